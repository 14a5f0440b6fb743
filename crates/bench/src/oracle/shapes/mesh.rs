//! Meshes: every triangle of the model, with normals and colours at its vertices.

use glam::DVec3;
use rayfold_scene::assets::Closure;
use rayfold_scene::{Material, Mesh, Object, Placement, Triangle};

use super::Shape;
use crate::oracle::hit::Hit;
use crate::oracle::line::Line;
use crate::oracle::model_color::At;
use crate::oracle::real::{Real, Vector};

/// The surface of a face of a mesh, as light sees it.
pub(in crate::oracle) struct Shaded {
    /// The interpolated unit normal, facing the ray.
    pub(in crate::oracle) normal: Vector,
    /// The way from the hit to where shadow rays start.
    pub(in crate::oracle) lift: Vector,
    /// The factor of ambient and diffuse coefficients.
    pub(in crate::oracle) color: DVec3,
    /// The colour that is added.
    pub(in crate::oracle) glow: DVec3,
    /// Whether the faces show their colour alone.
    pub(in crate::oracle) unlit: bool,
}

/// Returns a triangle of the model.
fn triangle(mesh: &Mesh, k: usize) -> Triangle {
    Triangle::new(mesh.model().corners(k), Material::default())
        .unwrap_or_else(|_| unreachable!("positions of a model are finite"))
}

/// Returns the hit of a line with a triangle of the model beyond `start`, if the triangle has no hole there.
fn first_on(mesh: &Mesh, k: usize, line: &Line, start: &Real) -> Option<Real> {
    let t = triangle(mesh, k).first(line, start)?;
    let model = mesh.model();
    let weights = weights(model.corners(k), &line.at(&t)).map(|weight| weight.to_f64());
    let is_hole = model.has_holes() && At { model, triangle: k, weights, linear: false }.is_hole();
    (!is_hole).then_some(t)
}

/// Returns the barycentric weights of a point of a triangle.
fn weights(corners: [DVec3; 3], point: &Vector) -> [Real; 3] {
    let [a, b, c] = &corners.map(Vector::from);
    let area = b.minus(a).cross(&c.minus(a));
    let whole = area.dot(&area);
    let weight = |p: &Vector, q: &Vector| area.dot(&p.minus(point).cross(&q.minus(point))).over(&whole);
    [weight(b, c), weight(c, a), weight(a, b)]
}

/// Returns the first triangle that a line hits at `t`.
fn hit_at(mesh: &Mesh, line: &Line, t: &Real) -> usize {
    let near = t - &t.magnitude().shifted(-380);
    (0..mesh.model().triangle_count())
        .find(|k| first_on(mesh, *k, line, &near).is_some_and(|first| first <= t + &t.shifted(-380)))
        .unwrap_or_default()
}

impl Shape for Mesh {
    fn extent(&self) -> f64 {
        self.model().positions().iter().map(|p| p.abs().max_element()).fold(0.0, f64::max)
    }

    fn has_inside(&self) -> bool {
        *self.model().closure() == Closure::Closed
    }

    fn first(&self, line: &Line, start: &Real) -> Option<Real> {
        let all = (0..self.model().triangle_count()).filter_map(|k| first_on(self, k, line, start));
        all.reduce(|a, b| if b < a { b } else { a })
    }

    fn outward(&self, line: &Line, t: &Real) -> Vector {
        triangle(self, hit_at(self, line, t)).outward(line, t)
    }

    fn face(&self, line: &Line, t: &Real) -> Option<(usize, f64)> {
        triangle(self, hit_at(self, line, t)).face(line, t)
    }
}

/// Returns whether an object, also in a group, is a mesh with the colours of its file alone.
pub(in crate::oracle) fn is_of_file(object: &Object) -> bool {
    match object {
        Object::Mesh(mesh) => !mesh.has_material(),
        Object::Instance(instance) => is_of_file(instance.object()),
        _ => false,
    }
}

/// Returns the texture coordinates of a hit on a mesh, also in a group, and whether they count from the top of a picture.
pub(in crate::oracle) fn texture(object: &Object, line: &Line, hit: &Hit) -> Option<([f64; 2], bool)> {
    let (mesh, local, _) = mesh_of(object, line)?;
    let (model, k) = (mesh.model(), hit_at(mesh, &local, &hit.t));
    let weights = weights(model.corners(k), &local.at(&hit.t)).map(|weight| weight.to_f64());
    let uvs = model.uvs(k)?;
    let sum = |axis: usize| uvs.iter().zip(weights).map(|(uv, weight)| weight * f64::from(uv[axis])).sum();
    Some(([sum(0), sum(1)], model.has_uvs_from_top()))
}

/// Returns the mesh that an object is, the line in the coordinates of its file, and its place if it is in a group.
fn mesh_of<'a>(object: &'a Object, line: &Line) -> Option<(&'a Mesh, Line, Option<&'a Placement>)> {
    match object {
        Object::Mesh(mesh) => Some((mesh, line.clone(), None)),
        Object::Instance(instance) => match instance.object() {
            Object::Mesh(mesh) => Some((mesh, instance.local(line), Some(instance.placement()))),
            _ => None,
        },
        _ => None,
    }
}

/// Returns the contribution of a mesh, also in a group, to the surface of a hit. `linear` is whether colours are linear
/// light.
pub(in crate::oracle) fn shaded(object: &Object, line: &Line, hit: &Hit, linear: bool) -> Option<Shaded> {
    let (mesh, local, placement) = mesh_of(object, line)?;
    let (model, k) = (mesh.model(), hit_at(mesh, &local, &hit.t));
    let corners = model.corners(k).map(Vector::from);
    let point = local.at(&hit.t);
    let [a, b, c] = &corners;
    let area = b.minus(a).cross(&c.minus(a));
    let weights = weights(model.corners(k), &point);
    let faces_away = |v: &Vector| v.dot(&local.direction).sign() > 0;
    let face = if faces_away(&area) { area.opposite() } else { area.clone() };
    let onto = |n: &Vector| if n.dot(&face).sign() < 0 { n.opposite() } else { n.clone() };

    let nothing = Vector::from(DVec3::ZERO);
    let (mut normal, mut lift) = (face.unit(), nothing.clone());
    if let Some(normals) = model.normals(k) {
        let normals = normals.map(|n| match n {
            DVec3::ZERO => nothing.clone(),
            n => Vector::from(n).unit(),
        });
        let mixed = normals.iter().zip(&weights).fold(nothing.clone(), |sum, (n, w)| sum.plus(w, n));
        let mixed = onto(&mixed);
        if mixed.dot(&local.direction).sign() < 0 {
            normal = mixed.unit();
        }
        for ((n, corner), weight) in normals.iter().zip(&corners).zip(&weights) {
            let n = onto(n);
            let height = n.dot(&corner.minus(&point));
            if height.sign() > 0 {
                lift = lift.plus(&(weight * &height), &n);
            }
        }
    }
    if let Some(placement) = placement {
        let columns = placement.rotation().to_cols_array_2d().map(|column| Vector(column.map(Real::from)));
        let turned = |v: &Vector| {
            let [x, y, z] = &v.0;
            nothing.plus(x, &columns[0]).plus(y, &columns[1]).plus(z, &columns[2])
        };
        normal = turned(&normal).unit();
        lift = nothing.plus(&Real::from(placement.scale()), &turned(&lift));
    }
    let is_own = mesh.material().finish().is_some_and(|finish| finish.own);
    let is_of_file = is_own && !mesh.has_material();
    let at = At { model, triangle: k, weights: weights.map(|weight| weight.to_f64()), linear };
    let color = if is_own { at.color() } else { DVec3::ONE };
    let glow = if is_of_file { at.glow() } else { DVec3::ZERO };
    Some(Shaded { normal, lift, color, glow, unlit: is_of_file && model.looks()[model.look(k)].unlit })
}

#[cfg(test)]
mod tests {
    use rayfold_scene::assets::{Library, MemoryFiles};
    use rayfold_scene::{Limits, parse_with_files};
    use rayfold_tracer::reference;

    use crate::oracle;

    /// An octahedron with normals and colours at its vertices.
    const MODEL: &[u8] = b"v 1 0 0 1 .2 .2\nv -1 0 0 .2 1 1\nv 0 1 0 .2 .9 .2\nv 0 -1 0 1 .3 1\nv 0 0 1 .2 .2 1\nv 0 0 -1 1 1 .2
vn 1 0 0\nvn -1 0 0\nvn 0 1 0\nvn 0 -1 0\nvn 0 0 1\nvn 0 0 -1
f 1//1 3//3 5//5\nf 3//3 2//2 5//5\nf 2//2 4//4 5//5\nf 4//4 1//1 5//5
f 3//3 1//1 6//6\nf 2//2 3//3 6//6\nf 4//4 2//2 6//6\nf 1//1 4//4 6//6
";

    #[test]
    fn the_reference_draws_meshes_like_the_oracle() {
        let stage = "Screen 13 11\nLook 3 2.5 5 0 .1 0 32\nBackground .9 .95 1 .3 .5 .9\nIlight .8 .8 .7 -1 -2 -1\nPlight .5 .4 .4 2 \
                     3 2\nMaterial floor ambient .1 .1 .1 diffuse .5 .5 .5\nMaterial red ambient .1 0 0 diffuse .8 .2 .1 shine .4 .4 .4 \
                     30\nMaterial chrome mirror .8 .8 .8\nMaterial glassy glass .95 .97 1 1.5 shine .5 .5 .5 60\nMaterial own \
                     diffuse 1 1 1 own\nDepth 4\nPlane 0 -1.05 0 0.02 1 .01 floor\n";
        let library = Library::new(MemoryFiles::from([("m.obj", MODEL.to_vec())]));
        for mesh in
            ["", " red", " chrome", " glassy", " own", " glassy flat", " red smooth 180", " red smooth 60"]
                .map(|mesh| format!("Mesh \"m.obj\"{mesh}"))
                .into_iter()
                .chain(["", " red", " glassy"].map(|surface| format!("Text \"D\" 1.6 .4{surface} centre")))
        {
            for (used, tone) in [(false, ""), (true, "Tone srgb\n")] {
                let line = format!("{mesh}\n");
                let line = match used {
                    true => format!("Group g\n{line}End\nUse g .1 .2 -.3 10 20 30 .8\n"),
                    false => line,
                };
                let text = format!("{stage}{tone}{line}Trace");
                let parsed = parse_with_files("a.txt", text.as_bytes(), &Limits::default(), &library);
                let scene =
                    parsed.script.unwrap_or_else(|| panic!("{:?}", parsed.diagnostics)).frame(0).unwrap();
                let mut off = 0;
                for (i, j) in (0..13).flat_map(|i| (0..11).map(move |j| (i, j))) {
                    let (exact, found) = (oracle::color(&scene, i, j), reference::color(&scene, i, j));
                    off += u32::from((exact - found).abs().max_element() > 1e-6);
                }
                // A ray may pass an edge on the other side.
                assert!(off <= 1, "{mesh} {tone} {used}: {off} pixels");
            }
        }
    }
}
