//! The hard cases at their quick sizes, every way to trace within its bounds: a test a case. The figures are printed:
//! `cargo test --test hard_cases -- --nocapture`.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails, also in the functions that tests share")]

use rayfold_bench::hard_cases::{CASES, SEED, Size};
use rayfold_bench::tracers;

/// Where the packets fall short of their bounds as yet: case, part of the way's name, part of what is measured. An entry
/// that no figure needs any more fails the test.
const SHORTFALLS: &[(&str, &str, &str)] = &[
    ("19", "f32", "scaled by 2^-1000"),
    ("19", "f32", "scaled by 2^-500"),
    ("19", "f32", "scaled by 2^500"),
    ("19", "f32", "scaled by 2^1000"),
    ("19", "f64", "scaled by 2^-1000"),
    ("19", "f64", "scaled by 2^-500"),
    ("19", "f64", "scaled by 2^500"),
    ("19", "f64", "scaled by 2^1000"),
    ("19", "auto", "scaled by 2^-1000"),
    ("19", "auto", "scaled by 2^-500"),
    ("19", "auto", "scaled by 2^500"),
    ("19", "auto", "scaled by 2^1000"),
    ("19", "f32", "huge colours"),
    ("19", "auto", "huge colours"),
];

#[test]
fn hard_cases_keep_their_bounds() {
    let tracers = tracers::all();
    let mut failed = Vec::new();
    let mut fell_short = Vec::new();
    println!("seed {SEED}");
    for case in CASES {
        let began = std::time::Instant::now();
        let figures = case.figures(&tracers, Size::Quick).unwrap();
        println!("\n{} {} ({:.1} s)", case.number, case.title, began.elapsed().as_secs_f64());
        assert!(!figures.is_empty(), "case {} measures nothing", case.number);
        for figure in figures {
            println!("  {figure}");
            if !figure.passes() {
                let known = SHORTFALLS.iter().position(|(number, way, what)| {
                    *number == case.number && figure.tracer.contains(way) && figure.what.contains(what)
                });
                match known {
                    Some(entry) => fell_short.push(entry),
                    None => failed.push(format!("{}: {figure}", case.number)),
                }
            }
        }
    }
    for (entry, shortfall) in SHORTFALLS.iter().enumerate() {
        assert!(fell_short.contains(&entry), "{shortfall:?} keeps its bound now: take it off the list");
    }
    assert!(failed.is_empty(), "seed {SEED}, beyond their bounds:\n{}", failed.join("\n"));
}
