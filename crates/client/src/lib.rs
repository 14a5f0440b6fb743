//! A client for animations in a bucket: uploads scripts, reports progress, downloads frames and GIFs.
//!
//! The command line, the web page and the Python package are built on this crate. Like the functions, the client reads
//! all state from the bucket and keeps none, so an interrupted operation resumes from the bucket's contents. It knows
//! no terminal, no flags and no S3: the bucket is a [`Store`](rayfold_pipeline::store::Store) and time a
//! [`Clock`](rayfold_pipeline::Clock). It reports progress as values ([`Sending`], [`Waiting`], [`RemoveProgress`]) to
//! a closure of the caller.
//!
//! - `submit` makes an animation's folder in the bucket equal to a local one. It deletes only scripts that the caller
//!   asked to delete.
//! - `watch` polls until the outputs exist.
//! - `status`, `fetch`, `retry` and `remove` are the commands of the same names. An object that is replaced during a
//!   read is read again.
//! - `download` writes an output to a file.
//! - `explain` has the words for errors.
//! - [`cost`] estimates the price of an animation on AWS.
//!
//! ```
//! use rayfold_client::{Client, File, Submission, Submitted};
//! use rayfold_pipeline::{SystemClock, keys::{Animation, ScriptName}, store::MemoryStore};
//! # #[tokio::main(flavor = "current_thread")] async fn main() -> rayfold_client::Result<()> {
//! let store = MemoryStore::new(SystemClock);
//! let client = Client::new(&store, &SystemClock);
//! let script = (ScriptName::new("1")?, File::of_text("Screen 4 3\nTrace\n"));
//! let submission = Submission::new(Animation::new("film")?, [script], File::of_text("{\"frames\": 1}\n"))?;
//! let Submitted { versions } = client.submit(&submission, |progress| eprintln!("{progress:?}")).await?;
//! assert!(versions.contains_key("scripts/film/1.txt"));
//! # Ok(()) }
//! ```

mod client;
pub mod cost;
mod download;
mod error;
mod explain;
mod fetch;
mod file;
mod remove;
mod retry;
mod status;
mod submit;
mod watch;

#[cfg(test)]
mod world;

pub use client::Client;
pub use error::{Error, Result};
pub use explain::address;
pub use fetch::{FetchedFrame, FrameKey, Frames, Output, frames};
pub use file::{Content, File};
pub use remove::{Contents, RemoveProgress};
pub use status::{Misplaced, Obstacle, Overview, frame_name, obstacles};
pub use submit::{Preview, Sending, Submission, Submitted, settings_with_frames};
pub use watch::{Ended, Waiting, Watch};

#[cfg(test)]
mod tests {
    use rayfold_pipeline::Randomness;
    use rayfold_pipeline::retry::Scope;

    use super::*;
    use crate::world::World;

    fn is_send<F: Future + Send>(_: F) {}

    struct Nowhere;

    impl Output for Nowhere {
        fn begin(&mut self, _: u64) -> std::io::Result<()> {
            Ok(())
        }

        fn write(&mut self, _: &[u8]) -> std::io::Result<()> {
            Ok(())
        }
    }

    /// A web server moves futures between threads.
    #[test]
    fn what_the_client_does_can_move_between_threads() {
        let world = World::new();
        let (client, film, random) = (world.client(), world.film(), Randomness::seeded(1));
        let submission = Submission::new(film.clone(), [], File::of_text("{}")).unwrap();
        let submitted = Submitted { versions: Default::default() };
        is_send(client.submit(&submission, |_| {}));
        is_send(client.wait(&film, &submitted, |_| {}));
        is_send(client.fetch(&film, rayfold_scene::Container::Gif, &mut Nowhere));
        is_send(client.fetch_frames(&[], |_| Ok(())));
        is_send(client.retry(&film, Scope::All, 1, &random));
        is_send(client.remove(&film, |_| {}));
        is_send(client.animations());
        is_send(client.look(&[]));
    }
}
