//! An animation in a bucket: uploads its scripts and downloads its GIF, by the same client as the command line.
//!
//! Python's lock is released meanwhile. Between two polls of the bucket the run checks for Ctrl-C and reports the
//! progress, for which it takes Python's lock. It keeps no state: an interrupted run continues from the contents of the
//! bucket.

use std::cell::RefCell;
use std::error::Error as StdError;
use std::path::PathBuf;
use std::time::Duration;

use pyo3::exceptions::{PyFileExistsError, PyOSError, PyRuntimeError, PyUserWarning, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use rayfold_client::{
    Client, Content, Ended, Error, File, Obstacle, Sending, Submission, Submitted, Waiting, address,
    obstacles,
};
use rayfold_files::probe;
use rayfold_pipeline::SystemClock;
use rayfold_pipeline::keys::{Animation, ScriptName};
use rayfold_pipeline::manifest::Manifest;
use rayfold_pipeline::store::S3Store;
use rayfold_scene::{Container, UnknownContainer};

use crate::error::{guarded, os_error, scene_error};
use crate::given::Given;
use crate::place::quoted;

/// The time between two looks for Ctrl-C.
const LOOK: Duration = Duration::from_millis(50);

/// The most scripts that a message names.
const MOST: usize = 20;

/// A wanted animation of a bucket.
struct Order {
    bucket: String,
    animation: Animation,
    submission: Submission,
    output: Container,
    /// The file to write; without one its bytes are returned.
    path: Option<PathBuf>,
    is_awaited: bool,
}

/// The callable for progress, which gets the kind of work, the number done and the total.
struct Reports {
    report: Option<Py<PyAny>>,
    /// The exception of a progress report, such as a warning that is an error. It ends the run.
    failed: RefCell<Option<PyErr>>,
}

/// Makes the scripts, and the files that they name, those of an animation in a bucket. `place` is `s3://BUCKET/NAME`. Waits for the `output`, a file such as `gif`, if it `is_awaited`,
/// and returns its bytes, or writes them to `path`. `report` is called with a kind, the number done and the total.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "the properties of a submission, which Python names")]
pub(crate) fn submit<'py>(
    py: Python<'py>,
    place: &str,
    scripts: Vec<(String, String)>,
    files: Vec<(String, PathBuf)>,
    given: Vec<Given>,
    settings: String,
    output: &str,
    path: Option<PathBuf>,
    delete: bool,
    is_awaited: bool,
    report: Option<Py<PyAny>>,
) -> PyResult<Option<Bound<'py, PyBytes>>> {
    let (bucket, animation) = parse_place(place)?;
    let output: Container =
        output.parse().map_err(|error: UnknownContainer| PyValueError::new_err(error.to_string()))?;
    if let Some(path) = &path {
        probe(path).map_err(os_error)?;
    }
    let scripts = scripts.into_iter().map(|(name, text)| Ok((ScriptName::new(&name)?, File::of_text(text))));
    let scripts: Vec<_> = scripts.collect::<Result<_, rayfold_pipeline::Error>>().map_err(value_error)?;
    let submission =
        Submission::new(animation.clone(), scripts, File::of_text(settings)).map_err(value_error)?;
    let files = py.detach(|| read(files, &given))?;
    let submission = submission.with_files(files).map_err(|error| match error {
        Error::Store(error) => value_error(error),
        other => PyOSError::new_err(other.to_string()),
    })?;
    let submission = if delete { submission.deleting_all_others() } else { submission };
    let order = Order { bucket, animation, submission, output, path, is_awaited };
    let gif = py.detach(|| guarded(|| run(&order, Reports { report, failed: RefCell::default() })))??;
    Ok(gif.map(|gif| PyBytes::new(py, &gif)))
}

/// Reads the files for their digests, those on disk and those in memory.
fn read(files: Vec<(String, PathBuf)>, given: &[Given]) -> PyResult<Vec<(String, File)>> {
    let file = |(name, path)| Ok((name, File::new(Content::Path(path))?));
    let in_memory = given.iter().map(|given| Ok((given.name_of().to_owned(), given.file()?)));
    files
        .into_iter()
        .map(file)
        .chain(in_memory)
        .collect::<Result<_, Error>>()
        .map_err(|error| PyOSError::new_err(error.to_string()))
}

/// Takes `s3://BUCKET/NAME` apart.
fn parse_place(place: &str) -> PyResult<(String, Animation)> {
    let parts = place.strip_prefix("s3://").and_then(|rest| rest.trim_end_matches('/').split_once('/'));
    let Some((bucket, name)) = parts.filter(|(bucket, name)| !bucket.is_empty() && !name.is_empty()) else {
        return Err(PyValueError::new_err(format!(
            "submit(): address is a bucket and a name such as \"s3://films/wave\", not {}",
            quoted(place)
        )));
    };
    let animation = Animation::new(name).map_err(|error| match error {
        rayfold_pipeline::Error::Key { problem, .. } => {
            PyValueError::new_err(format!("submit(): address {}: {problem}", quoted(place)))
        }
        other => value_error(other),
    })?;
    Ok((bucket.to_owned(), animation))
}

/// Runs the work on a tokio runtime of its own, until it is done or Ctrl-C comes.
fn run(order: &Order, reports: Reports) -> PyResult<Option<Vec<u8>>> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let result = runtime.block_on(async {
        let work = async {
            let store = S3Store::from_environment(&order.bucket).await.map_err(Error::from);
            let store = store.map_err(|error| client_error(&error, order))?;
            deliver(Client::new(&store, &SystemClock), order, &reports).await
        };
        tokio::select! {
            result = work => result,
            stopped = interrupted(&reports) => Err(stopped),
        }
    });
    // A look for the address of a host may take its time, and nothing waits for it after Ctrl-C.
    runtime.shutdown_background();
    result
}

async fn deliver(
    client: Client<'_, S3Store, SystemClock>,
    order: &Order,
    reports: &Reports,
) -> PyResult<Option<Vec<u8>>> {
    let wrong = |error: Error| client_error(&error, order);
    let sending = |sending| match sending {
        Sending::Uploading { done, total } => reports.at("scripts", done, total),
        Sending::Deleted { .. } | Sending::Finished { .. } => {}
    };
    let submitted: Submitted = client.submit(&order.submission, sending).await.map_err(wrong)?;
    if !order.is_awaited {
        return Ok(None);
    }
    let waiting = |waiting| match waiting {
        Waiting::Frames { done, total } => reports.at("frames", done, total),
        Waiting::Quiet(quiet) => reports.warn(quiet),
    };
    match client.wait(&order.animation, &submitted, waiting).await.map_err(wrong)? {
        Ended::Files(_) => {}
        Ended::Failed(manifest) => return Err(failed(&manifest)),
    }
    match &order.path {
        Some(path) => {
            client.download(&order.animation, order.output, path).await.map(|_| None).map_err(wrong)
        }
        None => {
            let mut gif = Vec::new();
            client.fetch(&order.animation, order.output, &mut gif).await.map_err(wrong)?;
            Ok(Some(gif))
        }
    }
}

/// Ends with the exception of a signal or of a report.
async fn interrupted(reports: &Reports) -> PyErr {
    loop {
        tokio::time::sleep(LOOK).await;
        if let Some(failed) = reports.failed.take() {
            return failed;
        }
        if let Err(stopped) = Python::attach(|py| py.check_signals()) {
            return stopped;
        }
    }
}

impl Reports {
    fn at(&self, what: &str, done: u64, total: u64) {
        let Some(report) = &self.report else { return };
        self.note(Python::attach(|py| report.call1(py, (what, done, total)).err()));
    }

    fn warn(&self, quiet: Duration) {
        let text = format!(
            "nothing has happened for {} s: are the functions running? Ctrl-C loses nothing",
            quiet.as_secs()
        );
        self.note(Python::attach(|py| {
            let category = py.get_type::<PyUserWarning>();
            py.import("warnings").and_then(|module| module.call_method1("warn", (text, category, 3))).err()
        }));
    }

    fn note(&self, failed: Option<PyErr>) {
        if failed.is_some() {
            self.failed.replace(failed);
        }
    }
}

/// Makes the exception for an animation without a GIF.
fn failed(manifest: &Manifest) -> PyErr {
    let head = &manifest.head;
    let obstacles = obstacles(manifest);
    let reasons = || obstacles.iter().filter_map(|obstacle| obstacle.reason);
    let diagnostics: Vec<_> = reasons().flat_map(|reason| reason.diagnostics.iter().cloned()).collect();
    if !diagnostics.is_empty() && reasons().all(|reason| !reason.diagnostics.is_empty()) {
        return Python::attach(|py| scene_error(py, diagnostics));
    }
    let mut text = format!("{} is {}: {} frames of {}", head.animation, head.status, head.done, head.total);
    let rejected = head.rejected.iter().map(|rejected| format!("\n{}: {}", rejected.key, rejected.problem));
    let lines = obstacles.iter().map(|Obstacle { what, reason }| {
        format!("\n{what}: {}", reason.map_or("no reason is known yet", |reason| reason.message.as_str()))
    });
    text.extend(rejected.chain(lines).take(MOST));
    PyRuntimeError::new_err(text)
}

/// Makes the exception for an error of the client.
fn client_error(error: &Error, order: &Order) -> PyErr {
    let folder = address(&order.bucket, &order.animation.scripts());
    if let Error::WouldDelete { keys } = error {
        let mut names = keys.iter().take(MOST).map(String::as_str).collect::<Vec<_>>().join(", ");
        if keys.len() > MOST {
            names += &format!(" and {} more", keys.len() - MOST);
        }
        return PyFileExistsError::new_err(format!(
            "{folder} holds other scripts, which would be frames too: {names}; nothing was uploaded: delete=True deletes \
             them, another name leaves them alone"
        ));
    }
    let words = match error.explain(&order.bucket) {
        Some(words) if error.is_of_store() => format!("{words}: {}", chain(error)),
        Some(words) => words,
        None => chain(error),
    };
    if error.is_of_store() || matches!(error, Error::Output(_) | Error::Write(_)) {
        PyOSError::new_err(words)
    } else {
        PyRuntimeError::new_err(words)
    }
}

/// Returns an error and its sources as one line.
fn chain(error: &dyn StdError) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(error) = source {
        text += &format!(": {error}");
        source = error.source();
    }
    text
}

fn value_error(error: impl StdError) -> PyErr {
    PyValueError::new_err(chain(&error))
}
