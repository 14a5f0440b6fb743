//! `--pass`: files beside a picture with other data of its pixels. docs/passes.md defines their numbers.

use std::collections::{BTreeSet, HashMap};
use std::io::Cursor;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::ValueEnum;
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, ReadChannels, ReadLayers,
    SmallVec, Text, WritableImage, read,
};
use rayfold_files::OutputFile;
use rayfold_scene::{Origin, Screen, Tone};
use rayfold_tracer::{FirstHit, RenderOptions, first_hits};
use rayon::prelude::*;
use serde::Serialize;

use super::target::{Pattern, Place, Target};
use crate::interrupt;
use crate::outcome::Usage;
use crate::plan::{Job, Plan};

/// The level in a `.png` of depth of a pixel without a hit.
const NOTHING: u16 = u16::MAX;

/// The level of the farthest distance in a `.png` of depth.
const FARTHEST: u16 = u16::MAX - 1;

/// The maximum number of characters of a line in a table.
const SHOWN: usize = 200;

/// The largest number up to which `f32` holds every whole number.
const WHOLE: usize = 1 << f32::MANTISSA_DIGITS;

/// A kind of pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, ValueEnum)]
pub(crate) enum Pass {
    /// Distance along the view axis
    Depth,
    /// Direction of the surface in the world
    Normal,
    /// Number of the object, with a table of the lines of the script
    Object,
    /// Colour of the surface without light
    Albedo,
}

/// The format of such files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum PassFormat {
    /// OpenEXR: the numbers themselves, in 32 bits
    #[default]
    Exr,
    /// PNG: levels of 16 bits
    Png,
}

/// The flags about passes.
#[derive(Clone, Debug, Default, clap::Args)]
pub(crate) struct PassArgs {
    /// Write passes beside each image: frame.depth.exr beside frame.png. For compositing and denoising; docs/passes.md has
    /// their definitions
    #[arg(id = "passes", long = "pass", value_name = "PASS,...", value_delimiter = ',', value_enum)]
    wanted: Vec<Pass>,
    /// Format of the passes
    #[arg(long, value_name = "FORMAT", value_enum, default_value_t, requires = "passes")]
    pass_format: PassFormat,
    /// Distances that are black and white in a .png of depth [default: 0, and the farthest in the image]
    #[arg(long, value_name = "NEAR..FAR", value_parser = parse_range, requires = "passes", allow_hyphen_values = true)]
    depth_range: Option<(f64, f64)>,
}

/// A file beside an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Beside {
    Pass(Pass),
    /// The table of the numbers of objects.
    Table,
}

/// The files that a run writes beside images.
#[derive(Clone, Debug)]
pub(crate) struct Passes {
    wanted: Vec<Beside>,
    format: PassFormat,
    depth_range: Option<(f64, f64)>,
}

/// The numbers of all pixels of a pass.
#[derive(Clone, Debug, PartialEq)]
enum Values {
    /// One number, in the channel `Y`: the only single channel that every program reads.
    One(Vec<f32>),
    /// Three numbers, in the channels `R`, `G` and `B`.
    Three([Vec<f32>; 3]),
}

/// An object of a table.
#[derive(Debug, Serialize)]
struct Row<'a> {
    number: usize,
    lines: Vec<usize>,
    text: &'a str,
}

impl Pass {
    fn name(self) -> &'static str {
        match self {
            Self::Depth => "depth",
            Self::Normal => "normal",
            Self::Object => "object",
            Self::Albedo => "albedo",
        }
    }

    /// The definition, for people who look into a file.
    fn comment(self) -> &'static str {
        match self {
            Self::Depth => {
                "Y: distance from the eye along the view axis, in world units; infinite where nothing is"
            }
            Self::Normal => {
                "R, G, B: x, y, z of the unit normal in the world, towards the viewer; 0 where nothing is"
            }
            Self::Object => "Y: number of the object, as in the table beside it; 0 where nothing is",
            Self::Albedo => "R, G, B: share of the light that the surface sends back; 0 where nothing is",
        }
    }
}

/// Returns whether a file has the name of a pass, such as `frame.depth.exr`.
pub(crate) fn is_pass(path: &Path) -> bool {
    let inner = path.file_stem().map(Path::new).and_then(Path::extension);
    inner.is_some_and(|inner| Pass::value_variants().iter().any(|pass| inner == pass.name()))
}

impl PassFormat {
    fn ending(self) -> &'static str {
        match self {
            Self::Exr => "exr",
            Self::Png => "png",
        }
    }
}

impl PassArgs {
    /// Returns the passes that are asked for, each once.
    ///
    /// # Errors
    /// Fails if the output is no image, or a flag has no effect.
    pub(crate) fn passes(&self, target: &Target) -> Result<Passes, Usage> {
        let mut wanted = self.wanted.clone();
        wanted.sort_unstable();
        wanted.dedup();
        let has_depth = wanted.contains(&Pass::Depth);
        let has_objects = wanted.contains(&Pass::Object);
        let wanted = wanted.into_iter().map(Beside::Pass);
        let wanted: Vec<_> = wanted.chain(has_objects.then_some(Beside::Table)).collect();
        let usage = |message: &str| Err(Usage(message.into()));
        match target {
            Target::Animation(_, Place::StandardOutput) if !wanted.is_empty() => {
                return usage(
                    "--pass writes files beside images, and standard output (-) is none: expected an output such as frames/%04d.png",
                );
            }
            Target::Animation(..) if !wanted.is_empty() => {
                return usage(
                    "--pass writes files beside each image: expected an output that ends in .png, .tif or .tiff, such as \
                     frames/%04d.png for an animation",
                );
            }
            _ => {}
        }
        if self.depth_range.is_some() && !has_depth {
            return usage("--depth-range is for depth: expected it among the passes, as in --pass depth");
        }
        if self.depth_range.is_some() && self.pass_format == PassFormat::Exr {
            return usage("--depth-range is for --pass-format png: an .exr has the distances themselves");
        }
        Ok(Passes { wanted, format: self.pass_format, depth_range: self.depth_range })
    }
}

impl Passes {
    pub(crate) fn is_empty(&self) -> bool {
        self.wanted.is_empty()
    }

    fn ending(&self, of: Beside) -> String {
        match of {
            Beside::Pass(pass) => format!("{}.{}", pass.name(), self.format.ending()),
            Beside::Table => format!("{}.json", Pass::Object.name()),
        }
    }

    /// Returns the files beside an image.
    pub(crate) fn beside(&self, image: &Path) -> Vec<(Beside, PathBuf)> {
        self.wanted.iter().map(|&of| (of, image.with_extension(self.ending(of)))).collect()
    }

    /// Returns the patterns of the files beside images.
    pub(crate) fn patterns<'a>(&'a self, images: &'a Pattern) -> impl Iterator<Item = Pattern> + 'a {
        self.wanted.iter().map(|&of| images.with_ending(&self.ending(of)))
    }

    /// Returns some files of a frame.
    ///
    /// # Errors
    /// Fails if the run was interrupted, if a number does not fit into the format, and with the errors of the renderer.
    pub(crate) fn encode(
        &self,
        plan: &Plan,
        job: &Job,
        missing: Vec<(Beside, PathBuf)>,
    ) -> anyhow::Result<Vec<(PathBuf, Vec<u8>)>> {
        if missing.is_empty() {
            return Ok(Vec::new());
        }
        anyhow::ensure!(!interrupt::stopping(), "interrupted");
        let scene = plan.scene(job)?;
        let tells_objects = |of: Beside| matches!(of, Beside::Table | Beside::Pass(Pass::Object));
        let origins =
            if missing.iter().any(|(of, _)| tells_objects(*of)) { plan.origins(job)? } else { Vec::new() };
        let of_frame = || format!("frame {} ({})", job.number, plan.name(job));
        let options = RenderOptions { cancel: Some(interrupt::flag()), ..Default::default() };
        let hits = first_hits(&scene, &options).with_context(|| format!("cannot render {}", of_frame()))?;
        let encode = |(of, path): (Beside, PathBuf)| {
            anyhow::ensure!(!interrupt::stopping(), "interrupted");
            let file = match (of, self.format) {
                (Beside::Table, _) => table(plan, job, &hits, &origins),
                (Beside::Pass(pass), PassFormat::Exr) => values(pass, &hits, &origins, WHOLE)
                    .and_then(|values| exr(scene.screen, values, pass.comment())),
                (Beside::Pass(pass), PassFormat::Png) => {
                    self.png(pass, &hits, &origins, scene.screen, scene.tone)
                }
            };
            let file = file.with_context(|| format!("cannot write {}: {}", path.display(), of_frame()))?;
            Ok((path, file))
        };
        missing.into_par_iter().map(encode).collect()
    }

    fn png(
        &self,
        pass: Pass,
        hits: &[FirstHit],
        origins: &[Origin],
        screen: Screen,
        tone: Tone,
    ) -> anyhow::Result<Vec<u8>> {
        match (pass, values(pass, hits, origins, u16::MAX.into())?) {
            (Pass::Depth, Values::One(depths)) => {
                let (near, far) = self.depth_range.unwrap_or((0.0, farthest(&depths)));
                let level = |depth: f32| match depth {
                    f32::INFINITY => NOTHING,
                    _ => {
                        let share = (f64::from(depth) - near) / (far - near);
                        (f64::from(FARTHEST) * share.clamp(0.0, 1.0)).round() as u16
                    }
                };
                let levels = depths.into_iter().map(level).collect();
                let texts = [("Depth near", near.to_string()), ("Depth far", far.to_string())];
                png(screen, png::ColorType::Grayscale, levels, &texts)
            }
            (_, Values::One(numbers)) => {
                let levels = numbers.into_iter().map(|number| number as u16).collect();
                png(screen, png::ColorType::Grayscale, levels, &[])
            }
            (_, Values::Three(channels)) => {
                let share = |value: f32| match (pass, tone) {
                    (Pass::Normal, _) => 0.5 * f64::from(value) + 0.5,
                    (_, Tone::Srgb) => tone.encoded(value.into()),
                    (_, Tone::Plain) => value.into(),
                };
                let level = |value: f32| (f64::from(u16::MAX) * share(value)).round() as u16;
                let [red, green, blue] = channels;
                let pixels = red.into_iter().zip(green).zip(blue);
                let levels = pixels.flat_map(|((red, green), blue)| [red, green, blue].map(level)).collect();
                png(screen, png::ColorType::Rgb, levels, &[])
            }
        }
    }

    /// Returns whether there is a complete file with the size of the image.
    pub(crate) fn is_whole(&self, of: Beside, path: &Path, screen: Screen) -> bool {
        let size = (screen.width(), screen.height());
        let Ok(file) = std::fs::read(path) else { return false };
        match (of, self.format) {
            (Beside::Table, _) => serde_json::from_slice::<serde_json::Value>(&file).is_ok(),
            (Beside::Pass(_), PassFormat::Png) => {
                image::load_from_memory_with_format(&file, image::ImageFormat::Png)
                    .is_ok_and(|image| (image.width(), image.height()) == size)
            }
            (Beside::Pass(_), PassFormat::Exr) => read()
                .no_deep_data()
                .largest_resolution_level()
                .all_channels()
                .first_valid_layer()
                .all_attributes()
                .non_parallel()
                .from_buffered(Cursor::new(file))
                .is_ok_and(|image| {
                    let found = image.layer_data.size;
                    (found.x(), found.y()) == (size.0 as usize, size.1 as usize)
                }),
        }
    }
}

/// Writes the files of a frame, and returns the number of their bytes.
///
/// # Errors
/// Fails if one cannot be written.
pub(crate) fn write(files: Vec<(PathBuf, Vec<u8>)>, durable: bool) -> anyhow::Result<u64> {
    let mut bytes = 0;
    for (path, file) in files {
        OutputFile::write(path, &file, durable)?;
        bytes += file.len() as u64;
    }
    Ok(bytes)
}

/// Returns the numbers of a pass. Those of objects are at most `most`.
fn values(pass: Pass, hits: &[FirstHit], origins: &[Origin], most: usize) -> anyhow::Result<Values> {
    let three = |of: fn(&FirstHit) -> &[f32; 3]| {
        Values::Three([0, 1, 2].map(|axis: usize| hits.iter().map(|hit| of(hit)[axis]).collect()))
    };
    Ok(match pass {
        Pass::Depth => Values::One(hits.iter().map(|hit| hit.depth).collect()),
        Pass::Normal => three(|hit| &hit.normal),
        Pass::Albedo => three(|hit| &hit.albedo),
        Pass::Object => {
            let number = |hit: &FirstHit| match hit.object {
                0 => 0,
                object => origins[object as usize - 1].number,
            };
            let highest = hits.iter().map(number).max().unwrap_or_default();
            let advice = if most < WHOLE { "; expected --pass-format exr" } else { "" };
            anyhow::ensure!(
                highest <= most,
                "it shows object {highest}, and its pixels count to {most}{advice}"
            );
            Values::One(hits.iter().map(|hit| number(hit) as f32).collect())
        }
    })
}

/// Returns the table of the objects that are seen: their numbers and the lines of the script that draw them.
fn table(plan: &Plan, job: &Job, hits: &[FirstHit], origins: &[Origin]) -> anyhow::Result<Vec<u8>> {
    let seen: BTreeSet<u32> = hits.iter().map(|hit| hit.object).filter(|object| *object > 0).collect();
    let seen: Vec<&Origin> = seen.into_iter().map(|object| &origins[object as usize - 1]).collect();
    let wanted: BTreeSet<usize> = seen.iter().map(|origin| origin.line).collect();
    let text = plan.text(job)?;
    let lines = text.split(|byte| *byte == b'\n').zip(1..).filter(|(_, line)| wanted.contains(line));
    let texts: HashMap<usize, String> = lines
        .map(|(text, line)| (line, String::from_utf8_lossy(text).trim().chars().take(SHOWN).collect()))
        .collect();
    let rows = seen.into_iter().map(|origin| {
        serde_json::to_string(&Row {
            number: origin.number,
            lines: origin.uses.iter().copied().chain([origin.line]).collect(),
            text: texts.get(&origin.line).map(String::as_str).unwrap_or_default(),
        })
    });
    let rows = rows.collect::<Result<Vec<_>, _>>()?.join(",\n");
    let name = serde_json::to_string(plan.name(job))?;
    Ok(format!("{{\"script\":{name},\"objects\":[\n{rows}\n]}}\n").into_bytes())
}

/// Returns the farthest finite distance, or 1 if there is none.
fn farthest(depths: &[f32]) -> f64 {
    let farthest = depths.iter().copied().filter(|depth| depth.is_finite()).fold(0.0, f32::max);
    if farthest > 0.0 { farthest.into() } else { 1.0 }
}

fn exr(screen: Screen, values: Values, comment: &str) -> anyhow::Result<Vec<u8>> {
    let channel = |name: &str, numbers| AnyChannel::new(name, FlatSamples::F32(numbers));
    let mut channels = SmallVec::new();
    match values {
        Values::One(numbers) => channels.push(channel("Y", numbers)),
        Values::Three(numbers) => {
            channels.extend(
                ["R", "G", "B"].into_iter().zip(numbers).map(|(name, numbers)| channel(name, numbers)),
            );
        }
    }
    let attributes = LayerAttributes {
        comments: Text::new_or_none(comment),
        software_name: Text::new_or_none("rayfold"),
        ..LayerAttributes::default()
    };
    let size = (screen.width() as usize, screen.height() as usize);
    let layer = Layer::new(size, attributes, Encoding::SMALL_LOSSLESS, AnyChannels::sort(channels));
    let mut file = Cursor::new(Vec::new());
    Image::from_layer(layer).write().non_parallel().to_buffered(&mut file)?;
    Ok(file.into_inner())
}

fn png(
    screen: Screen,
    color: png::ColorType,
    levels: Vec<u16>,
    texts: &[(&str, String)],
) -> anyhow::Result<Vec<u8>> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, screen.width(), screen.height());
    encoder.set_color(color);
    encoder.set_depth(png::BitDepth::Sixteen);
    encoder.set_compression(png::Compression::Fast);
    for (keyword, text) in texts {
        encoder.add_text_chunk((*keyword).into(), text.clone())?;
    }
    let mut writer = encoder.write_header()?;
    let bytes: Vec<u8> = levels.into_iter().flat_map(u16::to_be_bytes).collect();
    writer.write_image_data(&bytes)?;
    writer.finish()?;
    Ok(file)
}

fn parse_range(text: &str) -> Result<(f64, f64), String> {
    let expected = "expected two distances in world units, the nearer one first, such as 0..20";
    let number = |text: &str| text.parse::<f64>().ok().filter(|number| number.is_finite() && *number >= 0.0);
    let (near, far) = text.split_once("..").ok_or(expected)?;
    match (number(near), number(far)) {
        (Some(near), Some(far)) if near < far => Ok((near, far)),
        (Some(near), Some(far)) if near > far => {
            Err(format!("the range is empty; did you mean {far}..{near}?"))
        }
        _ => Err(expected.into()),
    }
}
