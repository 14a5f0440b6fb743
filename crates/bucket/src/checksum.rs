//! Checksums as S3 computes them: of a stream of bytes, and of an upload from its parts.
//!
//! Every object has a checksum: the one that the client chose, or CRC-64/NVME. A *full object* checksum is
//! computed from the bytes. A *composite* checksum is computed from the checksums of the parts, and is
//! followed by their count.
//! <https://docs.aws.amazon.com/AmazonS3/latest/userguide/checking-object-integrity.html>

use crc_fast::{CrcAlgorithm, checksum_combine};
use s3s::crypto::{Checksum as _, Crc32, Crc32c, Crc64Nvme, Md5, Sha1, Sha256};
use serde::{Deserialize, Serialize};

/// The algorithm of a checksum.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "UPPERCASE")]
pub(crate) enum Algorithm {
    Crc32,
    Crc32c,
    Crc64nvme,
    Sha1,
    Sha256,
}

/// The input of a checksum: the bytes of the object, or the checksums of its parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
pub(crate) enum Kind {
    FullObject,
    Composite,
}

/// A checksum in base64, as headers have it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Checksum {
    pub(crate) algorithm: Algorithm,
    pub(crate) kind: Kind,
    pub(crate) value: String,
}

impl Algorithm {
    pub(crate) const ALL: [Self; 5] = [Self::Crc32, Self::Crc32c, Self::Crc64nvme, Self::Sha1, Self::Sha256];

    /// Returns S3's name of the algorithm.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Crc32 => "CRC32",
            Self::Crc32c => "CRC32C",
            Self::Crc64nvme => "CRC64NVME",
            Self::Sha1 => "SHA1",
            Self::Sha256 => "SHA256",
        }
    }

    /// Returns the name of the header for the checksum.
    pub(crate) fn header(self) -> &'static str {
        match self {
            Self::Crc32 => "x-amz-checksum-crc32",
            Self::Crc32c => "x-amz-checksum-crc32c",
            Self::Crc64nvme => "x-amz-checksum-crc64nvme",
            Self::Sha1 => "x-amz-checksum-sha1",
            Self::Sha256 => "x-amz-checksum-sha256",
        }
    }

    /// Computes the checksum of bytes.
    pub(crate) fn of(self, bytes: &[u8]) -> String {
        let mut hasher = Hasher::new(self);
        hasher.update(bytes);
        base64(&hasher.finish())
    }

    pub(crate) fn of_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|algorithm| algorithm.name().eq_ignore_ascii_case(name))
    }

    /// Returns the length of the checksum in bytes.
    pub(crate) fn bytes(self) -> usize {
        match self {
            Self::Crc32 | Self::Crc32c => 4,
            Self::Crc64nvme => 8,
            Self::Sha1 => 20,
            Self::Sha256 => 32,
        }
    }

    /// Returns the kind of an upload in parts if the client does not choose one.
    pub(crate) fn default_kind(self) -> Kind {
        match self {
            Self::Crc64nvme => Kind::FullObject,
            Self::Crc32 | Self::Crc32c | Self::Sha1 | Self::Sha256 => Kind::Composite,
        }
    }

    /// Returns whether an upload in parts may have this kind.
    pub(crate) fn allows(self, kind: Kind) -> bool {
        match (self, kind) {
            (Self::Crc64nvme, Kind::Composite) | (Self::Sha1 | Self::Sha256, Kind::FullObject) => false,
            (Self::Crc32 | Self::Crc32c, Kind::FullObject | Kind::Composite)
            | (Self::Crc64nvme, Kind::FullObject)
            | (Self::Sha1 | Self::Sha256, Kind::Composite) => true,
        }
    }
}

impl Kind {
    /// Returns S3's name of the kind.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::FullObject => "FULL_OBJECT",
            Self::Composite => "COMPOSITE",
        }
    }
}

/// A computation of an ETag and a checksum of a stream of bytes.
pub(crate) struct Digests {
    md5: Md5,
    algorithm: Algorithm,
    hasher: Hasher,
}

enum Hasher {
    Crc32(Crc32),
    Crc32c(Crc32c),
    Crc64nvme(Crc64Nvme),
    Sha1(Sha1),
    Sha256(Sha256),
}

impl Digests {
    pub(crate) fn new(algorithm: Algorithm) -> Self {
        Self { md5: Md5::new(), algorithm, hasher: Hasher::new(algorithm) }
    }

    pub(crate) fn update(&mut self, bytes: &[u8]) {
        self.md5.update(bytes);
        self.hasher.update(bytes);
    }

    /// Returns the MD5 and the checksum.
    pub(crate) fn finish(self) -> ([u8; 16], Checksum) {
        let value = base64(&self.hasher.finish());
        (self.md5.finalize(), Checksum { algorithm: self.algorithm, kind: Kind::FullObject, value })
    }
}

/// A comparison of a stream of bytes with their stored checksum.
pub(crate) struct Comparison {
    hasher: Hasher,
    expected: String,
}

impl Comparison {
    /// Returns `None` for a checksum that is not computed from the bytes themselves.
    pub(crate) fn with(stored: &Checksum) -> Option<Self> {
        let hasher = Hasher::new(stored.algorithm);
        (stored.kind == Kind::FullObject).then(|| Self { hasher, expected: stored.value.clone() })
    }

    pub(crate) fn update(&mut self, bytes: &[u8]) {
        self.hasher.update(bytes);
    }

    /// Returns whether the bytes so far match the stored checksum.
    pub(crate) fn matches(self) -> bool {
        base64(&self.hasher.finish()) == self.expected
    }
}

impl Hasher {
    fn new(algorithm: Algorithm) -> Self {
        match algorithm {
            Algorithm::Crc32 => Self::Crc32(Crc32::new()),
            Algorithm::Crc32c => Self::Crc32c(Crc32c::new()),
            Algorithm::Crc64nvme => Self::Crc64nvme(Crc64Nvme::new()),
            Algorithm::Sha1 => Self::Sha1(Sha1::new()),
            Algorithm::Sha256 => Self::Sha256(Sha256::new()),
        }
    }

    fn update(&mut self, bytes: &[u8]) {
        match self {
            Self::Crc32(hasher) => hasher.update(bytes),
            Self::Crc32c(hasher) => hasher.update(bytes),
            Self::Crc64nvme(hasher) => hasher.update(bytes),
            Self::Sha1(hasher) => hasher.update(bytes),
            Self::Sha256(hasher) => hasher.update(bytes),
        }
    }

    fn finish(self) -> Vec<u8> {
        match self {
            Self::Crc32(hasher) => hasher.finalize().to_vec(),
            Self::Crc32c(hasher) => hasher.finalize().to_vec(),
            Self::Crc64nvme(hasher) => hasher.finalize().to_vec(),
            Self::Sha1(hasher) => hasher.finalize().to_vec(),
            Self::Sha256(hasher) => hasher.finalize().to_vec(),
        }
    }
}

/// Computes the checksum of an object from the sizes and checksums of its parts. Returns `None` if a part has another
/// algorithm, or if the algorithm does not allow the kind.
pub(crate) fn of_parts(algorithm: Algorithm, kind: Kind, parts: &[(u64, &Checksum)]) -> Option<Checksum> {
    if !algorithm.allows(kind) || parts.iter().any(|(_, part)| part.algorithm != algorithm) {
        return None;
    }
    let value = match kind {
        Kind::Composite => {
            let mut hasher = Hasher::new(algorithm);
            for (_, part) in parts {
                hasher.update(&bytes_of(&part.value)?);
            }
            format!("{}-{}", base64(&hasher.finish()), parts.len())
        }
        Kind::FullObject => {
            let (crc, width) = match algorithm {
                Algorithm::Crc32 => (CrcAlgorithm::Crc32IsoHdlc, 4),
                Algorithm::Crc32c => (CrcAlgorithm::Crc32Iscsi, 4),
                Algorithm::Crc64nvme => (CrcAlgorithm::Crc64Nvme, 8),
                Algorithm::Sha1 | Algorithm::Sha256 => return None,
            };
            let mut whole = None;
            for (size, part) in parts {
                let bytes = bytes_of(&part.value)?;
                let part = bytes.iter().fold(0, |number, byte| number << 8 | u64::from(*byte));
                whole = Some(whole.map_or(part, |before| checksum_combine(crc, before, part, *size)));
            }
            base64(&whole?.to_be_bytes()[8 - width..])
        }
    };
    Some(Checksum { algorithm, kind, value })
}

pub(crate) fn base64(bytes: &[u8]) -> String {
    base64_simd::STANDARD.encode_to_string(bytes)
}

pub(crate) fn bytes_of(text: &str) -> Option<Vec<u8>> {
    base64_simd::STANDARD.decode_to_vec(text).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checksum(algorithm: Algorithm, bytes: &[u8]) -> Checksum {
        let mut digests = Digests::new(algorithm);
        digests.update(bytes);
        digests.finish().1
    }

    #[test]
    fn checksums_of_known_bytes() {
        // The published check values of each algorithm for "123456789".
        for (algorithm, hex) in [
            (Algorithm::Crc32, "cbf43926"),
            (Algorithm::Crc32c, "e3069283"),
            (Algorithm::Crc64nvme, "ae8b14860a799888"),
            (Algorithm::Sha1, "f7c3bc1d808e04732adf679965ccc34ca7ae3441"),
            (Algorithm::Sha256, "15e2b0d3c33891ebb0f1ef609ec419420c20e320ce94c65fbc8c3312448eb225"),
        ] {
            let value = bytes_of(&checksum(algorithm, b"123456789").value).unwrap();
            let shown: String = value.iter().map(|byte| format!("{byte:02x}")).collect();
            assert_eq!(shown, hex, "{algorithm:?}");
            assert_eq!(value.len(), algorithm.bytes());
        }
    }

    #[test]
    fn a_full_checksum_of_parts_is_that_of_the_whole() {
        let whole: Vec<u8> = (0..100_000_u32).flat_map(u32::to_le_bytes).collect();
        for algorithm in [Algorithm::Crc32, Algorithm::Crc32c, Algorithm::Crc64nvme] {
            let cuts = [0, 1, 70_000, 70_000, 399_999, 400_000];
            let parts: Vec<&[u8]> = cuts.windows(2).map(|cut| &whole[cut[0]..cut[1]]).collect();
            let sums: Vec<_> =
                parts.iter().map(|part| (part.len() as u64, checksum(algorithm, part))).collect();
            let sums: Vec<_> = sums.iter().map(|(size, sum)| (*size, sum)).collect();
            let combined = of_parts(algorithm, Kind::FullObject, &sums).unwrap();
            assert_eq!(combined.value, checksum(algorithm, &whole).value, "{algorithm:?}");
        }
    }

    #[test]
    fn a_composite_checksum_is_of_the_parts_checksums() {
        let parts = [checksum(Algorithm::Sha256, b"one"), checksum(Algorithm::Sha256, b"two")];
        let both = [bytes_of(&parts[0].value).unwrap(), bytes_of(&parts[1].value).unwrap()].concat();
        let combined = of_parts(Algorithm::Sha256, Kind::Composite, &[(3, &parts[0]), (3, &parts[1])]);
        assert_eq!(combined.unwrap().value, format!("{}-2", checksum(Algorithm::Sha256, &both).value));
        assert_eq!(of_parts(Algorithm::Sha256, Kind::FullObject, &[(3, &parts[0])]), None);
        assert_eq!(of_parts(Algorithm::Sha1, Kind::Composite, &[(3, &parts[0])]), None);
    }
}
