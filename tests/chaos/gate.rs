//! A proxy that slows, cuts and lies, by the dice of a seed. It passes bytes on and understands none of them.
//!
//! It outlives whoever it leads to, so that its address stays when that is killed and comes back on another port.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use fastrand::Rng;
use tokio::io::{AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::net::tcp::{OwnedReadHalf, ReadHalf, WriteHalf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::watch;

use crate::tally::Tally;

/// After so long without a byte a wild connection ends, so that the next request meets the dice anew.
const IDLE: Duration = Duration::from_millis(300);

/// What a liar says of a request that arrived.
const LIE: &[u8] = b"HTTP/1.1 500 Internal Server Error\r\ncontent-length: 0\r\nconnection: close\r\n\r\n";

/// What becomes of a connection.
#[derive(Debug, Clone, Copy)]
enum Fate {
    Pass,
    /// Every piece waits so many milliseconds.
    Slow(u64),
    /// Requests are cut after so many bytes.
    CutRequests(usize),
    /// Answers are cut after so many bytes.
    CutAnswers(usize),
    /// The first request arrives, its answer does not.
    LoseAnswer,
    /// The first request arrives, and the answer says that something went wrong.
    Lie,
    /// The first request arrives twice, and the answer is that to the second.
    Twice,
}

/// Where the gate leads; nowhere while it is shut.
type Way = Option<SocketAddr>;

/// A listening proxy.
pub(crate) struct Gate {
    address: SocketAddr,
    way: watch::Sender<Way>,
    dice: Arc<Mutex<Option<Rng>>>,
}

impl Gate {
    /// Listens until the runtime ends; `name` is what its faults are counted under.
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

    /// Leads elsewhere, or nowhere, from now on: what goes through it is cut.
    pub(crate) fn lead(&self, way: Way) {
        self.way.send_replace(way);
    }

    pub(crate) fn way(&self) -> Way {
        *self.way.borrow()
    }

    /// Does what the dice say from now on; without any all passes.
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
            Fate::Lie => "lies of a failure",
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

/// When it ends both sides are closed.
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
            // Who has gone hears no lie.
            let _ = to_client.write_all(LIE).await;
        }
        return;
    }
    let seen = Mutex::new(tokio::time::Instant::now());
    let there = copy_seen(&mut from_client, &mut to_server, pause, requests, &seen);
    let back = copy_seen(&mut from_server, &mut to_client, pause, answers, &seen);
    tokio::select! { () = there => {}, () = back => {}, () = idle_for(idle, &seen) => {} }
}

/// Sends what comes to two connections, and gives back what the second one answers, once the first has answered, too: so
/// nothing of it lands after the answer.
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
