//! LZW as the format has it: codes of growing width, at most 4,096 of them.
//!
//! The book of strings is begun anew as soon as it is full: frames change too much from top to bottom for an old book
//! to be worth keeping (measured: files grow by 0 to 2 % when it is kept while it fits as well as it did).

/// The most codes that the format allows.
const MOST_CODES: u16 = 4096;
/// Slots of the hash table: at most half of them are in use.
const SLOTS: usize = 8192;
const NONE: u32 = u32::MAX;

/// What has been seen since the last clear code: strings of indices, each one longer than its parent by one index.
#[derive(Debug)]
pub(crate) struct Book {
    /// Parent and index of each string, and its code, where the hash of parent and index puts it.
    slots: Vec<(u32, u16)>,
    first_free: u16,
    next: u16,
}

impl Book {
    /// For indices below 2^`bits`.
    pub(crate) fn new(bits: u8) -> Self {
        let first_free = (1 << bits) + 2;
        Self { slots: vec![(NONE, 0); SLOTS], first_free, next: first_free }
    }

    pub(crate) fn clear(&mut self) {
        self.slots.fill((NONE, 0));
        self.next = self.first_free;
    }

    pub(crate) fn is_full(&self) -> bool {
        self.next == MOST_CODES
    }

    /// The code of the string `parent` with `index` after it.
    pub(crate) fn get(&self, parent: u16, index: u8) -> Option<u16> {
        let (key, at) = self.locate(parent, index);
        (self.slots[at].0 == key).then(|| self.slots[at].1)
    }

    /// Gives it a code, if there is one left.
    pub(crate) fn insert(&mut self, parent: u16, index: u8) {
        if !self.is_full() {
            let (key, at) = self.locate(parent, index);
            self.slots[at] = (key, self.next);
            self.next += 1;
        }
    }

    fn locate(&self, parent: u16, index: u8) -> (u32, usize) {
        let key = u32::from(parent) << 8 | u32::from(index);
        let mut at = (key.wrapping_mul(0x9E37_79B1) >> 19) as usize;
        while self.slots[at].0 != key && self.slots[at].0 != NONE {
            at = (at + 1) % SLOTS;
        }
        (key, at)
    }
}

/// The format's image data for indices below 2^`bits`, without its blocks: first `bits` itself, then the codes.
pub(crate) fn compress(indices: &[u8], bits: u8) -> Vec<u8> {
    let mut out = Codes { bytes: vec![bits], pending: 0, held: 0 };
    let (clear, end) = (1_u16 << bits, (1_u16 << bits) + 1);
    let mut book = Book::new(bits);
    let mut width = u32::from(bits) + 1;
    out.put(clear, width);
    let mut string = None;
    for &index in indices {
        let Some(parent) = string else {
            string = Some(u16::from(index));
            continue;
        };
        if let Some(longer) = book.get(parent, index) {
            string = Some(longer);
            continue;
        }
        out.put(parent, width);
        // The decoder knows this code one step later, so the width grows when the code itself does not fit.
        if u32::from(book.next) == 1 << width {
            width += 1;
        }
        book.insert(parent, index);
        if book.is_full() {
            out.put(clear, width);
            book.clear();
            width = u32::from(bits) + 1;
        }
        string = Some(u16::from(index));
    }
    if let Some(last) = string {
        out.put(last, width);
        if u32::from(book.next) == 1 << width {
            width += 1;
        }
    }
    out.put(end, width);
    out.finish()
}

#[derive(Debug)]
struct Codes {
    bytes: Vec<u8>,
    pending: u32,
    held: u32,
}

impl Codes {
    fn put(&mut self, code: u16, width: u32) {
        self.pending |= u32::from(code) << self.held;
        self.held += width;
        while self.held >= 8 {
            self.bytes.push(self.pending as u8);
            self.pending >>= 8;
            self.held -= 8;
        }
    }

    fn finish(mut self) -> Vec<u8> {
        if self.held > 0 {
            self.bytes.push(self.pending as u8);
        }
        self.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
                    let index = |k: u32| (k.wrapping_mul(2_654_435_761) >> 16) % spread.min(1 << bits);
                    let indices = (0..pixels as u32).map(|k| index(k) as u8).collect::<Vec<_>>();
                    assert_eq!(
                        decode(&compress(&indices, bits), pixels),
                        indices,
                        "{bits} {pixels} {spread}"
                    );
                }
            }
        }
    }
}
