//! The actions that an operation of S3 needs, from the table of the Service Authorization Reference.
//!
//! <https://docs.aws.amazon.com/service-authorization/latest/reference/list_amazons3.html>

/// The kind of resource of an action.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scope {
    /// All buckets, as `*`.
    Account,
    /// A bucket, as `arn:aws:s3:::bucket`.
    Bucket,
    /// An object, as `arn:aws:s3:::bucket/key`.
    Object,
}

/// Returns the actions that an operation needs, and the kind of their resource. The operation is given by its name in
/// the API, and all of the actions must be allowed.
///
/// The rights to read a copy's source and to delete many objects at once are checked for each object in addition.
/// Returns `None` for operations that no policy can allow in this store.
pub fn needed(operation: &str) -> Option<(Scope, &'static [&'static str])> {
    let (scope, actions): (_, &[&str]) = match operation {
        "ListBuckets" => (Scope::Account, &["s3:ListAllMyBuckets"]),

        "CreateBucket" => (Scope::Bucket, &["s3:CreateBucket"]),
        "DeleteBucket" => (Scope::Bucket, &["s3:DeleteBucket"]),
        "HeadBucket" | "ListObjects" | "ListObjectsV2" => (Scope::Bucket, &["s3:ListBucket"]),
        "ListObjectVersions" => (Scope::Bucket, &["s3:ListBucketVersions"]),
        "ListMultipartUploads" => (Scope::Bucket, &["s3:ListBucketMultipartUploads"]),
        "GetBucketAcl" => (Scope::Bucket, &["s3:GetBucketAcl"]),
        "GetBucketCors" => (Scope::Bucket, &["s3:GetBucketCORS"]),
        "GetBucketEncryption" => (Scope::Bucket, &["s3:GetEncryptionConfiguration"]),
        "GetBucketLifecycleConfiguration" => (Scope::Bucket, &["s3:GetLifecycleConfiguration"]),
        "GetBucketLocation" => (Scope::Bucket, &["s3:GetBucketLocation"]),
        "GetBucketNotificationConfiguration" => (Scope::Bucket, &["s3:GetBucketNotification"]),
        "GetBucketPolicy" => (Scope::Bucket, &["s3:GetBucketPolicy"]),
        "GetBucketTagging" => (Scope::Bucket, &["s3:GetBucketTagging"]),
        "GetBucketVersioning" => (Scope::Bucket, &["s3:GetBucketVersioning"]),
        "GetObjectLockConfiguration" => (Scope::Bucket, &["s3:GetBucketObjectLockConfiguration"]),
        "PutBucketAcl" => (Scope::Bucket, &["s3:PutBucketAcl"]),
        "PutBucketCors" | "DeleteBucketCors" => (Scope::Bucket, &["s3:PutBucketCORS"]),
        "PutBucketNotificationConfiguration" => (Scope::Bucket, &["s3:PutBucketNotification"]),

        "GetObject" | "HeadObject" => (Scope::Object, &["s3:GetObject"]),
        "GetObjectAttributes" => (Scope::Object, &["s3:GetObject", "s3:GetObjectAttributes"]),
        "GetObjectAcl" => (Scope::Object, &["s3:GetObjectAcl"]),
        "GetObjectTagging" => (Scope::Object, &["s3:GetObjectTagging"]),
        "PutObject"
        | "CopyObject"
        | "CreateMultipartUpload"
        | "UploadPart"
        | "UploadPartCopy"
        | "CompleteMultipartUpload" => (Scope::Object, &["s3:PutObject"]),
        "PutObjectAcl" => (Scope::Object, &["s3:PutObjectAcl"]),
        "PutObjectTagging" => (Scope::Object, &["s3:PutObjectTagging"]),
        "DeleteObject" => (Scope::Object, &["s3:DeleteObject"]),
        "DeleteObjectTagging" => (Scope::Object, &["s3:DeleteObjectTagging"]),
        "AbortMultipartUpload" => (Scope::Object, &["s3:AbortMultipartUpload"]),
        "ListParts" => (Scope::Object, &["s3:ListMultipartUploadParts"]),
        _ => return None,
    };
    Some((scope, actions))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The reference's table: operation, kind of resource, actions.
    const REFERENCE: &str = "
        ListBuckets                         Account  s3:ListAllMyBuckets
        CreateBucket                        Bucket   s3:CreateBucket
        DeleteBucket                        Bucket   s3:DeleteBucket
        HeadBucket                          Bucket   s3:ListBucket
        ListObjects                         Bucket   s3:ListBucket
        ListObjectsV2                       Bucket   s3:ListBucket
        ListObjectVersions                  Bucket   s3:ListBucketVersions
        ListMultipartUploads                Bucket   s3:ListBucketMultipartUploads
        GetBucketAcl                        Bucket   s3:GetBucketAcl
        GetBucketCors                       Bucket   s3:GetBucketCORS
        GetBucketEncryption                 Bucket   s3:GetEncryptionConfiguration
        GetBucketLifecycleConfiguration     Bucket   s3:GetLifecycleConfiguration
        GetBucketLocation                   Bucket   s3:GetBucketLocation
        GetBucketNotificationConfiguration  Bucket   s3:GetBucketNotification
        GetBucketPolicy                     Bucket   s3:GetBucketPolicy
        GetBucketTagging                    Bucket   s3:GetBucketTagging
        GetBucketVersioning                 Bucket   s3:GetBucketVersioning
        GetObjectLockConfiguration          Bucket   s3:GetBucketObjectLockConfiguration
        PutBucketAcl                        Bucket   s3:PutBucketAcl
        PutBucketCors                       Bucket   s3:PutBucketCORS
        DeleteBucketCors                    Bucket   s3:PutBucketCORS
        PutBucketNotificationConfiguration  Bucket   s3:PutBucketNotification
        GetObject                           Object   s3:GetObject
        HeadObject                          Object   s3:GetObject
        GetObjectAttributes                 Object   s3:GetObject s3:GetObjectAttributes
        GetObjectAcl                        Object   s3:GetObjectAcl
        GetObjectTagging                    Object   s3:GetObjectTagging
        PutObject                           Object   s3:PutObject
        CopyObject                          Object   s3:PutObject
        CreateMultipartUpload               Object   s3:PutObject
        UploadPart                          Object   s3:PutObject
        UploadPartCopy                      Object   s3:PutObject
        CompleteMultipartUpload             Object   s3:PutObject
        PutObjectAcl                        Object   s3:PutObjectAcl
        PutObjectTagging                    Object   s3:PutObjectTagging
        DeleteObject                        Object   s3:DeleteObject
        DeleteObjectTagging                 Object   s3:DeleteObjectTagging
        AbortMultipartUpload                Object   s3:AbortMultipartUpload
        ListParts                           Object   s3:ListMultipartUploadParts
    ";

    #[test]
    fn operations_need_the_actions_of_the_reference() {
        for line in REFERENCE.lines().map(str::trim).filter(|line| !line.is_empty()) {
            let mut words = line.split_whitespace();
            let (operation, on) = (words.next().unwrap_or_default(), words.next().unwrap_or_default());
            let (scope, actions) = needed(operation).unwrap_or_else(|| panic!("{operation} is unknown"));
            assert_eq!(format!("{scope:?}"), on, "{operation}");
            assert_eq!(actions, words.collect::<Vec<_>>(), "{operation}");
        }
        assert_eq!(needed("PutBucketPolicy"), None);
    }
}
