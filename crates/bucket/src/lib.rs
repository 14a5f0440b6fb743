//! An S3-compatible object store in a folder, which runs in the process that starts it.
//!
//! [`Server::start`] opens the folder and serves S3's protocol on an address. The caller provides the owner's key
//! ([`Options::root`]) and the receiver of events ([`Options::webhook`]). Every acknowledged change is on disk, and its
//! event is written in the same commit.
//!
//! The store does not interpret keys or bodies.
//!
//! ```no_run
//! use rayfold_bucket::{Credentials, Options, Server};
//! # async fn example() -> rayfold_bucket::Result<()> {
//! let server = Server::start(Options {
//!     data: "data".into(),
//!     address: ([127, 0, 0, 1], 0).into(),
//!     root: Credentials { access_key: "key".into(), secret_key: "secret".into() },
//!     region: "us-east-1".into(),
//!     webhook: None,
//! })
//! .await?;
//! println!("http://{}", server.address());
//! server.stop().await;
//! # Ok(()) }
//! ```
//!
//! A request passes these modules:
//!
//! 1. `connection_service` gives it an id. `gate` refuses every operation, header and element that its tables lack.
//!    `cors` answers browsers.
//! 2. `s3s` (a dependency) checks signatures and parses the protocol. `identity` and `policy` decide about the caller's
//!    rights.
//! 3. `service` has one module per family of operations. `ingest` and `body_stream` stream bodies.
//! 4. `storage::writer` commits pending changes as one batch with one sync of the `journal`, then applies it to
//!    `database` (redb). `bodies` stores large bodies as files. `delivery` sends events to the webhook.
//!
//! `opening` refuses files that are damaged or do not belong together. `check` and `salvage` read a damaged folder.
//! `medium` is an interface to the disk, so that tests can cut the power (`power`) and damage files (`damage`).
//!
//! Invariants: a refusal changes nothing. A body file without a row is garbage.

mod answer;
mod check;
mod checksum;
mod connection_service;
mod cors;
mod delivery;
mod error;
mod events;
mod expiry;
mod gate;
mod host;
mod identity;
mod limits;
mod options;
pub mod policy;
pub mod private;
mod records;
mod replies;
mod server;
mod service;
mod storage;

pub use check::{Report, check};
pub use error::{Error, Result};
pub use options::{Credentials, Options, QUEUE_ARN, Webhook};
pub use server::Server;
pub use storage::Damage;
