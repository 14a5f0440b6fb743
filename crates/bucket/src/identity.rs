//! Authentication and authorisation: the owner may do everything, a session what its policy allows.
//!
//! The owner's key is given at the start. `AssumeRole` ([`sts`]) makes a session with a policy. The database keeps it
//! until it expires. A session has a key of its own, which must come with the session's token. A request is refused
//! if it has no signature, or if its signature leaves out a header that changes the request ([`signed`]).
//! [`policy`](crate::policy) evaluates; [`access`] determines the rights that a request needs.
//!
//! Invariants: key, token and policy are checked before a request reaches an operation. An expired session has no
//! rights. A secret or token is never part of a response, except of the one that issues it.

mod access;
mod caller;
mod session;
mod signed;
mod sts;

pub(crate) use access::{Access, DeniedKeys, hide_missing_key};
pub(crate) use caller::Identities;
pub(crate) use session::Sessions;
pub(crate) use sts::{AssumeRole, in_sts_shape, is_for_sts};
