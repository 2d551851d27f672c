//! The `maglev` command.
fn main() {}
