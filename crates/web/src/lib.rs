//! The studio as a WebAssembly module. It does the work of `crates/studio` without a server
//! ([`rayfold_studio::browser`]). Its functions of numbers are called by the scripts of a page
//! (`crates/studio/web/src/static/module.ts`).
//!
//! Each worker of the page has a module of its own, and workers share no memory. A module works as one of these:
//!
//! - [`Desk`] holds the session, and returns the tasks of the page's scripts ([`Effect`]). Its files are in memory
//!   (`storage::Memory`), and the page keeps them in the browser's storage.
//! - [`Drawer`] draws rows of a picture.
//! - [`Reel`] draws and encodes the frames of an animation.
//!
//! A call takes its bytes from one buffer and leaves its result in another. The page writes to the address that
//! [`input`] returns, and [`call`]s. Then it reads the result from the address that [`output`] returns, with the length
//! that [`call`] returns. The first byte of a result is 0 for success. It is 1 for an error, and then the error message
//! follows.
//!
//! A panic ends a module: the call does not return, and no other call may follow. Then [`fault`] returns the length of
//! its message.
//!
//! The module imports nothing from the page. There is no unsafe code here. Exporting a name needs an exception from the
//! lint `unsafe_code`, because two functions of one name would be undefined behaviour.
//!
//! # The page
//!
//! The page is that of the program, with another connection (`#connection`, `#runs`). `variant.ts` in `static` chooses
//! one of two builds of the module. If a stack serves the page, it can submit, by the scripts in `static/stack`:
//!
//! - They sign requests to S3, and compute the state of runs from manifests, as `studio::runs` does for the program.
//!   Tests compare both on the cases in `studio/src/runs/standing.json`.
//! - `cost` computes the same estimate as `client::cost` from the same prices. A test compares them.
//! - `retry` does the work of `pipeline::retry`, within the rights of a person.

use std::fmt::Display;
use std::sync::{Mutex, MutexGuard, Once, PoisonError};

use rayfold_studio::browser::{Desk, Drawer, Effect, File, Reel, files_of, packet, unzipped, zipped};

static INPUT: Mutex<Vec<u8>> = Mutex::new(Vec::new());
static OUTPUT: Mutex<Vec<u8>> = Mutex::new(Vec::new());
static STATE: Mutex<State> = Mutex::new(State { desk: None, drawer: None, reel: None });

/// The work of this module's worker.
struct State {
    desk: Option<Desk>,
    drawer: Option<Drawer>,
    reel: Option<Reel>,
}

fn locked<T>(of: &'static Mutex<T>) -> MutexGuard<'static, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Makes room for the bytes of the next call, and returns its address.
#[allow(unsafe_code, reason = "the name is exported")]
#[unsafe(no_mangle)]
pub extern "C" fn input(length: usize) -> *mut u8 {
    locked(&OUTPUT).clear();
    let mut input = locked(&INPUT);
    input.clear();
    input.resize(length, 0);
    input.as_mut_ptr()
}

/// Returns the address of the last call's result.
#[allow(unsafe_code, reason = "the name is exported")]
#[unsafe(no_mangle)]
pub extern "C" fn output() -> *const u8 {
    locked(&OUTPUT).as_ptr()
}

/// Returns the length of the message of the panic that ended a call, or 0 if there was no panic.
#[allow(unsafe_code, reason = "the name is exported")]
#[unsafe(no_mangle)]
pub extern "C" fn fault() -> usize {
    locked(&OUTPUT).len()
}

/// Makes a panic leave its message as the result.
fn keep_faults() {
    static KEPT: Once = Once::new();
    KEPT.call_once(|| {
        std::panic::set_hook(Box::new(|panic| *locked(&OUTPUT) = panic.to_string().into_bytes()));
    });
}

/// Runs the call with the number `what`, at this time in milliseconds. Returns the length of the result.
#[allow(unsafe_code, reason = "the name is exported")]
#[unsafe(no_mangle)]
pub extern "C" fn call(what: u32, number: u32, time: f64) -> usize {
    keep_faults();
    set_time((1000.0 * time) as u64);
    let bytes = std::mem::take(&mut *locked(&INPUT));
    let result = run(&mut locked(&STATE), what, number, bytes);
    let output = match result {
        Ok(bytes) => [&[0], bytes.as_slice()].concat(),
        Err(why) => [&[1], why.as_bytes()].concat(),
    };
    let length = output.len();
    *locked(&OUTPUT) = output;
    length
}

#[cfg(target_arch = "wasm32")]
use rayfold_studio::browser::{provide_font, set_time};

/// On other targets the system has a clock.
#[cfg(not(target_arch = "wasm32"))]
fn set_time(_: u64) {}

/// On other targets the font is a part of the program.
#[cfg(not(target_arch = "wasm32"))]
fn provide_font(_: Vec<u8>) {}

/// Runs a call. The numbers are those of `Call` in `module.ts`.
fn run(state: &mut State, what: u32, number: u32, bytes: Vec<u8>) -> Result<Vec<u8>, String> {
    let State { desk, drawer, reel } = state;
    match what {
        0 => {
            // The first one is the project, and its name is all of it.
            let mut files = unpacked(&bytes)?.into_iter();
            let (name, _) = files.next().ok_or("a project has a name")?;
            let opened = Desk::open(&name, files.collect(), number as usize).map_err(message)?;
            return Ok(written(desk.insert(opened).effects()));
        }
        1..=7 => {
            let desk = desk.as_mut().ok_or("no project is open")?;
            match what {
                1 => desk.hear(&text(bytes)?),
                2 => desk.tick(number != 0),
                3 => desk.drawn(number as usize, bytes),
                4 => desk.get(number, &text(bytes)?),
                5 => unpacked(&bytes)?.into_iter().for_each(|(name, content)| desk.put(&name, content)),
                7 => desk.lost(number as usize),
                _ => {
                    let (name, files) = desk.files();
                    return Ok([packet([(name.as_str(), [].as_slice())]), packed(&files)].concat());
                }
            }
            return Ok(written(desk.effects()));
        }
        10 => {
            let drawer = drawer.get_or_insert_default();
            unpacked(&bytes)?.into_iter().for_each(|(name, content)| drawer.put(&name, content));
        }
        11 => return drawer.get_or_insert_default().draw(&text(bytes)?).map_err(message),
        20 => {
            // The first one is the format.
            let mut files = unpacked(&bytes)?.into_iter();
            let (format, _) = files.next().ok_or("a file has a format")?;
            let begun = Reel::new(files.collect(), &format).map_err(message)?;
            return Ok((reel.insert(begun).count() as u32).to_le_bytes().into());
        }
        21 => return reel.as_ref().ok_or("nothing is rendered")?.draw(number as usize).map_err(message),
        22 => reel.as_mut().ok_or("nothing is rendered")?.push(&bytes).map_err(message)?,
        23 => return reel.take().ok_or("nothing is rendered")?.finish().map_err(message),
        30 => {
            // The names of files that are left out come first, as a list in a file without name.
            let (mut files, left_out) = unzipped(&bytes).map_err(message)?;
            files.insert(0, (String::new(), left_out.join(", ").into()));
            return Ok(packed(&files));
        }
        31 => return zipped(&unpacked(&bytes)?).map_err(message),
        40 => provide_font(bytes),
        _ => return Err(format!("there is no call {what}")),
    }
    Ok(Vec::new())
}

/// Returns the page's instructions as one run of bytes: for each its kind, its number, the length of its content, and
/// its content. Numbers are 32-bit and little-endian.
fn written(effects: Vec<Effect>) -> Vec<u8> {
    let mut bytes = Vec::new();
    for effect in effects {
        let (kind, number, content) = match effect {
            Effect::Tell(message) => (0, 0, message.into_bytes()),
            Effect::Show(picture) => (1, 0, picture),
            Effect::Put(worker, name, content) => {
                (2, worker as u32, packet([(name.as_str(), content.as_slice())]))
            }
            Effect::Draw(worker, task) => (3, worker as u32, task.into_bytes()),
            Effect::Save(name, content) => (4, 0, packet([(name.as_str(), content.as_slice())])),
            Effect::Answer(number, content) => (5, number, content),
            Effect::Wake(millis) => (6, millis, Vec::new()),
            Effect::Film(format) => (7, 0, format.unwrap_or_default().into()),
        };
        for number in [kind, number, content.len() as u32] {
            bytes.extend_from_slice(&number.to_le_bytes());
        }
        bytes.extend_from_slice(&content);
    }
    bytes
}

fn unpacked(bytes: &[u8]) -> Result<Vec<File>, String> {
    files_of(bytes).ok_or_else(|| "files were cut off".to_owned())
}

fn packed(files: &[File]) -> Vec<u8> {
    packet(files.iter().map(|(name, content)| (name.as_str(), content.as_slice())))
}

fn text(bytes: Vec<u8>) -> Result<String, String> {
    String::from_utf8(bytes).map_err(message)
}

fn message(error: impl Display) -> String {
    error.to_string()
}
