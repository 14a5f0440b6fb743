//! The owner's keys: random, and stored beside the data, readable only by the user.

use std::fs::{self, OpenOptions};
use std::io::Write;
use std::net::SocketAddr;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;

use rayfold_pipeline::store::Connection;
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};
use crate::region::REGION;

/// An access key and its secret.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Credentials {
    /// The access key's id.
    pub access_key: String,
    /// The secret access key.
    pub secret_key: String,
}

impl Credentials {
    /// Returns new random credentials.
    ///
    /// # Errors
    /// [`Error::Random`] if the system has no random bytes.
    pub fn random() -> Result<Self> {
        Ok(Self { access_key: format!("rayfold{}", token(6)?), secret_key: token(20)? })
    }

    /// Returns their connection to the server at an address.
    pub(crate) fn connection(&self, address: SocketAddr) -> Connection {
        Connection {
            endpoint: format!("http://{address}"),
            region: REGION.to_owned(),
            access_key: self.access_key.clone(),
            secret_key: self.secret_key.clone(),
            session_token: None,
        }
    }

    /// Returns the credentials of an earlier run beside `data`. If there are none, makes new ones
    /// and stores them there.
    pub(crate) fn kept(data: &Path) -> Result<Self> {
        let path = data.join("credentials.json");
        if let Ok(text) = fs::read(&path)
            && let Ok(kept) = serde_json::from_slice(&text)
        {
            return Ok(kept);
        }
        let fresh = Self::random()?;
        let mut file = OpenOptions::new()
            .write(true)
            .create(true)
            .truncate(true)
            .mode(0o600)
            .open(&path)
            .map_err(Error::file(&path))?;
        serde_json::to_writer(&mut file, &fresh)
            .map_err(std::io::Error::from)
            .and_then(|()| file.flush())
            .map_err(Error::file(&path))?;
        Ok(fresh)
    }
}

/// Returns `bytes` random bytes in hexadecimal.
///
/// # Errors
/// [`Error::Random`] if the system has no random bytes.
pub(crate) fn token(bytes: usize) -> Result<String> {
    let mut random = vec![0; bytes];
    getrandom::fill(&mut random).map_err(Error::Random)?;
    Ok(random.iter().map(|byte| format!("{byte:02x}")).collect())
}
