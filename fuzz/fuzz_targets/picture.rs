//! Any bytes as the file of a picture.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rayfold_scene::assets::{Library, MemoryFiles, Purpose};

fuzz_target!(|bytes: &[u8]| {
    let library = Library::new(MemoryFiles::from([("picture", bytes.to_vec())]));
    let Ok(picture) = library.picture("picture", Purpose::Sky) else { return };
    assert!(picture.width() > 0 && picture.height() > 0, "a picture has a pixel");
    for row in 0..picture.height().min(64) {
        for column in 0..picture.width().min(64) {
            let level = picture.level(column, row, true);
            assert!(level.is_finite() && level.min_element() >= 0.0);
            assert!(picture.is_light() || picture.factor(column, row, false).max_element() <= 1.0);
        }
    }
});
