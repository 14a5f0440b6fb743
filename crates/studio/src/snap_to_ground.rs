//! Dropping objects onto the ground, and onto the objects below them.
//!
//! The tracer finds the surfaces: rays from below find the underside of an object, and rays from there
//! the surface below it.

use glam::DVec3;
use rayfold_scene::{Object, Scene};
use rayfold_tracer::probe::nearest_hits;
use rayfold_tracer::{Precision, RenderOptions};

use crate::document::Splice;
use crate::edits::{moved, set};
use crate::extent::bounds;
use crate::line::Line;
use crate::source_map::SourceMap;
use crate::values::{Keying, tidy};

/// The number of rays per side, odd so that the middle is tested, too.
const SIDE: usize = 33;

/// The number of times that the area around the first contact is searched again, each time at a finer scale.
const ROUNDS: usize = 4;
const FINER: f64 = 8.0;

/// The distance above an underside at which rays start, in sizes of the object, so that they hit
/// a surface in contact.
const LIFT: f64 = 1e-6;

/// Drops objects together until one of them rests on an object below, or on the height 0 if there is none.
pub(crate) fn drop_down(
    lines: &[Line],
    source_map: &SourceMap,
    scene: &Scene,
    which: &[usize],
    keying: Keying,
) -> Vec<Splice> {
    let is_chosen = |object: usize| source_map.line_of(object).is_some_and(|line| which.contains(&line));
    let (own, others): (Vec<_>, Vec<_>) =
        scene.objects.iter().cloned().enumerate().partition(|(object, _)| is_chosen(*object));
    let plain = |objects: Vec<(usize, Object)>| objects.into_iter().map(|(_, object)| object).collect();
    let Some(fall) = fall(scene, plain(own), plain(others)) else { return Vec::new() };
    down(lines, which, fall, keying)
}

/// Moves each object so that its lowest point is at the height 0.
pub(crate) fn to_ground(
    lines: &[Line],
    source_map: &SourceMap,
    scene: &Scene,
    which: &[usize],
    keying: Keying,
) -> Vec<Splice> {
    let mut splices = Vec::new();
    for &line in which {
        let own = scene.objects.iter().enumerate().filter(|(at, _)| source_map.line_of(*at) == Some(line));
        let lowest = own.filter_map(|(_, object)| Some(-object.support(DVec3::NEG_Y)?)).reduce(f64::min);
        splices.extend(lowest.map(|lowest| down(lines, &[line], lowest, keying)).unwrap_or_default());
    }
    splices
}

fn down(lines: &[Line], which: &[usize], by: f64, keying: Keying) -> Vec<Splice> {
    let chosen = which.iter().filter_map(|&at| Some((at, lines.get(at)?)));
    chosen.filter_map(|(at, line)| Some(set(at, moved(line, DVec3::NEG_Y * tidy(by), keying)?))).collect()
}

/// Returns the distance that objects fall until they touch others or the height 0. Negative if they are below it.
fn fall(scene: &Scene, own: Vec<Object>, others: Vec<Object>) -> Option<f64> {
    let around = bounds(&own)?;
    let size = around.high - around.low;
    let [mut own_scene, mut below] = [scene.clone(), scene.clone()];
    own_scene.objects = own.into();
    below.objects = others.into();
    let mut middle = around.center();
    let mut half = 0.5 * size.max(DVec3::splat(1e-9 * size.length()));
    // The distance if no object is below.
    let ground = around.low.y;
    let mut least: Option<f64> = None;
    for _ in 0..ROUNDS {
        let (fall, at) = nearest(&own_scene, &below, middle, half, around.low.y - size.length())?;
        let Some(fall) = fall else { break };
        least = Some(least.map_or(fall, |least: f64| least.min(fall)));
        middle = at;
        half /= FINER;
    }
    Some(least.unwrap_or(ground))
}

/// Returns the smallest distance between undersides and the surfaces below them within a square, and its position.
fn nearest(own: &Scene, below: &Scene, middle: DVec3, half: DVec3, low: f64) -> Option<(Option<f64>, DVec3)> {
    let step = |at: usize| at as f64 / ((SIDE - 1) as f64 / 2.0) - 1.0;
    let starts: Vec<DVec3> = (0..SIDE * SIDE)
        .map(|at| DVec3::new(middle.x + half.x * step(at % SIDE), low, middle.z + half.z * step(at / SIDE)))
        .collect();
    let options = RenderOptions { precision: Precision::F64, ..RenderOptions::default() };
    let up: Vec<_> = starts.iter().map(|&start| (start, DVec3::Y)).collect();
    let undersides = nearest_hits(own, &up, &options).ok()?;
    let undersides: Vec<DVec3> = starts
        .iter()
        .zip(undersides)
        .filter_map(|(start, hit)| Some(*start + hit?.distance * DVec3::Y))
        .collect();
    let lift = LIFT * half.length();
    let down: Vec<_> = undersides.iter().map(|&from| (from + lift * DVec3::Y, DVec3::NEG_Y)).collect();
    let hits = nearest_hits(below, &down, &options).ok()?;
    let least = undersides
        .iter()
        .zip(hits)
        .filter_map(|(from, hit)| Some((hit?.distance - lift, *from)))
        .min_by(|a, b| a.0.total_cmp(&b.0));
    Some(least.map_or((None, middle), |(distance, at)| (Some(distance), at)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::Document;

    const STILL: Keying = Keying { time: 1.0, first: 1.0, auto: false, whole: false };

    type Act = fn(&[Line], &SourceMap, &Scene, &[usize], Keying) -> Vec<Splice>;

    fn after(text: &str, which: &[usize], act: Act) -> String {
        let lines = Line::split(text.as_bytes());
        let parsed = rayfold_scene::parse("a", text.as_bytes(), &Default::default());
        let scene = parsed.script.unwrap_or_else(|| panic!("{:?}", parsed.diagnostics)).frame(0).unwrap();
        let mut document = Document::new(text.as_bytes());
        for splice in act(&lines, &SourceMap::of(&lines, 0, 1.0), &scene, which, STILL) {
            document.apply(splice, None);
        }
        String::from_utf8(document.bytes()).unwrap()
    }

    const TEXT: &str = "Screen 4 3\nSphere 1  0 5 0  0 0 0  1 1 1 # a\n# Box 0 0 0 1 1 1 0 0 0 1 1 1\n\
                        Box -2 0 -2  2 .5 2  0 0 0  1 1 1\n# Box of tricks\nTrace\n";

    #[test]
    fn an_object_falls_onto_what_is_below() {
        let fallen = after(TEXT, &[1], drop_down);
        assert_eq!(fallen, TEXT.replace("0 5 0", "0 1.5 0"));
        assert_eq!(after(&fallen, &[1], drop_down), fallen, "it lies");
        let raised = TEXT.replace("-2 0 -2  2 .5 2", "-2 2 -2  2 2.5 2");
        let fallen = after(&raised, &[3], drop_down);
        assert_eq!(fallen, raised.replace("-2 2 -2  2 2.5 2", "-2 0 -2  2 0.5 2"), "the ground is at 0");
    }

    #[test]
    fn an_object_rests_with_its_edge() {
        let text = "Screen 4 3\nSphere 1  0 5 0  0 0 0  1 1 1\nSphere 1  1.2 0 0  0 0 0  1 1 1\nTrace";
        let fallen = after(text, &[1], drop_down);
        let height: f64 = fallen.lines().nth(1).unwrap().split_whitespace().nth(3).unwrap().parse().unwrap();
        assert!((height - 1.6).abs() < 1e-6, "two balls touch where 1.2² + 1.6² is 2²: {fallen}");
    }

    #[test]
    fn a_group_and_a_tilted_disc_stand_on_the_ground() {
        let text = "Screen 4 3\nMaterial m ambient 1 1 1\nGroup a\nCone .5 .2  0 0 0  0 1 0  m\nEnd\n\
                    Use a  1 2 3  180 0 0  2\nDisc 1  0 5 0  0.6 0.8 0  m\nTrace";
        let stood = after(text, &[5, 6], to_ground);
        let expected = text.replace("Disc 1  0 5 0", "Disc 1  0 0.6 0");
        assert_eq!(stood, expected, "the cone hangs from 2 to 0");
    }
}
