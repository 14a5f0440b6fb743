//! S3's operations, by the storage.

use s3s::S3;

/// See the module.
#[derive(Clone, Debug)]
pub(crate) struct Service;

impl Service {
    pub(crate) fn new() -> Self {
        Self
    }
}

#[async_trait::async_trait]
impl S3 for Service {}
