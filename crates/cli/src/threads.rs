//! How many cores to use.

use anyhow::Context;

use crate::values;

/// `--threads`, for every subcommand that draws or encodes.
#[derive(Clone, Copy, Debug, clap::Args)]
pub(crate) struct Threads {
    /// How many threads to use; all cores when not given. The result is the same for any number
    #[arg(long, value_name = "N", value_parser = values::count::<usize>)]
    threads: Option<usize>,
}

impl Threads {
    /// Sets up the pool that everything in this process runs on; to be called once, before any of that.
    ///
    /// # Errors
    /// When the threads cannot be started.
    pub(crate) fn start(self) -> anyhow::Result<()> {
        rayon::ThreadPoolBuilder::new()
            .num_threads(self.threads.unwrap_or(0))
            .build_global()
            .context("cannot start the threads")
    }
}
