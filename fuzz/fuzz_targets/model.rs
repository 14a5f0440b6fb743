//! Any bytes as the file of a model.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rayfold_scene::assets::{Library, MemoryFiles, Smoothing};

fuzz_target!(|bytes: &[u8]| {
    let files = MemoryFiles::from([("model", bytes.to_vec()), ("other", b"newmtl a\nKd 1 .5 0\n".to_vec())]);
    let library = Library::new(files);
    for smoothing in [Smoothing::OfFile, Smoothing::Within(40.0), Smoothing::Flat] {
        let Ok(model) = library.model("model", smoothing) else { return };
        assert!(model.triangle_count() > 0, "a model has a triangle");
        for triangle in 0..model.triangle_count() {
            assert!(model.corners(triangle).iter().all(|p| p.is_finite()));
            assert!(model.normals(triangle).is_none_or(|normals| normals.iter().all(|n| n.is_finite())));
            let color = model.color(triangle, [0.5, 0.25, 0.25], false);
            assert!(color.min_element() >= 0.0 && color.max_element() <= 1.0);
        }
        let _ = model.closure();
    }
});
