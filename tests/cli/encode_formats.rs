//! `rayfold encode` of files that other programs write: JPEG, WebP, animations and videos, also from standard input.

use image::codecs::gif::GifEncoder;
use image::{Delay, DynamicImage, Frame, ImageFormat, Rgb, RgbImage};

use crate::{Folder, ball_at, decode_gif};

/// A picture without fine detail, which lossy formats keep well.
fn smooth(shift: u32) -> RgbImage {
    RgbImage::from_fn(48, 32, |x, y| Rgb([(2 * x + 20 * shift) as u8, (4 * y) as u8, 90]))
}

fn is_near(a: &RgbImage, b: &RgbImage, levels: u8) -> bool {
    a.dimensions() == b.dimensions()
        && a.pixels().zip(b.pixels()).all(|(a, b)| (0..3).all(|c| a[c].abs_diff(b[c]) <= levels))
}

fn balls(count: usize) -> Folder {
    let folder = Folder::new();
    for step in 1..=count {
        folder.write(&format!("balls/f{step}.txt"), ball_at(step));
    }
    folder.rayfold("render balls -o %d.png").assert().code(0);
    folder
}

#[test]
fn photos_are_frames() {
    let folder = Folder::new();
    let image = smooth(1);
    image.save(folder.join("a.png")).unwrap();
    image.save(folder.join("b.jpg")).unwrap();
    image.save(folder.join("c.webp")).unwrap();
    folder.rayfold("encode a.png b.jpg c.webp -o out.gif").assert().code(0);
    let shown = decode_gif(&folder.read("out.gif"));
    assert_eq!(shown.len(), 3);
    for (frame, _) in &shown {
        assert!(is_near(frame, &image, 16));
    }
    // Cut off, each is an error with its name.
    for name in ["b.jpg", "c.webp"] {
        let whole = folder.read(name);
        folder.write(name, &whole[..20]);
        let out = folder.rayfold(&format!("encode {name} -o half.gif")).assert().code(1);
        let said = String::from_utf8_lossy(&out.get_output().stderr).into_owned();
        assert!(said.contains(&format!("cannot read {name}: ")), "{said}");
    }
}

#[test]
fn an_animated_gif_keeps_its_times() {
    let folder = Folder::new();
    let mut file = Vec::new();
    let mut encoder = GifEncoder::new(&mut file);
    for (number, ms) in [(0, 500), (1, 40), (2, 0)] {
        let buffer = DynamicImage::from(RgbImage::from_pixel(9, 5, Rgb([60 * number, 0, 9]))).into_rgba8();
        let delay = Delay::from_numer_denom_ms(ms, 1);
        encoder.encode_frame(Frame::from_parts(buffer, 0, 0, delay)).unwrap();
    }
    drop(encoder);
    folder.write("a.gif", file);
    let delays = |flags: &str| {
        folder.rayfold(&format!("encode a.gif -o out.gif {flags}")).assert().code(0);
        let shown = decode_gif(&folder.read("out.gif"));
        for (number, (frame, _)) in shown.iter().enumerate() {
            assert_eq!(frame.get_pixel(3, 3).0, [60 * number as u8, 0, 9]);
        }
        shown.into_iter().map(|(_, delay)| delay).collect::<Vec<_>>()
    };
    // A frame without a time is shown as players show it.
    assert_eq!(delays(""), [50, 4, 10]);
    assert_eq!(delays("--fps 20"), [5, 5, 5]);
    // An animation to an animation and back.
    folder.rayfold("encode a.gif -o a.apng").assert().code(0);
    folder.rayfold("encode a.apng -o b.gif").assert().code(0);
    folder.rayfold("encode a.gif -o c.gif").assert().code(0);
    assert!(folder.read("b.gif") == folder.read("c.gif"));
}

#[test]
fn a_video_is_its_frames_at_its_rate() {
    let folder = balls(4);
    folder.rayfold("render balls -o balls.y4m --fps 12.5").assert().code(0);
    folder.rayfold("encode balls.y4m -o out.gif").assert().code(0);
    let shown = decode_gif(&folder.read("out.gif"));
    assert_eq!(shown.len(), 4);
    for (number, (frame, delay)) in (1..).zip(&shown) {
        assert_eq!(*delay, 8);
        assert!(is_near(frame, &folder.image(&format!("{number}.png")), 6), "frame {number}");
    }
    // From a pipe, frame by frame.
    let out = folder.rayfold("encode - -o -").stdin(folder.read("balls.y4m")).assert().code(0);
    assert!(out.get_output().stdout == folder.read("out.gif"));
    // Cut off in a frame.
    let whole = folder.read("balls.y4m");
    let out =
        folder.rayfold("encode - -o half.gif").stdin(whole[..whole.len() - 9].to_vec()).assert().code(1);
    let said = String::from_utf8_lossy(&out.get_output().stderr).into_owned();
    assert!(said.contains("cannot read standard input: it is cut off"), "{said}");
    assert!(!folder.join("half.gif").exists());
}

#[test]
fn videos_of_fewer_colour_samples_and_of_grey_are_read() {
    let folder = Folder::new();
    // Mid-grey with a blue tinge: Y' 126, Cb 150, Cr 128.
    let frame = |luma: usize, chroma: usize| {
        [b"FRAME\n".to_vec(), vec![126; luma], vec![150; chroma], vec![128; chroma]].concat()
    };
    for (layout, chroma) in [("C420jpeg", 6), ("C420mpeg2", 6), ("C422", 9), ("C444", 15), ("", 6)] {
        let header = format!("YUV4MPEG2 W5 H3 F25:1 Ip A1:1 {layout}").trim_end().to_owned() + "\n";
        folder.write("a.y4m", [header.into_bytes(), frame(15, chroma)].concat());
        folder.rayfold("encode a.y4m -o out.gif").assert().code(0);
        let shown = &decode_gif(&folder.read("out.gif"))[0].0;
        let expected = RgbImage::from_pixel(5, 3, Rgb([128, 119, 172]));
        assert!(is_near(shown, &expected, 1), "{layout}: {:?}", shown.get_pixel(0, 0));
    }
    let grey = [b"YUV4MPEG2 W5 H3 F25:1 Cmono\nFRAME\n".to_vec(), vec![16; 15]].concat();
    folder.write("a.y4m", grey);
    folder.rayfold("encode a.y4m -o out.gif").assert().code(0);
    assert_eq!(decode_gif(&folder.read("out.gif"))[0].0.get_pixel(4, 2).0, [0; 3]);
    folder.write("a.y4m", b"YUV4MPEG2 W5 H3 F25:1 C420p10\nFRAME\n");
    let out = folder.rayfold("encode a.y4m -o out.gif").assert().code(1);
    let said = String::from_utf8_lossy(&out.get_output().stderr).into_owned();
    assert!(said.contains("expected 8 bits a sample, as by ffmpeg's -pix_fmt yuv444p"), "{said}");
}

#[test]
fn standard_input_is_an_image_too() {
    let folder = balls(2);
    folder.rayfold("encode 1.png 2.png -o files.gif").assert().code(0);
    let out = folder.rayfold("encode - 2.png --no-sort -o -").stdin(folder.read("1.png")).assert().code(0);
    assert!(out.get_output().stdout == folder.read("files.gif"));
    folder.rayfold("encode - - -o out.gif").stdin("").assert().code(2);
    let out = folder.rayfold("encode - -o out.gif").stdin("no image").assert().code(1);
    let said = String::from_utf8_lossy(&out.get_output().stderr).into_owned();
    assert!(said.contains("cannot read standard input: it is no image"), "{said}");
}

#[test]
fn what_an_image_may_become_is_said() {
    let folder = Folder::new();
    smooth(0).save_with_format(folder.join("a.png"), ImageFormat::Png).unwrap();
    let out = folder.rayfold("encode a.png -o b.png").assert().code(2);
    let said = String::from_utf8_lossy(&out.get_output().stderr).into_owned();
    assert!(said.contains("an animation is expected, such as .gif or .apng"), "{said}");
    let out = folder.rayfold("encode a.png -o b.mp4").assert().code(2);
    let said = String::from_utf8_lossy(&out.get_output().stderr).into_owned();
    assert!(said.contains("ffmpeg"), "{said}");
}
