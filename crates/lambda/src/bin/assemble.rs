//! The program of the assemble function.

fn main() -> anyhow::Result<()> {
    rayfold_lambda::run(rayfold_lambda::Function::Assemble)
}
