//! The settings of an invoker: the functions, their limits, and the faults to inject.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::time::Duration;

use rayfold_pipeline::store::S3Store;

use super::chaos::{Chaos, Fates};
use super::ramp::Ramp;
use crate::functions::Functions;
use crate::routes::Function;

/// The settings of an invoker.
#[derive(Clone)]
pub struct Settings {
    /// The binaries of the functions.
    pub functions: Functions,
    /// The environment of the processes, besides the variables that Lambda sets.
    pub environment: Vec<(String, String)>,
    /// The environment of single functions, such as credentials of their own.
    pub environment_of: BTreeMap<Function, Vec<(String, String)>>,
    /// The store's S3 endpoint, which the processes reach through proxies that count their requests. Without it they reach the
    /// endpoint that their environment names.
    pub store: Option<SocketAddr>,
    /// The address at which to listen for events.
    pub webhook: SocketAddr,
    /// The token that events must contain.
    pub webhook_token: String,
    /// The largest number of processes of a function at once.
    pub concurrency: usize,
    /// The rate at which new processes may start.
    pub ramp: Ramp,
    /// The memory size that the processes see, in MB.
    pub memory_mb: u32,
    /// The time from the delivery of an event until its process is killed.
    pub timeout: Duration,
    /// The pauses before each further attempt at a failed event; Lambda's are one and two minutes.
    pub retry_pauses: Vec<Duration>,
    /// The time within which the store delivers the events that it kept while there was no listener; `None` if it keeps
    /// no events. The sweep at the start waits for these, because it need not trigger frames that they trigger.
    pub kept_events: Option<Duration>,
    /// The listings of the bucket from which events come, if the store sends none.
    pub listing: Option<Listing>,
    /// The interval of the sweeps after the one at the start.
    pub sweep_every: Option<Duration>,
    /// The faults to inject into events and processes.
    pub chaos: Chaos,
    /// The faults to inject into requests to the store.
    pub fates: Option<Fates>,
}

impl Settings {
    /// Returns settings that suit a laptop.
    pub fn new(
        functions: Functions,
        store: Option<SocketAddr>,
        webhook: SocketAddr,
        webhook_token: String,
    ) -> Self {
        Self {
            functions,
            environment: Vec::new(),
            environment_of: BTreeMap::new(),
            store,
            webhook,
            webhook_token,
            concurrency: 10,
            ramp: Ramp::default(),
            memory_mb: 1769,
            timeout: Duration::from_secs(300),
            retry_pauses: vec![Duration::from_millis(500), Duration::from_secs(1)],
            kept_events: None,
            listing: None,
            sweep_every: Some(Duration::from_secs(30)),
            chaos: Chaos::default(),
            fates: None,
        }
    }
}

/// The listing by which an invoker finds changes in a bucket, and the invoker's share of them.
#[derive(Clone)]
pub struct Listing {
    /// The store of the bucket.
    pub store: S3Store,
    /// The invoker's name, without slashes. If two invokers on a bucket have the same name, neither sees the other.
    pub name: String,
    /// The interval between two listings.
    pub every: Duration,
}

impl Listing {
    /// Returns a listing every second.
    pub fn new(store: S3Store, name: &str) -> Self {
        Self { store, name: name.to_owned(), every: Duration::from_secs(1) }
    }
}
