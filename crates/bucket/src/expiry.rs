//! Expiry of unfinished uploads a week after they were begun. On AWS a lifecycle rule of the bucket deletes them after a day.

use std::time::Duration;

use crate::records::{self, Moment, abandon, all, decode};
use crate::storage::{Kind, Storage, Table, Unavailable};

/// The time after which an unfinished upload expires.
const LIFETIME: Duration = Duration::from_secs(7 * 24 * 60 * 60);

/// The time between two searches for expired uploads.
pub(crate) const INTERVAL: Duration = Duration::from_secs(60 * 60);

/// Removes the unfinished uploads that were begun a week or longer before `now`, with their
/// parts. Returns their number.
///
/// # Errors
/// Returns [`Unavailable`] if the storage cannot be written.
pub(crate) async fn expire_uploads(storage: &Storage, now: Moment) -> Result<u64, Unavailable> {
    let lifetime = u64::try_from(LIFETIME.as_millis()).unwrap_or(u64::MAX);
    let expire = storage.change(Kind::Shrinks, move |batch| {
        let mut expired = 0;
        for (row, value) in all(batch, Table::Uploads, b"")? {
            let upload: records::Upload = decode(&value)?;
            if now.0.saturating_sub(upload.initiated.0) >= lifetime {
                abandon(batch, &row)?;
                expired += 1;
            }
        }
        Ok(expired)
    });
    expire.await
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::checksum::{Algorithm, Checksum, Kind as SumKind};
    use crate::records::{Body, Part, Upload, key, set};
    use crate::storage::View;

    #[tokio::test]
    async fn an_unfinished_upload_goes_after_a_week_with_its_parts() {
        let folder = tempfile::tempdir().unwrap();
        let (storage, writing) = Storage::open(folder.path()).unwrap();
        let begun = Moment(1_768_642_882_512);
        let later = Moment(begun.0 + 1);
        let ids = storage.bodies().clone();
        let begin = storage.change(Kind::Grows, move |batch| {
            for (id, initiated) in [("0a", begun), ("0b", later)] {
                let upload = Upload {
                    initiated,
                    headers: records::Headers::default(),
                    algorithm: Algorithm::Crc64nvme,
                    kind: SumKind::FullObject,
                    asked: false,
                };
                set(batch, Table::Uploads, &key::upload("films", "a", id), &upload)?;
                let body = ids.id();
                batch.put(Table::Bodies, &body.key(), b"part")?;
                let part = Part {
                    size: 4,
                    etag: String::new(),
                    modified: initiated,
                    body: Body::Row(body),
                    checksum: Checksum {
                        algorithm: Algorithm::Crc64nvme,
                        kind: SumKind::FullObject,
                        value: String::new(),
                    },
                };
                set(batch, Table::Parts, &key::part(id, 1), &part)?;
            }
            Ok(())
        });
        begin.await.unwrap();
        let left = || {
            let snapshot = storage.snapshot().unwrap();
            [Table::Uploads, Table::Parts, Table::Bodies].map(|table| snapshot.count(table).unwrap())
        };
        let week = 7 * 24 * 60 * 60 * 1000;
        assert_eq!(expire_uploads(&storage, Moment(begun.0 + week - 1)).await.unwrap(), 0);
        // The clock was set back.
        assert_eq!(expire_uploads(&storage, Moment(0)).await.unwrap(), 0);
        assert_eq!(left(), [2, 2, 2]);
        assert_eq!(expire_uploads(&storage, Moment(begun.0 + week)).await.unwrap(), 1);
        assert_eq!(left(), [1, 1, 1]);
        let kept = storage.snapshot().unwrap().get(Table::Uploads, &key::upload("films", "a", "0b"));
        assert!(kept.unwrap().is_some());
        writing.end();
    }
}
