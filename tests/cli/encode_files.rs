//! `rayfold encode` with files that hold several frames, or metadata about their display.

use image::RgbImage;
use snapbox::str;

use crate::{Folder, ball_at, decode_gif};

/// A page of a TIFF file. It has one colour, except for a white first pixel.
#[derive(Clone, Default)]
struct Page {
    size: (u16, u16),
    colour: [u8; 3],
    /// The value of NewSubfileType.
    subfile: u16,
    orientation: u16,
    is_planar: bool,
    /// Whether the page has tiles of 16 x 16, compressed by LZW.
    is_tiled: bool,
}

impl Page {
    fn of(colour: [u8; 3]) -> Self {
        Self { size: (6, 4), colour, orientation: 1, ..Self::default() }
    }

    fn level(&self, x: usize, y: usize, channel: usize) -> u8 {
        if (x, y) == (0, 0) { 255 } else { self.colour[channel] }
    }

    /// Returns the strips or tiles.
    fn chunks(&self) -> Vec<Vec<u8>> {
        let (width, height) = (usize::from(self.size.0), usize::from(self.size.1));
        let (across, down) = if self.is_tiled { (16, 16) } else { (width, height) };
        let mut chunks = Vec::new();
        let planes: Vec<Vec<usize>> =
            if self.is_planar { vec![vec![0], vec![1], vec![2]] } else { vec![vec![0, 1, 2]] };
        for channels in planes {
            for (top, left) in
                (0..height).step_by(down).flat_map(|y| (0..width).step_by(across).map(move |x| (y, x)))
            {
                let mut chunk = Vec::new();
                for (y, x) in (0..down).flat_map(|y| (0..across).map(move |x| (y, x))) {
                    chunk.extend(channels.iter().map(|c| self.level(left + x, top + y, *c)));
                }
                chunks.push(if self.is_tiled { lzw(&chunk) } else { chunk });
            }
        }
        chunks
    }
}

fn lzw(bytes: &[u8]) -> Vec<u8> {
    weezl::encode::Encoder::with_tiff_size_switch(weezl::BitOrder::Msb, 8).encode(bytes).unwrap()
}

/// Returns a file of pages, in either byte order, with offsets of four bytes or eight.
fn tiff(pages: &[Page], is_big_endian: bool, is_large: bool) -> Vec<u8> {
    let number = |value: u64, bytes: usize| {
        let mut digits = value.to_le_bytes()[..bytes].to_vec();
        if is_big_endian {
            digits.reverse();
        }
        digits
    };
    let wide = if is_large { 8 } else { 4 };
    let mut file = if is_big_endian { b"MM".to_vec() } else { b"II".to_vec() };
    if is_large {
        file.extend([number(43, 2), number(8, 2), number(0, 2)].concat());
    } else {
        file.extend(number(42, 2));
    }
    let mut link = file.len();
    file.extend(number(0, wide));
    for page in pages {
        // Values that do not fit beside their tag precede the directory.
        let list = |file: &mut Vec<u8>, values: &[u64], bytes: usize| -> Vec<u8> {
            let all: Vec<u8> = values.iter().flat_map(|value| number(*value, bytes)).collect();
            if all.len() <= wide {
                return [all.clone(), vec![0; wide - all.len()]].concat();
            }
            let at = file.len() as u64;
            file.extend(all);
            number(at, wide)
        };
        let (mut offsets, mut lengths) = (Vec::new(), Vec::new());
        for chunk in page.chunks() {
            offsets.push(file.len() as u64);
            lengths.push(chunk.len() as u64);
            file.extend(chunk);
        }
        let (width, height) = (u64::from(page.size.0), u64::from(page.size.1));
        let mut tags: Vec<(u16, u16, Vec<u64>)> = vec![
            (254, 4, vec![page.subfile.into()]),
            (256, 3, vec![width]),
            (257, 3, vec![height]),
            (258, 3, vec![8, 8, 8]),
            (259, 3, vec![if page.is_tiled { 5 } else { 1 }]),
            (262, 3, vec![2]),
            (274, 3, vec![page.orientation.into()]),
            (277, 3, vec![3]),
            (284, 3, vec![if page.is_planar { 2 } else { 1 }]),
        ];
        if page.is_tiled {
            tags.extend([(322, 3, vec![16]), (323, 3, vec![16]), (324, 4, offsets), (325, 4, lengths)]);
        } else {
            tags.extend([(273, 4, offsets), (278, 3, vec![height]), (279, 4, lengths)]);
        }
        tags.sort();
        let mut directory = number(tags.len() as u64, if is_large { 8 } else { 2 });
        for (tag, kind, values) in tags {
            let value = list(&mut file, &values, if kind == 3 { 2 } else { 4 });
            directory.extend(number(tag.into(), 2));
            directory.extend(number(kind.into(), 2));
            directory.extend(number(values.len() as u64, wide));
            directory.extend(value);
        }
        let at = file.len() as u64;
        file[link..link + wide].copy_from_slice(&number(at, wide));
        file.extend(directory);
        link = file.len();
        file.extend(number(0, wide));
    }
    file
}

/// Encodes one file. Returns the pictures that a viewer shows.
fn shown(folder: &Folder, file: &str) -> Vec<RgbImage> {
    folder.rayfold(&format!("encode {file} -o out.gif")).assert().code(0);
    decode_gif(&folder.read("out.gif")).into_iter().map(|(image, _)| image).collect()
}

/// Regression test: only the first frame was used, and the others were silently ignored.
#[test]
fn an_animated_png_is_all_of_its_frames() {
    let folder = Folder::new();
    for step in 0..7 {
        folder.write(&format!("balls/{step}.txt"), ball_at(step));
    }
    folder.rayfold("render balls -o balls.apng --fps 20").assert().code(0);
    folder.rayfold("render balls -o balls.gif --fps 20").assert().code(0);
    folder.rayfold("render balls -o %d.png").assert().code(0);
    folder.rayfold("encode balls.apng -o parts.gif --fps 20").assert().code(0);
    assert_eq!(folder.read("parts.gif"), folder.read("balls.gif"));
    // Between other files, in order.
    let out = folder.rayfold("encode 1.png balls.apng 7.png --no-sort -o more.gif --fps 20").assert().code(0);
    assert!(String::from_utf8_lossy(&out.get_output().stderr).contains("9 frames"));
    let frames = decode_gif(&folder.read("more.gif"));
    assert_eq!(frames.len(), 9);
    assert_eq!(frames[1..8], decode_gif(&folder.read("balls.gif"))[..]);
    // A truncated file is reported, and nothing is written.
    let whole = folder.read("balls.apng");
    folder.write("half.apng", &whole[..whole.len() / 2]);
    let out = folder.rayfold("encode half.apng -o half.gif").assert().code(1);
    let said = String::from_utf8_lossy(&out.get_output().stderr).into_owned();
    assert!(said.contains("cannot read half.apng: "), "{said}");
    assert!(!folder.join("half.gif").exists());
}

#[test]
fn a_tiff_is_all_of_its_pages() {
    let folder = Folder::new();
    let pages: Vec<Page> = (0..5).map(|page| Page::of([50 * page, 7, 200 - 40 * page])).collect();
    for (is_big_endian, is_large) in [(false, false), (true, false), (false, true), (true, true)] {
        folder.write("pages.tif", tiff(&pages, is_big_endian, is_large));
        let shown = shown(&folder, "pages.tif");
        assert_eq!(shown.len(), 5, "{is_big_endian} {is_large}");
        for (page, image) in pages.iter().zip(&shown) {
            assert_eq!((image.get_pixel(0, 0).0, image.get_pixel(3, 3).0), ([255; 3], page.colour));
        }
    }
    let out = folder.rayfold("encode pages.tif pages.tif -o out.gif").assert().code(0);
    assert!(String::from_utf8_lossy(&out.get_output().stderr).contains("10 frames"));
    // Thumbnails, which cameras and scanners add, are no pages; nor are masks.
    let mut with_copies = pages.clone();
    with_copies.insert(1, Page { subfile: 1, size: (3, 2), ..pages[0].clone() });
    with_copies.push(Page { subfile: 4, size: (3, 2), ..pages[0].clone() });
    folder.write("copies.tif", tiff(&with_copies, false, false));
    assert_eq!(shown(&folder, "copies.tif"), shown(&folder, "pages.tif"));
    // The last directory points to the first.
    let mut circle = tiff(&pages, false, false);
    let (first, end) = (circle[4..8].to_vec(), circle.len());
    circle[end - 4..].copy_from_slice(&first);
    folder.write("circle.tif", circle);
    folder.rayfold("encode circle.tif -o circle.gif").assert().code(1).stderr_eq(str![[r#"
error: cannot read circle.tif: its pages lead in a circle
error: 1 of 1 file cannot be used

"#]]);
}

/// Regression test: the decoder panicked.
#[test]
fn a_tiff_in_tiles_is_read_or_refused_by_name() {
    let folder = Folder::new();
    let tiled = Page { is_tiled: true, size: (40, 21), ..Page::of([9, 99, 199]) };
    folder.write("tiled.tif", tiff(&[tiled.clone(), tiled.clone()], false, false));
    let out = folder.rayfold("encode tiled.tif -o out.gif").output().unwrap();
    let said = String::from_utf8(out.stderr).unwrap();
    if out.status.success() {
        let frames = decode_gif(&folder.read("out.gif"));
        assert!(frames.len() == 2 && frames[1].0.get_pixel(39, 20).0 == tiled.colour, "{said}");
    } else {
        assert!(said.contains("cannot read tiled.tif: ") && !said.contains("panicked"), "{said}");
    }
    let strips = Page { is_planar: true, ..Page::of([9, 99, 199]) };
    folder.write("strips.tif", tiff(&[strips], false, false));
    assert_eq!(shown(&folder, "strips.tif")[0].get_pixel(3, 3).0, [9, 99, 199]);
    let planar = Page { is_planar: true, ..tiled };
    folder.write("planar.tif", tiff(&[Page::of([0; 3]), planar], false, false));
    folder.rayfold("encode planar.tif -o planar.gif").assert().code(1).stderr_eq(str![[r#"
error: cannot read planar.tif: page 2 is stored in tiles and channel by channel, which cannot be read: expected strips, or the channels of a pixel side by side
error: 1 of 1 file cannot be used

"#]]);
}

#[test]
fn orientation_is_obeyed() {
    let folder = Folder::new();
    // The position of the white pixel of the upper left corner in a picture of 6 x 4.
    for (orientation, size, white) in [
        (1, (6, 4), (0, 0)),
        (2, (6, 4), (5, 0)),
        (3, (6, 4), (5, 3)),
        (4, (6, 4), (0, 3)),
        (5, (4, 6), (0, 0)),
        (6, (4, 6), (3, 0)),
        (7, (4, 6), (3, 5)),
        (8, (4, 6), (0, 5)),
    ] {
        folder.write("a.tif", tiff(&[Page { orientation, ..Page::of([10, 20, 30]) }], false, false));
        let image = &shown(&folder, "a.tif")[0];
        assert_eq!(image.dimensions(), size, "{orientation}");
        assert_eq!(image.get_pixel(white.0, white.1).0, [255; 3], "{orientation}");
        // The orientation in a PNG, by its eXIf chunk.
        let exif = [
            b"II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0".to_vec(),
            vec![orientation as u8, 0, 0, 0, 0, 0, 0, 0],
        ];
        folder.write("a.png", png(|info| info.exif_metadata = Some(exif.concat().into())));
        let image = &shown(&folder, "a.png")[0];
        assert_eq!(
            (image.dimensions(), image.get_pixel(white.0, white.1).0),
            (size, [255; 3]),
            "{orientation}"
        );
    }
}

/// Returns a picture of 6 x 4 that is 128 everywhere except for its first pixel.
fn png(change: impl FnOnce(&mut png::Info<'_>)) -> Vec<u8> {
    let mut info = png::Info::with_size(6, 4);
    info.color_type = png::ColorType::Rgb;
    info.bit_depth = png::BitDepth::Eight;
    change(&mut info);
    let mut file = Vec::new();
    let mut writer = png::Encoder::with_info(&mut file, info).unwrap().write_header().unwrap();
    let mut pixels = vec![128; 6 * 4 * 3];
    pixels[..3].fill(255);
    writer.write_image_data(&pixels).unwrap();
    writer.finish().unwrap();
    file
}

/// Regression test: pictures in linear light were far too dark.
#[test]
fn gamma_is_obeyed() {
    let folder = Folder::new();
    let gamma = |gamma: f32| Some(png::ScaledFloat::new(gamma));
    let intent = Some(png::SrgbRenderingIntent::Perceptual);
    type Change = Box<dyn Fn(&mut png::Info<'_>)>;
    let cases: [(&str, u8, Change); 5] = [
        ("none", 128, Box::new(|_| ())),
        ("that of the display", 128, Box::new(move |info| info.source_gamma = gamma(0.45455))),
        // 128 / 255 as light is 188 in sRGB.
        ("linear", 188, Box::new(move |info| info.source_gamma = gamma(1.0))),
        // The light is (128 / 255) ^ 1.8.
        ("old Macintosh", 146, Box::new(move |info| info.source_gamma = gamma(1.0 / 1.8))),
        (
            "sRGB, which counts",
            128,
            Box::new(move |info| {
                info.source_gamma = gamma(1.0);
                info.srgb = intent;
            }),
        ),
    ];
    for (what, expected, change) in cases {
        folder.write("a.png", png(change));
        let image = &shown(&folder, "a.png")[0];
        assert_eq!((image.get_pixel(3, 3).0, image.get_pixel(0, 0).0), ([expected; 3], [255; 3]), "{what}");
    }
}
