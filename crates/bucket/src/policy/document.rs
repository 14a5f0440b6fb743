//! The JSON of a policy document, parsed strictly: every error names the refused part and its position.

use std::fmt;
use std::marker::PhantomData;
use std::str::FromStr;

use serde::de::value::{MapAccessDeserializer, StrDeserializer};
use serde::de::{Deserialize, Deserializer, Error, MapAccess, SeqAccess, Visitor};

use super::condition::{Condition, Key, Operator};
use super::pattern::Pattern;
use super::statement::{self, Effect, Policy};

/// The prefix of the ARNs of all buckets and objects.
const ARN: &str = "arn:aws:s3:::";

impl FromStr for Policy {
    type Err = serde_json::Error;

    /// Parses a policy document.
    ///
    /// # Errors
    /// The problem and its position, also for anything that is valid in IAM but not supported here.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        read(text)
    }
}

fn read(text: &str) -> Result<Policy, serde_json::Error> {
    let document: Document = serde_json::from_str(text)?;
    let Version::Current = document.version;
    let mut sids = Vec::new();
    let mut statements = Vec::new();
    for Statement { sid, effect, action, resource, condition } in document.statement.0 {
        if let Some(Sid(sid)) = sid {
            if sids.contains(&sid) {
                return Err(Error::custom(format_args!("two statements have the Sid `{sid}`")));
            }
            sids.push(sid);
        }
        statements.push(statement::Statement {
            effect,
            actions: action.0.into_iter().map(|Action(pattern)| pattern).collect(),
            resources: resource.0.into_iter().map(|Resource(pattern)| pattern).collect(),
            conditions: condition.0,
        });
    }
    Ok(Policy { statements })
}

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields, rename_all = "PascalCase")]
struct Document {
    version: Version,
    statement: OneOrMany<Statement>,
}

#[derive(serde::Deserialize)]
enum Version {
    #[serde(rename = "2012-10-17")]
    Current,
}

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields, rename_all = "PascalCase")]
struct Statement {
    sid: Option<Sid>,
    effect: Effect,
    action: OneOrMany<Action>,
    resource: OneOrMany<Resource>,
    #[serde(default)]
    condition: Conditions,
}

#[derive(serde::Deserialize)]
#[serde(try_from = "String")]
struct Sid(String);

impl TryFrom<String> for Sid {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        if text.chars().all(|c| c.is_ascii_alphanumeric()) {
            Ok(Self(text))
        } else {
            Err(format!("the Sid `{text}` has more than letters and digits"))
        }
    }
}

#[derive(serde::Deserialize)]
#[serde(try_from = "String")]
struct Action(Pattern);

impl TryFrom<String> for Action {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let lower = text.to_ascii_lowercase();
        let is_name = |name: &str| {
            !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '*' | '?'))
        };
        if lower == "*" || lower.strip_prefix("s3:").is_some_and(is_name) {
            Ok(Self(Pattern::new(&lower)))
        } else {
            Err(format!("unknown action `{text}`: expected `s3:` and a name, or `*`"))
        }
    }
}

#[derive(serde::Deserialize)]
#[serde(try_from = "String")]
struct Resource(Pattern);

impl TryFrom<String> for Resource {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        without_variables(&text)?;
        if text == "*" || text.strip_prefix(ARN).is_some_and(|rest| !rest.is_empty()) {
            Ok(Self(Pattern::new(&text)))
        } else {
            Err(format!("invalid resource `{text}`: expected `{ARN}` and a bucket, or `*`"))
        }
    }
}

/// Refuses policy variables such as `${aws:username}`, which only IAM can resolve.
fn without_variables(text: &str) -> Result<(), String> {
    if text.contains("${") {
        return Err(format!("`{text}` has a policy variable, which is not supported"));
    }
    Ok(())
}

/// Conditions, nested in the JSON as operator, key and values.
#[derive(Default)]
struct Conditions(Vec<Condition>);

impl<'de> Deserialize<'de> for Conditions {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Operators;

        impl<'de> Visitor<'de> for Operators {
            type Value = Conditions;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a map from operators to conditions")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Conditions, A::Error> {
                let mut seen = Vec::new();
                let mut conditions = Vec::new();
                while let Some(name) = map.next_key::<String>()? {
                    let operator = Operator::named(&name).ok_or_else(|| {
                        Error::custom(format_args!("the condition operator `{name}` is not supported"))
                    })?;
                    if seen.contains(&operator) {
                        return Err(Error::custom(format_args!(
                            "the operator `{name}` occurs more than once"
                        )));
                    }
                    seen.push(operator);
                    for (key, values) in map.next_value::<Keys>()?.0 {
                        let condition = Condition::new(operator, key, values).map_err(|value| {
                            Error::custom(format_args!("`{value}` under {name} is neither true nor false"))
                        })?;
                        conditions.push(condition);
                    }
                }
                Ok(Conditions(conditions))
            }
        }

        deserializer.deserialize_map(Operators)
    }
}

/// The keys and values of one operator.
struct Keys(Vec<(Key, Vec<String>)>);

impl<'de> Deserialize<'de> for Keys {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Pairs;

        impl<'de> Visitor<'de> for Pairs {
            type Value = Keys;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a map from condition keys to values")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Keys, A::Error> {
                let mut pairs: Vec<(Key, Vec<String>)> = Vec::new();
                while let Some(name) = map.next_key::<String>()? {
                    let key = Key::named(&name).ok_or_else(|| {
                        Error::custom(format_args!("the condition key `{name}` is not supported"))
                    })?;
                    if pairs.iter().any(|(other, _)| *other == key) {
                        return Err(Error::custom(format_args!("the key `{name}` occurs more than once")));
                    }
                    let values = map.next_value::<OneOrMany<Text>>()?.0;
                    pairs.push((key, values.into_iter().map(|Text(text)| text).collect()));
                }
                Ok(Keys(pairs))
            }
        }

        deserializer.deserialize_map(Pairs)
    }
}

/// A value of a condition: a string, or a Boolean for `Null`.
struct Text(String);

impl<'de> Deserialize<'de> for Text {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct StringOrBool;

        impl Visitor<'_> for StringOrBool {
            type Value = Text;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a string")
            }

            fn visit_str<E: Error>(self, text: &str) -> Result<Text, E> {
                without_variables(text).map_err(E::custom)?;
                Ok(Text(text.to_owned()))
            }

            fn visit_bool<E: Error>(self, value: bool) -> Result<Text, E> {
                Ok(Text(value.to_string()))
            }
        }

        deserializer.deserialize_any(StringOrBool)
    }
}

/// A value alone or a list that is not empty.
struct OneOrMany<T>(Vec<T>);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for OneOrMany<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either<T>(PhantomData<T>);

        impl<'de, T: Deserialize<'de>> Visitor<'de> for Either<T> {
            type Value = OneOrMany<T>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("one, or a list of them")
            }

            fn visit_str<E: Error>(self, text: &str) -> Result<Self::Value, E> {
                Ok(OneOrMany(vec![T::deserialize(StrDeserializer::new(text))?]))
            }

            fn visit_bool<E: Error>(self, value: bool) -> Result<Self::Value, E> {
                Ok(OneOrMany(vec![T::deserialize(serde::de::value::BoolDeserializer::new(value))?]))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
                Ok(OneOrMany(vec![T::deserialize(MapAccessDeserializer::new(map))?]))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Self::Value, A::Error> {
                let mut many = Vec::new();
                while let Some(one) = list.next_element()? {
                    many.push(one);
                }
                if many.is_empty() { Err(A::Error::invalid_length(0, &self)) } else { Ok(OneOrMany(many)) }
            }
        }

        deserializer.deserialize_any(Either(PhantomData))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = r#"{
        "Version": "2012-10-17",
        "Statement": [{
            "Sid": "List1", "Effect": "Allow", "Action": ["s3:ListBucket"], "Resource": "arn:aws:s3:::b",
            "Condition": { "StringLike": { "s3:prefix": ["a/*", "b"] }, "Null": { "s3:delimiter": "true" } }
        }]
    }"#;

    #[test]
    fn one_may_stand_for_a_list_of_one() {
        let alone =
            GOOD.replace("[{", "{").replace("}]", "}").replace(r#"["s3:ListBucket"]"#, r#""s3:ListBucket""#);
        let alone = alone.replace(r#""true""#, "true");
        assert_eq!(read(&alone).unwrap(), read(GOOD).unwrap());
    }

    #[test]
    fn whatever_is_not_understood_is_refused_by_name() {
        for (good, bad, named) in [
            (r#""2012-10-17""#, r#""2008-10-17""#, "2008-10-17"),
            (r#""Version": "2012-10-17","#, "", "Version"),
            (r#""Version""#, r#""Id": "x", "Version""#, "Id"),
            (r#""Effect": "Allow""#, r#""Effect": "allow""#, "allow"),
            (r#""Effect": "Allow","#, "", "Effect"),
            (r#""Action""#, r#""NotAction""#, "NotAction"),
            (r#""Resource""#, r#""NotResource""#, "NotResource"),
            (r#""Sid""#, r#""Principal": "*", "Sid""#, "Principal"),
            ("List1", "List 1", "List 1"),
            (r#"["s3:ListBucket"]"#, "[]", "at line"),
            ("s3:ListBucket", "sqs:SendMessage", "sqs:SendMessage"),
            ("s3:ListBucket", "s3:", "s3:"),
            ("arn:aws:s3:::b", "arn:aws:s3:::", "arn:aws:s3:::"),
            ("arn:aws:s3:::b", "arn:aws:sqs:::b", "arn:aws:sqs:::b"),
            ("arn:aws:s3:::b", "arn:aws:s3:::${aws:username}", "${aws:username}"),
            ("StringLike", "ForAllValues:StringLike", "ForAllValues:StringLike"),
            ("StringLike", "IpAddress", "IpAddress"),
            ("Null", "NullIfExists", "NullIfExists"),
            (r#""Null""#, r#""StringLike""#, "StringLike"),
            ("s3:prefix", "aws:SourceIp", "aws:SourceIp"),
            (r#""s3:prefix""#, r#""S3:Prefix": "x", "s3:prefix""#, "s3:prefix"),
            ("a/*", "${a}", "${a}"),
            (r#""true""#, r#""yes""#, "yes"),
            (r#"["a/*", "b"]"#, "7", "7"),
            (r#"["a/*", "b"]"#, "[]", "at line"),
            (r#"["a/*", "b"]"#, r#"[["a"]]"#, "at line"),
            ("}]", "},]", "line"),
        ] {
            assert!(GOOD.contains(good), "{good}");
            let text = GOOD.replacen(good, bad, 1);
            let error = read(&text).expect_err(bad).to_string();
            assert!(error.contains(named), "{bad}: {error}");
        }
        let twice = GOOD.replace("[{", r#"[{"Sid":"List1","Effect":"Deny","Action":"*","Resource":"*"},{"#);
        assert!(read(&twice).unwrap_err().to_string().contains("List1"));
    }

    /// The error for a value of a wrong type names the right ones.
    #[test]
    fn what_may_stand_there_is_said() {
        let with = |condition: &str| {
            format!(
                r#"{{"Version":"2012-10-17","Statement":{{"Effect":"Allow","Action":"*","Resource":"*","Condition":{condition}}}}}"#
            )
        };
        for (condition, expected) in [
            ("7", "a map from operators to conditions"),
            (r#"{"Null": 7}"#, "a map from condition keys to values"),
            (r#"{"Null": {"s3:prefix": [7]}}"#, "a string"),
            (r#"{"Null": {"s3:prefix": 7}}"#, "one, or a list of them"),
        ] {
            let error = read(&with(condition)).expect_err(condition).to_string();
            assert!(error.contains(&format!("expected {expected}")), "{condition}: {error}");
        }
    }
}
