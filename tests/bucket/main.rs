//! The object store as S3 clients see it.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails, also in the functions that tests share")]

mod answers;
mod bodies;
mod conditions;
mod cross_origin;
mod damage;
mod edges;
mod events;
mod identity;
mod kill;
mod listing;
mod model;
mod multipart;
mod objects;
mod process;
mod protocol;
mod room;
mod signed;
mod stage;
