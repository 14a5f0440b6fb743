//! Images of scenes that are moved, scaled, and lit so that wrong shadows are likely.

use anyhow::Result;
use glam::DVec3;
use image::RgbImage;
use rayfold_scene::{Cuboid, Light, Material, Object, Scene, Screen, Sphere, Tone, Triangle, model::unit};
use rayon::prelude::*;

use super::figures::{Figures, Size};
use crate::backends::{Backend, reference};
use crate::oracle;
use crate::scenes::{icosphere, light, looking_at, moved, single, table};

/// Returns the number of pixels that differ by more than `levels` in a channel.
pub(super) fn off_by_more_than(levels: u8, a: &RgbImage, b: &RgbImage) -> usize {
    let off =
        |(p, q): (&image::Rgb<u8>, &image::Rgb<u8>)| p.0.iter().zip(q.0).any(|(p, q)| p.abs_diff(q) > levels);
    a.pixels().zip(b.pixels()).filter(|&pair| off(pair)).count()
}

/// Returns the number of pixels that may be wrong: 0.05 % of all.
fn few(image: &RgbImage) -> f64 {
    0.0005 * f64::from(image.width() * image.height())
}

/// Checks that the images of scaled scenes are equal bit for bit.
pub(super) fn scaled_by_two(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    let side = size.pick(96, 384);
    let scene = table(side, side)?;
    for backend in backends {
        let image = backend.render(&scene)?;
        let mut different = 0;
        let exponents = size.pick(vec![-20, -7, -1, 3, 20], (-20..=20).collect());
        for &exponent in &exponents {
            let other = backend.render(&moved(&scene, 2f64.powi(exponent), DVec3::ZERO)?)?;
            different += off_by_more_than(0, &image, &other);
        }
        let pixels = exponents.len() * image.pixels().len();
        figures.add(backend, "pixels that differ at all", pixels, different as f64, 0.0);
    }
    Ok(())
}

/// Checks that the images of scaled scenes are equal except for rounding.
pub(super) fn scaled_by_ten(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    let side = size.pick(96, 384);
    let scene = table(side, side)?;
    for backend in backends {
        let image = backend.render(&scene)?;
        let mut worst = 0;
        for exponent in size.pick(vec![-6, -1, 3, 6], (-6..=6).collect()) {
            let other = backend.render(&moved(&scene, 10f64.powi(exponent), DVec3::ZERO)?)?;
            worst = worst.max(off_by_more_than(2, &image, &other));
        }
        figures.add(backend, "pixels off by > 2 levels", image.pixels().len(), worst as f64, few(&image));
    }
    Ok(())
}

/// Checks that the images of moved scenes are equal except for the rounding of positions.
pub(super) fn far_from_the_origin(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    let side = size.pick(96, 384);
    let scene = moved(&table(side, side)?, 0.1, DVec3::ZERO)?;
    for backend in backends {
        let image = backend.render(&scene)?;
        for offset in [DVec3::new(1e6, 0.0, 0.0), DVec3::new(-1e6, 1e6, 1e6)] {
            let other = backend.render(&moved(&scene, 1.0, offset)?)?;
            let off = off_by_more_than(2, &image, &other);
            let what = format!("pixels off by > 2 levels, at {offset}");
            figures.add(backend, what, image.pixels().len(), off as f64, few(&image));
        }
    }
    Ok(())
}

fn matte() -> Result<Material> {
    Ok(Material::new(DVec3::splat(0.1), DVec3::splat(0.8), DVec3::ZERO)?)
}

/// Returns the material and the normal at each pixel. The value is `None` on the background and at outlines, where a
/// backend that rounds may see a neighbour.
fn visible(scene: &Scene) -> Vec<Option<(Material, DVec3)>> {
    let (width, height) = (scene.screen.width(), scene.screen.height());
    let hits: Vec<_> = (0..width * height)
        .into_par_iter()
        .map(|k| oracle::first_hit(scene, k % width, height - 1 - k / width))
        .collect();
    let object = |k: usize| hits.get(k).and_then(|hit| hit.as_ref().map(|&(object, _)| object));
    hits.iter()
        .enumerate()
        .map(|(k, hit)| {
            let row = width as usize;
            let neighbours = [k.wrapping_sub(1), k + 1, k.wrapping_sub(row), k + row];
            let inner = neighbours.iter().all(|&n| object(n) == object(k));
            hit.filter(|_| inner).map(|(object, normal)| (scene.objects[object].material().clone(), normal))
        })
        .collect()
}

/// Returns the colours of a convex body in these lights. No point that faces a light can be in its own shadow.
fn without_shadows(visible: &[Option<(Material, DVec3)>], lights: &[Light]) -> Vec<Option<[u8; 3]>> {
    let shaded = |(material, normal): &(Material, DVec3)| {
        let color = lights.iter().fold(material.ambient(), |sum, light| {
            let Light::Directional(light) = light else { unreachable!("only suns light these bodies") };
            let cosine = normal.dot(-unit(light.direction())).max(0.0);
            sum + light.color() * material.diffuse() * cosine
        });
        oracle::levels(Tone::Plain, color)
    };
    visible.iter().map(|seen| seen.as_ref().map(shaded)).collect()
}

/// Returns the number of pixels that are darker or brighter than an unshadowed surface by more than 2 levels.
fn speckles(image: &RgbImage, expected: &[Option<[u8; 3]>]) -> usize {
    let off = |(pixel, expected): (&image::Rgb<u8>, &Option<[u8; 3]>)| {
        expected.is_some_and(|e| pixel.0.iter().zip(e).any(|(p, e)| p.abs_diff(e) > 2))
    };
    image.pixels().zip(expected).filter(|&pair| off(pair)).count()
}

/// Measures convex bodies, lit from the side, small and large, near the origin and far from it.
pub(super) fn acne(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    let surface = matte()?;
    let corners = [[1.0, 1.0, 1.0], [-1.0, -1.0, 1.0], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0]].map(DVec3::from);
    let tetrahedron = (0..4)
        .map(|k| {
            Triangle::new([1, 2, 3].map(|n| corners[(k + n) % 4]), surface.clone()).map(Object::Triangle)
        })
        .collect::<Result<Vec<_>, _>>()?;
    let bodies = [
        vec![Object::Sphere(Sphere::new(1.0, DVec3::ZERO, surface.clone())?)],
        vec![Object::Cuboid(Cuboid::new([DVec3::splat(-0.8), DVec3::splat(0.8)], surface.clone())?)],
        tetrahedron,
    ];
    let side = size.pick(32, 256);
    let mut scenes = Vec::new();
    for objects in bodies {
        let screen = Screen::new(side, side)?;
        let mut scene = Scene::new(screen, looking_at(DVec3::new(2.0, 1.5, 4.0), DVec3::ZERO, 0.6, screen)?);
        scene.objects = objects.into();
        scene.lights = vec![light(0.9, [-1.0, -1.0, -0.2])?, light(0.3, [0.9, 0.1, -0.01])?].into();
        for scale in size.pick(vec![1e-3, 1.0, 1e3], vec![1e-3, 1e-2, 1e-1, 1.0, 1e1, 1e2, 1e3]) {
            for offset in [DVec3::ZERO, DVec3::new(100.0, -50.0, 70.0) * scale] {
                let scene = moved(&scene, scale, offset)?;
                let expected = without_shadows(&visible(&scene), &scene.lights);
                scenes.push((scene, expected));
            }
        }
    }
    for backend in backends {
        let mut spots = 0;
        for (scene, expected) in &scenes {
            spots += speckles(&backend.render(scene)?, expected);
        }
        let pixels = scenes.iter().map(|(_, expected)| expected.iter().flatten().count()).sum();
        figures.add(backend, "acne pixels", pixels, spots as f64, 0.0);
    }
    Ok(())
}

/// Measures a coarse mesh in light that is almost parallel to its facets.
pub(super) fn grazing_light(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    let surface = matte()?;
    let side = size.pick(48, 384);
    let screen = Screen::new(side, side)?;
    let mut scene = Scene::new(screen, looking_at(DVec3::new(0.3, 0.4, 4.0), DVec3::ZERO, 0.6, screen)?);
    scene.objects = icosphere(80)
        .into_iter()
        .map(|face| Triangle::new(face.map(single), surface.clone()).map(Object::Triangle))
        .collect::<Result<Vec<_>, _>>()?
        .into();
    let lights = [[-1.0, 0.0, 0.0], [0.3, -1.0, 0.05], [-1.0, 0.0, 0.35]];
    let visible = visible(&scene);
    let mut scenes = Vec::new();
    for direction in lights {
        scene.lights = vec![light(0.9, direction)?].into();
        scenes.push((scene.clone(), without_shadows(&visible, &scene.lights)));
    }
    for backend in backends {
        let mut spots = 0;
        for (scene, expected) in &scenes {
            spots += speckles(&backend.render(scene)?, expected);
        }
        let pixels = scenes.iter().map(|(_, expected)| expected.iter().flatten().count()).sum();
        figures.add(backend, "pixels off flat shading by > 2 levels", pixels, spots as f64, 0.0);
    }
    Ok(())
}

/// Measures bodies that hover over a floor by 1e-4 of their size. Counts pixels of light that leaks in under them, more
/// than a pixel from the end of the shadow according to the oracle.
pub(super) fn contact_shadow(backends: &[Backend], size: Size, figures: &mut Figures) -> Result<()> {
    let surface = matte()?;
    let side = size.pick(64, 384);
    let screen = Screen::new(side, side)?;
    let floor = Cuboid::new([DVec3::new(-4.0, -1.0, -4.0), DVec3::new(4.0, 0.0, 4.0)], surface.clone())?;
    let hovering = Cuboid::new([DVec3::new(-0.5, 1e-4, -0.5), DVec3::new(0.5, 1.0, 0.5)], surface.clone())?;
    let ball = Sphere::new(0.5, DVec3::new(1.5, 0.5 + 1e-4, 0.0), surface.clone())?;
    let mut scene = Scene::new(screen, looking_at(DVec3::new(0.7, 1.2, 3.0), DVec3::X * 0.7, 0.9, screen)?);
    scene.objects = vec![Object::Cuboid(floor), Object::Cuboid(hovering), Object::Sphere(ball)].into();
    scene.lights = vec![light(0.9, [-0.5, -1.0, -0.7])?].into();
    let truth = oracle::image(&scene);
    anyhow::ensure!(off_by_more_than(2, &truth, &reference().render(&scene)?) <= truth.pixels().len() / 100);
    for backend in backends {
        let image = backend.render(&scene)?;
        let alike =
            |p: image::Rgb<u8>, q: image::Rgb<u8>| p.0.iter().zip(q.0).all(|(p, q)| p.abs_diff(q) <= 3);
        let leaks = image.enumerate_pixels().filter(|&(x, y, &pixel)| {
            let around = |d: i32, at: u32| at.checked_add_signed(d).filter(|&at| at < side);
            let known = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (dx, dy))).any(|(dx, dy)| {
                let (Some(x), Some(y)) = (around(dx, x), around(dy, y)) else { return false };
                alike(*truth.get_pixel(x, y), pixel)
            });
            !known
        });
        figures.add(
            backend,
            "pixels of no colour within a pixel of the oracle's",
            truth.pixels().len(),
            leaks.count() as f64,
            0.0,
        );
    }
    Ok(())
}
