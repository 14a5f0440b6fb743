//! Files appear whole or not at all, at their requested path, and with their former mode and owner.

use super::*;

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn join(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn count(&self) -> usize {
        self.0.path().read_dir().unwrap().count()
    }
}

fn text(path: impl AsRef<Path>) -> String {
    std::fs::read_to_string(path).unwrap()
}

#[test]
fn an_unfinished_file_leaves_the_old_one_and_no_litter() {
    let folder = Folder::new();
    let path = folder.join("a.gif");
    std::fs::write(&path, "old").unwrap();
    let mut out = OutputFile::create(&path).unwrap();
    out.write_all(b"new").unwrap();
    assert_eq!(folder.count(), 2);
    drop(out);
    assert_eq!((text(&path).as_str(), folder.count()), ("old", 1));
}

#[test]
fn a_finished_file_is_the_only_one() {
    let folder = Folder::new();
    let path = folder.join("a.gif");
    OutputFile::write(&path, b"new", true).unwrap();
    assert_eq!((text(&path).as_str(), folder.count()), ("new", 1));
}

#[test]
fn a_new_file_replaces_no_other() {
    let folder = Folder::new();
    let path = folder.join("a.txt");
    OutputFile::write_new(&path, b"first").unwrap();
    assert!(OutputFile::write_new(&path, b"second").unwrap_err().is_taken());
    assert_eq!((text(&path).as_str(), folder.count()), ("first", 1));
    // Another program writes the file between the check and the rename.
    let out = OutputFile::with(&folder.join("b.txt"), b"ours").unwrap();
    std::fs::write(folder.join("b.txt"), "theirs").unwrap();
    let put = |temporary: &Path, place: &Path| std::fs::hard_link(temporary, place);
    assert!(out.settle(false, put).unwrap_err().is_taken());
    assert_eq!((text(folder.join("b.txt")).as_str(), folder.count()), ("theirs", 2));
}

/// Hidden names that contained the file's own name left no room for it.
#[test]
fn names_of_every_length_that_the_system_takes_are_written() {
    let folder = Folder::new();
    for length in [1, 241, 242, 250, 255] {
        let path = folder.join(&"n".repeat(length));
        OutputFile::write(&path, b"new", false).unwrap_or_else(|error| panic!("{length}: {error:?}"));
        OutputFile::write(&path, b"again", false).unwrap();
        assert_eq!(text(&path), "again");
    }
    let too_long = probe(&folder.join(&"n".repeat(256))).unwrap_err();
    assert!(matches!(&too_long, Error::Io { .. }), "{too_long:?}");
    assert_eq!(folder.count(), 5);
}

/// In a container every run has the process id 1.
#[test]
fn what_another_run_left_under_an_old_name_blocks_nothing() {
    let folder = Folder::new();
    for number in 0..100 {
        std::fs::write(folder.join(&format!(".p.gif.{}-{number}.part", std::process::id())), "").unwrap();
    }
    OutputFile::write(folder.join("p.gif"), b"new", false).unwrap();
    assert_eq!(text(folder.join("p.gif")), "new");
}

#[test]
fn a_run_that_ends_at_once_leaves_nothing() {
    let folder = Folder::new();
    let out = OutputFile::create(folder.join("a.gif")).unwrap();
    std::fs::remove_file(unfinished().iter().find(|path| **path == out.temporary.0).unwrap()).unwrap();
    assert_eq!(folder.count(), 0);
    drop(out);
    let path = folder.join("b.gif");
    OutputFile::write(&path, b"", false).unwrap();
    assert!(!unfinished().iter().any(|path| path.starts_with(folder.0.path())), "{:?}", unfinished());
}

#[test]
fn folders_and_missing_folders_are_named() {
    let folder = Folder::new();
    let taken = OutputFile::create(folder.0.path()).unwrap_err();
    assert!(taken.to_string().ends_with("it is a folder"), "{taken}");
    let missing = OutputFile::create(folder.join("no/a.gif")).unwrap_err();
    assert!(matches!(&missing, Error::NoFolder { folder, .. } if folder.ends_with("no")), "{missing}");
    std::fs::write(folder.join("file"), "").unwrap();
    let below = OutputFile::create(folder.join("file/a.gif")).unwrap_err();
    assert!(below.to_string().ends_with("file is no folder"), "{below}");
}

#[cfg(unix)]
mod unix {
    use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};

    use super::*;

    fn mode(path: &Path) -> u32 {
        path.metadata().unwrap().mode() & 0o7777
    }

    #[test]
    fn a_link_is_followed() {
        let folder = Folder::new();
        let (real, link) = (folder.join("real.gif"), folder.join("link.gif"));
        std::fs::write(&real, "old").unwrap();
        symlink(&real, &link).unwrap();
        OutputFile::write(&link, b"new", false).unwrap();
        assert!(link.symlink_metadata().unwrap().is_symlink());
        assert_eq!(text(&real), "new");
    }

    /// Once the link itself was replaced by the file.
    #[test]
    fn links_to_a_file_that_is_not_there_yet_are_followed() {
        let folder = Folder::new();
        std::fs::create_dir(folder.join("out")).unwrap();
        symlink("other.gif", folder.join("out/link.gif")).unwrap();
        symlink("out/link.gif", folder.join("link.gif")).unwrap();
        OutputFile::write(folder.join("link.gif"), b"new", false).unwrap();
        assert_eq!(text(folder.join("out/other.gif")), "new");
        for link in ["link.gif", "out/link.gif"] {
            assert!(folder.join(link).symlink_metadata().unwrap().is_symlink(), "{link}");
        }
        symlink("no/such.gif", folder.join("lost.gif")).unwrap();
        let lost = probe(&folder.join("lost.gif")).unwrap_err();
        assert!(matches!(&lost, Error::NoFolder { folder, .. } if folder.ends_with("no")), "{lost:?}");
        symlink("b", folder.join("a")).unwrap();
        symlink("a", folder.join("b")).unwrap();
        let Error::Io { source, .. } = probe(&folder.join("a")).unwrap_err() else { panic!("a circle") };
        assert!(source.to_string().contains("circle"), "{source}");
    }

    #[test]
    fn a_file_keeps_its_mode() {
        let folder = Folder::new();
        let path = folder.join("a.gif");
        for wanted in [0o600, 0o640, 0o200, 0o755, 0o666] {
            std::fs::write(&path, "old").unwrap();
            std::fs::set_permissions(&path, PermissionsExt::from_mode(wanted)).unwrap();
            OutputFile::write(&path, b"new", false).unwrap();
            assert_eq!(mode(&path), wanted, "{wanted:o}");
            std::fs::remove_file(&path).unwrap();
        }
        std::fs::write(folder.join("plain"), "").unwrap();
        OutputFile::write(&path, b"new", false).unwrap();
        assert_eq!(mode(&path), mode(&folder.join("plain")), "a new one gets what all new files get");
    }

    #[test]
    fn a_file_is_secret_from_its_first_byte_on() {
        let folder = Folder::new();
        let path = folder.join("a.gif");
        std::fs::write(&path, "old").unwrap();
        std::fs::set_permissions(&path, PermissionsExt::from_mode(0o600)).unwrap();
        let out = OutputFile::create(&path).unwrap();
        assert_eq!(mode(&out.temporary.0), 0o600);
    }

    #[test]
    fn a_read_only_file_is_not_replaced() {
        let folder = Folder::new();
        let path = folder.join("a.gif");
        std::fs::write(&path, "old").unwrap();
        symlink("a.gif", folder.join("link.gif")).unwrap();
        for mode in [0o444, 0o400, 0o555] {
            std::fs::set_permissions(&path, PermissionsExt::from_mode(mode)).unwrap();
            for name in ["a.gif", "link.gif"] {
                let error = OutputFile::write(folder.join(name), b"new", false).unwrap_err();
                assert!(error.to_string().ends_with("it is read-only"), "{error}");
            }
        }
        assert_eq!((text(&path).as_str(), folder.count()), ("old", 2));
    }
}
