//! The records of a batch of object events, one by one. The caller provides the work for a record.

use rayfold_pipeline::Error;

use crate::answer::{Answer, Failed, Outcome, chain, is_transient};
use crate::event::ObjectEvent;

/// Runs `record` for the key of each record of our bucket, whatever the results of the others.
///
/// # Errors
/// [`Failed`] with the records for which another try may succeed.
pub(crate) async fn work<F>(
    bucket: &str,
    request_id: &str,
    objects: Vec<ObjectEvent>,
    record: impl Fn(String) -> F,
) -> Result<Answer, Failed>
where
    F: Future<Output = Result<String, Error>>,
{
    let (mut answer, mut failed) = (Answer::default(), Vec::new());
    for ObjectEvent { bucket: of, key } in objects {
        if of != bucket {
            tracing::error!(request_id, unhandled = true, bucket = of, key, "an event of another bucket");
            answer.outcomes.push(Outcome { of: key, what: "of another bucket".into() });
            continue;
        }
        match record(key.clone()).await {
            Ok(what) => answer.outcomes.push(Outcome { of: key, what }),
            Err(error) if is_transient(&error) => {
                tracing::error!(request_id, key, error = chain(&error), "failed");
                failed.push((key, error));
            }
            Err(error) => {
                tracing::warn!(request_id, key, error = chain(&error), "ignored");
                answer.outcomes.push(Outcome { of: key, what: chain(&error) });
            }
        }
    }
    if failed.is_empty() { Ok(answer) } else { Err(Failed(failed)) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn object(bucket: &str, key: &str) -> ObjectEvent {
        ObjectEvent { bucket: bucket.into(), key: key.into() }
    }

    #[tokio::test]
    async fn each_record_has_its_outcome_and_only_what_may_pass_fails_the_batch() {
        let record = |key: String| async move {
            match key.as_str() {
                "none" => Err("none".parse::<rayfold_pipeline::keys::Key>().unwrap_err()),
                "late" => Err(Error::OutOfTime { what: "late".into() }),
                _ => Ok(format!("did {key}")),
            }
        };
        let objects = vec![object("b", "x"), object("c", "y"), object("b", "none")];
        let answer = work("b", "r", objects.clone(), record).await.unwrap();
        let what: Vec<&str> = answer.outcomes.iter().map(|outcome| outcome.what.as_str()).collect();
        assert_eq!(what, ["did x", "of another bucket", "none: not a key of the pipeline"]);
        let objects = [objects, vec![object("b", "late")]].concat();
        let Failed(failed) = work("b", "r", objects, record).await.unwrap_err();
        assert!(matches!(failed.as_slice(), [(key, Error::OutOfTime { .. })] if key == "late"));
    }
}
