//! Lets the `train-bc` binary find MuJoCo's library where `cargo xtask setup` put it.

fn main() {
    let root = std::env::var("CARGO_MANIFEST_DIR").expect("cargo sets CARGO_MANIFEST_DIR");
    println!("cargo:rustc-link-arg-bins=-Wl,-rpath,{root}/../third_party/mujoco/lib");
}
