//! A proxy that delays, cuts and falsifies connections at random, by a seed. It forwards bytes without interpreting
//! them.
//!
//! It outlives its upstream, so that the address stays the same if the upstream is killed and restarts on another port.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use fastrand::Rng;
use tokio::io::{AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::net::tcp::{OwnedReadHalf, ReadHalf, WriteHalf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::watch;

use crate::tally::Tally;

/// A connection with faults ends after this time without a byte, so that the next request draws a new fault.
const IDLE: Duration = Duration::from_millis(300);

/// The false reply to a request that arrived.
const LIE: &[u8] = b"HTTP/1.1 500 Internal Server Error\r\ncontent-length: 0\r\nconnection: close\r\n\r\n";

/// The fate of a connection.
#[derive(Debug, Clone, Copy)]
enum Fate {
    Pass,
    /// Every piece is delayed by this number of milliseconds.
    Slow(u64),
    /// Requests are cut after this number of bytes.
    CutRequests(usize),
    /// Replies are cut after this number of bytes.
    CutAnswers(usize),
    /// The first request arrives, and its reply is lost.
    LoseAnswer,
    /// The first request arrives, and the reply is a false error.
    Lie,
    /// The first request arrives twice, and the reply is that to the second.
    Twice,
}

/// The upstream of the gate, if it is open.
type Way = Option<SocketAddr>;

pub(crate) struct Gate {
    address: SocketAddr,
    way: watch::Sender<Way>,
    dice: Arc<Mutex<Option<Rng>>>,
}

impl Gate {
    /// Listens until the runtime ends. Its faults are counted under `name`.
    pub(crate) async fn open(name: &'static str, tally: &Tally) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let (way, led) = watch::channel(None);
        let dice = Arc::new(Mutex::new(None));
        tokio::spawn(serve(listener, led, dice.clone(), name, tally.clone()));
        Gate { address, way, dice }
    }

    pub(crate) fn address(&self) -> SocketAddr {
        self.address
    }

    /// Changes the upstream, or closes the gate. Cuts the current connections.
    pub(crate) fn lead(&self, way: Way) {
        self.way.send_replace(way);
    }

    pub(crate) fn way(&self) -> Way {
        *self.way.borrow()
    }

    /// Draws faults from `dice` from now on; without dice there are none.
    pub(crate) fn roll(&self, dice: Option<Rng>) {
        *self.dice.lock().unwrap() = dice;
    }
}

impl Fate {
    fn drawn(dice: &mut Rng) -> Self {
        match dice.u32(0..24) {
            0 | 1 => Fate::Slow(dice.u64(5..80)),
            2 => Fate::CutRequests(dice.usize(1..3_000)),
            3 => Fate::CutAnswers(dice.usize(1..3_000)),
            4 => Fate::LoseAnswer,
            5 => Fate::Lie,
            6 => Fate::Twice,
            _ => Fate::Pass,
        }
    }

    fn name(self) -> Option<&'static str> {
        Some(match self {
            Fate::Pass => return None,
            Fate::Slow(_) => "slow connections",
            Fate::CutRequests(_) => "requests cut",
            Fate::CutAnswers(_) => "answers cut",
            Fate::LoseAnswer => "answers lost",
            Fate::Lie => "false failures",
            Fate::Twice => "requests doubled",
        })
    }
}

async fn serve(
    listener: TcpListener,
    way: watch::Receiver<Way>,
    dice: Arc<Mutex<Option<Rng>>>,
    name: &'static str,
    tally: Tally,
) {
    loop {
        let Ok((client, _)) = listener.accept().await else { continue };
        let Some(upstream) = *way.borrow() else { continue };
        let fate = dice.lock().unwrap().as_mut().map(Fate::drawn);
        if let Some(fault) = fate.and_then(Fate::name) {
            tally.add(&format!("{name}: {fault}"));
        }
        let mut way = way.clone();
        tokio::spawn(async move {
            let changed = async { while way.changed().await.is_ok() && *way.borrow() == Some(upstream) {} };
            tokio::select! { () = pass(client, upstream, fate) => {}, () = changed => {} }
        });
    }
}

/// Forwards a connection. At its end both sides are closed.
async fn pass(mut client: TcpStream, upstream: SocketAddr, fate: Option<Fate>) {
    let Ok(mut server) = TcpStream::connect(upstream).await else { return };
    let idle = if fate.is_some() { IDLE } else { Duration::MAX };
    let (pause, requests, answers) = match fate {
        Some(Fate::Slow(pause)) => (pause, usize::MAX, usize::MAX),
        Some(Fate::CutRequests(most)) => (0, most, usize::MAX),
        Some(Fate::CutAnswers(most)) => (0, usize::MAX, most),
        Some(Fate::Twice) => return pass_twice(client, server, upstream).await,
        Some(Fate::Pass | Fate::LoseAnswer | Fate::Lie) | None => (0, usize::MAX, usize::MAX),
    };
    let (mut from_client, mut to_client) = client.split();
    let (mut from_server, mut to_server) = server.split();
    if let Some(Fate::LoseAnswer | Fate::Lie) = fate {
        let there = copy(&mut from_client, &mut to_server, 0, usize::MAX);
        tokio::select! { () = there => return, _ = from_server.readable() => {} }
        if let Some(Fate::Lie) = fate {
            // The client may have disconnected.
            let _ = to_client.write_all(LIE).await;
        }
        return;
    }
    let seen = Mutex::new(tokio::time::Instant::now());
    let there = copy_seen(&mut from_client, &mut to_server, pause, requests, &seen);
    let back = copy_seen(&mut from_server, &mut to_client, pause, answers, &seen);
    tokio::select! { () = there => {}, () = back => {}, () = idle_for(idle, &seen) => {} }
}

/// Sends the request to two connections and returns the reply of the second, after the first has replied too. So
/// nothing takes effect after the reply.
async fn pass_twice(mut client: TcpStream, first: TcpStream, upstream: SocketAddr) {
    let Ok(second) = TcpStream::connect(upstream).await else { return };
    let (mut from_client, mut to_client) = client.split();
    let ((from_first, mut to_first), (mut from_second, mut to_second)) =
        (first.into_split(), second.into_split());
    let there = async {
        let mut piece = [0; 4_096];
        loop {
            let read = from_client.read(&mut piece).await.unwrap_or(0);
            let is_sent = read > 0
                && to_first.write_all(&piece[..read]).await.is_ok()
                && to_second.write_all(&piece[..read]).await.is_ok();
            if !is_sent {
                return;
            }
        }
    };
    let back = async {
        let readable = |half: OwnedReadHalf| async move { drop(half.readable().await) };
        readable(from_first).await;
        let mut piece = [0; 4_096];
        loop {
            let answer = tokio::time::timeout(IDLE, from_second.read(&mut piece)).await;
            let read = answer.map_or(0, |read| read.unwrap_or(0));
            if read == 0 || to_client.write_all(&piece[..read]).await.is_err() {
                return;
            }
        }
    };
    tokio::select! { () = there => {}, () = back => {} }
}

async fn copy(from: &mut ReadHalf<'_>, to: &mut WriteHalf<'_>, pause: u64, most: usize) {
    copy_seen(from, to, pause, most, &Mutex::new(tokio::time::Instant::now())).await;
}

async fn copy_seen(
    from: &mut ReadHalf<'_>,
    to: &mut (impl AsyncWrite + Unpin),
    pause: u64,
    most: usize,
    seen: &Mutex<tokio::time::Instant>,
) {
    let (mut piece, mut left) = ([0; 4_096], most);
    while left > 0 {
        let read = from.read(&mut piece).await.unwrap_or(0);
        *seen.lock().unwrap() = tokio::time::Instant::now();
        if read == 0 {
            return;
        }
        if pause > 0 {
            tokio::time::sleep(Duration::from_millis(pause)).await;
        }
        let passed = read.min(left);
        left -= passed;
        if to.write_all(&piece[..passed]).await.is_err() {
            return;
        }
    }
}

async fn idle_for(idle: Duration, seen: &Mutex<tokio::time::Instant>) {
    if idle == Duration::MAX {
        return std::future::pending().await;
    }
    loop {
        let last = *seen.lock().unwrap();
        if last.elapsed() >= idle {
            return;
        }
        tokio::time::sleep_until(last + idle).await;
    }
}
