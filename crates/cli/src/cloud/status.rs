//! `rayfold status`: where the animations of a bucket stand.

use std::fmt::Write;

use rayfold_client::{Obstacle, obstacles};
use rayfold_pipeline::keys::Animation;
use rayfold_pipeline::manifest::{Head, Reason};
use serde::Serialize;

use super::{BucketArgs, Watch, parse_animation, report, with_bucket};
use crate::console::{Console, Format, visible};
use crate::outcome::Outcome;
use crate::wording::Size;

/// Show where the animations of a bucket stand
///
/// Without ANIMATION: all of them, a line each. With one: also every frame that failed, with its reason.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  rayfold status --bucket my-bucket                       all animations
  rayfold status hello --bucket my-bucket                 one, with what failed and why
  rayfold status hello --bucket my-bucket --watch         until it is done; exit code 1 if it failed
  rayfold status hello --bucket my-bucket --format json   for programs, on standard output")]
pub(crate) struct Args {
    /// The animation
    #[arg(value_parser = parse_animation)]
    animation: Option<Animation>,
    #[command(flatten)]
    bucket: BucketArgs,
    /// Show each change, until nothing more will happen
    #[arg(long)]
    watch: bool,
    /// How to show it
    #[arg(long, value_enum, default_value_t)]
    format: Format,
}

#[derive(Serialize)]
struct Report<'a> {
    animations: Vec<Entry<'a>>,
}

#[derive(Serialize)]
struct Entry<'a> {
    #[serde(flatten)]
    known: Known<'a>,
    gif: Option<Gif<'a>>,
    faults: Vec<FaultEntry<'a>>,
}

/// What the manifest says in short.
#[derive(Serialize)]
#[serde(untagged)]
enum Known<'a> {
    Seen(&'a Head),
    /// No function has looked at it yet, or what it wrote cannot be read.
    New {
        animation: &'a Animation,
        status: &'static str,
    },
}

#[derive(Serialize)]
struct Gif<'a> {
    key: String,
    size: u64,
    version: &'a str,
    /// It shows what the manifest says.
    current: bool,
}

#[derive(Serialize)]
struct FaultEntry<'a> {
    what: String,
    reason: Option<&'a Reason>,
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    with_bucket(&args.bucket, async |client| {
        let mut last = String::new();
        loop {
            let names = match &args.animation {
                Some(animation) => vec![animation.clone()],
                None => client.animations().await?,
            };
            let watches = client.look(&names).await?;
            if let (Some(animation), [watch]) = (&args.animation, watches.as_slice())
                && watch.manifest().is_none()
                && !args.watch
            {
                client.must_exist(animation).await?;
            }
            let shown = match args.format {
                Format::Text => table(&watches),
                Format::Json => document(&watches, args.watch)?,
            };
            if shown != last {
                console.print(&shown)?;
                last = shown;
            }
            let settled = watches.iter().all(Watch::is_settled);
            if !args.watch || (settled && args.animation.is_some()) {
                let failed = watches.iter().any(|watch| watch.is_settled() && !watch.is_current());
                if args.animation.is_some() && args.format == Format::Text {
                    for manifest in watches.iter().filter_map(Watch::manifest) {
                        report::show_faults(manifest, console);
                    }
                }
                return Ok(if args.watch && failed { Outcome::Failed } else { Outcome::Done });
            }
            match watches.first() {
                Some(watch) => watch.pause().await,
                None => tokio::time::sleep(std::time::Duration::from_secs(1)).await,
            }
        }
    })
}

fn table(watches: &[Watch<'_>]) -> String {
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
        let status = report::word(manifest.head.status);
        let gif = match watch.gif() {
            Some(gif) if watch.is_current() => format!("GIF of {}", Size(gif.size)),
            Some(_) => "an older GIF".to_owned(),
            None => "no GIF".to_owned(),
        };
        let _ = writeln!(text, "{name:width$}  {status:9}  {}, {gif}", report::count(manifest));
    }
    text
}

/// Why there is no manifest to show, in a word and in a sentence.
fn unknown(watch: &Watch<'_>) -> (&'static str, &'static str) {
    if watch.is_unreadable() {
        ("unreadable", "its manifest cannot be read: the next sweep makes it anew")
    } else {
        ("new", "no function has looked at it yet")
    }
}

fn document(watches: &[Watch<'_>], one_line: bool) -> anyhow::Result<String> {
    let entries = watches.iter().map(|watch| Entry {
        known: match watch.manifest() {
            Some(manifest) => Known::Seen(&manifest.head),
            None => Known::New { animation: watch.animation(), status: unknown(watch).0 },
        },
        gif: watch.gif().map(|gif| Gif {
            key: watch.animation().gif(),
            size: gif.size,
            version: gif.etag.as_str(),
            current: watch.is_current(),
        }),
        faults: watch.manifest().map_or_else(Vec::new, |manifest| {
            let obstacles = obstacles(manifest).into_iter();
            obstacles.map(|Obstacle { what, reason }| FaultEntry { what, reason }).collect()
        }),
    });
    let report = Report { animations: entries.collect() };
    let text = if one_line { serde_json::to_string(&report) } else { serde_json::to_string_pretty(&report) };
    Ok(text? + "\n")
}
