//! Animations in a bucket, for the page: what would be uploaded and what it costs, the upload, and the progress of
//! each run until its GIF.
//!
//! Works over any [`Store`], so it knows no AWS. The page gets names, states and errors, but never the caller of the
//! store or its credentials. The bucket is the source of truth. Only running uploads are kept in memory, so a page
//! can be closed and reopened, and finds its run by its name.

mod offer;
mod routes;
pub(crate) mod sending;
#[cfg(test)]
mod tests;
pub(crate) mod updates;

use std::fmt;
use std::sync::{Arc, Mutex};

use axum::Router;
use rayfold_pipeline::store::Store;

use crate::project::Project;

/// A bucket for the page, or none.
pub struct Cloud {
    routes: Box<dyn FnOnce(Arc<Mutex<Project>>) -> Router + Send>,
    has_bucket: bool,
}

impl Cloud {
    /// Makes a page without bucket, which explains how to name one.
    pub fn none() -> Self {
        Self { routes: Box::new(|_| routes::without_bucket()), has_bucket: false }
    }

    /// Makes a page with the bucket of this name in this store.
    pub fn new(name: impl Into<String>, store: impl Store + 'static) -> Self {
        let name = name.into();
        Self { routes: Box::new(move |project| routes::with_bucket(name, store, project)), has_bucket: true }
    }

    /// Returns whether there is a bucket to submit to.
    pub(crate) fn has_bucket(&self) -> bool {
        self.has_bucket
    }

    /// Returns the routes that answer the page.
    pub(crate) fn router(self, project: Arc<Mutex<Project>>) -> Router {
        (self.routes)(project)
    }
}

impl fmt::Debug for Cloud {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Cloud").finish_non_exhaustive()
    }
}
