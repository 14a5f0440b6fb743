//! How many cores to use.

use std::num::NonZeroUsize;

use anyhow::Context;

/// `--threads`, for every subcommand that draws or encodes.
#[derive(Clone, Copy, Debug, clap::Args)]
pub(crate) struct Threads {
    /// How many threads to use; all cores when not given. The result is the same for any number
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
}

impl Threads {
    /// Sets up the pool that everything in this process runs on; to be called once, before any of that.
    ///
    /// # Errors
    /// When the threads cannot be started.
    pub(crate) fn start(self) -> anyhow::Result<()> {
        rayon::ThreadPoolBuilder::new()
            .num_threads(self.threads.map_or(0, NonZeroUsize::get))
            .build_global()
            .context("cannot start the threads")
    }
}
