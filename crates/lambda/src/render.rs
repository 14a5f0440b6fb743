//! The render function, which handles one event per frame.

use rayfold_pipeline::Error;
use rayfold_pipeline::keys::{SCRIPTS, Uploaded};
use rayfold_pipeline::render::{Outcome as Came, Rendered, render_frame};
use rayfold_pipeline::store::Store;
use serde_json::Value;

use crate::answer::{Answer, Failed};
use crate::context::{Call, Context};
use crate::event::Event;
use crate::logs::ms;
use crate::records;

/// Handles the payload of an invocation.
///
/// # Errors
/// [`Failed`] if another try may succeed.
pub async fn handle<S: Store>(context: &Context<S>, call: &Call, payload: Value) -> Result<Answer, Failed> {
    let objects = match Event::parse(payload) {
        Ok(Event::Objects(objects)) => objects,
        Ok(Event::Sweep(_) | Event::Failures(_)) => {
            tracing::warn!(request_id = %call.request_id, "an event for the assemble function");
            Vec::new()
        }
        Err(error) => {
            tracing::error!(request_id = %call.request_id, unhandled = true, error = %error, "unreadable event");
            Vec::new()
        }
    };
    records::work(&context.bucket, &call.request_id, objects, |key| record(context, call, key)).await
}

async fn record<S: Store>(context: &Context<S>, call: &Call, key: String) -> Result<String, Error> {
    if key.starts_with(SCRIPTS) && Uploaded::of(&key, 0) == Uploaded::Nothing {
        return Ok("nothing that is read".into());
    }
    let rendered = render_frame(&context.invocation(&context.policy, call), &context.renderer, &key).await?;
    let what = described(&rendered.outcome);
    match rendered.outcome {
        Came::NearMiss(problem) => {
            tracing::warn!(request_id = %call.request_id, animation = %rendered.animation, key, problem, "not read");
        }
        _ => log(call, &key, &rendered, &what),
    }
    Ok(what)
}

fn described(outcome: &Came) -> String {
    match outcome {
        Came::Gone => "gone".into(),
        Came::Settings => "settings".into(),
        Came::NearMiss(_) => "not read".into(),
        Came::Superseded => "superseded".into(),
        Came::Present => "present".into(),
        Came::Drawn => "drawn".into(),
        Came::Split(parts) => format!("split into {parts}"),
        Came::Cut(bands) => format!("cut into {bands}"),
        Came::Band(band) => format!("band {band}"),
        Came::Waits(_) => "waits for a file".into(),
        Came::Faulty(_) => "faulty".into(),
        Came::File => "a file of scripts".into(),
        Came::NoFile => "nothing that is read".into(),
        Came::TooMany => "one too many".into(),
    }
}

fn log(call: &Call, key: &str, rendered: &Rendered, what: &str) {
    let stages = rendered.stages;
    tracing::info!(
        request_id = %call.request_id,
        key,
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
