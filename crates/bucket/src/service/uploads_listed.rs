//! The operations ListParts and ListMultipartUploads.

use s3s::dto::*;

use super::Service;
use super::buckets::owner;
use super::lists::{encoded, encoding, most, prefixes};
use super::writes::of;
use crate::answer::{Answer, invalid_argument, time, unreadable};
use crate::checksum::Algorithm;
use crate::records::{self, decode, key};
use crate::storage::{Table, View};

impl Service {
    pub(super) fn handle_list_parts(&self, input: &ListPartsInput) -> Answer<ListPartsOutput> {
        let most = most(input.max_parts, "max-parts")?;
        let after = input.part_number_marker.unwrap_or_default();
        let upload = self.upload(&input.bucket, &input.key, &input.upload_id)?;
        let snapshot = self.snapshot()?;
        let first =
            u16::try_from(after).map_err(|_| invalid_argument("part-number-marker is out of range"))?;
        let inside = [input.upload_id.as_bytes(), b"\0"].concat();
        let from = key::part(&input.upload_id, first.saturating_add(1));
        let mut parts = Vec::new();
        let mut truncated = false;
        for row in snapshot.from(Table::Parts, &from).map_err(unreadable)? {
            let (row, value) = row.map_err(unreadable)?;
            if !row.starts_with(&inside) {
                break;
            }
            if parts.len() == most {
                truncated = true;
                break;
            }
            let part: records::Part = decode(&value).map_err(unreadable)?;
            let sum = Some(&part.checksum).filter(|_| upload.asked);
            parts.push(Part {
                checksum_crc32: of(sum, Algorithm::Crc32),
                checksum_crc32c: of(sum, Algorithm::Crc32c),
                checksum_crc64nvme: of(sum, Algorithm::Crc64nvme),
                checksum_sha1: of(sum, Algorithm::Sha1),
                checksum_sha256: of(sum, Algorithm::Sha256),
                e_tag: Some(ETag::Strong(part.etag)),
                last_modified: Some(time(part.modified)),
                part_number: Some(i32::from(key::of_part(&row))),
                size: i64::try_from(part.size).ok(),
            });
        }
        let next = parts.last().and_then(|part| part.part_number).unwrap_or(after);
        let owner = owner();
        Ok(ListPartsOutput {
            bucket: Some(input.bucket.clone()),
            key: Some(input.key.clone()),
            upload_id: Some(input.upload_id.clone()),
            checksum_algorithm: upload.asked.then(|| ChecksumAlgorithm::from_static(upload.algorithm.name())),
            checksum_type: upload.asked.then(|| ChecksumType::from_static(upload.kind.name())),
            initiator: Some(Initiator { display_name: owner.display_name.clone(), id: owner.id.clone() }),
            owner: Some(owner),
            is_truncated: Some(truncated),
            max_parts: i32::try_from(most).ok(),
            part_number_marker: Some(after),
            next_part_number_marker: Some(next),
            parts: Some(parts),
            storage_class: Some(StorageClass::from_static(StorageClass::STANDARD)),
            ..ListPartsOutput::default()
        })
    }

    /// Lists uploads in the order of keys, and of ids within a key. Common prefixes are as in a listing of objects.
    pub(super) fn handle_list_multipart_uploads(
        &self,
        input: &ListMultipartUploadsInput,
    ) -> Answer<ListMultipartUploadsOutput> {
        let most = most(input.max_uploads, "max-uploads")?;
        let url = encoding(input.encoding_type.as_ref())?;
        let prefix = input.prefix.as_deref().unwrap_or_default();
        let delimiter = input.delimiter.as_deref().unwrap_or_default();
        let key_marker = input.key_marker.as_deref().unwrap_or_default();
        let id_marker =
            input.upload_id_marker.as_deref().filter(|_| !key_marker.is_empty()).unwrap_or_default();
        let snapshot = self.snapshot()?;
        self.bucket(&snapshot, &input.bucket)?;
        let shown = |text: &str| if url { encoded(text) } else { text.to_owned() };

        let mut uploads = Vec::new();
        let mut common: Vec<String> = Vec::new();
        let mut last = None;
        let mut truncated = false;
        let inside = key::object(&input.bucket, prefix.as_bytes());
        let begin = key::object(&input.bucket, key_marker.max(prefix).as_bytes());
        for row in snapshot.from(Table::Uploads, &begin).map_err(unreadable)? {
            let (row, value) = row.map_err(unreadable)?;
            if !row.starts_with(&inside) {
                break;
            }
            let (name, id) = key::of_upload(&row, &input.bucket);
            let (name, id) =
                (String::from_utf8_lossy(name).into_owned(), String::from_utf8_lossy(id).into_owned());
            let seen =
                *name < *key_marker || (name == key_marker && (id_marker.is_empty() || *id <= *id_marker));
            let end = (!delimiter.is_empty()).then(|| name[prefix.len()..].find(delimiter)).flatten();
            let rolled = end.map(|end| name[..prefix.len() + end + delimiter.len()].to_owned());
            let already_listed = rolled.as_ref().is_some_and(|rolled| {
                common.last() == Some(rolled)
                    || (!key_marker.is_empty() && key_marker.starts_with(rolled.as_str()))
            });
            if seen || already_listed {
                continue;
            }
            if uploads.len() + common.len() == most {
                truncated = most > 0;
                break;
            }
            if let Some(rolled) = rolled {
                last = Some((rolled.clone(), String::new()));
                common.push(rolled);
                continue;
            }
            let record: records::Upload = decode(&value).map_err(unreadable)?;
            let owner = owner();
            uploads.push(MultipartUpload {
                checksum_algorithm: record
                    .asked
                    .then(|| ChecksumAlgorithm::from_static(record.algorithm.name())),
                checksum_type: record.asked.then(|| ChecksumType::from_static(record.kind.name())),
                initiated: Some(time(record.initiated)),
                initiator: Some(Initiator { display_name: owner.display_name.clone(), id: owner.id.clone() }),
                key: Some(shown(&name)),
                owner: Some(owner),
                storage_class: Some(StorageClass::from_static(StorageClass::STANDARD)),
                upload_id: Some(id.clone()),
            });
            last = Some((name, id));
        }
        let last = last.filter(|_| truncated);
        Ok(ListMultipartUploadsOutput {
            bucket: Some(input.bucket.clone()),
            common_prefixes: Some(prefixes(common, url)),
            delimiter: input.delimiter.as_deref().map(shown),
            encoding_type: input.encoding_type.clone(),
            is_truncated: Some(truncated),
            key_marker: Some(shown(key_marker)),
            max_uploads: i32::try_from(most).ok(),
            next_key_marker: last.as_ref().map(|(name, _)| shown(name)),
            next_upload_id_marker: last.as_ref().map(|(_, id)| id.clone()),
            prefix: Some(shown(prefix)),
            upload_id_marker: Some(id_marker.to_owned()),
            uploads: Some(uploads),
            ..ListMultipartUploadsOutput::default()
        })
    }
}
