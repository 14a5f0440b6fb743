//! ListObjectVersions: a bucket of this store keeps one version of each object, which S3 calls `null`.
//!
//! Clients that empty a bucket request its versions, whether it keeps any or not.

use s3s::dto::*;

use super::Service;
use super::buckets::owner;
use super::lists::{Query, after, encoded, encoding, most, prefixes};
use crate::answer::{Answer, invalid_argument, time};
use crate::records;

/// The version id of an object that was put into a bucket without versions.
const ONLY: &str = "null";

impl Service {
    pub(super) async fn handle_list_object_versions(
        &self,
        input: ListObjectVersionsInput,
    ) -> Answer<ListObjectVersionsOutput> {
        let most = most(input.max_keys, "max-keys")?;
        let prefix = input.prefix.clone().unwrap_or_default();
        let delimiter = input.delimiter.clone().unwrap_or_default();
        let marker = input.key_marker.clone().unwrap_or_default();
        if marker.is_empty() && input.version_id_marker.as_ref().is_some_and(|version| !version.is_empty()) {
            return Err(invalid_argument("A version-id marker cannot be specified without a key marker."));
        }
        // After the only version comes the next key, whether the marker names a version or not.
        let from = after(&marker, &prefix, &delimiter);
        let query = Query { bucket: input.bucket.clone(), prefix, delimiter, most };
        let page = self.page(query, from).await?;
        let url = encoding(input.encoding_type.as_ref())?;
        let shown = |text: String| if url { encoded(&text) } else { text };
        let last_key = page.objects.last().map(|(name, _)| name);
        let last = last_key.max(page.prefixes.last()).filter(|_| page.next.is_some()).cloned();
        let ends_with_a_version = last.is_some() && last.as_ref() == last_key;
        Ok(ListObjectVersionsOutput {
            name: Some(input.bucket),
            prefix: Some(shown(input.prefix.unwrap_or_default())),
            delimiter: input.delimiter.filter(|delimiter| !delimiter.is_empty()).map(shown),
            key_marker: Some(shown(marker)),
            version_id_marker: Some(input.version_id_marker.unwrap_or_default()),
            max_keys: i32::try_from(most).ok(),
            is_truncated: Some(page.next.is_some()),
            next_version_id_marker: ends_with_a_version.then(|| ONLY.to_owned()),
            next_key_marker: last.map(shown),
            common_prefixes: Some(prefixes(page.prefixes, url)),
            versions: Some(page.objects.into_iter().map(|object| version(object, shown)).collect()),
            encoding_type: input.encoding_type,
            delete_markers: None,
            request_charged: None,
        })
    }
}

fn version((name, object): (String, records::Object), shown: impl Fn(String) -> String) -> ObjectVersion {
    let sum = object.checksum.as_ref();
    ObjectVersion {
        checksum_algorithm: sum.map(|sum| vec![ChecksumAlgorithm::from_static(sum.algorithm.name())]),
        checksum_type: sum.map(|sum| ChecksumType::from_static(sum.kind.name())),
        e_tag: Some(ETag::Strong(object.etag)),
        is_latest: Some(true),
        key: Some(shown(name)),
        last_modified: Some(time(object.modified)),
        owner: Some(owner()),
        restore_status: None,
        size: i64::try_from(object.size).ok(),
        storage_class: Some(ObjectVersionStorageClass::from_static(ObjectVersionStorageClass::STANDARD)),
        version_id: Some(ONLY.to_owned()),
    }
}
