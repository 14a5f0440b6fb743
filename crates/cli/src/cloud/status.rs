//! `rayfold status`: where the animations of a bucket stand.

use std::fmt::Write;

use futures_util::stream::{self, StreamExt, TryStreamExt};
use rayfold_pipeline::keys::{Animation, Key, MANIFESTS, SCRIPTS};
use rayfold_pipeline::manifest::{Head, Reason};
use rayfold_pipeline::store::{ListRequest, S3Store};
use serde::Serialize;

use super::watch::Watch;
use super::{BucketArgs, SIDE_BY_SIDE, list, must_exist, parse_animation, report, with_bucket};
use crate::console::{Console, Format};
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
    /// No function has looked at it yet.
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
    with_bucket(&args.bucket, async |store| {
        let mut last = String::new();
        loop {
            let names = match &args.animation {
                Some(animation) => vec![animation.clone()],
                None => animations(store).await?,
            };
            let watches = look(store, &names).await?;
            if let (Some(animation), [watch]) = (&args.animation, watches.as_slice())
                && watch.manifest.is_none()
                && !args.watch
            {
                must_exist(store, animation).await?;
            }
            let shown = match args.format {
                Format::Text => table(&names, &watches),
                Format::Json => document(&names, &watches, args.watch)?,
            };
            if shown != last {
                console.print(&shown)?;
                last = shown;
            }
            let settled = watches.iter().all(Watch::is_settled);
            if !args.watch || (settled && args.animation.is_some()) {
                let failed = watches.iter().any(|watch| watch.is_settled() && !watch.is_current());
                if args.animation.is_some() && args.format == Format::Text {
                    for manifest in watches.iter().filter_map(|watch| watch.manifest.as_ref()) {
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

async fn look<'a>(store: &'a S3Store, names: &'a [Animation]) -> anyhow::Result<Vec<Watch<'a>>> {
    let looks: Vec<_> = names
        .iter()
        .map(async |name| {
            let mut watch = Watch::new(store, name);
            watch.look().await?;
            anyhow::Ok(watch)
        })
        .collect();
    stream::iter(looks).buffered(SIDE_BY_SIDE).try_collect().await
}

/// Those that have a manifest, and folders of scripts that have none yet.
async fn animations(store: &S3Store) -> anyhow::Result<Vec<Animation>> {
    let (manifests, _) = list(store, ListRequest::all(MANIFESTS)).await?;
    let mut names: Vec<Animation> = manifests
        .iter()
        .filter_map(|object| Some(object.key.parse::<Key>().ok()?.animation().clone()))
        .collect();
    let (_, folders) = list(store, ListRequest::level(SCRIPTS)).await?;
    for folder in folders {
        let name = folder.trim_start_matches(SCRIPTS).trim_end_matches('/');
        let is_below =
            |known: &Animation| known.as_str() == name || known.as_str().starts_with(&format!("{name}/"));
        if !names.iter().any(is_below)
            && let Ok(name) = Animation::new(name)
        {
            names.push(name);
        }
    }
    names.sort();
    Ok(names)
}

fn table(names: &[Animation], watches: &[Watch<'_>]) -> String {
    let width = names.iter().map(|name| name.as_str().chars().count()).max().unwrap_or(0);
    let mut text = String::new();
    for (name, watch) in names.iter().zip(watches) {
        let name = name.as_str();
        let Some(manifest) = &watch.manifest else {
            let _ = writeln!(text, "{name:width$}  new        no function has looked at it yet");
            continue;
        };
        let status = report::word(manifest.head.status);
        let gif = match &watch.gif {
            Some(gif) if watch.is_current() => format!("GIF of {}", Size(gif.size)),
            Some(_) => "an older GIF".to_owned(),
            None => "no GIF".to_owned(),
        };
        let _ = writeln!(text, "{name:width$}  {status:9}  {}, {gif}", report::count(manifest));
    }
    text
}

fn document(names: &[Animation], watches: &[Watch<'_>], one_line: bool) -> anyhow::Result<String> {
    let entries = names.iter().zip(watches).map(|(animation, watch)| Entry {
        known: match &watch.manifest {
            Some(manifest) => Known::Seen(&manifest.head),
            None => Known::New { animation, status: "new" },
        },
        gif: watch.gif.as_ref().map(|gif| Gif {
            key: animation.gif(),
            size: gif.size,
            version: gif.etag.as_str(),
            current: watch.is_current(),
        }),
        faults: watch.manifest.as_ref().map_or_else(Vec::new, |manifest| {
            let faults = report::faults(manifest).into_iter();
            faults.map(|(what, reason)| FaultEntry { what, reason }).collect()
        }),
    });
    let report = Report { animations: entries.collect() };
    let text = if one_line { serde_json::to_string(&report) } else { serde_json::to_string_pretty(&report) };
    Ok(text? + "\n")
}
