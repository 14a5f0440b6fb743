//! The start page: recent scenes, examples as copies, and an empty scene. It opens nothing itself: a choice becomes a
//! path, and the caller answers with the address of the studio that opened it.
//!
//! The page names a scene by its place in a list, so no path of a request reaches the file system.

mod html;
mod recent;

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use axum::Router;
use axum::extract::{Query, State};
use axum::http::{StatusCode, header};
use axum::middleware::from_fn_with_state;
use axum::response::{IntoResponse, Redirect, Response};
use axum::routing::get;
use rayfold_files::OutputFile;
use serde::Deserialize;
use tokio::sync::{Semaphore, mpsc, oneshot};
use tokio::task::JoinHandle;

use crate::door::{Door, guard, serve};
use crate::error::{Error, words};
use crate::examples;
use crate::output::thumbnail;
pub use recent::Recent;

/// The maximum number of copies of a name in a folder.
const COPIES: usize = 999;

/// A scene that looks good before objects are added.
const EMPTY: &str = include_str!("start/empty.txt");

/// The start page and its server.
#[derive(Debug)]
pub struct Start {
    address: String,
    choices: mpsc::Receiver<Choice>,
    task: JoinHandle<()>,
}

/// A scene to open.
#[derive(Debug)]
pub struct Choice {
    /// The script or the folder.
    pub path: PathBuf,
    /// Receives the address of its studio, or the reason why it cannot be opened.
    pub answer: oneshot::Sender<Result<String, String>>,
}

struct Shared {
    recent: Recent,
    /// The recent scenes that pages have shown, by their numbers in links.
    shown: Mutex<Vec<PathBuf>>,
    /// The folder for copies of examples.
    folder: PathBuf,
    choices: mpsc::Sender<Choice>,
    /// The permit to render small pictures, which are rendered one after the other.
    drawing: Semaphore,
}

/// The scene that a request names, or an empty one.
#[derive(Deserialize)]
struct SceneQuery {
    recent: Option<usize>,
    example: Option<String>,
}

impl Start {
    /// Serves the page on this port, or on any free one if it is 0. Copies are made in `folder`.
    ///
    /// # Errors
    /// Fails if the port is taken or the system has no randomness.
    pub async fn open(recent: Recent, folder: &Path, port: u16) -> Result<Self, Error> {
        let (listener, door) = Door::open(port).await?;
        let (address, door) = (door.address(), Arc::new(door));
        let (sender, choices) = mpsc::channel(1);
        let shared = Arc::new(Shared {
            recent,
            shown: Mutex::default(),
            folder: folder.to_owned(),
            choices: sender,
            drawing: Semaphore::new(1),
        });
        let router = Router::new()
            .route("/{token}/", get(page))
            .route("/{token}/start.css", get(style))
            .route("/{token}/example.png", get(picture))
            .route("/{token}/open", get(choose))
            .with_state(shared)
            .layer(from_fn_with_state(door, guard));
        Ok(Self { address, choices, task: tokio::spawn(serve(listener, router)) })
    }

    /// Returns the URL of the page, with the token.
    pub fn address(&self) -> &str {
        &self.address
    }

    /// Returns the next scene that is chosen.
    pub async fn choice(&mut self) -> Option<Choice> {
        self.choices.recv().await
    }
}

impl Shared {
    fn shown(&self) -> MutexGuard<'_, Vec<PathBuf>> {
        self.shown.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the recent scenes with their numbers, the newest first. A path keeps its number.
    fn recent(&self) -> Vec<(usize, PathBuf)> {
        let mut shown = self.shown();
        let mut number = |path: &PathBuf| {
            shown.iter().position(|other| other == path).unwrap_or_else(|| {
                shown.push(path.clone());
                shown.len() - 1
            })
        };
        self.recent.list().into_iter().map(|path| (number(&path), path)).collect()
    }
}

impl Drop for Start {
    fn drop(&mut self) {
        self.task.abort();
    }
}

async fn page(State(shared): State<Arc<Shared>>) -> Response {
    let html = html::page(&shared.recent(), &shared.folder, &examples::names());
    ([(header::CONTENT_TYPE, "text/html; charset=utf-8")], html).into_response()
}

async fn style() -> Response {
    ([(header::CONTENT_TYPE, "text/css; charset=utf-8")], include_str!("start/start.css")).into_response()
}

/// Returns a small picture of the first frame of the example that the query names, or of the empty scene.
async fn picture(State(shared): State<Arc<Shared>>, Query(what): Query<SceneQuery>) -> Response {
    let Ok(_permit) = shared.drawing.acquire().await else {
        return StatusCode::SERVICE_UNAVAILABLE.into_response();
    };
    let png = tokio::task::block_in_place(|| {
        let script = rayfold_scene::parse("example", text(&what)?.as_bytes(), &Default::default()).script?;
        thumbnail(script.frame(0)?).ok()?
    });
    match png {
        Some(png) => ([(header::CONTENT_TYPE, "image/png")], png).into_response(),
        None => StatusCode::NO_CONTENT.into_response(),
    }
}

fn text(what: &SceneQuery) -> Option<&'static str> {
    what.example.as_deref().map_or(Some(EMPTY), examples::text)
}

async fn choose(State(shared): State<Arc<Shared>>, Query(what): Query<SceneQuery>) -> Response {
    let path = match what.recent {
        Some(number) => {
            shared.shown().get(number).cloned().ok_or_else(|| "there is no such scene".to_owned())
        }
        None => copy(&shared.folder, &what),
    };
    let opened = match path {
        Ok(path) => {
            let (answer, answered) = oneshot::channel();
            let sent = shared.choices.send(Choice { path, answer }).await;
            if sent.is_err() {
                Err("the studio ends".to_owned())
            } else {
                answered.await.unwrap_or_else(|error| Err(error.to_string()))
            }
        }
        Err(error) => Err(error),
    };
    match opened {
        // The page has a link back.
        Ok(address) => Redirect::to(&format!("{address}?start")).into_response(),
        Err(why) => (StatusCode::CONFLICT, format!("{why}\n")).into_response(),
    }
}

/// Writes a text to a new script of the folder, under the first free name.
fn copy(folder: &Path, what: &SceneQuery) -> Result<PathBuf, String> {
    let name = what.example.as_deref().unwrap_or("scene");
    let text = text(what).ok_or_else(|| format!("there is no example {name}"))?;
    for number in 1..=COPIES {
        let end = if number == 1 { String::new() } else { format!("-{number}") };
        let path = folder.join(format!("{name}{end}.txt"));
        match OutputFile::write_new(&path, text.as_bytes()) {
            Ok(()) => return Ok(path),
            Err(error) if error.is_taken() => {}
            Err(error) => return Err(words(&error)),
        }
    }
    Err(format!("{} has {COPIES} scenes of this name", folder.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_have_names_of_their_own_and_the_empty_scene_is_in_order() {
        let folder = tempfile::tempdir().unwrap();
        let example = SceneQuery { recent: None, example: Some("hello".into()) };
        let names = [1, 2, 3].map(|_| copy(folder.path(), &example).unwrap().file_name().unwrap().to_owned());
        assert_eq!(names, ["hello.txt", "hello-2.txt", "hello-3.txt"]);
        let path = copy(folder.path(), &SceneQuery { recent: None, example: None }).unwrap();
        let parsed = rayfold_scene::parse("scene", &std::fs::read(path).unwrap(), &Default::default());
        assert!(parsed.diagnostics.is_empty(), "{:?}", parsed.diagnostics);
        let other = SceneQuery { recent: None, example: Some("../hello".into()) };
        assert!(copy(folder.path(), &other).unwrap_err().contains("no example"));
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn a_choice_leads_to_the_studio_that_opens_it() {
        let folder = tempfile::tempdir().unwrap();
        let recent = Recent::at(folder.path().join("recent.json"));
        recent.add(folder.path());
        let mut start = Start::open(recent, folder.path(), 0).await.unwrap();
        let address = start.address().to_owned();
        let host = address.split('/').nth(2).unwrap().to_owned();
        let root = address.strip_prefix(&format!("http://{host}")).unwrap().to_owned();
        let request = |path: &str| {
            let (host, path) = (host.clone(), format!("{root}{path}"));
            async move {
                use tokio::io::{AsyncReadExt, AsyncWriteExt};
                let mut stream = tokio::net::TcpStream::connect(&host).await.unwrap();
                let text = format!("GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n");
                stream.write_all(text.as_bytes()).await.unwrap();
                let mut answer = Vec::new();
                stream.read_to_end(&mut answer).await.unwrap();
                String::from_utf8_lossy(&answer).into_owned()
            }
        };
        let page = request("").await;
        assert!(page.contains("open?recent=0") && page.contains("open?example=hello"), "{page}");
        Recent::at(folder.path().join("recent.json")).add(&folder.path().join("recent.json"));
        let page = request("").await;
        let (newest, older) = (page.find("open?recent=1").unwrap(), page.find("open?recent=0").unwrap());
        assert!(newest < older, "a scene keeps its number: {page}");
        assert!(request("example.png?example=hello").await.contains("image/png"));
        let asked = tokio::spawn(request("open?recent=0"));
        let choice = start.choice().await.unwrap();
        assert_eq!(choice.path, folder.path().canonicalize().unwrap());
        choice.answer.send(Ok("http://127.0.0.1:1/a/".into())).unwrap();
        let answer = asked.await.unwrap();
        assert!(
            answer.starts_with("HTTP/1.1 303") && answer.contains("http://127.0.0.1:1/a/?start"),
            "{answer}"
        );
        let asked = tokio::spawn(request("open"));
        start.choice().await.unwrap().answer.send(Err("no room".into())).unwrap();
        assert!(asked.await.unwrap().contains("409"));
        assert!(request("open?recent=7").await.contains("no such scene"));
    }
}
