//! The extension module of the Python package: scenes as text, pictures, animations.
//!
//! A scene is the text of its script (`script`), so Python draws the same picture as `rayfold render` does from that
//! text. This crate makes all checks, texts and pictures:
//!
//! 1. `signature` turns the table of commands and clauses into methods, parameters and keywords. `describe` makes their
//!    docstrings and the type stub `__init__.pyi`, which a test compares.
//! 2. A call binds its arguments, writes them as a line (`value`, `material`, `curve`), and lets the command check the
//!    numbers (`Command::check`). A wrong argument is an error at the call.
//! 3. `drawing` parses the text and draws frames ahead on the rayon pool, and looks for Ctrl-C while it waits.
//!    `encoder` writes them. `folder` reads folders of scripts. `bucket` renders them in a bucket, by the crate
//!    `client`.
//! 4. Meshes and pictures from arrays are files in memory (`given`), named by the hash of their content: binary PLY,
//!    PNG and OpenEXR (`arrays`). A script that names one finds it by the same trait as files in folders. They are
//!    written beside saved scripts.
//!
//! Python's side (`python/rayfold`) is small. `_scene` makes a method of each command in `signature::METHODS` when it
//! is first asked for. `_animation` takes scenes from functions and iterators. `_picture` is an array with a picture,
//! and `_arrays` checks arrays and gives them their shape. Only the last two import NumPy, and only when they are
//! needed, so that `import rayfold` is fast.
//!
//! `unsafe`: this crate writes none. PyO3's attributes expand to `unsafe` for the pointers that CPython passes when
//! Python calls a Rust function. The lint allows that in code from other crates' macros, so `forbid` holds here as in
//! the whole workspace.
//!
//! Invariants: Python's lock is released while a scene is parsed, drawn or encoded. A panic becomes a Python exception.
//!
//! Cargo builds the library without an interpreter, and `cargo clippy --workspace` checks it. A test program could not
//! be linked, so there are no tests in Rust. The tests are pytest (`crates/python/tests`), run by `.ci/run`. `cargo
//! xtask wheel` builds the file that pip installs.

mod arrays;
mod bucket;
mod curve;
mod describe;
mod drawing;
mod encoder;
mod error;
mod folder;
mod given;
mod material;
mod place;
mod script;
mod signature;
mod value;

use pyo3::prelude::*;
use pyo3::types::PyModule;
use rayfold_scene::assets::limits as bounds;

/// A method of `Scene`: its name, its parameters, and whether it takes the clauses of a material.
type Method = (String, Vec<Parameter>, bool);
/// The name of a parameter, whether it is required, and the count of its numbers.
type Parameter = (String, bool, usize);

/// The methods of `Scene`, in the order in which `Script._add` counts them.
#[pyfunction]
fn methods() -> Vec<Method> {
    let parameter = |method: &signature::Signature, parameter: &signature::Parameter| {
        let numbers = match parameter.role {
            signature::Role::Field(i) => method.command.form().fields[i].names.len(),
            signature::Role::Smooth => 1,
            signature::Role::Name(_)
            | signature::Role::Material(_)
            | signature::Role::Flat
            | signature::Role::Align
            | signature::Role::Font => 0,
        };
        (parameter.name.clone(), parameter.is_required, numbers)
    };
    let method = |method: &signature::Signature| {
        let parameters = method.parameters.iter().map(|p| parameter(method, p)).collect();
        (method.method.clone(), parameters, method.has_clauses())
    };
    signature::METHODS.iter().map(method).collect()
}

/// The documentation of the method with this index.
#[pyfunction]
fn method_doc(index: usize) -> String {
    describe::method_doc(&signature::METHODS[index])
}

/// The most triangles of a mesh, pixels of a picture, and bytes of a file.
#[pyfunction]
fn limits() -> (usize, u64, u64) {
    (bounds::TRIANGLES, bounds::PIXELS, bounds::FILE_BYTES)
}

/// The keywords of a material, each with the entries of its value.
#[pyfunction]
fn clauses() -> Vec<(String, Vec<String>)> {
    signature::CLAUSES.iter().map(|keyword| (keyword.name.clone(), keyword.entries.clone())).collect()
}

/// The names of the commands that may be keywords of `Scene`.
#[pyfunction]
fn settings() -> Vec<String> {
    describe::settings().map(|method| method.method.clone()).collect()
}

/// The text of `__init__.pyi`.
#[pyfunction]
fn stub() -> String {
    describe::stub()
}

#[pymodule]
fn _rayfold(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("material_doc", describe::material_doc())?;
    module.add("keys_doc", describe::keys_doc())?;
    module.add_class::<curve::Curve>()?;
    module.add_class::<drawing::Ahead>()?;
    module.add_class::<drawing::Image>()?;
    module.add_class::<encoder::Encoder>()?;
    module.add_class::<error::Diagnostic>()?;
    module.add_class::<given::Given>()?;
    module.add_class::<material::Material>()?;
    module.add_class::<script::Script>()?;
    module.add_function(wrap_pyfunction!(methods, module)?)?;
    module.add_function(wrap_pyfunction!(method_doc, module)?)?;
    module.add_function(wrap_pyfunction!(limits, module)?)?;
    module.add_function(wrap_pyfunction!(clauses, module)?)?;
    module.add_function(wrap_pyfunction!(settings, module)?)?;
    module.add_function(wrap_pyfunction!(stub, module)?)?;
    module.add_function(wrap_pyfunction!(arrays::mesh_file, module)?)?;
    module.add_function(wrap_pyfunction!(arrays::levels_file, module)?)?;
    module.add_function(wrap_pyfunction!(arrays::light_file, module)?)?;
    module.add_function(wrap_pyfunction!(bucket::submit, module)?)?;
    module.add_function(wrap_pyfunction!(curve::keys, module)?)?;
    module.add_function(wrap_pyfunction!(encoder::write_file, module)?)?;
    module.add_function(wrap_pyfunction!(folder::read_folder, module)?)?;
    module.add_function(wrap_pyfunction!(folder::settings_text, module)?)?;
    Ok(())
}
