//! Receiving a body: it is counted, digested and stored, with memory that does not grow with it.
//!
//! A small body stays in memory and becomes a row. A larger one goes to a file, a block at a time, while the next
//! block is received. The client's data about the body (length, MD5, checksum) is compared at the end, before
//! anything refers to it.

use bytes::Bytes;
use futures_util::{Stream, StreamExt};
use hyper::HeaderMap;
use s3s::{S3Error, StdError, TrailingHeaders, s3_error};
use tokio::task::JoinHandle;

use crate::answer::{Answer, body_failed, file_failed, invalid_request, wrong_checksum, wrong_md5};
use crate::checksum::{Algorithm, Checksum, Digests, bytes_of};
use crate::gate::checksum_header;
use crate::storage::{NewBody, Storage};

/// Bodies up to this size are stored in the row, with one sync in all. Writing a larger body twice would cost more
/// than a second sync.
const ROW_BYTES: usize = 128 * 1024;

/// The number of bytes that are digested and written at a time.
const BLOCK_BYTES: usize = 1024 * 1024;

/// S3's limit on the body of a request.
const LARGEST_BODY: u64 = 5 * 1024 * 1024 * 1024;

/// The length and digests of a body that the client announced.
pub(crate) struct ExpectedBody {
    length: Option<u64>,
    md5: Option<Vec<u8>>,
    algorithm: Algorithm,
    /// The checksum in a header.
    checksum: Option<String>,
    /// The headers after the body, which may hold the checksum.
    trailer: Option<TrailingHeaders>,
}

/// A body that has been received completely and matches the announced data.
pub(crate) struct Ingested {
    pub(crate) size: u64,
    pub(crate) md5: [u8; 16],
    pub(crate) checksum: Checksum,
    pub(crate) content: Content,
}

/// The location of a body until a row refers to it.
pub(crate) enum Content {
    Row(Vec<u8>),
    File(NewBody),
}

impl ExpectedBody {
    /// Reads them from a request with a body. `otherwise` is the algorithm of the checksum if the client names none.
    pub(crate) fn of_request(
        headers: &HeaderMap,
        trailer: Option<TrailingHeaders>,
        otherwise: Algorithm,
    ) -> Answer<Self> {
        let text = |name: &str| headers.get(name).and_then(|value| value.to_str().ok()).map(str::trim);
        // If the length of the bytes themselves was given, `s3s` has put it in place of the length of the chunks.
        let in_chunks = text("x-amz-content-sha256").is_some_and(|hash| hash.starts_with("STREAMING-"));
        let decoded = text("x-amz-decoded-content-length").filter(|_| in_chunks);
        let length = text("content-length").or(decoded).and_then(|text| text.parse().ok());
        if length.is_none() {
            return Err(s3_error!(MissingContentLength, "You must provide the Content-Length HTTP header."));
        }
        if length.is_some_and(is_too_large) {
            return Err(s3_error!(EntityTooLarge, "Your proposed upload exceeds the maximum allowed size"));
        }
        let md5 = match text("content-md5").map(bytes_of) {
            None => None,
            Some(Some(md5)) if md5.len() == 16 => Some(md5),
            Some(_) => return Err(s3_error!(InvalidDigest, "The Content-MD5 you specified is not valid.")),
        };
        let in_header = checksum_header(headers)?;
        let in_trailer = text("x-amz-trailer").and_then(|name| {
            Algorithm::ALL.into_iter().find(|algorithm| algorithm.header().eq_ignore_ascii_case(name))
        });
        if in_header.is_some() && in_trailer.is_some() {
            let message =
                "Expecting a single x-amz-checksum- header. Multiple checksum Types are not allowed.";
            return Err(invalid_request(message));
        }
        if let (Some(name), None, None) = (text("x-amz-sdk-checksum-algorithm"), &in_header, in_trailer) {
            return Err(invalid_request(format!(
                "x-amz-sdk-checksum-algorithm specified ({name}), but no corresponding x-amz-checksum-* or x-amz-trailer headers were found."
            )));
        }
        // A client may name an algorithm so that the store computes the checksum. The gate checks that it
        // agrees with the others.
        let named = text("x-amz-checksum-algorithm").and_then(Algorithm::of_name);
        let given = in_header.as_ref().map(|(algorithm, _)| *algorithm).or(in_trailer);
        let algorithm = given.or(named).unwrap_or(otherwise);
        let checksum = in_header.map(|(algorithm, value)| valid(algorithm, Some(&value))).transpose()?;
        let trailer = in_trailer.and(trailer);
        Ok(Self { length, md5, algorithm, checksum, trailer })
    }

    /// Makes the expectation for a body that comes from the store itself: there is nothing to compare.
    pub(crate) fn none(algorithm: Algorithm) -> Self {
        Self { length: None, md5: None, algorithm, checksum: None, trailer: None }
    }
}

/// Returns whether a body exceeds what one request may upload or copy.
pub(crate) fn is_too_large(size: u64) -> bool {
    size > LARGEST_BODY
}

/// Returns the checksum if it has the right form.
pub(crate) fn valid(algorithm: Algorithm, value: Option<&str>) -> Answer<String> {
    value
        .filter(|value| bytes_of(value).is_some_and(|bytes| bytes.len() == algorithm.bytes()))
        .map(str::to_owned)
        .ok_or_else(|| invalid_request(format!("Value for {} header is invalid.", algorithm.header())))
}

/// Receives a body and verifies it.
pub(crate) async fn ingest<S>(storage: &Storage, expected: ExpectedBody, mut body: S) -> Answer<Ingested>
where
    S: Stream<Item = Result<Bytes, StdError>> + Unpin,
{
    let mut sink = Sink::new(storage.clone(), expected.algorithm);
    while let Some(bytes) = body.next().await {
        sink.take(&bytes.map_err(|error| body_failed(&error))?).await?;
        if sink.size > expected.length.unwrap_or(LARGEST_BODY) {
            return Err(s3_error!(
                EntityTooLarge,
                "The body is longer than Content-Length says, or than 5 GiB."
            ));
        }
    }
    let ingested = sink.end().await?;
    if expected.length.is_some_and(|length| length != ingested.size) {
        return Err(s3_error!(IncompleteBody, "The body is shorter than Content-Length says."));
    }
    if expected.md5.is_some_and(|md5| md5 != ingested.md5) {
        return Err(wrong_md5());
    }
    let header = expected.algorithm.header();
    let claimed = match expected.trailer {
        None => expected.checksum,
        Some(trailer) => {
            let value =
                trailer.read(|headers| headers.get(header).and_then(|v| v.to_str().ok()).map(str::to_owned));
            Some(valid(expected.algorithm, value.flatten().as_deref())?)
        }
    };
    if claimed.is_some_and(|claimed| claimed != ingested.checksum.value) {
        return Err(wrong_checksum(expected.algorithm));
    }
    Ok(ingested)
}

/// Returns the ETag of a body.
pub(crate) fn etag(md5: [u8; 16]) -> String {
    md5.iter().map(|byte| format!("{byte:02x}")).collect()
}

struct Sink {
    storage: Storage,
    size: u64,
    block: Vec<u8>,
    state: Option<State>,
    writing: Option<JoinHandle<std::io::Result<State>>>,
}

struct State {
    digests: Digests,
    file: Option<NewBody>,
}

impl Sink {
    fn new(storage: Storage, algorithm: Algorithm) -> Self {
        let state = Some(State { digests: Digests::new(algorithm), file: None });
        Self { storage, size: 0, block: Vec::new(), state, writing: None }
    }

    async fn take(&mut self, mut bytes: &[u8]) -> Answer<()> {
        self.size += bytes.len() as u64;
        while !bytes.is_empty() {
            let (now, later) = bytes.split_at(bytes.len().min(BLOCK_BYTES - self.block.len()));
            self.block.extend_from_slice(now);
            bytes = later;
            if self.block.len() == BLOCK_BYTES {
                self.write().await?;
            }
        }
        Ok(())
    }

    /// Waits until the previous block is written, and passes this one on.
    async fn write(&mut self) -> Answer<()> {
        let mut state = self.state().await?;
        let block = std::mem::take(&mut self.block);
        let bodies = self.storage.bodies().clone();
        self.writing = Some(tokio::task::spawn_blocking(move || {
            let mut file = match state.file.take() {
                Some(file) => file,
                None => bodies.create()?,
            };
            state.digests.update(&block);
            file.write(&block)?;
            state.file = Some(file);
            Ok(state)
        }));
        Ok(())
    }

    async fn state(&mut self) -> Answer<State> {
        match self.writing.take() {
            Some(writing) => writing.await.map_err(S3Error::internal_error)?.map_err(file_failed),
            None => self.state.take().ok_or_else(|| s3_error!(InternalError, "a body was taken in twice")),
        }
    }

    async fn end(mut self) -> Answer<Ingested> {
        let size = self.size;
        let is_row = self.writing.is_none() && self.block.len() <= ROW_BYTES;
        if is_row {
            let mut state = self.state().await?;
            state.digests.update(&self.block);
            let (md5, checksum) = state.digests.finish();
            return Ok(Ingested { size, md5, checksum, content: Content::Row(self.block) });
        }
        if !self.block.is_empty() {
            self.write().await?;
        }
        let State { digests, file } = self.state().await?;
        let mut file = file.ok_or_else(|| s3_error!(InternalError, "a body without a file"))?;
        let finished = tokio::task::spawn_blocking(move || file.finish().map(|()| file)).await;
        let file = finished.map_err(S3Error::internal_error)?.map_err(file_failed)?;
        let (md5, checksum) = digests.finish();
        Ok(Ingested { size, md5, checksum, content: Content::File(file) })
    }
}

#[cfg(test)]
mod tests {
    use futures_util::stream;

    use super::*;

    fn expected(headers: &[(&'static str, &str)]) -> Result<ExpectedBody, String> {
        let headers = headers.iter().map(|(name, value)| {
            (
                hyper::header::HeaderName::from_static(name),
                hyper::header::HeaderValue::from_str(value).unwrap(),
            )
        });
        let expected = ExpectedBody::of_request(&headers.collect(), None, Algorithm::Crc32);
        expected.map_err(|error| error.code().as_str().to_owned())
    }

    #[test]
    fn what_is_said_of_a_body_is_read_or_refused() {
        let largest = LARGEST_BODY.to_string();
        assert_eq!(
            expected(&[("content-length", &largest)]).map(|expected| expected.length),
            Ok(Some(LARGEST_BODY))
        );
        let larger = (LARGEST_BODY + 1).to_string();
        let length = ("content-length", "1");
        let crc = ("x-amz-checksum-crc32", "AAAAAA==");
        for (headers, code) in [
            (vec![], "MissingContentLength"),
            (vec![("content-length", "many")], "MissingContentLength"),
            (vec![("content-length", &*larger)], "EntityTooLarge"),
            (vec![length, ("content-md5", "YWJj")], "InvalidDigest"),
            (vec![length, ("content-md5", "!")], "InvalidDigest"),
            (vec![length, ("x-amz-checksum-crc32", "AAAA")], "InvalidRequest"),
            (vec![length, crc, ("x-amz-checksum-sha1", "AAAAAAAAAAAAAAAAAAAAAAAAAAA=")], "InvalidRequest"),
            (vec![length, crc, ("x-amz-trailer", "x-amz-checksum-crc32")], "InvalidRequest"),
            (vec![length, ("x-amz-sdk-checksum-algorithm", "CRC32")], "InvalidRequest"),
        ] {
            assert_eq!(expected(&headers).map(|_| ()), Err(code.to_owned()), "{headers:?}");
        }
        let chunked = [
            ("x-amz-content-sha256", "STREAMING-UNSIGNED-PAYLOAD-TRAILER"),
            ("x-amz-decoded-content-length", "7"),
        ];
        assert_eq!(expected(&chunked).map(|expected| expected.length), Ok(Some(7)));
        assert_eq!(expected(&chunked[1..]).map(|_| ()), Err("MissingContentLength".to_owned()));
        let good = expected(&[length, crc, ("content-md5", "CZ7fAjxLoqlN0Cf2Vm8Zew==")]).unwrap();
        assert_eq!((good.md5.map(|md5| md5.len()), good.algorithm), (Some(16), Algorithm::Crc32));
        let behind = expected(&[length, ("x-amz-trailer", "x-amz-checksum-sha256")]).unwrap();
        assert_eq!((behind.algorithm, behind.checksum), (Algorithm::Sha256, None));
    }

    /// Pieces of any size: at most one block is in memory, and the stored bytes are the same.
    #[tokio::test]
    async fn pieces_of_any_size_make_blocks() {
        let folder = tempfile::tempdir().unwrap();
        let (storage, writing) = Storage::open(folder.path()).unwrap();
        let mut sink = Sink::new(storage.clone(), Algorithm::Crc32);
        for _ in 0..10 {
            sink.take(&[7; 700_001]).await.unwrap();
            assert!(sink.block.len() < BLOCK_BYTES);
        }
        let sunk = sink.end().await.unwrap();
        let whole = stream::iter([Ok(Bytes::from(vec![7; 7_000_010]))]);
        let at_once = ingest(&storage, ExpectedBody::none(Algorithm::Crc32), whole).await.unwrap();
        assert_eq!((sunk.size, sunk.md5, &sunk.checksum), (7_000_010, at_once.md5, &at_once.checksum));
        drop((sunk, at_once));
        writing.end();
    }

    #[tokio::test]
    async fn a_body_of_another_length_than_was_said_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let (storage, writing) = Storage::open(folder.path()).unwrap();
        for (length, code) in [("4", "EntityTooLarge"), ("5", ""), ("6", "IncompleteBody")] {
            let expected = expected(&[("content-length", length)]).unwrap();
            let body = stream::iter([Ok(Bytes::from_static(b"he")), Ok(Bytes::from_static(b"llo"))]);
            let ingested = ingest(&storage, expected, body).await;
            assert_eq!(
                ingested.err().map(|error| error.code().as_str().to_owned()).unwrap_or_default(),
                code
            );
        }
        writing.end();
    }

    #[test]
    fn a_body_of_5_gib_is_not_too_large() {
        assert!(!is_too_large(5_368_709_120) && is_too_large(5_368_709_121));
    }
}
