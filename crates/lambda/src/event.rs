//! Parsing of the JSON payloads with which the platform invokes a function.
//!
//! S3's events have AWS's shape or MinIO's, which prefixes names with `s3:`, escapes slashes in keys and adds fields.
//! The schedule's have the shape in which Terraform writes it or EventBridge's default. Failed events come in a batch
//! of SQS. This module knows no pipeline: it decodes keys, and leaves them as text.

use aws_lambda_events::event::s3::S3Event;
use rayfold_pipeline::keys::decode_event_key;
use serde::Deserialize;
use serde_json::Value;

/// The `of` of [`Unreadable::Malformed`] for a batch of the failure queue.
pub const FAILURE_QUEUE: &str = "SQS";

/// The reason why a payload cannot be read. It would be the same at the next try.
#[derive(Debug, thiserror::Error)]
pub enum Unreadable {
    /// The payload has none of the known shapes.
    #[error("unknown payload: expected an S3, SQS or schedule event")]
    Unknown,
    /// The payload resembles a known event, but is malformed.
    #[error("malformed {of} event")]
    Malformed {
        /// The source of the event.
        of: &'static str,
        /// The error of the parser.
        source: serde_json::Error,
    },
}

/// An event that invokes a function.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// Objects were created or deleted.
    Objects(Vec<ObjectEvent>),
    /// Events that failed permanently.
    Failures(Vec<Message>),
    /// The schedule asks for a sweep.
    Sweep(Sweep),
}

/// The mode of a sweep.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sweep {
    /// Pending work may be queued, so only work that has waited for long is triggered.
    Patient,
    /// No event can be queued, because nothing received events until now. So all pending work is triggered.
    CatchUp,
}

/// The event that an object was created or deleted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ObjectEvent {
    /// The name of the bucket.
    pub bucket: String,
    /// The decoded key, or the raw one if it cannot be decoded.
    pub key: String,
}

/// A message of the failure queue.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// The id by which the queue knows the message.
    pub id: String,
    /// The record of the failed event.
    pub body: String,
}

impl Event {
    /// Parses the payload of an invocation.
    ///
    /// # Errors
    /// Returns [`Unreadable`] if the payload is no known event.
    pub fn parse(payload: Value) -> Result<Self, Unreadable> {
        if payload["sweep"] == Value::Bool(true) || payload["detail-type"] == "Scheduled Event" {
            let catch_up = payload["catch_up"] == Value::Bool(true);
            return Ok(Self::Sweep(if catch_up { Sweep::CatchUp } else { Sweep::Patient }));
        }
        // S3 sends this when notifications are set up. It is about no object.
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
