//! Any bytes as the file of a model.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rayfold_scene::assets::{Library, MemoryFiles, Slot, Smoothing};

/// A picture of one pixel, light grey and half transparent.
const PICTURE: &[u8] = b"\x89PNG\x0d\x0a\x1a\x0a\x00\x00\x00\x0dIHDR\x00\x00\x00\x01\x00\x00\x00\x01\x08\x04\x00\x00\x00\xb5\x1c\x0c\x02\x00\x00\x00\x0bIDATx\xdac8\xd1\x00\x00\x02\x13\x01I\xfc\xfbr\xfb\x00\x00\x00\x00IEND\xaeB`\x82";

fuzz_target!(|bytes: &[u8]| {
    let files = MemoryFiles::from([
        ("model", bytes.to_vec()),
        ("other", b"newmtl a\nKd 1 .5 0\nmap_Kd picture\n".to_vec()),
        ("picture", PICTURE.to_vec()),
    ]);
    let library = Library::new(files);
    for smoothing in [Smoothing::OfFile, Smoothing::Within(40.0), Smoothing::Flat] {
        let Ok(model) = library.model("model", smoothing) else { return };
        assert!(model.triangle_count() > 0, "a model has a triangle");
        for triangle in 0..model.triangle_count() {
            assert!(model.corners(triangle).iter().all(|p| p.is_finite()));
            assert!(model.normals(triangle).is_none_or(|normals| normals.iter().all(|n| n.is_finite())));
            let mut level = model.corners(triangle)[0] * 0.0 + 1.0;
            let look = &model.looks()[model.look(triangle)];
            if let Some(texture) = look.texture(Slot::Color) {
                assert!(model.picture_uvs(triangle, Slot::Color).iter().all(|uv| uv.is_finite()));
                level = texture.picture().level(0, 0, model.decodes_pictures(false));
            }
            let color = model.color(triangle, [0.5, 0.25, 0.25], level, false);
            assert!(color.min_element() >= 0.0 && color.max_element() <= 1.0);
            assert!(model.vertex_alphas(triangle).iter().all(|alpha| alpha.is_finite()));
        }
        let _ = model.closure();
    }
});
