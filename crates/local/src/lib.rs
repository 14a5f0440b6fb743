//! Lambda's and S3's part on one machine: a local invoker and MinIO.
//!
//! [`minio`] finds or builds MinIO and runs it as a child; [`invoker`] runs the function binaries on Lambda's terms and
//! feeds them with MinIO's events by the shared [`routes`]. What happens can be listened to as [`observation`]s.
//!
//! Knows the pipeline's keys and store, and nothing of scenes or pixels. Everything listens on loopback alone, and
//! nothing that was started outlives the process, however it ends.

mod error;
mod functions;
mod guard;
mod http;
pub mod invoker;
mod meter;
pub mod minio;
pub mod observation;
mod platform;
pub mod routes;

pub use error::{Error, Result};
pub use functions::Functions;
pub use platform::{Plan, Platform, connection};
