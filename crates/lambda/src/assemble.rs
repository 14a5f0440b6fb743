//! The assemble function: claims, the sweep, and events that failed for good.

use rayfold_pipeline::assemble::{Assembled, assemble};
use rayfold_pipeline::failure::{Failure, Recorded, parse_record, record_failure};
use rayfold_pipeline::store::Store;
use rayfold_pipeline::sweep::sweep;
use rayfold_pipeline::{Error, Policy};
use serde_json::Value;

use crate::answer::{Answer, BatchItem, Failed, Outcome, chain, may_pass};
use crate::context::{Call, Context};
use crate::event::{Event, Message, Sweep};
use crate::logs::ms;
use crate::records;

/// Works on a payload.
///
/// # Errors
/// [`Failed`] when another try may end otherwise; for messages of the failure queue the answer says so instead.
pub async fn handle<S: Store>(context: &Context<S>, call: &Call, payload: Value) -> Result<Answer, Failed> {
    match Event::parse(payload) {
        Ok(Event::Objects(objects)) => {
            records::work(&context.bucket, &call.request_id, objects, |key| record(context, call, key)).await
        }
        Ok(Event::Failures(messages)) => Ok(failures(context, call, messages).await),
        Ok(Event::Sweep(how)) => clean(context, call, how).await,
        Err(error) => {
            tracing::error!(request_id = %call.request_id, error = %error, "unreadable event");
            Ok(Answer::default())
        }
    }
}

/// Works on one claim.
async fn record<S: Store>(context: &Context<S>, call: &Call, key: String) -> Result<String, Error> {
    let assembled = assemble(&context.invocation(&context.policy, call), &context.animator, &key).await?;
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
                tracing::error!(request_id = %call.request_id, message = id, error = chain(&error), "unreadable record");
                continue;
            }
        };
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
        Err(error) if may_pass(&error) => {
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
        Sweep::CatchUp => {
            Policy { stuck_after: std::time::Duration::ZERO, attempts: u64::MAX, ..context.policy.clone() }
        }
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
            // The next sweep comes soon; one animation's trouble is not the others'.
            Err(error) => {
                tracing::error!(request_id = %call.request_id, animation = %animation, error = chain(&error), "failed");
            }
        }
    }
    if swept.unvisited > 0 {
        tracing::warn!(request_id = %call.request_id, unvisited = swept.unvisited, "no time for all animations");
    }
    Ok(answer)
}
