//! Embeds the built page in the library, if it has been built. Does not build it: that needs Node, which is not
//! required to compile or test.

use std::path::PathBuf;
use std::{env, fs, io};

fn main() -> io::Result<()> {
    let dist = PathBuf::from("web/dist");
    println!("cargo::rerun-if-changed={}", dist.display());
    let out = PathBuf::from(env::var_os("OUT_DIR").ok_or_else(|| io::Error::other("no OUT_DIR"))?);
    for name in ["index.html", "studio.js", "studio.css"] {
        // An empty file means that the page has not been built.
        fs::write(out.join(name), fs::read(dist.join(name)).unwrap_or_default())?;
    }
    Ok(())
}
