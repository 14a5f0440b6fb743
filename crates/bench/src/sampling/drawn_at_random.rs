//! Random patterned floors, and random scenes with all features of the language.

use std::fmt::Write as _;

use fastrand::Rng;

fn within(dice: &mut Rng, from: f64, to: f64) -> f64 {
    from + (to - from) * dice.f64()
}

fn color(dice: &mut Rng, from: f64, to: f64) -> String {
    let [r, g, b] = [(); 3].map(|()| within(dice, from, to));
    format!("{r:.3} {g:.3} {b:.3}")
}

/// Returns a checkered or striped floor to the horizon, often seen through a lens, lit by a sun with or without an
/// extent, with or without balls.
pub(super) fn floor(dice: &mut Rng, (width, height): (u32, u32)) -> String {
    let mut text = format!("Screen {width} {height}\nTone srgb\nBackground {}\n", color(dice, 0.2, 0.9));
    let (up, x, y, angle) =
        (within(dice, 0.6, 2.0), within(dice, -1.0, 1.0), within(dice, 0.2, 0.9), within(dice, 35.0, 65.0));
    let _ = writeln!(text, "Look 0 {up:.3} 5  {x:.3} {y:.3} 0  {angle:.1}");
    if dice.bool() {
        let _ = writeln!(text, "Lens {:.3} {:.2}", within(dice, 0.01, 0.06), within(dice, 3.0, 8.0));
    }
    let pattern = if dice.bool() { "checker" } else { "stripes" };
    let (dark, bright, size) = (color(dice, 0.0, 0.4), color(dice, 0.4, 1.0), within(dice, 0.1, 1.0));
    let _ = writeln!(text, "Material dark ambient .02 .02 .03 diffuse {dark}");
    let _ = writeln!(text, "Material tiles ambient .1 .1 .1 diffuse {bright} {pattern} {size:.3} dark");
    let (x, z, sun) = (within(dice, -1.0, 1.0), within(dice, -1.0, 0.0), within(dice, 0.0, 8.0));
    let _ = writeln!(text, "Plane 0 0 0 0 1 0 tiles\nIlight .8 .8 .7  {x:.2} -1 {z:.2} {sun:.2}");
    for _ in 0..dice.u32(0..5) {
        let (r, x, z) = (within(dice, 0.2, 0.7), within(dice, -2.0, 2.0), within(dice, -3.0, 1.0));
        let _ =
            writeln!(text, "Sphere {r:.3} {x:.3} {r:.3} {z:.3} .1 .1 .1 {} .2 .2 .2", color(dice, 0.2, 0.9));
    }
    text + "Trace\n"
}

const MATERIALS: &str = "Material dark ambient .05 .05 .1 diffuse .1 .1 .2\nMaterial pane glass .9 .95 .9 1.5\n\
                         Material shiny ambient .05 .05 .05 diffuse .5 .3 .2 shine .6 .6 .6 60\n\
                         Material tile ambient .1 .1 .1 diffuse .7 .7 .7 checker .25 dark\n\
                         Material wood ambient .1 .05 0 diffuse .6 .4 .2 noise .15 dark\n";

/// Returns objects of all shapes and materials on a floor, with any of lens, soft sun, lamp and `Tone srgb`.
pub(super) fn scene(dice: &mut Rng, (width, height): (u32, u32)) -> String {
    let mut text = format!("Screen {width} {height}\n{MATERIALS}");
    if dice.bool() {
        text.push_str("Tone srgb\n");
    }
    let (x, y) = (within(dice, -2.0, 2.0), within(dice, 0.6, 3.0));
    let (to, up, angle) = (within(dice, -1.0, 1.0), within(dice, 0.2, 0.9), within(dice, 30.0, 55.0));
    let _ = writeln!(
        text,
        "Background {}\nLook {x:.2} {y:.2} 7  {to:.2} {up:.2} 0  {angle:.1}",
        color(dice, 0.2, 0.9)
    );
    if dice.u8(0..5) < 2 {
        let _ = writeln!(text, "Lens {:.3} {:.2}", within(dice, 0.01, 0.1), within(dice, 4.0, 9.0));
    }
    let floor = ["tile", "wood", ".1 .1 .1 .5 .5 .5"][dice.usize(0..3)];
    let (x, z, sun) = (within(dice, -1.0, 1.0), within(dice, -1.0, 0.0), [0, 4, 9][dice.usize(0..3)]);
    let _ = writeln!(text, "Plane 0 0 0 0 1 0 {floor}\nIlight .7 .7 .7  {x:.2} -1 {z:.2} {sun}");
    if dice.bool() {
        let (x, y, z) = (within(dice, -3.0, 3.0), within(dice, 2.0, 4.0), within(dice, 0.0, 3.0));
        let _ = writeln!(text, "Plight .6 .5 .4  {x:.2} {y:.2} {z:.2} {}", [0.0, 0.4][dice.usize(0..2)]);
    }
    for _ in 0..dice.u32(4..15) {
        let material = match dice.u8(0..6) {
            0 => "shiny".to_owned(),
            1 => "tile".to_owned(),
            2 => "wood".to_owned(),
            3 => "pane".to_owned(),
            4 => ".05 .05 .05 .2 .2 .2 .6 .6 .6".to_owned(),
            _ => format!(".05 .05 .05 {}", color(dice, 0.1, 0.9)),
        };
        let (x, z, r) = (within(dice, -3.0, 3.0), within(dice, -5.0, 2.0), within(dice, 0.15, 0.8));
        let (h, aside) = (within(dice, 0.2, 1.8), within(dice, -0.5, 0.5));
        let _ = match dice.u8(0..6) {
            0 => writeln!(text, "Sphere {r:.3} {x:.3} {r:.3} {z:.3} {material}"),
            1 => writeln!(text, "Box {x:.3} 0 {z:.3} {:.3} {h:.3} {:.3} {material}", x + r, z + r),
            2 => writeln!(
                text,
                "Cylinder {:.3} {x:.3} 0 {z:.3} {:.3} {h:.3} {z:.3} {material}",
                r / 2.0,
                x + aside
            ),
            3 => writeln!(
                text,
                "Torus {r:.3} {:.3} {x:.3} {h:.3} {z:.3} {aside:.2} 1 .3 {material}",
                r * within(dice, 0.1, 0.5)
            ),
            4 => writeln!(text, "Cone {:.3} 0 {x:.3} 0 {z:.3} {x:.3} {h:.3} {z:.3} {material}", r / 2.0),
            _ => writeln!(
                text,
                "Triangle {x:.3} 0 {z:.3} {:.3} 0 {:.3} {:.3} {h:.3} {z:.3} {material}",
                x + r,
                z + aside,
                x + aside
            ),
        };
    }
    text + "Trace\n"
}

#[cfg(test)]
mod tests {
    use rayfold_scene::{Limits, parse};

    use super::*;

    #[test]
    fn all_that_is_drawn_is_a_script() {
        for seed in 0..200 {
            for draw in [floor, scene] {
                let text = draw(&mut Rng::with_seed(seed), (12, 9));
                let parsed = parse("a.txt", text.as_bytes(), &Limits::default());
                assert!(parsed.script.is_some(), "{:?} in\n{text}", parsed.diagnostics);
            }
        }
    }
}
