//! Uploads that go on: they outlive the page that began them, and end with the program.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use rayfold_client::{Error, Sending};
use rayfold_pipeline::keys::Animation;
use serde::Serialize;

use crate::error::words;

/// Uploads that are known, at most; the ended ones are forgotten first.
const KNOWN: usize = 64;

/// How far an upload is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case", tag = "is")]
pub(super) enum SendingTell {
    /// It goes on.
    Uploading {
        /// So many scripts are there.
        done: u64,
        /// Of so many.
        total: u64,
    },
    /// It has ended before all was there.
    Failed {
        /// Why.
        why: String,
    },
}

/// The uploads of this program by animation.
#[derive(Debug, Default)]
pub(super) struct Uploads {
    known: Mutex<BTreeMap<Animation, SendingTell>>,
    ended: AtomicU64,
}

impl Uploads {
    /// Takes note of a new one; not if one of this animation goes on, or too many do.
    pub(super) fn begin(&self, animation: &Animation) -> bool {
        let mut known = self.known();
        if matches!(known.get(animation), Some(SendingTell::Uploading { .. })) {
            return false;
        }
        if known.len() >= KNOWN {
            known.retain(|_, sending| matches!(sending, SendingTell::Uploading { .. }));
        }
        if known.len() >= KNOWN {
            return false;
        }
        known.insert(animation.clone(), SendingTell::Uploading { done: 0, total: 0 });
        true
    }

    /// Takes note of how far it is.
    pub(super) fn note(&self, animation: &Animation, sending: &Sending) {
        if let Sending::Uploading { done, total } = *sending {
            self.known().insert(animation.clone(), SendingTell::Uploading { done, total });
        }
    }

    /// Takes note of its end.
    pub(super) fn end<T>(&self, animation: &Animation, ended: Result<T, Error>) {
        let mut known = self.known();
        self.ended.fetch_add(1, Ordering::Relaxed);
        match ended {
            Ok(_) => drop(known.remove(animation)),
            Err(error) => {
                drop(known.insert(animation.clone(), SendingTell::Failed { why: words(&error) }));
            }
        }
    }

    /// How many have ended: when that grows the bucket may hold other scripts than were seen last.
    pub(super) fn ended(&self) -> u64 {
        self.ended.load(Ordering::Relaxed)
    }

    /// How far it is, if it goes on or failed.
    pub(super) fn of(&self, animation: &Animation) -> Option<SendingTell> {
        self.known().get(animation).cloned()
    }

    /// All that go on or failed.
    pub(super) fn all(&self) -> Vec<Animation> {
        self.known().keys().cloned().collect()
    }

    fn known(&self) -> MutexGuard<'_, BTreeMap<Animation, SendingTell>> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_upload_is_one_at_a_time_and_its_failure_is_known_until_the_next() {
        let uploads = Uploads::default();
        let film = Animation::new("film").unwrap();
        assert!(uploads.begin(&film) && !uploads.begin(&film));
        uploads.note(&film, &Sending::Uploading { done: 1, total: 3 });
        assert_eq!(uploads.of(&film), Some(SendingTell::Uploading { done: 1, total: 3 }));
        uploads.end::<()>(&film, Err(Error::NoAnimation(film.clone())));
        assert_eq!(uploads.of(&film), Some(SendingTell::Failed { why: "there is no animation film".into() }));
        assert!(uploads.begin(&film));
        uploads.end(&film, Ok(()));
        assert_eq!((uploads.of(&film), uploads.ended()), (None, 2));
    }

    #[test]
    fn no_more_uploads_are_remembered_than_there_is_room_for() {
        let uploads = Uploads::default();
        let name = |n: usize| Animation::new(&format!("film{n}")).unwrap();
        assert!((0..KNOWN).all(|n| uploads.begin(&name(n))));
        assert!(!uploads.begin(&name(KNOWN)));
        uploads.end::<()>(&name(3), Err(Error::NoAnimation(name(3))));
        assert!(uploads.begin(&name(KNOWN)), "an ended one makes room");
        assert_eq!(uploads.all().len(), KNOWN);
    }
}
