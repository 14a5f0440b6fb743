//! The HTTP requests of the page about a bucket. The server's guard checks each request first.
//!
//! Names in queries are parsed like those of the pipeline, so a request can only mean an animation, a frame or a GIF,
//! never any other object.

use std::convert::Infallible;
use std::io;
use std::num::NonZeroU64;
use std::sync::{Arc, Mutex, PoisonError};

use axum::extract::{DefaultBodyLimit, Query, State};
use axum::http::{StatusCode, header};
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router};
use bytes::Bytes;
use futures_util::stream;
use rayfold_client::{Client, Error, FetchedFrame, Output, Watch, frames};
use rayfold_pipeline::keys::{Animation, Receipt, ScriptName, Tag};
use rayfold_pipeline::retry::Scope;
use rayfold_pipeline::store::{ETag, Store};
use rayfold_pipeline::{Clock, Randomness, SystemClock};
use rayfold_scene::Container;
use serde::{Deserialize, Serialize};
use serde_json::json;
use tokio::sync::{Semaphore, mpsc};

use super::offer::{Ready, Refusal};
use super::sending::{UploadProgress, Uploads};
use super::updates::{FrameUpdate, RunState, RunUpdate, Summary, faults, summary};
use crate::error::words;
use crate::output::frame_file;
use crate::pipe::{Zip, pipe};
use crate::project::Project;

/// The largest body of a request in bytes: names of scripts that may be deleted.
const BODY: usize = 1 << 20;

/// The largest number of runs in a list.
const LISTED: usize = 500;

/// The largest number of runs that are watched at the same time.
pub(super) const WATCHED: usize = 8;

/// The largest number of pictures and GIFs that are downloaded at the same time.
const FETCHED: usize = 12;

/// The largest GIF in bytes that is kept in memory.
const GIF: u64 = 512 << 20;

/// A bucket and its clients.
struct Runs<S> {
    bucket: String,
    store: S,
    project: Arc<Mutex<Project>>,
    uploads: Uploads,
    watched: Arc<Semaphore>,
    fetched: Semaphore,
    /// A permit to render frames for an estimate.
    estimating: Semaphore,
}

type Shared<S> = State<Arc<Runs<S>>>;

type Answer<T> = Result<T, Refused>;

/// The reason why a request is refused.
struct Refused(StatusCode, Refusal);

#[derive(Deserialize)]
struct Named {
    run: String,
}

#[derive(Deserialize)]
struct FileNamed {
    run: String,
    output: Container,
}

#[derive(Deserialize)]
struct FrameNamed {
    run: String,
    script: String,
    version: String,
    part: Option<NonZeroU64>,
    pixels: u32,
}

#[derive(Deserialize)]
struct Submit {
    run: String,
    /// Keys of scripts in the bucket that may be deleted.
    delete: Vec<String>,
}

#[derive(Deserialize)]
struct Retry {
    run: String,
    /// The script of one frame; without it, all failed frames are retried.
    script: Option<String>,
    part: Option<NonZeroU64>,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct List {
    bucket: String,
    runs: Vec<Summary>,
    /// The number of runs that are not listed.
    more: usize,
}

pub(super) fn without_bucket() -> Router {
    Router::new().route("/list", get(async || Json(json!({"bucket": null, "runs": [], "more": 0}))))
}

pub(super) fn with_bucket<S: Store + 'static>(
    bucket: String,
    store: S,
    project: Arc<Mutex<Project>>,
) -> Router {
    let runs = Runs {
        bucket,
        store,
        project,
        uploads: Uploads::default(),
        watched: Arc::new(Semaphore::new(WATCHED)),
        fetched: Semaphore::new(FETCHED),
        estimating: Semaphore::new(1),
    };
    Router::new()
        .route("/list", get(list::<S>))
        .route("/offer", get(offer::<S>))
        .route("/submit", post(submit::<S>))
        .route("/retry", post(retry::<S>))
        .route("/events", get(events::<S>))
        .route("/frame.png", get(frame::<S>))
        .route("/file", get(file::<S>))
        .route("/frames.zip", get(frames_zip::<S>))
        .layer(DefaultBodyLimit::max(BODY))
        .with_state(Arc::new(runs))
}

impl<S: Store> Runs<S> {
    fn client(&self) -> Client<'_, S, SystemClock> {
        Client::new(&self.store, &SystemClock)
    }

    fn ready(&self) -> Answer<Ready> {
        let ready = Ready::of(&self.project.lock().unwrap_or_else(PoisonError::into_inner));
        ready.map_err(|refusal| Refused(StatusCode::CONFLICT, refusal))
    }

    /// Returns the state of a run.
    fn state<C: Clock>(&self, watch: &Watch<'_, S, C>, problem: Option<String>) -> RunState {
        let (faults, more_faults) = watch.manifest().map_or_else(Default::default, faults);
        let sending = self.uploads.of(watch.animation());
        let mut summary = summary(watch);
        summary.settled &= !matches!(sending, Some(UploadProgress::Uploading { .. }));
        RunState { summary, faults, more_faults, sending, problem }
    }
}

impl From<Error> for Refused {
    fn from(error: Error) -> Self {
        let status = match &error {
            Error::NoAnimation(_) => StatusCode::NOT_FOUND,
            Error::WouldDelete { .. } => StatusCode::CONFLICT,
            _ => StatusCode::BAD_GATEWAY,
        };
        Self(status, Refusal::of(&error))
    }
}

impl From<rayfold_pipeline::Error> for Refused {
    fn from(error: rayfold_pipeline::Error) -> Self {
        match error {
            rayfold_pipeline::Error::Key { .. } => Self(StatusCode::BAD_REQUEST, Refusal::new(words(&error))),
            rayfold_pipeline::Error::NotFound { .. } => {
                Self(StatusCode::NOT_FOUND, Refusal::new(words(&error)))
            }
            error => Self::from(Error::Store(error)),
        }
    }
}

impl IntoResponse for Refused {
    fn into_response(self) -> Response {
        (self.0, Json(self.1)).into_response()
    }
}

fn busy(what: &str) -> Refused {
    Refused(StatusCode::SERVICE_UNAVAILABLE, Refusal::new(what))
}

/// Lists all runs of the bucket, including those that are being uploaded.
async fn list<S: Store + 'static>(State(runs): Shared<S>) -> Answer<Json<List>> {
    let client = runs.client();
    let mut names = client.animations().await?;
    names.extend(runs.uploads.all());
    names.sort();
    names.dedup();
    let more = names.len().saturating_sub(LISTED);
    names.truncate(LISTED);
    let watches = client.look(&names).await?;
    let summaries = watches.iter().map(|watch| runs.state(watch, None).summary).collect();
    Ok(Json(List { bucket: runs.bucket.clone(), runs: summaries, more }))
}

/// Returns what would be uploaded under a name, and the cost.
async fn offer<S: Store + 'static>(
    State(runs): Shared<S>,
    Query(named): Query<Named>,
) -> Answer<Json<serde_json::Value>> {
    let animation = Animation::new(&named.run)?;
    let Ok(_one) = runs.estimating.try_acquire() else {
        return Err(busy("an estimate is being made already"));
    };
    let (ready, estimate) = tokio::task::block_in_place(|| {
        let ready = runs.ready()?;
        let estimate = ready.estimate().map_err(|refusal| Refused(StatusCode::CONFLICT, refusal))?;
        Ok::<_, Refused>((ready, estimate))
    })?;
    let folder = animation.scripts();
    let submission =
        ready.submission(animation).map_err(|refusal| Refused(StatusCode::BAD_REQUEST, refusal))?;
    let preview = runs.client().preview(&submission).await?;
    Ok(Json(json!({
        "estimate": estimate,
        "folder": folder,
        "upload": preview.upload.len(),
        "unchanged": preview.unchanged,
        "delete": preview.delete,
    })))
}

/// Starts uploading the scripts of the page. Continues if the page is closed.
async fn submit<S: Store + 'static>(State(runs): Shared<S>, Json(wish): Json<Submit>) -> Answer<StatusCode> {
    let animation = Animation::new(&wish.run)?;
    let submission = tokio::task::block_in_place(|| {
        let submission = runs.ready()?.submission(animation.clone());
        submission.map_err(|refusal| Refused(StatusCode::BAD_REQUEST, refusal))
    })?;
    // Permission to delete one script is no permission to delete another.
    let preview = runs.client().preview(&submission).await?;
    if preview.delete.iter().any(|key| !wish.delete.contains(key)) {
        let refusal = Refusal {
            delete: preview.delete,
            ..Refusal::new("the bucket holds scripts that are not on the page")
        };
        return Err(Refused(StatusCode::CONFLICT, refusal));
    }
    if !runs.uploads.begin(&animation) {
        return Err(busy("it is being sent already"));
    }
    let submission = submission.deleting(wish.delete);
    tokio::spawn(async move {
        let report = |sending| runs.uploads.note(&animation, &sending);
        let ended = runs.client().submit(&submission, report).await;
        runs.uploads.end(&animation, ended);
    });
    Ok(StatusCode::ACCEPTED)
}

async fn retry<S: Store + 'static>(
    State(runs): Shared<S>,
    Json(wish): Json<Retry>,
) -> Answer<Json<serde_json::Value>> {
    let animation = Animation::new(&wish.run)?;
    let script = wish.script.as_deref().map(ScriptName::new).transpose()?;
    let scope = match &script {
        Some(script) => Scope::Frame(script, wish.part),
        None => Scope::Failed,
    };
    let seed = getrandom::u64().map_err(|error| busy(&format!("no randomness: {error}")))?;
    let (random, pixels) = (Randomness::seeded(seed), rayfold_tracer::PIXEL_VERSION);
    let retried = runs.client().retry(&animation, scope, pixels, &random).await?;
    Ok(Json(json!({"woken": retried.woken, "reassembled": retried.reassembled})))
}

/// Sends the state of a run, and each change of it, as server-sent events.
async fn events<S: Store + 'static>(
    State(runs): Shared<S>,
    Query(named): Query<Named>,
) -> Answer<impl IntoResponse> {
    let animation = Animation::new(&named.run)?;
    let Ok(permit) = Arc::clone(&runs.watched).try_acquire_owned() else {
        return Err(busy("as many runs are watched as there is room for: close some of their pages"));
    };
    let (sender, receiver) = mpsc::channel(1);
    tokio::spawn(async move {
        tokio::select! {
            () = sender.closed() => {}
            () = watch(&runs, animation, &sender) => {}
        }
        drop(permit);
    });
    let next = async |mut receiver: mpsc::Receiver<Event>| {
        receiver.recv().await.map(|event| (Ok::<_, Infallible>(event), receiver))
    };
    Ok(Sse::new(stream::unfold(receiver, next)).keep_alive(KeepAlive::default()))
}

async fn watch<S: Store>(runs: &Runs<S>, animation: Animation, sender: &mpsc::Sender<Event>) {
    let mut watch = Watch::new(runs.client(), animation);
    let (mut last, mut ended) = (None, 0);
    loop {
        let ended_before = std::mem::replace(&mut ended, runs.uploads.ended());
        let looked = async {
            let changed = watch.poll().await?;
            if changed || watch.is_behind() || last.is_none() || ended != ended_before {
                watch.compare().await?;
            }
            Ok::<_, Error>(())
        };
        let problem = looked.await.err().map(|error| words(&error));
        let frames = watch.manifest().map_or(&[][..], |manifest| &manifest.frames);
        let frames = frames.iter().map(FrameUpdate::of).collect();
        if let Some(tell) = RunUpdate::since(&mut last, runs.state(&watch, problem), frames) {
            // Numbers, texts and lists of them can always be written as JSON.
            let event = Event::default().data(serde_json::to_string(&tell).unwrap_or_default());
            if sender.send(event).await.is_err() {
                return;
            }
        }
        watch.pause().await;
    }
}

/// Returns the PNG of a rendered frame.
async fn frame<S: Store + 'static>(
    State(runs): Shared<S>,
    Query(named): Query<FrameNamed>,
) -> Answer<impl IntoResponse> {
    let animation = Animation::new(&named.run)?;
    let tag = Tag { version: ETag::new(&named.version), pixels: named.pixels };
    let receipt = Receipt::Frame { name: ScriptName::new(&named.script)?, tag, part: named.part };
    let Ok(_one) = runs.fetched.acquire().await else { return Err(busy("the studio ends")) };
    let png = runs.store.get(&animation.receipt(&receipt)).await?.body;
    Ok(([(header::CONTENT_TYPE, "image/png")], png))
}

/// Returns a current file.
async fn file<S: Store + 'static>(
    State(runs): Shared<S>,
    Query(named): Query<FileNamed>,
) -> Answer<impl IntoResponse> {
    let animation = Animation::new(&named.run)?;
    let Ok(_one) = runs.fetched.acquire().await else { return Err(busy("the studio ends")) };
    let mut file = Bounded(Vec::new());
    runs.client().fetch(&animation, named.output, &mut file).await.map_err(|error| match error {
        Error::Store(error) => Refused::from(error),
        error => Refused::from(error),
    })?;
    Ok(([(header::CONTENT_TYPE, named.output.media_type())], Bytes::from(file.0)))
}

/// Returns the rendered frames as a zip file.
async fn frames_zip<S: Store + 'static>(
    State(runs): Shared<S>,
    Query(named): Query<Named>,
) -> Answer<impl IntoResponse> {
    let animation = Animation::new(&named.run)?;
    let keys = {
        let watches = runs.client().look(std::slice::from_ref(&animation)).await?;
        let manifest = watches.first().and_then(Watch::manifest);
        manifest.map(|manifest| (frames(manifest).drawn, manifest.frames.len() as u64))
    };
    let Some((keys, of)) = keys else { return Err(Refused::from(Error::NoAnimation(animation))) };
    let (pipe, body) = pipe();
    tokio::spawn(async move {
        let failures = pipe.failures();
        let mut zip = Zip::new(pipe);
        let take = |frame: FetchedFrame<'_>| {
            tokio::task::block_in_place(|| zip.add(&frame_file(frame.number, of), &frame.png))
        };
        let fetched = runs.client().fetch_frames(&keys, take).await.map_err(io::Error::other);
        if let Err(error) = fetched.and_then(|()| tokio::task::block_in_place(|| zip.finish())) {
            let _ = failures.send(Err(error)).await;
        }
    });
    Ok(([(header::CONTENT_TYPE, "application/zip")], body))
}

/// A buffer with a size limit.
struct Bounded(Vec<u8>);

impl Output for Bounded {
    fn begin(&mut self, size: u64) -> io::Result<()> {
        if size > GIF {
            return Err(io::Error::other(format!(
                "the GIF is larger than {GIF} bytes; `rayfold fetch` writes it to a file"
            )));
        }
        self.0.clear();
        Ok(())
    }

    fn write(&mut self, piece: &[u8]) -> io::Result<()> {
        self.0.extend_from_slice(piece);
        Ok(())
    }
}
