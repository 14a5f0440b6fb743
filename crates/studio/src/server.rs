//! The server of the page, behind its [`Door`]. No path of a request reaches the file system. One page works at a time,
//! and a new one replaces it.

use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Duration;

use axum::Router;
use axum::body::{Body, Bytes};
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::extract::{Request, State};
use axum::http::{StatusCode, header};
use axum::middleware::from_fn_with_state;
use axum::response::{IntoResponse, Redirect, Response};
use axum::routing::{any, get};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc, oneshot};
use tokio::task::JoinHandle;
use tokio::time::MissedTickBehavior;

use crate::door::{Door, guard, serve};
use crate::error::Error;
use crate::materials;
use crate::output::{frame_png, scripts_zip, thumbnail};
use crate::outputs::{Outputs, frames_zip};
use crate::page::Page;
use crate::pictures::Painter;
use crate::project::Project;
use crate::protocol::{ClientMessage, ServerMessage};
use crate::runs::Cloud;
use crate::session::{Answer, Output, Session};

/// The largest message of the page in bytes: more than a pasted line.
const MESSAGE: usize = 2 << 20;

/// The largest number of messages that wait to be sent to the page. The painter limits pictures further.
const WAITING: usize = 64;

/// The number of downloads for which frames are rendered at the same time, besides the viewport.
const DRAWN: usize = 2;

/// The interval at which files are checked and written.
const TICK: Duration = Duration::from_millis(250);

/// A running server.
#[derive(Debug)]
pub struct Server {
    address: String,
    shared: Arc<Shared>,
    stop: oneshot::Sender<()>,
    task: JoinHandle<()>,
}

#[derive(Debug)]
struct Shared {
    project: Arc<Mutex<Project>>,
    outputs: Arc<Outputs>,
    page: Page,
    /// Whether there is a bucket to submit to.
    can_submit: bool,
    /// A permit to render frames for downloads.
    drawing: Arc<Semaphore>,
    /// The permit to render small pictures, which are rendered one after the other.
    thumbnails: Semaphore,
    /// Ends the session of the current page.
    working: Mutex<Option<oneshot::Sender<()>>>,
    /// The address of the start page that it was opened from.
    start_page: OnceLock<String>,
}

impl Server {
    /// Serves a project, and a bucket to submit it to, on this port, or on any free one if it is 0.
    ///
    /// # Errors
    /// Fails if the port is taken or the system has no randomness.
    pub async fn start(project: Project, page: Page, cloud: Cloud, port: u16) -> Result<Self, Error> {
        let (listener, door) = Door::open(port).await?;
        let (address, door) = (door.address(), Arc::new(door));
        let project = Arc::new(Mutex::new(project));
        let shared = Arc::new(Shared {
            project: Arc::clone(&project),
            outputs: Arc::default(),
            page,
            can_submit: cloud.has_bucket(),
            drawing: Arc::new(Semaphore::new(DRAWN)),
            thumbnails: Semaphore::new(1),
            working: Mutex::default(),
            start_page: OnceLock::new(),
        });
        let router = Router::new()
            .route("/{token}/", get(html))
            .route("/{token}/studio.js", get(script))
            .route("/{token}/studio.css", get(style))
            .route("/{token}/socket", any(socket))
            .route("/{token}/animation", get(animation))
            .route("/{token}/scripts.zip", get(scripts))
            .route("/{token}/frame.png", get(frame))
            .route("/{token}/frames.zip", get(frames))
            .route("/{token}/thumbnail.png", get(thumbnail_of))
            .route("/{token}/script.txt", get(one_script))
            .route("/{token}/material.png", get(material))
            .route("/{token}/preset.png", get(preset))
            .route("/{token}/start", get(start_page))
            .with_state(Arc::clone(&shared))
            .nest("/{token}/runs", cloud.router(project))
            .layer(from_fn_with_state(door, guard));
        let (stop, stopped) = oneshot::channel();
        let task = tokio::spawn(async move {
            tokio::select! {
                () = serve(listener, router) => {}
                _ = stopped => {}
            }
        });
        Ok(Self { address, shared, stop, task })
    }

    /// Returns the URL of the page, with the token.
    pub fn address(&self) -> &str {
        &self.address
    }

    /// Lets the page link to the start page from which it was opened.
    pub fn lead_to_start(&self, address: &str) {
        // A second address would be the same.
        let _ = self.shared.start_page.set(address.to_owned());
    }

    /// Writes pending changes and stops. Returns the names of the files that could not be written.
    pub async fn stop(self) -> Vec<String> {
        let _ = self.stop.send(());
        let _ = self.task.await;
        self.shared.outputs.cancel();
        let mut project = self.shared.project();
        project.save(true);
        let unsaved = project.files.iter().filter(|file| file.saved() != crate::project::Saved::Yes);
        unsaved.map(|file| file.name.clone()).collect()
    }
}

impl Shared {
    fn project(&self) -> MutexGuard<'_, Project> {
        self.project.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns a permit to render frames for a download, if one is free.
    fn may_draw(&self) -> Option<OwnedSemaphorePermit> {
        Arc::clone(&self.drawing).try_acquire_owned().ok()
    }
}

async fn html(State(shared): State<Arc<Shared>>) -> Response {
    file("text/html; charset=utf-8", shared.page.html.clone())
}

async fn script(State(shared): State<Arc<Shared>>) -> Response {
    file("text/javascript; charset=utf-8", shared.page.script.clone())
}

async fn style(State(shared): State<Arc<Shared>>) -> Response {
    file("text/css; charset=utf-8", shared.page.style.clone())
}

async fn animation(State(shared): State<Arc<Shared>>) -> Response {
    match shared.outputs.file() {
        Some((container, bytes)) => file(container.media_type(), bytes.to_vec()),
        None => (StatusCode::NOT_FOUND, "no animation has been rendered yet\n").into_response(),
    }
}

async fn scripts(State(shared): State<Arc<Shared>>) -> Response {
    let zip = tokio::task::block_in_place(|| scripts_zip(&shared.project()));
    zip.map_or_else(|error| failed(&error), |zip| file("application/zip", zip))
}

/// Returns the current text of a script. The query is its index among the files.
async fn one_script(State(shared): State<Arc<Shared>>, request: Request) -> Response {
    let index: usize = request.uri().query().unwrap_or_default().parse().unwrap_or(0);
    let text = shared.project().files.get(index).map(|opened| opened.document.bytes());
    match text {
        Some(text) => file("text/plain; charset=utf-8", text),
        None => (StatusCode::NOT_FOUND, "there is no such script\n").into_response(),
    }
}

async fn frames(State(shared): State<Arc<Shared>>) -> Response {
    let Some(permit) = shared.may_draw() else { return busy() };
    let zip = tokio::task::block_in_place(|| frames_zip(&shared.project(), permit));
    zip.map_or_else(
        |error| failed(&error),
        |zip| ([(header::CONTENT_TYPE, "application/zip")], zip).into_response(),
    )
}

/// Returns the PNG of a frame. The query is its number, from 0.
async fn frame(State(shared): State<Arc<Shared>>, request: Request) -> Response {
    let Some(_permit) = shared.may_draw() else { return busy() };
    let number = request.uri().query().unwrap_or_default().parse().unwrap_or(0);
    let (script, frame) = {
        let project = shared.project();
        let place = project.place(number);
        (project.files[place.file].script.clone(), place.frame)
    };
    let png = tokio::task::block_in_place(|| script.map_or(Ok(None), |script| frame_png(&script, frame)));
    picture(png, (StatusCode::NOT_FOUND, "this frame has nothing to draw\n"))
}

/// Returns a small picture of a script's first frame. The query is its index among the files.
async fn thumbnail_of(State(shared): State<Arc<Shared>>, request: Request) -> Response {
    let Ok(_permit) = shared.thumbnails.acquire().await else { return busy() };
    let query = request.uri().query().unwrap_or_default();
    let index = query.split(',').next().and_then(|index| index.parse::<usize>().ok());
    let png = tokio::task::block_in_place(|| {
        let scene = index.and_then(|index| shared.project().files.get(index)?.frame(0).scene.clone());
        scene.map_or(Ok(None), thumbnail)
    });
    // A script without a picture is no error.
    picture(png, StatusCode::NO_CONTENT)
}

/// Returns a sphere of a material. The query is the index of its file, its line and the number of the
/// frame, joined by commas.
async fn material(State(shared): State<Arc<Shared>>, request: Request) -> Response {
    let query = request.uri().query().unwrap_or_default();
    let mut numbers = query.split(',').map(|number| number.parse().unwrap_or(0usize));
    let mut next = || numbers.next().unwrap_or(0);
    let (of, line, frame) = (next(), next(), next());
    let png = tokio::task::block_in_place(|| {
        let (lines, library): (Vec<_>, _) = {
            let project = shared.project();
            let Some(file) = project.files.get(of) else { return Ok(None) };
            (file.document.lines().iter().take(line + 1).cloned().collect(), file.library().clone())
        };
        materials::sphere(&lines, line, u32::try_from(frame).unwrap_or(u32::MAX), &library)
    });
    // The script may have changed since the page wanted it.
    picture(png, StatusCode::NO_CONTENT)
}

/// Returns a sphere of the starter material that the query names.
async fn preset(request: Request) -> Response {
    let name = request.uri().query().unwrap_or_default();
    let png = tokio::task::block_in_place(|| materials::preset_sphere(name));
    picture(png, (StatusCode::NOT_FOUND, "there is no such starter material\n"))
}

/// Redirects to the start page from which the studio was opened.
async fn start_page(State(shared): State<Arc<Shared>>) -> Response {
    match shared.start_page.get() {
        Some(address) => Redirect::to(address).into_response(),
        None => (StatusCode::NOT_FOUND, "the studio was opened without a start page\n").into_response(),
    }
}

fn picture(png: Result<Option<Vec<u8>>, Error>, missing: impl IntoResponse) -> Response {
    match png {
        Ok(Some(png)) => file("image/png", png),
        Ok(None) => missing.into_response(),
        Err(error) => failed(&error),
    }
}

fn file(kind: &'static str, bytes: Vec<u8>) -> Response {
    ([(header::CONTENT_TYPE, kind)], Body::from(bytes)).into_response()
}

fn busy() -> Response {
    let why = "frames are drawn for other downloads: wait for these\n";
    (StatusCode::SERVICE_UNAVAILABLE, why).into_response()
}

fn failed(error: &Error) -> Response {
    (StatusCode::INTERNAL_SERVER_ERROR, format!("{error}\n")).into_response()
}

async fn socket(State(shared): State<Arc<Shared>>, upgrade: WebSocketUpgrade) -> Response {
    let (leave, left) = oneshot::channel();
    if let Some(old) = shared.working.lock().unwrap_or_else(PoisonError::into_inner).replace(leave) {
        let _ = old.send(());
    }
    upgrade
        .max_message_size(MESSAGE)
        .max_frame_size(MESSAGE)
        .on_upgrade(move |socket| work(shared, socket, left))
}

/// Runs the session of a page, until it closes or another replaces it.
async fn work(shared: Arc<Shared>, mut socket: WebSocket, mut left: oneshot::Receiver<()>) {
    let (pictures, mut drawn) = mpsc::channel::<Vec<u8>>(WAITING);
    let (tellings, mut messages) = mpsc::channel::<ServerMessage>(WAITING);
    let Ok(painter) = Painter::start(move |picture| pictures.blocking_send(picture).is_ok()) else { return };
    let (mut session, mut answer) = Session::open(&shared.project());
    answer.tell.can_submit = Some(shared.can_submit);
    let mut tick = tokio::time::interval(TICK);
    tick.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut next = Some(answer);
    loop {
        let message = match next.take() {
            Some(answer) => {
                if answer.shown {
                    painter.shown();
                    continue;
                }
                if let Some(picture) = answer.picture {
                    painter.want(picture);
                }
                match answer.output {
                    Some(Output::Cancel) => shared.outputs.cancel(),
                    Some(Output::Render(format)) => {
                        let tellings = tellings.clone();
                        shared.outputs.start(&shared.project(), format, move |output| {
                            let tell = ServerMessage { output: Some(output), ..ServerMessage::default() };
                            // If this fails, the page has gone.
                            let _ = tellings.blocking_send(tell);
                        });
                    }
                    None => {}
                }
                text(&answer.tell)
            }
            None => tokio::select! {
                picture = drawn.recv() => match picture {
                    Some(picture) => Message::Binary(Bytes::from(picture)),
                    None => break,
                },
                tell = messages.recv() => match tell {
                    Some(tell) => text(&tell),
                    None => break,
                },
                message = socket.recv() => {
                    match message {
                        Some(Ok(Message::Text(message))) => {
                            next = Some(ask(&shared, &mut session, &message));
                        }
                        Some(Ok(Message::Binary(_) | Message::Ping(_) | Message::Pong(_))) => {}
                        Some(Ok(Message::Close(_)) | Err(_)) | None => break,
                    }
                    continue;
                },
                _ = tick.tick() => {
                    next = tokio::task::block_in_place(|| session.tick(&mut shared.project()));
                    continue;
                },
                _ = &mut left => {
                    let _ = socket.send(text(&notice("Another page has taken over; this one rests."))).await;
                    break;
                }
            },
        };
        if socket.send(message).await.is_err() {
            break;
        }
    }
    painter.close();
    tokio::task::block_in_place(|| shared.project().save(true));
}

fn ask(shared: &Shared, session: &mut Session, message: &str) -> Answer {
    match serde_json::from_str::<ClientMessage>(message) {
        Ok(ask) => tokio::task::block_in_place(|| session.ask(&mut shared.project(), ask)),
        Err(error) => Answer {
            tell: notice(&format!("the page said what is not understood: {error}")),
            ..Answer::default()
        },
    }
}

fn notice(text: &str) -> ServerMessage {
    ServerMessage { notice: Some(text.into()), ..ServerMessage::default() }
}

fn text(tell: &ServerMessage) -> Message {
    // Numbers, texts and lists of them can always be written as JSON.
    Message::Text(serde_json::to_string(tell).unwrap_or_default().into())
}

#[cfg(test)]
mod tests {
    use tokio::io::{AsyncReadExt, AsyncWriteExt};
    use tokio::net::TcpStream;

    use super::*;
    use crate::door::{CONNECTIONS, TOKEN};

    /// Returns the status of a request that is written literally to the socket.
    async fn status(host: &str, path: &str, headers: &[(&str, &str)]) -> u16 {
        let mut stream = TcpStream::connect(host).await.unwrap();
        let mut text = format!("GET {path} HTTP/1.1\r\n");
        for (name, value) in headers {
            text.push_str(&format!("{name}: {value}\r\n"));
        }
        stream.write_all(format!("{text}\r\n").as_bytes()).await.unwrap();
        let mut answer = [0; 12];
        stream.read_exact(&mut answer).await.unwrap();
        std::str::from_utf8(&answer[9..]).unwrap().parse().unwrap()
    }

    /// Many idle clients do not keep a page out, and are disconnected.
    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn half_open_connections_are_closed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        let project = Project::open(&path).unwrap();
        let server = Server::start(project, Page::built_in(), Cloud::none(), 0).await.unwrap();
        let rest = server.address().strip_prefix("http://").unwrap();
        let (host, path) = rest.split_at(rest.find('/').unwrap());
        let mut silent = Vec::new();
        for _ in 0..2 * CONNECTIONS {
            let mut stream = TcpStream::connect(host).await.unwrap();
            stream.write_all(b"GET / HTTP/1.1\r\nHost:").await.unwrap();
            silent.push(stream);
        }
        assert_eq!(status(host, path, &[("Host", host)]).await, 200);
        for mut stream in silent {
            let mut rest = Vec::new();
            // The end, or a reset: either way it is closed.
            let _ = stream.read_to_end(&mut rest).await;
        }
        assert!(server.stop().await.is_empty());
    }

    #[tokio::test(flavor = "multi_thread", worker_threads = 1)]
    async fn only_who_knows_the_address_gets_in() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a.txt"), "Screen 4 3\nLook 0 0 9 0 0 0 40\nTrace").unwrap();
        let project = Project::open(folder.path()).unwrap();
        let server = Server::start(project, Page::built_in(), Cloud::none(), 0).await.unwrap();
        let rest = server.address().strip_prefix("http://").unwrap();
        let (host, path) = rest.split_at(rest.find('/').unwrap());
        assert!(host.starts_with("127.0.0.1:") && path.len() == 2 * TOKEN + 2);
        let own = format!("http://{host}");
        let check = async |path: &str, headers: &[(&str, &str)], expected: u16| {
            assert_eq!(status(host, path, headers).await, expected, "{path} {headers:?}");
        };
        check(path, &[("Host", host)], 200).await;
        check(path, &[("Host", host), ("Origin", &own)], 200).await;
        check("/", &[("Host", host)], 403).await;
        check(&format!("/{}/", "0".repeat(2 * TOKEN)), &[("Host", host)], 403).await;
        check(&path[..path.len() - 1], &[("Host", "localhost")], 403).await;
        check(path, &[("Host", "evil.example")], 403).await;
        check(path, &[("Host", host), ("Origin", "http://evil.example")], 403).await;
        check(path, &[("Host", host), ("Origin", "null")], 403).await;
        check(&format!("{path}a.txt"), &[("Host", host)], 404).await;
        check(&format!("{path}thumbnail.png?0,1"), &[("Host", host)], 200).await;
        check(&format!("{path}thumbnail.png?1"), &[("Host", host)], 204).await;
        check(&format!("{path}%2e%2e/a.txt"), &[("Host", host)], 404).await;
        let socket = format!("{path}socket");
        let upgrade = [
            ("Host", host),
            ("Connection", "Upgrade"),
            ("Upgrade", "websocket"),
            ("Sec-WebSocket-Version", "13"),
            ("Sec-WebSocket-Key", "AAAAAAAAAAAAAAAAAAAAAA=="),
        ];
        check(&socket, &upgrade, 403).await;
        check(&socket, &[&upgrade[..], &[("Origin", "http://evil.example")]].concat(), 403).await;
        check(&socket, &[&upgrade[..], &[("Origin", own.as_str())]].concat(), 101).await;
        assert!(server.stop().await.is_empty());
    }
}
