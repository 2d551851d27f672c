//! Cargo takes the features of build dependencies into account only if there is a build script.

fn main() {}
