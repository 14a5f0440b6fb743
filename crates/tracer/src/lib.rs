//! Scenes to images, deterministically.
