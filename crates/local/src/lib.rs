//! Lambda's and S3's part on one machine: a local invoker and a bucket.
//!
//! [`S3Server`] is the bucket's server, built in or MinIO; [`invoker`] runs the function binaries on Lambda's terms and
//! feeds them with the bucket's events by the shared [`routes`]. What happens can be listened to as [`observation`]s.
//!
//! Knows the pipeline's keys and store, and nothing of scenes or pixels. Everything listens on loopback alone, and
//! nothing that was started outlives the process, however it ends.

mod credentials;
mod error;
mod functions;
mod guard;
mod http;
pub mod invoker;
pub mod minio;
pub mod observation;
mod platform;
mod region;
pub mod routes;
mod s3_server;

pub use credentials::Credentials;
pub use error::{Error, Result};
pub use functions::Functions;
pub use http::any_port;
pub use platform::{Plan, Platform, notify};
pub use rayfold_bucket::Webhook;
pub use region::REGION;
pub use s3_server::{S3Server, StoreKind};
