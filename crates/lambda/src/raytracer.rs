//! The render function's renderer: turns scripts into PNG images with `rayfold-scene` and `rayfold-tracer`.
//!
//! A drawing is cancelled when its caller stops waiting. A frame that is too big for an invocation is drawn in bands.
//! [`Capacity`] decides that from the time of a few strips of the frame, or after drawing has taken too long.

use std::num::{NonZeroU32, NonZeroU64};
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use bytes::Bytes;
use rayfold_pipeline::keys::{Band, ScriptName};
use rayfold_pipeline::manifest::Reason;
use rayfold_pipeline::{Drawing, Error, File, Files, Renderer, Result, Source};
use rayfold_scene::diagnostic::{Code, Diagnostic};
use rayfold_scene::{Limits, Scene, Script, assets};
use rayfold_tracer::{Drawing as Picture, Exposure, RenderError, RenderOptions};

use crate::capacity::{Capacity, Extent, FEW_RAYS, Measured, STOP_SHARE, STRIP, Verdict, strips};
use crate::given::Kept;
use crate::joining::PngJoining;
use crate::{png, pool};

/// The bytes per pixel of its sums if it may have many samples. `FIRST_BYTES` are those of the first sample if not
/// all pixels get sums.
const SUMS_BYTES: u64 = 56;
const FIRST_BYTES: u64 = 9;

/// The bytes per pixel of its light and its cover, and of its levels with alpha, in a scene without background.
const CLEAR_BYTES: u64 = 20;

/// No more strips are drawn after this share of the remaining time.
const MEASURING_SHARE: f64 = 0.1;

/// A renderer of scene scripts.
///
/// ```
/// use rayfold_lambda::raytracer::RayTracer;
/// use rayfold_pipeline::{Drawing, Files, Renderer, Source, keys::ScriptName};
/// # #[tokio::main(flavor = "current_thread")] async fn main() -> rayfold_pipeline::Result<()> {
/// let script = "Screen 4 3\nSphere 1 0 0 -5 1 0 0 0 0 0\nTrace";
/// let name = ScriptName::new("red")?;
/// let source = Source { name, script: script.into(), files: Files::default(), part: None };
/// let drawing = RayTracer::default().draw(source, None).await?;
/// assert!(matches!(drawing, Drawing::Frame(png) if png.starts_with(b"\x89PNG")));
/// # Ok(()) }
/// ```
#[derive(Debug, Clone, Default)]
pub struct RayTracer {
    /// The limits of a script.
    pub limits: Limits,
    /// The resources of an invocation.
    pub capacity: Capacity,
    kept: Kept,
}

impl RayTracer {
    /// Makes a renderer that has drawn nothing yet.
    pub fn new(limits: Limits, capacity: Capacity) -> Self {
        RayTracer { limits, capacity, kept: Kept::default() }
    }
}

impl Renderer for RayTracer {
    type BandJoiner = PngJoining;

    fn most_bytes(&self) -> u64 {
        self.limits.max_script_bytes as u64
    }

    fn most_file_bytes(&self) -> u64 {
        assets::limits::FILE_BYTES
    }

    async fn needed(&self, name: &ScriptName, script: Bytes, files: Files) -> Result<Vec<String>> {
        // Names of files are in quotes.
        if !script.contains(&b'"') {
            return Ok(Vec::new());
        }
        let (kept, limits, file) = (self.kept.clone(), self.limits, format!("{name}.txt"));
        run(name, move || {
            Ok(kept.with_earlier(files, |given| {
                rayfold_scene::parse_with_files(&file, &script, &limits, &given.library);
                given.take_asked()
            }))
        })
        .await
    }

    fn kept(&self, key: &str) -> Option<File> {
        self.kept.file(key)
    }

    fn keep(&self, key: &str, file: Option<&File>) {
        self.kept.keep(key, file);
    }

    async fn draw(&self, source: Source, left: Option<Duration>) -> Result<Drawing> {
        let stop = CancelOnDrop::default();
        let (flag, name, reader) = (stop.0.clone(), source.name.clone(), self.clone());
        let time = Time { began: Instant::now(), left, capacity: self.capacity };
        let drawing = run(&name, move || match reader.shot(&source) {
            Ok(shot) => shot.draw(&time, &flag),
            Err(other) => Ok(other),
        });
        let mut drawing = pin!(drawing);
        let Some(patience) = left.filter(|_| self.capacity.cuts()) else { return drawing.await };
        match tokio::time::timeout(patience.mul_f64(STOP_SHARE), &mut drawing).await {
            Ok(drawn) => drawn,
            Err(_) => {
                // The drawing ends soon, and says how many bands the frame is to be cut into.
                stop.0.store(true, Ordering::Relaxed);
                drawing.await
            }
        }
    }

    async fn draw_band(&self, source: Source, band: Band) -> Result<Result<Bytes, Reason>> {
        let stop = CancelOnDrop::default();
        let (flag, name, reader) = (stop.0.clone(), source.name.clone(), self.clone());
        run(&name, move || match reader.shot(&source) {
            Ok(shot) => shot.draw_band(band, &flag),
            Err(other) => Ok(Err(no_single_frame(&format!("{}.txt", source.name), other))),
        })
        .await
    }

    async fn join(&self, source: Source, count: NonZeroU64) -> Result<Result<PngJoining, Reason>> {
        let (name, reader) = (source.name.clone(), self.clone());
        run(&name, move || {
            Ok(match reader.shot(&source) {
                Ok(shot) => PngJoining::begin(shot.size(), shot.scene.background.is_none(), count),
                Err(other) => Err(no_single_frame(&format!("{}.txt", source.name), other)),
            })
        })
        .await
    }
}

/// Runs work on the pool.
async fn run<T: Send + 'static>(
    name: &ScriptName,
    work: impl FnOnce() -> Result<T> + Send + 'static,
) -> Result<T> {
    let given_up = || Err(Error::OutOfTime { what: format!("drawing {name} was given up") });
    pool::run(work).await.unwrap_or_else(given_up)
}

/// Returns the reason why a band has no frame. A script that was cut does not change, so it should have one.
fn no_single_frame(file: &str, drawing: Drawing) -> Reason {
    match drawing {
        Drawing::Waits(reason) | Drawing::Fault(reason) => reason,
        Drawing::Split(count) => Reason::new(format!("{file} has {count} frames, each of which has bands")),
        Drawing::Frame(_) | Drawing::Cut(_) => Reason::new(format!("{file} has no bands")),
    }
}

/// The time and the resources for a drawing.
struct Time {
    began: Instant,
    /// The time that is left after `began`.
    left: Option<Duration>,
    capacity: Capacity,
}

/// A frame of a script.
struct Shot {
    file: String,
    script: Script,
    /// The frame's position in the script, from 0.
    place: usize,
    scene: Scene,
}

impl RayTracer {
    /// Reads a script. Returns the result of the drawing if there is no frame to draw.
    fn shot(&self, source: &Source) -> std::result::Result<Shot, Drawing> {
        let file = format!("{}.txt", source.name);
        let parsed = self.kept.with(source.files.clone(), |given| {
            rayfold_scene::parse_with_files(&file, &source.script, &self.limits, &given.library)
        });
        let Some(script) = parsed.script else {
            let mut errors = parsed.diagnostics.iter().filter(|diagnostic| diagnostic.is_error());
            // A script with other errors as well would fail with its files, too.
            let waits = errors.all(|error: &Diagnostic| error.code == Code::AbsentFile);
            let reason = Reason::from_diagnostics(parsed.diagnostics);
            return Err(if waits { Drawing::Waits(reason) } else { Drawing::Fault(reason) });
        };
        let count = script.frame_count() as u64;
        let number = match (source.part, NonZeroU64::new(count)) {
            (None, Some(count)) if count.get() > 1 => return Err(Drawing::Split(count)),
            (part, _) => part.map_or(1, NonZeroU64::get),
        };
        let place = usize::try_from(number - 1).unwrap_or(usize::MAX);
        match script.frame(place) {
            Some(scene) => Ok(Shot { file, script, place, scene }),
            None => Err(Drawing::Fault(Reason::new(format!("{file} has {count} frames, no frame {number}")))),
        }
    }
}

impl Shot {
    /// Returns columns and rows.
    fn size(&self) -> (u32, u32) {
        (self.scene.screen.width(), self.scene.screen.height())
    }

    /// Prepares the picture, and passes it to `then`.
    fn expose<T>(
        &self,
        options: &RenderOptions,
        then: impl FnOnce(&Picture) -> std::result::Result<T, RenderError>,
    ) -> std::result::Result<T, RenderError> {
        let after =
            |frames| self.script.frame_after(self.place, frames).unwrap_or_else(|| self.scene.clone());
        then(&Picture::exposed(Exposure::moving(&self.scene, &after), options)?)
    }

    /// Draws the frame, unless it is too big.
    fn draw(&self, time: &Time, stop: &AtomicBool) -> Result<Drawing> {
        let options = RenderOptions { cancel: Some(stop), ..Default::default() };
        let drawn = self.expose(&options, |picture| {
            let extent = self.extent(picture.margin());
            match self.judge(picture, &extent, time) {
                Verdict::Whole => match picture.draw_picture() {
                    Err(RenderError::Cancelled) if time.left.is_some() => {
                        Ok(Err(time.judge_late(&extent, extent.height)))
                    }
                    image => image.map(Ok),
                },
                verdict => Ok(Err(verdict)),
            }
        });
        let (file, cut) = (&self.file, |bands: NonZeroU32| Drawing::Cut(NonZeroU64::from(bands)));
        match drawn {
            Ok(Ok(image)) => match png::encode(&image) {
                Ok(frame) => Ok(Drawing::Frame(frame)),
                Err(source) => {
                    Err(Error::Malformed { key: "the drawn frame".to_owned(), source: source.into() })
                }
            },
            Ok(Err(Verdict::Bands(bands))) => Ok(cut(bands)),
            Ok(Err(Verdict::TooBig(why))) => Ok(Drawing::Fault(Reason::new(format!("{file}: {why}")))),
            Ok(Err(Verdict::Whole)) | Err(RenderError::Cancelled) => {
                Err(Error::OutOfTime { what: format!("drawing {file} was cancelled") })
            }
            Err(error) => Ok(Drawing::Fault(Reason::new(format!("{file}: {error}")))),
        }
    }

    fn draw_band(&self, band: Band, stop: &AtomicBool) -> Result<std::result::Result<Bytes, Reason>> {
        let options = RenderOptions { cancel: Some(stop), ..Default::default() };
        let (file, (_, height)) = (&self.file, self.size());
        let rows = band.rows(height);
        if rows.is_empty() {
            return Ok(Err(Reason::new(format!("{file}: a frame of {height} rows has no band {band}"))));
        }
        match self.expose(&options, |picture| picture.draw_picture_rows(rows)) {
            Ok(image) => match png::encode(&image) {
                Ok(image) => Ok(Ok(image)),
                Err(source) => {
                    Err(Error::Malformed { key: "the drawn band".to_owned(), source: source.into() })
                }
            },
            Err(RenderError::Cancelled) => {
                Err(Error::OutOfTime { what: format!("drawing band {band} of {file} was cancelled") })
            }
            Err(error) => Ok(Err(Reason::new(format!("{file}: {error}")))),
        }
    }

    fn extent(&self, margin: u32) -> Extent {
        let (width, height) = self.size();
        let samples = self.scene.samples;
        let of_samples = match samples.most() {
            1 => 0,
            _ if samples.error() > 0.0 => FIRST_BYTES + SUMS_BYTES,
            _ => SUMS_BYTES,
        };
        // The cover is sampled as the colour is.
        let is_clear = self.scene.background.is_none();
        let pixel_bytes = if is_clear { CLEAR_BYTES + 2 * of_samples } else { of_samples };
        Extent { width, height, pixel_bytes, margin }
    }

    /// Decides about the frame. Draws strips of it first if it may exceed the invocation.
    fn judge(&self, picture: &Picture, extent: &Extent, time: &Time) -> Verdict {
        let by_memory = time.capacity.judge_memory(extent);
        let rays = self.scene.screen.pixels().saturating_mul(u64::from(self.scene.samples.most()));
        let Some(left) = time.left.filter(|_| rays > FEW_RAYS || by_memory != Verdict::Whole) else {
            return by_memory;
        };
        let before = time.began.elapsed();
        let (mut seconds, mut rows_drawn) = (0.0, 0);
        let mut measured = Measured { before, row: 0.0, dearest_row: 0.0 };
        for rows in strips(extent.height) {
            let (start, count) = (Instant::now(), rows.end - rows.start);
            if picture.sketch_rows(rows).is_err() {
                // The strip was stopped: it alone took longer than a frame may.
                return time.judge_late(extent, STRIP);
            }
            let took = start.elapsed().as_secs_f64();
            seconds += took;
            rows_drawn += count;
            measured.row = seconds / f64::from(rows_drawn);
            measured.dearest_row = measured.dearest_row.max(took / f64::from(count));
            if time.capacity.is_sure(extent, &measured, left)
                || seconds > MEASURING_SHARE * left.as_secs_f64()
            {
                break;
            }
        }
        time.capacity.judge(extent, &measured, left)
    }
}

impl Time {
    /// Decides about a frame if it is only known that this many rows take longer than the remaining time.
    fn judge_late(&self, extent: &Extent, rows: u32) -> Verdict {
        let left = self.left.unwrap_or_default();
        // Assumes twice the time, because the real time is unknown.
        let row = 2.0 * left.as_secs_f64() / f64::from(rows.min(extent.height));
        let measured = Measured { before: Duration::ZERO, row, dearest_row: row };
        self.capacity.judge(extent, &measured, left)
    }
}

/// A guard that stops a drawing when its caller stops waiting.
#[derive(Default)]
struct CancelOnDrop(Arc<AtomicBool>);

impl Drop for CancelOnDrop {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use rayfold_pipeline::render::Outcome;
    use rayfold_pipeline::store::{ListRequest, MemoryStore, PutOptions, Store};
    use rayfold_pipeline::{BandJoiner, Invocation, Policy, Randomness, SystemClock, render_frame};

    use super::*;

    fn source(script: &Bytes) -> Source {
        let name = ScriptName::new("big").unwrap();
        Source { name, script: script.clone(), files: Files::default(), part: None }
    }

    /// A script of balls on a floor, seen in mirrors.
    fn script(size: &str, samples: &str) -> Bytes {
        let text = format!(
            "Screen {size}\nSamples {samples}\nLook 0 3 9  0 0 0  40\nBackground .5 .6 .8\nIlight .6 .6 .55  1 -1.7 -1  9\n\
             Sphere 1 -1.6 .9 -.4  .04 .04 .04 .2 .2 .2 .6 .6 .6\nSphere .8 1 .6 1.2  .08 .02 .02 .8 .2 .15\n\
             Plane 0 -1 0  0 1 0  .1 .1 .1 .5 .5 .45 .2 .2 .2\nTrace\n"
        );
        text.into()
    }

    /// Returns a renderer that allows any number of bands, so that no frame is too big on a busy machine.
    fn patient() -> RayTracer {
        let capacity = Capacity { memory: None, most_bands: NonZeroU32::new(100_000).unwrap() };
        RayTracer { capacity, ..RayTracer::default() }
    }

    async fn draw(script: &Bytes, left_ms: Option<u64>) -> Drawing {
        let left = left_ms.map(Duration::from_millis);
        patient().draw(source(script), left).await.unwrap()
    }

    async fn put_together(script: &Bytes, count: NonZeroU64) -> Bytes {
        let tracer = patient();
        let mut joining = tracer.join(source(script), count).await.unwrap().unwrap();
        for band in Band::all(count) {
            let image = tracer.draw_band(source(script), band).await.unwrap().unwrap();
            joining.push(image).await.unwrap();
        }
        joining.finish().await.unwrap()
    }

    #[tokio::test]
    async fn bands_are_the_frame_byte_for_byte_whatever_the_samples() {
        for (samples, is_clear) in ["1", "4 0", "16 2"].into_iter().flat_map(|s| [(s, false), (s, true)]) {
            let script = script("70 400", samples);
            let script = if is_clear { on_nothing(&script) } else { script };
            let Drawing::Frame(whole) = draw(&script, None).await else { panic!("{samples}") };
            assert_eq!(png::decode(&whole, Limits::PIXELS).unwrap().color().has_alpha(), is_clear);
            for count in [2, 5] {
                let joined = put_together(&script, NonZeroU64::new(count).unwrap()).await;
                assert!(joined == whole, "{samples} samples in {count} bands");
            }
        }
    }

    /// Returns a script without its background and its floor.
    fn on_nothing(script: &Bytes) -> Bytes {
        let text = str::from_utf8(script).unwrap().replace("Background .5 .6 .8", "Background none");
        let lines = text.lines().filter(|line| !line.starts_with("Plane"));
        lines.map(|line| format!("{line}\n")).collect::<String>().into()
    }

    /// A frame of many rays: measured by strips before it is drawn.
    #[tokio::test]
    async fn a_frame_that_is_measured_to_take_too_long_is_cut() {
        let script = script("3000 3000", "64 0");
        let start = Instant::now();
        let cut = draw(&script, Some(200)).await;
        let Drawing::Cut(bands) = cut else { panic!("{cut:?}") };
        println!("{bands} bands, after {:?}", start.elapsed());
        assert!(bands.get() >= 2);
    }

    /// A frame of few rays: cut after it has taken too long.
    #[tokio::test]
    async fn a_frame_that_turns_out_to_take_too_long_is_cut() {
        let cut = draw(&script("1000 1000", "16 0"), Some(5)).await;
        assert!(matches!(cut, Drawing::Cut(bands) if bands.get() >= 2), "{cut:?}");
    }

    /// Works on an event with the renderer of a process.
    async fn work(store: &MemoryStore<SystemClock>, process: &RayTracer, key: &str) -> Outcome {
        let (random, policy) = (Randomness::seeded(1), Policy::new(1));
        let invocation = Invocation::new(store, &SystemClock, &random, &policy, key);
        render_frame(&invocation, process, key).await.unwrap().outcome
    }

    /// A process that had drawn an older model gave the newer one's version files to which only the older one refers.
    /// Other processes, which had not drawn the older model, treated their frames as superseded.
    #[tokio::test]
    async fn all_processes_give_a_script_the_same_version_whatever_they_have_drawn_before() {
        const CORNER: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        let script = "Screen 4 3\nMesh \"c.obj\"\nTrace\nTrace\n";
        // The second file of each pair replaces the first one. Names of pictures come before those of libraries.
        let map = "newmtl a\nmap_Kd a.png\n";
        let changes = [
            [("c.obj", format!("mtllib c.mtl\nusemtl a\n{CORNER}")), ("c.obj", CORNER.to_owned())],
            [("c.mtl", map.to_owned()), ("c.mtl", "newmtl a\nKd 1 0 0\n".to_owned())],
            [("c.mtl", "newmtl a\nKd 1 0 0\n".to_owned()), ("c.mtl", map.to_owned())],
        ];
        for [(before, first), (name, second)] in changes {
            let store = MemoryStore::new(SystemClock);
            let put = async |name: &str, text: &str| {
                let body = Bytes::copy_from_slice(text.as_bytes());
                store.put(&format!("scripts/film/{name}"), body, PutOptions::always()).await.unwrap();
            };
            let events = async |process: &RayTracer, done: &mut Vec<String>| {
                let request = || ListRequest::all("parts/film/");
                let listed = store.list(request()).await.unwrap().objects;
                let mut outcomes = Vec::new();
                for key in
                    listed.into_iter().map(|object| object.key).filter(|key| !key.ends_with("files.json"))
                {
                    if !done.contains(&key) {
                        outcomes.push(work(&store, process, &key).await);
                        done.push(key);
                    }
                }
                outcomes
            };
            let (warm, mut done) = (RayTracer::default(), Vec::new());
            put("c.obj", &format!("mtllib c.mtl\nusemtl a\n{CORNER}")).await;
            put(before, &first).await;
            put("1.txt", script).await;
            assert!(matches!(work(&store, &warm, "scripts/film/1.txt").await, Outcome::Split(_)));
            assert_eq!(events(&RayTracer::default(), &mut done).await, [Outcome::Drawn, Outcome::Drawn]);
            put(name, &second).await;
            assert!(matches!(work(&store, &warm, "scripts/film/1.txt").await, Outcome::Split(_)), "{name}");
            let drawn = events(&RayTracer::default(), &mut done).await;
            assert_eq!(drawn, [Outcome::Drawn, Outcome::Drawn], "{name}: {second}");
        }
    }

    #[tokio::test]
    async fn where_no_frame_may_be_cut_those_that_fit_are_drawn() {
        let tracer = RayTracer {
            capacity: Capacity { memory: None, most_bands: NonZeroU32::MIN },
            ..RayTracer::default()
        };
        let left = Some(Duration::from_secs(600));
        let drawn = tracer.draw(source(&script("40 30", "4 0")), left).await.unwrap();
        assert!(matches!(drawn, Drawing::Frame(_)));
    }
}
