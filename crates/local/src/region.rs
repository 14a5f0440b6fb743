//! The region that everything on this machine says it is in.

/// The one that S3 itself takes when none is named.
pub const REGION: &str = "us-east-1";
