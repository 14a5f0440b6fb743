//! The shape that letters leave of a plate: contours joined by the non-zero rule, triangles, and the edges of its sides.

use std::collections::HashMap;

use glam::{DVec2, I64Vec2};
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay::{IntOverlayOptions, Overlay};
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::i_float::int::point::IntPoint;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

use super::outline::{Contour, Corner};
use crate::error::Fault;

/// The largest distance from the middle of joined outlines, in units of the grid. Predicates with such numbers are exact.
const REACH: i64 = 1 << 29;

/// The most corners that are joined at once.
const CORNERS: usize = 1_000_000;

/// The maximum number of crossings of outlines that are joined at once, and of pairs of chords that are compared to
/// find them.
const CROSSINGS: usize = 1_000_000;
const PAIRS: usize = 1_000_000_000;

/// The cosine of two angles: a corner of the outline below the first is smooth; a chord that turns by less than the
/// second takes the direction of the outline at its end.
const SMOOTH: f64 = 0.866_025_403_784_438_6;
const SAME: f64 = 0.906_307_787_036_65;

/// A flat shape without overlaps.
#[derive(Debug, Default)]
pub(super) struct Plate {
    contours: Vec<Contour>,
    points: Vec<I64Vec2>,
    triangles: Vec<[u32; 3]>,
    sides: Vec<Side>,
    bounds: [I64Vec2; 2],
}

/// An edge of the shape, which lies on its left, and the outward normals at its ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Side {
    pub(super) ends: [u32; 2],
    pub(super) normals: [DVec2; 2],
}

impl Plate {
    /// Joins shapes, each at a place.
    pub(super) fn joined(parts: &[(&Self, I64Vec2)]) -> Result<Self, Fault> {
        let corners: usize = parts.iter().flat_map(|(part, _)| &part.contours).map(Vec::len).sum();
        if corners > CORNERS {
            return Err(Fault::new(format!("those that touch have more than {CORNERS} corners")));
        }
        let moved = |corner: &Corner, by: I64Vec2| Corner { at: corner.at + by, ..*corner };
        let contours = parts.iter().flat_map(|(part, at)| {
            part.contours.iter().map(|contour| contour.iter().map(|corner| moved(corner, *at)).collect())
        });
        Self::new(contours.collect())
    }

    /// Makes the shape of contours.
    pub(super) fn new(contours: Vec<Contour>) -> Result<Self, Fault> {
        let Some(bounds) = bounds(&contours) else { return Ok(Self::default()) };
        let middle = (bounds[0] + bounds[1]) / 2;
        if (bounds[1] - middle).max_element() > REACH {
            return Err(Fault::new("those that touch are too far apart"));
        }
        check_crossings(&contours)?;
        let contours = united(&contours, middle);
        let Some(bounds) = self::bounds(&contours) else { return Ok(Self::default()) };
        let mut plate = Self { contours, bounds, ..Self::default() };
        plate.triangulate(middle)?;
        Ok(plate)
    }

    pub(super) fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// Returns the lowest and the highest corner.
    pub(super) fn bounds(&self) -> [I64Vec2; 2] {
        self.bounds
    }

    pub(super) fn points(&self) -> &[I64Vec2] {
        &self.points
    }

    /// Returns the triangles, counterclockwise.
    pub(super) fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Returns each edge that has a triangle on one side alone.
    pub(super) fn sides(&self) -> &[Side] {
        &self.sides
    }

    /// Fills the contours with triangles. Every corner is a corner of triangles, so that no edge has a point within.
    fn triangulate(&mut self, middle: I64Vec2) -> Result<(), Fault> {
        let mut normals: HashMap<[I64Vec2; 2], [DVec2; 2]> = HashMap::new();
        let (mut points, mut edges) = (Vec::new(), Vec::new());
        for contour in &self.contours {
            let first = points.len();
            for (i, corner) in contour.iter().enumerate() {
                let next = contour[(i + 1) % contour.len()];
                normals.insert([corner.at, next.at], [corner.normals()[1], next.normals()[0]]);
                let p = (corner.at - middle).as_dvec2();
                points.push(Point2::new(p.x, p.y));
                edges.push([first + i, first + (i + 1) % contour.len()]);
            }
        }
        let mut conflicts = 0;
        let made = ConstrainedDelaunayTriangulation::<Point2<f64>>::try_bulk_load_cdt(points, edges, |_| {
            conflicts += 1;
        });
        let Ok(made) = made else { return Err(Fault::new("their outlines have no triangles")) };
        if conflicts > 0 {
            return Err(Fault::new("their outlines cross where they were joined"));
        }
        // A triangle is inside if an odd number of contours lies between it and the outside.
        let mut inside = vec![None; made.num_all_faces()];
        inside[made.outer_face().index()] = Some(false);
        let mut open: Vec<_> = made.convex_hull().map(|edge| edge.fix()).collect();
        while let Some(edge) = open.pop() {
            let edge = made.directed_edge(edge);
            let beyond = edge.rev().face();
            if inside[beyond.index()].is_some() {
                continue;
            }
            let here = inside[edge.face().index()].unwrap_or_default();
            inside[beyond.index()] = Some(here != edge.is_constraint_edge());
            open.extend(
                beyond.as_inner().into_iter().flat_map(|face| face.adjacent_edges()).map(|e| e.fix()),
            );
        }
        let place = |p: Point2<f64>| DVec2::new(p.x, p.y).as_i64vec2() + middle;
        self.points = made.vertices().map(|vertex| place(vertex.position())).collect();
        let is_inside = |face: usize| inside[face] == Some(true);
        for face in made.inner_faces().filter(|face| is_inside(face.index())) {
            self.triangles.push(face.vertices().map(|vertex| vertex.index() as u32));
            for edge in face.adjacent_edges() {
                if is_inside(edge.rev().face().index()) {
                    continue;
                }
                let ends = [edge.from(), edge.to()];
                let places = ends.map(|end| place(end.position()));
                let chord = outward((places[1] - places[0]).as_dvec2().normalize());
                let normals = normals.get(&places).copied().unwrap_or([chord; 2]);
                self.sides.push(Side { ends: ends.map(|end| end.index() as u32), normals });
            }
        }
        Ok(())
    }
}

impl Corner {
    /// Returns the outward normals of the sides before and after the corner, which are one where it is smooth.
    fn normals(&self) -> [DVec2; 2] {
        let normals = [self.before, self.after].map(outward);
        if self.before.dot(self.after) > SMOOTH {
            return [(normals[0] + normals[1]).normalize(); 2];
        }
        normals
    }
}

/// Returns the normal of a contour with a direction, towards its right.
fn outward(direction: DVec2) -> DVec2 {
    DVec2::new(direction.y, -direction.x)
}

fn bounds(contours: &[Contour]) -> Option<[I64Vec2; 2]> {
    let corners = || contours.iter().flatten().map(|corner| corner.at);
    Some([corners().reduce(I64Vec2::min)?, corners().reduce(I64Vec2::max)?])
}

/// Joins contours by the non-zero rule: shapes lie on the left of the result, which neither crosses nor overlaps itself.
fn united(contours: &[Contour], middle: I64Vec2) -> Vec<Contour> {
    let point = |p: I64Vec2| {
        let p = (p - middle).as_ivec2();
        IntPoint::new(p.x, p.y)
    };
    let subject: Vec<Vec<IntPoint<i32>>> =
        contours.iter().map(|contour| contour.iter().map(|corner| point(corner.at)).collect()).collect();
    let options = IntOverlayOptions::keep_output_points();
    let mut overlay = Overlay::from_subj_custom(&subject, options, Default::default());
    let shapes = overlay.overlay(OverlayRule::Subject, FillRule::NonZero);
    // The outline's own directions, where one contour alone has a corner.
    let mut known: HashMap<I64Vec2, Option<Corner>> = HashMap::new();
    for corner in contours.iter().flatten() {
        known.entry(corner.at).and_modify(|known| *known = None).or_insert(Some(*corner));
    }
    let lines = shapes.into_iter().flatten().filter(|line| line.len() > 2);
    lines
        .map(|line| {
            let at = |i: usize| {
                let p = line[i % line.len()];
                I64Vec2::new(i64::from(p.x), i64::from(p.y)) + middle
            };
            let corner = |i: usize| {
                let (last, here, next) = (at(i + line.len() - 1), at(i), at(i + 1));
                let chords = [here - last, next - here].map(|chord| chord.as_dvec2().normalize());
                directed(here, chords, known.get(&here).copied().flatten())
            };
            (0..line.len()).map(corner).collect()
        })
        .collect()
}

/// Returns a corner between two chords, with the directions of the outline where they are those of a known corner there.
fn directed(at: I64Vec2, chords: [DVec2; 2], known: Option<Corner>) -> Corner {
    let [before, after] = chords;
    let is_like = |[a, b]: [DVec2; 2]| a.dot(before) > SAME && b.dot(after) > SAME;
    let of_outline = known.and_then(|known| {
        let (along, against) = ([known.before, known.after], [-known.after, -known.before]);
        [along, against].into_iter().find(|directions| is_like(*directions))
    });
    let [before, after] = of_outline.unwrap_or(chords);
    Corner { at, before, after }
}

/// Checks that contours do not lie above one another or cross so often that joining them would take too long.
fn check_crossings(contours: &[Contour]) -> Result<(), Fault> {
    let mut chords: Vec<[I64Vec2; 2]> = contours
        .iter()
        .flat_map(|contour| (0..contour.len()).map(|i| [contour[i].at, contour[(i + 1) % contour.len()].at]))
        .collect();
    chords.sort_unstable_by_key(|[a, b]| a.x.min(b.x));
    let (mut open, mut pairs, mut crossings): (Vec<[I64Vec2; 2]>, usize, usize) = (Vec::new(), 0, 0);
    for chord in chords {
        let [low, high] = [chord[0].min(chord[1]), chord[0].max(chord[1])];
        open.retain(|[a, b]| a.x.max(b.x) >= low.x);
        pairs += open.len();
        if pairs > PAIRS {
            return Err(Fault::new("too many parts of their outlines lie above one another"));
        }
        let meets = |other: &&[I64Vec2; 2]| {
            let [a, b] = **other;
            a.y.min(b.y) <= high.y && low.y <= a.y.max(b.y) && crosses(chord, **other)
        };
        crossings += open.iter().filter(meets).count();
        if crossings > CROSSINGS {
            return Err(Fault::new(format!("their outlines cross more than {CROSSINGS} times")));
        }
        open.push(chord);
    }
    Ok(())
}

/// Returns whether chords have a point in common that is not the end of both.
fn crosses([a, b]: [I64Vec2; 2], [c, d]: [I64Vec2; 2]) -> bool {
    // Within `REACH` nothing overflows.
    let side = |p: I64Vec2, q: I64Vec2, r: I64Vec2| (q - p).perp_dot(r - p).signum();
    let (ab, cd) = ([side(a, b, c), side(a, b, d)], [side(c, d, a), side(c, d, b)]);
    if [a, b].iter().any(|p| *p == c || *p == d) {
        return false;
    }
    ab[0] * ab[1] <= 0 && cd[0] * cd[1] <= 0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn contour(points: &[[i64; 2]]) -> Contour {
        let at = |i: usize| I64Vec2::from(points[i % points.len()]);
        (0..points.len())
            .map(|i| {
                let [before, after] = [[i + points.len() - 1, i], [i, i + 1]]
                    .map(|[from, to]| (at(to) - at(from)).as_dvec2().normalize());
                Corner { at: at(i), before, after }
            })
            .collect()
    }

    fn square(low: i64, high: i64) -> Contour {
        contour(&[[low, low], [high, low], [high, high], [low, high]])
    }

    fn reversed(mut contour: Contour) -> Contour {
        contour.reverse();
        contour.iter_mut().for_each(|c| (c.before, c.after) = (-c.after, -c.before));
        contour
    }

    /// Returns twice the area, after a check that sides and triangles have the same edges.
    fn double_area(contours: Vec<Contour>) -> i64 {
        let plate = Plate::new(contours).unwrap();
        let mut edges: HashMap<[u32; 2], i32> = HashMap::new();
        for [a, b, c] in plate.triangles() {
            for [from, to] in [[a, b], [b, c], [c, a]] {
                *edges.entry([*from, *to]).or_default() += 1;
                *edges.entry([*to, *from]).or_default() -= 1;
            }
        }
        for side in plate.sides() {
            assert_eq!(edges.remove(&side.ends), Some(1));
            assert!(side.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-12));
        }
        assert_eq!(edges.values().filter(|balance| **balance > 0).count(), 0);
        let corners = plate.triangles().iter().map(|t| t.map(|i| plate.points()[i as usize]));
        corners.map(|[a, b, c]| (b - a).perp_dot(c - a)).inspect(|area| assert!(*area > 0)).sum()
    }

    #[test]
    fn contours_fill_by_the_non_zero_rule() {
        let (large, small) = (square(0, 100), square(30, 60));
        assert_eq!(double_area(vec![large.clone()]), 2 * 10_000);
        assert_eq!(double_area(vec![reversed(large.clone())]), 2 * 10_000, "TrueType's direction");
        assert_eq!(double_area(vec![large.clone(), reversed(small.clone())]), 2 * (10_000 - 900));
        assert_eq!(double_area(vec![large.clone(), small.clone()]), 2 * 10_000, "no hole");
        assert_eq!(double_area(vec![large.clone(), square(50, 150)]), 2 * (20_000 - 2500));
        assert_eq!(double_area(vec![large.clone(), square(100, 150)]), 2 * 12_500, "a corner in common");
        let beside = contour(&[[100, 20], [150, 20], [150, 40], [100, 40]]);
        assert_eq!(double_area(vec![large, beside]), 2 * 11_000, "a part of an edge in common");
        assert_eq!(double_area(vec![contour(&[[0, 0], [9, 9], [9, 0], [0, 9]])]), 81, "a bow tie");
        assert!(Plate::new(vec![contour(&[[0, 0], [9, 9], [3, 3]])]).unwrap().is_empty(), "no area");
    }

    #[test]
    fn directions_of_the_outline_are_kept() {
        // A circle whose directions are off by 3 degrees, which chords would not show.
        let direction = |degrees: f64| DVec2::from_angle(degrees.to_radians());
        let corner = |k: i32| {
            let along = direction(f64::from(10 * k) + 93.0);
            let at = (1e5 * direction(f64::from(10 * k))).round().as_i64vec2();
            Corner { at, before: along, after: along }
        };
        let circle: Contour = (0..36).map(corner).collect();
        for circle in [circle.clone(), reversed(circle.clone())] {
            let plate = Plate::new(vec![circle]).unwrap();
            assert_eq!(plate.sides().len(), 36);
            for side in plate.sides() {
                for (end, normal) in side.ends.into_iter().zip(side.normals) {
                    let out = plate.points()[end as usize].as_dvec2().normalize();
                    assert!((normal.dot(out) - direction(3.0).x).abs() < 1e-4, "{side:?}");
                }
            }
        }
        let square = contour(&[[-200_000, -9], [200_000, -9], [200_000, 9], [-200_000, 9]]);
        let joined = Plate::new(vec![circle, square]).unwrap();
        let is_along = |side: &&Side| side.normals[0].abs() == DVec2::Y && side.normals[0] == side.normals[1];
        assert_eq!(joined.sides().iter().filter(is_along).count(), 4, "where contours cross, chords count");
    }

    #[test]
    fn what_crosses_without_end_is_an_error() {
        // Each of the lines from left to right crosses each of those from below.
        let zigzag = |count: i64, turn: bool| {
            let point = |k: i64, end: i64| if turn { [100 * k, end] } else { [end, 100 * k] };
            let points = (0..count).map(|k| point(k, if k % 2 == 0 { -50 } else { 100 * count }));
            contour(&points.collect::<Vec<_>>())
        };
        assert!(Plate::new(vec![zigzag(100, true), zigzag(100, false)]).is_ok());
        let fault = Plate::new(vec![zigzag(2000, true), zigzag(2000, false)]).unwrap_err();
        assert!(fault.what.contains("cross more than"), "{}", fault.what);
        let far = contour(&[[0, 0], [1 << 40, 0], [0, 1 << 40]]);
        assert!(Plate::new(vec![far]).unwrap_err().what.contains("too far apart"));
    }
}
