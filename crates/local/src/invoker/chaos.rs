//! The faults of events and processes that the platform makes on purpose, from a seed.
//!
//! A seed always draws the same faults in the same order; the order in which the store reports events still decides
//! which event gets which fault.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use crate::observation::{Attempt, StoreRequest};

/// The switches; all off by default.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Chaos {
    /// The seed of all random choices.
    pub seed: u64,
    /// The probability that an event is delivered twice.
    pub duplicate: f64,
    /// The probability that an event is delayed, by up to `delay_up_to`.
    pub delay: f64,
    /// The longest delay of an event.
    pub delay_up_to: Duration,
    /// Events are held back until none has arrived for this long, and are then delivered newest first.
    pub reverse_after: Option<Duration>,
    /// The probability that an event is lost.
    pub drop: f64,
    /// The probability that the process of an invocation is killed, at a random time up to `kill_within`.
    pub kill: f64,
    /// The latest time of a kill within its invocation.
    pub kill_within: Duration,
}

/// The fault of a request that a process is about to send to the store.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// The request goes through.
    Pass,
    /// The process is killed; the store never sees the request.
    KillBefore,
    /// The store receives the request; the process is killed before the reply.
    KillAfter,
    /// The store receives the request; the connection of the process breaks.
    LoseAnswer,
    /// The reply says that the store is overloaded: 503.
    SlowDown,
}

/// Decides the fault of each request to the store.
pub type Fates = Arc<dyn Fn(&Attempt, &StoreRequest) -> Fate + Send + Sync>;

/// The chaos of one invoker.
#[derive(Debug)]
pub(crate) struct Dice {
    chaos: Chaos,
    random: Mutex<fastrand::Rng>,
}

impl Dice {
    pub(crate) fn new(chaos: Chaos) -> Self {
        let random = Mutex::new(fastrand::Rng::with_seed(chaos.seed));
        Self { chaos, random }
    }

    /// The pauses after which an event is delivered: none, one or two deliveries.
    pub(crate) fn deliveries(&self) -> Vec<Duration> {
        let mut random = self.random.lock().unwrap_or_else(PoisonError::into_inner);
        if random.f64() < self.chaos.drop {
            return Vec::new();
        }
        let copies = 1 + usize::from(random.f64() < self.chaos.duplicate);
        (0..copies)
            .map(|_| {
                let late = random.f64() < self.chaos.delay;
                if late { self.chaos.delay_up_to.mul_f64(random.f64()) } else { Duration::ZERO }
            })
            .collect()
    }

    /// The time at which the process of the next invocation is killed, if it is.
    pub(crate) fn kill_after(&self) -> Option<Duration> {
        let mut random = self.random.lock().unwrap_or_else(PoisonError::into_inner);
        (random.f64() < self.chaos.kill).then(|| self.chaos.kill_within.mul_f64(random.f64()))
    }

    pub(crate) fn reverse_after(&self) -> Option<Duration> {
        self.chaos.reverse_after
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_draws_the_same_fates_again() {
        let chaos = Chaos {
            seed: 7,
            duplicate: 0.3,
            delay: 0.5,
            delay_up_to: Duration::from_millis(50),
            drop: 0.1,
            kill: 0.2,
            kill_within: Duration::from_secs(1),
            ..Chaos::default()
        };
        let draw = |dice: Dice| (0..200).map(|_| (dice.deliveries(), dice.kill_after())).collect::<Vec<_>>();
        let fates = draw(Dice::new(chaos.clone()));
        assert_eq!(fates, draw(Dice::new(chaos.clone())));
        assert_ne!(fates, draw(Dice::new(Chaos { seed: 8, ..chaos })));
        assert!(fates.iter().any(|(deliveries, _)| deliveries.is_empty()));
        assert!(fates.iter().any(|(deliveries, _)| deliveries.len() == 2));
        assert!(fates.iter().any(|(_, kill)| kill.is_some()));
    }

    #[test]
    fn without_chaos_every_event_comes_once_and_at_once() {
        let dice = Dice::new(Chaos::default());
        assert!((0..100).all(|_| dice.deliveries() == [Duration::ZERO] && dice.kill_after().is_none()));
    }
}
