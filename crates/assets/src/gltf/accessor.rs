//! Reads accessors: numbers in views of buffers, of which a sparse accessor replaces some. Every range is checked
//! before it is read.

use super::document::{Accessor, Document};
use crate::error::{Fault, shortened};
use crate::limits;

/// The buffers of a document.
pub(super) struct Buffers {
    pub(super) contents: Vec<Vec<u8>>,
}

/// The type of a component.
#[derive(Clone, Copy)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(number: u32) -> Result<Self, Fault> {
        Ok(match number {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return Err(Fault::new(format!("an accessor has the component type {number}"))),
        })
    }

    fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// Returns the number at the start of the bytes, which must be enough. A `normalized` whole number is a share of
    /// the largest one.
    fn read(self, b: &[u8], normalized: bool) -> f64 {
        let (number, largest) = match self {
            Self::I8 => (f64::from(b[0].cast_signed()), 127.0),
            Self::U8 => (f64::from(b[0]), 255.0),
            Self::I16 => (f64::from(i16::from_le_bytes([b[0], b[1]])), 32_767.0),
            Self::U16 => (f64::from(u16::from_le_bytes([b[0], b[1]])), 65_535.0),
            Self::U32 => (f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]])), f64::from(u32::MAX)),
            Self::F32 => return f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])),
        };
        if normalized { (number / largest).max(-1.0) } else { number }
    }
}

/// Items of a view, all of which are within their buffer.
struct Items<'a> {
    bytes: &'a [u8],
    stride: usize,
}

/// Returns the fault of a part of a file that is outside of its buffer.
fn outside(what: &str) -> impl Fn() -> Fault {
    move || Fault::new(format!("{what} is outside of its buffer: the file is cut off, or damaged"))
}

impl Buffers {
    /// Returns the bytes of a view.
    pub(super) fn view(&self, document: &Document, view: usize) -> Result<&[u8], Fault> {
        self.within(document, view, &outside("a picture"))
    }

    fn within(&self, document: &Document, view: usize, outside: &impl Fn() -> Fault) -> Result<&[u8], Fault> {
        let number = view;
        let view = document
            .buffer_views
            .get(view)
            .ok_or_else(|| Fault::new(format!("there is no buffer view {number}")))?;
        let buffer = self
            .contents
            .get(view.buffer)
            .ok_or_else(|| Fault::new(format!("there is no buffer {}", view.buffer)))?;
        let start = usize::try_from(view.byte_offset).map_err(|_| outside())?;
        let length = usize::try_from(view.byte_length).map_err(|_| outside())?;
        let end = start.checked_add(length).ok_or_else(outside)?;
        buffer.get(start..end).ok_or_else(outside)
    }

    /// Returns `count` items of `size` bytes each, from `offset` within a view.
    fn items(
        &self,
        document: &Document,
        (view, offset): (usize, u64),
        count: u64,
        size: usize,
        strided: bool,
    ) -> Result<Items<'_>, Fault> {
        let outside = outside("an accessor");
        let offset = usize::try_from(offset).map_err(|_| outside())?;
        let bytes = self.within(document, view, &outside)?.get(offset..).ok_or_else(&outside)?;
        let stride = match document.buffer_views.get(view).and_then(|view| view.byte_stride) {
            Some(stride) if strided => usize::try_from(stride).map_err(|_| outside())?,
            _ => size,
        };
        if strided && (stride < size || stride > 1 << 16) {
            return Err(Fault::new(format!("a buffer view has the stride {stride}")));
        }
        let count = usize::try_from(count).map_err(|_| outside())?;
        let needed = match count {
            0 => 0,
            _ => (count - 1).checked_mul(stride).and_then(|n| n.checked_add(size)).ok_or_else(&outside)?,
        };
        if needed > bytes.len() {
            return Err(outside());
        }
        Ok(Items { bytes, stride })
    }

    /// Passes each item of an accessor to a function, with its components, and returns their number.
    pub(super) fn each<const N: usize>(
        &self,
        document: &Document,
        accessor: usize,
        kinds: &[(&str, usize)],
        mut each: impl FnMut([f64; N]),
    ) -> Result<usize, Fault> {
        let number = accessor;
        let accessor = document
            .accessors
            .get(accessor)
            .ok_or_else(|| Fault::new(format!("there is no accessor {number}")))?;
        let components = kinds.iter().find(|(kind, _)| *kind == accessor.kind).map(|(_, count)| *count);
        let Some(components) = components else {
            return Err(Fault::new(format!(
                "accessor {number} has the type `{}`",
                shortened(&accessor.kind)
            )));
        };
        let most = if accessor.buffer_view.is_some() { limits::VERTICES } else { limits::NODES };
        if accessor.count > most as u64 {
            return Err(Fault::new(format!(
                "accessor {number} has {} items, more than {most}",
                accessor.count
            )));
        }
        let of = Component::of(accessor.component_type)?;
        let size = components * of.bytes();
        let read = |bytes: &[u8]| {
            let mut item = [0.0; N];
            for (component, bytes) in item.iter_mut().zip(bytes[..size].chunks_exact(of.bytes())) {
                *component = of.read(bytes, accessor.normalized);
            }
            item
        };
        let dense = accessor
            .buffer_view
            .map(|view| self.items(document, (view, accessor.byte_offset), accessor.count, size, true))
            .transpose()?;
        let sparse = self.sparse(document, accessor, size)?;
        let mut sparse = sparse.iter().peekable();
        for i in 0..accessor.count as usize {
            let replaced = sparse.next_if(|(at, _)| *at as usize == i);
            each(match (replaced, &dense) {
                (Some((_, bytes)), _) => read(bytes),
                (None, Some(items)) => read(&items.bytes[i * items.stride..]),
                (None, None) => [0.0; N],
            });
        }
        Ok(accessor.count as usize)
    }

    /// Returns the items that replace others: their indices, which increase, and their bytes.
    fn sparse(
        &self,
        document: &Document,
        accessor: &Accessor,
        size: usize,
    ) -> Result<Vec<(u32, &[u8])>, Fault> {
        let Some(sparse) = &accessor.sparse else { return Ok(Vec::new()) };
        if sparse.count > accessor.count {
            return Err(Fault::new("a sparse accessor replaces more items than there are"));
        }
        let of = Component::of(sparse.indices.component_type)?;
        let place = (sparse.indices.buffer_view, sparse.indices.byte_offset);
        let indices = self.items(document, place, sparse.count, of.bytes(), false)?;
        let place = (sparse.values.buffer_view, sparse.values.byte_offset);
        let values = self.items(document, place, sparse.count, size, false)?;
        let mut replaced = Vec::with_capacity(sparse.count as usize);
        for k in 0..sparse.count as usize {
            let index = of.read(&indices.bytes[k * indices.stride..], false) as u32;
            if replaced.last().is_some_and(|(last, _)| *last >= index) || u64::from(index) >= accessor.count {
                return Err(Fault::new("the indices of a sparse accessor do not increase within it"));
            }
            replaced.push((index, &values.bytes[k * size..]));
        }
        Ok(replaced)
    }
}
