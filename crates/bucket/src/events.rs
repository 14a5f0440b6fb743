//! Event messages in S3's format, version 2.1 of the record.
//! <https://docs.aws.amazon.com/AmazonS3/latest/userguide/notification-content-structure.html>

use percent_encoding::{AsciiSet, NON_ALPHANUMERIC, utf8_percent_encode};
use s3s::dto::{Timestamp, TimestampFormat};
use serde_json::{Value, json};

use crate::records::Event;

/// The characters that are not percent-encoded in an event's key. A space becomes a plus.
const KEPT: AsciiSet =
    NON_ALPHANUMERIC.remove(b'-').remove(b'_').remove(b'.').remove(b'*').remove(b'/').remove(b' ');

/// Formats the message of an event. `sequencer` grows with the order of changes.
pub(crate) fn message(event: &Event, sequencer: u64, region: &str) -> Value {
    let mut object = json!({
        "key": utf8_percent_encode(&event.key, &KEPT).to_string().replace(' ', "+"),
        "sequencer": format!("{sequencer:016X}"),
    });
    if let Some(size) = event.size {
        object["size"] = size.into();
    }
    if let Some(etag) = &event.etag {
        object["eTag"] = etag.as_str().into();
    }
    let mut time = Vec::new();
    let formatted = Timestamp::from(event.time.system_time()).format(TimestampFormat::DateTime, &mut time);
    json!({ "Records": [{
        "eventVersion": "2.1",
        "eventSource": "aws:s3",
        "awsRegion": region,
        "eventTime": formatted.ok().map(|()| String::from_utf8_lossy(&time)),
        "eventName": event.name,
        "userIdentity": { "principalId": event.principal },
        "requestParameters": { "sourceIPAddress": event.source },
        "responseElements": { "x-amz-request-id": event.request, "x-amz-id-2": "" },
        "s3": {
            "s3SchemaVersion": "1.0",
            "configurationId": event.configuration,
            "bucket": {
                "name": event.bucket,
                "ownerIdentity": { "principalId": event.principal },
                "arn": format!("arn:aws:s3:::{}", event.bucket),
            },
            "object": object,
        },
    }] })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::records::Moment;

    fn event(key: &str, name: &str) -> Event {
        Event {
            bucket: "films".into(),
            key: key.into(),
            name: name.into(),
            time: Moment(1_768_642_882_512),
            configuration: "scripts".into(),
            size: None,
            etag: None,
            principal: "root".into(),
            request: "C3D1".into(),
            source: "127.0.0.1".into(),
        }
    }

    #[test]
    fn the_event_of_a_created_object_is_as_of_s3() {
        let event = Event {
            size: Some(10),
            etag: Some("d41d".into()),
            ..event("scripts/my film/ü+1.txt", "ObjectCreated:Put")
        };
        let record = &message(&event, 0x5A, "eu-central-1")["Records"][0];
        assert_eq!(record["eventName"], "ObjectCreated:Put");
        assert_eq!(record["eventTime"], "2026-01-17T09:41:22.512Z");
        assert_eq!(record["awsRegion"], "eu-central-1");
        assert_eq!(record["s3"]["bucket"]["name"], "films");
        assert_eq!(record["s3"]["object"]["key"], "scripts/my+film/%C3%BC%2B1.txt");
        assert_eq!(record["s3"]["object"]["size"], 10);
        assert_eq!(record["s3"]["object"]["eTag"], "d41d");
        assert_eq!(record["s3"]["object"]["sequencer"], "000000000000005A");
    }

    #[test]
    fn a_removed_object_has_no_size() {
        let record = &message(&event("a", "ObjectRemoved:Delete"), 1, "us-east-1")["Records"][0];
        assert_eq!(record["s3"]["object"].get("size"), None);
        assert_eq!(record["s3"]["object"].get("eTag"), None);
    }
}
