//! The object store as S3 clients see it.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails, also in the functions that tests share")]

mod answers;
mod bodies;
mod conditions;
mod cross_origin;
mod edges;
mod events;
mod listing;
mod model;
mod multipart;
mod objects;
mod protocol;
mod signed;
mod stage;
