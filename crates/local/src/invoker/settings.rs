//! What an invoker is told: what to run, on which terms, and what is to go wrong.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::time::Duration;

use super::chaos::{Chaos, Fates};
use super::ramp::Ramp;
use crate::functions::Functions;
use crate::routes::Function;

/// What an invoker needs to know.
#[derive(Clone)]
pub struct Settings {
    /// The binaries.
    pub functions: Functions,
    /// The processes' environment, beyond what Lambda sets.
    pub environment: Vec<(String, String)>,
    /// What differs by function, such as credentials of its own.
    pub environment_of: BTreeMap<Function, Vec<(String, String)>>,
    /// The store's S3 endpoint.
    pub store: SocketAddr,
    /// Where to listen for events.
    pub webhook: SocketAddr,
    /// What events have to carry.
    pub webhook_token: String,
    /// Processes of a function at once.
    pub concurrency: usize,
    /// How fast new ones may start.
    pub ramp: Ramp,
    /// What the processes are told of their memory.
    pub memory_mb: u32,
    /// From the handing out to the kill.
    pub timeout: Duration,
    /// Before each further try of an event that failed; Lambda's are one and two minutes.
    pub retry_pauses: Vec<Duration>,
    /// How soon the store delivers what it has kept while nobody listened; nothing when it keeps no events. The sweep at
    /// the start waits for these: what they wake needs no waking.
    pub kept_events: Option<Duration>,
    /// Between the sweeps after the one at the start.
    pub sweep_every: Option<Duration>,
    /// What goes wrong on purpose with events and processes.
    pub chaos: Chaos,
    /// What goes wrong on purpose with requests to the store.
    pub fates: Option<Fates>,
}

impl Settings {
    /// Those of a laptop.
    pub fn new(functions: Functions, store: SocketAddr, webhook: SocketAddr, webhook_token: String) -> Self {
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
            sweep_every: Some(Duration::from_secs(30)),
            chaos: Chaos::default(),
            fates: None,
        }
    }
}
