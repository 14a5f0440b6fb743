//! One run: a story and a world are generated from a seed, simulated, and checked.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use bytes::Bytes;

use super::bucket::{Actor, Faults, Moment, SimEnvironment};
use super::engine::{Engine, WorldClock, lock};
use super::expected::{Expected, follows};
use super::platform::{Chaos, Platform, Work};
use super::timed::Pace;
use super::{PIXELS, Run, Shared};
use rayfold_pipeline::assemble::generation_of;
use rayfold_pipeline::fakes::{BIG, GARBLED};
use rayfold_pipeline::keys::{Animation, Key, Uploaded};
use rayfold_pipeline::manifest::Manifest;
use rayfold_pipeline::store::{Bucket, Object, PutOptions};
use rayfold_pipeline::sweep::Visit;
use rayfold_pipeline::{Clock, Mutation, Policy, Randomness};
use rayfold_scene::Container;

/// The time by which a run must have come to rest.
const PATIENCE: Duration = Duration::from_secs(24 * 3600);

/// The time limit of an invocation.
const TIMEOUT: Duration = Duration::from_secs(30);

/// The time during which changes and faults happen.
const TROUBLES: Duration = Duration::from_secs(45);

/// Separates the random numbers of other clients from those of the rest of a story.
const STRANGERS: u64 = 0x0067_6172_626c_6572;

/// Separates the random choice of frames that are too big from the rest of a story.
const BIG_FRAMES: u64 = 0x0062_6967;
/// Separates the random choice of scripts that name files, and the actions on these files, from the rest of a story.
const FILES: u64 = 0x0066_696c_6573;
/// Separates the random time limits of the assembler.
const HURRY: u64 = 0x0068_7572_7279;
/// Separates the random choice of the requested files.
const OUTPUTS: u64 = 0x006f_7574_7075_7473;

/// The number of sweeps that a run may need.
const MAX_SWEEPS: u32 = 24;

/// The largest number of calls of `retry`.
const MAX_RETRIES: u32 = 4;

/// The number of bytes of a part if GIFs are built in pieces: two or three frames.
const SMALL_PART: usize = 32;

/// Scripts of the stories: their natural order is not their byte order, and one name looks like a receipt's.
const NAMES: [&str; 4] = ["2", "10", "1", "3@0-p1"];

/// The file names of the stories.
const FILE_NAMES: [&str; 2] = ["f", "g"];

/// Runs one seed, and records its history if requested.
pub(super) fn run(
    seed: u64,
    mutation: Option<Mutation>,
    log: Option<&mut Vec<String>>,
) -> Result<Run, String> {
    let random = Randomness::seeded(seed.wrapping_mul(0x2545_f491_4f6c_dd1d) ^ 0x5eed);
    let files = Randomness::seeded(seed ^ FILES);
    let outputs = Randomness::seeded(seed ^ OUTPUTS);
    let judge = begin(&random, (&Randomness::seeded(seed ^ HURRY), &outputs), mutation, log.is_some())?;
    if files.one_in(3) {
        *lock(&judge.env.files) = Some(files.bits());
        write_acts_on_files(&files, &judge.env, &judge.animation);
    }
    let lots = Randomness::seeded(seed ^ BIG_FRAMES);
    if lots.one_in(3) {
        *lock(&judge.env.big) = Some(lots.bits());
    }
    let strangers = Randomness::seeded(seed ^ STRANGERS);
    if strangers.one_in(8) {
        judge.garble(&strangers);
    }
    judge.engine.run(TROUBLES);
    judge.calm_down();
    let outcome = judge.judge();
    // The notification and the platform's tasks know each other.
    *lock(&judge.env.notify) = None;
    *lock(&judge.env.moments) = None;
    judge.engine.end();
    if let (Some(log), Some(noted)) = (log, &judge.env.log) {
        log.append(&mut lock(noted));
    }
    outcome
}

/// A world with its story, before anything has happened.
fn begin(
    random: &Randomness,
    (hurry, outputs): (&Randomness, &Randomness),
    mutation: Option<Mutation>,
    is_logged: bool,
) -> Result<Judge, String> {
    let engine = Engine::default();
    let env = SimEnvironment::new(engine.clone(), random.bits(), is_logged);
    let mut policy = policy(random);
    let concurrency = [1, 2, 4, 100][pick(random, 4)];
    let draw_ms = (1, [20, 300, 3_000][pick(random, 3)]);
    let push = Duration::from_millis([0, 0, 100, 400][pick(random, 4)]);
    let mut pace = Pace { push, is_eager: false };
    if hurry.one_in(4) {
        // A GIF takes several invocations, of one to three frames each.
        pace = Pace { push: Duration::from_millis([2_000, 3_000, 8_000][pick(hurry, 3)]), is_eager: true };
        policy.margin = Duration::from_secs(1);
        env.part.store(SMALL_PART, Ordering::Relaxed);
    }
    let platform = Platform::new(env.clone(), policy, mutation, concurrency, TIMEOUT, draw_ms, pace);
    if !random.one_in(4) {
        *lock(&platform.chaos) = chaos(random);
        *lock(&env.faults) = faults(random);
    }
    let animation = Animation::new("an/im").map_err(|error| error.to_string())?;
    let watch = watch(&env, &platform);
    write_story((random, outputs), &env, &platform, &animation);
    if random.one_in(2) {
        *lock(&env.moments) = Some(awkward_user(random, &env));
    }
    Ok(Judge { engine, env, platform, animation, watch })
}

/// Returns the constants of the protocol, chosen so that a small world can show all cases.
fn policy(random: &Randomness) -> Policy {
    Policy {
        quiet: Duration::from_millis([100, 1_000, 5_000][pick(random, 3)]),
        stuck_after: Duration::from_secs(60),
        superseded_after: Duration::from_secs([1, 1_000, 7 * 24 * 3600][pick(random, 3)]),
        pause_cap: Duration::from_millis([1, 50, 500][pick(random, 3)]),
        pause_looks: [0, 1, 8][pick(random, 3)],
        // The first 800 bytes of most manifests here are the head and some of the frames.
        glimpse: [64, 800, 32 * 1024][pick(random, 3)],
        ..Policy::new(PIXELS)
    }
}

/// Returns one of four rates.
fn rate(random: &Randomness, rates: [u64; 4]) -> u64 {
    rates[pick(random, 4)]
}

/// Returns the faults of the platform.
fn chaos(random: &Randomness) -> Chaos {
    Chaos {
        drop: rate(random, [0, 0, 0, 8]),
        duplicate: rate(random, [0, 0, 3, 10]),
        kill: rate(random, [0, 3, 6, 2]),
        too_old: rate(random, [0, 0, 0, 30]),
        delay_ms: rate(random, [10, 100, 1_000, 5_000]),
        skew_ms: rate(random, [0, 0, 50, 2_000]),
    }
}

/// Returns the faults of the bucket.
fn faults(random: &Randomness) -> Faults {
    Faults {
        busy: rate(random, [0, 0, 20, 60]),
        conflict: rate(random, [0, 0, 5, 30]),
        lost_answer: rate(random, [0, 0, 10, 40]),
        torn_listings: random.one_in(2),
        slow: rate(random, [0, 3, 6, 20]),
    }
}

/// Watches every change of the bucket, and sends it to the platform.
fn watch(env: &SimEnvironment, platform: &Arc<Platform>) -> Shared<Watch> {
    let watch: Shared<Watch> = Shared::default();
    let (platform, watched) = (Arc::downgrade(platform), watch.clone());
    *lock(&env.notify) = Some(Arc::new(move |actor, key, there, bucket| {
        lock(&watched).see(actor, key, there, bucket);
        if let Some(platform) = platform.upgrade() {
            let etag = bucket.head(key).ok().filter(|_| there).map(|info| info.etag);
            platform.object_event(key, etag);
        }
    }));
    watch
}

fn pick(random: &Randomness, of: usize) -> usize {
    usize::try_from(random.below(of as u64)).unwrap_or(0)
}

/// Generates the actions of users and their times.
fn write_story(
    (random, outputs): (&Randomness, &Randomness),
    env: &Arc<SimEnvironment>,
    platform: &Arc<Platform>,
    animation: &Animation,
) {
    let count = 1 + pick(random, 4).min(1 + pick(random, 3));
    let span_ms = [50, 500, 4_000, 20_000][pick(random, 4)];
    let has_outputs = outputs.one_in(4);
    let settings_text = |random: &Randomness, scripts: usize| {
        let settings = match random.below(8) {
            0 => r#""frames": 0.5"#.to_owned(),
            1 | 2 => r#""fps": 20"#.to_owned(),
            3 => format!(r#""frames": {}"#, scripts + 1),
            _ => format!(r#""frames": {scripts}"#),
        };
        let outputs = match outputs.below(4) {
            0 if has_outputs => r#", "outputs": ["gif", "webp"]"#,
            1 if has_outputs => r#", "outputs": ["webp", "apng", "gif"]"#,
            2 if has_outputs => r#", "outputs": ["y4m"]"#,
            _ => "",
        };
        format!("{{{settings}{outputs}}}")
    };
    if random.one_in(2) {
        let delay = Duration::from_millis(random.below(span_ms));
        act(env, delay, animation.settings(), Some(settings_text(random, count)));
    }
    let key = |place: usize| format!("{}{}.txt", animation.scripts(), NAMES[place]);
    for place in 0..count {
        let delay = Duration::from_millis(random.below(span_ms));
        act(env, delay, key(place), Some(content(random)));
    }
    for _ in 0..random.below(6) {
        let delay = Duration::from_millis(random.below(span_ms * 2));
        let place = pick(random, count);
        match random.below(12) {
            0..=4 => act(env, delay, key(place), Some(content(random))),
            5 | 6 => {
                // A quick change and change back.
                let (first, second) = (content(random), content(random));
                act(env, delay, key(place), Some(first.clone()));
                for text in [second, first] {
                    let later = delay + Duration::from_millis(random.below(400));
                    act(env, later, key(place), Some(text));
                }
            }
            7 | 8 => act(env, delay, key(place), None),
            9 => act(env, delay, animation.settings(), Some(settings_text(random, count))),
            10 => act(env, delay, animation.settings(), None),
            _ => platform.submit(Work::Sweep, delay + Duration::from_secs(random.below(30))),
        }
    }
}

/// Generates the actions on files and their times. Some files come before the scripts that name them, some never come.
fn write_acts_on_files(random: &Randomness, env: &Arc<SimEnvironment>, animation: &Animation) {
    let span_ms = [50, 500, 4_000, 20_000][pick(random, 4)];
    for _ in 0..1 + random.below(7) {
        let delay = Duration::from_millis(random.below(span_ms));
        let name = FILE_NAMES[pick(random, FILE_NAMES.len())];
        let text = match random.below(8) {
            0 => None,
            1 | 2 => Some(format!("also {}", FILE_NAMES[pick(random, FILE_NAMES.len())])),
            number => Some(["red", "blue"][number as usize % 2].to_owned()),
        };
        let key = format!("{}{name}", animation.scripts());
        act(env, delay, key.clone(), text.clone());
        if random.one_in(3) {
            // A quick change back, or again.
            let later = delay + Duration::from_millis(random.below(400));
            act(env, later, key, Some("red".to_owned()));
        }
    }
}

/// Simulates a user who changes a script at the worst moment, mostly back to its earlier text.
fn awkward_user(random: &Randomness, env: &Arc<SimEnvironment>) -> Arc<dyn Fn(Moment) + Send + Sync> {
    let random = Randomness::seeded(random.bits());
    let (left, patience) = (AtomicU64::new(1 + random.below(4)), 1 + random.below(6));
    // After a listing; before it and back after it, so that it alone has seen the change; during a build.
    let habit = [Moment::Listed, Moment::Listing, Moment::Building][pick(&random, 3)];
    let to_restore: Mutex<Option<(String, String)>> = Mutex::new(None);
    let world = Arc::downgrade(env);
    Arc::new(move |moment| {
        let Some(env) = world.upgrade() else { return };
        if moment == Moment::Listed
            && let Some((key, text)) = lock(&to_restore).take()
        {
            let soon = Duration::from_millis(random.below(2) * random.below(20));
            act(&env, soon, key, Some(text));
        }
        if moment != habit || left.load(Ordering::Relaxed) == 0 || !random.one_in(patience) {
            return;
        }
        let past = lock(&env.past).clone();
        let Some((key, before)) = past.get(pick(&random, past.len().max(1))) else { return };
        let key = if key.ends_with(".json") { return } else { key.clone() };
        if moment == Moment::Listing {
            let Ok(now) = lock(&env.bucket).get(&key) else { return };
            let now = String::from_utf8_lossy(&now.body).into_owned();
            let other = format!("frame {}", u64::from(now == "frame 0"));
            if lock(&to_restore).is_none() {
                left.fetch_sub(1, Ordering::Relaxed);
                *lock(&to_restore) = Some((key.clone(), now));
                act(&env, Duration::ZERO, key, Some(other));
            }
            return;
        }
        left.fetch_sub(1, Ordering::Relaxed);
        let text = if random.one_in(6) { Some(content(&random)) } else { before.clone() };
        let first = Duration::from_millis(random.below(60));
        act(&env, first, key.clone(), text);
        if random.one_in(3) {
            let later = first + Duration::from_millis(random.below(150));
            act(&env, later, key, Some(content(&random)));
        }
    })
}

/// Returns one of few contents, so that a change often goes back to an earlier one.
fn content(random: &Randomness) -> String {
    let number = random.below(2);
    match random.below(24) {
        0 => format!("bad {number}"),
        1 => format!("hang {number}"),
        2 => format!("crash {number}"),
        3..=5 => format!("split {} {number}", 2 + random.below(2)),
        _ => format!("frame {number}"),
    }
}

/// The user puts or deletes an object.
fn act(env: &Arc<SimEnvironment>, delay: Duration, key: String, text: Option<String>) {
    let world = env.clone();
    env.engine.after(delay, move || {
        let text = text.map(|text| perhaps_big(&world, &key, perhaps_with(&world, &key, text)));
        let now = WorldClock::exact(&world.engine).now();
        let there = text.is_some();
        let before = lock(&world.bucket).get(&key).ok();
        let before = before.map(|object| String::from_utf8_lossy(&object.body).into_owned());
        lock(&world.past).push((key.clone(), before));
        world.note(|| format!("the user: {key} {text:?}"));
        let changed = match text {
            Some(text) => lock(&world.bucket).put(now, &key, Bytes::from(text), PutOptions::always()).is_ok(),
            None => lock(&world.bucket).delete(&key),
        };
        let notify = lock(&world.notify).clone();
        if let Some(notify) = notify.filter(|_| changed) {
            notify(Actor::User, &key, there, &lock(&world.bucket));
        }
    });
}

/// In a world with files, half of the texts of scripts name some, always the same ones.
fn perhaps_with(world: &SimEnvironment, key: &str, text: String) -> String {
    let Some(lot) = *lock(&world.files) else { return text };
    let is_plain = !text.starts_with("with ") && !text.starts_with(BIG);
    let number = text.bytes().fold(lot, |number, byte| number.wrapping_mul(31) ^ u64::from(byte));
    let lots = Randomness::seeded(number);
    if key.ends_with(".txt") && is_plain && lots.one_in(2) {
        let names = ["f", "g", "f,g"][pick(&lots, 3)];
        return format!("with {names} {text}");
    }
    text
}

/// In a world with big frames, half of the texts of scripts have some, always the same ones.
fn perhaps_big(world: &SimEnvironment, key: &str, text: String) -> String {
    let Some(lot) = *lock(&world.big) else { return text };
    let number = text.bytes().fold(lot, |number, byte| number.wrapping_mul(31) ^ u64::from(byte));
    if key.ends_with(".txt") && !text.starts_with(BIG) && Randomness::seeded(number).one_in(2) {
        return format!("{BIG}{text}");
    }
    text
}

/// The invariants that hold at every moment.
#[derive(Default)]
struct Watch {
    manifest: Option<Manifest>,
    violation: Option<String>,
}

impl Watch {
    fn see(&mut self, actor: Actor, key: &str, there: bool, bucket: &Bucket) {
        if let Err(what) = self.check(actor, key, there, bucket) {
            self.violation.get_or_insert(what);
        }
    }

    fn check(&mut self, actor: Actor, key: &str, there: bool, bucket: &Bucket) -> Result<(), String> {
        if actor != Actor::User && key.starts_with("scripts/") {
            return Err(format!("{actor:?} wrote {key}"));
        }
        if actor == Actor::User && Uploaded::is_file(key) {
            return Ok(());
        }
        let Ok(parsed) = key.parse::<Key>() else {
            return Err(format!("{actor:?} wrote {key}, which is no key"));
        };
        let body = bucket.get(key).map(|object| object.body).unwrap_or_default();
        match parsed {
            Key::Manifest { animation }
                if actor == Actor::User && Manifest::decode(&animation, &body).is_err() =>
            {
                self.manifest = None;
            }
            Key::Manifest { animation } => {
                let manifest = Manifest::decode(&animation, &body).map_err(|error| error.to_string())?;
                let before = self.manifest.replace(manifest.clone());
                follows(&manifest, before.as_ref())?;
            }
            Key::Output { .. } if there => {
                let text = String::from_utf8_lossy(&body);
                let frames: Vec<(u64, String, u64)> = text.lines().filter_map(place_of).collect();
                if !frames.is_sorted()
                    || frames.windows(2).any(|pair| pair[0] == pair[1])
                    || frames.is_empty()
                {
                    return Err(format!("a GIF with its frames out of order:\n{text}"));
                }
            }
            _ => {}
        }
        Ok(())
    }
}

fn is_image(key: &str) -> bool {
    key.ends_with(".png") || key.ends_with(".band")
}

/// Returns the place of a picture in the animation: the number with which its script's name starts, the name, the part.
fn place_of(picture: &str) -> Option<(u64, String, u64)> {
    let mut fields = picture.split(':');
    let name = fields.next()?;
    let digits: String = name.chars().take_while(char::is_ascii_digit).collect();
    Some((digits.parse().ok()?, name.to_owned(), fields.next()?.parse().ok()?))
}

/// Lets the world come to rest and checks it.
struct Judge {
    engine: Engine,
    env: Arc<SimEnvironment>,
    platform: Arc<Platform>,
    animation: Animation,
    watch: Shared<Watch>,
}

impl Judge {
    /// A user overwrites the manifest, a frame or the GIF with garbage. This triggers no function.
    fn garble(&self, random: &Randomness) {
        let delay = Duration::from_micros(random.below(TROUBLES.as_micros() as u64));
        match random.below(3) {
            0 => return self.garble_a_frame(random.bits(), delay),
            1 => return self.cut_off_a_file(delay),
            _ => {}
        }
        let text = ["", "garbage\n", "{\"schema\":9},\n\"frames\":[\n\n]}\n"][pick(random, 3)];
        act(&self.env, delay, self.animation.manifest(), Some(text.to_owned()));
        self.platform.only_the_sweep_heals("the manifest was garbled");
    }

    /// A user overwrites a frame, or a band of one, with garbage.
    fn garble_a_frame(&self, lot: u64, delay: Duration) {
        let (world, platform) = (self.env.clone(), self.platform.clone());
        self.engine.after(delay, move || {
            let now = WorldClock::exact(&world.engine).now();
            let mut bucket = lock(&world.bucket);
            let frames: Vec<String> = bucket.keys().filter(|key| is_image(key)).map(str::to_owned).collect();
            let Some(key) = frames.get(pick(&Randomness::seeded(lot), frames.len().max(1))) else { return };
            world.note(|| format!("someone garbles {key}"));
            let _ = bucket.put(now, key, GARBLED.into(), PutOptions::always());
            platform.only_the_sweep_heals("a frame was garbled");
        });
    }

    /// A user replaces a file by half of it, with its metadata, once the manifest records its version.
    fn cut_off_a_file(&self, delay: Duration) {
        let (world, platform, animation) = (self.env.clone(), self.platform.clone(), self.animation.clone());
        self.engine.after(delay, move || {
            let now = WorldClock::exact(&world.engine).now();
            let mut bucket = lock(&world.bucket);
            let manifest = bucket.get(&animation.manifest()).ok();
            let manifest = manifest.and_then(|object| Manifest::decode(&animation, &object.body).ok());
            let output = manifest.as_ref().and_then(|manifest| manifest.head.outputs().last().copied());
            let key = animation.output(output.unwrap_or(Container::Gif));
            let Ok(Object { info, body }) = bucket.get(&key) else { return };
            // Files of two generations may be equal: then their metadata tell them apart.
            let is_named = |manifest: &Manifest| {
                let head = &manifest.head;
                output.and_then(|output| head.version_of(output)).is_some_and(|named| {
                    *named == info.etag && generation_of(Some(&info)) == Some(head.generation.as_str())
                })
            };
            if !manifest.as_ref().is_some_and(is_named) {
                return;
            }
            world.note(|| format!("someone cuts off {key}"));
            let options = PutOptions { metadata: info.metadata, ..PutOptions::always() };
            let _ = bucket.put(now, &key, body.slice(..body.len() / 2), options);
            platform.only_the_sweep_heals("a file was cut off");
        });
    }

    /// Stops all faults from now on.
    fn calm_down(&self) {
        *lock(&self.platform.chaos) = Chaos { delay_ms: 10, ..Chaos::default() };
        *lock(&self.env.faults) = Faults::default();
    }

    fn judge(&self) -> Result<Run, String> {
        self.rest()?;
        let needs_sweep = lock(&self.platform.diary).needs_sweep;
        let without_sweep = needs_sweep.is_none() && !self.platform.has_late_writes();
        if without_sweep {
            self.check().map_err(|what| format!("without a sweep: {what}"))?;
        }
        self.sweep_until_rest()?;
        // A user may change the script while the command looks: then it has retried a frame that is gone.
        for _ in 0..MAX_RETRIES {
            if self.wrongly_given_up() == 0 {
                break;
            }
            if lock(&self.platform.diary).needs_sweep.is_none() {
                return Err("a frame was given up that nothing had happened to".to_owned());
            }
            self.platform.submit(Work::Retry(self.animation.clone()), Duration::ZERO);
            self.rest()?;
            self.sweep_until_rest()?;
        }
        self.check()?;
        let diary = lock(&self.platform.diary);
        let seen = lock(&self.env.seen);
        Ok(Run {
            requests: self.env.requests.iter().map(|count| count.load(Ordering::Relaxed)).sum(),
            invocations: diary.invocations,
            without_sweep,
            given_up: diary.given_up,
            left: diary.left,
            late_writes: self.env.late_writes.load(Ordering::Relaxed),
            permissions: seen
                .iter()
                .map(|(actor, action, folder)| format!("{actor:?} {action:?} {folder}"))
                .collect(),
        })
    }

    /// Runs until nothing is left to happen.
    fn rest(&self) -> Result<(), String> {
        let limit = Duration::from_micros(self.engine.now_us()) + PATIENCE;
        if !self.engine.run(limit) {
            return Err("the world does not come to rest".to_owned());
        }
        if let Some(bug) = &lock(&self.platform.diary).bug {
            return Err(format!("an invocation failed for good: {bug}"));
        }
        lock(&self.env.set_back).clone().map_or(Ok(()), Err)?;
        lock(&self.watch).violation.clone().map_or(Ok(()), Err)
    }

    fn sweep_until_rest(&self) -> Result<(), String> {
        // Longer than the sweep's own patience with any frame.
        let pause = self.platform.policy.stuck_after * 8;
        for _ in 0..MAX_SWEEPS {
            let acts = lock(&self.env.past).len();
            self.platform.submit(Work::Sweep, pause);
            self.rest()?;
            let did_nothing =
                lock(&self.platform.diary).last_sweep.iter().all(|visit| *visit == Visit::default());
            if did_nothing && lock(&self.env.past).len() == acts {
                return Ok(());
            }
        }
        Err(format!("after {MAX_SWEEPS} sweeps there is still something to do"))
    }

    fn wrongly_given_up(&self) -> usize {
        let bucket = lock(&self.env.bucket);
        let manifest = bucket.get(&self.animation.manifest()).ok();
        let manifest = manifest.and_then(|object| Manifest::decode(&self.animation, &object.body).ok());
        manifest.map_or(0, |manifest| Expected::of(&bucket, &self.animation).wrongly_given_up(&manifest))
    }

    fn check(&self) -> Result<(), String> {
        let bucket = lock(&self.env.bucket);
        let torn =
            |key: &&str| bucket.get(key).is_ok_and(|image| image.body.windows(4).any(|text| text == b"torn"));
        if let Some(key) = bucket.keys().find(torn) {
            return Err(format!("{key} was put together of what does not belong together"));
        }
        Expected::of(&bucket, &self.animation).check(&bucket, &self.animation)
    }
}
