//! The invokers of a bucket, which share its events.
//!
//! Each invoker repeatedly writes an object below `invokers/`, and lists those of the others. A hash of an event's key,
//! weighted by the number of functions that each invoker runs at once, assigns the event to one of them (rendezvous
//! hashing). So no event costs a request, and when an invoker comes or goes only its own share moves.
//!
//! An invoker is silent if its object was the same in several listings. From then on it has no share. Some listings
//! later, when the others have seen that too, the first of them sweeps the pending work. Views that differ for a moment
//! cost a drawing or a wait for the sweep, but never a frame.
//!
//! The module compares no clocks of different machines: each invoker counts its own listings.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use rayfold_pipeline::store::{ETag, ListRequest, PutOptions, S3Store, Store};
use tokio::task::JoinSet;

use super::CATCH_UP;
use super::queue::{Job, Pool};
use super::settings::Listing;
use crate::observation::{Observer, Seen};

/// The prefix of the invokers' objects.
pub(crate) const INVOKERS: &str = "invokers/";

/// The interval between two listings. With each listing the invoker writes its own object again.
const BEAT: Duration = Duration::from_secs(1);

/// The number of listings that show the object of an invoker unchanged after which that invoker has no share.
const SILENT: u32 = 10;

/// The number of such listings after which the invoker's share is swept. An invoker that has left is silent at once.
const LOST: u32 = SILENT + 3;

/// This invoker, and its view of the others.
pub(crate) struct Members {
    store: S3Store,
    own: String,
    others: Mutex<Others>,
}

/// The other invokers, by the names of their objects.
type Others = BTreeMap<String, Other>;

#[derive(Debug, PartialEq)]
struct Other {
    etag: ETag,
    /// The number of listings since it changed.
    looks: u32,
}

impl Members {
    /// Joins the invokers of the bucket.
    pub(crate) fn start(
        listing: &Listing,
        concurrency: usize,
        assemble: Pool,
        observer: Observer,
        tasks: &mut JoinSet<()>,
    ) -> Arc<Self> {
        let own = format!("{}-{concurrency}", listing.name);
        let members = Arc::new(Self { store: listing.store.clone(), own, others: Mutex::default() });
        let beating = members.clone();
        tasks.spawn(async move {
            for beat in 0_u64.. {
                beating.beat(beat, &assemble, &observer).await;
                tokio::time::sleep(BEAT).await;
            }
        });
        members
    }

    /// Returns whether an event on this key is this invoker's.
    pub(crate) fn owns(&self, key: &str) -> bool {
        let own = share(&self.own, key);
        self.with_others(|others| {
            others.iter().filter(|(_, other)| other.looks < SILENT).all(|(name, _)| share(name, key) < own)
        })
    }

    /// Returns whether this is the first of the invokers, which does the work that only one should do.
    pub(crate) fn leads(&self) -> bool {
        self.with_others(|others| {
            others.iter().filter(|(_, other)| other.looks < SILENT).all(|(name, _)| *name > self.own)
        })
    }

    /// Deletes this invoker's object, so that the others take over at once.
    pub(crate) async fn leave(&self) {
        // If this fails, they take over later.
        let _ = self.store.delete(&format!("{INVOKERS}{}", self.own)).await;
    }

    async fn beat(&self, beat: u64, assemble: &Pool, observer: &Observer) {
        let body = format!("{beat} {}", fastrand::u64(..));
        // A listing that fails does not count: no other invoker is silent because this one is cut off.
        let _ = self.store.put(&format!("{INVOKERS}{}", self.own), body.into(), PutOptions::always()).await;
        let Ok(page) = self.store.list(ListRequest::all(INVOKERS)).await else { return };
        let found = page.objects.into_iter().filter_map(|object| {
            let name = object.key.strip_prefix(INVOKERS)?.to_owned();
            (name != self.own).then_some((name, object.etag))
        });
        let found = found.collect();
        let (joined, lost) = self.with_others(|others| look(others, found));
        for name in joined {
            observer.see(Seen::Joined { invoker: name });
        }
        for invoker in &lost {
            let _ = self.store.delete(&format!("{INVOKERS}{invoker}")).await;
            observer.see(Seen::Lost { invoker: invoker.clone() });
        }
        if !lost.is_empty() && self.leads() {
            assemble.submit(Job::event(CATCH_UP));
        }
    }

    fn with_others<T>(&self, act: impl FnOnce(&mut Others) -> T) -> T {
        act(&mut self.others.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// Updates the view of the others by a listing. Returns the invokers that have come and those that are lost.
fn look(others: &mut Others, found: BTreeMap<String, ETag>) -> (Vec<String>, Vec<String>) {
    for (name, other) in others.iter_mut() {
        match found.get(name) {
            Some(etag) if *etag != other.etag => *other = Other { etag: etag.clone(), looks: 0 },
            Some(_) => other.looks += 1,
            None => other.looks = (other.looks + 1).max(SILENT),
        }
    }
    let lost: Vec<String> =
        others.iter().filter(|(_, other)| other.looks >= LOST).map(|(name, _)| name.clone()).collect();
    others.retain(|_, other| other.looks < LOST);
    let new = found.into_iter().filter(|(name, _)| !others.contains_key(name) && !lost.contains(name));
    let new: Vec<_> = new.collect();
    let joined = new.iter().map(|(name, _)| name.clone()).collect();
    others.extend(new.into_iter().map(|(name, etag)| (name, Other { etag, looks: 0 })));
    (joined, lost)
}

/// Returns an invoker's score for a key; the invoker with the highest score gets the key. The weight is the text after
/// the last hyphen of the name.
fn share(name: &str, key: &str) -> f64 {
    let weight = name.rsplit_once('-').and_then(|(_, weight)| weight.parse().ok()).unwrap_or(1.0_f64);
    // The middle of one of 2^53 intervals, so neither 0 nor 1.
    let uniform = ((hash(name, key) >> 11) as f64 + 0.5) / (1_u64 << 53) as f64;
    -weight / uniform.ln()
}

/// Hashes by FNV-1a, then by the finaliser of SplitMix64. All invokers of a bucket must compute the same value.
fn hash(name: &str, key: &str) -> u64 {
    let bytes = name.bytes().chain([0]).chain(key.bytes());
    let fnv = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    let mut hash = bytes.fold(0xcbf2_9ce4_8422_2325, fnv);
    hash = (hash ^ (hash >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    hash = (hash ^ (hash >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    hash ^ (hash >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(objects: &[(&str, &str)]) -> BTreeMap<String, ETag> {
        objects.iter().map(|(name, tag)| ((*name).to_owned(), ETag::new(tag))).collect()
    }

    #[test]
    fn an_invoker_is_lost_after_many_looks_at_the_same_object() {
        let mut others = Others::new();
        assert_eq!(look(&mut others, found(&[("a-1", "0")])), (vec!["a-1".to_owned()], vec![]));
        for _ in 1..SILENT {
            assert_eq!(look(&mut others, found(&[("a-1", "0")])), (vec![], vec![]));
        }
        assert_eq!(others["a-1"].looks, SILENT - 1);
        look(&mut others, found(&[("a-1", "1")]));
        assert_eq!(others["a-1"].looks, 0, "it is alive");
        for _ in 1..LOST {
            assert_eq!(look(&mut others, found(&[("a-1", "1")])), (vec![], vec![]));
        }
        assert_eq!(look(&mut others, found(&[("a-1", "1")])), (vec![], vec!["a-1".to_owned()]));
        assert!(others.is_empty());
    }

    #[test]
    fn an_invoker_that_has_left_is_silent_at_once_and_soon_lost() {
        let mut others = Others::new();
        look(&mut others, found(&[("a-1", "0")]));
        let looks: Vec<_> = (SILENT..=LOST).map(|_| look(&mut others, found(&[])).1.len()).collect();
        assert_eq!(looks, [0, 0, 0, 1]);
    }

    #[test]
    fn keys_are_shared_by_weight_and_only_the_share_of_the_lost_moves() {
        let names = ["a-2", "b-2", "c-4"];
        let owner = |names: &[&'static str], key: &str| {
            *names.iter().max_by(|a, b| share(a, key).total_cmp(&share(b, key))).unwrap()
        };
        let mut counts = BTreeMap::new();
        for number in 0..8_000 {
            let key = format!("scripts/film/{number}.txt");
            let of_three = owner(&names, &key);
            *counts.entry(of_three).or_insert(0) += 1;
            if of_three != "c-4" {
                assert_eq!(owner(&names[..2], &key), of_three, "{key}");
            }
        }
        for (name, expected) in [("a-2", 2_000_i32), ("b-2", 2_000), ("c-4", 4_000)] {
            assert!((counts[name] - expected).abs() < 200, "{counts:?}");
        }
    }
}
