//! `cargo xtask`: set-up and the project's commands.

fn main() {}
