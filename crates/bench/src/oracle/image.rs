//! The factors of pictures on surfaces. They have an error of some roundoffs of `f64`.

use std::f64::consts::PI;

use glam::DVec3;
use rayfold_scene::{Axes, ImageMap, Object};

use super::hit::Hit;
use super::line::Line;
use super::shapes;
use super::sky::interpolated;

/// Returns the factor of ambient and diffuse, if the object has a picture. `place` is the hit in the coordinates of the
/// object's numbers; `linear` is whether colours are linear light.
pub(super) fn factor(object: &Object, place: &DVec3, line: &Line, hit: &Hit, linear: bool) -> Option<DVec3> {
    let image = object.material().finish()?.image.as_ref()?;
    let picture = image.file().picture();
    let inner = match object {
        Object::Instance(instance) => instance.object(),
        object => object,
    };
    let (at, repeats_down) = match image.map() {
        ImageMap::Flat(width, axes) => {
            let [right, up] = match axes {
                Axes::Xy => [place.x, place.y],
                Axes::Xz => [place.x, -place.z],
                Axes::Zy => [place.z, place.y],
            };
            let height = width * f64::from(picture.height()) / f64::from(picture.width());
            ([right / width, -up / height], true)
        }
        ImageMap::Ball => {
            let center = if let Object::Sphere(ball) = inner { ball.center() } else { DVec3::ZERO };
            let direction = (*place - center).normalize_or(DVec3::Y);
            let (longitude, latitude) = (direction.x.atan2(direction.z), direction.y.clamp(-1.0, 1.0).asin());
            ([0.5 + longitude / (2.0 * PI), 0.5 - latitude / PI], false)
        }
        ImageMap::Uv => {
            let ([u, v], from_top) = shapes::texture(object, line, hit)?;
            ([u, if from_top { v } else { -v }], true)
        }
    };
    Some(interpolated(picture, at, repeats_down, |column, row| picture.factor(column, row, linear)))
}

#[cfg(test)]
pub(super) mod tests {
    use rayfold_scene::assets::{Library, MemoryFiles};
    use rayfold_scene::{Limits, parse_with_files};
    use rayfold_tracer::reference;

    use crate::oracle;

    /// A square with texture coordinates that go beyond a picture, in the two formats.
    const OBJ: &[u8] =
        b"v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt -.3 .1\nvt 1.4 .2\nvt 1.2 1.7\nvt .1 .9\n\
        f 1/1 2/2 3/3 4/4\n";
    const PLY: &[u8] = b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float \
        z\nproperty float u\nproperty float v\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n-1 -1 0 0 0\n1 \
        -1 0 1 0\n0 1 0 .5 1\n3 0 1 2\n";

    /// A PNG with alpha, 5 x 3 pixels.
    pub(in crate::oracle) fn png() -> Vec<u8> {
        let level = |k: u32| (k * 97 % 256) as u8;
        let picture = ::image::RgbaImage::from_fn(5, 3, |x, y| {
            let k = x + 5 * y;
            ::image::Rgba([level(k), level(k + 3), level(2 * k), 255 - level(3 * k) / 2])
        });
        let mut bytes = std::io::Cursor::new(Vec::new());
        picture.write_to(&mut bytes, ::image::ImageFormat::Png).unwrap();
        bytes.into_inner()
    }

    #[test]
    fn the_reference_places_pictures_like_the_oracle() {
        let library = Library::new(MemoryFiles::from([
            ("a.png", png()),
            ("a.obj", OBJ.to_vec()),
            ("a.ply", PLY.to_vec()),
        ]));
        let stage = "Look 1 1.5 5 .013 .1 0 34\nIlight .8 .8 .7 -1 -2 -1\nMaterial chrome mirror .8 .8 .8\n";
        let on = |way: &str, object: &str| {
            format!("Material m ambient .3 .4 .5 diffuse .5 .6 .5 image \"a.png\" {way}\n{object} m\n")
        };
        let grouped = |line: String| {
            let (material, object) = line.split_once('\n').unwrap();
            format!("{material}\nGroup g\n{object}End\nUse g .1 .2 -.3 10 20 30 .8\n")
        };
        let mut scenes = vec![
            on("ball", "Sphere 1 .3 .1 0"),
            on("ball", "Box -1 -1 -1 1 1 1"),
            on("flat .7", "Sphere 1 .3 .1 0"),
            on("flat 1.1 xz", "Plane 0 -.5 0 0 1 0"),
            on("flat .9 zy", "Torus .8 .3 0 0 0 .2 1 .1"),
            on("uv", "Mesh \"a.obj\""),
            on("uv", "Mesh \"a.ply\""),
            on("ball", "Mesh \"a.obj\""),
        ];
        scenes.extend(scenes.clone().into_iter().map(grouped));
        scenes.push("Sky \"a.png\" .8 25\nSphere 1 0 0 0 chrome\n".into());
        scenes.push("Sky .5 3 1 2 0 .5\nSphere 1 0 0 0 chrome\n".into());
        for (lines, tone) in scenes.iter().flat_map(|lines| ["plain", "srgb"].map(|tone| (lines, tone))) {
            let text = format!("Screen 13 11\nTone {tone}\n{stage}{lines}Trace");
            let parsed = parse_with_files("a.txt", text.as_bytes(), &Limits::default(), &library);
            let script = parsed.script.unwrap_or_else(|| panic!("{text}\n{:?}", parsed.diagnostics));
            let scene = script.frame(0).unwrap();
            let plain = reference::render(&scene, &Default::default()).unwrap();
            let mut off = 0;
            for (i, j) in (0..13).flat_map(|i| (0..11).map(move |j| (i, j))) {
                let seen = oracle::levels(scene.tone, oracle::color(&scene, i, j));
                let is_off = seen.iter().zip(plain.get_pixel(i, 10 - j).0).any(|(a, b)| a.abs_diff(b) > 1);
                off += usize::from(is_off);
            }
            assert!(off <= 1, "{off} pixels of {text}");
        }
    }
}
