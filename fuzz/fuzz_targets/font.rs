//! Any bytes as the file of a font.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rayfold_scene::assets::{Align, Closure, Lettering, Library, MemoryFiles};

fuzz_target!(|bytes: &[u8]| {
    let library = Library::new(MemoryFiles::from([("font", bytes.to_vec())]));
    for text in ["AVfi\u{e9}%&8", "\u{5d0}\u{633}\u{644}a\n\u{915}\u{94d}\u{937}"] {
        let font = Some("font".to_string());
        let lettering = Lettering { text: text.into(), size: 1.0, depth: 0.25, align: Align::Center, font };
        let Ok(Some(model)) = library.letters(&lettering) else { continue };
        for triangle in 0..model.triangle_count() {
            assert!(model.corners(triangle).iter().all(|p| p.is_finite()));
            assert!(model.normals(triangle).is_none_or(|normals| normals.iter().all(|n| n.is_finite())));
        }
        assert!(matches!(model.closure(), Closure::Closed | Closure::NoVolume));
    }
});
