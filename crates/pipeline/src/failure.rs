//! Events that the platform has given up: the records of its on-failure destination, which
//! the assemble function receives.
//!
//! A frame that timed out, or whose function died, in each attempt at one version would do so again: it gets an error
//! receipt that says so. Other failures (a busy store, events too old) may be transient: the frame is triggered again,
//! a limited number of times. In both cases the manifest is folded, so that the user sees the failure. An assembly that
//! timed out or died in each attempt is refused, and the refusal names the output. The sweep handles other failed
//! assemblies.

use serde::Deserialize;

use crate::fold::{Age, Folded};
use crate::invocation::Invocation;
use crate::keys::{
    Animation, Band, Generation, Key, Part, Receipt, ScriptName, Tag, Uploaded, decode_event_key,
};
use crate::manifest::{Fact, Reason};
use crate::observe::version_result;
use crate::outputs::{Due, Outputs, needed};
use crate::render::bands::Bands;
use crate::store::{ETag, ListRequest, Store};
use crate::{Clock, Error, Result};

/// An event that failed in each of its attempts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Failure {
    /// The key that the event was about.
    pub key: String,
    /// The version of the object that the event was about, if the event contains it.
    pub version: Option<ETag>,
    /// The number of attempts; 0 if the function was never started.
    pub attempts: u64,
    /// The end of the last attempt.
    pub end: End,
    /// The event's, in all attempts.
    pub request_id: String,
}

/// The reason for which an invocation ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum End {
    /// The invocation was ended at its deadline.
    TimedOut,
    /// The process died, most likely for lack of memory.
    Died,
    /// The event became too old before an attempt.
    TooOld,
    /// The function answered with an error.
    Error(String),
}

/// The result of handling a failed event.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Recorded {
    /// There is a result, or there is nothing to render any more.
    Resolved(Folded),
    /// The frame was woken once more.
    Woken {
        /// The number of this attempt.
        attempt: u64,
    },
    /// The frame has an error receipt now.
    GivenUp(Folded),
    /// The set of frames is refused now.
    Refused(Folded),
    /// The sweep handles it: an assembly, or a frame that was triggered often enough.
    LeftToSweep,
}

/// Returns the failed events of an on-failure destination record (JSON, as Lambda writes it).
///
/// Records of other events, such as those of the schedule, contain none.
///
/// # Errors
///
/// [`Error::Malformed`] if it is no such record.
pub fn parse_record(record: &[u8]) -> Result<Vec<Failure>> {
    let record: Record = serde_json::from_slice(record).map_err(|source| Error::Malformed {
        key: "the on-failure record".to_owned(),
        source: source.into(),
    })?;
    let end = record.end();
    let RequestContext { approximate_invoke_count: attempts, request_id, .. } = record.request_context;
    let payload: Payload = serde_json::from_value(record.request_payload).unwrap_or_default();
    payload
        .records
        .into_iter()
        .map(|event| {
            let key = decode_event_key(&event.s3.object.key)?;
            let version = event.s3.object.etag.filter(|etag| !etag.is_empty()).map(|etag| ETag::new(&etag));
            Ok(Failure { key, version, attempts, end: end.clone(), request_id: request_id.clone() })
        })
        .collect()
}

/// Handles a failed event.
///
/// # Errors
///
/// [`Error::Key`] for a key that triggers nothing: a retry would not help. All other errors are the store's.
pub async fn record_failure<S: Store, C: Clock>(
    invocation: &Invocation<'_, S, C>,
    failure: &Failure,
) -> Result<Recorded> {
    // The scripts that name it are pending then, which the sweep finds.
    if let Uploaded::File(animation, _) = Uploaded::of(&failure.key, 0) {
        return invocation.fold(&animation, &Fact::Fold, Age::Old).await.map(Recorded::Resolved);
    }
    match failure.key.parse()? {
        Key::Script { animation, name } => {
            let version = failure.version.clone();
            invocation.record_frame(failure, animation, name, (None, None), version).await
        }
        Key::Part { animation, name, tag, number } => {
            let of = (Some(number), None);
            invocation.record_frame(failure, animation, name, of, Some(tag.version)).await
        }
        Key::Band { animation, name, tag, part, band, .. } => {
            let of = (part, Some(band));
            invocation.record_frame(failure, animation, name, of, Some(tag.version)).await
        }
        Key::Wake { animation, name, tag } => {
            invocation.record_frame(failure, animation, name, (None, None), Some(tag.version)).await
        }
        Key::Retry { animation, name, tag, part, .. } => {
            invocation.record_frame(failure, animation, name, (part, None), Some(tag.version)).await
        }
        Key::Settings { animation } => {
            invocation.fold(&animation, &Fact::Fold, Age::Old).await.map(Recorded::Resolved)
        }
        Key::Claim { animation, generation, .. } => {
            invocation.record_assembly(failure, animation, generation).await
        }
        _ => Err(Error::key(&failure.key, "this key wakes nothing")),
    }
}

impl<S: Store, C: Clock> Invocation<'_, S, C> {
    async fn record_frame(
        &self,
        failure: &Failure,
        animation: Animation,
        name: ScriptName,
        (part, band): (Part, Option<Band>),
        tried: Option<ETag>,
    ) -> Result<Recorded> {
        let Some(script) = self.head(&animation.script(&name)).await? else {
            return self.fold(&animation, &Fact::Absent(name), Age::Old).await.map(Recorded::Resolved);
        };
        let version = match part.is_some() || band.is_some() {
            true if tried.as_ref().is_some_and(|tried| tried.script() == script.etag.as_str()) => {
                tried.clone().unwrap_or(script.etag)
            }
            true => script.etag,
            false => self.current_version(&animation, &name, script.etag).await?,
        };
        if (part.is_some() || band.is_some()) && tried.as_ref() != Some(&version) {
            return self
                .fold(&animation, &Fact::Version(name, version), Age::Old)
                .await
                .map(Recorded::Resolved);
        }
        let receipts = self.receipts_of(&animation, &name, &version, part).await?;
        if let Some(standing) = version_result(&receipts, part) {
            let fact = standing.fact(name, version, part);
            return self.fold(&animation, &fact, Age::Old).await.map(Recorded::Resolved);
        }
        let (attempts, begun) = self.attempts(&animation, &name, &version, part).await?;
        let tag = Tag { version: version.clone(), pixels: self.policy.pixels };
        let tries = failure.attempts;
        // An invocation that is woken for a frame that is cut only wakes others.
        let is_cut = Bands::of(&receipts, part, self.policy.pixels).cut().is_some();
        let has_tried = tried.as_ref() == Some(&version) && (band.is_some() || !is_cut);
        let what = band.map_or(String::new(), |band| format!("band {} of {}: ", band.number(), band.of()));
        let hopeless = match &failure.end {
            End::TimedOut if has_tried => Some(format!("{what}timed out in each of {tries} attempts")),
            End::Died if has_tried => Some(format!(
                "{what}the render function died in each of {tries} attempts, most likely for lack of memory"
            )),
            // It has not been tried.
            End::TooOld => None,
            _ if begun < self.policy.attempts => None,
            End::TimedOut | End::Died => Some(format!("no result in each of {begun} attempts")),
            End::Error(message) => Some(format!("no result in each of {begun} attempts: {message}")),
        };
        match hopeless {
            // The store may be busy for long: the sweep is more patient with every waking. One retry wakes all bands that are
            // missing, so that a record for each of them is not one too many.
            None if attempts >= self.policy.attempts && (failure.end != End::TooOld || band.is_some()) => {
                self.fold(&animation, &Fact::Fold, Age::Old).await?;
                Ok(Recorded::LeftToSweep)
            }
            None => {
                self.put_retry(&animation, &name, tag, part, attempts + 1).await?;
                Ok(Recorded::Woken { attempt: attempts + 1 })
            }
            Some(message) => {
                let receipt = self.put_fault(&animation, &name, &tag, part, &Reason::new(message)).await?;
                let fact = receipt.map_or(Fact::Fold, |receipt| Fact::Faulty(name, version, part, receipt));
                self.fold(&animation, &fact, Age::Old).await.map(Recorded::GivenUp)
            }
        }
    }

    /// The number of a frame's last trigger, and the number of triggers for which an invocation has begun.
    async fn attempts(
        &self,
        animation: &Animation,
        name: &ScriptName,
        version: &ETag,
        part: Part,
    ) -> Result<(u64, u64)> {
        let (mut attempts, mut begun) = (0, 0);
        for listed in self.retries(animation).await? {
            if let Ok(Key::Retry { name: of, tag, part: of_part, attempt, .. }) = listed.key.parse()
                && (&of, &tag.version, of_part) == (name, version, part)
            {
                attempts = attempts.max(attempt.get());
            }
        }
        let prefix = format!("{}{}", animation.frames(), Tag::receipts_of(name, version));
        for listed in self.list_ranges(ListRequest::all(prefix), Vec::new()).await? {
            if let Ok(Key::Receipt { receipt: Receipt::Begun { name: of, tag, part: of_part, .. }, .. }) =
                listed.key.parse()
                && (&of, &tag.version, of_part) == (name, version, part)
            {
                begun += 1;
            }
        }
        Ok((attempts, begun))
    }

    async fn record_assembly(
        &self,
        failure: &Failure,
        animation: Animation,
        claimed: Generation,
    ) -> Result<Recorded> {
        self.free_lease_of(&animation, &failure.request_id).await?;
        let what = match failure.end {
            End::TimedOut => "timed out",
            End::Died => "died, most likely for lack of memory,",
            End::TooOld | End::Error(_) => return Ok(Recorded::LeftToSweep),
        };
        let known = self.manifest(&animation).await?;
        let mut outputs = Outputs::default();
        self.look_at_outputs(&animation, &needed(known.as_ref(), None), &mut outputs).await?;
        let observation = self.observe(&animation, known.as_ref()).await?;
        self.look_at_outputs(&animation, &needed(None, Some(&observation)), &mut outputs).await?;
        let mut manifest = observation.manifest;
        manifest.head = manifest.head.with_files_of(known.as_ref().map(|known| &known.manifest.head));
        let head = &manifest.head;
        let Due::File(output) = outputs.due(head) else { return Ok(Recorded::LeftToSweep) };
        if head.generation != claimed {
            return Ok(Recorded::LeftToSweep);
        }
        let tries = failure.attempts;
        let reason = Reason::new(format!(
            "the assemble function {what} in each of {tries} attempts at {} frames: give it more time or memory and \
             retry, or fetch the frames and assemble them locally",
            head.total
        ));
        self.refuse(&manifest, output, &reason).await?;
        self.fold(&animation, &Fact::Fold, Age::Old).await.map(Recorded::Refused)
    }
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Record {
    request_context: RequestContext,
    #[serde(default)]
    request_payload: serde_json::Value,
    #[serde(default)]
    response_payload: serde_json::Value,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct RequestContext {
    #[serde(default)]
    condition: String,
    #[serde(default)]
    approximate_invoke_count: u64,
    #[serde(default)]
    request_id: String,
}

#[derive(Deserialize, Default)]
struct Payload {
    #[serde(rename = "Records", default)]
    records: Vec<Event>,
}

#[derive(Deserialize)]
struct Event {
    s3: Entity,
}

#[derive(Deserialize)]
struct Entity {
    object: EventObject,
}

#[derive(Deserialize)]
struct EventObject {
    key: String,
    #[serde(rename = "eTag")]
    etag: Option<String>,
}

impl Record {
    /// Lambda reports how an attempt ended only in the text of its error.
    fn end(&self) -> End {
        if self.request_context.condition == "EventAgeExceeded" {
            return End::TooOld;
        }
        let text = |field: &str| self.response_payload[field].as_str().unwrap_or_default();
        let (kind, message) = (text("errorType"), text("errorMessage"));
        if message.contains("Task timed out")
            || message.starts_with("out of time")
            || kind == "Sandbox.Timedout"
        {
            End::TimedOut
        } else if kind == "Runtime.ExitError"
            || kind == "Runtime.OutOfMemory"
            || message.contains("Runtime exited")
        {
            End::Died
        } else {
            End::Error(message.to_owned())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(condition: &str, response: &str) -> String {
        format!(
            r#"{{"version":"1.0","timestamp":"2026-01-01T00:00:00.000Z",
            "requestContext":{{"requestId":"r","functionArn":"arn:aws:lambda:eu-west-1:1:function:f:$LATEST",
            "condition":"{condition}","approximateInvokeCount":3}},
            "requestPayload":{{"Records":[{{"s3":{{"bucket":{{"name":"b"}},
            "object":{{"key":"scripts/a+b/x%2B1.txt","eTag":"abc"}}}}}}]}},
            "responseContext":{{"statusCode":200,"executedVersion":"$LATEST","functionError":"Unhandled"}},
            "responsePayload":{response}}}"#
        )
    }

    fn check(condition: &str, response: &str, expected: End) {
        let failures = parse_record(record(condition, response).as_bytes()).unwrap();
        let failure = Failure {
            key: "scripts/a b/x+1.txt".to_owned(),
            version: Some(ETag::new("abc")),
            attempts: 3,
            end: expected,
            request_id: "r".to_owned(),
        };
        assert_eq!(failures, [failure]);
    }

    #[test]
    fn records_say_how_it_ended() {
        let message = r#"{"errorMessage":"2026-01-01T00:00:00.000Z r Task timed out after 60.00 seconds"}"#;
        check("RetriesExhausted", message, End::TimedOut);
        let died = r#"{"errorType":"Runtime.ExitError","errorMessage":"RequestId: r Error: Runtime exited with error: signal: killed"}"#;
        check("RetriesExhausted", died, End::Died);
        let own = r#"{"errorType":"Error","errorMessage":"out of time: drawing x"}"#;
        check("RetriesExhausted", own, End::TimedOut);
        let other = r#"{"errorType":"Error","errorMessage":"the store is busy"}"#;
        check("RetriesExhausted", other, End::Error("the store is busy".to_owned()));
        check("EventAgeExceeded", "null", End::TooOld);
    }

    #[test]
    fn each_sign_of_an_end_is_enough() {
        let kind = |kind: &str| format!(r#"{{"errorType":"{kind}","errorMessage":"of some kind"}}"#);
        check("RetriesExhausted", &kind("Sandbox.Timedout"), End::TimedOut);
        check("RetriesExhausted", &kind("Runtime.ExitError"), End::Died);
        check("RetriesExhausted", &kind("Runtime.OutOfMemory"), End::Died);
        check("RetriesExhausted", r#"{"errorMessage":"Runtime exited"}"#, End::Died);
        check("RetriesExhausted", &kind("Other"), End::Error("of some kind".to_owned()));
    }

    #[test]
    fn an_event_of_a_removed_object_has_no_version() {
        for version in ["\"eTag\":\"\"", "\"other\":\"abc\""] {
            let text = record("EventAgeExceeded", "null").replace("\"eTag\":\"abc\"", version);
            let [failure] = &parse_record(text.as_bytes()).unwrap()[..] else { panic!("{text}") };
            assert_eq!(failure.version, None, "{version}");
        }
    }

    #[test]
    fn records_of_the_schedule_have_no_objects() {
        let text = record("RetriesExhausted", "null").replace("Records", "other");
        assert_eq!(parse_record(text.as_bytes()).unwrap(), []);
        assert!(parse_record(b"{}").is_err());
    }
}
