//! Conditions of a statement: operators on what a listing asks for.

use super::access::Access;
use super::pattern::Pattern;

/// What a condition looks at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Key {
    /// `s3:prefix`
    Prefix,
    /// `s3:delimiter`
    Delimiter,
}

impl Key {
    /// The names of condition keys have no case.
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

/// How a condition compares.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Operator {
    /// `Null`: whether the request has the key at all.
    Null,
    /// The family of string operators.
    String {
        /// What counts as equal.
        comparison: Comparison,
        /// `…Not…`: none of the values may be equal.
        negated: bool,
        /// `…IfExists`: a request without the key passes.
        if_exists: bool,
    },
}

/// When a string equals a condition's value.
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

/// One key under one operator.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Condition {
    key: Key,
    test: Test,
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Test {
    /// The key is absent (true), present (false), or either.
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
    /// In lower case.
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
    /// # Errors
    /// For a value that the operator cannot use, that value.
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

    /// A key that the request lacks equals no value: so a negated operator holds.
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
