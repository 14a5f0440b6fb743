//! Draws the first frame of a script a given number of times on one thread. Prints the instruction set that was used
//! and a digest of the picture. `rayfold-bench needs` counts the instructions of this program.
//!
//! usage: frames SCRIPT TIMES auto|f32|f64

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program")]

use std::hash::{DefaultHasher, Hasher};
use std::process::ExitCode;

use rayfold_scene::assets::{Library, MemoryFiles};
use rayfold_scene::{Limits, parse_with_files};
use rayfold_tracer::{Level, Precision, RenderError, RenderOptions, render_frame};

/// The exit code for a scene that needs a feature which this build leaves out.
const LEFT_OUT: u8 = 3;

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            let left_out = matches!(error.downcast_ref(), Some(RenderError::LeftOut { .. }));
            ExitCode::from(if left_out { LEFT_OUT } else { 1 })
        }
    }
}

fn run() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [path, times, precision] = &arguments[..] else {
        return Err("usage: frames SCRIPT TIMES auto|f32|f64".into());
    };
    let precision = match &precision[..] {
        "f32" => Precision::F32,
        "f64" => Precision::F64,
        _ => Precision::Auto,
    };
    // The model and the picture beside the script, if they are there.
    let mut files = MemoryFiles::default();
    for name in ["model.obj", "sky.png"] {
        if let Ok(bytes) = std::fs::read(std::path::Path::new(path).with_file_name(name)) {
            files.insert(name, bytes);
        }
    }
    let library = Library::new(files);
    // Models are read here, too: threads that wait for each other take any number of instructions.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build()?;
    let text = std::fs::read(path)?;
    let parsed = pool.install(|| parse_with_files(path, &text, &Limits::default(), &library));
    let script = parsed.script.ok_or("not a script")?;
    let mut digest = DefaultHasher::new();
    for _ in 0..times.parse()? {
        let options = RenderOptions { precision, ..Default::default() };
        let image = pool.install(|| render_frame(&script, 0, &options)).ok_or("nothing is shown")??;
        digest.write(image.as_raw());
    }
    println!("{:?} {:016x}", Level::new(), digest.finish());
    Ok(())
}
