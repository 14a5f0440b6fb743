//! Who uses a bucket, and what every use needs of it. The uses are one module each.

use rayfold_pipeline::keys::{Animation, Uploaded};
use rayfold_pipeline::store::{ListRequest, Listing, Store};
use rayfold_pipeline::{Clock, found};

use crate::error::{Error, Result};

/// Requests of one kind that are under way at once.
pub(crate) const SIDE_BY_SIDE: usize = 32;

/// Someone who uses a bucket.
#[derive(Debug)]
pub struct Client<'a, S, C> {
    pub(crate) store: &'a S,
    pub(crate) clock: &'a C,
}

impl<S, C> Clone for Client<'_, S, C> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<S, C> Copy for Client<'_, S, C> {}

impl<'a, S: Store, C: Clock> Client<'a, S, C> {
    /// Of this bucket, waiting on this clock.
    pub fn new(store: &'a S, clock: &'a C) -> Self {
        Client { store, clock }
    }

    /// Reads a listing to its end.
    pub(crate) async fn list(&self, request: ListRequest) -> Result<Listing> {
        Ok(Listing::read(request, None, |request| self.store.list(request)).await?)
    }

    /// # Errors
    /// [`Error::NoAnimation`] when nothing shows that there is such an animation, or ever was.
    pub async fn must_exist(&self, animation: &Animation) -> Result<()> {
        // A GET, whose refusal says more than that of a HEAD.
        let has_manifest = found(self.store.get_range(&animation.manifest(), 0..1).await)?.is_some();
        if !has_manifest {
            let page = self.list(ListRequest::level(animation.scripts())).await?;
            let mut objects = page.objects.iter();
            if !objects.any(|object| Uploaded::of(&object.key, object.size).animation().is_some()) {
                return Err(Error::NoAnimation(animation.clone()));
            }
        }
        Ok(())
    }
}
