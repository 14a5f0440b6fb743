//! Any bytes on a connection to the built-in store: it answers or hangs up, lets no client in, and goes on.
#![no_main]

use std::net::SocketAddr;
use std::sync::LazyLock;
use std::time::Duration;

use libfuzzer_sys::fuzz_target;
use rayfold_bucket::{Credentials, Options, Server};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::runtime::{Builder, Runtime};

struct Store {
    runtime: Runtime,
    address: SocketAddr,
    _server: Server,
    _data: tempfile::TempDir,
}

static STORE: LazyLock<Store> = LazyLock::new(|| {
    let runtime = Builder::new_multi_thread().worker_threads(2).enable_all().build().expect("a runtime");
    let data = tempfile::tempdir().expect("a folder");
    let options = Options {
        data: data.path().to_owned(),
        address: ([127, 0, 0, 1], 0).into(),
        root: Credentials { access_key: "key".into(), secret_key: "secret".into() },
        region: "us-east-1".into(),
        webhook: None,
    };
    let server = runtime.block_on(Server::start(options)).expect("a server");
    Store { address: server.address(), runtime, _server: server, _data: data }
});

fuzz_target!(|request: &[u8]| {
    let store = &*STORE;
    store.runtime.block_on(async {
        let mut stream = TcpStream::connect(store.address).await.expect("it takes connections");
        // It may hang up before all is sent.
        let _ = stream.write_all(request).await;
        let _ = stream.shutdown().await;
        let mut answer = Vec::new();
        let read = tokio::time::timeout(Duration::from_secs(5), stream.read_to_end(&mut answer)).await;
        assert!(read.is_ok(), "neither an answer nor an end");
        assert!(!answer.starts_with(b"HTTP/1.1 2"), "{}", String::from_utf8_lossy(&answer));
    });
});
