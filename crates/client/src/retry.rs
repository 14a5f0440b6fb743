//! Rendering frames of an animation again.

use rayfold_pipeline::keys::Animation;
use rayfold_pipeline::retry::{Retried, Scope, retry};
use rayfold_pipeline::store::Store;
use rayfold_pipeline::{Clock, Invocation, Policy, Randomness};

use crate::client::Client;
use crate::error::Result;

impl<S: Store, C: Clock> Client<'_, S, C> {
    /// Has frames of an animation rendered again, by a renderer of this pixel version.
    ///
    /// # Errors
    /// [`NoAnimation`](crate::Error::NoAnimation), and the errors of the store.
    pub async fn retry(
        &self,
        animation: &Animation,
        scope: Scope<'_>,
        pixels: u32,
        random: &Randomness,
    ) -> Result<Retried> {
        self.must_exist(animation).await?;
        let (policy, request_id) = (Policy::new(pixels), format!("retry-{:016x}", random.bits()));
        let invocation = Invocation::new(self.store, self.clock, random, &policy, &request_id);
        Ok(retry(&invocation, animation, scope).await?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Error;
    use crate::world::{PIXELS, World};
    use rayfold_pipeline::keys::ScriptName;

    #[tokio::test]
    async fn what_failed_is_drawn_again_and_what_is_drawn_only_on_demand() {
        let world = World::new();
        world.put("scripts/film/1.txt", "frame").await;
        world.put("scripts/film/2.txt", "bad").await;
        world.functions().await;
        let random = Randomness::seeded(1);
        let client = world.client();
        let film = world.film();
        let retried = client.retry(&film, Scope::Failed, PIXELS, &random).await.unwrap();
        assert_eq!((retried.deleted, retried.woken), (1, 1));
        world.functions().await;
        let retried = client.retry(&film, Scope::All, PIXELS, &random).await.unwrap();
        assert_eq!((retried.deleted, retried.woken), (2, 2));
        world.functions().await;
        let one = ScriptName::new("1").unwrap();
        let retried = client.retry(&film, Scope::Frame(&one, None), PIXELS, &random).await.unwrap();
        assert_eq!((retried.deleted, retried.woken), (1, 1), "of two");
        let none = Animation::new("none").unwrap();
        let error = client.retry(&none, Scope::All, PIXELS, &random).await.unwrap_err();
        assert!(matches!(error, Error::NoAnimation(name) if name == none));
        assert!(world.keys("retries/none").await.is_empty());
    }
}
