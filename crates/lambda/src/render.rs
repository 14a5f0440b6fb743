//! The render function: an event a frame.

use rayfold_pipeline::render::{Outcome as Came, Rendered, render_frame};
use rayfold_pipeline::store::Store;
use serde_json::Value;

use crate::answer::{Answer, Failed, Outcome, chain, may_pass};
use crate::context::{Call, Context};
use crate::event::{Event, ObjectEvent};
use crate::logs::ms;

/// Works on a payload.
///
/// # Errors
/// [`Failed`] when another try may end otherwise.
pub async fn handle<S: Store>(context: &Context<S>, call: &Call, payload: Value) -> Result<Answer, Failed> {
    let objects = match Event::parse(payload) {
        Ok(Event::Objects(objects)) => objects,
        Ok(Event::Sweep(_) | Event::Failures(_)) => {
            tracing::warn!(request_id = %call.request_id, "an event for the assemble function");
            Vec::new()
        }
        Err(error) => {
            tracing::error!(request_id = %call.request_id, error = %error, "unreadable event");
            Vec::new()
        }
    };
    let (mut answer, mut failed) = (Answer::default(), Vec::new());
    for ObjectEvent { bucket, key } in objects {
        if bucket != context.bucket {
            tracing::error!(request_id = %call.request_id, bucket, key, "an event of another bucket");
            answer.outcomes.push(Outcome { of: key, what: "of another bucket".into() });
            continue;
        }
        let invocation = context.invocation(&context.policy, call);
        match render_frame(&invocation, &context.studio, &key).await {
            Ok(rendered) => {
                let what = described(&rendered.outcome);
                log(call, &rendered, &what);
                answer.outcomes.push(Outcome { of: key, what });
            }
            Err(error) if may_pass(&error) => {
                tracing::error!(request_id = %call.request_id, key, error = chain(&error), "failed");
                failed.push((key, error));
            }
            Err(error) => {
                tracing::warn!(request_id = %call.request_id, key, error = chain(&error), "ignored");
                answer.outcomes.push(Outcome { of: key, what: chain(&error) });
            }
        }
    }
    if failed.is_empty() { Ok(answer) } else { Err(Failed(failed)) }
}

fn described(outcome: &Came) -> String {
    match outcome {
        Came::Gone => "gone".into(),
        Came::Settings => "settings".into(),
        Came::Superseded => "superseded".into(),
        Came::Present => "present".into(),
        Came::Drawn => "drawn".into(),
        Came::Split(parts) => format!("split into {parts}"),
        Came::Faulty(_) => "faulty".into(),
    }
}

fn log(call: &Call, rendered: &Rendered, what: &str) {
    let stages = rendered.stages;
    tracing::info!(
        request_id = %call.request_id,
        animation = %rendered.animation,
        frame = rendered.script.as_ref().map(tracing::field::display),
        outcome = what,
        read_ms = ms(stages.read),
        draw_ms = ms(stages.draw),
        put_ms = ms(stages.put),
        fold_ms = ms(stages.fold),
        "rendered"
    );
}
