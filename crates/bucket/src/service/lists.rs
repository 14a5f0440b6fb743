//! ListObjects, versions 1 and 2: one page, read from one snapshot.
//!
//! [`walk`] visits the rows in the order of the keys' bytes. A key with the delimiter after the prefix stands for all
//! keys with the same part up to there. They become one common prefix, and the walk continues after the last of them
//! without reading them. So the cost of a page depends on its entries, not on the number of keys under its prefixes.

use s3s::dto::*;

use super::Service;
use super::buckets::owner;
use crate::answer::{Answer, invalid_argument, time, unreadable};
use crate::records::{self, decode, key};
use crate::storage::{Snapshot, Table, View};

/// The largest number of keys and common prefixes on a page together.
pub(super) const PAGE: usize = 1000;

/// The parameters of a listing.
#[derive(Clone, Debug)]
pub(super) struct Query {
    pub(super) bucket: String,
    pub(super) prefix: String,
    /// The delimiter; empty for none.
    pub(super) delimiter: String,
    pub(super) most: usize,
}

/// A page of a listing.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Page {
    pub(super) objects: Vec<(String, records::Object)>,
    pub(super) prefixes: Vec<String>,
    /// The first key that the next page may hold, or `None` if this page is the last.
    pub(super) next: Option<Vec<u8>>,
}

/// Returns a page, starting at the first key that is not less than `from`.
pub(super) fn walk(snapshot: &Snapshot, query: &Query, from: &[u8]) -> Answer<Page> {
    let mut page = Page::default();
    if query.most == 0 {
        return Ok(page);
    }
    let mut from = from.max(query.prefix.as_bytes()).to_vec();
    'seek: loop {
        let start = key::object(&query.bucket, &from);
        let inside = key::object(&query.bucket, query.prefix.as_bytes());
        for row in snapshot.from(Table::Objects, &start).map_err(unreadable)? {
            let (row, value) = row.map_err(unreadable)?;
            if !row.starts_with(&inside) {
                return Ok(page);
            }
            let name = key::of_object(&row, &query.bucket);
            if page.objects.len() + page.prefixes.len() == query.most {
                page.next = Some(name.to_vec());
                return Ok(page);
            }
            if let Some(common) = common_prefix(name, &query.prefix, &query.delimiter) {
                page.prefixes.push(text(common));
                match behind(common) {
                    Some(behind) => from = behind,
                    None => return Ok(page),
                }
                continue 'seek;
            }
            page.objects.push((text(name), decode(&value).map_err(unreadable)?));
        }
        return Ok(page);
    }
}

/// Returns a key up to and including the first delimiter after the prefix.
fn common_prefix<'a>(name: &'a [u8], prefix: &str, delimiter: &str) -> Option<&'a [u8]> {
    if delimiter.is_empty() {
        return None;
    }
    let rest = name.get(prefix.len()..)?;
    let at = rest.windows(delimiter.len()).position(|window| window == delimiter.as_bytes())?;
    name.get(..prefix.len() + at + delimiter.len())
}

/// Returns the first key after all keys that begin with `prefix`.
fn behind(prefix: &[u8]) -> Option<Vec<u8>> {
    let last = prefix.iter().rposition(|byte| *byte != u8::MAX)?;
    let mut next = prefix[..=last].to_vec();
    next[last] += 1;
    Some(next)
}

/// Returns the start of a listing after a key. A key within a common prefix stands for all of it.
pub(super) fn after(name: &str, prefix: &str, delimiter: &str) -> Vec<u8> {
    let within =
        name.starts_with(prefix).then(|| common_prefix(name.as_bytes(), prefix, delimiter)).flatten();
    match within {
        Some(common) => behind(common).unwrap_or_else(|| [common, &[u8::MAX]].concat()),
        None => [name.as_bytes(), b"\0"].concat(),
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

impl Service {
    pub(super) async fn handle_list_objects_v2(
        &self,
        input: ListObjectsV2Input,
    ) -> Answer<ListObjectsV2Output> {
        let most = most(input.max_keys, "max-keys")?;
        let prefix = input.prefix.clone().unwrap_or_default();
        let delimiter = input.delimiter.clone().unwrap_or_default();
        let from = match (&input.continuation_token, &input.start_after) {
            (Some(token), _) => token_bytes(token)?,
            (None, Some(start)) => after(start, &prefix, &delimiter),
            (None, None) => Vec::new(),
        };
        let query = Query { bucket: input.bucket.clone(), prefix, delimiter, most };
        let page = self.page(query, from).await?;
        let url = encoding(input.encoding_type.as_ref())?;
        let shown = |text: String| if url { encoded(&text) } else { text };
        let with_owner = input.fetch_owner.unwrap_or_default();
        let count = page.objects.len() + page.prefixes.len();
        Ok(ListObjectsV2Output {
            name: Some(input.bucket),
            prefix: Some(shown(input.prefix.unwrap_or_default())),
            max_keys: i32::try_from(most).ok(),
            key_count: i32::try_from(count).ok(),
            continuation_token: input.continuation_token,
            is_truncated: Some(page.next.is_some()),
            next_continuation_token: page.next.as_deref().map(token),
            contents: Some(contents(page.objects, with_owner, url)),
            common_prefixes: Some(prefixes(page.prefixes, url)),
            delimiter: input.delimiter.filter(|delimiter| !delimiter.is_empty()).map(shown),
            encoding_type: input.encoding_type,
            start_after: input.start_after.map(shown),
            request_charged: None,
        })
    }

    pub(super) async fn handle_list_objects(&self, input: ListObjectsInput) -> Answer<ListObjectsOutput> {
        let most = most(input.max_keys, "max-keys")?;
        let prefix = input.prefix.clone().unwrap_or_default();
        let delimiter = input.delimiter.clone().unwrap_or_default();
        let from = input.marker.as_ref().map(|marker| after(marker, &prefix, &delimiter)).unwrap_or_default();
        let query = Query { bucket: input.bucket.clone(), prefix, delimiter, most };
        let page = self.page(query, from).await?;
        let url = encoding(input.encoding_type.as_ref())?;
        let shown = |text: String| if url { encoded(&text) } else { text };
        // S3 returns the next marker only if the last key alone may not determine it.
        let last_key = page.objects.last().map(|(name, _)| name);
        let last = last_key.into_iter().chain(page.prefixes.last()).max().cloned();
        let next = last.filter(|_| {
            page.next.is_some() && input.delimiter.as_ref().is_some_and(|delimiter| !delimiter.is_empty())
        });
        Ok(ListObjectsOutput {
            name: Some(input.bucket),
            prefix: Some(shown(input.prefix.unwrap_or_default())),
            marker: Some(shown(input.marker.unwrap_or_default())),
            max_keys: i32::try_from(most).ok(),
            is_truncated: Some(page.next.is_some()),
            contents: Some(contents(page.objects, true, url)),
            common_prefixes: Some(prefixes(page.prefixes, url)),
            delimiter: input.delimiter.filter(|delimiter| !delimiter.is_empty()).map(shown),
            next_marker: next.map(shown),
            encoding_type: input.encoding_type,
            request_charged: None,
        })
    }

    /// Reads a page on a thread that may block.
    pub(super) async fn page(&self, query: Query, from: Vec<u8>) -> Answer<Page> {
        let snapshot = self.snapshot()?;
        self.bucket(&snapshot, &query.bucket)?;
        let read = tokio::task::spawn_blocking(move || walk(&snapshot, &query, &from));
        read.await.map_err(s3s::S3Error::internal_error)?
    }
}

/// Returns the page size for a request.
pub(super) fn most(asked: Option<i32>, name: &str) -> Answer<usize> {
    match asked {
        None => Ok(PAGE),
        Some(asked) => usize::try_from(asked).map(|asked| asked.min(PAGE)).map_err(|_| {
            invalid_argument(format!("Argument {name} must be an integer between 0 and 2147483647"))
        }),
    }
}

/// Returns whether names must be encoded.
pub(super) fn encoding(asked: Option<&EncodingType>) -> Answer<bool> {
    match asked.map(EncodingType::as_str) {
        None => Ok(false),
        Some(EncodingType::URL) => Ok(true),
        Some(_) => Err(invalid_argument("Invalid Encoding Method specified in Request")),
    }
}

/// Encodes a name for `encoding-type=url`: all bytes except letters, digits and `-_.~/*`.
pub(super) fn encoded(name: &str) -> String {
    const KEPT: percent_encoding::AsciiSet = percent_encoding::NON_ALPHANUMERIC
        .remove(b'-')
        .remove(b'_')
        .remove(b'.')
        .remove(b'~')
        .remove(b'/')
        .remove(b'*');
    percent_encoding::utf8_percent_encode(name, &KEPT).to_string()
}

pub(super) fn prefixes(prefixes: Vec<String>, url: bool) -> Vec<CommonPrefix> {
    let shown = |text: String| if url { encoded(&text) } else { text };
    prefixes.into_iter().map(|prefix| CommonPrefix { prefix: Some(shown(prefix)) }).collect()
}

fn contents(objects: Vec<(String, records::Object)>, with_owner: bool, url: bool) -> Vec<Object> {
    let to_output = |(name, object): (String, records::Object)| Object {
        checksum_algorithm: object
            .checksum
            .as_ref()
            .map(|sum| vec![ChecksumAlgorithm::from_static(sum.algorithm.name())]),
        checksum_type: object.checksum.as_ref().map(|sum| ChecksumType::from_static(sum.kind.name())),
        e_tag: Some(ETag::Strong(object.etag)),
        key: Some(if url { encoded(&name) } else { name }),
        last_modified: Some(time(object.modified)),
        owner: with_owner.then(owner),
        restore_status: None,
        size: i64::try_from(object.size).ok(),
        storage_class: Some(ObjectStorageClass::from_static(ObjectStorageClass::STANDARD)),
    };
    objects.into_iter().map(to_output).collect()
}

/// Encodes a position as an opaque token.
fn token(position: &[u8]) -> String {
    base64_simd::URL_SAFE_NO_PAD.encode_to_string(position)
}

fn token_bytes(token: &str) -> Answer<Vec<u8>> {
    base64_simd::URL_SAFE_NO_PAD
        .decode_to_vec(token)
        .ok()
        .filter(|position| !position.is_empty())
        .ok_or_else(|| invalid_argument("The continuation token provided is incorrect"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_common_prefix_ends_with_the_first_delimiter_behind_the_prefix() {
        let common = |name: &str, prefix: &str, delimiter: &str| {
            common_prefix(name.as_bytes(), prefix, delimiter).map(text)
        };
        assert_eq!(common("a/b/c", "", "/").as_deref(), Some("a/"));
        assert_eq!(common("a/b/c", "a/", "/").as_deref(), Some("a/b/"));
        assert_eq!(common("a/b", "a/", "/"), None);
        assert_eq!(common("a--b--c", "a", "--").as_deref(), Some("a--"));
        assert_eq!(common("a//b", "a/", "/").as_deref(), Some("a//"));
        assert_eq!(common("a", "", ""), None);
    }

    #[test]
    fn behind_a_prefix_is_behind_all_that_begin_with_it() {
        assert_eq!(behind(b"a/").as_deref(), Some(&b"a0"[..]));
        assert_eq!(behind(b"a\xff").as_deref(), Some(&b"b"[..]));
        assert_eq!(behind(b"\xff\xff"), None);
    }

    #[test]
    fn names_are_encoded_so_that_every_client_decodes_them() {
        assert_eq!(encoded("a b+c/ü&\n.txt"), "a%20b%2Bc/%C3%BC%26%0A.txt");
    }

    #[test]
    fn tokens_are_read_back_and_others_refused() {
        assert_eq!(token_bytes(&token(b"a/\xff")).unwrap(), b"a/\xff");
        assert!(token_bytes("").is_err() && token_bytes("!").is_err());
    }
}
