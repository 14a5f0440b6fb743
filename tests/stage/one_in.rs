//! Tests that take long try a part of their cases in each run.

/// Returns whether this run tries a case: it tries one in `of`, chosen by a seed. The seed is the time in seconds, and
/// is printed; `RAYFOLD_SEED` sets it. With `RAYFOLD_TESTS=all` a run tries all cases.
#[allow(clippy::print_stdout, reason = "a test says what repeats it")]
pub(crate) fn one_in(of: usize) -> impl Fn(usize) -> bool {
    let given = std::env::var("RAYFOLD_SEED").ok().map(|seed| seed.parse().unwrap());
    let seed: usize = given.unwrap_or_else(|| std::time::UNIX_EPOCH.elapsed().unwrap().as_secs() as usize);
    let are_all = std::env::var_os("RAYFOLD_TESTS").is_some_and(|tests| tests == "all");
    println!("RAYFOLD_SEED={seed}");
    move |case| are_all || case % of == seed % of
}
