//! Animations in a bucket, for the page: what would be sent and what that costs, sending it, and how each run stands until
//! it is a GIF.
//!
//! Works over any [`Store`], so it knows no AWS, and the page hears names, states and faults, never who asks the store or
//! with which credentials. What stands in the bucket is the truth: only an upload that goes on is remembered here, so
//! that a page can be closed, opened again, and finds its run by its name.

mod offer;
mod routes;
mod sending;
#[cfg(test)]
mod tests;
mod updates;

use std::fmt;
use std::sync::{Arc, Mutex};

use axum::Router;
use rayfold_pipeline::store::Store;

use crate::project::Project;

/// A bucket for the page, or none.
pub struct Cloud(Box<dyn FnOnce(Arc<Mutex<Project>>) -> Router + Send>);

impl Cloud {
    /// The page says how to name one.
    pub fn none() -> Self {
        Self(Box::new(|_| routes::without_bucket()))
    }

    /// The bucket of this name, which is this store.
    pub fn new(name: impl Into<String>, store: impl Store + 'static) -> Self {
        let name = name.into();
        Self(Box::new(move |project| routes::with_bucket(name, store, project)))
    }

    /// What answers the page.
    pub(crate) fn router(self, project: Arc<Mutex<Project>>) -> Router {
        (self.0)(project)
    }
}

impl fmt::Debug for Cloud {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Cloud").finish_non_exhaustive()
    }
}
