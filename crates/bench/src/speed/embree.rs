//! Embree as a peer, if a C++ compiler and its headers are installed: camera and shadow rays against a mesh.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use rayfold_scene::{Camera, Light, Object, Scene};

const SOURCE: &str = include_str!("embree_peer.cpp");

/// The processor time of one image's rays on one thread, without building the tree.
pub(crate) struct Seconds {
    /// The time of the camera rays, singly and in packets.
    pub(crate) camera: [f64; 2],
    /// The time with a shadow ray from each hit in addition.
    pub(crate) lit: [f64; 2],
    /// The number of rays that hit the mesh.
    pub(crate) hits: u64,
    /// The number of hits in shadow.
    pub(crate) dark: u64,
}

/// Compiles the peer program. Returns the reason if it cannot be compiled.
pub(crate) fn compile(folder: &Path) -> Result<Result<PathBuf, String>> {
    let (source, program) = (folder.join("embree_peer.cpp"), folder.join("embree_peer"));
    std::fs::write(&source, SOURCE)?;
    let run = Command::new("c++")
        .args(["-O3", "-march=native", "-std=c++17"])
        .args([&source, Path::new("-o"), &program, Path::new("-lembree3")])
        .output();
    Ok(match run {
        Err(error) => Err(format!("no C++ compiler: {error}")),
        Ok(run) if run.status.success() => Ok(program),
        Ok(run) => Err(String::from_utf8_lossy(&run.stderr).lines().next().unwrap_or_default().to_owned()),
    })
}

/// Runs the peer on the triangles of a scene with a pinhole camera, a light and a square screen. The width is a
/// multiple of 4.
pub(crate) fn run(program: &Path, folder: &Path, scene: &Scene, rounds: u32) -> Result<Seconds> {
    let mut corners = Vec::new();
    for object in scene.objects.iter() {
        let Object::Triangle(triangle) = object else { continue };
        for vertex in triangle.vertices() {
            corners.extend(vertex.as_vec3().to_array().iter().flat_map(|x| x.to_le_bytes()));
        }
    }
    let (mesh, view) = (folder.join("mesh.f32"), folder.join("view.txt"));
    std::fs::write(&mesh, corners)?;
    let Camera::Pinhole(pinhole) = scene.camera else { anyhow::bail!("only a pinhole camera") };
    let (u, v, w) = pinhole.basis();
    let (a, b) = (pinhole.lower_left(), pinhole.upper_right());
    let steps = f64::from(scene.screen.width() - 1);
    let corner = a.x * u + a.y * v - pinhole.distance() * w;
    let [Light::Directional(light)] = scene.lights[..] else { anyhow::bail!("only one light") };
    let towards = -light.direction().normalize();
    let numbers = [pinhole.eye(), corner, (b.x - a.x) / steps * u, (b.y - a.y) / steps * v, towards];
    let text: Vec<String> = numbers.iter().flat_map(|v| v.to_array()).map(|x| format!("{x:e}")).collect();
    std::fs::write(&view, text.join(" "))?;
    let run = Command::new(program)
        .args([&mesh, &view])
        .args([scene.screen.width().to_string(), rounds.to_string()])
        .output()?;
    ensure!(run.status.success(), "the Embree peer: {}", run.status);
    let answer = String::from_utf8(run.stdout)?;
    let fields: Vec<&str> = answer.split_whitespace().collect();
    let [single, packets, lit_single, lit_packets, hits, same, dark, _] = fields[..] else {
        anyhow::bail!("the Embree peer says {answer}")
    };
    ensure!(hits == same, "Embree's own ways meet {hits} and {same} times");
    let number = |text: &str| text.parse().with_context(|| format!("the Embree peer says {answer}"));
    Ok(Seconds {
        camera: [number(single)?, number(packets)?],
        lit: [number(lit_single)?, number(lit_packets)?],
        hits: hits.parse()?,
        dark: dark.parse()?,
    })
}
