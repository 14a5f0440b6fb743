//! The number of cores to use.

use std::num::NonZeroUsize;

use anyhow::Context;

use crate::console::Console;
use crate::values;

/// The maximum number of threads per processor. More only take memory.
const MAX_PER_PROCESSOR: usize = 4;

/// `--threads`, for every subcommand that draws or encodes.
#[derive(Clone, Copy, Debug, clap::Args)]
pub(crate) struct Threads {
    /// Number of threads, at most four per core; all cores when not given. The result is the same for any number
    #[arg(long, value_name = "N", value_parser = values::count::<usize>, allow_negative_numbers = true)]
    threads: Option<usize>,
}

impl Threads {
    /// Sets up the thread pool of this process. Call it once, before anything runs on the pool.
    ///
    /// # Errors
    /// Fails if the threads cannot be started.
    pub(crate) fn start(self) -> anyhow::Result<()> {
        rayon::ThreadPoolBuilder::new()
            .num_threads(self.threads.map_or(0, |asked| asked.min(most())))
            .build_global()
            .context("cannot start the threads")
    }

    /// Warns if fewer threads are started than were asked for.
    pub(crate) fn tell(self, console: &Console) {
        if let Some(asked) = self.threads.filter(|asked| *asked > most()) {
            console.warn(format_args!(
                "{} threads are used instead of {asked}: at most {MAX_PER_PROCESSOR} for each processor",
                most()
            ));
        }
    }
}

fn most() -> usize {
    let processors = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    MAX_PER_PROCESSOR * processors
}
