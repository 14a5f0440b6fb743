//! The object store from outside: what S3's clients see of it.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails, also in the functions that tests share")]

mod answers;
mod conditions;
mod events;
mod listing;
mod multipart;
mod objects;
mod protocol;
mod stage;
