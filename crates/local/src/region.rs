//! The region of all local parts.

/// The default region of S3.
pub const REGION: &str = "us-east-1";
