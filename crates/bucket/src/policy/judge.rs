//! A second evaluator for the tests. It interprets the JSON directly and follows IAM's user guide word by word,
//! without regard to speed. It shares no code with the evaluator that it tests.

use proptest::prelude::*;
use serde_json::{Value, json};

use super::{Access, Policy, Verdict};

/// Matches by the definition: a star matches nothing, or one character followed by the same star.
pub(super) fn naive_match(pattern: &str, text: &str) -> bool {
    let mut pattern_rest = pattern.chars();
    let mut text_rest = text.chars();
    match (pattern_rest.next(), text_rest.next()) {
        (None, None) => true,
        (None, Some(_)) => false,
        (Some('*'), first) => {
            naive_match(pattern_rest.as_str(), text)
                || first.is_some() && naive_match(pattern, text_rest.as_str())
        }
        (Some(_), None) => false,
        (Some('?'), Some(_)) => naive_match(pattern_rest.as_str(), text_rest.as_str()),
        (Some(a), Some(b)) => a == b && naive_match(pattern_rest.as_str(), text_rest.as_str()),
    }
}

fn list(value: &Value) -> Vec<String> {
    match value {
        Value::String(text) => vec![text.clone()],
        Value::Array(items) => items.iter().map(|item| item.as_str().unwrap().to_owned()).collect(),
        other => panic!("{other}"),
    }
}

/// Evaluates a condition by the definition: "When a request is made, the key's value is compared with each value of
/// the condition, with a logical OR; for a negated operator with a logical NOR. Several keys and several operators
/// are joined by a logical AND."
fn naive_condition(operator: &str, wanted: &[String], found: Option<&str>) -> bool {
    let base = operator.trim_end_matches("IfExists");
    if operator != base && found.is_none() {
        return true;
    }
    match base {
        "Null" => wanted.iter().any(|w| (w == "true") == found.is_none()),
        "StringEquals" => found.is_some_and(|found| wanted.iter().any(|w| w == found)),
        "StringNotEquals" => !found.is_some_and(|found| wanted.iter().any(|w| w == found)),
        "StringLike" => found.is_some_and(|found| wanted.iter().any(|w| naive_match(w, found))),
        "StringNotLike" => !found.is_some_and(|found| wanted.iter().any(|w| naive_match(w, found))),
        "StringEqualsIgnoreCase" => {
            found.is_some_and(|found| wanted.iter().any(|w| w.eq_ignore_ascii_case(found)))
        }
        "StringNotEqualsIgnoreCase" => {
            !found.is_some_and(|found| wanted.iter().any(|w| w.eq_ignore_ascii_case(found)))
        }
        other => panic!("{other}"),
    }
}

fn naive_verdict(document: &Value, access: &Access<'_>) -> Verdict {
    let applies = |statement: &Value| {
        let action = list(&statement["Action"])
            .iter()
            .any(|a| naive_match(&a.to_lowercase(), &access.action.to_lowercase()));
        let resource = list(&statement["Resource"]).iter().any(|r| naive_match(r, access.resource));
        let condition = statement["Condition"].as_object().is_none_or(|operators| {
            operators.iter().all(|(operator, keys)| {
                keys.as_object().unwrap().iter().all(|(key, values)| {
                    let found = match key.as_str() {
                        "s3:prefix" => access.prefix,
                        "s3:delimiter" => access.delimiter,
                        other => panic!("{other}"),
                    };
                    naive_condition(operator, &list(values), found)
                })
            })
        });
        action && resource && condition
    };
    let statements = document["Statement"].as_array().unwrap();
    let applying: Vec<&Value> = statements.iter().filter(|statement| applies(statement)).collect();
    if applying.iter().any(|statement| statement["Effect"] == "Deny") {
        Verdict::Denied
    } else if applying.is_empty() {
        Verdict::NotAllowed
    } else {
        Verdict::Allowed
    }
}

fn one_or_many(items: impl Strategy<Value = String> + Clone + 'static) -> impl Strategy<Value = Value> {
    prop_oneof![
        items.clone().prop_map(Value::String),
        prop::collection::vec(items, 1..3)
            .prop_map(|many| Value::Array(many.into_iter().map(Value::String).collect())),
    ]
}

fn conditions() -> impl Strategy<Value = Value> {
    let operators = [
        "StringEquals",
        "StringNotEquals",
        "StringLike",
        "StringNotLike",
        "StringEqualsIgnoreCase",
        "StringNotEqualsIgnoreCase",
        "StringEqualsIfExists",
        "StringNotEqualsIfExists",
        "StringLikeIfExists",
        "StringNotLikeIfExists",
    ];
    let keys = |values: BoxedStrategy<Value>| {
        prop::collection::hash_map(prop::sample::select(vec!["s3:prefix", "s3:delimiter"]), values, 1..3)
            .prop_map(|keys| json!(keys))
    };
    let null = keys(one_or_many(prop::sample::select(vec!["true".to_owned(), "false".to_owned()])).boxed());
    let strings = keys(one_or_many("[aA/*?]{0,3}").boxed());
    let strings = prop::collection::hash_map(prop::sample::select(operators.to_vec()), strings, 0..3);
    (strings, prop::option::of(null)).prop_map(|(strings, null)| {
        let mut map = json!(strings);
        if let Some(null) = null {
            map["Null"] = null;
        }
        map
    })
}

fn documents() -> impl Strategy<Value = Value> {
    let actions = prop::sample::select(vec![
        "*",
        "s3:*",
        "s3:Get*",
        "s3:getobject",
        "s3:PutObject",
        "s3:???Object",
        "s3:ListBucket",
        "S3:List*",
    ]);
    let actions = actions.prop_map(str::to_owned);
    let resources =
        prop_oneof![Just("*".to_owned()), "[ab*?/]{1,5}".prop_map(|rest| format!("arn:aws:s3:::{rest}")),];
    let statement = (
        prop::bool::weighted(0.7),
        one_or_many(actions),
        one_or_many(resources),
        prop::option::of(conditions()),
    );
    prop::collection::vec(statement, 1..4).prop_map(|statements| {
        let statements: Vec<Value> = statements
            .into_iter()
            .map(|(allow, action, resource, condition)| {
                let effect = if allow { "Allow" } else { "Deny" };
                let mut statement = json!({ "Effect": effect, "Action": action, "Resource": resource });
                if let Some(condition) = condition {
                    statement["Condition"] = condition;
                }
                statement
            })
            .collect();
        json!({ "Version": "2012-10-17", "Statement": statements })
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3000))]

    #[test]
    fn verdicts_are_those_of_the_naive_evaluator(
        document in documents(),
        action in prop::sample::select(vec!["s3:GetObject", "s3:PutObject", "s3:ListBucket", "s3:DeleteObject"]),
        resource in "[ab/]{1,4}".prop_map(|rest| format!("arn:aws:s3:::{rest}")),
        prefix in prop::option::of("[aA/]{0,3}"),
        delimiter in prop::option::of("[aA/]{0,2}"),
    ) {
        let policy: Policy = document.to_string().parse().unwrap();
        let access = Access {
            action,
            resource: &resource,
            prefix: prefix.as_deref(),
            delimiter: delimiter.as_deref(),
        };
        prop_assert_eq!(policy.verdict(&access), naive_verdict(&document, &access));
    }
}

/// Checks that the comparison above covers all three verdicts, and conditions that matter.
#[test]
fn the_generator_meets_every_verdict() {
    use proptest::strategy::ValueTree;
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let mut met = std::collections::BTreeMap::new();
    for _ in 0..400 {
        let document = documents().new_tree(&mut runner).unwrap().current();
        let access = Access {
            action: "s3:GetObject",
            resource: "arn:aws:s3:::a/b",
            prefix: Some("a/"),
            delimiter: None,
        };
        let verdict = naive_verdict(&document, &access);
        *met.entry(format!("{verdict:?}")).or_insert(0) += 1;
    }
    assert!(met.len() == 3 && met.values().all(|count| *count > 20), "{met:?}");
}
