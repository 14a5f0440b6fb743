//! Draws the scripts on standard input, and prints the name and the fingerprint of each. `rayfold-bench fingerprints --on`
//! builds this program for other kinds of machines.
//!
//! Before each file stands a line with its name and its length in bytes. What is not named `*.txt` is there for the scripts
//! that follow.

#![allow(clippy::print_stdout, reason = "a program")]

use std::io::{BufRead, Read};

use rayfold_scene::assets::{Library, MemoryFiles};
use rayfold_scene::{Limits, parse_with_files};
use rayfold_tracer::{RenderOptions, probe};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut input = std::io::stdin().lock();
    let mut files = MemoryFiles::default();
    let mut library = Library::new(files.clone());
    let mut head = String::new();
    while input.read_line(&mut head)? > 0 {
        let (name, length) = head.trim_end().rsplit_once(' ').ok_or("a name and a length are needed")?;
        let mut bytes = vec![0; length.parse()?];
        input.read_exact(&mut bytes)?;
        if name.ends_with(".txt") {
            let parsed = parse_with_files(name, &bytes, &Limits::default(), &library);
            let script = parsed.script.ok_or_else(|| format!("{name}: {:?}", parsed.diagnostics))?;
            println!("{name} {:016x}", probe::fingerprint(&script, &RenderOptions::default())?);
        } else {
            files.insert(name, bytes);
            library = Library::new(files.clone());
        }
        head.clear();
    }
    Ok(())
}
