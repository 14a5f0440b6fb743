//! What whoever starts the store decides.

use std::net::SocketAddr;
use std::path::PathBuf;

/// The queue that a bucket's notifications name to reach [`Options::webhook`].
pub const QUEUE_ARN: &str = "arn:aws:sqs:us-east-1:000000000000:webhook";

/// The account that all buckets and objects belong to.
pub(crate) const OWNER: &str = "000000000000";

/// An access key and its secret.
#[derive(Clone, PartialEq, Eq)]
pub struct Credentials {
    /// The access key's id.
    pub access_key: String,
    /// The secret.
    pub secret_key: String,
}

/// Where events go.
#[derive(Clone)]
pub struct Webhook {
    /// Of the listener, `http://…`. An event is delivered when it answers 200.
    pub url: String,
    /// Sent as `Authorization: Bearer <token>`, so that the listener knows the store.
    pub token: String,
}

/// How to run the store.
#[derive(Clone, Debug)]
pub struct Options {
    /// The folder, made when missing. One process at a time uses it.
    pub data: PathBuf,
    /// Where to listen; port 0 stands for any free one.
    pub address: SocketAddr,
    /// Who may do everything.
    pub root: Credentials,
    /// What the buckets' location is.
    pub region: String,
    /// Where events go. Without it they wait in the folder for the next start.
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
