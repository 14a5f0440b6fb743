//! `rayfold encode` of what other programs write: frames that go away or are blended, plays, exact times, unlike sizes, and
//! files that are cut off or claim to be huge.

use image::codecs::gif::{GifEncoder, Repeat};
use image::{AnimationDecoder, Delay, Frame, Rgba, RgbaImage};

use crate::Folder;

const RED: Rgba<u8> = Rgba([255, 0, 0, 255]);
const BLUE: Rgba<u8> = Rgba([0, 0, 255, 255]);
const CLEAR: Rgba<u8> = Rgba([0; 4]);

/// A frame of an animated WebP: its left and top, its picture, and whether it overwrites and is disposed of.
struct Part {
    at: [u32; 2],
    picture: RgbaImage,
    overwrites: bool,
    disposed: bool,
}

/// Writes the chunks of an animated WebP by RFC 9649. Each frame is shown for 70 ms.
fn webp([width, height]: [u32; 2], times: u16, parts: &[Part]) -> Vec<u8> {
    let u24 = |number: u32| number.to_le_bytes()[..3].to_vec();
    let chunk = |kind: &[u8], data: &[u8]| {
        let mut chunk = [kind, &(data.len() as u32).to_le_bytes(), data].concat();
        chunk.extend(std::iter::repeat_n(0, data.len() % 2));
        chunk
    };
    let mut body = b"WEBP".to_vec();
    body.extend(chunk(b"VP8X", &[vec![0x12, 0, 0, 0], u24(width - 1), u24(height - 1)].concat()));
    body.extend(chunk(b"ANIM", &[&[255, 255, 255, 255], &times.to_le_bytes()[..]].concat()));
    for Part { at: [left, top], picture, overwrites, disposed } in parts {
        let mut file = Vec::new();
        let (columns, rows) = picture.dimensions();
        image_webp::WebPEncoder::new(&mut file)
            .encode(picture, columns, rows, image_webp::ColorType::Rgba8)
            .unwrap();
        let mut data = [left / 2, top / 2, columns - 1, rows - 1, 70].map(u24).concat();
        data.push(u8::from(*disposed) | u8::from(*overwrites) << 1);
        data.extend(&file[12..]);
        body.extend(chunk(b"ANMF", &data));
    }
    chunk(b"RIFF", &body)
}

fn square(color: Rgba<u8>) -> RgbaImage {
    RgbaImage::from_pixel(4, 4, color)
}

/// The frames of an APNG.
fn frames(file: &[u8]) -> Vec<RgbaImage> {
    let decoder = image::codecs::png::PngDecoder::new(std::io::Cursor::new(file)).unwrap();
    decoder.apng().unwrap().into_frames().map(|frame| frame.unwrap().into_buffer()).collect()
}

#[test]
fn a_webp_frame_that_is_disposed_of_is_gone_in_the_next() {
    let part =
        |left, color, disposed| Part { at: [left, 0], picture: square(color), overwrites: false, disposed };
    let file = webp(
        [12, 4],
        0,
        &[part(0, RED, true), part(4, BLUE, false), part(8, RED, true), part(0, BLUE, false)],
    );
    let folder = Folder::with("a.webp", file);
    folder.rayfold("encode a.webp -o a.apng").assert().code(0);
    let colors: Vec<_> = frames(&folder.read("a.apng"))
        .iter()
        .map(|frame| [0, 4, 8].map(|left| *frame.get_pixel(left, 2)))
        .collect();
    assert_eq!(colors, [[RED, CLEAR, CLEAR], [CLEAR, BLUE, CLEAR], [CLEAR, BLUE, RED], [BLUE, BLUE, CLEAR]]);
}

#[test]
fn a_webp_frame_that_is_blended_keeps_what_is_below_it_exactly() {
    let below = RgbaImage::from_fn(16, 16, |x, y| Rgba([(16 * x + y) as u8, 255 - y as u8, 255, 255]));
    let mut above = RgbaImage::new(8, 8);
    above.put_pixel(3, 3, RED);
    let parts = [
        Part { at: [0, 0], picture: below.clone(), overwrites: true, disposed: false },
        Part { at: [4, 6], picture: above, overwrites: false, disposed: false },
        Part { at: [4, 6], picture: square(CLEAR), overwrites: true, disposed: false },
    ];
    let folder = Folder::with("a.webp", webp([16, 16], 0, &parts));
    folder.rayfold("encode a.webp -o a.apng").assert().code(0);
    let mut expected = below;
    let shown = frames(&folder.read("a.apng"));
    assert!(shown[0] == expected);
    expected.put_pixel(7, 9, RED);
    assert!(shown[1] == expected);
    (4..8).for_each(|x| (6..10).for_each(|y| expected.put_pixel(x, y, CLEAR)));
    assert!(shown[2] == expected, "what overwrites is taken as it is, and keeps the rest");
}

#[test]
fn a_webp_frame_beyond_its_canvas_is_an_error() {
    let part = |at| Part { at, picture: square(RED), overwrites: true, disposed: false };
    let folder = Folder::with("a.webp", webp([8, 4], 0, &[part([0, 0]), part([6, 0])]));
    let output = folder.rayfold("encode a.webp -o a.gif").assert().code(1).get_output().stderr.clone();
    let said = String::from_utf8(output).unwrap();
    assert!(
        said.contains("cannot read a.webp: a frame of 4 x 4 pixels at 6, 0 is beyond the picture"),
        "{said}"
    );
    assert!(!folder.join("a.gif").exists());
}

/// Returns what is behind a text of a file: the field of a format.
fn field(file: &[u8], name: &[u8], offset: usize, length: usize) -> Vec<u8> {
    let at = file.windows(name.len()).position(|window| window == name).unwrap() + name.len() + offset;
    file[at..at + length].to_vec()
}

#[test]
fn a_single_animated_file_keeps_how_often_it_is_shown() {
    let folder = Folder::new();
    for (name, repeat) in
        [("once", None), ("thrice", Some(Repeat::Finite(2))), ("ever", Some(Repeat::Infinite))]
    {
        let mut file = Vec::new();
        let mut encoder = GifEncoder::new(&mut file);
        if let Some(repeat) = repeat {
            encoder.set_repeat(repeat).unwrap();
        }
        for color in [RED, BLUE] {
            let delay = Delay::from_numer_denom_ms(200, 1);
            encoder.encode_frame(Frame::from_parts(square(color), 0, 0, delay)).unwrap();
        }
        drop(encoder);
        folder.write(&format!("{name}.gif"), file);
    }
    let apng = |from: &str, flags: &str| {
        folder.rayfold(&format!("encode {from} -o out.apng {flags}")).assert().code(0);
        u32::from_be_bytes(field(&folder.read("out.apng"), b"acTL", 4, 4).try_into().unwrap())
    };
    assert_eq!(["once.gif", "thrice.gif", "ever.gif"].map(|from| apng(from, "")), [1, 3, 0]);
    assert_eq!(apng("thrice.gif", "--loop 0"), 0);
    assert_eq!(apng("once.gif --no-sort thrice.gif", ""), 0, "of several files none decides");
    // By way of each format.
    folder.rayfold("encode thrice.gif -o thrice.webp").assert().code(0);
    assert_eq!(field(&folder.read("thrice.webp"), b"ANIM", 8, 2), 3_u16.to_le_bytes());
    folder.rayfold("encode thrice.webp -o again.apng").assert().code(0);
    assert_eq!(apng("again.apng", ""), 3);
    folder.rayfold("encode again.apng -o again.gif").assert().code(0);
    assert_eq!(field(&folder.read("again.gif"), b"NETSCAPE2.0", 2, 2), 2_u16.to_le_bytes());
}

#[test]
fn other_settings_than_durations_are_reported() {
    let folder = Folder::new();
    for (name, color) in [("a.png", RED), ("b.png", BLUE)] {
        square(color).save(folder.join(name)).unwrap();
    }
    folder.write("all.json", r#"{"fps": 5, "durations": {"2": 0.5}, "bounce": true}"#);
    let run = folder.rayfold("encode a.png b.png -o o.gif --durations all.json").assert().code(0);
    let text = String::from_utf8_lossy(&run.get_output().stderr).into_owned();
    assert!(text.contains("of all.json only \"durations\" is read, not bounce, fps"), "{text}");
    folder.write("none.json", r#"{"fps": 5, "loop": 2}"#);
    let run = folder.rayfold("encode a.png b.png -o o.gif --durations none.json").assert().code(1);
    let text = String::from_utf8_lossy(&run.get_output().stderr).into_owned();
    assert!(text.contains("none.json has no \"durations\": expected seconds by frame"), "{text}");
}

#[test]
fn times_of_an_apng_are_kept_as_fractions() {
    let folder =
        Folder::with("a.txt", "Screen 8 6\nFrames 1 4\nSphere 1 (1:1 4:7) 3 -5  1 0 0  0 0 0\nTrace\n");
    let mut times = Vec::new();
    for fps in ["30000/1001", "80", "3"] {
        folder.rayfold(&format!("render a.txt -o a.apng --fps {fps}")).assert().code(0);
        folder.rayfold("encode a.apng -o b.apng").assert().code(0);
        folder.rayfold("encode b.apng -o c.apng").assert().code(0);
        // Behind the number of the frame, its size and its place.
        let time = |name: &str| field(&folder.read(name), b"fcTL", 20, 4);
        assert_eq!(time("a.apng"), time("b.apng"), "{fps}");
        assert_eq!(time("a.apng"), time("c.apng"), "{fps}");
        times.push(time("a.apng"));
    }
    assert_eq!(times, [[1001_u16, 30_000], [1, 80], [1, 3]].map(|time| time.map(u16::to_be_bytes).concat()));
}

#[test]
fn pictures_of_unlike_sizes_are_an_error_in_every_output() {
    let folder = Folder::new();
    RgbaImage::from_pixel(9, 6, RED).save(folder.join("land.png")).unwrap();
    RgbaImage::from_pixel(6, 9, BLUE).save(folder.join("port.png")).unwrap();
    RgbaImage::from_pixel(3, 2, BLUE).save(folder.join("small.png")).unwrap();
    for output in ["o.gif", "o.apng", "o.webp", "o.y4m"] {
        for (files, said) in [
            ("land.png port.png", "6 x 9 pixels, the frames before it are 9 x 6"),
            ("land.png small.png", "3 x 2 pixels, the frames before it are 9 x 6"),
            ("small.png land.png", "9 x 6 pixels, the frames before it are 3 x 2"),
        ] {
            let run = folder.rayfold(&format!("encode --no-sort {files} -o {output}")).assert().code(1);
            let text = String::from_utf8_lossy(&run.get_output().stderr).into_owned();
            let second = files.split(' ').nth(1).unwrap();
            assert!(text.contains(said) && text.contains(&format!("{second}: ")), "{output}: {text}");
            assert!(!folder.join(output).exists(), "{output}");
        }
    }
}

#[test]
fn a_photo_that_is_cut_off_is_an_error() {
    let folder = Folder::new();
    let photo =
        image::RgbImage::from_fn(64, 64, |x, y| image::Rgb([(x * 4) as u8, (y * 4) as u8, (x ^ y) as u8]));
    photo.save(folder.join("whole.jpg")).unwrap();
    let whole = folder.read("whole.jpg");
    folder.rayfold("encode whole.jpg -o whole.apng").assert().code(0);
    for share in [0.3, 0.6, 0.9, 0.999] {
        folder.write("cut.jpg", &whole[..(whole.len() as f64 * share) as usize]);
        let run = folder.rayfold("encode cut.jpg -o cut.apng").assert().code(1);
        let text = String::from_utf8_lossy(&run.get_output().stderr).into_owned();
        assert!(text.contains("cannot read cut.jpg: "), "{share}: {text}");
        assert!(!folder.join("cut.apng").exists());
    }
}

#[test]
fn a_file_that_claims_to_be_huge_is_refused_by_its_header() {
    let folder = Folder::new();
    let gif = |screen: u16, frame: u16| {
        let (screen, frame) =
            ([screen, screen].map(u16::to_le_bytes).concat(), [frame, frame].map(u16::to_le_bytes).concat());
        let start = [&b"GIF89a"[..], &screen, &[0x80, 0, 0, 0, 0, 0, 255, 255, 255]].concat();
        [&start[..], &[0x2c, 0, 0, 0, 0], &frame, &[0, 2, 2, 0x44, 1, 0, 0x3b]].concat()
    };
    for (name, file) in [("screen.gif", gif(65_535, 1)), ("frame.gif", gif(1, 65_535))] {
        folder.write(name, file);
        let run = folder.rayfold(&format!("encode {name} -o o.gif")).assert().code(1);
        let text = String::from_utf8_lossy(&run.get_output().stderr).into_owned();
        assert!(
            text.contains(&format!("{name}: it has 65535 x 65535 pixels: expected at most 64000000")),
            "{text}"
        );
    }
}
