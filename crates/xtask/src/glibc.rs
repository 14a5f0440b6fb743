//! Reads from a binary what it requires of the system's C library.
//!
//! A program that was linked against a newer glibc than Lambda's does not start there, and this shows only after
//! deployment. The dynamic section lists the libraries that the loader must find. The version table lists the versions
//! of their symbols.

use object::elf::FileHeader64;
use object::read::elf::{Dyn, FileHeader, SectionHeader};
use object::{Endianness, elf};

/// The glibc version of Amazon Linux 2023, the system of `provided.al2023`.
pub(crate) const AMAZON_LINUX_2023: Version = Version(2, 34);

/// The libraries that come with every glibc, by the start of their names. The loader's name differs by architecture.
const OF_GLIBC: [&str; 6] =
    ["libc.so.6", "libm.so.6", "libdl.so.2", "libpthread.so.0", "librt.so.1", "ld-linux-"];

/// A glibc version, as in `GLIBC_2.34`. A third number, which only ancient symbols have, is ignored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Version(pub(crate) u32, pub(crate) u32);

impl std::fmt::Display for Version {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}.{}", self.0, self.1)
    }
}

/// The reason why a binary would not start.
#[derive(Debug, PartialEq, thiserror::Error)]
pub(crate) enum Error {
    /// The file cannot be parsed.
    #[error("not a 64-bit ELF program")]
    Format(#[source] object::Error),
    /// The program was linked for a newer system.
    #[error("needs {0}, and Amazon Linux 2023 has glibc {AMAZON_LINUX_2023}")]
    TooNew(String),
    /// The program needs a library or symbols that are not part of glibc.
    #[error("needs {0}, which is not part of glibc")]
    Foreign(String),
}

/// The libraries and symbols that the loader must find.
#[derive(Debug, Default)]
pub(crate) struct Needs {
    /// Names of shared libraries: `libc.so.6`.
    libraries: Vec<String>,
    /// Versions of their symbols: `GLIBC_2.34`.
    versions: Vec<String>,
}

impl Needs {
    /// Reads the requirements of the program `bytes`.
    ///
    /// # Errors
    /// [`Error::Format`] if the program cannot be parsed.
    pub(crate) fn of(bytes: &[u8]) -> Result<Self, Error> {
        read(bytes).map_err(Error::Format)
    }

    /// Returns the newest glibc that the program needs, at most Amazon Linux 2023's, or `None` if it needs none.
    ///
    /// # Errors
    /// Returns the reason if the program would not start there.
    pub(crate) fn newest(&self) -> Result<Option<Version>, Error> {
        if let Some(foreign) =
            self.libraries.iter().find(|name| !OF_GLIBC.iter().any(|own| name.starts_with(own)))
        {
            return Err(Error::Foreign(foreign.clone()));
        }
        let mut newest = None;
        for symbol in &self.versions {
            let version = glibc(symbol).ok_or_else(|| Error::Foreign(symbol.clone()))?;
            if version > AMAZON_LINUX_2023 {
                return Err(Error::TooNew(symbol.clone()));
            }
            newest = newest.max(Some(version));
        }
        Ok(newest)
    }
}

fn glibc(symbol: &str) -> Option<Version> {
    let mut parts = symbol.strip_prefix("GLIBC_")?.split('.').map(str::parse);
    Some(Version(parts.next()?.ok()?, parts.next()?.ok()?))
}

fn read(bytes: &[u8]) -> object::Result<Needs> {
    let header = FileHeader64::<Endianness>::parse(bytes)?;
    let endian = header.endian()?;
    let sections = header.sections(endian, bytes)?;
    let text = |name: &[u8]| String::from_utf8_lossy(name).into_owned();
    let mut needs = Needs::default();
    if let Some((entries, strings)) = sections.dynamic(endian, bytes)? {
        let strings = sections.strings(endian, bytes, strings)?;
        for entry in entries {
            if entry.tag(endian) == elf::DT_NEEDED {
                needs.libraries.push(text(entry.string(endian, strings)?));
            }
        }
    }
    for section in sections.iter() {
        if let Some((mut libraries, strings)) = section.gnu_verneed(endian, bytes)? {
            let strings = sections.strings(endian, bytes, strings)?;
            while let Some((_, mut versions)) = libraries.next()? {
                while let Some(version) = versions.next()? {
                    needs.versions.push(text(version.name(endian, strings)?));
                }
            }
        }
    }
    Ok(needs)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn judge(libraries: &[&str], versions: &[&str]) -> Result<Option<Version>, Error> {
        let own = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
        Needs { libraries: own(libraries), versions: own(versions) }.newest()
    }

    #[test]
    fn the_newest_version_counts_by_number_not_by_text() {
        let newest = judge(&["libc.so.6"], &["GLIBC_2.2.5", "GLIBC_2.34", "GLIBC_2.4"]);
        assert_eq!(newest, Ok(Some(Version(2, 34))));
    }

    #[test]
    fn a_static_program_needs_nothing() {
        assert_eq!(judge(&[], &[]), Ok(None));
    }

    #[test]
    fn one_version_too_new_is_refused() {
        assert_eq!(
            judge(&["libc.so.6"], &["GLIBC_2.4", "GLIBC_2.35"]),
            Err(Error::TooNew("GLIBC_2.35".into()))
        );
        assert_eq!(judge(&["libc.so.6"], &["GLIBC_3.0"]), Err(Error::TooNew("GLIBC_3.0".into())));
    }

    #[test]
    fn other_libraries_and_their_symbols_are_refused() {
        assert_eq!(judge(&["libc.so.6", "libssl.so.3"], &[]), Err(Error::Foreign("libssl.so.3".into())));
        assert_eq!(judge(&["libc.so.6"], &["GCC_3.0"]), Err(Error::Foreign("GCC_3.0".into())));
        assert_eq!(judge(&["libc.so.6"], &["GLIBC_PRIVATE"]), Err(Error::Foreign("GLIBC_PRIVATE".into())));
    }

    #[test]
    fn the_loader_counts_as_part_of_glibc_on_either_architecture() {
        assert_eq!(judge(&["ld-linux-x86-64.so.2", "ld-linux-aarch64.so.1"], &[]), Ok(None));
    }

    #[test]
    #[cfg(all(target_os = "linux", target_env = "gnu", target_pointer_width = "64"))]
    fn a_program_is_read_for_its_libraries_and_versions() {
        let own = std::fs::read(std::env::current_exe().unwrap()).unwrap();
        let needs = Needs::of(&own).unwrap();
        assert!(needs.libraries.iter().any(|name| name == "libc.so.6"), "{needs:?}");
        assert!(needs.versions.iter().any(|name| glibc(name) >= Some(Version(2, 14))), "{needs:?}");
    }

    #[test]
    fn what_is_no_program_is_said_to_be_none() {
        assert!(matches!(Needs::of(b"#!/bin/sh\n"), Err(Error::Format(_))));
    }
}
