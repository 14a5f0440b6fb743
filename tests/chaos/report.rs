//! The report of a run, for a terminal and for `docs/reports/chaos.md`.

use std::fmt::{self, Write as _};
use std::time::Duration;

use rayfold_local::StoreKind;

use crate::tally::Tally;

/// The results of a round.
pub(crate) struct Round {
    pub(crate) seed: u64,
    /// The number of the user's actions.
    pub(crate) acts: u64,
    /// The number of files that the user put or deleted again, because their state was unknown.
    pub(crate) said_again: usize,
    /// The items that were given up because of faults, by the names that they were reported with.
    pub(crate) named: Vec<String>,
    /// The time from the end of the faults until all animations were right.
    pub(crate) took: Duration,
    pub(crate) tally: Tally,
}

impl fmt::Display for Round {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Round { seed, acts, said_again, named, took, tally } = self;
        let seconds = took.as_secs_f64();
        write!(
            f,
            "seed {seed}: {acts} actions, {said_again} files repeated; right after {seconds:.1} s, {} given up by name \
             {named:?}; {tally}",
            named.len()
        )
    }
}

/// Returns the text before the figures.
fn header(store: StoreKind) -> String {
    let (title, command, clocks) = match store {
        StoreKind::BuiltIn => ("Chaos on the real parts", "chaos.md", "clocks step"),
        StoreKind::Minio => (
            "Chaos on the real parts, with MinIO",
            "chaos-minio.md RAYFOLD_CHAOS_STORE=minio",
            "clocks of all but MinIO step",
        ),
        StoreKind::SeaweedFs => (
            "Chaos on the real parts, with SeaweedFS",
            "chaos-seaweedfs.md RAYFOLD_CHAOS_STORE=seaweedfs",
            "clocks of all but SeaweedFS step",
        ),
    };
    format!(
        "# {title}

Written by

    RAYFOLD_CHAOS_MINUTES=11 RAYFOLD_CHAOS_REPORT=$PWD/docs/reports/{command} cargo test -p rayfold-lambda --test chaos -- --nocapture

Each round has its own seed and bucket. For 20 s {store}, the invoker and the function processes are killed (`kill -9`)
separately. Proxies before the store and before the invoker delay connections, cut them in the middle of a request or a reply,
lose replies, reply 500 to requests that succeeded, and send requests twice. Files cannot grow (`ulimit -f`), {clocks} by up to
30 s or an hour (libfaketime), and events are lost, duplicated and late. Meanwhile a user puts, overwrites, deletes and changes
back scripts and settings of three animations, including faulty ones and scripts of three frames. One animation's frames are
drawn in bands, and in half of the rounds each GIF is built by several assemblers. Then the faults end. Within 240 s every
manifest must match the files, and every GIF must have the bytes that the same files give without a bucket. If a function gave
up an item because of faults, the manifest must report it by name, and a retry by the user must succeed. `RAYFOLD_SEED` replays
a round's user actions and random faults; their assignment to requests depends on the machine.
"
    )
}

/// Returns the whole report.
pub(crate) fn page(store: StoreKind, rounds: &[Round], took: Duration) -> String {
    let mut page = header(store);
    let all = Tally::default();
    rounds.iter().for_each(|round| all.add_all(&round.tally));
    let write = |page: &mut String, line: fmt::Arguments<'_>| page.write_fmt(line).unwrap();
    let acts: u64 = rounds.iter().map(|round| round.acts).sum();
    write(
        &mut page,
        format_args!(
            "\n\
             ## A run\n\n\
             {} rounds in {:.0} minutes, {acts} user actions. Every animation ended correctly in every round.\n\n",
            rounds.len(),
            took.as_secs_f64() / 60.0
        ),
    );
    write(&mut page, format_args!("| what | times |\n| --- | --- |\n"));
    for (what, count) in all.counts() {
        write(&mut page, format_args!("| {what} | {count} |\n"));
    }
    write(
        &mut page,
        format_args!(
            "\n\
             | seed | actions | repeated | right after, s | given up by name |\n\
             | --- | --- | --- | --- | --- |\n"
        ),
    );
    for Round { seed, acts, said_again, named, took, .. } in rounds {
        let named = if named.is_empty() { "nothing".to_owned() } else { named.join("; ") };
        let seconds = took.as_secs_f64();
        write(&mut page, format_args!("| {seed} | {acts} | {said_again} | {seconds:.1} | {named} |\n"));
    }
    page
}
