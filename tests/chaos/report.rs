//! What a run was like, for a terminal and for `docs/reports/chaos.md`.

use std::fmt::{self, Write as _};
use std::time::Duration;

use rayfold_local::StoreKind;

use crate::tally::Tally;

/// One round.
pub(crate) struct Round {
    pub(crate) seed: u64,
    /// What the user did.
    pub(crate) acts: u64,
    /// Files that the user put or deleted once more, not knowing whether they had arrived.
    pub(crate) said_again: usize,
    /// What was given up for what the world did, by the names that it was given.
    pub(crate) named: Vec<String>,
    /// From the calm to the time when all was right.
    pub(crate) took: Duration,
    pub(crate) tally: Tally,
}

impl fmt::Display for Round {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Round { seed, acts, said_again, named, took, tally } = self;
        let seconds = took.as_secs_f64();
        write!(
            f,
            "seed {seed}: {acts} acts, {said_again} files said again; right after {seconds:.1} s, {} given up by name {named:?}; {tally}",
            named.len()
        )
    }
}

/// What comes before the figures.
fn header(store: StoreKind) -> String {
    let (title, command, clocks) = match store {
        StoreKind::BuiltIn => ("Chaos on the real parts", "chaos.md", "clocks step"),
        StoreKind::Minio => (
            "Chaos on the real parts, with MinIO",
            "chaos-minio.md RAYFOLD_CHAOS_STORE=minio",
            "clocks of all but MinIO step",
        ),
    };
    format!(
        "# {title}

Written by

    RAYFOLD_CHAOS_MINUTES=11 RAYFOLD_CHAOS_REPORT=$PWD/docs/reports/{command} cargo test -p rayfold-lambda --test chaos -- --nocapture

A round has a seed and a bucket of its own. For 20 s {store}, the invoker and the function processes are killed
(`kill -9`), each by itself; proxies before the store and before the invoker slow connections, cut them in the middle of a
request or an answer, lose answers, answer 500 to what was done, and send requests twice; files cannot grow (`ulimit -f`),
{clocks} by up to 30 s or an hour (libfaketime), events are lost, doubled and late. A user puts, overwrites, deletes and
changes back scripts and settings of three animations meanwhile, faulty ones and scripts of three frames among them; one
animation's frames are drawn in bands, and in half of the rounds each GIF is built by several assemblers. Then all is calm, and
within 240 s every manifest must say what the files say, and every GIF must have the bytes that the same files give without a
bucket. What a function gave up for what was done to it must say so by name, and comes right when the user tries again.
`RAYFOLD_SEED` replays a round's acts and dice; which request meets which is up to the machine.
"
    )
}

/// The whole report.
pub(crate) fn page(store: StoreKind, rounds: &[Round], took: Duration) -> String {
    let mut page = header(store);
    let all = Tally::default();
    rounds.iter().for_each(|round| all.add_all(&round.tally));
    let write = |page: &mut String, line: fmt::Arguments<'_>| page.write_fmt(line).unwrap();
    let acts: u64 = rounds.iter().map(|round| round.acts).sum();
    write(
        &mut page,
        format_args!(
            "\n## A run\n\n{} rounds in {:.0} minutes, {acts} acts of the user. Every animation ended right in every round.\n\n",
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
            "\n| seed | acts | said again | right after, s | given up by name |\n| --- | --- | --- | --- | --- |\n"
        ),
    );
    for Round { seed, acts, said_again, named, took, .. } in rounds {
        let named = if named.is_empty() { "nothing".to_owned() } else { named.join("; ") };
        let seconds = took.as_secs_f64();
        write(&mut page, format_args!("| {seed} | {acts} | {said_again} | {seconds:.1} | {named} |\n"));
    }
    page
}
