//! The time of the system, or that of the page if there is no system.

#[cfg(target_arch = "wasm32")]
pub(crate) use page::{Instant, set};
#[cfg(not(target_arch = "wasm32"))]
pub(crate) use std::time::Instant;

#[cfg(target_arch = "wasm32")]
mod page {
    use std::sync::atomic::{AtomicU64, Ordering};
    use std::time::Duration;

    /// The time that the page has set last, in microseconds.
    static NOW: AtomicU64 = AtomicU64::new(0);

    /// A moment, as `std::time::Instant`.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    pub(crate) struct Instant(Duration);

    /// Sets the time since an arbitrary moment.
    pub(crate) fn set(micros: u64) {
        NOW.store(micros, Ordering::Relaxed);
    }

    impl Instant {
        pub(crate) fn now() -> Self {
            Self(Duration::from_micros(NOW.load(Ordering::Relaxed)))
        }

        pub(crate) fn elapsed(&self) -> Duration {
            Self::now().saturating_duration_since(*self)
        }

        pub(crate) fn saturating_duration_since(&self, earlier: Self) -> Duration {
            self.0.saturating_sub(earlier.0)
        }
    }

    impl std::ops::Add<Duration> for Instant {
        type Output = Self;

        fn add(self, time: Duration) -> Self {
            Self(self.0 + time)
        }
    }
}
