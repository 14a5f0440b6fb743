//! The access that a caller wants, and the verdict of a policy.

/// An action that a caller wants to take.
#[derive(Clone, Copy, Debug)]
pub struct Access<'a> {
    /// The name of the action, such as `s3:GetObject`.
    pub action: &'a str,
    /// The ARN of the bucket or object: `arn:aws:s3:::bucket/key`.
    pub resource: &'a str,
    /// The condition key `s3:prefix`: the prefix that a listing asks for.
    pub prefix: Option<&'a str>,
    /// The condition key `s3:delimiter` of a listing.
    pub delimiter: Option<&'a str>,
}

/// The verdict of a policy about an access.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// A statement allows it, and none denies it.
    Allowed,
    /// A statement denies it, whatever others allow.
    Denied,
    /// No statement allows or denies it.
    NotAllowed,
}
