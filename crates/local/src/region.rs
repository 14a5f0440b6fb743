//! The region of all local parts.

/// S3's default region.
pub const REGION: &str = "us-east-1";
