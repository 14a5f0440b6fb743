//! The records of a batch of object events, one by one, for either function.

use rayfold_pipeline::store::Store;

use crate::answer::{Answer, Failed, Outcome, chain, may_pass};
use crate::context::{Call, Context};
use crate::event::ObjectEvent;
use crate::{Function, assemble, render};

/// Works on each record, whatever becomes of the others.
///
/// # Errors
/// [`Failed`] with those that another try may end otherwise.
pub(crate) async fn work<S: Store>(
    function: Function,
    context: &Context<S>,
    call: &Call,
    objects: Vec<ObjectEvent>,
) -> Result<Answer, Failed> {
    let (mut answer, mut failed) = (Answer::default(), Vec::new());
    for ObjectEvent { bucket, key } in objects {
        if bucket != context.bucket {
            tracing::error!(request_id = %call.request_id, unhandled = true, bucket, key, "an event of another bucket");
            answer.outcomes.push(Outcome { of: key, what: "of another bucket".into() });
            continue;
        }
        let outcome = match function {
            Function::Render => render::record(context, call, &key).await,
            Function::Assemble => assemble::record(context, call, &key).await,
        };
        match outcome {
            Ok(what) => answer.outcomes.push(Outcome { of: key, what }),
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
