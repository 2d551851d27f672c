//! `cargo xtask codegen`'s second half, a program of its own so that only it needs bindgen:
//! `cargo run -p xtask --features codegen --bin bindings [-- --check]`.

#[path = "../codegen.rs"]
mod codegen;

fn main() -> anyhow::Result<()> {
    codegen::run(std::env::args().any(|argument| argument == "--check"))
}
