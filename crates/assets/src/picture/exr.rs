//! OpenEXR: the first part with the channels R, G and B.

use std::io::Cursor;
use std::sync::OnceLock;

use exr::error::Error;
use exr::meta::MetaData;
use exr::meta::header::Header;
use exr::prelude::{Compression, ReadChannels, ReadLayers, ReadSpecificChannel, Vec2, read as reader};
use image::metadata::Orientation;

use super::size::check_size;
use super::{Levels, Picture};
use crate::error::Fault;

/// The channels that count.
const CHANNELS: [&str; 3] = ["R", "G", "B"];

/// The name, type and length of the header's entry for the compression.
const COMPRESSION: &[u8] = b"compression\0compression\0\x01\0\0\0";

/// The least bytes of a block: its place in a table, and its own head.
const BLOCK: u64 = 16;

pub(super) fn read(bytes: &[u8]) -> Result<Picture, Fault> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|error| {
        // Compressions that are newer than the reader.
        let number =
            memchr::memmem::find(bytes, COMPRESSION).and_then(|at| bytes.get(at + COMPRESSION.len()));
        match number {
            Some(10) => unread("HTJ2K256"),
            Some(11) => unread("HTJ2K32"),
            Some(number @ 12..) => unread(&format!("number {number}")),
            _ => fault(error),
        }
    })?;
    let has_colors = |header: &&Header| {
        !header.deep
            && CHANNELS.iter().all(|name| header.channels.list.iter().any(|channel| channel.name.eq(name)))
    };
    let header = meta.headers.iter().find(has_colors);
    let header = header.ok_or_else(|| Fault::new("no part of it has the channels R, G and B"))?;
    let Vec2(width, height) = header.layer_size;
    let within = |size: usize| u32::try_from(size).unwrap_or(u32::MAX);
    check_size(within(width), within(height))?;
    let is_whole = |name: &&str| {
        header.channels.list.iter().any(|channel| channel.name.eq(name) && channel.sampling == Vec2(1, 1))
    };
    if !CHANNELS.iter().all(is_whole) {
        return Err(Fault::new("its R, G and B have fewer values than pixels"));
    }
    match header.compression {
        // The reader panics on malformed data of these two.
        Compression::B44 => return Err(unread("B44")),
        Compression::B44A => return Err(unread("B44A")),
        Compression::DWAA(_) => return Err(unread("DWAA")),
        Compression::DWAB(_) => return Err(unread("DWAB")),
        _ => {}
    }
    let blocks: u64 = meta.headers.iter().map(|header| header.chunk_count as u64).sum();
    if BLOCK * blocks > bytes.len() as u64 {
        return Err(Fault::new(format!(
            "its header promises {blocks} blocks, but it has only {} bytes",
            bytes.len()
        )));
    }
    let image = reader()
        .no_deep_data()
        .largest_resolution_level()
        .specific_channels()
        .required("R")
        .required("G")
        .required("B")
        .collect_pixels(
            |size: Vec2<usize>, _| (size.0, vec![[0.0f32; 3]; size.0 * size.1]),
            |(width, pixels), at, (r, g, b): (f32, f32, f32)| {
                if let Some(pixel) = pixels.get_mut(at.1 * *width + at.0) {
                    *pixel = [r, g, b];
                }
            },
        )
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(fault)?;
    let layer = image.layer_data;
    let (read_width, mut levels) = layer.channel_data.pixels;
    if read_width != width || levels.len() != width * height {
        return Err(Fault::new("its parts contradict each other"));
    }
    let warnings = make_light(&mut levels)?;
    let orientation = Orientation::NoTransforms;
    let stored = [width as u32, height as u32];
    let largest = levels.iter().flatten().fold(1.0, |most: f32, level| most.max(*level)).into();
    Ok(Picture {
        stored,
        levels: Levels::Floats(levels),
        orientation,
        largest,
        warnings,
        is_opaque: OnceLock::new(),
    })
}

fn unread(compression: &str) -> Fault {
    Fault::new(format!("its compression is {compression}: save it with ZIP, PIZ, RLE or none"))
}

/// Makes levels finite and at least 0, and describes what was changed.
fn make_light(levels: &mut [[f32; 3]]) -> Result<Vec<String>, Fault> {
    /// The largest number of a half.
    const HALF: f32 = 65504.0;
    let all = || levels.iter().flatten().copied();
    if all().any(f32::is_nan) {
        return Err(Fault::new("a level is not a number (NaN)"));
    }
    let negative = all().filter(|x| *x < 0.0).count();
    let infinite = all().filter(|x| *x == f32::INFINITY).count();
    let most = all().filter(|x| x.is_finite()).fold(HALF, f32::max);
    // 0 that is negative is 0.
    levels.iter_mut().flatten().for_each(|x| *x = if *x > 0.0 { x.min(most) } else { 0.0 });
    let mut warnings = Vec::new();
    if negative > 0 {
        warnings.push(format!("{negative} of its levels are negative, and count as 0"));
    }
    if infinite > 0 {
        warnings.push(format!("{infinite} of its levels are infinite, and count as {most}"));
    }
    Ok(warnings)
}

fn fault(error: Error) -> Fault {
    let what = match error {
        Error::Io(error) => error.to_string(),
        Error::Invalid(what) if what == "reference to missing bytes" => "the file is cut off".into(),
        Error::Invalid(what) | Error::NotSupported(what) => what.into_owned(),
        Error::Aborted => "it was given up".into(),
    };
    Fault::new(format!("it cannot be decoded: {what}"))
}
