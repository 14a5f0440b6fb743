//! A bucket's contents and rules as a plain value, which handles one request at a time. The memory store and the
//! simulation share it. It has no clock: every write passes the time.

use std::collections::BTreeMap;
use std::ops::{Bound, Range};

use bytes::Bytes;
use sha2::{Digest, Sha256};

use super::{Condition, ETag, ListPage, ListRequest, Listed, Object, ObjectInfo, PAGE, PutOptions};
use crate::clock::Timestamp;
use crate::{Error, Result};

/// The objects of a bucket by key, and its unfinished uploads.
#[derive(Debug, Clone, Default)]
pub struct Bucket {
    objects: BTreeMap<String, Object>,
    /// The uploads by id, and their parts by number, counted from 1.
    uploads: BTreeMap<u64, BTreeMap<usize, Bytes>>,
    last_upload: u64,
}

impl Bucket {
    /// Reads a whole object.
    pub fn get(&self, key: &str) -> Result<Object> {
        self.objects.get(key).cloned().ok_or_else(|| Error::NotFound { key: key.to_owned() })
    }

    /// Reads a range of an object.
    pub fn get_range(&self, key: &str, range: Range<u64>) -> Result<Object> {
        let Object { info, body } = self.get(key)?;
        let at = |offset: u64| usize::try_from(offset).unwrap_or(usize::MAX).min(body.len());
        let body = body.slice(at(range.start)..at(range.end.max(range.start)));
        Ok(Object { info, body })
    }

    /// Reads all but the body.
    pub fn head(&self, key: &str) -> Result<ObjectInfo> {
        self.get(key).map(|object| object.info)
    }

    /// Writes an object whole.
    pub fn put(&mut self, now: Timestamp, key: &str, body: Bytes, options: PutOptions) -> Result<ETag> {
        let failed = || Error::PreconditionFailed { key: key.to_owned() };
        match (&options.condition, self.objects.get(key)) {
            (Condition::IfAbsent, Some(_)) => return Err(failed()),
            (Condition::IfMatch(_), None) => return Err(Error::NotFound { key: key.to_owned() }),
            (Condition::IfMatch(etag), Some(object)) if object.info.etag != *etag => return Err(failed()),
            _ => {}
        }
        let etag = etag_of(&body);
        let info = ObjectInfo {
            etag: etag.clone(),
            size: body.len() as u64,
            modified: now,
            metadata: options.metadata,
        };
        self.objects.insert(key.to_owned(), Object { info, body });
        Ok(etag)
    }

    /// Begins an upload, and returns its id.
    pub fn begin_upload(&mut self) -> u64 {
        self.last_upload += 1;
        self.uploads.insert(self.last_upload, BTreeMap::new());
        self.last_upload
    }

    /// Stores a part of an upload, in place of one with the same number.
    pub fn put_part(&mut self, key: &str, id: u64, number: usize, body: Bytes) -> Result<ETag> {
        let gone = || Error::NotFound { key: key.to_owned() };
        let etag = etag_of(&body);
        self.uploads.get_mut(&id).ok_or_else(gone)?.insert(number, body);
        Ok(etag)
    }

    /// Makes an object of an upload's parts and the bytes after them. If the condition does not hold, the upload is
    /// removed.
    pub fn complete_upload(
        &mut self,
        now: Timestamp,
        key: &str,
        id: u64,
        (parts, tail): (&[ETag], &[u8]),
        options: PutOptions,
    ) -> Result<ETag> {
        let gone =
            || Error::Ambiguous { key: key.to_owned(), source: "the upload is not there any more".into() };
        let sent = self.uploads.remove(&id).ok_or_else(gone)?;
        let mut body = Vec::new();
        for (number, etag) in (1..).zip(parts) {
            match sent.get(&number).filter(|part| etag_of(part) == *etag) {
                Some(part) => body.extend_from_slice(part),
                None => return Err(Error::Refused { key: key.to_owned(), source: "no such part".into() }),
            }
        }
        body.extend_from_slice(tail);
        self.put(now, key, body.into(), options)
    }

    /// Aborts an upload. It is no error if it is gone.
    pub fn abort_upload(&mut self, id: u64) {
        self.uploads.remove(&id);
    }

    /// Returns the number of uploads that are neither finished nor aborted.
    pub fn unfinished_uploads(&self) -> usize {
        self.uploads.len()
    }

    /// Removes an object. Returns whether there was one.
    pub fn delete(&mut self, key: &str) -> bool {
        self.objects.remove(key).is_some()
    }

    /// Reads one page of a listing.
    pub fn list(&self, request: &ListRequest) -> ListPage {
        let mut page = ListPage::default();
        let from = match (&request.continuation, &request.start_after) {
            (Some(token), _) | (None, Some(token)) if *token >= request.prefix => {
                Bound::Excluded(token.clone())
            }
            _ => Bound::Included(request.prefix.clone()),
        };
        let mut objects = self.objects.range::<String, _>((from, Bound::Unbounded));
        while let Some((key, object)) = objects.next() {
            let Some(rest) = key.strip_prefix(&request.prefix) else { break };
            if page.objects.len() + page.prefixes.len() == PAGE {
                page.next = Some(match page.prefixes.last() {
                    Some(prefix) if page.objects.last().is_none_or(|object| object.key < *prefix) => {
                        end_of(prefix)
                    }
                    _ => page.objects.last().map(|object| object.key.clone()).unwrap_or_default(),
                });
                break;
            }
            match rest.find('/').filter(|_| request.delimiter) {
                Some(slash) => {
                    let prefix = &key[..=request.prefix.len() + slash];
                    page.prefixes.push(prefix.to_owned());
                    let after = Bound::Excluded(end_of(prefix));
                    objects = self.objects.range::<String, _>((after, Bound::Unbounded));
                }
                None => {
                    page.objects.push(Listed {
                        key: key.clone(),
                        etag: object.info.etag.clone(),
                        size: object.info.size,
                        modified: object.info.modified,
                    });
                }
            }
        }
        page
    }

    /// All keys, in byte order.
    pub fn keys(&self) -> impl Iterator<Item = &str> {
        self.objects.keys().map(String::as_str)
    }
}

/// Returns a text that sorts after every key below `prefix`, which ends in `/`, and before every later key.
fn end_of(prefix: &str) -> String {
    format!("{prefix}{}", char::MAX)
}

/// Returns an entity tag that depends only on the body, as S3's does.
fn etag_of(body: &[u8]) -> ETag {
    let digest = Sha256::digest(body);
    ETag(digest.iter().take(16).map(|byte| format!("{byte:02x}")).collect())
}
