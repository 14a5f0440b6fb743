//! Scene scripts to typed scenes and back, with every diagnostic.
//!
//! Knows no other crate of the project and does no I/O: text comes in, trees and diagnostics go out.

pub mod model;

pub use model::{
    Camera, Cuboid, DirectionalLight, InvalidValue, Light, Material, Object, Pinhole, Scene, Screen, Sphere,
    Triangle,
};
