//! Files as one sequence of bytes, which workers send to each other: for each file the length of its name, its name,
//! the length of its content, its content. Lengths are 32-bit little-endian numbers.

/// A file: its name and its content.
pub type File = (String, Vec<u8>);

/// Returns files as one run of bytes.
pub fn packet<'a>(files: impl IntoIterator<Item = (&'a str, &'a [u8])>) -> Vec<u8> {
    let mut bytes = Vec::new();
    for (name, content) in files {
        for part in [name.as_bytes(), content] {
            bytes.extend_from_slice(&(part.len() as u32).to_le_bytes());
            bytes.extend_from_slice(part);
        }
    }
    bytes
}

/// Returns the files in a sequence of bytes, or `None` if it is cut off.
pub fn files_of(mut bytes: &[u8]) -> Option<Vec<File>> {
    let mut next = || {
        let (length, rest) = bytes.split_first_chunk()?;
        let (part, rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
        bytes = rest;
        Some((part.to_vec(), rest.is_empty()))
    };
    let mut files = Vec::new();
    loop {
        let Some((name, _)) = next() else { return files.is_empty().then_some(files) };
        let (content, is_last) = next()?;
        files.push((String::from_utf8(name).ok()?, content));
        if is_last {
            return Some(files);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_come_out_as_they_went_in() {
        let files = vec![("a.txt".to_owned(), b"one".to_vec()), ("\u{e4}".to_owned(), Vec::new())];
        let bytes = packet(files.iter().map(|(name, content)| (name.as_str(), content.as_slice())));
        assert_eq!(files_of(&bytes), Some(files));
        assert_eq!(files_of(&bytes[..bytes.len() - 1]), None);
        assert_eq!(files_of(&[]), Some(Vec::new()));
    }
}
