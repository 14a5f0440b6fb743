//! Processor time in seconds, which can be measured on a machine with other load.

use std::time::Duration;

use anyhow::Result;
use nix::sys::resource::{UsageWho, getrusage};
use nix::time::{ClockId, clock_gettime};

/// Runs `work`. Returns the processor time of all threads of this program in seconds, and the result.
///
/// # Errors
/// Fails if the clock cannot be read.
pub fn of<T>(work: impl FnOnce() -> T) -> Result<(f64, T)> {
    let before = Duration::from(clock_gettime(ClockId::CLOCK_PROCESS_CPUTIME_ID)?);
    let result = work();
    let after = Duration::from(clock_gettime(ClockId::CLOCK_PROCESS_CPUTIME_ID)?);
    Ok(((after - before).as_secs_f64(), result))
}

/// Runs `work` on a pool. Returns the processor time in seconds of its busiest thread, and the result. That is the time by the
/// clock on as many free cores, except for waiting.
///
/// # Errors
/// Fails if a clock cannot be read.
pub fn of_busiest<T: Send>(pool: &rayon::ThreadPool, work: impl FnOnce() -> T + Send) -> Result<(f64, T)> {
    let times = || {
        let time = |_: rayon::BroadcastContext<'_>| clock_gettime(ClockId::CLOCK_THREAD_CPUTIME_ID);
        pool.broadcast(time).into_iter().collect::<Result<Vec<_>, _>>()
    };
    let before = times()?;
    let result = pool.install(work);
    let passed = times()?.into_iter().zip(before).map(|(after, before)| Duration::from(after - before));
    Ok((passed.max().unwrap_or_default().as_secs_f64(), result))
}

/// Runs `work`. Returns the user processor time in seconds of the child processes that it starts and waits for, and the
/// result.
///
/// # Errors
/// Fails if the usage cannot be read.
pub fn of_children<T>(work: impl FnOnce() -> T) -> Result<(f64, T)> {
    let used = || -> Result<f64> {
        let time = getrusage(UsageWho::RUSAGE_CHILDREN)?.user_time();
        Ok(time.tv_sec() as f64 + time.tv_usec() as f64 * 1e-6)
    };
    let before = used()?;
    let result = work();
    Ok((used()? - before, result))
}

/// Returns the median of the measurements; NaN if there are none.
pub fn median(mut seconds: Vec<f64>) -> f64 {
    seconds.sort_by(f64::total_cmp);
    seconds.get(seconds.len() / 2).copied().unwrap_or(f64::NAN)
}
