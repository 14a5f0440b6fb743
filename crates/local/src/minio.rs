//! MinIO: an object store with S3's conditional writes and its event notifications.

use std::fs::File;
use std::net::SocketAddr;
use std::path::Path;

use rayfold_bucket::Webhook;

use crate::credentials::Credentials;
use crate::error::Result;
use crate::process::{Command, ServerProcess};
use crate::program::MINIO;
use crate::region::REGION;

/// The queue that bucket notifications name: MinIO's webhook to the invoker.
pub(crate) const QUEUE_ARN: &str = "arn:minio:sqs:us-east-1:RAYFOLD:webhook";

/// Starts `binary` on the folder `objects`.
///
/// # Errors
/// The errors of [`ServerProcess::start`].
pub(crate) async fn start(
    binary: &Path,
    objects: &Path,
    log: &Path,
    address: SocketAddr,
    credentials: &Credentials,
    webhook: Option<&Webhook>,
    lock: &File,
) -> Result<ServerProcess> {
    let environment = environment(credentials, webhook);
    let command = Command {
        program: &MINIO,
        binary,
        environment,
        log,
        ready: "/minio/health/ready",
        credentials,
        lock,
    };
    let objects = objects.to_string_lossy().into_owned();
    ServerProcess::start(command, address, |address| {
        Ok(vec!["server".into(), "--quiet".into(), "--address".into(), address.to_string(), objects.clone()])
    })
    .await
}

fn environment(credentials: &Credentials, webhook: Option<&Webhook>) -> Vec<(String, String)> {
    let mut env = vec![
        ("MINIO_ROOT_USER".to_owned(), credentials.access_key.clone()),
        ("MINIO_ROOT_PASSWORD".to_owned(), credentials.secret_key.clone()),
        ("MINIO_REGION".to_owned(), REGION.to_owned()),
        ("MINIO_BROWSER".to_owned(), "off".to_owned()),
        ("MINIO_UPDATE".to_owned(), "off".to_owned()),
    ];
    if let Some(webhook) = webhook {
        // Without a queue folder: with one, events are delivered on a poll of three seconds.
        env.push(("MINIO_NOTIFY_WEBHOOK_ENABLE_RAYFOLD".to_owned(), "on".to_owned()));
        env.push(("MINIO_NOTIFY_WEBHOOK_ENDPOINT_RAYFOLD".to_owned(), webhook.url.clone()));
        env.push(("MINIO_NOTIFY_WEBHOOK_AUTH_TOKEN_RAYFOLD".to_owned(), webhook.token.clone()));
    }
    env
}
