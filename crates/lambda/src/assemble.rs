//! The assemble function: claims, the sweep, and events that failed permanently.

use rayfold_pipeline::assemble::{Assembled, assemble};
use rayfold_pipeline::failure::{Failure, Recorded, parse_record, record_failure};
use rayfold_pipeline::store::Store;
use rayfold_pipeline::sweep::sweep;
use rayfold_pipeline::{Error, Policy};
use serde_json::Value;

use crate::answer::{Answer, BatchItem, Failed, Outcome, chain, is_transient};
use crate::context::{Call, Context};
use crate::event::{Event, FAILURE_QUEUE, Message, Sweep, Unreadable};
use crate::logs::ms;
use crate::records;

/// Handles the payload of an invocation.
///
/// # Errors
/// [`Failed`] if another try may succeed. For messages of the failure queue the answer lists them instead.
pub async fn handle<S: Store>(context: &Context<S>, call: &Call, payload: Value) -> Result<Answer, Failed> {
    match Event::parse(payload) {
        Ok(Event::Objects(objects)) => {
            records::work(&context.bucket, &call.request_id, objects, |key| record(context, call, key)).await
        }
        Ok(Event::Failures(messages)) => Ok(failures(context, call, messages).await),
        Ok(Event::Sweep(how)) => clean(context, call, how).await,
        // If it were acknowledged, the batch would be deleted. So it comes again, and ends in the dead-letter queue.
        Err(Unreadable::Malformed { of: FAILURE_QUEUE, source }) => {
            tracing::error!(request_id = %call.request_id, error = %source, "unreadable batch");
            let error = Error::Malformed { key: "the failure queue's batch".into(), source: source.into() };
            Err(Failed(vec![(FAILURE_QUEUE.into(), error)]))
        }
        Err(error) => {
            tracing::error!(request_id = %call.request_id, unhandled = true, error = %error, "unreadable event");
            Ok(Answer::default())
        }
    }
}

async fn record<S: Store>(context: &Context<S>, call: &Call, key: String) -> Result<String, Error> {
    let assembled = assemble(&context.invocation(&context.policy, call), &context.animator, &key).await?;
    let Some(assembled) = assembled else {
        tracing::info!(request_id = %call.request_id, key, "another assembler is at it");
        return Ok("left to another".to_owned());
    };
    log(call, &assembled);
    Ok(format!("{:?}", assembled.status).to_lowercase())
}

fn log(call: &Call, assembled: &Assembled) {
    tracing::info!(
        request_id = %call.request_id,
        animation = %assembled.animation,
        status = ?assembled.status,
        generation = %assembled.generation,
        rounds = assembled.rounds,
        built = assembled.built,
        frames = assembled.frames,
        left_after = assembled.left_after,
        waited_ms = ms(assembled.waited),
        building_ms = ms(assembled.building),
        "assembled"
    );
}

async fn failures<S: Store>(context: &Context<S>, call: &Call, messages: Vec<Message>) -> Answer {
    let mut answer = Answer::default();
    for Message { id, body } in messages {
        let failures = match parse_record(body.as_bytes()) {
            Ok(failures) => failures,
            Err(error) => {
                // The message comes again, because a newer version may read it, until the queue moves it
                // to the dead letters.
                tracing::error!(request_id = %call.request_id, id, error = chain(&error), "unreadable record");
                answer.batch_item_failures.push(BatchItem { item_identifier: id });
                continue;
            }
        };
        if failures.is_empty() {
            // For example one of the schedule: the next sweep does the work of this one.
            tracing::error!(request_id = %call.request_id, id, unhandled = true, "a failed event about no object");
        }
        for failure in failures {
            match write_down(context, call, &failure).await {
                Ok(what) => answer.outcomes.push(Outcome { of: failure.key, what }),
                Err(_) => {
                    answer.batch_item_failures.push(BatchItem { item_identifier: id.clone() });
                    break;
                }
            }
        }
    }
    answer
}

async fn write_down<S: Store>(context: &Context<S>, call: &Call, failure: &Failure) -> Result<String, Error> {
    let invocation = context.invocation(&context.policy, call);
    let what = match record_failure(&invocation, failure).await {
        Ok(Recorded::Resolved(_)) => "resolved".to_owned(),
        Ok(Recorded::Woken { attempt }) => format!("woken for attempt {attempt}"),
        Ok(Recorded::GivenUp(_)) => "given up".to_owned(),
        Ok(Recorded::Refused(_)) => "refused".to_owned(),
        Ok(Recorded::LeftToSweep) => "left to the sweep".to_owned(),
        Err(error) if is_transient(&error) => {
            tracing::error!(request_id = %call.request_id, key = failure.key, error = chain(&error), "failed");
            return Err(error);
        }
        Err(error) => chain(&error),
    };
    tracing::warn!(
        request_id = %call.request_id,
        key = failure.key,
        attempts = failure.attempts,
        end = ?failure.end,
        outcome = what,
        "event failed for good"
    );
    Ok(what)
}

async fn clean<S: Store>(context: &Context<S>, call: &Call, how: Sweep) -> Result<Answer, Failed> {
    let policy = match how {
        Sweep::Patient => context.policy.clone(),
        Sweep::CatchUp => Policy { is_fresh_start: true, ..context.policy.clone() },
    };
    let swept = match sweep(&context.invocation(&policy, call)).await {
        Ok(swept) => swept,
        Err(error) => {
            tracing::error!(request_id = %call.request_id, error = chain(&error), "sweep failed");
            return Err(Failed(vec![("sweep".into(), error)]));
        }
    };
    for (key, problem) in &swept.rejected {
        tracing::warn!(request_id = %call.request_id, key, problem, "no script");
    }
    let mut answer = Answer::default();
    for (animation, visit) in swept.visits {
        match visit {
            Ok(visit) => {
                if visit != rayfold_pipeline::sweep::Visit::default() {
                    tracing::info!(
                        request_id = %call.request_id,
                        animation = %animation,
                        woken = visit.woken,
                        given_up = visit.given_up,
                        claimed = visit.claimed,
                        deleted = visit.deleted,
                        "swept"
                    );
                    answer.outcomes.push(Outcome { of: animation.to_string(), what: "swept".into() });
                }
            }
            // The next sweep comes soon, and an error of one animation must not stop the others.
            Err(error) => {
                tracing::error!(
                    request_id = %call.request_id,
                    unhandled = true,
                    animation = %animation,
                    error = chain(&error),
                    "not swept"
                );
            }
        }
    }
    if swept.unvisited > 0 {
        tracing::warn!(request_id = %call.request_id, unvisited = swept.unvisited, "no time for all animations");
    }
    Ok(answer)
}

#[cfg(test)]
mod tests {
    use std::ops::Range;

    use bytes::Bytes;
    use rayfold_pipeline::store::{
        ETag, ListPage, ListRequest, MemoryStore, MemoryUpload, Object, ObjectInfo, PutOptions,
        UnfinishedUpload,
    };
    use rayfold_pipeline::{Randomness, Result, SystemClock, Timestamp, render_frame};
    use serde_json::json;

    use super::*;
    use crate::animator::MovieAnimator;
    use crate::logs::tests::Kept;
    use crate::raytracer::RayTracer;

    /// A bucket in which every request for the GIF of one animation fails.
    struct Faulty(MemoryStore<SystemClock>);

    impl Store for Faulty {
        type Upload = MemoryUpload<SystemClock>;

        async fn get(&self, key: &str) -> Result<Object> {
            self.0.get(key).await
        }

        async fn get_range(&self, key: &str, range: Range<u64>) -> Result<Object> {
            self.0.get_range(key, range).await
        }

        async fn head(&self, key: &str) -> Result<ObjectInfo> {
            match key {
                "animations/bad.gif" => Err(Error::Refused { key: key.into(), source: "broken".into() }),
                _ => self.0.head(key).await,
            }
        }

        async fn put(&self, key: &str, body: Bytes, options: PutOptions) -> Result<ETag> {
            self.0.put(key, body, options).await
        }

        async fn delete(&self, key: &str) -> Result<()> {
            self.0.delete(key).await
        }

        async fn list(&self, request: ListRequest) -> Result<ListPage> {
            self.0.list(request).await
        }

        async fn upload(&self, key: &str, options: PutOptions) -> Result<Self::Upload> {
            self.0.upload(key, options).await
        }

        fn take_up(&self, key: &str, options: PutOptions, unfinished: UnfinishedUpload) -> Self::Upload {
            self.0.take_up(key, options, unfinished)
        }
    }

    async fn context() -> Context<Faulty> {
        let store = MemoryStore::new(SystemClock);
        for key in ["scripts/bad/1.txt", "scripts/good/1.txt"] {
            store.put(key, Bytes::from_static(b"Screen 1 1\nTrace"), PutOptions::always()).await.unwrap();
        }
        Context {
            store: Faulty(store),
            bucket: "films".into(),
            renderer: RayTracer::default(),
            animator: MovieAnimator::default(),
            policy: Policy { request_attempts: 1, ..Policy::new(1) },
            random: Randomness::seeded(1),
        }
    }

    fn call() -> Call {
        Call { request_id: "r".into(), deadline: Timestamp(u64::MAX) }
    }

    fn batch(bodies: &[&str]) -> Value {
        let record = |(n, body): (usize, &&str)| json!({ "eventSource": "aws:sqs", "messageId": format!("m{n}"), "body": body });
        json!({ "Records": bodies.iter().enumerate().map(record).collect::<Vec<_>>() })
    }

    #[tokio::test]
    async fn the_sweep_of_an_animation_that_fails_reaches_the_alarm_and_the_others_are_swept() {
        let context = context().await;
        let (kept, _guard) = Kept::start();
        let answer = handle(&context, &call(), json!({ "sweep": true })).await.unwrap();
        let swept: Vec<_> = answer.outcomes.iter().map(|outcome| outcome.of.as_str()).collect();
        assert_eq!(swept, ["good"]);
        let unhandled = kept.unhandled();
        assert_eq!(unhandled.len(), 1, "{unhandled:?}");
        assert_eq!(
            (&unhandled[0]["animation"], &unhandled[0]["message"]),
            (&"bad".into(), &"not swept".into())
        );
    }

    /// A restart of `rayfold dev` marked frames as failed that waited for their files, and so deleted the previous GIF.
    #[tokio::test]
    async fn catching_up_wakes_what_is_pending_and_lets_wait_what_waits() {
        let context = context().await;
        let put = async |key: &str, text: &'static str| {
            context.store.put(key, Bytes::from_static(text.as_bytes()), PutOptions::always()).await.unwrap();
        };
        put("scripts/good/2.txt", "Screen 1 1\nMesh \"ball.obj\"\nTrace").await;
        let call = call();
        let invocation = context.invocation(&context.policy, &call);
        let waits = render_frame(&invocation, &context.renderer, "scripts/good/2.txt").await.unwrap();
        assert!(matches!(waits.outcome, rayfold_pipeline::render::Outcome::Waits(_)), "{waits:?}");
        for _ in 0..2 {
            handle(&context, &call, json!({ "sweep": true, "catch_up": true })).await.unwrap();
            let keys = async |prefix: &str| {
                let listed = context.store.list(ListRequest::all(prefix)).await.unwrap().objects;
                listed.into_iter().map(|object| object.key).collect::<Vec<_>>()
            };
            let receipts = keys("frames/good/2@").await;
            assert!(!receipts.iter().any(|key| key.ends_with(".error.json")), "{receipts:?}");
            let woken = keys("retries/good/").await;
            assert!(
                woken.iter().all(|key| key.starts_with("retries/good/1@")) && !woken.is_empty(),
                "{woken:?}"
            );
        }
    }

    #[tokio::test]
    async fn an_unreadable_failure_record_comes_again_until_it_is_a_dead_letter() {
        let context = context().await;
        let gone = r#"{"requestContext":{"condition":"RetriesExhausted","approximateInvokeCount":3},
            "requestPayload":{"Records":[{"s3":{"object":{"key":"scripts/none/1.txt"}}}]},
            "responsePayload":{"errorMessage":"busy"}}"#;
        let answer = handle(&context, &call(), batch(&["no JSON", gone, "{}"])).await.unwrap();
        let again: Vec<_> =
            answer.batch_item_failures.iter().map(|item| item.item_identifier.as_str()).collect();
        assert_eq!(again, ["m0", "m2"]);
        assert_eq!(answer.outcomes.len(), 1);
    }

    #[tokio::test]
    async fn an_unreadable_batch_fails_and_so_comes_again() {
        let context = context().await;
        let payload = json!({ "Records": [{ "eventSource": "aws:sqs", "messageId": 7 }] });
        let failed = handle(&context, &call(), payload).await.unwrap_err();
        assert!(failed.to_string().contains("the failure queue's batch"), "{failed}");
    }

    #[tokio::test]
    async fn a_failed_schedule_and_an_unreadable_event_reach_the_alarm() {
        let context = context().await;
        let (kept, _guard) = Kept::start();
        let schedule = r#"{"requestContext":{"condition":"RetriesExhausted","approximateInvokeCount":3},
            "requestPayload":{"sweep":true},"responsePayload":{"errorMessage":"busy"}}"#;
        let answer = handle(&context, &call(), batch(&[schedule])).await.unwrap();
        assert_eq!(answer, Answer::default());
        assert_eq!(handle(&context, &call(), json!({ "what": "else" })).await.unwrap(), Answer::default());
        assert_eq!(kept.unhandled().len(), 2);
    }
}
