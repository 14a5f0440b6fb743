//! The S3 servers that are separate programs.

use std::fmt;

/// An S3 server that is a separate program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Program {
    /// The name of the server for messages.
    pub name: &'static str,
    /// The name of the binary.
    pub binary: &'static str,
    /// The environment variable with the path of the binary.
    pub variable: &'static str,
    /// The Go package that is built.
    pub package: &'static str,
    /// The version that is built.
    pub version: &'static str,
    /// The oldest version of Go that builds it.
    pub(crate) go: (u32, u32),
}

/// The community edition, which is archived; module proxies may refuse it. The version is its last commit; older ones
/// mishandle `If-Match` on a missing key.
pub(crate) static MINIO: Program = Program {
    name: "MinIO",
    binary: "minio",
    variable: "RAYFOLD_MINIO",
    package: "github.com/minio/minio",
    version: "v0.0.0-20260212201848-7aac2a2c5b7c",
    go: (1, 25),
};

/// SeaweedFS, with its master, volume server, filer and S3 gateway in one program.
pub(crate) static SEAWEEDFS: Program = Program {
    name: "SeaweedFS",
    binary: "weed",
    variable: "RAYFOLD_SEAWEEDFS",
    package: "github.com/seaweedfs/seaweedfs/weed",
    version: "v0.0.0-20261109003541-7506e5f91cd6",
    go: (1, 26),
};

impl fmt::Display for Program {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}
