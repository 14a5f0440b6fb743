//! The rights of a session: an IAM policy document, evaluated as IAM does.
//!
//! An explicit deny overrides every allow, and an action that no statement allows is denied. The document is parsed
//! strictly. Loading it fails with the name of anything unsupported (`NotAction`, `Principal`, another operator or
//! condition key, a policy variable, an unknown field), because ignoring a condition would allow too much.
//!
//! The module is pure: it knows no requests, keys or clock. [`needed`] returns the actions that an
//! operation of S3 needs.
//!
//! ```
//! use rayfold_bucket::policy::{Access, Policy, Verdict};
//!
//! let policy: Policy = r#"{
//!     "Version": "2012-10-17",
//!     "Statement": { "Effect": "Allow", "Action": "s3:Get*", "Resource": "arn:aws:s3:::films/public/*" }
//! }"#.parse()?;
//! let get = |resource| Access { action: "s3:GetObject", resource, prefix: None, delimiter: None };
//! assert_eq!(policy.verdict(&get("arn:aws:s3:::films/public/a.gif")), Verdict::Allowed);
//! assert_eq!(policy.verdict(&get("arn:aws:s3:::films/draft.gif")), Verdict::NotAllowed);
//! # Ok::<(), serde_json::Error>(())
//! ```

mod access;
mod actions;
mod condition;
mod document;
#[cfg(test)]
mod judge;
mod pattern;
mod statement;

pub use access::{Access, Verdict};
pub use actions::{Scope, needed};
pub use statement::Policy;

#[cfg(test)]
mod tests {
    use super::*;

    fn policy(statements: &str) -> Policy {
        format!(r#"{{"Version":"2012-10-17","Statement":[{statements}]}}"#).parse().unwrap()
    }

    fn access<'a>(action: &'a str, resource: &'a str) -> Access<'a> {
        Access { action, resource, prefix: None, delimiter: None }
    }

    #[test]
    fn a_deny_beats_every_allow_wherever_it_stands() {
        let allow = r#"{"Effect":"Allow","Action":"s3:*","Resource":"*"}"#;
        let deny = r#"{"Effect":"Deny","Action":"s3:DeleteObject","Resource":"arn:aws:s3:::b/keep/*"}"#;
        for order in [format!("{allow},{deny}"), format!("{deny},{allow}")] {
            let policy = policy(&order);
            assert_eq!(policy.verdict(&access("s3:DeleteObject", "arn:aws:s3:::b/keep/x")), Verdict::Denied);
            assert_eq!(policy.verdict(&access("s3:DeleteObject", "arn:aws:s3:::b/x")), Verdict::Allowed);
        }
    }

    #[test]
    fn actions_have_no_case_and_resources_do() {
        let policy = policy(r#"{"Effect":"Allow","Action":"S3:getobject","Resource":"arn:aws:s3:::b/K"}"#);
        assert_eq!(policy.verdict(&access("s3:GetObject", "arn:aws:s3:::b/K")), Verdict::Allowed);
        assert_eq!(policy.verdict(&access("s3:GetObject", "arn:aws:s3:::b/k")), Verdict::NotAllowed);
    }

    /// The policies of the functions: those that Terraform deploys on AWS are the ones tested here.
    #[test]
    fn the_documents_of_the_functions_are_read() {
        for (name, template) in [
            ("render", include_str!("../../../infra/terraform/policies/render.json.tftpl")),
            ("assemble", include_str!("../../../infra/terraform/policies/assemble.json.tftpl")),
        ] {
            let policy: Policy = template.replace("${bucket_arn}", "arn:aws:s3:::films").parse().unwrap();
            let script = access("s3:GetObject", "arn:aws:s3:::films/scripts/a/1.txt");
            assert_eq!(policy.verdict(&script), Verdict::Allowed, "{name}");
            let write = access("s3:PutObject", "arn:aws:s3:::films/scripts/a/1.txt");
            assert_eq!(policy.verdict(&write), Verdict::NotAllowed, "{name}");
            let list = access("s3:ListBucket", "arn:aws:s3:::films");
            for (prefix, verdict) in [
                (None, Verdict::Allowed),
                (Some("scripts/a/"), Verdict::Allowed),
                (Some("animations/"), Verdict::NotAllowed),
                (Some(""), Verdict::NotAllowed),
            ] {
                assert_eq!(policy.verdict(&Access { prefix, ..list }), verdict, "{name} {prefix:?}");
            }
        }
    }
}
