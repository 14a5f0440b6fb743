//! LZW as GIF uses it: codes of growing width, at most 4,096 of them.
//!
//! The parts of the image data are written in parallel, each with its own code table, and joined bit by bit. A full
//! code table is cleared at once, because frames change too much from top to bottom for an old table to be useful
//! (measured: files grow by 0 to 2 % if it is kept as long as it compresses as well as before).

/// The largest number of codes of the format.
const MAX_CODES: u16 = 4096;
/// Slots of the hash table, at most half of which are in use.
const SLOTS: usize = 8192;
/// An empty slot. No string has this value: it would continue the last code, and the table is
/// cleared before that exists.
const EMPTY: u32 = u32::MAX;

/// The strings of indices since the last clear code. Each is one index longer than its parent.
#[derive(Debug)]
struct CodeTable {
    /// Parent, index and code of each string in 12, 8 and 12 bits, at the hash of parent and index.
    slots: Box<[u32; SLOTS]>,
    next: u16,
    /// For each string, the set of the indices that continue it, modulo 32, one bit each.
    continued: Box<[u32; MAX_CODES as usize]>,
}

impl CodeTable {
    /// Returns the code of the string `parent` followed by `index`, or the slot where it belongs.
    fn find(&self, parent: u16, index: u8) -> Result<u16, usize> {
        let key = u32::from(parent) << 8 | u32::from(index);
        let mut at = (key.wrapping_mul(0x9E37_79B1) >> 19) as usize % SLOTS;
        loop {
            let slot = self.slots[at];
            if slot >> 12 == key && slot != EMPTY {
                return Ok((slot & 0xFFF) as u16);
            }
            if slot == EMPTY {
                return Err(at);
            }
            at = (at + 1) % SLOTS;
        }
    }

    /// Returns the code of the string `parent` followed by `index`. Mostly there is none, and one bit shows it.
    fn code(&self, parent: u16, index: u8) -> Option<u16> {
        let continued = self.continued[usize::from(parent)] >> (index & 31) & 1 != 0;
        if continued { self.find(parent, index).ok() } else { None }
    }
}

/// A writer of a part of an image's data, index by index.
#[derive(Debug)]
pub(crate) struct Writer {
    bits: u8,
    table: CodeTable,
    /// The code of the current string, which is not written yet.
    string: Option<u16>,
    width: u32,
    codes: Codes,
}

impl Writer {
    /// Makes a writer for indices below 2^`bits`, with 2 to 8 bits.
    pub(crate) fn new(bits: u8) -> Self {
        let table = CodeTable {
            slots: Box::new([EMPTY; SLOTS]),
            next: (1 << bits) + 2,
            continued: Box::new([0; MAX_CODES as usize]),
        };
        Self { bits, table, string: None, width: u32::from(bits) + 1, codes: Codes::default() }
    }

    /// Returns the code of the current string.
    pub(crate) fn string(&self) -> Option<u16> {
        self.string
    }

    /// Returns the code of a string followed by an index, if it is known. `None` is the empty string.
    pub(crate) fn longer(&self, string: Option<u16>, index: u8) -> Option<u16> {
        string.map_or(Some(u16::from(index)), |string| self.table.code(string, index))
    }

    /// Returns whether some index may continue the current string.
    pub(crate) fn is_known(&self) -> bool {
        self.string.is_none_or(|string| self.table.continued[usize::from(string)] != 0)
    }

    /// Returns whether this index continues the current string, so that it costs no code.
    pub(crate) fn continues(&self, index: u8) -> bool {
        self.string.is_none_or(|string| self.table.code(string, index).is_some())
    }

    /// Returns one bit per index: 0 if it does not continue the current string, 1 if it may.
    pub(crate) fn may_continue<const N: usize>(&self, indices: &[u8; N]) -> u32 {
        let continued = self.string.map_or(u32::MAX, |string| self.table.continued[usize::from(string)]);
        let mut bits = 0;
        for (k, index) in indices.iter().enumerate() {
            bits |= (continued >> (index & 31) & 1) << k;
        }
        bits
    }

    /// Writes the index if it continues the current string. Returns whether it did.
    pub(crate) fn extend(&mut self, index: u8) -> bool {
        let longer = self.longer(self.string, index);
        if longer.is_some() {
            self.string = longer;
        }
        longer.is_some()
    }

    /// Writes an index.
    pub(crate) fn put(&mut self, index: u8) {
        let found = match self.string {
            Some(string) => self.table.find(string, index).map_err(|at| (string, at)),
            None => Ok(u16::from(index)),
        };
        self.string = match found {
            Ok(longer) => Some(longer),
            Err((string, at)) => {
                self.end_string(string);
                self.table.slots[at] =
                    u32::from(string) << 20 | u32::from(index) << 12 | u32::from(self.table.next);
                self.table.continued[usize::from(string)] |= 1 << (index & 31);
                self.table.next += 1;
                if self.table.next == MAX_CODES {
                    self.codes.put(1 << self.bits, self.width);
                    self.table.slots.fill(EMPTY);
                    self.table.continued.fill(0);
                    self.table.next = (1 << self.bits) + 2;
                    self.width = u32::from(self.bits) + 1;
                }
                Some(u16::from(index))
            }
        };
    }

    fn end_string(&mut self, string: u16) {
        self.codes.put(string, self.width);
        // The decoder adds a string one code later than the encoder, so the width must grow one code later, too.
        if u32::from(self.table.next) == 1 << self.width {
            self.width += 1;
        }
    }

    /// Ends the part, so that it can be [joined](join) to others. `last`: it is the last part of the image.
    pub(crate) fn finish(mut self, last: bool) -> Part {
        if let Some(string) = self.string {
            self.end_string(string);
        }
        self.codes.put((1 << self.bits) + u16::from(last), self.width);
        Part(self.codes)
    }
}

/// A part of an image's data.
#[derive(Debug)]
pub(crate) struct Part(Codes);

/// Joins the parts to the format's image data, without sub-blocks: first `bits`, then the codes of all parts.
pub(crate) fn join(bits: u8, parts: &[Part]) -> Vec<u8> {
    let bytes = parts.iter().map(|part| part.0.bytes.len() + 9).sum::<usize>();
    let mut all = Codes { bytes: Vec::with_capacity(bytes + 2), ..Codes::default() };
    all.put(u16::from(bits), 8);
    all.put(1 << bits, u32::from(bits) + 1);
    for Part(part) in parts {
        let (pairs, rest) = part.bytes.as_chunks::<2>();
        for pair in pairs {
            all.put(u16::from_le_bytes(*pair), 16);
        }
        for &byte in rest {
            all.put(u16::from(byte), 8);
        }
        all.put(part.pending as u16 & 0xFF, part.held.min(8));
        all.put((part.pending >> 8) as u16 & 0xFF, part.held.saturating_sub(8).min(8));
        all.put((part.pending >> 16) as u16, part.held.saturating_sub(16));
    }
    all.finish()
}

/// Codes in sequence, bit by bit, the lowest bit first.
#[derive(Debug, Default)]
struct Codes {
    bytes: Vec<u8>,
    /// The bits that are not yet bytes: fewer than 32.
    pending: u64,
    held: u32,
}

impl Codes {
    fn put(&mut self, code: u16, width: u32) {
        self.pending |= u64::from(code) << self.held;
        self.held += width;
        if self.held >= 32 {
            self.bytes.extend_from_slice(&(self.pending as u32).to_le_bytes());
            self.pending >>= 32;
            self.held -= 32;
        }
    }

    fn finish(mut self) -> Vec<u8> {
        let rest = self.held.div_ceil(8) as usize;
        self.bytes.extend_from_slice(&self.pending.to_le_bytes()[..rest]);
        self.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compress(indices: &[u8], bits: u8, parts: usize) -> Vec<u8> {
        let size = indices.len().div_ceil(parts);
        let written = indices.chunks(size).enumerate().map(|(number, part)| {
            let mut writer = Writer::new(bits);
            part.iter().for_each(|&index| writer.put(index));
            writer.finish((number + 1) * size >= indices.len())
        });
        join(bits, &written.collect::<Vec<_>>())
    }

    fn decode(bytes: &[u8], pixels: usize) -> Vec<u8> {
        let mut decoder = weezl::decode::Decoder::new(weezl::BitOrder::Lsb, bytes[0]);
        let decoded = decoder.decode(&bytes[1..]).unwrap();
        assert_eq!(decoded.len(), pixels);
        decoded
    }

    #[test]
    fn decodes_to_what_it_was() {
        for bits in 2..=8_u8 {
            for pixels in [1, 2, 3, 255, 4_000, 100_000] {
                for spread in [1, 2, 7, 256_u32] {
                    for parts in [1, 2, 3] {
                        let index = |k: u32| (k.wrapping_mul(2_654_435_761) >> 16) % spread.min(1 << bits);
                        let indices = (0..pixels as u32).map(|k| index(k) as u8).collect::<Vec<_>>();
                        assert_eq!(
                            decode(&compress(&indices, bits, parts), pixels),
                            indices,
                            "{bits} {pixels} {spread} {parts}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn what_continues_is_not_written() {
        let mut writer = Writer::new(8);
        [1, 2, 1, 2, 3, 1].iter().for_each(|&index| writer.put(index));
        assert!(writer.continues(2) && !writer.continues(3));
        assert!(writer.extend(2) && writer.extend(3) && !writer.extend(9));
        writer.put(9);
        let bytes = join(8, &[writer.finish(true)]);
        assert_eq!(decode(&bytes, 9), [1, 2, 1, 2, 3, 1, 2, 3, 9]);
    }

    #[test]
    fn what_continues_is_among_what_may() {
        let mut writer = Writer::new(8);
        let indices: [u8; 32] = std::array::from_fn(|k| (k * 7) as u8);
        for k in 0..20_000_u32 {
            let may = writer.may_continue(&indices);
            for (at, &index) in indices.iter().enumerate() {
                assert!(may >> at & 1 == 1 || !writer.continues(index), "{k} {index}");
            }
            writer.put(indices[(k.wrapping_mul(2_654_435_761) >> 27) as usize % 32]);
        }
    }
}
