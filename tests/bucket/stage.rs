//! A store in a new folder, its client, a listener for its events, and requests that no client would send.

use std::net::SocketAddr;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use aws_sdk_s3::Client;
use aws_sdk_s3::config::{BehaviorVersion, Credentials as Keys, Region};
use aws_sdk_s3::error::{ProvideErrorMetadata, SdkError};
use aws_sdk_s3::presigning::PresigningConfig;
use aws_sdk_s3::types::{Event, NotificationConfiguration, QueueConfiguration};
use rayfold_bucket::{Credentials, Options, QUEUE_ARN, Server, Webhook};
use tempfile::TempDir;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};

pub(crate) const BUCKET: &str = "films";
pub(crate) const TOKEN: &str = "token";

pub(crate) struct Stage {
    pub(crate) server: Server,
    pub(crate) client: Client,
    pub(crate) folder: TempDir,
}

pub(crate) fn client(address: SocketAddr) -> Client {
    let config = aws_sdk_s3::Config::builder()
        .behavior_version(BehaviorVersion::latest())
        .region(Region::new("us-east-1"))
        .credentials_provider(Keys::new("root", "secret-key", None, None, "test"))
        .http_client(aws_smithy_http_client::Builder::new().build_http())
        .endpoint_url(format!("http://{address}"))
        .force_path_style(true)
        .retry_config(aws_sdk_s3::config::retry::RetryConfig::disabled())
        .build();
    Client::from_conf(config)
}

pub(crate) fn options(data: &Path, webhook: Option<Webhook>) -> Options {
    Options {
        data: data.to_owned(),
        address: ([127, 0, 0, 1], 0).into(),
        root: Credentials { access_key: "root".into(), secret_key: "secret-key".into() },
        region: "us-east-1".into(),
        webhook,
    }
}

/// Starts a store with one bucket.
pub(crate) async fn stage() -> Stage {
    stage_with(None).await
}

pub(crate) async fn stage_with(webhook: Option<Webhook>) -> Stage {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(options(folder.path(), webhook)).await.unwrap();
    let client = client(server.address());
    client.create_bucket().bucket(BUCKET).send().await.unwrap();
    Stage { server, client, folder }
}

impl Stage {
    pub(crate) async fn put(&self, key: &str, body: impl Into<Vec<u8>>) -> String {
        let put = self.client.put_object().bucket(BUCKET).key(key).body(body.into().into());
        put.send().await.unwrap().e_tag.unwrap()
    }

    pub(crate) async fn get(&self, key: &str) -> Vec<u8> {
        let got = self.client.get_object().bucket(BUCKET).key(key).send().await.unwrap();
        got.body.collect().await.unwrap().to_vec()
    }

    /// Returns the number of files of large bodies on the disk.
    pub(crate) fn files(&self) -> usize {
        let folders = std::fs::read_dir(self.folder.path().join("bodies")).unwrap();
        folders.map(|folder| std::fs::read_dir(folder.unwrap().path()).unwrap().count()).sum()
    }

    /// Sends an event to the webhook for every change.
    pub(crate) async fn notify(&self) {
        notify(&self.client).await;
    }

    /// Returns the options for a presigned URL.
    pub(crate) fn presigning(&self) -> PresigningConfig {
        PresigningConfig::expires_in(Duration::from_secs(60)).unwrap()
    }

    /// Sends a request unchanged. Returns status, headers and body as text.
    pub(crate) async fn raw(&self, request: &str) -> String {
        raw(self.server.address(), request.as_bytes()).await
    }
}

pub(crate) async fn notify(client: &Client) {
    let queue = QueueConfiguration::builder()
        .queue_arn(QUEUE_ARN)
        .events(Event::from("s3:ObjectCreated:*"))
        .events(Event::from("s3:ObjectRemoved:*"))
        .build()
        .unwrap();
    let all = NotificationConfiguration::builder().queue_configurations(queue).build();
    let set = client.put_bucket_notification_configuration().bucket(BUCKET).notification_configuration(all);
    set.send().await.unwrap();
}

pub(crate) async fn raw(address: SocketAddr, request: &[u8]) -> String {
    let mut stream = TcpStream::connect(address).await.unwrap();
    stream.write_all(request).await.unwrap();
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).await.unwrap();
    String::from_utf8_lossy(&answer).into_owned()
}

/// Returns the path and query of a URL.
pub(crate) fn path(url: &str) -> &str {
    let rest = url.strip_prefix("http://").unwrap();
    &rest[rest.find('/').unwrap()..]
}

/// Returns the status and S3's error code.
pub(crate) fn failure<T: std::fmt::Debug, E: ProvideErrorMetadata + std::fmt::Debug>(
    answer: Result<T, SdkError<E>>,
) -> (u16, String) {
    let error = answer.unwrap_err();
    let status = error.raw_response().unwrap().status().as_u16();
    (status, error.code().unwrap_or_default().to_owned())
}

/// The events that a listener received.
#[derive(Clone, Default)]
pub(crate) struct Heard {
    /// The names and keys of the accepted events, in order.
    accepted: Arc<Mutex<Vec<(String, String)>>>,
    /// The number of rejected requests.
    refused: Arc<AtomicUsize>,
}

impl Heard {
    pub(crate) fn all(&self) -> Vec<(String, String)> {
        self.accepted.lock().unwrap().clone()
    }

    pub(crate) fn refused(&self) -> usize {
        self.refused.load(Ordering::Relaxed)
    }

    /// Waits until this many events were accepted.
    pub(crate) async fn wait(&self, count: usize) -> Vec<(String, String)> {
        for _ in 0..1000 {
            if self.all().len() >= count {
                return self.all();
            }
            tokio::time::sleep(Duration::from_millis(10)).await;
        }
        panic!("{} of {count} events: {:?}", self.all().len(), self.all());
    }
}

/// Listens for events. Replies 503 to the first `refuse` requests.
pub(crate) async fn listener(refuse: usize) -> (Webhook, Heard) {
    use http_body_util::{BodyExt, Empty};
    use hyper::body::{Bytes, Incoming};
    use hyper::{Request, Response, StatusCode};

    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let url = format!("http://{}/events", listener.local_addr().unwrap());
    let heard = Heard::default();
    let hears = heard.clone();
    tokio::spawn(async move {
        loop {
            let (stream, _) = listener.accept().await.unwrap();
            let hears = hears.clone();
            let service = hyper::service::service_fn(move |request: Request<Incoming>| {
                let hears = hears.clone();
                async move {
                    assert_eq!(request.headers()["authorization"], format!("Bearer {TOKEN}"));
                    let body = request.into_body().collect().await?.to_bytes();
                    let mut answer = Response::new(Empty::<Bytes>::new());
                    let more = |refused| (refused < refuse).then_some(refused + 1);
                    if hears.refused.fetch_update(Ordering::Relaxed, Ordering::Relaxed, more).is_ok() {
                        *answer.status_mut() = StatusCode::SERVICE_UNAVAILABLE;
                    } else {
                        let message: serde_json::Value = serde_json::from_slice(&body).unwrap();
                        let record = &message["Records"][0];
                        let name = record["eventName"].as_str().unwrap().to_owned();
                        let key = record["s3"]["object"]["key"].as_str().unwrap().to_owned();
                        hears.accepted.lock().unwrap().push((name, key));
                    }
                    Ok::<_, hyper::Error>(answer)
                }
            });
            let stream = hyper_util::rt::TokioIo::new(stream);
            tokio::spawn(hyper::server::conn::http1::Builder::new().serve_connection(stream, service));
        }
    });
    (Webhook { url, token: TOKEN.into() }, heard)
}
