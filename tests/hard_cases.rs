//! The hard cases at their quick sizes, every backend within its bounds: one test per case. To see the figures: `cargo
//! test --test hard_cases -- --nocapture`.

#![allow(clippy::unwrap_used, reason = "a panic is how a test fails, also in the functions that tests share")]

use rayfold_bench::backends;
use rayfold_bench::hard_cases::{CASES, SEED, Size};

#[test]
fn hard_cases_keep_their_bounds() {
    let backends = backends::all();
    let mut failed = Vec::new();
    println!("seed {SEED}");
    for case in CASES {
        let began = std::time::Instant::now();
        let figures = case.figures(&backends, Size::Quick).unwrap();
        println!("\n{} {} ({:.1} s)", case.number, case.title, began.elapsed().as_secs_f64());
        assert!(!figures.is_empty(), "case {} measures nothing", case.number);
        for figure in figures {
            println!("  {figure}");
            if !figure.passes() {
                failed.push(format!("{}: {figure}", case.number));
            }
        }
    }
    assert!(failed.is_empty(), "seed {SEED}, beyond their bounds:\n{}", failed.join("\n"));
}
