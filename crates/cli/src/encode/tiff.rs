//! The pages of a TIFF file. The decoder reads only the first page of a file; for another page it gets a header that
//! points to that page.

use std::collections::HashSet;
use std::io::{self, Read, Seek, SeekFrom};

use anyhow::{Context, bail, ensure};

/// The tags that are read here.
const NEW_SUBFILE_TYPE: u16 = 254;
const PLANAR_CONFIGURATION: u16 = 284;
const TILE_WIDTH: u16 = 322;

/// The bits of NewSubfileType for a smaller copy of another page, and for a mask.
const NO_PAGE: u64 = 0b101;

/// The PlanarConfiguration of samples that are stored channel by channel.
const PLANAR: u64 = 2;

/// More pages than any real file has.
const MAX_PAGES: usize = 1 << 20;

/// The byte order and offset size of a file.
#[derive(Clone, Copy, Debug)]
struct Layout {
    is_big_endian: bool,
    /// Whether it is a BigTIFF, whose offsets have eight bytes.
    is_large: bool,
}

/// Returns the offsets of the pages' directories, in order. Smaller copies and masks are not pages.
///
/// # Errors
/// When the file is cut off or its directories lead in a circle, and for a page that the decoder cannot read.
pub(super) fn pages(file: &mut (impl Read + Seek)) -> anyhow::Result<Vec<u64>> {
    let layout = Layout::of(&header(file)?)?;
    let cut_off = "it is cut off: a page's directory is missing";
    let mut at = layout.first(file).context(cut_off)?;
    let (mut pages, mut seen) = (Vec::new(), HashSet::new());
    while at != 0 {
        ensure!(seen.insert(at) && seen.len() <= MAX_PAGES, "its pages lead in a circle");
        let (directory, next) = Directory::read(file, at, layout).context(cut_off)?;
        if directory.subfile & NO_PAGE == 0 || pages.is_empty() {
            // The decoder panics on such a page.
            ensure!(
                !(directory.is_tiled && directory.planes == PLANAR),
                "page {} is stored in tiles and channel by channel, which cannot be read: expected strips, or the \
                 channels of a pixel side by side",
                pages.len() + 1
            );
            pages.push(at);
        }
        at = next;
    }
    ensure!(!pages.is_empty(), "it has no page");
    Ok(pages)
}

/// Returns whether a file with this header is a TIFF image.
pub(super) fn is_tiff(header: &[u8; 8]) -> bool {
    Layout::of(header).is_ok()
}

/// Reads the first eight bytes of a file.
///
/// # Errors
/// Fails if the file is shorter.
pub(super) fn header(file: &mut (impl Read + Seek)) -> io::Result<[u8; 8]> {
    let mut header = [0; 8];
    file.rewind()?;
    file.read_exact(&mut header)?;
    Ok(header)
}

impl Layout {
    fn of(header: &[u8; 8]) -> anyhow::Result<Self> {
        Ok(match header[..4] {
            [b'I', b'I', 42, 0] => Self { is_big_endian: false, is_large: false },
            [b'M', b'M', 0, 42] => Self { is_big_endian: true, is_large: false },
            [b'I', b'I', 43, 0] => Self { is_big_endian: false, is_large: true },
            [b'M', b'M', 0, 43] => Self { is_big_endian: true, is_large: true },
            _ => bail!("its header is not a TIFF image's"),
        })
    }

    /// Returns the position of the first directory's offset, and the size of an offset in bytes.
    fn offset(self) -> (u64, usize) {
        if self.is_large { (8, 8) } else { (4, 4) }
    }

    fn first(self, file: &mut (impl Read + Seek)) -> io::Result<u64> {
        let (at, bytes) = self.offset();
        file.seek(SeekFrom::Start(at))?;
        self.number(file, bytes)
    }

    fn number(self, file: &mut impl Read, bytes: usize) -> io::Result<u64> {
        let mut number = [0; 8];
        let digits = &mut number[..bytes];
        file.read_exact(digits)?;
        if self.is_big_endian {
            digits.reverse();
        }
        Ok(u64::from_le_bytes(number))
    }
}

/// The entries of a page's directory that are read here.
#[derive(Debug, Default)]
struct Directory {
    subfile: u64,
    planes: u64,
    is_tiled: bool,
}

impl Directory {
    /// Reads a directory, and the offset of the next one.
    fn read(file: &mut (impl Read + Seek), at: u64, layout: Layout) -> io::Result<(Self, u64)> {
        let (_, bytes) = layout.offset();
        file.seek(SeekFrom::Start(at))?;
        let entries = layout.number(file, if layout.is_large { 8 } else { 2 })?;
        let mut directory = Self::default();
        for _ in 0..entries {
            let tag = layout.number(file, 2)?;
            let kind = layout.number(file, 2)?;
            layout.number(file, bytes)?;
            let mut value = vec![0; bytes];
            file.read_exact(&mut value)?;
            // A SHORT or LONG, at the start of the value.
            let width = if kind == 3 { 2 } else { 4 };
            let value = layout.number(&mut &value[..], width)?;
            match u16::try_from(tag) {
                Ok(NEW_SUBFILE_TYPE) => directory.subfile = value,
                Ok(PLANAR_CONFIGURATION) => directory.planes = value,
                Ok(TILE_WIDTH) => directory.is_tiled = true,
                _ => {}
            }
        }
        Ok((directory, layout.number(file, bytes)?))
    }
}

/// A TIFF file that begins with another page.
#[derive(Debug)]
pub(super) struct PageReader<R> {
    file: R,
    header: Vec<u8>,
    at: u64,
}

impl<R: Read + Seek> PageReader<R> {
    /// # Errors
    /// When the header cannot be read.
    pub(super) fn new(mut file: R, page: u64) -> anyhow::Result<Self> {
        let layout = Layout::of(&header(&mut file)?)?;
        let (at, bytes) = layout.offset();
        let mut header = vec![0; at as usize + bytes];
        file.rewind()?;
        file.read_exact(&mut header)?;
        let mut offset = page.to_le_bytes()[..bytes].to_vec();
        if layout.is_big_endian {
            offset.reverse();
        }
        header[at as usize..].copy_from_slice(&offset);
        file.rewind()?;
        Ok(Self { file, header, at: 0 })
    }
}

impl<R: Read + Seek> Read for PageReader<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let rest = usize::try_from(self.at).ok().and_then(|at| self.header.get(at..)).unwrap_or_default();
        let read = if rest.is_empty() {
            self.file.read(buffer)?
        } else {
            let read = rest.len().min(buffer.len());
            buffer[..read].copy_from_slice(&rest[..read]);
            self.file.seek(SeekFrom::Start(self.at + read as u64))?;
            read
        };
        self.at += read as u64;
        Ok(read)
    }
}

impl<R: Seek> Seek for PageReader<R> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.at = self.file.seek(to)?;
        Ok(self.at)
    }
}
