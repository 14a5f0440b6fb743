//! Time and randomness are passed in. A step that uses no others can be replayed from a seed.

use std::future::Future;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use serde::{Deserialize, Serialize};

/// A moment in milliseconds since 1970-01-01T00:00:00Z.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Timestamp(pub u64);

impl Timestamp {
    /// Returns the time from `earlier` to `self`; zero if `earlier` is later.
    pub fn since(self, earlier: Timestamp) -> Duration {
        Duration::from_millis(self.0.saturating_sub(earlier.0))
    }

    /// The moment `duration` after this one.
    pub fn after(self, duration: Duration) -> Timestamp {
        Timestamp(self.0.saturating_add(u64::try_from(duration.as_millis()).unwrap_or(u64::MAX)))
    }
}

/// A clock on which a task can also wait.
pub trait Clock: Send + Sync {
    /// Returns the current time. It need not be exact: ages are compared with seconds of tolerance.
    fn now(&self) -> Timestamp;

    /// Waits for at least `duration`.
    fn sleep(&self, duration: Duration) -> impl Future<Output = ()> + Send;
}

/// The machine's clock. It needs a tokio runtime with a timer.
#[derive(Debug, Clone, Copy, Default)]
pub struct SystemClock;

impl Clock for SystemClock {
    #[expect(clippy::disallowed_methods, reason = "this is the one place where the machine's clock enters")]
    fn now(&self) -> Timestamp {
        let elapsed =
            std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or(Duration::ZERO);
        Timestamp(0).after(elapsed)
    }

    #[expect(clippy::disallowed_methods, reason = "this is the one place where the machine's clock enters")]
    async fn sleep(&self, duration: Duration) {
        tokio::time::sleep(duration).await;
    }
}

/// A seeded source of randomness (SplitMix64; Steele, Lea & Flood 2014). It spreads retries, and is not secret.
#[derive(Debug)]
pub struct Randomness(AtomicU64);

impl Randomness {
    /// Returns a source whose draws depend on the seed alone.
    pub fn seeded(seed: u64) -> Self {
        Randomness(AtomicU64::new(seed))
    }

    /// The next 64 random bits.
    pub fn bits(&self) -> u64 {
        let step = 0x9e37_79b9_7f4a_7c15_u64;
        let mut z = self.0.fetch_add(step, Ordering::Relaxed).wrapping_add(step);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Returns a number below `bound`, or 0 if `bound` is 0.
    pub fn below(&self, bound: u64) -> u64 {
        u64::try_from((u128::from(self.bits()) * u128::from(bound)) >> 64).unwrap_or(0)
    }

    /// A duration from zero up to `most`.
    pub fn up_to(&self, most: Duration) -> Duration {
        Duration::from_micros(
            self.below(u64::try_from(most.as_micros()).unwrap_or(u64::MAX).saturating_add(1)),
        )
    }

    /// Returns `true` once in `of` draws, on average.
    pub fn one_in(&self, of: u64) -> bool {
        self.below(of) == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_differ_by_milliseconds() {
        let (early, late) = (Timestamp(1_000), Timestamp(3_500));
        assert_eq!(late.since(early), Duration::from_millis(2_500));
        assert_eq!(early.since(late), Duration::ZERO);
        assert_eq!(early.after(Duration::from_millis(2_500)), late);
        assert_eq!(late.after(Duration::MAX), Timestamp(u64::MAX));
    }

    #[tokio::test]
    async fn the_machines_clock_goes_on_while_one_sleeps() {
        let before = SystemClock.now();
        assert!(before > Timestamp(1_600_000_000_000), "it is later than 2020: {before:?}");
        SystemClock.sleep(Duration::from_millis(30)).await;
        assert!(SystemClock.now().since(before) >= Duration::from_millis(25));
    }

    /// The numbers that the authors' program prints.
    #[test]
    fn chance_is_that_of_splitmix64() {
        let random = Randomness::seeded(1_234_567);
        let expected = [
            6_457_827_717_110_365_317,
            3_203_168_211_198_807_973,
            9_817_491_932_198_370_423,
            4_593_380_528_125_082_431,
            16_408_922_859_458_223_821,
        ];
        assert_eq!(expected.map(|_| random.bits()), expected);
    }

    #[test]
    fn draws_are_below_their_bound_and_reach_it() {
        let random = Randomness::seeded(1);
        let draws: std::collections::BTreeSet<u64> = (0..100).map(|_| random.below(5)).collect();
        assert_eq!(draws, (0..5).collect());
        assert_eq!((random.below(0), random.below(1)), (0, 0));
        let most = Duration::from_micros(3);
        let draws: std::collections::BTreeSet<Duration> = (0..100).map(|_| random.up_to(most)).collect();
        assert_eq!(draws, (0..=3).map(Duration::from_micros).collect());
        let times = (0..1_000).filter(|_| random.one_in(4)).count();
        assert!((180..320).contains(&times), "{times} of 1,000 are one in four");
        assert!((0..10).all(|_| random.one_in(1)));
    }
}
