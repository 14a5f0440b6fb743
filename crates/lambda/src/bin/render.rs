//! The program of the render function.

fn main() -> anyhow::Result<()> {
    rayfold_lambda::run(rayfold_lambda::Function::Render)
}
