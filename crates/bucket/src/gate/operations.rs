//! The table of supported operations, with everything that their requests may contain.

/// The kind of resource of an operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum On {
    Root,
    Bucket,
    Object,
}

impl On {
    /// Returns the kind in words.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Root => "the store",
            Self::Bucket => "a bucket",
            Self::Object => "an object",
        }
    }
}

/// The body of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Payload {
    None,
    /// The bytes of an object or of a part.
    Bytes,
    /// XML with these elements under its root.
    Xml(&'static [&'static str]),
    /// A browser's form with a file.
    Form,
}

/// An operation of S3.
#[derive(Debug)]
pub(super) struct Operation {
    pub(super) name: &'static str,
    pub(super) method: &'static str,
    pub(super) on: On,
    /// The parameters and headers (`x-amz-…`) that distinguish it from other operations of its method.
    pub(super) chosen_by: &'static [&'static str],
    /// The other parameters of the query that are allowed.
    pub(super) query: &'static [&'static str],
    /// The other headers that are allowed. Any header that changes the meaning of a request
    /// ([`super::values::matters`]) must be listed.
    pub(super) headers: &'static [&'static str],
    pub(super) payload: Payload,
    /// Whether S3 requires a digest of the body. (Its model also requires one for access lists, but
    /// clients send those without.)
    pub(super) needs_digest: bool,
}

/// The headers of an operation that writes an object.
const WRITTEN: &[&str] = &[
    "x-amz-acl",
    "x-amz-meta-",
    "x-amz-server-side-encryption",
    "x-amz-server-side-encryption-bucket-key-enabled",
    "x-amz-storage-class",
    "x-amz-tagging",
];

const RESPONSE: [&str; 6] = [
    "response-cache-control",
    "response-content-disposition",
    "response-content-encoding",
    "response-content-language",
    "response-content-type",
    "response-expires",
];

const READ_QUERY: &[&str] = &[
    RESPONSE[0],
    RESPONSE[1],
    RESPONSE[2],
    RESPONSE[3],
    RESPONSE[4],
    RESPONSE[5],
    "versionId",
    "partNumber",
];

const READ_HEADERS: &[&str] = &[
    "if-match",
    "if-modified-since",
    "if-none-match",
    "if-unmodified-since",
    "if-range",
    "range",
    "x-amz-checksum-mode",
    // The transfer encodings that the client accepts. None is used. Clients for Java send this header.
    "x-amz-te",
];

/// A parameter that asks MinIO for more in a listing, and that S3 ignores. `mc` sends it to both.
const MINIO_METADATA: &str = "metadata";

const SOURCE: [&str; 5] = [
    "x-amz-copy-source-if-match",
    "x-amz-copy-source-if-modified-since",
    "x-amz-copy-source-if-none-match",
    "x-amz-copy-source-if-unmodified-since",
    "x-amz-source-expected-bucket-owner",
];

const ACL: Payload = Payload::Xml(&[
    "AccessControlList",
    "AccessControlList/Grant",
    "AccessControlList/Grant/Grantee",
    "AccessControlList/Grant/Grantee/DisplayName",
    "AccessControlList/Grant/Grantee/EmailAddress",
    "AccessControlList/Grant/Grantee/ID",
    "AccessControlList/Grant/Grantee/URI",
    "AccessControlList/Grant/Permission",
    "Owner",
    "Owner/DisplayName",
    "Owner/ID",
]);

/// The base of all entries, which an operation overrides where it differs.
const PLAIN: Operation = Operation {
    name: "",
    method: "GET",
    on: On::Bucket,
    chosen_by: &[],
    query: &[],
    headers: &[],
    payload: Payload::None,
    needs_digest: false,
};

/// Makes the entry of an operation that reads a configuration of a bucket.
const fn configuration(name: &'static str, chosen_by: &'static [&'static str]) -> Operation {
    Operation { name, chosen_by, ..PLAIN }
}

/// The operations that the store supports.
pub(super) const OPERATIONS: &[Operation] = &[
    Operation {
        name: "ListBuckets",
        on: On::Root,
        query: &["max-buckets", "continuation-token", "prefix", "bucket-region"],
        ..PLAIN
    },
    Operation {
        name: "CreateBucket",
        method: "PUT",
        headers: &["x-amz-acl", "x-amz-bucket-object-lock-enabled", "x-amz-object-ownership"],
        payload: Payload::Xml(&["LocationConstraint"]),
        ..PLAIN
    },
    Operation { name: "HeadBucket", method: "HEAD", ..PLAIN },
    Operation { name: "DeleteBucket", method: "DELETE", ..PLAIN },
    configuration("GetBucketLocation", &["location"]),
    configuration("GetBucketVersioning", &["versioning"]),
    configuration("GetBucketAcl", &["acl"]),
    configuration("GetBucketPolicy", &["policy"]),
    configuration("GetBucketCors", &["cors"]),
    configuration("GetBucketLifecycleConfiguration", &["lifecycle"]),
    configuration("GetBucketTagging", &["tagging"]),
    configuration("GetBucketEncryption", &["encryption"]),
    configuration("GetObjectLockConfiguration", &["object-lock"]),
    configuration("GetBucketWebsite", &["website"]),
    configuration("GetBucketNotificationConfiguration", &["notification"]),
    Operation {
        name: "PutBucketAcl",
        method: "PUT",
        chosen_by: &["acl"],
        headers: &["x-amz-acl"],
        payload: ACL,
        ..PLAIN
    },
    Operation {
        name: "PutBucketCors",
        method: "PUT",
        chosen_by: &["cors"],
        payload: Payload::Xml(&[
            "CORSRule",
            "CORSRule/ID",
            "CORSRule/AllowedHeader",
            "CORSRule/AllowedMethod",
            "CORSRule/AllowedOrigin",
            "CORSRule/ExposeHeader",
            "CORSRule/MaxAgeSeconds",
        ]),
        needs_digest: true,
        ..PLAIN
    },
    Operation { name: "DeleteBucketCors", method: "DELETE", chosen_by: &["cors"], ..PLAIN },
    Operation {
        name: "PutBucketNotificationConfiguration",
        method: "PUT",
        chosen_by: &["notification"],
        headers: &["x-amz-skip-destination-validation"],
        payload: Payload::Xml(&[
            "QueueConfiguration",
            "QueueConfiguration/Id",
            "QueueConfiguration/Queue",
            "QueueConfiguration/Event",
            "QueueConfiguration/Filter",
            "QueueConfiguration/Filter/S3Key",
            "QueueConfiguration/Filter/S3Key/FilterRule",
            "QueueConfiguration/Filter/S3Key/FilterRule/Name",
            "QueueConfiguration/Filter/S3Key/FilterRule/Value",
        ]),
        ..PLAIN
    },
    Operation {
        name: "ListObjects",
        query: &["delimiter", "encoding-type", "marker", "max-keys", "prefix"],
        ..PLAIN
    },
    Operation {
        name: "ListObjectsV2",
        chosen_by: &["list-type"],
        query: &[
            "delimiter",
            "encoding-type",
            "max-keys",
            "prefix",
            "continuation-token",
            "fetch-owner",
            "start-after",
            MINIO_METADATA,
        ],
        ..PLAIN
    },
    Operation {
        name: "ListObjectVersions",
        chosen_by: &["versions"],
        query: &[
            "delimiter",
            "encoding-type",
            "key-marker",
            "max-keys",
            "prefix",
            "version-id-marker",
            MINIO_METADATA,
        ],
        ..PLAIN
    },
    Operation {
        name: "ListMultipartUploads",
        chosen_by: &["uploads"],
        query: &["delimiter", "encoding-type", "key-marker", "max-uploads", "prefix", "upload-id-marker"],
        ..PLAIN
    },
    Operation {
        name: "DeleteObjects",
        method: "POST",
        chosen_by: &["delete"],
        headers: &["x-amz-bypass-governance-retention"],
        payload: Payload::Xml(&["Object", "Object/Key", "Object/VersionId", "Object/ETag", "Quiet"]),
        needs_digest: true,
        ..PLAIN
    },
    Operation { name: "PostObject", method: "POST", payload: Payload::Form, ..PLAIN },
    Operation { name: "GetObject", on: On::Object, query: READ_QUERY, headers: READ_HEADERS, ..PLAIN },
    Operation {
        name: "HeadObject",
        method: "HEAD",
        on: On::Object,
        query: READ_QUERY,
        headers: READ_HEADERS,
        ..PLAIN
    },
    Operation {
        name: "GetObjectAttributes",
        on: On::Object,
        chosen_by: &["attributes"],
        query: &["versionId"],
        headers: &["x-amz-max-parts", "x-amz-part-number-marker", "x-amz-object-attributes"],
        ..PLAIN
    },
    Operation { name: "GetObjectAcl", on: On::Object, chosen_by: &["acl"], query: &["versionId"], ..PLAIN },
    Operation {
        name: "PutObjectAcl",
        method: "PUT",
        on: On::Object,
        chosen_by: &["acl"],
        query: &["versionId"],
        headers: &["x-amz-acl"],
        payload: ACL,
        ..PLAIN
    },
    Operation {
        name: "GetObjectTagging",
        on: On::Object,
        chosen_by: &["tagging"],
        query: &["versionId"],
        ..PLAIN
    },
    Operation {
        name: "PutObject",
        method: "PUT",
        on: On::Object,
        headers: &[
            WRITTEN[0],
            WRITTEN[1],
            WRITTEN[2],
            WRITTEN[3],
            WRITTEN[4],
            WRITTEN[5],
            "if-match",
            "if-none-match",
        ],
        payload: Payload::Bytes,
        ..PLAIN
    },
    Operation {
        name: "CopyObject",
        method: "PUT",
        on: On::Object,
        chosen_by: &["x-amz-copy-source"],
        headers: &[
            WRITTEN[0],
            WRITTEN[1],
            WRITTEN[2],
            WRITTEN[3],
            WRITTEN[4],
            WRITTEN[5],
            SOURCE[0],
            SOURCE[1],
            SOURCE[2],
            SOURCE[3],
            SOURCE[4],
            "if-match",
            "if-none-match",
            "x-amz-checksum-algorithm",
            "x-amz-metadata-directive",
            "x-amz-tagging-directive",
        ],
        ..PLAIN
    },
    Operation {
        name: "DeleteObject",
        method: "DELETE",
        on: On::Object,
        query: &["versionId"],
        headers: &["if-match", "x-amz-bypass-governance-retention"],
        ..PLAIN
    },
    Operation {
        name: "CreateMultipartUpload",
        method: "POST",
        on: On::Object,
        chosen_by: &["uploads"],
        headers: &[
            WRITTEN[0],
            WRITTEN[1],
            WRITTEN[2],
            WRITTEN[3],
            WRITTEN[4],
            WRITTEN[5],
            "x-amz-checksum-algorithm",
            "x-amz-checksum-type",
        ],
        ..PLAIN
    },
    Operation {
        name: "UploadPart",
        method: "PUT",
        on: On::Object,
        chosen_by: &["partNumber", "uploadId"],
        payload: Payload::Bytes,
        ..PLAIN
    },
    Operation {
        name: "UploadPartCopy",
        method: "PUT",
        on: On::Object,
        chosen_by: &["partNumber", "uploadId", "x-amz-copy-source"],
        headers: &[SOURCE[0], SOURCE[1], SOURCE[2], SOURCE[3], SOURCE[4], "x-amz-copy-source-range"],
        ..PLAIN
    },
    Operation {
        name: "CompleteMultipartUpload",
        method: "POST",
        on: On::Object,
        chosen_by: &["uploadId"],
        headers: &["if-match", "if-none-match", "x-amz-checksum-type", "x-amz-mp-object-size"],
        payload: Payload::Xml(&[
            "Part",
            "Part/ETag",
            "Part/PartNumber",
            "Part/ChecksumCRC32",
            "Part/ChecksumCRC32C",
            "Part/ChecksumCRC64NVME",
            "Part/ChecksumSHA1",
            "Part/ChecksumSHA256",
        ]),
        ..PLAIN
    },
    Operation {
        name: "AbortMultipartUpload",
        method: "DELETE",
        on: On::Object,
        chosen_by: &["uploadId"],
        ..PLAIN
    },
    Operation {
        name: "ListParts",
        on: On::Object,
        chosen_by: &["uploadId"],
        query: &["max-parts", "part-number-marker"],
        ..PLAIN
    },
];
