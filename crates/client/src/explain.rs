//! The words for an error that a user reads: the store's errors seldom name the bucket, and never
//! the source of credentials.

use rayfold_pipeline::Error as StoreError;

use crate::error::Error;

impl Error {
    /// Returns a sentence that names the bucket: in place of the error, or before it and its sources if it
    /// [is the store's](Self::is_of_store). Returns none if the error says all that there is to say.
    pub fn explain(&self, bucket: &str) -> Option<String> {
        match self {
            Self::NoAnimation(animation) => Some(format!("there is no animation {animation} in {bucket}")),
            Self::ChangedMeanwhile { key } => {
                Some(format!("somebody else has changed {} meanwhile", address(bucket, key)))
            }
            Self::Restless { key } => {
                Some(format!("{} is replaced faster than it can be read", address(bucket, key)))
            }
            Self::Store(StoreError::Refused { source, .. } | StoreError::Ambiguous { source, .. }) => {
                let words = source.to_string();
                let lacks_credentials = ["credentials", "IMDS"].iter().any(|word| words.contains(word));
                Some(if lacks_credentials {
                    format!(
                        "bucket {bucket}: found no AWS credentials: set AWS_PROFILE, or AWS_ACCESS_KEY_ID and \
                         AWS_SECRET_ACCESS_KEY"
                    )
                } else {
                    format!("bucket {bucket}")
                })
            }
            Self::Store(StoreError::Full { .. }) => Some(format!("bucket {bucket}")),
            _ => None,
        }
    }

    /// Returns whether it is an error of the store, whose sources have the details.
    pub fn is_of_store(&self) -> bool {
        matches!(self, Self::Store(_))
    }
}

/// Returns the URL of an object.
pub fn address(bucket: &str, key: &str) -> String {
    format!("s3://{bucket}/{key}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(words: &str) -> Error {
        Error::Store(StoreError::Refused { key: "scripts/a/1.txt".into(), source: words.to_owned().into() })
    }

    #[test]
    fn a_refusal_names_the_bucket_and_where_credentials_come_from() {
        assert_eq!(refused("AccessDenied").explain("films").as_deref(), Some("bucket films"));
        assert!(refused("no credentials").explain("films").unwrap().contains("AWS_PROFILE"));
        assert!(refused("AccessDenied").is_of_store());
    }

    #[test]
    fn a_bucket_without_room_is_named() {
        let (key, source) = ("scripts/a/1.txt".to_owned(), "the disk is full".into());
        let full = Error::Store(StoreError::Full { key, source });
        assert_eq!(full.explain("films").as_deref(), Some("bucket films"));
    }

    #[test]
    fn an_object_is_named_with_its_bucket() {
        let error = Error::Restless { key: "animations/a.gif".into() };
        assert!(error.explain("films").unwrap().starts_with("s3://films/animations/a.gif is replaced"));
        assert!(!error.is_of_store());
        assert_eq!(Error::WouldDelete { keys: vec![] }.explain("films"), None);
    }
}
