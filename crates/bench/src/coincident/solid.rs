//! Solids in the form of script lines, and the same solids made slightly thicker.

use std::fmt::Write as _;

use fastrand::Rng;
use glam::{DMat3, DVec3};

/// A solid with the numbers of its line.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Solid {
    Sphere { radius: f64, center: DVec3 },
    Box([DVec3; 2]),
    Triangle([DVec3; 3]),
    Plane { point: DVec3, normal: DVec3 },
    Disc { radius: f64, center: DVec3, normal: DVec3 },
    Cylinder { radius: f64, ends: [DVec3; 2] },
    Cone { radii: [f64; 2], ends: [DVec3; 2] },
    Torus { radius: f64, thickness: f64, center: DVec3, normal: DVec3 },
    Capsule { radius: f64, ends: [DVec3; 2] },
    Roundbox { corners: [DVec3; 2], radius: f64 },
}

impl Solid {
    /// Writes the line without a material.
    pub(super) fn line(&self) -> String {
        let mut line = String::new();
        let (name, lengths, vectors): (&str, &[f64], &[DVec3]) = match self {
            Self::Sphere { radius, center } => ("Sphere", &[*radius], &[*center]),
            Self::Box(corners) => ("Box", &[], corners),
            Self::Triangle(vertices) => ("Triangle", &[], vertices),
            Self::Plane { point, normal } => ("Plane", &[], &[*point, *normal]),
            Self::Disc { radius, center, normal } => ("Disc", &[*radius], &[*center, *normal]),
            Self::Cylinder { radius, ends } => ("Cylinder", &[*radius], ends),
            Self::Cone { radii, ends } => ("Cone", radii, ends),
            Self::Torus { radius, thickness, center, normal } => {
                ("Torus", &[*radius, *thickness], &[*center, *normal])
            }
            Self::Capsule { radius, ends } => ("Capsule", &[*radius], ends),
            Self::Roundbox { corners, .. } => ("Roundbox", &[], corners),
        };
        line += name;
        let last = if let Self::Roundbox { radius, .. } = self { Some(*radius) } else { None };
        let numbers = lengths.iter().copied().chain(vectors.iter().flat_map(|v| v.to_array())).chain(last);
        for number in numbers {
            // `+ 0.0` removes the sign of a zero.
            let _ = write!(line, " {}", number + 0.0);
        }
        line
    }

    /// Returns the solid rotated and then moved. Returns `None` for a box of either kind, which is axis-aligned, unless
    /// the rotation is the identity.
    pub(super) fn placed(&self, turn: DMat3, shift: DVec3) -> Option<Self> {
        let place = |point: &DVec3| shift + turn * *point;
        Some(match self {
            Self::Sphere { radius, center } => Self::Sphere { radius: *radius, center: place(center) },
            Self::Box(_) if turn != DMat3::IDENTITY => return None,
            Self::Box(corners) => Self::Box(corners.each_ref().map(place)),
            Self::Triangle(vertices) => Self::Triangle(vertices.each_ref().map(place)),
            Self::Plane { point, normal } => Self::Plane { point: place(point), normal: turn * *normal },
            Self::Disc { radius, center, normal } => {
                Self::Disc { radius: *radius, center: place(center), normal: turn * *normal }
            }
            Self::Cylinder { radius, ends } => {
                Self::Cylinder { radius: *radius, ends: ends.each_ref().map(place) }
            }
            Self::Cone { radii, ends } => Self::Cone { radii: *radii, ends: ends.each_ref().map(place) },
            Self::Torus { radius, thickness, center, normal } => Self::Torus {
                radius: *radius,
                thickness: *thickness,
                center: place(center),
                normal: turn * *normal,
            },
            Self::Capsule { radius, ends } => {
                Self::Capsule { radius: *radius, ends: ends.each_ref().map(place) }
            }
            Self::Roundbox { .. } if turn != DMat3::IDENTITY => return None,
            Self::Roundbox { corners, radius } => {
                Self::Roundbox { corners: corners.each_ref().map(place), radius: *radius }
            }
        })
    }

    /// Returns the solid with each number unchanged or replaced by the next `f64` up or down, like computed numbers.
    pub(super) fn jittered(&self, rng: &mut Rng) -> Self {
        let mut number = |x: f64| match rng.u32(0..3) {
            0 if x != 0.0 => x.next_up(),
            1 if x != 0.0 => x.next_down(),
            _ => x,
        };
        let vector = |v: DVec3, number: &mut dyn FnMut(f64) -> f64| v.map(number);
        match self {
            Self::Sphere { radius, center } => {
                Self::Sphere { radius: number(*radius), center: vector(*center, &mut number) }
            }
            // A flat box stays flat.
            Self::Box([u, v]) => {
                let other = vector(*v, &mut number);
                Self::Box([*u, DVec3::select(u.cmpeq(*v), *v, other)])
            }
            Self::Triangle(vertices) => Self::Triangle(vertices.map(|v| vector(v, &mut number))),
            Self::Plane { point, normal } => {
                Self::Plane { point: vector(*point, &mut number), normal: vector(*normal, &mut number) }
            }
            Self::Disc { radius, center, normal } => Self::Disc {
                radius: *radius,
                center: vector(*center, &mut number),
                normal: vector(*normal, &mut number),
            },
            Self::Cylinder { radius, ends } => {
                Self::Cylinder { radius: number(*radius), ends: ends.map(|end| vector(end, &mut number)) }
            }
            Self::Cone { radii, ends } => {
                Self::Cone { radii: radii.map(&mut number), ends: ends.map(|end| vector(end, &mut number)) }
            }
            Self::Torus { radius, thickness, center, normal } => Self::Torus {
                radius: number(*radius),
                thickness: number(*thickness),
                center: vector(*center, &mut number),
                normal: vector(*normal, &mut number),
            },
            Self::Capsule { radius, ends } => {
                Self::Capsule { radius: number(*radius), ends: ends.map(|end| vector(end, &mut number)) }
            }
            Self::Roundbox { corners, radius } => Self::Roundbox {
                corners: corners.map(|corner| vector(corner, &mut number)),
                radius: number(*radius),
            },
        }
    }

    /// Returns solids whose surface lies outside this one's by `depth`. For a flat solid these are two, one on each
    /// side.
    pub(super) fn thicker(&self, depth: f64) -> Vec<Self> {
        let both = |normal: DVec3, moved: &dyn Fn(DVec3) -> Self| {
            let apart = depth * normal.normalize();
            vec![moved(apart), moved(-apart)]
        };
        match self {
            Self::Sphere { radius, center } => {
                vec![Self::Sphere { radius: radius + depth, center: *center }]
            }
            Self::Box([u, v]) => {
                let (low, high) = (u.min(*v), u.max(*v));
                let flat = (0..3).find(|&axis| low[axis] == high[axis]);
                match flat {
                    Some(axis) => both(DVec3::AXES[axis], &|apart| Self::Box([low + apart, high + apart])),
                    None => vec![Self::Box([low - depth, high + depth])],
                }
            }
            Self::Triangle([a, b, c]) => {
                both((b - a).cross(c - a), &|apart| Self::Triangle([a + apart, b + apart, c + apart]))
            }
            Self::Plane { point, normal } => {
                both(*normal, &|apart| Self::Plane { point: point + apart, normal: *normal })
            }
            Self::Disc { radius, center, normal } => both(*normal, &|apart| Self::Disc {
                radius: *radius,
                center: center + apart,
                normal: *normal,
            }),
            Self::Cylinder { radius, ends: [a, b] } => {
                let along = depth * (b - a).normalize();
                vec![Self::Cylinder { radius: radius + depth, ends: [a - along, b + along] }]
            }
            Self::Cone { radii: [low, high], ends: [a, b] } => {
                let along = depth * (b - a).normalize();
                let slope = (high - low) / (b - a).length();
                let wider = depth * (1.0 + slope * slope).sqrt();
                let radii = [low + wider - slope * depth, high + wider + slope * depth];
                vec![Self::Cone { radii: radii.map(|radius| radius.max(0.0)), ends: [a - along, b + along] }]
            }
            Self::Torus { radius, thickness, center, normal } => vec![Self::Torus {
                radius: *radius,
                thickness: thickness + depth,
                center: *center,
                normal: *normal,
            }],
            Self::Capsule { radius, ends } => vec![Self::Capsule { radius: radius + depth, ends: *ends }],
            Self::Roundbox { corners: [u, v], radius } => {
                let corners = [u.min(*v) - depth, u.max(*v) + depth];
                vec![Self::Roundbox { corners, radius: radius + depth }]
            }
        }
    }
}
