//! The statements of a policy, and their joint verdict.

use super::access::{Access, Verdict};
use super::condition::Condition;
use super::pattern::Pattern;

/// A policy document that has been validated.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Policy {
    pub(super) statements: Vec<Statement>,
}

/// A statement, which allows or denies some actions on some resources if all its conditions hold.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Statement {
    pub(super) effect: Effect,
    /// The actions in lower case, because their names are case-insensitive.
    pub(super) actions: Vec<Pattern>,
    pub(super) resources: Vec<Pattern>,
    pub(super) conditions: Vec<Condition>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize)]
pub(super) enum Effect {
    Allow,
    Deny,
}

impl Policy {
    /// Returns the verdict about an access.
    pub fn verdict(&self, access: &Access<'_>) -> Verdict {
        let action = access.action.to_ascii_lowercase();
        let mut verdict = Verdict::NotAllowed;
        for statement in self.statements.iter().filter(|statement| statement.applies(&action, access)) {
            match statement.effect {
                Effect::Deny => return Verdict::Denied,
                Effect::Allow => verdict = Verdict::Allowed,
            }
        }
        verdict
    }
}

impl Statement {
    fn applies(&self, action: &str, access: &Access<'_>) -> bool {
        self.actions.iter().any(|pattern| pattern.matches(action))
            && self.resources.iter().any(|pattern| pattern.matches(access.resource))
            && self.conditions.iter().all(|condition| condition.holds(access))
    }
}
