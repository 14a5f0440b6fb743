//! The client: a bucket's store and a clock. Each operation on it is a module of its own.

use rayfold_pipeline::keys::{Animation, Uploaded};
use rayfold_pipeline::store::{ListRequest, Listing, Store};
use rayfold_pipeline::{Clock, found};

use crate::error::{Error, Result};

/// The largest number of requests of one kind at the same time.
pub(crate) const SIDE_BY_SIDE: usize = 32;

/// A client of a bucket.
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
    /// Makes a client of this bucket, which waits on this clock.
    pub fn new(store: &'a S, clock: &'a C) -> Self {
        Client { store, clock }
    }

    /// Reads a listing to its end.
    pub(crate) async fn list(&self, request: ListRequest) -> Result<Listing> {
        Ok(Listing::read(request, None, |request| self.store.list(request)).await?)
    }

    /// Checks that the animation exists.
    ///
    /// # Errors
    /// [`Error::NoAnimation`] if nothing shows that the animation exists or ever existed.
    pub async fn must_exist(&self, animation: &Animation) -> Result<()> {
        // A GET, because its refusal says more than that of a HEAD.
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
