//! The invoker's behaviour, tested with a function that follows instructions in its event.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails, also in the functions that tests share")]

use std::collections::BTreeSet;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::time::{Duration, Instant};

use rayfold_local::invoker::{Chaos, Invoker, Ramp, Settings};
use rayfold_local::observation::{Observation, Outcome, Seen};
use rayfold_local::routes::Function;
use rayfold_local::{Functions, any_port};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::sync::mpsc::{UnboundedReceiver, unbounded_channel};

const LONG: Duration = Duration::from_secs(30);

struct Stage {
    invoker: Invoker,
    seen: UnboundedReceiver<Observation>,
    _folder: tempfile::TempDir,
}

async fn stage(change: impl FnOnce(&mut Settings)) -> Stage {
    let folder = tempfile::tempdir().unwrap();
    for function in Function::ALL {
        let program = Path::new(env!("CARGO_BIN_EXE_rayfold-local-obedient-function"));
        symlink(program, folder.path().join(function.binary())).unwrap();
    }
    let mut settings =
        Settings::new(Functions::in_folder(folder.path()), Some(any_port()), any_port(), "secret".into());
    settings.retry_pauses = vec![Duration::from_millis(10), Duration::from_millis(20)];
    settings.sweep_every = None;
    change(&mut settings);
    let (sender, seen) = unbounded_channel();
    let invoker = Invoker::start(settings, Some(sender)).await.unwrap();
    tokio::time::timeout(LONG, invoker.idle()).await.expect("the first sweep ends");
    Stage { invoker, seen, _folder: folder }
}

impl Stage {
    async fn settle(&mut self) -> Vec<Observation> {
        tokio::time::timeout(LONG, self.invoker.idle()).await.expect("all work ends");
        std::iter::from_fn(|| self.seen.try_recv().ok()).collect()
    }

    async fn post(&self, token: &str, body: &str) -> String {
        let mut stream = tokio::net::TcpStream::connect(self.invoker.webhook()).await.unwrap();
        let head =
            format!("POST / HTTP/1.1\r\nHost: x\r\nConnection: close\r\nAuthorization: Bearer {token}\r\n");
        let request = format!("{head}Content-Length: {}\r\n\r\n{body}", body.len());
        stream.write_all(request.as_bytes()).await.unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).await.unwrap();
        answer
    }
}

fn started(seen: &[Observation], of: Function) -> Vec<(String, u32, u32)> {
    let attempts = seen.iter().filter_map(|observation| match &observation.seen {
        Seen::Started(attempt) if attempt.function == of => Some(attempt),
        _ => None,
    });
    attempts.map(|attempt| (attempt.request_id.clone(), attempt.number, attempt.pid)).collect()
}

fn served(outcome: &Outcome) -> u64 {
    match outcome {
        Outcome::Succeeded(answer) => {
            serde_json::from_str::<serde_json::Value>(answer).unwrap()["served"].as_u64().unwrap()
        }
        other => panic!("{other:?}"),
    }
}

#[tokio::test]
async fn a_warm_process_is_used_again_and_a_crashed_one_is_replaced() {
    let stage = stage(|_| {}).await;
    let mut answers = Vec::new();
    for event in ["{}", "{}", "\"crash\"", "{}", "\"fail\"", "{}"] {
        answers.push(stage.invoker.invoke(Function::Render, event).await);
    }
    assert_eq!((served(&answers[0]), served(&answers[1])), (1, 2));
    assert!(matches!(&answers[2], Outcome::Crashed(how) if how.contains('3')), "{:?}", answers[2]);
    assert_eq!(served(&answers[3]), 1);
    assert!(matches!(&answers[4], Outcome::Failed(body) if body.contains("as asked")));
    assert_eq!(served(&answers[5]), 3, "an error that a function reports does not end its process");
}

#[tokio::test]
async fn an_event_that_fails_is_tried_three_times_under_one_id_and_then_delivered() {
    let mut stage = stage(|_| {}).await;
    stage.settle().await;
    stage.invoker.send(Function::Render, "{\"key\":\"crash\"}");
    let seen = stage.settle().await;
    let tries = started(&seen, Function::Render);
    assert_eq!(tries.iter().map(|(_, number, _)| *number).collect::<Vec<_>>(), [1, 2, 3]);
    assert_eq!(tries.iter().map(|(id, ..)| id).collect::<BTreeSet<_>>().len(), 1);
    assert_eq!(tries.iter().map(|(.., pid)| pid).collect::<BTreeSet<_>>().len(), 3);
    // The delivered record holds the event, so the obedient function crashes on it too, and the queue gives it up.
    assert_eq!(started(&seen, Function::Assemble).len(), 5);
    let letters: Vec<&String> = seen
        .iter()
        .filter_map(|observation| match &observation.seen {
            Seen::DeadLetter { body } => Some(body),
            _ => None,
        })
        .collect();
    assert_eq!(letters.len(), 1);
    let record: serde_json::Value = serde_json::from_str(letters[0]).unwrap();
    assert_eq!(record["requestPayload"]["key"], "crash");
    assert_eq!(record["requestContext"]["requestId"], tries[0].0.as_str());
}

#[tokio::test]
async fn a_process_is_killed_at_its_deadline() {
    let stage = stage(|settings| settings.timeout = Duration::from_millis(300)).await;
    let start = Instant::now();
    assert_eq!(stage.invoker.invoke(Function::Render, "\"hang\"").await, Outcome::TimedOut);
    assert!(start.elapsed() >= Duration::from_millis(300));
    assert_eq!(served(&stage.invoker.invoke(Function::Render, "{}").await), 1);
}

#[tokio::test]
async fn no_more_run_at_once_than_the_concurrency_allows() {
    let mut stage = stage(|settings| settings.concurrency = 3).await;
    stage.settle().await;
    for _ in 0..12 {
        stage.invoker.send(Function::Render, "\"slow\"");
    }
    let seen = stage.settle().await;
    let (mut running, mut most) = (0_u32, 0);
    for observation in &seen {
        match &observation.seen {
            Seen::Started(_) => running += 1,
            Seen::Finished { .. } => running -= 1,
            _ => {}
        }
        most = most.max(running);
    }
    assert_eq!(most, 3);
    let tries = started(&seen, Function::Render);
    assert_eq!(tries.len(), 12);
    assert_eq!(tries.iter().map(|(.., pid)| pid).collect::<BTreeSet<_>>().len(), 3);
}

#[tokio::test]
async fn new_processes_start_no_faster_than_the_ramp() {
    let mut stage = stage(|settings| settings.ramp = Ramp { burst: 1, per_second: 10.0 }).await;
    let start = Instant::now();
    for _ in 0..4 {
        stage.invoker.send(Function::Render, "\"hang\"");
    }
    while started(&std::iter::from_fn(|| stage.seen.try_recv().ok()).collect::<Vec<_>>(), Function::Render)
        .is_empty()
    {
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
    let mut more = 1;
    while more < 4 {
        let next = tokio::time::timeout(LONG, stage.seen.recv()).await.unwrap().unwrap();
        more += u32::from(matches!(next.seen, Seen::Started(_)));
    }
    assert!(start.elapsed() >= Duration::from_millis(280), "{:?}", start.elapsed());
}

#[tokio::test]
async fn events_need_the_token_and_a_route() {
    let mut stage = stage(|_| {}).await;
    stage.settle().await;
    let event = |key: &str| {
        format!(
            "{{\"Records\":[{{\"eventName\":\"s3:ObjectCreated:Put\",\"s3\":{{\"object\":{{\"key\":\"{key}\"}}}}}}]}}"
        )
    };
    assert!(stage.post("guess", &event("scripts%2Fa%2F1.txt")).await.starts_with("HTTP/1.1 401"));
    assert!(stage.post("secret", &event("frames%2Fa%2F1.png")).await.starts_with("HTTP/1.1 200"));
    assert!(started(&stage.settle().await, Function::Render).is_empty());
    assert!(stage.post("secret", &event("scripts%2Fa%2F1.txt")).await.starts_with("HTTP/1.1 200"));
    assert_eq!(started(&stage.settle().await, Function::Render).len(), 1);
}

#[tokio::test]
async fn chaos_doubles_and_reverses_events_and_kills_processes() {
    let mut stage = stage(|settings| {
        settings.concurrency = 1;
        settings.chaos = Chaos {
            seed: 1,
            duplicate: 1.0,
            reverse_after: Some(Duration::from_millis(300)),
            ..Chaos::default()
        };
    })
    .await;
    stage.settle().await;
    for number in [1, 2] {
        let event = format!(
            "{{\"n\":{number},\"Records\":[{{\"eventName\":\"s3:ObjectCreated:Put\",\"s3\":{{\"object\":{{\"key\":\"scripts%2Fa%2F{number}.txt\"}}}}}}]}}"
        );
        stage.post("secret", &event).await;
    }
    assert_eq!(started(&stage.settle().await, Function::Render).len(), 4);

    let mut stage = self::stage(|settings| {
        settings.chaos = Chaos { seed: 1, kill: 1.0, ..Chaos::default() };
        settings.retry_pauses = vec![];
    })
    .await;
    stage.settle().await;
    assert!(matches!(stage.invoker.invoke(Function::Render, "\"slow\"").await, Outcome::Crashed(_)));
}

#[tokio::test]
async fn no_process_outlives_the_invoker() {
    let mut stage = stage(|_| {}).await;
    stage.settle().await;
    stage.invoker.send(Function::Render, "\"hang\"");
    let pid = loop {
        match tokio::time::timeout(LONG, stage.seen.recv()).await.unwrap().unwrap().seen {
            Seen::Started(attempt) => break attempt.pid,
            _ => continue,
        }
    };
    drop(stage.invoker);
    let gone = || !Path::new(&format!("/proc/{pid}")).exists() || is_zombie(pid);
    let start = Instant::now();
    while !gone() {
        assert!(start.elapsed() < LONG, "{pid} is still there");
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
}

fn is_zombie(pid: u32) -> bool {
    std::fs::read_to_string(format!("/proc/{pid}/stat")).is_ok_and(|stat| stat.contains(") Z "))
}
