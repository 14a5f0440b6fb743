//! The question and the answer.

/// Something that a caller wants to do.
#[derive(Clone, Copy, Debug)]
pub struct Access<'a> {
    /// `s3:GetObject`, for example.
    pub action: &'a str,
    /// The ARN of the bucket or object: `arn:aws:s3:::bucket/key`.
    pub resource: &'a str,
    /// The condition key `s3:prefix`: the prefix that a listing asks for.
    pub prefix: Option<&'a str>,
    /// The condition key `s3:delimiter`.
    pub delimiter: Option<&'a str>,
}

/// What a policy says to an access.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// A statement allows it, and none denies it.
    Allowed,
    /// A statement denies it, whatever others allow.
    Denied,
    /// No statement allows it.
    NotAllowed,
}
