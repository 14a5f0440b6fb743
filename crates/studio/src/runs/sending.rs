//! Running uploads: they outlive the page that started them, and end with the program.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use rayfold_client::{Error, Sending};
use rayfold_pipeline::keys::Animation;
use serde::Serialize;

use crate::error::words;

/// The largest number of uploads in memory. Ended ones are forgotten first.
const KNOWN: usize = 64;

/// The progress of an upload.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "kebab-case", tag = "is")]
pub(crate) enum UploadProgress {
    /// The upload is running.
    Uploading {
        /// The number of uploaded scripts.
        done: u64,
        /// The number of scripts to upload.
        total: u64,
    },
    /// The upload ended before everything was uploaded.
    Failed {
        /// The reason of the failure.
        why: String,
    },
}

/// The uploads of this program by animation.
#[derive(Debug, Default)]
pub(super) struct Uploads {
    known: Mutex<BTreeMap<Animation, UploadProgress>>,
    ended: AtomicU64,
}

impl Uploads {
    /// Records a new upload. Returns `false` if one of this animation or too many others are running.
    pub(super) fn begin(&self, animation: &Animation) -> bool {
        let mut known = self.known();
        if matches!(known.get(animation), Some(UploadProgress::Uploading { .. })) {
            return false;
        }
        if known.len() >= KNOWN {
            known.retain(|_, sending| matches!(sending, UploadProgress::Uploading { .. }));
        }
        if known.len() >= KNOWN {
            return false;
        }
        known.insert(animation.clone(), UploadProgress::Uploading { done: 0, total: 0 });
        true
    }

    /// Records the progress of an upload.
    pub(super) fn note(&self, animation: &Animation, sending: &Sending) {
        if let Sending::Uploading { done, total } = *sending {
            self.known().insert(animation.clone(), UploadProgress::Uploading { done, total });
        }
    }

    /// Records the end of an upload.
    pub(super) fn end<T>(&self, animation: &Animation, ended: Result<T, Error>) {
        let mut known = self.known();
        self.ended.fetch_add(1, Ordering::Relaxed);
        match ended {
            Ok(_) => drop(known.remove(animation)),
            Err(error) => {
                drop(known.insert(animation.clone(), UploadProgress::Failed { why: words(&error) }));
            }
        }
    }

    /// Returns the number of ended uploads. When it grows, the bucket may hold other scripts than those seen last.
    pub(super) fn ended(&self) -> u64 {
        self.ended.load(Ordering::Relaxed)
    }

    /// Returns the progress of an upload that is running or failed.
    pub(super) fn of(&self, animation: &Animation) -> Option<UploadProgress> {
        self.known().get(animation).cloned()
    }

    /// Returns the animations whose upload is running or failed.
    pub(super) fn all(&self) -> Vec<Animation> {
        self.known().keys().cloned().collect()
    }

    fn known(&self) -> MutexGuard<'_, BTreeMap<Animation, UploadProgress>> {
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
        assert_eq!(uploads.of(&film), Some(UploadProgress::Uploading { done: 1, total: 3 }));
        uploads.end::<()>(&film, Err(Error::NoAnimation(film.clone())));
        assert_eq!(
            uploads.of(&film),
            Some(UploadProgress::Failed { why: "there is no animation film".into() })
        );
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
