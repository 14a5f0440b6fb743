//! Frames through the encoder and a decoder, back to frames.

use image::{Rgb, RgbImage};
use rayfold_gif::{Encoder, Error, Plays, Settings, Summary};

fn encode(frames: &[RgbImage], settings: Settings) -> Result<(Vec<u8>, Summary), Error> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, settings)?;
    for frame in frames {
        encoder.push(frame.clone())?;
    }
    let summary = encoder.finish()?;
    Ok((bytes, summary))
}

/// Returns the frames that a viewer shows, and their times in hundredths of a second.
fn decode(bytes: &[u8]) -> Vec<(RgbImage, u16)> {
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(bytes).unwrap();
    let mut canvas = RgbImage::new(decoder.width().into(), decoder.height().into());
    let mut drawn = vec![false; (canvas.width() * canvas.height()) as usize];
    let mut shown = Vec::new();
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        assert_eq!(frame.dispose, gif::DisposalMethod::Keep);
        for (k, rgba) in frame.buffer.chunks_exact(4).enumerate() {
            let x = u32::from(frame.left) + k as u32 % u32::from(frame.width);
            let y = u32::from(frame.top) + k as u32 / u32::from(frame.width);
            if rgba[3] > 0 {
                canvas.put_pixel(x, y, Rgb([rgba[0], rgba[1], rgba[2]]));
                drawn[(y * canvas.width() + x) as usize] = true;
            }
        }
        assert!(drawn.iter().all(|&drawn| drawn), "the first frame leaves no hole");
        shown.push((canvas.clone(), frame.delay));
    }
    shown
}

fn scatter(k: u32) -> u32 {
    let k = (k ^ k >> 16).wrapping_mul(0x7feb_352d);
    let k = (k ^ k >> 15).wrapping_mul(0x846c_a68b);
    k ^ k >> 16
}

fn noise(width: u32, height: u32, seed: u32) -> RgbImage {
    RgbImage::from_fn(width, height, |x, y| {
        let [r, g, b, _] = scatter(seed << 24 ^ y << 12 ^ x).to_le_bytes();
        Rgb([r, g, b])
    })
}

/// Returns a ball that moves over a gradient.
fn ball(width: u32, height: u32, at: u32) -> RgbImage {
    RgbImage::from_fn(width, height, |x, y| {
        let (dx, dy) = (x as f32 - (10 + 3 * at) as f32, y as f32 - height as f32 / 2.0);
        let d = (dx * dx + dy * dy).sqrt() / (height as f32 / 4.0);
        if d < 1.0 {
            let light = (1.0 - d * d).sqrt();
            Rgb([(250.0 * light) as u8, (120.0 * light) as u8, 40])
        } else {
            Rgb([(x * 255 / width) as u8, 60, (y * 255 / height) as u8])
        }
    })
}

fn psnr(a: &RgbImage, b: &RgbImage) -> f64 {
    let sum = a.as_raw().iter().zip(b.as_raw()).map(|(&a, &b)| f64::from(a.abs_diff(b)).powi(2)).sum::<f64>();
    10.0 * (255.0 * 255.0 * a.as_raw().len() as f64 / sum).log10()
}

#[test]
fn every_frame_in_order_with_its_delay() {
    let frames = (0..20).map(|k| ball(120, 80, k)).collect::<Vec<_>>();
    let (bytes, summary) = encode(&frames, Settings { fps: 30.0, ..Settings::default() }).unwrap();
    let shown = decode(&bytes);
    let delays = shown.iter().map(|(_, delay)| *delay).collect::<Vec<_>>();
    assert_eq!(delays, [3, 4, 3].iter().cycle().take(20).copied().collect::<Vec<_>>());
    for (k, (frame, (seen, _))) in frames.iter().zip(&shown).enumerate() {
        assert!(psnr(frame, seen) > 35.0, "frame {k}: {} dB", psnr(frame, seen));
    }
    let bytes = bytes.len() as u64;
    assert_eq!(summary, Summary { frames: 20, dropped: 0, size: (120, 80), duration_cs: 67, bytes });
}

#[test]
fn at_most_256_colours_are_exact() {
    let frames = (0..8).map(|k| {
        RgbImage::from_fn(40, 40, |x, y| {
            let [r, g, b, _] = scatter((x / 5 + 8 * (y / 5) + k) % 64 + 64 * k % 192).to_le_bytes();
            Rgb([r, g, b])
        })
    });
    let frames = frames.collect::<Vec<_>>();
    let (bytes, _) = encode(&frames, Settings::default()).unwrap();
    for (k, (frame, (seen, _))) in frames.iter().zip(decode(&bytes)).enumerate() {
        assert!(*frame == seen, "frame {k}");
    }
}

#[test]
fn a_frame_of_256_colours_after_another_is_exact() {
    let of = |offset: u32| {
        RgbImage::from_fn(16, 16, |x, y| {
            let [r, g, b, _] = scatter(x + 16 * y + offset).to_le_bytes();
            Rgb([r, g, b])
        })
    };
    let mut frames = vec![of(0), of(1_000)];
    frames.push(frames[1].clone());
    frames[2].put_pixel(3, 3, Rgb([1, 2, 3]));
    let (bytes, _) = encode(&frames, Settings::default()).unwrap();
    for (k, (frame, (seen, _))) in frames.iter().zip(decode(&bytes)).enumerate() {
        assert!(*frame == seen, "frame {k}");
    }
}

/// Returns a sky that brightens by a level per frame, and a cut.
fn brightening(width: u32, height: u32) -> Vec<RgbImage> {
    let sky = |time: u32| {
        let level = |x: u32, y: u32| (40 + (x + y) * 24 / (width + height) + time) as u8;
        RgbImage::from_fn(width, height, |x, y| Rgb([level(x, y), 60, (90 + time / 2) as u8]))
    };
    let cut = RgbImage::from_fn(width, height, |x, _| Rgb([(x * 24 / width) as u8, 200, 10]));
    (0..12).map(sky).chain([cut]).collect()
}

#[test]
fn few_colours_that_drift_are_near_and_small_and_a_cut_is_exact() {
    let frames = brightening(400, 300);
    let (bytes, _) = encode(&frames, Settings::default()).unwrap();
    let shown = decode(&bytes);
    assert!(frames[0] == shown[0].0 && frames[12] == shown[12].0);
    for (k, (frame, (seen, _))) in frames.iter().zip(&shown).enumerate() {
        assert!(frame == seen || psnr(frame, seen) > 44.0, "frame {k}: {} dB", psnr(frame, seen));
        let off = frame.iter().zip(seen.iter()).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(off <= Some(4), "frame {k} is off by {off:?} levels");
    }
    let (exact, _) = encode(&frames, Settings { exact: true, ..Settings::default() }).unwrap();
    assert!(bytes.len() * 3 < exact.len() * 2, "{} bytes, exact {}", bytes.len(), exact.len());
}

#[test]
fn few_colours_that_drift_are_exact_where_that_is_asked_for_or_the_picture_is_small() {
    let settings = Settings { exact: true, ..Settings::default() };
    for (size, settings) in [((400, 300), settings), ((320, 240), Settings::default())] {
        let frames = brightening(size.0, size.1);
        let (bytes, _) = encode(&frames, settings).unwrap();
        for (k, (frame, (seen, _))) in frames.iter().zip(decode(&bytes)).enumerate() {
            assert!(*frame == seen, "frame {k} of {size:?}");
        }
    }
}

#[test]
fn two_hundred_and_fifty_six_plain_frames_are_exact() {
    let frames = (0..=255).map(|level| RgbImage::from_pixel(20, 20, Rgb([level, 0, 0]))).collect::<Vec<_>>();
    let (bytes, _) = encode(&frames, Settings::default()).unwrap();
    for (k, (frame, (seen, _))) in frames.iter().zip(decode(&bytes)).enumerate() {
        assert!(*frame == seen, "frame {k}");
    }
}

#[test]
fn one_pixel_one_frame() {
    let frame = RgbImage::from_pixel(1, 1, Rgb([12, 34, 56]));
    let (bytes, summary) = encode(std::slice::from_ref(&frame), Settings::default()).unwrap();
    assert_eq!(decode(&bytes), [(frame, 10)]);
    assert_eq!((summary.frames, summary.duration_cs), (1, 10));
}

#[test]
fn identical_frames_are_all_there() {
    let frames = vec![ball(64, 48, 3); 12];
    let (bytes, summary) = encode(&frames, Settings { fps: 12.5, ..Settings::default() }).unwrap();
    let shown = decode(&bytes);
    assert_eq!(summary.frames, 12);
    assert!(shown.iter().all(|(_, delay)| *delay == 8));
    assert_eq!(shown.len(), 12);
}

#[test]
fn noise_of_any_shape() {
    for (width, height) in [(1, 300), (300, 1), (257, 3), (64, 64)] {
        let frames = (0..4).map(|k| noise(width, height, k)).collect::<Vec<_>>();
        let (bytes, _) = encode(&frames, Settings::default()).unwrap();
        for (frame, (seen, _)) in frames.iter().zip(decode(&bytes)) {
            assert!(psnr(frame, &seen) > 22.0, "{width} x {height}: {} dB", psnr(frame, &seen));
        }
    }
}

#[test]
fn the_longest_sides_fit_and_no_longer_ones() {
    for (width, height) in [(65_535, 1), (1, 65_535)] {
        let frame = RgbImage::from_fn(width, height, |x, y| Rgb([(x + y) as u8, 0, 0]));
        let (bytes, _) = encode(std::slice::from_ref(&frame), Settings::default()).unwrap();
        assert!(decode(&bytes)[0].0 == frame);
    }
    for (width, height) in [(65_536, 1), (1, 65_536), (0, 5), (5, 0)] {
        let error = encode(&[RgbImage::new(width, height)], Settings::default()).unwrap_err();
        assert!(matches!(error, Error::Size { frame: 1, .. }), "{error}");
    }
}

#[test]
fn a_frame_of_another_size_is_named() {
    let frames = [RgbImage::new(8, 6), RgbImage::new(8, 6), RgbImage::new(6, 8)];
    let error = encode(&frames, Settings::default()).unwrap_err();
    assert_eq!(error.to_string(), "frame 3 is 6 x 8 pixels, the frames before it are 8 x 6");
}

#[test]
fn no_frames_is_an_error() {
    assert!(matches!(encode(&[], Settings::default()), Err(Error::NoFrames)));
}

#[test]
fn too_many_frames_a_second_are_dropped_and_counted() {
    let frames = (0..100).map(|k| ball(40, 30, k)).collect::<Vec<_>>();
    let (bytes, summary) = encode(&frames, Settings { fps: 100.0, ..Settings::default() }).unwrap();
    assert_eq!((summary.frames, summary.dropped, summary.duration_cs), (50, 50, 100));
    assert_eq!(decode(&bytes).len(), 50);
}

#[test]
fn repeats_as_often_as_asked() {
    let bytes = |plays| encode(&[RgbImage::new(2, 2)], Settings { plays, ..Settings::default() }).unwrap().0;
    let repeat = |plays| gif::DecodeOptions::new().read_info(&bytes(plays)[..]).unwrap().repeat();
    assert_eq!(repeat(Plays::Endless), gif::Repeat::Infinite);
    assert_eq!(repeat(Plays::repeated(0)), gif::Repeat::Infinite);
    assert_eq!(repeat(Plays::repeated(7)), gif::Repeat::Finite(7));
    // The decoder returns 0 repetitions both for a file with that number (endless) and for one without any.
    let says = |bytes: &[u8]| bytes.windows(11).any(|word| word == b"NETSCAPE2.0");
    assert!(says(&bytes(Plays::Endless)) && !says(&bytes(Plays::Once)));
}

#[test]
fn the_last_frame_stays_as_long_as_asked() {
    for fps in [10.0, 80.0] {
        let frames = (0..9).map(|k| ball(40, 30, k)).collect::<Vec<_>>();
        let delays = |last_delay_cs| {
            let (bytes, summary) =
                encode(&frames, Settings { fps, last_delay_cs, ..Settings::default() }).unwrap();
            let delays: Vec<u16> = decode(&bytes).iter().map(|(_, delay)| *delay).collect();
            assert_eq!(summary.duration_cs, delays.iter().map(|delay| u64::from(*delay)).sum::<u64>());
            delays
        };
        let (mut plain, held) = (delays(None), delays(Some(250)));
        *plain.last_mut().unwrap() = 250;
        assert_eq!(held, plain, "{fps} frames a second");
    }
}

#[test]
fn an_animation_ends_with_its_last_frame_also_where_frames_are_dropped() {
    let frames = (0..12).map(|k| RgbImage::from_pixel(9, 5, Rgb([20 * k, 0, 0]))).collect::<Vec<_>>();
    for fps in [10.0, 50.0, 60.0, 80.0, 99.0, 100.0, 144.0, 200.0, 1_000.0] {
        for count in 1..=12 {
            for last_delay_cs in [None, Some(200)] {
                let settings = Settings { fps, last_delay_cs, ..Settings::default() };
                let (bytes, summary) = encode(&frames[..count], settings).unwrap();
                let shown = decode(&bytes);
                let (last, delay) = &shown[shown.len() - 1];
                assert!(*last == frames[count - 1], "{count} frames, {fps} a second");
                assert!(last_delay_cs.is_none_or(|asked| asked == *delay), "{delay}");
                assert_eq!(summary.frames + summary.dropped, count as u64);
                assert_eq!(summary.frames, shown.len() as u64);
            }
        }
    }
}

#[test]
fn same_bytes_for_any_number_of_threads() {
    let frames = (0..6).map(|k| ball(200, 150, k)).chain([noise(200, 150, 9)]).collect::<Vec<_>>();
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| encode(&frames, Settings::default()).unwrap().0)
    };
    let one = with(1);
    for threads in [2, 3, 8] {
        assert!(with(threads) == one, "{threads} threads");
    }
    assert!(encode(&frames, Settings::default()).unwrap().0 == one, "outside of any pool");
}

#[test]
fn a_full_disk_is_an_error_of_the_frame() {
    struct Full(usize);
    impl std::io::Write for Full {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            if self.0 < bytes.len() {
                return Err(std::io::ErrorKind::StorageFull.into());
            }
            self.0 -= bytes.len();
            Ok(bytes.len())
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    let frames = (0..6).map(|k| ball(64, 64, k)).collect::<Vec<_>>();
    let (bytes, _) = encode(&frames, Settings::default()).unwrap();
    for room in [0, 10, 100, 2_000, bytes.len() - 1] {
        let mut encoder = Encoder::new(Full(room), Settings::default()).unwrap();
        let error = frames
            .iter()
            .try_for_each(|frame| encoder.push(frame.clone()))
            .and_then(|()| encoder.finish().map(drop))
            .unwrap_err();
        let Error::Write { source, .. } = &error else { panic!("{error}") };
        assert_eq!(source.kind(), std::io::ErrorKind::StorageFull);
    }
}
