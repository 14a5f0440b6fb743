//! Frames without background: alpha in each output, a matte in its place, and animations of both kinds of frames.

use image::codecs::gif::GifDecoder;
use image::codecs::png::PngDecoder;
use image::codecs::webp::WebPDecoder;
use image::{AnimationDecoder, DynamicImage, RgbImage, Rgba, RgbaImage};

use crate::Folder;

/// A red ball and a disc of glass on nothing, 24 x 16 pixels.
fn clear(step: usize) -> String {
    format!(
        "Screen 24 16\nCamera 0 0 5  0 0 -1  0 1 0  1  -.3 -.2 .3 .2\nBackground none\nSamples 16 0\n\
         Material pane glass .8 .4 0 1\nSphere .6  {} 0 0  .8 .2 .1  0 0 0\nDisc .5  .8 .3 0  0 0 1  pane\nTrace\n",
        -1.0 + 0.2 * step as f64
    )
}

/// A folder with three frames on nothing, and one on grey in their midst.
fn mixed() -> Folder {
    let folder = Folder::new();
    for step in [1, 2, 4] {
        folder.write(&format!("balls/f{step}.txt"), clear(step));
    }
    folder.write("balls/f3.txt", clear(3).replace("Background none", "Background .2 .2 .2"));
    folder.rayfold("render balls -o %d.png").assert().code(0);
    folder
}

/// Returns the frames as they are shown.
fn shown(folder: &Folder, name: &str) -> Vec<RgbaImage> {
    let file = std::io::Cursor::new(folder.read(name));
    let frames = match name.rsplit_once('.').unwrap().1 {
        "gif" => GifDecoder::new(file).unwrap().into_frames(),
        "webp" => WebPDecoder::new(file).unwrap().into_frames(),
        _ => PngDecoder::new(file).unwrap().apng().unwrap().into_frames(),
    };
    frames.map(|frame| frame.unwrap().into_buffer()).collect()
}

fn picture(folder: &Folder, name: &str) -> DynamicImage {
    image::open(folder.join(name)).unwrap()
}

#[test]
fn a_picture_has_alpha_where_nothing_is_in_front() {
    let folder = Folder::with("a.txt", clear(2));
    folder.rayfold("render a.txt -o a.png").assert().code(0).stderr_eq("a.png: [..]\n");
    folder.rayfold("render a.txt -o a.tif").assert().code(0);
    let DynamicImage::ImageRgba8(png) = picture(&folder, "a.png") else { panic!("no alpha") };
    assert_eq!(png.get_pixel(0, 0).0, [0; 4]);
    assert_eq!(png.get_pixel(9, 8).0, [204, 51, 26, 255]);
    // Glass of an index of 1 covers what its mean takes away, and is black there.
    assert_eq!(png.get_pixel(18, 6).0, [0, 0, 0, 153]);
    assert!(png.pixels().any(|pixel| (1..255).contains(&pixel[3]) && pixel.0[..3] == [204, 51, 26]));
    assert_eq!(picture(&folder, "a.tif"), DynamicImage::ImageRgba8(png));
}

#[test]
fn a_matte_is_in_place_of_nothing() {
    let folder = Folder::with("a.txt", clear(2));
    folder.rayfold("render a.txt -o a.png").assert().code(0);
    folder.rayfold("render a.txt -o over.png --matte #ff8000").assert().code(0);
    let DynamicImage::ImageRgb8(over) = picture(&folder, "over.png") else { panic!("it has alpha") };
    let seen = picture(&folder, "a.png").into_rgba8();
    for (pixel, over) in seen.pixels().zip(over.pixels()) {
        let alpha = f64::from(pixel[3]) / 255.0;
        for (k, matte) in [255.0, 128.0, 0.0].into_iter().enumerate() {
            let mixed = f64::from(pixel[k]) * alpha + matte * (1.0 - alpha);
            assert!((mixed - f64::from(over[k])).abs() <= 1.0, "{pixel:?} {over:?}");
        }
    }
    // A format without alpha is over black.
    folder.rayfold("render a.txt -o black.png --matte #000000").assert().code(0);
    folder.rayfold("render a.txt -o a.y4m").assert().code(0);
    folder.rayfold("encode black.png -o b.y4m").assert().code(0);
    assert!(folder.read("a.y4m") == folder.read("b.y4m"));
    folder.rayfold("render a.txt -o a.png --matte red").assert().code(2).stderr_eq(
        "error: invalid value 'red' for '--matte <#RRGGBB>': expected # and six hexadecimal digits in quotes, such as \
         '#ffffff'\n\nFor more information, try '--help'.\n",
    );
    folder.write("b.txt", clear(2).replace("Background none", "Background 0 0 1"));
    folder
        .rayfold("render b.txt -o b.png --matte #ff0000")
        .assert()
        .code(0)
        .stderr_eq("warning: --matte has no effect: no frame has `Background none`\nb.png: [..]\n");
}

#[test]
fn animations_may_have_frames_with_and_without_a_background() {
    let folder = mixed();
    for name in ["a.apng", "a.webp", "a.gif"] {
        folder.rayfold(&format!("render balls -o {name}")).assert().code(0);
        let frames = shown(&folder, name);
        assert_eq!(frames.len(), 4, "{name}");
        for (number, frame) in (1..).zip(&frames) {
            let picture = picture(&folder, &format!("{number}.png"));
            assert_eq!(picture.color().has_alpha(), number != 3);
            for (seen, meant) in frame.pixels().zip(picture.into_rgba8().pixels()) {
                if name == "a.gif" {
                    assert!(seen[3] == 0 || seen[3] == 255 && seen.0[..3] == meant.0[..3], "{number}");
                    assert!(!matches!(meant[3], 0 | 255) || seen[3] == meant[3], "{number}");
                } else {
                    assert_eq!(seen, meant, "{name} {number}");
                }
            }
        }
    }
    // Over a matte no file has alpha.
    folder.rayfold("render balls -o m.apng --matte #ffffff").assert().code(0);
    assert!(shown(&folder, "m.apng").iter().all(|frame| frame.pixels().all(|pixel| pixel[3] == 255)));
    let header =
        png::Decoder::new(std::io::Cursor::new(folder.read("m.apng"))).read_info().unwrap().info().color_type;
    assert_eq!(header, png::ColorType::Rgb);
}

#[test]
fn a_file_that_must_fit_keeps_its_alpha() {
    let folder = Folder::new();
    for step in 1..=5 {
        // A ball with shades, whose levels can be fewer.
        let lit = clear(step).replace("24 16", "120 80").replace(".8 .2 .1  0 0 0", ".1 0 0  .8 .6 .4");
        folder.write(&format!("balls/f{step}.txt"), lit.replace("Trace", "Ilight 1 1 1  -1 -1 -1\nTrace"));
    }
    folder.rayfold("render balls -o whole.webp").assert().code(0);
    let most = folder.read("whole.webp").len() * 9 / 10;
    folder.rayfold(&format!("render balls -o a.webp --max-size {most}")).assert().code(0);
    assert!(folder.read("a.webp").len() <= most);
    let (whole, fits) = (shown(&folder, "whole.webp"), shown(&folder, "a.webp"));
    let alpha = |frame: &RgbaImage| frame.pixels().map(|pixel| pixel[3]).collect::<Vec<u8>>();
    assert!(whole.iter().zip(&fits).all(|(a, b)| alpha(a) == alpha(b)));
}

#[test]
fn encode_keeps_what_is_transparent() {
    let folder = mixed();
    for ending in ["gif", "apng", "webp"] {
        folder.rayfold(&format!("render balls -o a.{ending}")).assert().code(0);
        folder.rayfold(&format!("encode 1.png 2.png 3.png 4.png -o b.{ending}")).assert().code(0);
        assert!(folder.read(&format!("a.{ending}")) == folder.read(&format!("b.{ending}")), "{ending}");
    }
    // From one format to another, and on to opaque pictures.
    folder.rayfold("encode a.apng -o c.webp").assert().code(0);
    assert!(shown(&folder, "c.webp") == shown(&folder, "a.apng"));
    folder.rayfold("encode a.apng -o d.apng --matte #0000ff").assert().code(0);
    assert_eq!(shown(&folder, "d.apng")[0].get_pixel(0, 0), &Rgba([0, 0, 255, 255]));
    folder.rayfold("encode a.gif -o e.gif").assert().code(0);
    assert!(shown(&folder, "e.gif") == shown(&folder, "a.gif"));
    RgbImage::new(3, 2).save(folder.join("opaque.png")).unwrap();
    folder.rayfold("encode opaque.png -o f.apng").assert().code(0);
    let file = folder.read("f.apng");
    let reader = png::Decoder::new(std::io::Cursor::new(file)).read_info().unwrap();
    assert_eq!(reader.info().color_type, png::ColorType::Rgb, "no alpha where there is none");
}
