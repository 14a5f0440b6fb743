//! The delivery of an invocation that failed for good: a destination record in a queue, read by the assemble function.
//!
//! On AWS both functions deliver to one SQS queue; the assemble function polls it. Here the queue is in memory, with the
//! same records, batches, redelivery and dead letters.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use serde_json::{Value, json};
use tokio::sync::{mpsc, oneshot};

use super::queue::{Caller, Failure, Job, Pending, Pool, random_id};
use crate::observation::{Observer, Outcome, Seen};
use crate::region::REGION;

/// SQS's largest batch for a function.
const BATCH: usize = 10;

/// The number of failures after which a message is given up (`maxReceiveCount` in `infra/terraform`).
const MAX_RECEIVES: u32 = 5;

/// The pause before a redelivery, in place of the queue's visibility timeout.
const PAUSE: Duration = Duration::from_millis(500);

struct Message {
    id: String,
    body: String,
    receives: u32,
}

/// Passes the messages of the queue to the assemble function until there are no more senders.
pub(crate) async fn deliver(
    mut failures: mpsc::UnboundedReceiver<Failure>,
    assemble: Pool,
    pending: Pending,
    observer: Observer,
) {
    let mut waiting: Vec<Message> = Vec::new();
    loop {
        if waiting.is_empty() {
            match failures.recv().await {
                Some(failure) => waiting.push(message(&failure)),
                None => return,
            }
        }
        while waiting.len() < BATCH
            && let Ok(failure) = failures.try_recv()
        {
            waiting.push(message(&failure));
        }
        let batch: Vec<Message> = waiting.drain(..waiting.len().min(BATCH)).collect();
        let (done, outcome) = oneshot::channel();
        assemble.submit(Job { caller: Caller::Waiting(done), ..Job::event(event(&batch)) });
        let failed = match outcome.await {
            Ok(Outcome::Succeeded(answer)) => failed_items(&answer),
            Ok(_) => batch.iter().map(|message| message.id.clone()).collect(),
            Err(_) => return,
        };
        let mut returned = false;
        for mut message in batch {
            if !failed.contains(&message.id) {
                pending.remove();
                continue;
            }
            message.receives += 1;
            if message.receives > MAX_RECEIVES {
                observer.see(Seen::DeadLetter { body: message.body });
                pending.remove();
            } else {
                returned = true;
                waiting.push(message);
            }
        }
        if returned {
            tokio::time::sleep(PAUSE).await;
        }
    }
}

fn message(failure: &Failure) -> Message {
    Message { id: random_id(), body: record(failure).to_string(), receives: 1 }
}

/// Returns the record that Lambda sends to a destination.
fn record(failure: &Failure) -> Value {
    let payload: Value = serde_json::from_slice(&failure.payload).unwrap_or(Value::Null);
    let (error, response) = match &failure.outcome {
        Outcome::Failed(body) => (
            json!("Unhandled"),
            serde_json::from_str(body).unwrap_or_else(|_| json!({ "errorMessage": body })),
        ),
        Outcome::TimedOut => (
            json!("Unhandled"),
            json!({ "errorMessage": format!("RequestId: {} Task timed out", failure.request_id) }),
        ),
        Outcome::Crashed(how) => (
            json!("Unhandled"),
            json!({
                "errorType": "Runtime.ExitError",
                "errorMessage": format!("RequestId: {} Error: Runtime exited: {how}", failure.request_id),
            }),
        ),
        Outcome::Succeeded(body) => (Value::Null, json!(body)),
    };
    json!({
        "version": "1.0",
        "timestamp": timestamp(SystemTime::now()),
        "requestContext": {
            "requestId": failure.request_id,
            "functionArn": format!("arn:aws:lambda:{REGION}:000000000000:function:rayfold-{}:$LATEST", failure.function),
            "condition": "RetriesExhausted",
            "approximateInvokeCount": failure.attempts,
        },
        "requestPayload": payload,
        "responseContext": { "statusCode": 200, "executedVersion": "$LATEST", "functionError": error },
        "responsePayload": response,
    })
}

/// The batch as the function gets it.
fn event(batch: &[Message]) -> String {
    let sent = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_millis().to_string();
    let records: Vec<Value> = batch
        .iter()
        .map(|message| {
            json!({
                "messageId": message.id,
                "receiptHandle": random_id(),
                "body": message.body,
                "attributes": {
                    "ApproximateReceiveCount": message.receives.to_string(),
                    "SentTimestamp": sent,
                    "SenderId": "rayfold-local",
                    "ApproximateFirstReceiveTimestamp": sent,
                },
                "messageAttributes": {},
                "md5OfBody": "",
                "eventSource": "aws:sqs",
                "eventSourceARN": format!("arn:aws:sqs:{REGION}:000000000000:rayfold-failures"),
                "awsRegion": REGION,
            })
        })
        .collect();
    json!({ "Records": records }).to_string()
}

/// Returns the messages that the function could not process (`ReportBatchItemFailures`).
fn failed_items(answer: &str) -> Vec<String> {
    let answer: Value = serde_json::from_str(answer).unwrap_or(Value::Null);
    let failures = answer["batchItemFailures"].as_array().into_iter().flatten();
    failures.filter_map(|item| item["itemIdentifier"].as_str()).map(str::to_owned).collect()
}

/// Formats a time by ISO 8601 in UTC, to the millisecond.
fn timestamp(at: SystemTime) -> String {
    let since = at.duration_since(UNIX_EPOCH).unwrap_or_default();
    let (days, seconds) = ((since.as_secs() / 86_400) as i64, since.as_secs() % 86_400);
    // Days since 0000-03-01 to a date of the Gregorian calendar: Hinnant, "chrono-compatible low-level date algorithms".
    let shifted = days + 719_468;
    let era = shifted.div_euclid(146_097);
    let of_era = shifted.rem_euclid(146_097);
    let year_of_era = (of_era - of_era / 1_460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted_month = (5 * of_year + 2) / 153;
    let day = of_year - (153 * shifted_month + 2) / 5 + 1;
    let month = if shifted_month < 10 { shifted_month + 3 } else { shifted_month - 9 };
    let year = year_of_era + era * 400 + i64::from(month <= 2);
    let (hour, minute, second) = (seconds / 3600, seconds / 60 % 60, seconds % 60);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}.{:03}Z", since.subsec_millis())
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;

    use super::*;
    use crate::routes::Function;

    #[test]
    fn timestamps_are_of_the_gregorian_calendar() {
        let at = |seconds: u64| timestamp(UNIX_EPOCH + Duration::from_millis(seconds * 1000 + 7));
        assert_eq!(at(0), "1970-01-01T00:00:00.007Z");
        assert_eq!(at(951_827_696), "2000-02-29T12:34:56.007Z");
        assert_eq!(at(4_107_542_399), "2100-02-28T23:59:59.007Z");
    }

    #[test]
    fn a_record_carries_the_event_and_the_reason() {
        let failure = Failure {
            function: Function::Render,
            request_id: "id".into(),
            payload: Bytes::from_static(b"{\"Records\":[]}"),
            attempts: 3,
            outcome: Outcome::TimedOut,
        };
        let record = record(&failure);
        assert_eq!(record["requestContext"]["condition"], "RetriesExhausted");
        assert_eq!(record["requestContext"]["approximateInvokeCount"], 3);
        assert_eq!(record["requestPayload"], json!({ "Records": [] }));
        assert!(record["responsePayload"]["errorMessage"].as_str().unwrap().contains("timed out"));
    }

    #[test]
    fn only_the_items_named_come_back() {
        assert_eq!(failed_items("null"), Vec::<String>::new());
        assert_eq!(failed_items("{\"batchItemFailures\":[{\"itemIdentifier\":\"a\"}]}"), ["a"]);
    }
}
