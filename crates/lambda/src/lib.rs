//! The render and the assemble function on AWS Lambda, thin: events in, the pipeline's steps, outcomes and logs out.
//!
//! The two binaries are this crate with another handler. The store's client is made once a cold start. Handlers take
//! the payload as JSON and know nothing of the runtime, so that they are tested without it; what a step decides is not
//! decided again here. `raytracer` and `animator` are what the steps draw and animate with.
//!
//! Invariants: a batch gives an outcome a record; what another try cannot change never fails an invocation; what nothing
//! here could handle stays in its queue, or is logged with `unhandled`, which an alarm watches; logs are JSON and hold no
//! script contents.

pub mod animator;
pub mod answer;
pub mod assemble;
pub mod capacity;
pub mod context;
pub mod event;
pub mod joining;
mod limits;
mod logs;
mod png;
mod pool;
pub mod raytracer;
mod records;
pub mod render;

use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use lambda_runtime::{BoxFuture, LambdaEvent, service_fn};
use rayfold_pipeline::Timestamp;
use rayfold_pipeline::store::S3Store;
use serde_json::Value;

use answer::{Answer, Failed};
use context::{Call, Context};

/// Which function a process is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Function {
    /// Draws a frame.
    Render,
    /// Writes the GIF, sweeps, records failed events.
    Assemble,
}

/// Serves the runtime until it ends.
///
/// # Errors
/// What is missing in the environment, or the runtime's.
pub fn run(function: Function) -> anyhow::Result<()> {
    logs::start();
    // One invocation at a time: a thread for requests and timers; the pixels have the rayon pool.
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build()?;
    runtime.block_on(async {
        let context = Arc::new(
            Context::from_environment()
                .await
                .inspect_err(|error| tracing::error!(error = format!("{error:#}"), "cannot start"))?,
        );
        let serve = service_fn(move |event: LambdaEvent<Value>| handle(function, context.clone(), event));
        lambda_runtime::run(serve).await.map_err(anyhow::Error::from_boxed)
    })
}

async fn handle(
    function: Function,
    context: Arc<Context<S3Store>>,
    event: LambdaEvent<Value>,
) -> Result<Answer, Failed> {
    let call = Call {
        request_id: event.context.request_id.clone(),
        deadline: Timestamp(ms_since_epoch(event.context.deadline())),
    };
    let handled: BoxFuture<'_, Result<Answer, Failed>> = match function {
        Function::Render => Box::pin(render::handle(&context, &call, event.payload)),
        Function::Assemble => Box::pin(assemble::handle(&context, &call, event.payload)),
    };
    handled.await
}

fn ms_since_epoch(at: SystemTime) -> u64 {
    let since = at.duration_since(UNIX_EPOCH).unwrap_or(Duration::ZERO);
    u64::try_from(since.as_millis()).unwrap_or(u64::MAX)
}
