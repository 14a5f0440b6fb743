//! The rate at which new processes may start: Lambda's token bucket.

use std::time::Instant;

/// The rate at which new processes may start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ramp {
    /// The number that may start at once.
    pub burst: u32,
    /// The rate after the burst, per second.
    pub per_second: f64,
}

/// Lambda's own rate: 1,000 every ten seconds.
impl Default for Ramp {
    fn default() -> Self {
        Self { burst: 1000, per_second: 100.0 }
    }
}

/// The token bucket that enforces a ramp.
pub(crate) struct Tokens {
    ramp: Ramp,
    tokens: f64,
    filled: Option<Instant>,
}

impl Tokens {
    pub(crate) fn new(ramp: Ramp) -> Self {
        Self { ramp, tokens: f64::from(ramp.burst), filled: None }
    }

    pub(crate) fn take(&mut self, now: Instant) -> bool {
        let since = self.filled.map_or(0.0, |filled| now.saturating_duration_since(filled).as_secs_f64());
        self.filled = Some(now);
        self.tokens = (self.tokens + since * self.ramp.per_second).min(f64::from(self.ramp.burst));
        let has_one = self.tokens >= 1.0;
        if has_one {
            self.tokens -= 1.0;
        }
        has_one
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn the_ramp_lets_a_burst_through_and_then_a_trickle() {
        let mut tokens = Tokens::new(Ramp { burst: 3, per_second: 10.0 });
        let start = Instant::now();
        let taken = |tokens: &mut Tokens, ms| tokens.take(start + Duration::from_millis(ms));
        assert!((0..3).all(|_| taken(&mut tokens, 0)));
        assert!(!taken(&mut tokens, 50));
        assert!(taken(&mut tokens, 101));
        assert!(!taken(&mut tokens, 102));
        assert!((0..3).all(|_| taken(&mut tokens, 10_000)));
        assert!(!taken(&mut tokens, 10_000));
    }
}
