//! Making a folder of the bucket equal to one on disk, with as little as possible uploaded.
//!
//! What is there already is told by its size and its MD5, which is an object's entity tag; where it is not (encrypted
//! with a key of one's own, uploaded in parts) the digest that [`send`] leaves in the metadata tells.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::Context;
use futures_util::stream::{self, StreamExt, TryStreamExt};
use md5::{Digest, Md5};
use rayfold_pipeline::keys::Animation;
use rayfold_pipeline::store::{ETag, ListRequest, Listed, PutOptions, S3Store, Store};

use super::{SIDE_BY_SIDE, list};

/// The name of the metadata that holds a script's digest.
const DIGEST: &str = "rayfold-md5";

/// Memory that files under way may take.
const UNDER_WAY: u64 = 256 << 20;

/// A file as it should be in the bucket.
#[derive(Debug)]
pub(crate) struct Wanted {
    pub(crate) content: Content,
    size: u64,
    digest: String,
}

/// Where its bytes are.
#[derive(Debug)]
pub(crate) enum Content {
    File(PathBuf),
    Text(String),
}

/// The bucket's folder compared with the wanted one.
#[derive(Debug, Default)]
pub(crate) struct Difference {
    /// Keys to put, in order.
    pub(crate) changed: Vec<String>,
    /// Keys to delete.
    pub(crate) surplus: Vec<String>,
    /// The versions of what is as it should be.
    pub(crate) same: BTreeMap<String, ETag>,
}

impl Wanted {
    /// # Errors
    /// When the file cannot be read.
    pub(crate) fn new(content: Content) -> anyhow::Result<Self> {
        let bytes = content.read()?;
        Ok(Self { size: bytes.len() as u64, digest: digest(&bytes), content })
    }
}

impl Content {
    fn read(&self) -> anyhow::Result<Vec<u8>> {
        match self {
            Self::Text(text) => Ok(text.clone().into_bytes()),
            Self::File(path) => read(path),
        }
    }
}

/// Compares what lies right below the animation's scripts with what should.
///
/// # Errors
/// Those of the store.
pub(crate) async fn compare(
    store: &S3Store,
    animation: &Animation,
    wanted: &BTreeMap<String, Wanted>,
) -> anyhow::Result<Difference> {
    let (listed, _) = list(store, ListRequest::level(animation.scripts())).await?;
    let listed: BTreeMap<String, Listed> =
        listed.into_iter().map(|object| (object.key.clone(), object)).collect();
    let is_ours = |key: &&String| key.ends_with(".txt") || **key == animation.settings();
    let surplus = listed.keys().filter(is_ours).filter(|key| !wanted.contains_key(*key)).cloned().collect();
    let same = wanted.iter().map(async |(key, wanted)| {
        let there = listed.get(key).filter(|there| there.size == wanted.size);
        let same = match there {
            None => None,
            Some(there) if there.etag.as_str() == wanted.digest => Some(there.etag.clone()),
            Some(_) => {
                let info = store.head(key).await?;
                (info.metadata.get(DIGEST) == Some(&wanted.digest)).then_some(info.etag)
            }
        };
        anyhow::Ok((key.clone(), same))
    });
    let same: Vec<_> = same.collect();
    let same: Vec<_> = stream::iter(same).buffered(SIDE_BY_SIDE).try_collect().await?;
    let mut difference = Difference { surplus, ..Difference::default() };
    for (key, same) in same {
        match same {
            Some(version) => _ = difference.same.insert(key, version),
            None => difference.changed.push(key),
        }
    }
    Ok(difference)
}

/// Puts what has changed, many files at once, and tells after each how many are there. Returns their versions.
///
/// # Errors
/// Those of the store, and when a file is no longer what was compared.
pub(crate) async fn send(
    store: &S3Store,
    keys: &[String],
    wanted: &BTreeMap<String, Wanted>,
    mut told: impl FnMut(u64),
) -> anyhow::Result<BTreeMap<String, ETag>> {
    let largest = keys.iter().filter_map(|key| wanted.get(key)).map(|w| w.size).max().unwrap_or(1).max(1);
    let at_once = usize::try_from(UNDER_WAY / largest).unwrap_or(SIDE_BY_SIDE).clamp(1, SIDE_BY_SIDE);
    let puts = keys.iter().filter_map(|key| Some((key, wanted.get(key)?))).map(async |(key, wanted)| {
        let bytes = wanted.content.read()?;
        anyhow::ensure!(digest(&bytes) == wanted.digest, "{key} has changed while it was being submitted");
        let options = PutOptions::always().content_type(media_type(key)).metadata(DIGEST, &wanted.digest);
        Ok((key.clone(), store.put(key, bytes.into(), options).await?))
    });
    let puts: Vec<_> = puts.collect();
    let mut puts = stream::iter(puts).buffer_unordered(at_once);
    let mut versions = BTreeMap::new();
    while let Some(put) = puts.next().await {
        let (key, version) = put?;
        versions.insert(key, version);
        told(versions.len() as u64);
    }
    Ok(versions)
}

/// Deletes, many at once.
///
/// # Errors
/// Those of the store.
pub(crate) async fn delete(store: &S3Store, keys: &[String]) -> anyhow::Result<()> {
    let deletions: Vec<_> = keys.iter().map(|key| store.delete(key)).collect();
    stream::iter(deletions).buffer_unordered(SIDE_BY_SIDE).try_collect::<Vec<()>>().await?;
    Ok(())
}

fn media_type(key: &str) -> &'static str {
    if key.ends_with(".json") { "application/json" } else { "text/plain; charset=utf-8" }
}

fn read(path: &Path) -> anyhow::Result<Vec<u8>> {
    std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))
}

fn digest(bytes: &[u8]) -> String {
    Md5::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_digest_is_what_s3_calls_an_entity_tag() {
        // RFC 1321, A.5
        assert_eq!(digest(b"message digest"), "f96b697d7cb7938d525a2f31aaf161d0");
    }
}
