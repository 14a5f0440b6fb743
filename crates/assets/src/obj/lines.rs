//! The lines of OBJ and MTL files, and the words and numbers in them.

use crate::error::{Fault, shortened};

/// The lines of a text with their numbers. A backslash at the end of a line joins the next line to it. A comment is not
/// continued, because it often ends with the path of a folder.
pub(super) struct Lines<'a> {
    pub(super) rest: &'a [u8],
    pub(super) number: usize,
}

impl<'a> Iterator for Lines<'a> {
    type Item = (usize, std::borrow::Cow<'a, [u8]>);

    fn next(&mut self) -> Option<Self::Item> {
        if self.rest.is_empty() {
            return None;
        }
        let first = self.number + 1;
        let mut whole: Option<Vec<u8>> = None;
        loop {
            self.number += 1;
            let (line, rest) = match memchr::memchr(b'\n', self.rest) {
                Some(end) => (&self.rest[..end], &self.rest[end + 1..]),
                None => (self.rest, &[][..]),
            };
            self.rest = rest;
            let line = line.trim_ascii_end();
            let (line, goes_on) = match line.strip_suffix(b"\\") {
                Some(line) if !line.contains(&b'#') => (line, !rest.is_empty()),
                _ => (line, false),
            };
            match &mut whole {
                None if !goes_on => return Some((first, line.into())),
                None => whole = Some([line, b" "].concat()),
                Some(whole) => {
                    whole.extend_from_slice(line);
                    whole.push(b' ');
                }
            }
            if !goes_on {
                return whole.map(|whole| (first, whole.into()));
            }
        }
    }
}

pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> + Clone {
    line.split(|b| matches!(b, b' ' | b'\t')).filter(|word| !word.is_empty())
}

/// Returns the text of a line after its first word, without blanks around it.
pub(super) fn rest_of(line: &[u8], word: &[u8]) -> String {
    let is_word = |window: &[u8]| window.eq_ignore_ascii_case(word);
    let at = line.windows(word.len()).position(is_word).unwrap_or_default() + word.len();
    String::from_utf8_lossy(&line[at..]).trim().to_string()
}

fn number(word: &[u8]) -> Option<f64> {
    if let Some(number) = short_number(word) {
        return Some(number);
    }
    let text = std::str::from_utf8(word).ok()?;
    text.parse().ok().filter(|x: &f64| x.is_finite())
}

/// Returns the number in a word that consists of a sign, a few digits and a point. The digits and the power of ten are
/// then exact, so the quotient is rounded once, to the number nearest to the word (Clinger, 1990).
fn short_number(word: &[u8]) -> Option<f64> {
    const POWERS: [f64; 16] =
        [1., 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];
    let (is_negative, digits) = match word {
        [b'-', digits @ ..] => (true, digits),
        digits => (false, digits),
    };
    let (mut whole, mut point) = (0u64, None);
    if !(1..=16).contains(&digits.len()) {
        return None;
    }
    for (at, byte) in digits.iter().enumerate() {
        match byte.wrapping_sub(b'0') {
            digit @ 0..=9 => whole = 10 * whole + u64::from(digit),
            _ if *byte == b'.' && point.is_none() && digits.len() > 1 => point = Some(at),
            _ => return None,
        }
    }
    let places = point.map_or(0, |at| digits.len() - 1 - at);
    // Sixteen digits may be more than a number holds.
    let number = (whole < 1 << 53).then(|| whole as f64 / POWERS[places])?;
    Some(if is_negative { -number } else { number })
}

/// Returns the words before a comment.
pub(super) fn before_comment<'a>(words: impl Iterator<Item = &'a [u8]>) -> impl Iterator<Item = &'a [u8]> {
    words.take_while(|word| word[0] != b'#')
}

/// Reads numbers, at most `N`, up to a comment. Returns how many there are.
pub(super) fn numbers<'a, const N: usize>(
    line: usize,
    words: impl Iterator<Item = &'a [u8]>,
    least: usize,
) -> Result<([f64; N], usize), Fault> {
    let (mut all, mut count) = ([0.0; N], 0);
    for word in before_comment(words) {
        let Some(place) = all.get_mut(count) else { break };
        *place = number(word).ok_or_else(|| {
            Fault::at(line, format!("`{}` is not a finite number", shortened(&String::from_utf8_lossy(word))))
        })?;
        count += 1;
    }
    if count < least {
        return Err(Fault::at(line, format!("{count} of {least} numbers")));
    }
    Ok((all, count))
}

pub(super) fn index(line: usize, text: &[u8]) -> Result<i64, Fault> {
    let (digits, sign) = match text {
        [b'-', digits @ ..] => (digits, -1),
        digits => (digits, 1),
    };
    let (mut number, mut is_number) = (0u32, (1..=9).contains(&digits.len()));
    for byte in digits.iter().take(9) {
        let digit = byte.wrapping_sub(b'0');
        is_number &= digit < 10;
        number = number.wrapping_mul(10).wrapping_add(u32::from(digit));
    }
    if !is_number {
        return Err(Fault::at(line, format!("`{}` is no index", shortened(&String::from_utf8_lossy(text)))));
    }
    Ok(sign * i64::from(number))
}

/// Returns a word up to a slash, and what is behind it.
pub(super) fn field(word: &[u8]) -> (&[u8], &[u8]) {
    match word.iter().position(|b| *b == b'/') {
        Some(end) => (&word[..end], &word[end + 1..]),
        None => (word, &[]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_numbers_are_those_of_the_standard_library() {
        let words = [
            "0",
            "-0",
            "1.",
            ".5",
            "-.25",
            "0.1",
            "-3.141593",
            "123456789012345",
            "9007199254740991",
            "9007199254740993",
            "0.30000000000001",
            "00012.5000",
            "1e5",
            "-1.5E-3",
            "inf",
            "nan",
            "",
            "-",
            ".",
            "-.",
            "1.2.3",
            "+1",
            "1x",
            "--1",
        ];
        for word in words {
            let expected = word.parse().ok().filter(|x: &f64| x.is_finite()).map(f64::to_bits);
            assert_eq!(number(word.as_bytes()).map(f64::to_bits), expected, "{word}");
        }
        let mut state = 1u64;
        for _ in 0..20_000 {
            state = state.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(1);
            let (digits, places) = (state >> (11 + state % 50), (state >> 7) as usize % 8);
            let word = format!("{:.places$}", digits as f64 / 1e3);
            assert_eq!(number(word.as_bytes()), word.parse().ok(), "{word}");
        }
    }

    #[test]
    fn indices_have_nine_digits_at_most() {
        assert_eq!(index(1, b"-123456789").unwrap(), -123_456_789);
        assert_eq!(index(1, b"000000007").unwrap(), 7);
        for word in ["", "-", "1234567890", "1.5", "+1", "4294967297", "--1", "1 "] {
            assert!(index(1, word.as_bytes()).is_err(), "{word}");
        }
    }
}
