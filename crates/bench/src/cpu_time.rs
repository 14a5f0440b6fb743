//! Seconds of processor time: what a machine that others use as well can measure.

use std::time::Duration;

use anyhow::Result;
use nix::sys::resource::{UsageWho, getrusage};
use nix::time::{ClockId, clock_gettime};

/// Processor time of `work` in all threads of this program, in seconds, and what it returned.
///
/// # Errors
/// When the clock cannot be read.
pub fn of<T>(work: impl FnOnce() -> T) -> Result<(f64, T)> {
    let before = Duration::from(clock_gettime(ClockId::CLOCK_PROCESS_CPUTIME_ID)?);
    let result = work();
    let after = Duration::from(clock_gettime(ClockId::CLOCK_PROCESS_CPUTIME_ID)?);
    Ok(((after - before).as_secs_f64(), result))
}

/// User processor time of the child processes that `work` starts and waits for, in seconds, and what it returned.
///
/// # Errors
/// When the usage cannot be read.
pub fn of_children<T>(work: impl FnOnce() -> T) -> Result<(f64, T)> {
    let used = || -> Result<f64> {
        let time = getrusage(UsageWho::RUSAGE_CHILDREN)?.user_time();
        Ok(time.tv_sec() as f64 + time.tv_usec() as f64 * 1e-6)
    };
    let before = used()?;
    let result = work();
    Ok((used()? - before, result))
}

/// The middle of the measurements; not a number when there are none.
pub fn median(mut seconds: Vec<f64>) -> f64 {
    seconds.sort_by(f64::total_cmp);
    seconds.get(seconds.len() / 2).copied().unwrap_or(f64::NAN)
}
