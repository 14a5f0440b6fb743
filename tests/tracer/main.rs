//! The tracer from outside: packets against the plain tracer, committed frames, means of samples, and bands.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test may panic, and says what it measured")]

mod bands;
mod covers;
mod dice;
mod fast_glass;
mod fast_language;
mod fast_path;
mod first_hits;
mod golden;
mod hold;
mod images;
mod light;
mod meshes;
mod sampled;
mod sampled_small;
mod skies;

/// Returns whether a run tries a case, for a test that takes long: it takes one in `of`, another one each second.
/// `RAYFOLD_TESTS=all` takes all.
fn one_in(of: usize) -> impl Fn(usize) -> bool {
    let now = std::time::UNIX_EPOCH.elapsed().unwrap().as_secs() as usize;
    let are_all = std::env::var_os("RAYFOLD_TESTS").is_some_and(|tests| tests == "all");
    move |case| are_all || case % of == now % of
}
