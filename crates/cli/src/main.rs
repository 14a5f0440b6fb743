//! The `rayfold` command.

fn main() {}
