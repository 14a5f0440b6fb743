//! Pictures in the form in which they are sent to the page: a header, and the part that differs
//! from the previous picture.
//!
//! A drag changes a part of the picture, and the browser takes longer to receive a whole picture than the tracer
//! to draw it. Invariant: a page that puts each part where its header says, and starts anew if the size changes,
//! shows each picture exactly.

use std::time::Duration;

use image::RgbaImage;

/// The number of bytes before the pixels, which are little-endian numbers: the picture's number, width, height,
/// rendering time in microseconds, and its [`Quality`]; then left, top, width and height
/// of the part whose pixels follow.
pub(crate) const HEADER: usize = 36;

/// A rendered picture.
#[derive(Debug)]
pub(crate) struct Picture {
    /// The number by which the page knows it.
    pub(crate) number: u32,
    pub(crate) image: RgbaImage,
    pub(crate) took: Duration,
    pub(crate) quality: Quality,
}

/// The quality of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Quality {
    /// A finer one follows.
    Coarse = 0,
    /// The picture equals that of the renderer.
    Final = 1,
    /// A finer picture follows. This one has fewer mirror images, and fewer objects are visible through glass.
    Simple = 2,
}

/// A packer of a sequence of pictures, all of which are shown.
#[derive(Debug, Default)]
pub(crate) struct Packer {
    before: RgbaImage,
}

/// A rectangle of a picture, in pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Part {
    left: u32,
    top: u32,
    width: u32,
    height: u32,
}

impl Picture {
    /// Makes the final picture, which is already shown, for another request.
    pub(crate) fn again(number: u32, image: &RgbaImage) -> Self {
        Self { number, image: image.clone(), took: Duration::ZERO, quality: Quality::Final }
    }
}

impl Packer {
    /// Returns the picture that was packed last.
    pub(crate) fn before(&self) -> &RgbaImage {
        &self.before
    }

    /// Returns the header of a picture and the part that differs from the previous picture, with four bytes per
    /// pixel: red, green, blue, alpha.
    pub(crate) fn pack(&mut self, picture: Picture) -> Vec<u8> {
        let Picture { number, image, took, quality } = picture;
        let part = differing(&self.before, &image);
        let micros = u32::try_from(took.as_micros()).unwrap_or(u32::MAX);
        let (across, down) = (part.width as usize, part.height as usize);
        let mut bytes = Vec::with_capacity(HEADER + across * down * 4);
        let size = [number, image.width(), image.height(), micros, quality as u32];
        for number in size.into_iter().chain([part.left, part.top, part.width, part.height]) {
            bytes.extend_from_slice(&number.to_le_bytes());
        }
        for row in rows(&image).skip(part.top as usize).take(down) {
            let pixels = &row[part.left as usize..][..across];
            bytes.extend_from_slice(pixels.as_flattened());
        }
        self.before = image;
        bytes
    }
}

/// Returns the smallest part outside of which two pictures are equal: all of the second if their sizes differ.
fn differing(before: &RgbaImage, now: &RgbaImage) -> Part {
    let (width, height) = now.dimensions();
    if before.dimensions() != (width, height) {
        return Part { left: 0, top: 0, width, height };
    }
    let differ = |(a, b): (&[[u8; 4]], &[[u8; 4]])| a != b;
    let pairs = || rows(before).zip(rows(now));
    let Some(top) = pairs().position(differ) else { return Part::default() };
    let below = pairs().rev().position(differ).unwrap_or(0);
    let down = height as usize - below - top;
    let (mut left, mut right) = (width as usize, 0);
    for (old, new) in pairs().skip(top).take(down) {
        let differ = |(a, b)| a != b;
        // Only pixels outside of the part so far can widen it.
        left = old[..left].iter().zip(&new[..left]).position(differ).unwrap_or(left);
        let more = old[right..].iter().zip(&new[right..]).rposition(differ);
        right = more.map_or(right, |more| right + more + 1);
    }
    Part { left: left as u32, top: top as u32, width: (right - left) as u32, height: down as u32 }
}

/// Returns the rows of pixels, from the top.
fn rows(image: &RgbaImage) -> impl DoubleEndedIterator<Item = &[[u8; 4]]> + ExactSizeIterator {
    image.as_raw().as_chunks::<4>().0.chunks_exact(image.width().max(1) as usize)
}

#[cfg(test)]
pub(crate) mod tests {
    use image::Rgba;

    use super::*;

    /// The picture that a page shows.
    #[derive(Debug, Default)]
    pub(crate) struct Shown(pub(crate) RgbaImage);

    impl Shown {
        /// Puts the received part in its place.
        pub(crate) fn put(&mut self, packed: &[u8]) {
            let (head, pixels) = packed.split_at(HEADER);
            let head: Vec<u32> = head.as_chunks().0.iter().map(|&bytes| u32::from_le_bytes(bytes)).collect();
            let &[_, width, height, _, _, left, top, across, down] = head.as_slice() else { unreachable!() };
            assert_eq!(pixels.len() as u32, 4 * across * down);
            if self.0.dimensions() != (width, height) {
                self.0 = RgbaImage::new(width, height);
            }
            for (at, &pixel) in pixels.as_chunks().0.iter().enumerate() {
                let at = at as u32;
                self.0.put_pixel(left + at % across, top + at / across, Rgba(pixel));
            }
        }
    }

    fn pack(packer: &mut Packer, image: &RgbaImage) -> Vec<u8> {
        let (number, took) = (1, Duration::ZERO);
        packer.pack(Picture { number, image: image.clone(), took, quality: Quality::Final })
    }

    #[test]
    fn parts_make_the_whole_picture_whatever_changes() {
        let seed = std::hash::BuildHasher::hash_one(&std::hash::RandomState::new(), 0);
        println!("seed {seed}");
        let mut state = seed | 1;
        let mut below = |limit: u32| {
            // The generator is from Marsaglia, Xorshift RNGs (2003).
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 33) as u32 % limit
        };
        let (mut packer, mut shown) = (Packer::default(), Shown::default());
        let mut image = RgbaImage::new(1, 1);
        for _ in 0..3000 {
            if below(20) == 0 {
                image = RgbaImage::new(1 + below(17), 1 + below(13));
            }
            for _ in 0..below(4) {
                let (x, y) = (below(image.width()), below(image.height()));
                image.put_pixel(x, y, Rgba([(); 4].map(|()| below(3) as u8)));
            }
            shown.put(&pack(&mut packer, &image));
            assert!(shown.0 == image);
        }
    }

    #[test]
    fn no_more_is_sent_than_differs() {
        let mut packer = Packer::default();
        let mut image = RgbaImage::new(100, 50);
        assert_eq!(pack(&mut packer, &image).len(), HEADER + 100 * 50 * 4, "the first one is whole");
        assert_eq!(pack(&mut packer, &image).len(), HEADER, "the same again is nothing");
        image.put_pixel(20, 7, Rgba([1, 2, 3, 255]));
        image.put_pixel(29, 11, Rgba([1, 2, 3, 255]));
        assert_eq!(pack(&mut packer, &image).len(), HEADER + 10 * 5 * 4);
        let turned = RgbaImage::new(50, 100);
        assert_eq!(pack(&mut packer, &turned).len(), HEADER + 100 * 50 * 4, "another size is whole");
    }
}
