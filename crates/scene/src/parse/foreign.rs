//! Files that are no scene scripts: pictures, models and other data.

/// The number of errors that are described of a text in another language.
pub(super) const DESCRIBED: usize = 10;

/// The bytes at the start of a file in which a zero byte shows that it is no text.
const LOOKED_AT: usize = 8 << 10;

/// Text that is not UTF-8, but may contain a script.
pub(super) const UTF_16: &str = "UTF-16 text";

/// The first bytes of files that people mistake for scripts, with their position.
const MARKS: &[(usize, &[u8], &str)] = &[
    (0, b"GIF8", "a GIF image"),
    (0, b"\x89PNG", "a PNG image"),
    (0, b"\xff\xd8\xff", "a JPEG image"),
    (8, b"WEBP", "a WebP image"),
    (0, b"II*\0", "a TIFF image"),
    (0, b"MM\0*", "a TIFF image"),
    (0, b"%PDF-", "a PDF document"),
    (0, b"PK\x03\x04", "a ZIP archive"),
    (0, b"\x1f\x8b", "a compressed file"),
    (0, b"YUV4MPEG2", "a video"),
    (4, b"ftyp", "a video"),
    (0, b"glTF", "a glTF model"),
    (0, b"ply\n", "a PLY model"),
    (0, b"ply\r\n", "a PLY model"),
    (0, b"BLENDER", "a Blender file"),
    (0, b"\x7fELF", "a program"),
];

/// Words that begin the lines of a Wavefront OBJ. Commands of a script begin with a capital.
const OF_OBJ: [&[u8]; 10] = [b"v", b"vn", b"vt", b"vp", b"f", b"o", b"g", b"s", b"mtllib", b"usemtl"];

/// Returns the other format that a text probably has, from its first line that is neither empty nor a comment.
fn other_text(bytes: &[u8]) -> Option<&'static str> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let lines = bytes[..bytes.len().min(LOOKED_AT)].split(|byte| *byte == b'\n').map(<[u8]>::trim_ascii);
    let mut words = lines
        .filter(|line| !line.is_empty() && !line.starts_with(b"#"))
        .filter_map(|line| line.split(|byte| matches!(byte, b' ' | b'\t')).next());
    match words.next()? {
        word if OF_OBJ.contains(&word) && words.any(|word| word == b"v") || word == b"v" => {
            Some("an OBJ model")
        }
        b"solid" => Some("an STL model"),
        word if word.starts_with(b"{") || word.starts_with(b"[") => Some("JSON"),
        word if word.starts_with(b"<") => Some("XML or HTML"),
        _ => None,
    }
}

/// Returns the kind of a file that is no text, or a text in another format.
pub(super) fn not_text(bytes: &[u8]) -> Option<&'static str> {
    let has =
        |(at, mark, _): &&(usize, &[u8], _)| bytes.get(*at..).is_some_and(|rest| rest.starts_with(mark));
    if let Some((.., what)) = MARKS.iter().find(has) {
        return Some(what);
    }
    let start = &bytes[..bytes.len().min(LOOKED_AT)];
    let zeros = |parity: usize| start.iter().skip(parity).step_by(2).filter(|byte| **byte == 0).count();
    let (even, odd) = (zeros(0), zeros(1));
    match even + odd {
        0 => other_text(bytes),
        // In UTF-16, one byte of each letter of a script is 0.
        zeros if zeros == even.max(odd) && zeros >= start.len() / 3 => Some(UTF_16),
        _ => Some("a binary file"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_no_text_is_named() {
        let check = |bytes: &[u8], expect| assert_eq!(not_text(bytes), expect, "{bytes:?}");
        check(b"", None);
        check(b"Screen 4 3\nTrace", None);
        check("Screen 4 3 # \u{e9}".as_bytes(), None);
        check(b"GIF89a", Some("a GIF image"));
        check(b"RIFF\x08\0\0\0WEBPVP8 ", Some("a WebP image"));
        check(b"\0\0\0\x18ftypmp42", Some("a video"));
        check(b"S\0c\0r\0e\0", Some(UTF_16));
        check(b"Screen 4 3\n\0", Some("a binary file"));
        check(b"# by a modeller\n\no ball\nv 0 0 0\nv 1 0 0\n", Some("an OBJ model"));
        check(b"v 0 0 0\n", Some("an OBJ model"));
        check(b"f 1 2 3\nSphere 1\n", None);
        check(b"solid cube\n  facet normal 0 0 1\n", Some("an STL model"));
        check(b"{\n  \"fps\": 25\n}", Some("JSON"));
        check(b"<svg>", Some("XML or HTML"));
    }
}
