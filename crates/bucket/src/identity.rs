//! Who asks, and what they may do: the owner everything, a session what its policy says.
//!
//! The owner's key is given at the start. A session is made by `AssumeRole` ([`sts`]) with a policy, kept in the database
//! until it expires, and known by a key of its own, which must come with the session's token. Requests without a signature
//! are refused, and so are those whose signature leaves out a header that changes them ([`signed`]).
//! [`policy`](crate::policy) evaluates; [`access`] says what a request asks for.
//!
//! Invariants: no request reaches an operation before its key, token and policy were looked at; a session that has
//! expired is nobody; secrets and tokens are never part of an answer but the one that hands them out.

mod access;
mod caller;
mod session;
mod signed;
mod sts;

pub(crate) use access::{Access, DeniedKeys, hide_missing_key};
pub(crate) use caller::Identities;
pub(crate) use session::Sessions;
pub(crate) use sts::{AssumeRole, in_sts_shape, is_for_sts};
