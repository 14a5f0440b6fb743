//! The render and the assemble function on AWS Lambda, as thin wrappers: they take events, run the pipeline's steps,
//! and return outcomes and logs.
//!
//! The two binaries are this crate with different handlers. The store's client is made once per cold start (`context`).
//! Handlers take the payload as JSON and know nothing of the runtime, so they are tested without it. A handler repeats
//! no decision of a step.
//!
//! - `event` parses the events: S3's in the form of AWS and of MinIO, the schedule's, and batches of the failure queue.
//! - `raytracer` and `animator` (by `movie`) implement the pipeline's traits.
//! - `capacity` decides whether an invocation can bear a frame, and into how many bands to cut it. `joining` puts bands
//!   together.
//! - `answer` has the outcomes, and the failure that makes Lambda retry.
//!
//! Invariants: a batch gives one outcome per record. A permanent error is recorded, and never fails an invocation. A
//! message that cannot be handled stays in its queue. Anything else that a function can neither handle nor hand on is
//! logged with `unhandled`, which an alarm counts. Logs are JSON and hold no script contents.

pub mod animator;
pub mod answer;
pub mod assemble;
pub mod capacity;
pub mod context;
pub mod event;
mod given;
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

/// The function that a process runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Function {
    /// The render function.
    Render,
    /// The assemble function, which writes the GIF, sweeps, and records failed events.
    Assemble,
}

/// If this variable is set, the process ends when its standard input ends.
pub const LIFELINE: &str = "RAYFOLD_ENDS_WITH_STDIN";

/// Serves the Lambda runtime until it ends.
///
/// With the variable [`LIFELINE`] the process ends at once when its standard input ends, also while it draws. The process that
/// started it holds the other end of that pipe, and the system closes it however that process ends.
///
/// # Errors
/// Returns what is missing in the environment, or the error of the runtime.
pub fn run(function: Function) -> anyhow::Result<()> {
    logs::start();
    if std::env::var_os(LIFELINE).is_some() {
        std::thread::Builder::new().name("lifeline".into()).spawn(|| {
            let _ = std::io::copy(&mut std::io::stdin().lock(), &mut std::io::sink());
            std::process::exit(0);
        })?;
    }
    // There is one invocation at a time, so one thread serves requests and timers. The pixels have the rayon pool.
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
