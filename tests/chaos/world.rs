//! The world: the parts, the gates before them, and the faults.

use std::path::{Path, PathBuf};
use std::time::Duration;

use fastrand::Rng;
use rayfold_pipeline::store::{Connection, S3Store};

use crate::gate::Gate;
use crate::parts::{Ground, InvokerConfig, Part, lying_clock, set_clock};
use crate::tally::Tally;

/// The number of blocks of 1,024 bytes that the largest file may still grow by on a full disk.
const LEFT_ON_DISK: std::ops::Range<u64> = 1..200;

/// The usual range of clock steps, in seconds.
const STEP: std::ops::RangeInclusive<i64> = -30..=30;

/// The rare clock steps, which exceed the limit for signatures of a store.
const FAR: [i64; 2] = [-3_600, 3_600];

/// The parts of the system, which run as real processes.
pub(crate) struct World {
    folder: PathBuf,
    tally: Tally,
    to_store: Gate,
    to_invoker: Gate,
    store: Option<Part>,
    invoker: Option<Part>,
    invoker_config: InvokerConfig,
    connection: Connection,
}

impl World {
    /// Starts everything, without faults until this returns.
    pub(crate) async fn start(folder: &Path, tally: Tally, mut dice: Rng) -> Self {
        for name in ["store", "invoker"] {
            set_clock(folder, name, 0);
        }
        let (to_store, to_invoker) = (Gate::open("store", &tally).await, Gate::open("events", &tally).await);
        let ground = Ground { lying_clock: lying_clock().is_some(), largest_file: None };
        let webhook = to_invoker.address();
        let started = tokio::task::block_in_place(|| Part::store(folder, webhook, ground));
        let (store, connection) = started.expect("the store does not start");
        to_store.lead(Some(address(&connection)));
        let Connection { region, access_key, secret_key, .. } = connection.clone();
        let endpoint = format!("http://{}", to_store.address());
        let invoker_config = InvokerConfig {
            store: to_store.address(),
            region,
            access_key,
            secret_key,
            in_pieces: dice.bool(),
            seed: Some(dice.u64(..)),
        };
        if invoker_config.in_pieces {
            tally.add("rounds with GIFs in pieces");
        }
        let connection = Connection { endpoint, ..connection };
        let mut world = World {
            folder: folder.to_owned(),
            tally,
            to_store,
            to_invoker,
            store: Some(store),
            invoker: None,
            invoker_config,
            connection,
        };
        world.start_invoker(ground);
        world.to_store.roll(Some(dice.fork()));
        world.to_invoker.roll(Some(dice.fork()));
        world
    }

    /// Returns the bucket as the user reaches it: through the gate.
    pub(crate) fn store(&self) -> S3Store {
        S3Store::at(&self.connection, "rayfold")
    }

    /// Causes one fault, which is over when this returns.
    pub(crate) async fn disaster(&mut self, dice: &mut Rng) {
        let pause = Duration::from_millis(dice.u64(0..1_500));
        match dice.u32(0..10) {
            0..=2 => {
                self.kill_store();
                tokio::time::sleep(pause).await;
                self.start_store(None);
            }
            3 | 4 => {
                self.kill_invoker();
                self.invoker_config.seed = Some(dice.u64(..));
                tokio::time::sleep(pause).await;
                self.start_invoker(self.ground(None));
            }
            5 => {
                self.kill_store();
                self.kill_invoker();
                self.invoker_config.seed = Some(dice.u64(..));
                tokio::time::sleep(pause).await;
                self.start_store(None);
                self.start_invoker(self.ground(None));
            }
            6 => {
                self.tally.add("store out of reach for a while");
                let way = self.to_store.way();
                self.to_store.lead(None);
                tokio::time::sleep(pause).await;
                self.to_store.lead(way);
            }
            7 => {
                self.kill_store();
                let left = largest_file(&self.folder.join("data")) / 1_024 + dice.u64(LEFT_ON_DISK);
                self.tally.add("disks full");
                self.start_store(Some(left));
                tokio::time::sleep(Duration::from_secs(1) + pause).await;
                self.kill_store();
                self.start_store(None);
            }
            _ => {
                let part = if dice.bool() { "store" } else { "invoker" };
                let is_far = dice.u32(0..4) == 0;
                let ahead = if is_far { dice.choice(FAR).unwrap() } else { dice.i64(STEP) };
                if lying_clock().is_some() {
                    self.tally.add(if is_far { "clocks stepped by an hour" } else { "clocks stepped" });
                    set_clock(&self.folder, part, ahead);
                    tokio::time::sleep(Duration::from_secs(1) + pause).await;
                    if is_far {
                        set_clock(&self.folder, part, 0);
                    }
                }
            }
        }
    }

    pub(crate) async fn calm_down(&mut self) {
        self.kill_invoker();
        self.kill_store();
        self.to_store.roll(None);
        self.to_invoker.roll(None);
        self.invoker_config.seed = None;
        for name in ["store", "invoker"] {
            set_clock(&self.folder, name, 0);
        }
        self.start_store(None);
        self.start_invoker(Ground::default());
    }

    fn ground(&self, largest_file: Option<u64>) -> Ground {
        Ground { largest_file, lying_clock: lying_clock().is_some() && self.invoker_config.seed.is_some() }
    }

    fn kill_store(&mut self) {
        if let Some(part) = self.store.take() {
            self.tally.add("stores killed");
            tokio::task::block_in_place(|| part.kill());
        }
    }

    fn kill_invoker(&mut self) {
        if let Some(part) = self.invoker.take() {
            self.tally.add("invokers killed");
            tokio::task::block_in_place(|| part.kill());
        }
    }

    /// Starts the store. On a full disk it may not start; then the gate is closed.
    fn start_store(&mut self, largest_file: Option<u64>) {
        let (webhook, ground) = (self.to_invoker.address(), self.ground(largest_file));
        let started = tokio::task::block_in_place(|| Part::store(&self.folder, webhook, ground));
        assert!(started.is_some() || largest_file.is_some(), "the store does not start");
        if started.is_none() {
            self.tally.add("starts of the store refused by a full disk");
        }
        self.to_store.lead(started.as_ref().map(|(_, connection)| address(connection)));
        self.store = started.map(|(part, _)| part);
    }

    fn start_invoker(&mut self, ground: Ground) {
        let started =
            tokio::task::block_in_place(|| Part::invoker(&self.folder, &self.invoker_config, ground));
        self.to_invoker.lead(Some(started.1));
        self.invoker = Some(started.0);
    }
}

fn address(connection: &Connection) -> std::net::SocketAddr {
    connection.endpoint.trim_start_matches("http://").parse().unwrap()
}

/// Returns the size in bytes of the largest file in a folder or below it.
fn largest_file(folder: &Path) -> u64 {
    let Ok(entries) = std::fs::read_dir(folder) else { return 0 };
    let sizes = entries.flatten().map(|entry| match entry.metadata() {
        Ok(metadata) if metadata.is_dir() => largest_file(&entry.path()),
        Ok(metadata) => metadata.len(),
        // The file was deleted in between.
        Err(_) => 0,
    });
    sizes.max().unwrap_or(0)
}
