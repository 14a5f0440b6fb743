//! `rayfold submit`: a folder of scripts to the bucket, and the animation back.
//!
//! The bucket's folder becomes equal to the local one. `animation.json` goes with the number of frames, so that the
//! functions need not wait for a quiet period to know that the upload has ended. Nothing is remembered here: what was
//! interrupted is picked up from what the bucket shows.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::Context;
use rayfold_pipeline::keys::{Animation, ScriptName};
use rayfold_pipeline::manifest::{Manifest, Status};
use rayfold_pipeline::store::{ETag, ListRequest, S3Store};
use rayfold_scene::{AnimationSettings, Limits};
use rayon::prelude::*;

use super::upload::{Content, Difference, Wanted, compare, delete, send};
use super::watch::Watch;
use super::{BucketArgs, address, fetch, list, parse_animation, report, with_bucket};
use crate::console::Console;
use crate::input::Input;
use crate::interrupt;
use crate::outcome::{Outcome, Usage};
use crate::output::probe;
use crate::plan::{Plan, Wishes};
use crate::progress::Progress;
use crate::render::target::Target;
use crate::wording::number;

/// How long nothing may happen before the user is told that this is unusual.
const UNUSUAL: Duration = Duration::from_secs(20);

/// Bytes of a script's name that MinIO can draw: it keeps objects as files, whose names have at most 255 bytes, and a
/// frame's has its script's version, too.
const LONGEST_NAME_ON_MINIO: usize = 200;

/// Render a folder of scripts in the cloud and download the animation
///
/// Checks all scripts, makes scripts/ANIMATION/ in the bucket equal to the folder (uploading only what changed, deleting
/// scripts that are no longer there), waits, and downloads the GIF. Interrupting it loses nothing: the same command
/// picks up where the bucket is.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  rayfold submit scenes/hello --bucket my-bucket               writes hello.gif
  rayfold submit scenes/hello --bucket my-bucket -o a.gif      writes a.gif
  rayfold submit scenes/hello --bucket my-bucket --no-wait     only uploads
  rayfold submit shots/7 --bucket my-bucket --name film/7      under a name of its own")]
pub(crate) struct Args {
    /// The folder
    folder: PathBuf,
    #[command(flatten)]
    bucket: BucketArgs,
    /// Where to write the GIF [default: the animation's name with .gif, in the current folder]
    #[arg(long, short, value_name = "OUT.gif", conflicts_with = "no_wait")]
    output: Option<PathBuf>,
    /// Upload and leave
    #[arg(long)]
    no_wait: bool,
    /// The animation's name in the bucket, which may hold slashes [default: the folder's name]
    #[arg(long, value_name = "ANIMATION", value_parser = parse_animation)]
    name: Option<Animation>,
}

pub(crate) fn run(args: &Args, console: &Console) -> anyhow::Result<Outcome> {
    anyhow::ensure!(
        args.folder.is_dir() || !args.folder.exists(),
        Usage(format!("{} is a file: expected a folder of scripts", args.folder.display()))
    );
    let animation = match &args.name {
        Some(name) => name.clone(),
        None => name_of(&args.folder)?,
    };
    let last = animation.as_str().rsplit('/').next().unwrap_or_default();
    let output = args.output.clone().unwrap_or_else(|| format!("{last}.gif").into());
    if !args.no_wait {
        if !matches!(Target::parse(&output)?, Target::Gif(_)) {
            return Err(Usage(format!("{} does not end in .gif", output.display())).into());
        }
        probe(&output)?;
    }
    let limits = Limits::default();
    let input = Input::animation(std::slice::from_ref(&args.folder), &limits)?;
    let plan = match Plan::new(&input, &limits, &Wishes::default(), console)? {
        Ok(plan) => plan,
        Err(faults) => anyhow::bail!("nothing was uploaded: {}", faults.count()),
    };
    plan.one_size()?;
    let wanted = wanted(&input, &plan, &animation, console)?;
    with_bucket(&args.bucket, async |store| {
        let versions = synchronise(store, &animation, &wanted, console).await?;
        if args.no_wait {
            console.note(format_args!(
                "{animation} is under way; rayfold status {animation} --bucket {} --watch follows it",
                store.bucket()
            ));
            return Ok(Outcome::Done);
        }
        let result = wait(store, &animation, &versions, console).await?;
        if let Err(manifest) = result {
            report::show_faults(&manifest, console);
            anyhow::bail!(
                "{animation} is {} ({}); rayfold retry {animation} tries again what is not the scripts' fault",
                report::word(manifest.head.status),
                report::count(&manifest)
            );
        }
        fetch::gif(store, &animation, &output, console).await?;
        Ok(Outcome::Done)
    })
}

fn name_of(folder: &Path) -> anyhow::Result<Animation> {
    let place = folder.canonicalize().with_context(|| format!("cannot read {}", folder.display()))?;
    let name = place.file_name().and_then(|name| name.to_str());
    let name = name.ok_or_else(|| Usage(format!("{} has no name to use: give --name", folder.display())))?;
    Ok(Animation::new(name)?)
}

/// What the bucket's folder should hold, by key.
fn wanted(
    input: &Input,
    plan: &Plan,
    animation: &Animation,
    console: &Console,
) -> anyhow::Result<BTreeMap<String, Wanted>> {
    let mut files = Vec::new();
    for path in input.scripts.iter().filter_map(|script| script.path()) {
        let name = path.file_name().and_then(|name| name.to_str());
        let name = name.with_context(|| format!("the name of {} is not UTF-8", path.display()))?;
        let name = ScriptName::new(name.trim_end_matches(".txt"))?;
        let key = animation.script(&name);
        if name.as_str().len() > LONGEST_NAME_ON_MINIO {
            console.note(format_args!(
                "{name}.txt: on S3 it is drawn; on MinIO, which keeps objects as files, a name of more than \
                 {LONGEST_NAME_ON_MINIO} bytes is too long for its frame"
            ));
        }
        // The pipeline refuses some names; say so now.
        key.parse::<rayfold_pipeline::keys::Key>()?;
        files.push((key, Content::File(path.to_path_buf())));
    }
    let settings = match (&input.settings, plan.settings.frames()) {
        (Some(path), Some(_)) => Content::File(path.clone()),
        _ => {
            let with_frames =
                AnimationSettings::new(Some(plan.len()), plan.settings.fps(), plan.settings.loops())?;
            Content::Text(serde_json::to_string_pretty(&with_frames)? + "\n")
        }
    };
    files.push((animation.settings(), settings));
    files.into_par_iter().map(|(key, content)| Ok((key, Wanted::new(content)?))).collect()
}

/// Makes the bucket's folder as wanted. Returns the version of each object.
///
/// What goes first matters: with scripts deleted, then the new number of frames, then new scripts, the animation is
/// never complete before it is what it should be.
async fn synchronise(
    store: &S3Store,
    animation: &Animation,
    wanted: &BTreeMap<String, Wanted>,
    console: &Console,
) -> anyhow::Result<BTreeMap<String, ETag>> {
    let Difference { mut changed, surplus, same } = compare(store, animation, wanted).await?;
    if !surplus.is_empty() {
        delete(store, &surplus).await?;
        console.note(format_args!(
            "{} no longer in the folder, deleted",
            number(surplus.len() as u64, "script")
        ));
    }
    let mut versions = same;
    let total = changed.len() as u64;
    let settings = animation.settings();
    if let Some(place) = changed.iter().position(|key| *key == settings) {
        changed.remove(place);
        versions.extend(send(store, std::slice::from_ref(&settings), wanted, |_| {}).await?);
    }
    let unchanged = wanted.len() as u64 - total;
    if changed.is_empty() {
        console.note(format_args!("{} up to date", address(store, &animation.scripts())));
    } else {
        let mut progress = Progress::start(console, "scripts uploaded", changed.len() as u64);
        let sent = send(store, &changed, wanted, |done| progress.set(console, done)).await?;
        let took = progress.finish().as_secs_f64();
        console.note(format_args!(
            "{}: {} uploaded in {took:.2} s, {unchanged} unchanged",
            address(store, &animation.scripts()),
            number(changed.len() as u64, "script")
        ));
        versions.extend(sent);
    }
    Ok(versions)
}

/// Waits until what was uploaded has become a GIF, or the manifest that says why it will not.
async fn wait(
    store: &S3Store,
    animation: &Animation,
    versions: &BTreeMap<String, ETag>,
    console: &Console,
) -> anyhow::Result<Result<(), Manifest>> {
    let mut watch = Watch::new(store, animation);
    let mut progress: Option<Progress> = None;
    let mut last_change = Instant::now();
    loop {
        let changed = watch.look_patiently().await?;
        if changed {
            last_change = Instant::now();
        }
        if let Some(manifest) = &watch.manifest
            && stands_for(manifest, animation, versions)
        {
            let head = &manifest.head;
            let total = head.total + head.missing() - head.pending;
            let bar = progress.get_or_insert_with(|| Progress::start(console, "frames", total));
            bar.resize(total);
            bar.set(console, head.done + head.failed);
            match head.status {
                Status::Done if watch.is_current() => return Ok(Ok(())),
                Status::Failed | Status::Refused => return Ok(Err(manifest.clone())),
                _ => {}
            }
        }
        if last_change.elapsed() > UNUSUAL {
            last_change = Instant::now();
            others(store, animation, versions).await?;
            console.note(format_args!(
                "nothing has happened for {} s: are the functions running? Ctrl-C loses nothing",
                UNUSUAL.as_secs()
            ));
        }
        anyhow::ensure!(!interrupt::stopping(), "interrupted");
        watch.pause().await;
    }
}

/// The manifest is about exactly these versions of exactly these files.
fn stands_for(manifest: &Manifest, animation: &Animation, versions: &BTreeMap<String, ETag>) -> bool {
    let mut seen: BTreeMap<String, &ETag> =
        manifest.frames.iter().map(|frame| (animation.script(&frame.script), &frame.version)).collect();
    if let Some(version) = &manifest.head.settings.version {
        seen.insert(animation.settings(), version);
    }
    seen.len() == versions.len() && seen.iter().all(|(key, version)| versions.get(key) == Some(*version))
}

/// # Errors
/// When somebody else has changed the scripts since.
async fn others(
    store: &S3Store,
    animation: &Animation,
    versions: &BTreeMap<String, ETag>,
) -> anyhow::Result<()> {
    let (listed, _) = list(store, ListRequest::level(animation.scripts())).await?;
    let now: BTreeMap<_, _> = listed.into_iter().map(|object| (object.key, object.etag)).collect();
    let gone = versions.iter().find(|(key, version)| now.get(*key) != Some(*version));
    let new = now.keys().find(|key| key.ends_with(".txt") && !versions.contains_key(*key));
    if let Some(key) = gone.map(|(key, _)| key).or(new) {
        anyhow::bail!("somebody else has changed {} meanwhile", address(store, key));
    }
    Ok(())
}
