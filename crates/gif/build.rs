//! Computes a fingerprint of the encoder: a hash of its sources and of the versions of its dependencies. A
//! suspended animation carries it.
//!
//! Only the encoder that wrote a state may continue it. Thanks to the hash there is no version number to remember.

use std::path::Path;
use std::{fs, io};

/// FNV-1a, 64 bits.
const OFFSET: u64 = 0xcbf2_9ce4_8422_2325;
const PRIME: u64 = 0x0000_0100_0000_01b3;

fn main() -> io::Result<()> {
    let sources = Path::new("src");
    println!("cargo::rerun-if-changed={}", sources.display());
    // A published package has its own; in the repository there is one for all crates.
    let versions = ["Cargo.lock", "../../Cargo.lock"].map(Path::new).into_iter().find(|file| file.exists());
    let mut files = fs::read_dir(sources)?.map(|entry| Ok(entry?.path())).collect::<io::Result<Vec<_>>>()?;
    files.sort();
    if let Some(versions) = versions {
        println!("cargo::rerun-if-changed={}", versions.display());
        files.push(versions.into());
    }
    let mut hash = OFFSET;
    for file in files {
        let name = file.file_name().unwrap_or_default().as_encoded_bytes();
        // Git may have written the lines with carriage returns.
        let text = fs::read(&file)?;
        for byte in name.iter().chain(text.iter().filter(|byte| **byte != b'\r')) {
            hash = (hash ^ u64::from(*byte)).wrapping_mul(PRIME);
        }
    }
    println!("cargo::rustc-env=RAYFOLD_GIF_SOURCES={hash}");
    Ok(())
}
