//! The options of the store.

use std::net::SocketAddr;
use std::path::PathBuf;

/// The ARN of the queue that a bucket's notification must name to reach [`Options::webhook`].
pub const QUEUE_ARN: &str = "arn:aws:sqs:us-east-1:000000000000:webhook";

/// The account that owns all buckets and objects.
pub(crate) const OWNER: &str = "000000000000";

/// An access key and its secret.
#[derive(Clone, PartialEq, Eq)]
pub struct Credentials {
    /// The id of the access key.
    pub access_key: String,
    /// The secret of the access key.
    pub secret_key: String,
}

/// The receiver of events.
#[derive(Clone)]
pub struct Webhook {
    /// The URL of the listener, `http://…`. An event is delivered when it answers 200.
    pub url: String,
    /// The token that is sent as `Authorization: Bearer <token>`, so that the listener can authenticate the store.
    pub token: String,
}

/// The options with which the store runs.
#[derive(Clone, Debug)]
pub struct Options {
    /// The folder of the store, which is created if missing. Only one process may use it at a time.
    pub data: PathBuf,
    /// The address to listen on; port 0 selects any free one.
    pub address: SocketAddr,
    /// The owner's key, which may do everything.
    pub root: Credentials,
    /// The region of all buckets.
    pub region: String,
    /// The receiver of events. Without it they wait in the folder for the next start.
    pub webhook: Option<Webhook>,
}

impl std::fmt::Debug for Credentials {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Credentials").field("access_key", &self.access_key).finish_non_exhaustive()
    }
}

impl std::fmt::Debug for Webhook {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Webhook").field("url", &self.url).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn secrets_are_not_shown() {
        let root = Credentials { access_key: "owner".into(), secret_key: "hush-1".into() };
        let webhook = Webhook { url: "http://127.0.0.1:9/events".into(), token: "hush-2".into() };
        let shown = format!("{root:?} {webhook:?}");
        assert!(shown.contains("owner") && shown.contains("http://127.0.0.1:9/events"), "{shown}");
        assert!(!shown.contains("hush"), "{shown}");
    }
}
