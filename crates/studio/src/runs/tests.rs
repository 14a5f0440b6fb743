//! Tests of the bucket's routes over real sockets: responses and refusals.

use std::time::Duration;

use rayfold_pipeline::SystemClock;
use rayfold_pipeline::store::{MemoryStore, PutOptions, Store};
use serde_json::{Value, json};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

use super::Cloud;
use crate::page::Page;
use crate::project::Project;
use crate::server::Server;

const BALL: &str = "Screen 24 16\nSphere 6 12 8 -9 .2 .2 .2 .7 .6 .5\nTrace\n";

/// A server of a folder with some scripts and a bucket.
struct Desk {
    _folder: tempfile::TempDir,
    server: Server,
    host: String,
    path: String,
}

impl Desk {
    async fn new(cloud: Cloud, scripts: &[(&str, &str)]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let film = folder.path().join("film");
        std::fs::create_dir(&film).unwrap();
        for (name, text) in scripts {
            std::fs::write(film.join(name), text).unwrap();
        }
        let project = Project::open(&film).unwrap();
        let page = Page { html: b"page".to_vec(), script: Vec::new(), style: Vec::new() };
        let server = Server::start(project, page, cloud, 0).await.unwrap();
        let rest = server.address().strip_prefix("http://").unwrap().to_owned();
        let (host, path) = rest.split_at(rest.find('/').unwrap());
        Self { _folder: folder, host: host.to_owned(), path: path.to_owned(), server }
    }

    async fn send(&self, head: &str, body: &[u8]) -> TcpStream {
        let mut stream = TcpStream::connect(&self.host).await.unwrap();
        let head = format!("{head}Host: {}\r\nContent-Length: {}\r\n\r\n", self.host, body.len());
        stream.write_all(head.as_bytes()).await.unwrap();
        // The server does not read the rest of a body that is too large.
        let _ = stream.write_all(body).await;
        stream
    }

    /// Returns the status and the body of a response.
    async fn answer(&self, head: &str, body: &[u8]) -> (u16, String) {
        let mut stream = self.send(&format!("{head}Connection: close\r\n"), body).await;
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer).await;
        let text = String::from_utf8_lossy(&answer).into_owned();
        let (head, body) = text.split_once("\r\n\r\n").unwrap_or((&text, ""));
        (head[9..12].parse().unwrap(), body.to_owned())
    }

    async fn get(&self, what: &str) -> (u16, String) {
        self.answer(&format!("GET {}runs/{what} HTTP/1.1\r\n", self.path), b"").await
    }

    async fn json(&self, what: &str) -> Value {
        let (status, body) = self.get(what).await;
        assert_eq!(status, 200, "{body}");
        serde_json::from_str(&body).unwrap()
    }

    async fn post(&self, what: &str, body: &Value) -> (u16, String) {
        let head = format!(
            "POST {}runs/{what} HTTP/1.1\r\nOrigin: http://{}\r\nContent-Type: application/json\r\n",
            self.path, self.host
        );
        self.answer(&head, body.to_string().as_bytes()).await
    }
}

fn memory() -> MemoryStore<SystemClock> {
    MemoryStore::new(SystemClock)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_stands_on_the_page_is_offered_sent_and_listed() {
    let store = memory();
    let desk = Desk::new(Cloud::new("films", store.clone()), &[("a.txt", BALL), ("b.txt", BALL)]).await;
    let offer = desk.json("offer?run=film").await;
    assert_eq!(
        (&offer["upload"], &offer["unchanged"], &offer["estimate"]["frames"]),
        (&3.into(), &0.into(), &2.into())
    );
    assert_eq!(offer["estimate"]["sections"].as_array().unwrap().len(), 3);
    assert!(store.get("scripts/film/a.txt").await.is_err(), "an offer sends nothing");
    assert_eq!(desk.post("submit", &json!({"run": "film", "delete": []})).await.0, 202);
    let sent = async {
        while store.get("scripts/film/b.txt").await.is_err() {
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
    };
    tokio::time::timeout(Duration::from_secs(20), sent).await.unwrap();
    assert_eq!(store.get("scripts/film/a.txt").await.unwrap().body, BALL);
    let settings = store.get("scripts/film/animation.json").await.unwrap().body;
    assert!(String::from_utf8_lossy(&settings).contains("\"frames\": 2"), "{settings:?}");
    let list = desk.json("list").await;
    assert_eq!(
        (&list["bucket"], &list["runs"][0]["run"], &list["runs"][0]["status"]),
        (&"films".into(), &"film".into(), &"new".into())
    );
    assert!(desk.server.stop().await.is_empty());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn scripts_of_others_are_deleted_only_if_each_was_named() {
    let store = memory();
    for name in ["x", "y"] {
        store.put(&format!("scripts/film/{name}.txt"), "theirs".into(), PutOptions::always()).await.unwrap();
    }
    let desk = Desk::new(Cloud::new("films", store.clone()), &[("a.txt", BALL)]).await;
    for delete in [json!([]), json!(["scripts/film/x.txt"])] {
        let (status, body) = desk.post("submit", &json!({"run": "film", "delete": delete})).await;
        assert_eq!(status, 409, "{body}");
        let refusal: Value = serde_json::from_str(&body).unwrap();
        assert_eq!(refusal["delete"], json!(["scripts/film/x.txt", "scripts/film/y.txt"]));
    }
    assert!(store.get("scripts/film/x.txt").await.is_ok() && store.get("scripts/film/a.txt").await.is_err());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn scripts_with_errors_are_not_sent_and_the_place_is_told() {
    let desk = Desk::new(
        Cloud::new("films", memory()),
        &[("a.txt", BALL), ("b.txt", "Screen 4 3\n  Spere 1\nTrace")],
    )
    .await;
    for (status, body) in
        [desk.get("offer?run=film").await, desk.post("submit", &json!({"run": "film", "delete": []})).await]
    {
        let refusal: Value = serde_json::from_str(&body).unwrap();
        assert_eq!(
            (status, &refusal["script"], &refusal["place"]),
            (409, &json!("b"), &json!([2, 3])),
            "{body}"
        );
    }
}

/// A request can name animations, scripts and frames. Whatever else it contains, no other object is read.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn no_request_reaches_an_object_that_is_none_of_an_animation() {
    let store = memory();
    for key in ["secret.txt", "frames/secret.txt", "animations/secret"] {
        store.put(key, "secret".into(), PutOptions::always()).await.unwrap();
    }
    let desk = Desk::new(Cloud::new("films", store), &[("a.txt", BALL)]).await;
    let frame = |run: &str, script: &str| format!("frame.png?run={run}&script={script}&version=v&pixels=1");
    for (what, expected) in [
        (frame("..", "a"), 400),
        (frame("a%2F..", "a"), 400),
        (frame("", "a"), 400),
        (frame("film", "..%2F..%2Fsecret.txt%00"), 400),
        (frame("film", "%2Fa"), 400),
        (frame("film", "a"), 404),
        ("frame.png?run=film".into(), 400),
        ("frame.png?run=film&script=a&version=v&pixels=x".into(), 400),
        ("file?run=..%2Fsecret&output=gif".into(), 400),
        ("file?run=film&output=webp".into(), 404),
        ("file?run=film&output=..%2Fsecret".into(), 400),
        ("file?run=film".into(), 400),
        ("frames.zip?run=film".into(), 404),
        ("events?run=%2E%2E".into(), 400),
        ("offer?run=%2F".into(), 400),
        ("../../secret.txt".into(), 404),
        ("secret.txt".into(), 404),
    ] {
        let (status, body) = desk.get(&what).await;
        assert_eq!(status, expected, "{what}: {body}");
        assert!(!body.contains("secret") || status == 400, "{what}: {body}");
    }
    let (status, _) = desk.post("retry", &json!({"run": "film"})).await;
    assert_eq!(status, 404);
    let (status, _) = desk.post("retry", &json!({"run": "film", "script": "a/b"})).await;
    assert_eq!(status, 400);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn what_is_sent_must_come_from_the_page_and_be_small() {
    let store = memory();
    let desk = Desk::new(Cloud::new("films", store.clone()), &[("a.txt", BALL)]).await;
    let body = json!({"run": "film", "delete": []}).to_string();
    let post = |path: &str, origin: &str| {
        format!("POST {path}runs/submit HTTP/1.1\r\n{origin}Content-Type: application/json\r\n")
    };
    let own = format!("Origin: http://{}\r\n", desk.host);
    for head in [
        post(&desk.path, ""),
        post(&desk.path, "Origin: http://evil.example\r\n"),
        post(&desk.path, "Origin: null\r\n"),
        post(&format!("/{}/", "0".repeat(32)), &own),
        post("/", &own),
    ] {
        assert_eq!(desk.answer(&head, body.as_bytes()).await.0, 403, "{head}");
    }
    // A form of another page could send this without a preflight.
    let form = format!("POST {}runs/submit HTTP/1.1\r\n{own}Content-Type: text/plain\r\n", desk.path);
    assert_eq!(desk.answer(&form, body.as_bytes()).await.0, 415);
    let large = json!({"run": "film", "delete": ["x".repeat(2 << 20)]});
    assert_eq!(desk.post("submit", &large).await.0, 413);
    assert!(store.get("scripts/film/a.txt").await.is_err(), "nothing was sent");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn so_many_runs_are_watched_and_one_more_when_another_page_closes() {
    let desk = Desk::new(Cloud::new("films", memory()), &[("a.txt", BALL)]).await;
    let head = format!("GET {}runs/events?run=film HTTP/1.1\r\n", desk.path);
    let mut pages = Vec::new();
    for _ in 0..super::routes::WATCHED {
        let mut page = desk.send(&head, b"").await;
        let mut begin = [0; 12];
        page.read_exact(&mut begin).await.unwrap();
        assert_eq!(&begin[9..], b"200");
        pages.push(page);
    }
    assert_eq!(desk.answer(&head, b"").await.0, 503);
    pages.pop();
    let watched = async {
        loop {
            let mut page = desk.send(&head, b"").await;
            let mut begin = [0; 12];
            page.read_exact(&mut begin).await.unwrap();
            if &begin[9..] == b"200" {
                break;
            }
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    };
    tokio::time::timeout(Duration::from_secs(20), watched).await.unwrap();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn without_a_bucket_there_is_an_empty_list_and_nothing_else() {
    let desk = Desk::new(Cloud::none(), &[("a.txt", BALL)]).await;
    assert_eq!(desk.json("list").await, json!({"bucket": null, "runs": [], "more": 0}));
    assert_eq!(desk.get("offer?run=film").await.0, 404);
    assert_eq!(desk.post("submit", &json!({"run": "film", "delete": []})).await.0, 404);
}
