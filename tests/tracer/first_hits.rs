//! First hits behind the middle of each pixel, against single rays of the plain tracer, which share no code with the kernels
//! that find the objects. Colours are judged by a picture of the same scene whose surfaces give off the light that they
//! would send back.
//!
//! Scenes are random; a failure prints the seed. `RAYFOLD_SEED` sets another one.

use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use glam::DVec3;
use image::{DynamicImage, ImageFormat, Rgb, RgbImage};
use rayfold_scene::assets::{Library, MemoryFiles};
use rayfold_scene::model::{Finish, Glass, Pattern, Weight};
use rayfold_scene::{Camera, Coefficients, Depth, Limits, Material, Object, Scene, Screen, parse_with_files};
use rayfold_tracer::{FirstHit, RenderError, RenderOptions, first_hits, pixel_ray, reference};

use super::dice::Dice;
use super::hold::levels;

const SEED: u64 = 20_261_126;

/// The distance in pixels within which a rounding error may decide which object a ray hits.
const NEARBY: f64 = 1e-6;

/// Rays and objects that the plain tracer may compare for one scene: a few seconds.
const PAIRS: usize = 14_000_000;

/// The first hit that the plain tracer finds along a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Judged {
    object: u32,
    depth: f64,
    normal: DVec3,
}

/// Returns what a ray through column `i` and row `j` from the bottom hits.
fn judged(scene: &Scene, i: f64, j: f64) -> Judged {
    let (origin, direction) = pixel_ray(scene, i, j);
    let along = match &scene.camera {
        Camera::Orthographic => DVec3::NEG_Z,
        Camera::Pinhole(camera) => -camera.basis().2,
        Camera::Look(camera) => -camera.basis().2,
    };
    match reference::nearest(&scene.objects, origin, direction) {
        None => Judged { object: 0, depth: f64::INFINITY, normal: DVec3::ZERO },
        Some(hit) => Judged {
            object: hit.object as u32 + 1,
            depth: hit.distance * direction.dot(along),
            normal: hit.surface.normal,
        },
    }
}

fn hits(scene: &Scene) -> Vec<FirstHit> {
    first_hits(scene, &RenderOptions::default()).unwrap()
}

fn vector(v: [f32; 3]) -> DVec3 {
    DVec3::from_array(v.map(f64::from))
}

/// Compares all hits of a scene, or some that are spread over the picture, with the plain tracer. Returns how many were
/// compared and how many were too near to an outline to tell.
fn compare(name: &str, scene: &Scene) -> (usize, usize) {
    let found = hits(scene);
    let (width, height) = (scene.screen.width(), scene.screen.height());
    assert_eq!(found.len() as u64, scene.screen.pixels(), "{name}");
    let count: usize = scene.objects.iter().map(triangles_of).sum();
    let (mut compared, mut untold) = (0, 0);
    for (at, hit) in found.iter().enumerate().step_by((found.len() * 5 * count / PAIRS).max(1)) {
        let (i, j) = (at as u32 % width, height - 1 - at as u32 / width);
        let around = [(0.0, 0.0), (NEARBY, NEARBY), (-NEARBY, NEARBY), (NEARBY, -NEARBY), (-NEARBY, -NEARBY)];
        let judges = around.map(|(x, y)| judged(scene, f64::from(i) + x, f64::from(j) + y));
        let place = format!("{name}: pixel {i} {j}: {hit:?} {judges:?}");
        compared += 1;
        untold += usize::from(judges.iter().any(|judge| judge.object != judges[0].object));
        // Beside an outline or an edge, one of the rays is on the other side.
        let fits = |judge: &Judged| {
            let depth = if judge.object == 0 { judge.depth } else { judge.depth.min(f32::MAX.into()) };
            let far = (f64::from(hit.depth) - depth).abs();
            judge.object == hit.object
                && (hit.depth == f32::INFINITY && depth == f64::INFINITY || far <= 1e-6 * depth)
                && (is_smooth(scene, judge.object) || vector(hit.normal).distance(judge.normal) <= 1e-5)
        };
        assert!(judges.iter().any(fits), "{place}");
        let length = vector(hit.normal).length();
        let (_, direction) = pixel_ray(scene, i.into(), j.into());
        if hit.object == 0 {
            assert_eq!(*hit, FirstHit::NOTHING, "{place}");
        } else {
            assert!((length - 1.0).abs() < 1e-6 && vector(hit.normal).dot(direction) < 1e-6, "{place}");
            assert!(hit.albedo.iter().all(|share| (0.0..=1.0).contains(share)), "{place}");
        }
    }
    (compared, untold)
}

/// Returns the mesh that an object is, also in a group.
fn mesh(object: &Object) -> Option<&rayfold_scene::Mesh> {
    match object {
        Object::Mesh(mesh) => Some(mesh),
        Object::Instance(instance) => mesh(instance.object()),
        _ => None,
    }
}

fn triangles_of(object: &Object) -> usize {
    mesh(object).map_or(1, |mesh| mesh.model().triangle_count())
}

/// Returns whether an object, counted from 1, has normals of its own.
fn is_smooth(scene: &Scene, object: u32) -> bool {
    object > 0 && mesh(&scene.objects[object as usize - 1]).is_some_and(|mesh| mesh.model().has_normals())
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Returns a frame, counted from 1, of an example, in the size 96 x 72.
fn example(name: &str, file: &str, frame: usize) -> Scene {
    let folder = root().join("scenes").join(name);
    let mut files = MemoryFiles::default();
    for entry in fs::read_dir(&folder).unwrap() {
        let entry = entry.unwrap();
        files.insert(&entry.file_name().into_string().unwrap(), fs::read(entry.path()).unwrap());
    }
    let text = fs::read(folder.join(file)).unwrap();
    let parsed = parse_with_files(file, &text, &Limits::default(), &Library::new(files));
    let mut scene =
        parsed.script.unwrap_or_else(|| panic!("{file}: {:?}", parsed.diagnostics)).frame(frame - 1).unwrap();
    scene.screen = Screen::new(96, 72).unwrap();
    scene
}

#[test]
fn hits_of_the_examples_are_the_references() {
    let mut folders: Vec<_> =
        fs::read_dir(root().join("scenes")).unwrap().map(|entry| entry.unwrap()).collect();
    folders.retain(|entry| entry.file_type().unwrap().is_dir());
    assert_eq!(folders.len(), 19);
    let is_taken = super::one_in::one_in(3);
    for (_, folder) in folders.into_iter().enumerate().filter(|(k, _)| is_taken(*k)) {
        let name = folder.file_name().into_string().unwrap();
        let mut scripts: Vec<_> = fs::read_dir(folder.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .filter(|file| file.ends_with(".txt"))
            .collect();
        scripts.sort();
        let frame =
            if scripts.len() == 1 && !["room", "still", "neon"].contains(&name.as_str()) { 9 } else { 1 };
        let scene = example(&name, &scripts[scripts.len() / 2], frame);
        let (compared, untold) = compare(&name, &scene);
        println!("{name}: {compared} compared, {untold} beside outlines");
        assert!(compared >= 100 && untold * 50 <= compared, "{name}");
    }
}

/// Returns the material whose surface gives off, without any light, what the other would send back.
fn luminous(material: &Material) -> Material {
    let lit =
        |of: Coefficients| Coefficients::new(of.diffuse() + of.mirror(), DVec3::ZERO, DVec3::ZERO).unwrap();
    let Some(finish) = material.finish() else {
        return Material::finished(lit(material.coefficients()), Finish::default());
    };
    if finish.glass.is_some() {
        // It stays glass, which loses against what is not at the same place.
        let white = Coefficients::new(DVec3::ONE, DVec3::ZERO, DVec3::ZERO).unwrap();
        return Material::finished(white, Finish { glass: finish.glass, ..Finish::default() });
    }
    let pattern = finish.pattern.map(|pattern| Pattern { other: lit(pattern.other), ..pattern });
    Material::finished(lit(material.coefficients()), Finish { pattern, ..Finish::default() })
}

/// Compares the albedo in every pixel with the light of a scene whose surfaces are luminous.
fn compare_colors(name: &str, scene: &Scene, luminous: &Scene) {
    let (width, height) = (scene.screen.width(), scene.screen.height());
    let (mut wrong, found) = (0, hits(scene));
    for (at, hit) in found.iter().enumerate().filter(|(_, hit)| hit.object > 0) {
        let (i, j) = (at as u32 % width, height - 1 - at as u32 / width);
        let expected = reference::color(luminous, i, j).clamp(DVec3::ZERO, DVec3::ONE);
        wrong += usize::from(vector(hit.albedo).distance(expected) > 1e-5);
    }
    // Where two colours of a pattern meet.
    assert!(wrong * 500 <= found.len(), "{name}: {wrong} of {} colours", found.len());
}

impl Dice {
    fn surface(&mut self) -> Material {
        let own = self.material().coefficients();
        let other = self.material().coefficients();
        let size = self.within(0.2, 1.0);
        let weight = match self.0.u8(0..8) {
            0 => Some(Weight::Checker(size)),
            1 => Some(Weight::Stripes(size)),
            2 => Some(Weight::Noise(size)),
            3 => Some(Weight::Gradient(-size, 2.0 * size)),
            _ => None,
        };
        let glass = (self.0.u8(0..5) == 0).then(|| Glass::new(self.color(), self.within(1.0, 2.0)).unwrap());
        let pattern = weight.map(|weight| Pattern { weight, other });
        Material::finished(own, Finish { glass, pattern, ..Finish::default() })
    }
}

#[test]
fn hits_and_colours_of_random_scenes_are_the_references() {
    let mut dice = Dice::new("first hits", SEED);
    let (mut compared, mut untold) = (0, 0);
    for round in 0..40 {
        let (mut objects, mut lights) = (vec![], vec![]);
        for _ in 0..[0, 1, 3, 12, 40, 90, 150][round % 7] {
            let material = dice.surface();
            let before = dice.0.clone();
            objects.push(dice.any(material.clone()));
            dice.0 = before;
            lights.push(dice.any(luminous(&material)));
        }
        let before = dice.0.clone();
        let mut scene = dice.scene(objects);
        dice.0 = before;
        let mut luminous = dice.scene(lights);
        // Glass shows nothing of what is behind it.
        (luminous.lights, luminous.depth) = (Default::default(), Depth::new(0).unwrap());
        dice.add_lamps(&mut scene);
        let name = format!("round {round}");
        let (some, few) = compare(&name, &scene);
        (compared, untold) = (compared + some, untold + few);
        compare_colors(&name, &scene, &luminous);
    }
    println!("{compared} compared, {untold} beside outlines");
    assert!(untold * 100 <= compared);
}

/// The triangles of a ball of radius 1 with its normals, and colours at its vertices, as OBJ.
fn ball(with_colors: bool) -> Vec<u8> {
    let n = 8;
    let mut text = String::new();
    let point = |i: usize, j: usize| {
        let (around, down) =
            (i as f64 / n as f64 * std::f64::consts::PI, j as f64 / n as f64 * std::f64::consts::PI);
        DVec3::new(down.sin() * around.cos(), down.cos(), -down.sin() * around.sin())
    };
    for j in 0..=n {
        for i in 0..2 * n {
            let p = point(i, j);
            let c = 0.5 + 0.5 * p;
            let color = if with_colors { format!(" {} {} {}", c.x, c.y, c.z) } else { String::new() };
            text += &format!("v {} {} {}{color}\nvn {} {} {}\n", p.x, p.y, p.z, p.x, p.y, p.z);
        }
    }
    for j in 0..n {
        for i in 0..2 * n {
            let [a, b] = [i, (i + 1) % (2 * n)].map(|i| j * 2 * n + i + 1);
            let [c, d] = [a + 2 * n, b + 2 * n];
            text += &format!("f {a}//{a} {c}//{c} {d}//{d}\nf {a}//{a} {d}//{d} {b}//{b}\n");
        }
    }
    text.into_bytes()
}

fn scripted(text: &str) -> Scene {
    let image = RgbImage::from_fn(4, 2, |x, y| Rgb([x as u8 * 60, y as u8 * 200, 30]));
    let mut png = Cursor::new(Vec::new());
    DynamicImage::from(image).write_to(&mut png, ImageFormat::Png).unwrap();
    let files = MemoryFiles::from([
        ("ball.obj", ball(false)),
        ("colored.obj", ball(true)),
        ("small.png", png.into_inner()),
    ]);
    let parsed = parse_with_files("a.txt", text.as_bytes(), &Limits::default(), &Library::new(files));
    let script = parsed.script.unwrap_or_else(|| panic!("{text}\n{:?}", parsed.diagnostics));
    script.frame(0).unwrap()
}

#[test]
fn colours_of_pictures_groups_and_vertices_are_those_of_surfaces_that_give_off_light() {
    for tone in ["", "Tone srgb\n"] {
        let of = |lit: bool| {
            // Where it is lit, the ambient coefficient is what diffuse and mirror coefficient together are.
            let made = |diffuse: f64, mirror: f64| match lit {
                true => format!("ambient {0} {0} {0}", diffuse + mirror),
                false => format!(
                    "ambient .3 .3 .3 diffuse {diffuse} {diffuse} {diffuse} mirror {mirror} {mirror} {mirror}"
                ),
            };
            scripted(&format!(
                "Screen 90 60\n{tone}Look 0 3 9 0 0 0 40\nMaterial flat {} image \"small.png\" flat 2 xz\nMaterial round {} image \
                 \"small.png\" ball\nMaterial own {} own\nMaterial other {}\nMaterial checks {} checker .4 other\nGroup g\nSphere \
                 .9 0 0 0 round\nBox .9 0 0 1.6 .7 .7 checks\nEnd\nPlane 0 -1 0 0 1 0 flat\nUse g -2.5 0 0 40 10 0 .7\nUse g \
                 2 0 -1 20 0 0 1.2\nGroup m\nMesh \"colored.obj\" own\nEnd\nUse m 0 0 1.5 0 0 0 .8\nTrace\n",
                made(0.7, 0.0),
                made(0.6, 0.0),
                made(0.9, 0.0),
                made(0.2, 0.3),
                made(0.5, 0.25),
            ))
        };
        let scene = of(false);
        compare(tone, &scene);
        compare_colors(tone, &scene, &of(true));
        let seen: std::collections::BTreeSet<u32> = hits(&scene).iter().map(|hit| hit.object).collect();
        assert_eq!(
            seen.len(),
            scene.objects.len() + 1,
            "all of {} objects, and nothing",
            scene.objects.len()
        );
    }
}

#[test]
fn normals_of_a_smooth_ball_are_means_of_those_at_its_corners() {
    for (lines, middle, size) in [
        ("Mesh \"ball.obj\"", DVec3::ZERO, 1.0),
        ("Group g\nMesh \"ball.obj\"\nEnd\nUse g 1 .5 0 0 0 0 1.5", DVec3::new(1.0, 0.5, 0.0), 1.5),
    ] {
        let scene = scripted(&format!("Screen 64 64\nLook 3 2 9 0 0 0 30\n{lines}\nTrace\n"));
        let mesh = mesh(&scene.objects[0]).unwrap();
        let mut seen = 0;
        for (at, hit) in hits(&scene).iter().enumerate() {
            let (origin, direction) =
                pixel_ray(&scene, f64::from(at as u32 % 64), 63.0 - f64::from(at as u32 / 64));
            if hit.object == 0 {
                continue;
            }
            seen += 1;
            let eye = (origin - middle) / size;
            // The first triangle that the ray meets from outside, by Cramer's rule.
            let met = (0..mesh.model().triangle_count()).filter_map(|k| {
                let [a, b, c] = mesh.model().corners(k);
                let (u, v, back) = (b - a, c - a, -direction);
                let volume = u.cross(v).dot(back);
                let part = |x: DVec3, y: DVec3, z: DVec3| x.cross(y).dot(z) / volume;
                let from = eye - a;
                let (s, t, far) = (part(from, v, back), part(u, from, back), part(u, v, from));
                let is_inside = s >= -1e-9 && t >= -1e-9 && s + t <= 1.0 + 1e-9;
                // A corner of the ball is its normal.
                (is_inside && volume != 0.0).then(|| (far, ((1.0 - s - t) * a + s * b + t * c).normalize()))
            });
            let (_, expected) = met.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
            let (facing, normal) = (expected.dot(direction) < 0.0, vector(hit.normal));
            assert!(!facing || normal.distance(expected) < 1e-6, "{hit:?} {expected}");
        }
        assert!(seen > 400, "{seen}");
    }
}

const STAGE: &str = "Sphere 1 0 .5 0  .1 .1 .1  .5 .4 .3\nBox 1 -1 -1  2 0 1  .1 .1 .1  .2 .4 .9\n";

#[test]
fn depth_counts_along_the_view_axis_and_is_finite_on_an_endless_plane() {
    let scene =
        scripted("Screen 40 31\nLook 0 1 0  0 1 -5  60\nPlane 0 0 0  0 1 0  0 0 0  .5 .5 .5\nTrace\n");
    for (at, hit) in hits(&scene).iter().enumerate() {
        let (i, j) = (f64::from(at as u32 % 40), 30.0 - f64::from(at as u32 / 40));
        let (_, direction) = pixel_ray(&scene, i, j);
        if j >= 15.0 {
            assert_eq!(*hit, FirstHit::NOTHING, "at the horizon and over it");
        } else {
            let expected = direction.z / direction.y;
            assert!((f64::from(hit.depth) - expected).abs() < 1e-6 * expected, "{i} {j}: {hit:?}");
            assert_eq!((hit.normal, hit.object, hit.albedo), ([0.0, 1.0, 0.0], 1, [0.5; 3]));
        }
    }
    // A wall across the view is equally far everywhere.
    let wall = scripted("Screen 40 30\nLook 0 0 8 0 0 0 90\nPlane 0 0 0  0 0 1  0 0 0  .5 .5 .5\nTrace\n");
    assert!(hits(&wall).iter().all(|hit| (hit.depth - 8.0).abs() < 2e-6));
}

#[test]
fn neither_lens_nor_shutter_samples_fog_nor_light_changes_a_hit() {
    let plain = format!("Screen 50 40\nLook 0 2 9 0 0 0 30\n{STAGE}Trace\n");
    let settings = "Samples 16\nShutter .5\nLens .3\nFog .5 .5 .5 6\nBackground none\nIlight 1 1 1 0 -1 0 5\nTone srgb\nDepth 3\n";
    assert_eq!(hits(&scripted(&plain)), hits(&scripted(&format!("{settings}{plain}"))));
}

#[test]
fn hits_do_not_depend_on_threads_widths_and_trees() {
    let mut dice = Dice::new("threads", SEED);
    for count in [5, 60, 200] {
        let objects = (0..count).map(|_| {
            let material = dice.surface();
            dice.any(material)
        });
        let objects = objects.collect();
        let scene = dice.scene(objects);
        let expected = hits(&scene);
        for threads in [1, 2, 7] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            assert!(pool.install(|| hits(&scene)) == expected, "{threads} threads");
        }
        let changed = |options: RenderOptions| {
            let found = first_hits(&scene, &options).unwrap();
            found.iter().zip(&expected).filter(|(a, b)| a != b).count()
        };
        for (name, level) in levels() {
            let differ = changed(RenderOptions { level: Some(level), ..Default::default() });
            // Without fused products, an outline may be rounded to the other side.
            let few = if name == "SSE4.2" { expected.len() / 1000 } else { 0 };
            assert!(differ <= few, "{name}: {differ}");
        }
        for tree in [true, false] {
            assert_eq!(changed(RenderOptions { tree: Some(tree), ..Default::default() }), 0);
        }
    }
}

#[test]
fn what_no_kernel_can_hold_is_the_references() {
    // The eye is in the surface of a torus, and lengths are beyond what kernels square.
    for lines in [
        "Look 0 0 1.5 0 0 -5 60\nTorus 1 .5  0 0 0  0 1 0  .1 .1 .1  .5 .4 .3\n",
        "Look 0 0 1e200 0 0 0 60\nSphere 1e199 0 0 0  .1 .1 .1  .5 .4 .3\nSphere 1 0 0 9e199  0 0 0  .1 .1 .1\n",
    ] {
        let scene = scripted(&format!("Screen 30 20\n{lines}{STAGE}Trace\n"));
        compare(lines, &scene);
        assert!(hits(&scene).iter().any(|hit| hit.object == 1), "{lines}");
    }
}

#[test]
fn hits_can_be_cancelled() {
    let flag = AtomicBool::new(true);
    let options = RenderOptions { cancel: Some(&flag), ..Default::default() };
    let scene = scripted(&format!("Screen 50 40\nLook 0 2 9 0 0 0 30\n{STAGE}Trace\n"));
    assert!(matches!(first_hits(&scene, &options), Err(RenderError::Cancelled)));
}
