//! The parts of Lambda and S3 on one machine: a local invoker and a bucket.
//!
//! - [`S3Server`] is the bucket's server: `crates/bucket` in this process, or MinIO or SeaweedFS as a child
//!   (`process`), which `install` finds or builds. `platform` sets up on it what Terraform sets up on AWS.
//! - [`cluster`] runs an invoker on a bucket of any other S3 server, which it checks first.
//! - [`invoker`] speaks the Lambda Runtime API to the function programs, with Lambda's cold starts, concurrency,
//!   deadlines, retries, failure queue and schedule. A proxy between each process and the store (`invoker::meter`)
//!   counts requests. At a chosen request it can kill the process, refuse the request or lose the reply.
//! - Events come from the store's webhook, or from listings (`invoker::listing`), which the invokers of one bucket
//!   share (`invoker::members`). [`routes`] assigns them to functions, by the same `routes.json` as Terraform.
//! - [`Site`] serves the studio's static page beside the bucket, as the stack does by CloudFront. `person` gives the
//!   page the rights of a person who signs in.
//! - A listener can receive [`observation`]s of all activity.
//!
//! The crate knows the pipeline's keys and store, but no scenes or pixels. Everything listens only on loopback
//! addresses, and no started process outlives this one, however it ends.

pub mod cluster;
mod credentials;
mod error;
mod functions;
mod guard;
mod http;
mod install;
pub mod invoker;
mod minio;
pub mod observation;
mod person;
mod platform;
mod process;
mod program;
mod region;
pub mod routes;
mod s3_server;
mod seaweedfs;
mod site;

pub use credentials::Credentials;
pub use error::{Error, Result};
pub use functions::Functions;
pub use http::any_port;
pub use person::sign_in;
pub use platform::{Plan, Platform, notify};
pub use program::Program;
pub use rayfold_bucket::Webhook;
pub use region::REGION;
pub use s3_server::{S3Server, StoreKind};
pub use site::Site;
