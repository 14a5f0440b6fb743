//! `rayfold status`: the progress of the animations of a bucket.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::time::Duration;

use rayfold_client::{Obstacle, Overview, obstacles};
use rayfold_movie::Container;
use rayfold_pipeline::keys::Animation;
use rayfold_pipeline::manifest::{Head, Reason};
use serde::Serialize;

use super::age::Age;
use super::{BucketArgs, Client, MAX_NAMED, Watch, named, parse_animation, report, with_bucket};
use crate::console::{Console, Format, visible};
use crate::outcome::Outcome;
use crate::wording::{Size, number};

/// The time between two looks at a whole bucket.
const APART: Duration = Duration::from_secs(2);

/// Show where the animations of a bucket stand
///
/// Without ANIMATION: all of them, a line each, and how many objects belong to none. With one: also every frame that
/// failed, with its reason, and every file that is not read because of its name.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  rayfold status --bucket my-bucket
      all animations
  rayfold status hello --bucket my-bucket
      one, with what failed and why
  rayfold status hello --bucket my-bucket --watch
      until it is done; exit code 1 if it failed
  rayfold status hello --bucket my-bucket --format json
      for programs, on standard output")]
pub(crate) struct Args {
    /// The animation
    #[arg(value_parser = parse_animation)]
    animation: Option<Animation>,
    #[command(flatten)]
    bucket: BucketArgs,
    /// Show each change: of an animation until nothing more will happen, of a whole bucket until Ctrl-C
    #[arg(long)]
    watch: bool,
    /// How to show it
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

#[derive(Serialize)]
struct Report<'a> {
    animations: Vec<Entry<'a>>,
    /// Present only if the whole bucket was examined.
    #[serde(skip_serializing_if = "Option::is_none")]
    misplaced: Option<Misplaced<'a>>,
}

/// The number of objects that belong to no animation, and the names of the first of them.
#[derive(Serialize)]
struct Misplaced<'a> {
    count: usize,
    named: Vec<MisplacedEntry<'a>>,
}

#[derive(Serialize)]
struct MisplacedEntry<'a> {
    key: &'a str,
    problem: &'a str,
}

#[derive(Serialize)]
struct Entry<'a> {
    #[serde(flatten)]
    known: Known<'a>,
    /// Whether there are scripts, or versions of them, that the functions have not seen.
    behind: bool,
    gif: Option<File<'a>>,
    /// The other files, by their ending.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    outputs: BTreeMap<&'static str, File<'a>>,
    faults: Vec<FaultEntry<'a>>,
}

/// The summary in a manifest, if there is one.
#[derive(Serialize)]
#[serde(untagged)]
enum Known<'a> {
    Seen(Box<Head>),
    /// No function has looked at it yet, or the manifest cannot be read.
    New {
        animation: &'a Animation,
        status: &'static str,
    },
}

#[derive(Serialize)]
struct File<'a> {
    key: String,
    size: u64,
    version: &'a str,
    /// When it was written, in milliseconds since 1970.
    modified_ms: u64,
    /// Whether the file shows the frames of the manifest.
    current: bool,
}

#[derive(Serialize)]
struct FaultEntry<'a> {
    what: String,
    reason: Option<&'a Reason>,
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    with_bucket(&args.bucket, async |client| match (&args.animation, args.watch) {
        (Some(animation), true) => follow(client, animation, args.format, console).await,
        (Some(animation), false) => {
            let watches = client.look(std::slice::from_ref(animation)).await?;
            if watches.iter().all(|watch| watch.manifest().is_none()) {
                client.must_exist(animation).await?;
            }
            show(&watches, None, args.format, console)?;
            show_faults(&watches, args.format, console);
            Ok(Outcome::Done)
        }
        (None, false) => {
            let overview = client.overview().await?;
            let watches = client.look(&overview.animations).await?;
            show(&watches, Some(&overview), args.format, console)?;
            if args.format == Format::Text {
                warn_of_misplaced(&overview, console);
            }
            Ok(Outcome::Done)
        }
        (None, true) => {
            let mut last = String::new();
            loop {
                let overview = client.overview().await?;
                let watches = client.look(&overview.animations).await?;
                let is_new = show_if_new(&watches, Some(&overview), args.format, &mut last, console)?;
                if is_new && args.format == Format::Text {
                    warn_of_misplaced(&overview, console);
                }
                tokio::time::sleep(APART).await;
            }
        }
    })
}

/// Shows each change of an animation until nothing more will happen.
async fn follow(
    client: Client<'_>,
    animation: &Animation,
    format: Format,
    console: &Console,
) -> anyhow::Result<Outcome> {
    let mut watches = [Watch::new(client, animation.clone())];
    let mut last = String::new();
    loop {
        watches[0].look_for().await?;
        watches[0].compare().await?;
        show_if_new(&watches, None, format, &mut last, console)?;
        if watches[0].is_settled() {
            show_faults(&watches, format, console);
            return Ok(if watches[0].is_current() { Outcome::Done } else { Outcome::Failed });
        }
        watches[0].pause().await;
    }
}

fn show(
    watches: &[Watch<'_>],
    overview: Option<&Overview>,
    format: Format,
    console: &Console,
) -> anyhow::Result<()> {
    match format {
        Format::Text => console.print(table(watches, true)),
        Format::Json => console.print(document(watches, overview, false)?),
    }
}

/// Shows the state if it differs from the one shown last in more than ages. Returns whether it does.
fn show_if_new(
    watches: &[Watch<'_>],
    overview: Option<&Overview>,
    format: Format,
    last: &mut String,
    console: &Console,
) -> anyhow::Result<bool> {
    let now = match format {
        Format::Text => {
            let misplaced = overview.map_or(0, |overview| overview.misplaced.len());
            table(watches, false) + &misplaced.to_string()
        }
        Format::Json => document(watches, overview, true)?,
    };
    if now == *last {
        return Ok(false);
    }
    match format {
        Format::Text => console.print(table(watches, true))?,
        Format::Json => console.print(&now)?,
    }
    *last = now;
    Ok(true)
}

/// Warns of the number of objects that belong to no animation, and names the first.
fn warn_of_misplaced(overview: &Overview, console: &Console) {
    if overview.misplaced.is_empty() {
        return;
    }
    let names = overview.misplaced.iter().map(|misplaced| misplaced.key.clone()).collect::<Vec<_>>();
    console.warn(format_args!(
        "{} misplaced, of which nothing is drawn: {}: expected scripts/<animation>/<name>.txt",
        number(names.len() as u64, "object"),
        named(&names)
    ));
}

fn show_faults(watches: &[Watch<'_>], format: Format, console: &Console) {
    if format == Format::Text {
        for manifest in watches.iter().filter_map(Watch::manifest) {
            report::show_faults(manifest, console);
        }
    }
}

fn table(watches: &[Watch<'_>], with_age: bool) -> String {
    let names: Vec<String> =
        watches.iter().map(|watch| visible(watch.animation().as_str()).replace('\n', "\\u{a}")).collect();
    let width = names.iter().map(|name| name.chars().count()).max().unwrap_or(0);
    let mut text = String::new();
    for (name, watch) in names.iter().zip(watches) {
        let Some(manifest) = watch.manifest() else {
            let (status, why) = unknown(watch);
            let _ = writeln!(text, "{name:width$}  {status:9}  {why}");
            continue;
        };
        let status = manifest.head.status;
        let file = |output: &Container| {
            let (output, name) = (*output, output.name());
            let age = watch.age(output).filter(|_| with_age).map(|age| format!(", {} old", Age(age)));
            match watch.file(output) {
                Some(file) if watch.has_current(output) => format!("{name} of {}", Size(file.size)),
                Some(file) => format!("last {name} of {}{}", Size(file.size), age.unwrap_or_default()),
                None => format!("no {name}"),
            }
        };
        let files = watch.outputs().iter().map(file).collect::<Vec<_>>().join(", ");
        let warnings = match manifest.head.warnings.len() as u64 {
            0 => String::new(),
            n => format!("; {}", number(n, "warning")),
        };
        let behind = if watch.is_behind() { "; newer scripts wait to be seen" } else { "" };
        let _ = writeln!(
            text,
            "{name:width$}  {status:9}  {}, {files}{warnings}{behind}",
            report::count(manifest)
        );
    }
    text
}

/// Returns the reason why there is no manifest to show, as a word and as a sentence.
fn unknown(watch: &Watch<'_>) -> (&'static str, &'static str) {
    if watch.is_unreadable() {
        ("unreadable", "its manifest cannot be read: the next sweep makes it anew")
    } else {
        ("new", "no function has looked at it yet")
    }
}

fn entry_of<'w>(watch: &'w Watch<'_>, output: Container) -> Option<File<'w>> {
    watch.file(output).map(|file| File {
        key: watch.animation().output(output),
        size: file.size,
        version: file.etag.as_str(),
        modified_ms: file.modified.0,
        current: watch.has_current(output),
    })
}

fn document(watches: &[Watch<'_>], overview: Option<&Overview>, one_line: bool) -> anyhow::Result<String> {
    let entries = watches.iter().map(|watch| Entry {
        known: match watch.manifest() {
            // The manifest's own records have the names of the fields that say more of the files.
            Some(manifest) => {
                let outputs = BTreeMap::new();
                Known::Seen(Box::new(Head { gif: None, outputs, ..manifest.head.clone() }))
            }
            None => Known::New { animation: watch.animation(), status: unknown(watch).0 },
        },
        behind: watch.is_behind(),
        gif: entry_of(watch, Container::Gif),
        outputs: Container::ALL
            .into_iter()
            .filter(|output| *output != Container::Gif)
            .filter_map(|output| Some((output.ending(), entry_of(watch, output)?)))
            .collect(),
        faults: watch.manifest().map_or_else(Vec::new, |manifest| {
            let obstacles = obstacles(manifest).into_iter();
            obstacles.map(|Obstacle { what, reason }| FaultEntry { what, reason }).collect()
        }),
    });
    let misplaced = overview.map(|Overview { misplaced, .. }| Misplaced {
        count: misplaced.len(),
        named: misplaced
            .iter()
            .take(MAX_NAMED)
            .map(|misplaced| MisplacedEntry { key: &misplaced.key, problem: misplaced.problem })
            .collect(),
    });
    let report = Report { animations: entries.collect(), misplaced };
    let text = if one_line { serde_json::to_string(&report) } else { serde_json::to_string_pretty(&report) };
    Ok(text? + "\n")
}
