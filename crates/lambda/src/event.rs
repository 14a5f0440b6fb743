//! What wakes a function, out of the JSON that the platform sends.
//!
//! S3's events come in AWS's shape and in MinIO's (which prefixes names with `s3:`, escapes slashes in keys and adds
//! fields), the schedule's as Terraform writes it or as EventBridge does by default, failed events in a batch of SQS.
//! Knows no pipeline: keys stay text, decoded.

use aws_lambda_events::event::s3::S3Event;
use rayfold_pipeline::keys::decode_event_key;
use serde::Deserialize;
use serde_json::Value;

/// What a malformed batch of the failure queue looks like an event of.
pub const FAILURE_QUEUE: &str = "SQS";

/// Why a payload is none of ours. It would be the same at the next try.
#[derive(Debug, thiserror::Error)]
pub enum Unreadable {
    /// No shape that is known here.
    #[error("the payload is no event of S3, SQS or the schedule")]
    Unknown,
    /// Almost.
    #[error("the payload looks like an event of {of} but is none")]
    Malformed {
        /// Whose.
        of: &'static str,
        /// What is wrong with it.
        source: serde_json::Error,
    },
}

/// What wakes a function.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// Objects came or went.
    Objects(Vec<ObjectEvent>),
    /// Events that failed for good.
    Failures(Vec<Message>),
    /// It is time to sweep.
    Sweep(Sweep),
}

/// How to sweep.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sweep {
    /// Patiently: what is pending may be queued.
    Patient,
    /// Nothing can be queued, as nobody listened for events until now: whatever is pending is woken.
    CatchUp,
}

/// An object came or went.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ObjectEvent {
    /// Of which bucket.
    pub bucket: String,
    /// Decoded; as it came when that is no text.
    pub key: String,
}

/// A message of the failure queue.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// What the queue knows it by.
    pub id: String,
    /// The record of the failed event.
    pub body: String,
}

impl Event {
    /// Reads a payload.
    ///
    /// # Errors
    /// [`Unreadable`].
    pub fn parse(payload: Value) -> Result<Self, Unreadable> {
        if payload["sweep"] == Value::Bool(true) || payload["detail-type"] == "Scheduled Event" {
            let catch_up = payload["catch_up"] == Value::Bool(true);
            return Ok(Self::Sweep(if catch_up { Sweep::CatchUp } else { Sweep::Patient }));
        }
        // What S3 sends when its notifications are set up: about no object.
        if payload["Event"] == "s3:TestEvent" {
            return Ok(Self::Objects(Vec::new()));
        }
        let malformed = |of| move |source| Unreadable::Malformed { of, source };
        match payload["Records"][0]["eventSource"].as_str() {
            Some("aws:s3" | "minio:s3") => {
                let event: S3Event = serde_json::from_value(payload).map_err(malformed("S3"))?;
                Ok(Self::Objects(event.records.into_iter().map(ObjectEvent::of).collect()))
            }
            Some("aws:sqs") => {
                let batch: Batch = serde_json::from_value(payload).map_err(malformed(FAILURE_QUEUE))?;
                let messages = batch.records.into_iter();
                Ok(Self::Failures(messages.map(|r| Message { id: r.message_id, body: r.body }).collect()))
            }
            _ => Err(Unreadable::Unknown),
        }
    }
}

impl ObjectEvent {
    fn of(record: aws_lambda_events::event::s3::S3EventRecord) -> Self {
        let encoded = record.s3.object.key.unwrap_or_default();
        Self {
            bucket: record.s3.bucket.name.unwrap_or_default(),
            key: decode_event_key(&encoded).unwrap_or(encoded),
        }
    }
}

#[derive(Deserialize)]
struct Batch {
    #[serde(rename = "Records")]
    records: Vec<SqsRecord>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct SqsRecord {
    message_id: String,
    body: String,
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn fixture(text: &str) -> Event {
        Event::parse(serde_json::from_str(text).unwrap()).unwrap()
    }

    fn object(bucket: &str, key: &str) -> ObjectEvent {
        ObjectEvent { bucket: bucket.into(), key: key.into() }
    }

    #[test]
    fn events_of_aws_are_read() {
        let put = fixture(include_str!("../fixtures/aws-put.json"));
        assert_eq!(put, Event::Objects(vec![object("animations-eu", "scripts/my film/ü+1.txt")]));
        let delete = fixture(include_str!("../fixtures/aws-delete.json"));
        assert_eq!(delete, Event::Objects(vec![object("animations-eu", "scripts/hello/f02.txt")]));
    }

    #[test]
    fn events_of_minio_are_read() {
        let put = fixture(include_str!("../fixtures/minio-put.json"));
        assert_eq!(put, Event::Objects(vec![object("rayfold", "scripts/my film/ü+1.txt")]));
        let delete = fixture(include_str!("../fixtures/minio-delete.json"));
        assert_eq!(delete, Event::Objects(vec![object("rayfold", "scripts/my film/ü+1.txt")]));
    }

    #[test]
    fn the_schedule_is_known_in_both_shapes() {
        let sweep = |payload| match Event::parse(payload).unwrap() {
            Event::Sweep(sweep) => sweep,
            other => panic!("{other:?}"),
        };
        assert_eq!(sweep(json!({ "sweep": true })), Sweep::Patient);
        assert_eq!(sweep(json!({ "sweep": true, "catch_up": true })), Sweep::CatchUp);
        let default = json!({ "detail-type": "Scheduled Event", "source": "aws.scheduler", "detail": "{}" });
        assert_eq!(sweep(default), Sweep::Patient);
    }

    #[test]
    fn a_batch_of_failures_keeps_ids_and_bodies() {
        let Event::Failures(messages) = fixture(include_str!("../fixtures/sqs-failures.json")) else {
            panic!("no batch")
        };
        assert_eq!(messages.len(), 2);
        let failures = rayfold_pipeline::failure::parse_record(messages[0].body.as_bytes()).unwrap();
        assert_eq!(failures[0].key, "scripts/hello/f02.txt");
        assert!(rayfold_pipeline::failure::parse_record(messages[1].body.as_bytes()).is_err());
    }

    #[test]
    fn anything_else_is_unreadable() {
        for payload in [json!({}), json!([]), json!({ "Records": [] }), json!({ "sweep": "yes" })] {
            assert!(matches!(Event::parse(payload.clone()), Err(Unreadable::Unknown)), "{payload}");
        }
        let broken = json!({ "Records": [{ "eventSource": "aws:s3" }] });
        assert!(matches!(Event::parse(broken), Err(Unreadable::Malformed { of: "S3", .. })));
    }
}
