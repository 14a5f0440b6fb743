//! The faces of meshes: normals at vertices, colours at vertices, and the inside of closed glass.
//!
//! As patterns are, they are computed lane by lane, with the functions of the reference tracer.

use std::sync::Arc;

use glam::DVec3;
use rayfold_scene::Scene;

use crate::fast::arithmetic::real::Real;
use crate::fast::placement::geometry::Geometry;
use crate::fast::rays::bounce::{Column, Hits, ROOM, RayBatch};
use crate::meshes::{FaceHit, Faces};

/// The faces of a scene, at least one of which has more than a triangle.
#[derive(Debug)]
pub(crate) struct ShadedFaces {
    faces: Arc<Faces>,
    /// The scene, for its materials.
    scene: Scene,
    center: DVec3,
    scale: f64,
}

impl ShadedFaces {
    /// Returns `None` if there are none.
    pub(crate) fn new(scene: &Scene, geometry: &Geometry) -> Option<Self> {
        let faces = geometry.faces.clone()?;
        Some(Self { faces, scene: scene.clone(), center: geometry.center, scale: geometry.scale })
    }

    /// Gives hits the normals and colours of their faces. Rays that go on from them start as from triangles.
    /// `EYE` says that the rays start at the eye, and count for 1.
    #[inline(never)]
    pub(crate) fn shade<E: Real, const EYE: bool>(
        &self,
        queue: &RayBatch<E>,
        hits: &mut Hits<E>,
        lanes: usize,
    ) {
        let columns = [&mut hits.face, &mut hits.place, &mut hits.under, &mut hits.onward];
        columns.into_iter().flatten().for_each(|column| column.resize(ROOM, E::narrow(0.0)));
        let zero = DVec3::ZERO;
        for packet in 0..hits.packets.len() {
            let (at, _) = hits.packets[packet];
            for lane in at..at + lanes {
                let (start, face) = (read(&hits.start, lane), read(&hits.normal, lane));
                write(&mut hits.face, lane, face);
                write(&mut hits.place, lane, start);
                write(&mut hits.onward, lane, face);
                write(&mut hits.under, lane, zero);
                if !hits.is_hit(lane) {
                    continue;
                }
                let order = hits.order.0[lane].widen();
                let offset = hits.sides[0].0[lane].widen();
                let point = start - offset * face;
                let direction = read(&queue.direction, lane);
                let hit = FaceHit { point, center: self.center, scale: self.scale, direction, face };
                let material = self.scene.objects[order as usize].material();
                let Some(shading) = self.faces.shading(order, material, hit) else { continue };
                write(&mut hits.normal, lane, shading.normal);
                write(&mut hits.onward, lane, shading.onward);
                write(&mut hits.start, lane, start + shading.lift);
                // A face that the start is lifted off can hide a light; a face that it starts on cannot.
                if shading.lift.dot(face) <= offset {
                    write(&mut hits.under, lane, -2.0 * offset * face);
                }
                let weight = if EYE { DVec3::ONE } else { read(&queue.weight, lane) };
                let color = read(&hits.color, lane) * shading.color + weight * shading.glow;
                write(&mut hits.color, lane, color);
                let diffuse = read(&hits.diffuse, lane) * shading.color;
                write(&mut hits.diffuse, lane, diffuse);
                if shading.within {
                    hits.sides[1].0[lane] = E::narrow(1.0);
                }
            }
        }
    }
}

impl<E: Real> Hits<E> {
    /// Leaves no hit with a face of a mesh, in a scene without.
    pub(crate) fn forget_faces(&mut self) {
        if !self.face[0].is_empty() {
            let columns = [&mut self.face, &mut self.place, &mut self.under, &mut self.onward];
            columns.into_iter().flatten().for_each(Vec::clear);
        }
    }

    /// Lets rays go on from the hits after all lights were added: from the faces, and by their normals.
    pub(crate) fn leave_faces(&mut self) {
        if self.place[0].is_empty() {
            return;
        }
        for axis in 0..3 {
            self.start[axis].0.copy_from_slice(&self.place[axis]);
            self.normal[axis].0.copy_from_slice(&self.onward[axis]);
        }
    }
}

fn read<E: Real>(columns: &[Column<E>; 3], lane: usize) -> DVec3 {
    DVec3::new(columns[0].0[lane].widen(), columns[1].0[lane].widen(), columns[2].0[lane].widen())
}

fn write<E: Real>(columns: &mut [impl AsMut<[E]>; 3], lane: usize, v: DVec3) {
    for (column, value) in columns.iter_mut().zip(v.to_array()) {
        column.as_mut()[lane] = E::narrow(value);
    }
}
