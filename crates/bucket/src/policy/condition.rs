//! The conditions of a statement: operators on the parameters of a listing.

use super::access::Access;
use super::pattern::Pattern;

/// A condition key that is supported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Key {
    /// The key `s3:prefix` of a listing.
    Prefix,
    /// The key `s3:delimiter` of a listing.
    Delimiter,
}

impl Key {
    /// Parses the name of a condition key, which is case-insensitive.
    pub(super) fn named(name: &str) -> Option<Self> {
        match name.to_ascii_lowercase().as_str() {
            "s3:prefix" => Some(Self::Prefix),
            "s3:delimiter" => Some(Self::Delimiter),
            _ => None,
        }
    }

    fn of<'a>(self, access: &Access<'a>) -> Option<&'a str> {
        match self {
            Self::Prefix => access.prefix,
            Self::Delimiter => access.delimiter,
        }
    }
}

/// The operator of a condition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Operator {
    /// `Null`: whether the request has the key.
    Null,
    /// The family of string operators.
    String {
        /// The comparison that counts as equality.
        comparison: Comparison,
        /// `…Not…`: none of the values may be equal.
        negated: bool,
        /// `…IfExists`: a request without the key passes.
        if_exists: bool,
    },
}

/// The way in which a string equals a condition's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Comparison {
    Exact,
    IgnoreCase,
    Like,
}

impl Operator {
    pub(super) fn named(name: &str) -> Option<Self> {
        if name == "Null" {
            return Some(Self::Null);
        }
        let (name, if_exists) = match name.strip_suffix("IfExists") {
            Some(name) => (name, true),
            None => (name, false),
        };
        let (comparison, negated) = match name {
            "StringEquals" => (Comparison::Exact, false),
            "StringNotEquals" => (Comparison::Exact, true),
            "StringEqualsIgnoreCase" => (Comparison::IgnoreCase, false),
            "StringNotEqualsIgnoreCase" => (Comparison::IgnoreCase, true),
            "StringLike" => (Comparison::Like, false),
            "StringNotLike" => (Comparison::Like, true),
            _ => return None,
        };
        Some(Self::String { comparison, negated, if_exists })
    }
}

/// A key with its operator and values.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Condition {
    key: Key,
    test: Test,
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Test {
    /// The key must be absent (true) or present (false); with both values, either.
    Null(Vec<bool>),
    String {
        values: Vec<Value>,
        negated: bool,
        if_exists: bool,
    },
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Value {
    Exact(String),
    /// The value in lower case.
    IgnoreCase(String),
    Like(Pattern),
}

impl Value {
    fn equals(&self, text: &str) -> bool {
        match self {
            Self::Exact(value) => value == text,
            Self::IgnoreCase(value) => *value == text.to_lowercase(),
            Self::Like(pattern) => pattern.matches(text),
        }
    }
}

impl Condition {
    /// Makes a condition on a key's values.
    ///
    /// # Errors
    /// Returns the value that the operator cannot use.
    pub(super) fn new(operator: Operator, key: Key, values: Vec<String>) -> Result<Self, String> {
        let test = match operator {
            Operator::Null => {
                let flag = |value: String| match value.as_str() {
                    "true" => Ok(true),
                    "false" => Ok(false),
                    _ => Err(value),
                };
                Test::Null(values.into_iter().map(flag).collect::<Result<_, _>>()?)
            }
            Operator::String { comparison, negated, if_exists } => {
                let value = |text: String| match comparison {
                    Comparison::Exact => Value::Exact(text),
                    Comparison::IgnoreCase => Value::IgnoreCase(text.to_lowercase()),
                    Comparison::Like => Value::Like(Pattern::new(&text)),
                };
                Test::String { values: values.into_iter().map(value).collect(), negated, if_exists }
            }
        };
        Ok(Self { key, test })
    }

    /// Evaluates the condition. A missing key equals no value, so a negated operator then holds.
    pub(super) fn holds(&self, access: &Access<'_>) -> bool {
        match (&self.test, self.key.of(access)) {
            (Test::Null(absent), found) => absent.contains(&found.is_none()),
            (Test::String { negated, if_exists, .. }, None) => *negated || *if_exists,
            (Test::String { values, negated, .. }, Some(text)) => {
                values.iter().any(|value| value.equals(text)) != *negated
            }
        }
    }
}
