//! One animation from its first upload to its GIF, with the observations made in between.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use bytes::Bytes;
use futures_util::stream::{self, StreamExt, TryStreamExt};
use rayfold_local::Platform;
use rayfold_local::observation::{Observation, Requests, Seen};
use rayfold_local::routes::Function;
use rayfold_pipeline::assemble::frame_key;
use rayfold_pipeline::keys::Animation;
use rayfold_pipeline::manifest::Manifest;
use rayfold_pipeline::store::{PutOptions, S3Store, Store};
use rayfold_scene::{AnimationSettings, SETTINGS_FILE, natural_cmp, parse_settings};
use serde_json::Value;
use tokio::sync::mpsc::UnboundedReceiver;

/// The number of concurrent uploads.
const UPLOADS: usize = 16;

/// The time between two polls for the result.
const LOOK: Duration = Duration::from_millis(10);

/// The time limit, much longer than any scene takes.
const PATIENCE: Duration = Duration::from_secs(1800);

/// The program that makes the GIF.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Compiled {
    ByTheFunction,
    /// This process, from fetched frames.
    Here,
}

/// A folder of scripts.
pub(crate) struct Folder {
    pub(crate) name: String,
    files: Vec<(String, Bytes)>,
    settings: AnimationSettings,
}

impl Folder {
    pub(crate) fn read(name: &str, path: &Path) -> Result<Self> {
        let mut files = Vec::new();
        for entry in std::fs::read_dir(path).with_context(|| path.display().to_string())? {
            let entry = entry?;
            let name = entry.file_name().to_string_lossy().into_owned();
            files.push((name, Bytes::from(std::fs::read(entry.path())?)));
        }
        files.sort_by(|(a, _), (b, _)| natural_cmp(a, b));
        let settings = files.iter().find(|(name, _)| name == SETTINGS_FILE);
        let settings = settings.map(|(name, text)| parse_settings(name, text).settings);
        let settings = settings.flatten().unwrap_or_default();
        Ok(Self { name: name.to_owned(), files, settings })
    }

    pub(crate) fn scripts(&self) -> impl Iterator<Item = (&str, &Bytes)> {
        self.files.iter().filter(|(name, _)| name.ends_with(".txt")).map(|(name, text)| (name.as_str(), text))
    }

    pub(crate) fn frames(&self) -> usize {
        self.scripts().count()
    }

    /// Returns the mean number of spheres, triangles, boxes and lights of a script.
    pub(crate) fn objects(&self) -> f64 {
        let is_object = |line: &&str| {
            let command = line.split_whitespace().next().unwrap_or_default().to_lowercase();
            ["sphere", "triangle", "box", "ilight"].contains(&command.as_str())
        };
        let count = |text: &Bytes| String::from_utf8_lossy(text).lines().filter(is_object).count();
        self.scripts().map(|(_, text)| count(text)).sum::<usize>() as f64 / self.frames() as f64
    }
}

/// The cost of a run.
pub(crate) struct Run {
    /// The time from the first upload to the GIF.
    pub(crate) total: Duration,
    /// The time from the last upload to the GIF.
    pub(crate) after_upload: Duration,
    /// The mean time of each stage of a frame, in milliseconds: reading, drawing, putting, folding.
    pub(crate) stages: [f64; 4],
    /// The time in which the assembler, or this program, built the GIF.
    pub(crate) building: Duration,
    /// The requests of all invocations of render and of assemble.
    pub(crate) requests: BTreeMap<Function, Requests>,
    /// The number of new processes, and the mean time from their start to their first call of `next`.
    pub(crate) cold_starts: usize,
    pub(crate) init: Duration,
    /// All invocations: function, process, start and end after the first upload.
    pub(crate) invocations: Vec<(Function, u32, Duration, Duration)>,
}

/// Uploads a folder as `animation` and waits for its GIF.
pub(crate) async fn run(
    platform: &Platform,
    seen: &mut UnboundedReceiver<Observation>,
    folder: &Folder,
    animation: &str,
    compiled: Compiled,
) -> Result<Run> {
    let store = platform.store();
    let animation = Animation::new(animation)?;
    let frames = folder.frames();
    // With one frame more than there will be, the assembler does not start.
    let wanted = if compiled == Compiled::Here { frames + 1 } else { frames };
    let settings = format!("{{\"frames\": {wanted}, \"fps\": {}}}", folder.settings.fps());
    let start = Instant::now();
    put(store, animation.settings(), settings.into()).await?;
    let uploads = folder.scripts().map(|(name, text)| {
        let key = format!("{}{name}", animation.scripts());
        put(store, key, text.clone())
    });
    let uploads: Vec<_> = uploads.collect();
    stream::iter(uploads).buffer_unordered(UPLOADS).try_collect::<Vec<()>>().await?;
    let uploaded = Instant::now();
    let mut building = Duration::ZERO;
    match compiled {
        Compiled::ByTheFunction => {
            until(async || Ok(store.head(&animation.gif()).await.is_ok())).await?;
        }
        Compiled::Here => {
            until(async || match store.get(&animation.manifest()).await {
                Ok(object) => {
                    let head = Manifest::decode(&animation, &object.body)?.head;
                    ensure!(head.failed == 0, "{animation} failed");
                    Ok(head.done == frames as u64)
                }
                Err(error) if error.is_not_found() => Ok(false),
                Err(error) => Err(error.into()),
            })
            .await?;
            let began = Instant::now();
            compile(store, &animation, folder).await?;
            building = began.elapsed();
        }
    }
    let end = Instant::now();
    platform.invoker().context("the invoker runs")?.idle().await;
    let mut run = sum_up(std::iter::from_fn(|| seen.try_recv().ok()), start);
    run.total = end - start;
    run.after_upload = end - uploaded;
    if compiled == Compiled::Here {
        run.building = building;
    }
    Ok(run)
}

pub(crate) async fn put(store: &S3Store, key: String, body: Bytes) -> Result<()> {
    Ok(store.put(&key, body, PutOptions::always()).await.map(drop)?)
}

async fn until(mut is_so: impl AsyncFnMut() -> Result<bool>) -> Result<()> {
    let start = Instant::now();
    while !is_so().await? {
        if start.elapsed() > PATIENCE {
            bail!("no result within {} s", PATIENCE.as_secs());
        }
        tokio::time::sleep(LOOK).await;
    }
    Ok(())
}

/// Fetches the frames and makes the GIF from them.
async fn compile(store: &S3Store, animation: &Animation, folder: &Folder) -> Result<Vec<u8>> {
    let object = store.get(&animation.manifest()).await?;
    let manifest = Manifest::decode(animation, &object.body)?;
    let keys: Vec<String> = manifest.frames.iter().filter_map(|frame| frame_key(animation, frame)).collect();
    let fetches = keys.iter().map(|key| store.get(key));
    let fetches: Vec<_> = fetches.collect();
    let mut images = stream::iter(fetches).buffered(UPLOADS);
    let settings = rayfold_gif::Settings::new(folder.settings.fps(), folder.settings.loops());
    let mut gif = Vec::new();
    let mut encoder = rayfold_gif::Encoder::new(&mut gif, settings)?;
    while let Some(image) = images.try_next().await? {
        encoder.push(image::load_from_memory(&image.body)?.into_rgb8())?;
    }
    encoder.finish()?;
    Ok(gif)
}

/// Sums up the observations of a run.
fn sum_up(seen: impl Iterator<Item = Observation>, start: Instant) -> Run {
    let mut stages = [0.0; 4];
    let (mut drawn, mut building, mut inits) = (0, 0, Vec::new());
    let mut requests: BTreeMap<Function, Requests> = BTreeMap::new();
    let mut invocations = Vec::new();
    for Observation { at, seen } in seen {
        match seen {
            Seen::Finished { attempt, took, init, requests: of, .. } => {
                *requests.entry(attempt.function).or_default() += of;
                inits.extend(init);
                let end = at.saturating_duration_since(start);
                invocations.push((attempt.function, attempt.pid, end.saturating_sub(took), end));
            }
            Seen::Log { line, .. } => {
                let line: Value = serde_json::from_str(&line).unwrap_or_default();
                if line["outcome"] == "drawn" {
                    drawn += 1;
                    for (sum, field) in stages.iter_mut().zip(["read_ms", "draw_ms", "put_ms", "fold_ms"]) {
                        *sum += line[field].as_f64().unwrap_or_default();
                    }
                }
                building += line["building_ms"].as_u64().unwrap_or_default();
            }
            _ => {}
        }
    }
    let mean = inits.iter().sum::<Duration>().checked_div(inits.len() as u32).unwrap_or_default();
    Run {
        total: Duration::ZERO,
        after_upload: Duration::ZERO,
        stages: stages.map(|sum| sum / f64::from(drawn.max(1))),
        building: Duration::from_millis(building),
        requests,
        cold_starts: inits.len(),
        init: mean,
        invocations,
    }
}
