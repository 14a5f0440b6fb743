//! `rayfold render` for other programs: YUV4MPEG2 and APNG, decoded here by independent code.

use std::io::Cursor;
use std::process::{Command, Stdio};

use image::AnimationDecoder;
use image::codecs::png::PngDecoder;
use snapbox::str;

use crate::{Folder, RAYFOLD, ball_at};

fn balls(count: usize) -> Folder {
    let folder = Folder::new();
    for step in 1..=count {
        folder.write(&format!("balls/f{step}.txt"), ball_at(step));
    }
    folder.rayfold("render balls -o %d.png").assert().code(0);
    folder
}

/// Returns the pixels of a Y4M's frames, by the formulas of BT.601.
fn decode_y4m(bytes: &[u8], size: (usize, usize)) -> Vec<Vec<[f64; 3]>> {
    let mut rest = bytes;
    let mut frames = Vec::new();
    while !rest.is_empty() {
        let (mark, planes) = rest.split_at(6);
        assert_eq!(mark, b"FRAME\n");
        let count = size.0 * size.1;
        let at = |plane: usize, pixel: usize| f64::from(planes[plane * count + pixel]);
        let pixels = (0..count).map(|k| {
            let y = (at(0, k) - 16.0) / 219.0;
            let (pb, pr) = ((at(1, k) - 128.0) / 224.0, (at(2, k) - 128.0) / 224.0);
            let (r, b) = (y + 1.402 * pr, y + 1.772 * pb);
            [r, (y - 0.299 * r - 0.114 * b) / 0.587, b].map(|c| 255.0 * c)
        });
        frames.push(pixels.collect());
        rest = &planes[3 * count..];
    }
    frames
}

#[test]
fn a_video_encoder_gets_every_frame_in_full_colour() {
    let folder = balls(4);
    folder.rayfold("render balls -o balls.y4m --fps 12.5").assert().code(0);
    let file = folder.read("balls.y4m");
    let end = file.iter().position(|byte| *byte == b'\n').unwrap();
    let header = std::str::from_utf8(&file[..end]).unwrap();
    assert_eq!(header, "YUV4MPEG2 W24 H16 F25:2 Ip A1:1 C444 XCOLORRANGE=LIMITED");
    let frames = decode_y4m(&file[end + 1..], (24, 16));
    assert_eq!(frames.len(), 4);
    for (number, frame) in (1..).zip(&frames) {
        let image = folder.image(&format!("{number}.png"));
        for (pixel, seen) in image.pixels().zip(frame) {
            let near = (0..3).all(|c| (f64::from(pixel[c]) - seen[c]).abs() < 2.0);
            assert!(near, "frame {number}: {pixel:?} is {seen:?}");
        }
    }
}

#[test]
fn standard_output_is_the_same_video_and_nothing_else() {
    let folder = balls(3);
    folder.rayfold("render balls -o file.y4m").assert().code(0);
    let out = folder.rayfold("render balls -o -").assert().code(0).get_output().clone();
    assert!(out.stdout == folder.read("file.y4m"));
    let said = String::from_utf8(out.stderr).unwrap();
    assert!(said.starts_with("standard output: 3 frames of 24 x 16, "), "{said}");
    // A script with an error produces no output for a program.
    folder.write("balls/f2.txt", "Trce");
    folder.rayfold("render balls -o -").assert().code(1).stdout_eq("");
}

#[cfg(unix)]
#[test]
fn a_player_that_is_closed_is_no_error() {
    let folder = balls(1);
    folder.write("long.txt", ball_at(1).replace("24, 16", "600, 400") + &"Trace\n".repeat(40));
    let mut rayfold = Command::new(RAYFOLD)
        .args(["render", "long.txt", "-o", "-"])
        .current_dir(folder.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(rayfold.stdout.take());
    let output = rayfold.wait_with_output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{said}");
    assert!(said.starts_with("the reader of standard output has closed it after "), "{said}");
}

#[test]
fn a_browser_gets_every_frame_without_loss() {
    let folder = balls(5);
    folder.rayfold("render balls -o balls.apng --fps 12.5 --loop 2 --final-delay 1.5").assert().code(0);
    let file = folder.read("balls.apng");
    let decoder = PngDecoder::new(Cursor::new(&file)).unwrap();
    assert!(decoder.is_apng().unwrap());
    let frames = decoder.apng().unwrap().into_frames().collect_frames().unwrap();
    assert_eq!(frames.len(), 5);
    for (number, frame) in (1..).zip(&frames) {
        let shown = image::DynamicImage::ImageRgba8(frame.buffer().clone()).into_rgb8();
        assert_eq!(shown, folder.image(&format!("{number}.png")), "frame {number}");
        let (parts, whole) = frame.delay().numer_denom_ms();
        assert_eq!(parts / whole, if number == 5 { 1_500 } else { 80 }, "frame {number}");
    }
    // acTL: the number of frames and of repetitions.
    let at = file.windows(4).position(|word| word == b"acTL").unwrap() + 4;
    let number = |at: usize| u32::from_be_bytes(file[at..at + 4].try_into().unwrap());
    assert_eq!((number(at), number(at + 4)), (5, 3));
}

#[test]
fn flags_that_a_video_has_no_room_for_are_refused() {
    let folder = balls(1);
    for flag in ["--loop 2", "--once", "--final-delay 2"] {
        let out = folder.rayfold(&format!("render balls -o a.y4m {flag}")).assert().code(2);
        let said = String::from_utf8(out.get_output().stderr.clone()).unwrap();
        assert!(said.contains("are for .gif, .apng and .webp"), "{said}");
    }
    folder.rayfold("render balls -o %d.apng").assert().code(2);
}

#[test]
fn a_webp_is_every_frame_without_loss() {
    let folder = balls(5);
    folder.rayfold("render balls -o balls.webp --fps 12.5 --loop 2 --final-delay 1.5").assert().code(0);
    let file = folder.read("balls.webp");
    assert_eq!(u32::from_le_bytes(file[4..8].try_into().unwrap()) as usize, file.len() - 8);
    let mut decoder = image_webp::WebPDecoder::new(Cursor::new(&file)).unwrap();
    assert!(decoder.is_animated() && !decoder.is_lossy() && !decoder.has_alpha());
    assert_eq!((decoder.dimensions(), decoder.num_frames()), ((24, 16), 5));
    assert_eq!(decoder.loop_count(), image_webp::LoopCount::Times(std::num::NonZeroU16::new(3).unwrap()));
    for number in 1..=5 {
        let mut pixels = vec![0; 24 * 16 * 3];
        let ms = decoder.read_frame(&mut pixels).unwrap();
        assert_eq!(pixels, folder.image(&format!("{number}.png")).into_raw(), "frame {number}");
        assert_eq!(ms, if number == 5 { 1_500 } else { 80 }, "frame {number}");
    }
    // Read back by this program, too.
    folder.rayfold("render balls -o balls.gif --fps 12.5 --loop 2 --final-delay 1.5").assert().code(0);
    folder.rayfold("encode balls.webp -o parts.gif").assert().code(0);
    assert!(folder.read("parts.gif") == folder.read("balls.gif"));
    // Above 90 frames a second as an APNG.
    let out = folder.rayfold("render balls -o fast.webp --fps 200").assert().code(0);
    let said = String::from_utf8_lossy(&out.get_output().stderr).into_owned();
    assert!(said.contains("browsers show at most 90 frames of a WebP a second, not 200"), "{said}");
    folder.write("wide.txt", "Screen 20000 2\nTrace");
    let out = folder.rayfold("render wide.txt -o wide.webp").assert().code(1);
    let said = String::from_utf8_lossy(&out.get_output().stderr).into_owned();
    assert!(said.contains("a WebP has 16384 pixels on a side at most, not 20000 x 2"), "{said}");
    assert!(!folder.join("wide.webp").exists());
}

/// Browsers show a frame of 10 ms or less for 100 ms.
#[test]
fn an_apng_of_many_frames_a_second_takes_its_time_and_ends_with_its_last_frame() {
    let folder = balls(12);
    for (fps, count) in [(50, 12), (60, 12), (90, 12), (95, 6), (100, 6), (120, 5), (200, 3), (1_000, 1)] {
        for (flag, last_ms) in [("", None), (" --final-delay 2", Some(2_000.0))] {
            folder.rayfold(&format!("render balls -o a.apng --fps {fps}{flag}")).assert().code(0);
            let file = folder.read("a.apng");
            let decoder = PngDecoder::new(Cursor::new(&file)).unwrap();
            let frames = decoder.apng().unwrap().into_frames().collect_frames().unwrap();
            assert_eq!(frames.len(), count, "{fps} frames a second");
            let delays = frames.iter().map(|frame| {
                let (parts, whole) = frame.delay().numer_denom_ms();
                f64::from(parts) / f64::from(whole)
            });
            let mut delays = delays.collect::<Vec<_>>();
            let last = delays.pop().unwrap();
            assert!(last_ms.is_none_or(|ms| (last - ms).abs() < 0.1), "{fps}: {last} ms");
            delays.extend(last_ms.is_none().then_some(last));
            assert!(delays.iter().all(|&ms| ms >= 11.0), "{fps} frames a second: {delays:?}");
            let shown = frames.last().unwrap().buffer().clone();
            let shown = image::DynamicImage::ImageRgba8(shown).into_rgb8();
            assert_eq!(shown, folder.image("12.png"), "{fps} frames a second");
        }
    }
    folder.rayfold("render balls -o a.apng --fps 100").assert().code(0).stderr_eq(str![[r#"
a.apng: 6 frames of 24 x 16, [..]B, in [..] s
6 frames left out: browsers show at most 90 frames of an APNG a second, not 100

"#]]);
}

#[test]
fn only_a_gif_is_asked_to_be_exact() {
    let folder = balls(2);
    folder.rayfold("render balls -o a.gif --exact").assert().code(0);
    for name in ["a.apng", "a.y4m", "%d.png"] {
        folder.rayfold(&format!("render balls -o {name} --exact")).assert().code(2).stderr_eq(str![[r#"
error: --exact is for .gif: every other output keeps all colours of a frame

"#]]);
    }
}
