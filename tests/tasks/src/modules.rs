//! `cargo sandbox-formats`: the formats of this project as WebAssembly modules, beside the program, for
//! `--sandbox-formats`.

use crate::cargo;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The target whose modules import nothing.
const TARGET: &str = "wasm32-unknown-unknown";

/// Plugins that hold formats alone: a module takes the place of the whole library.
const FORMATS: [&str; 8] = ["e57", "gltf", "las", "pcd", "potree", "sfl", "stl", "text"];

/// The host calls the functions of the module's table, and adds its own to it.
const FLAGS: &str = "-Clink-arg=--export-table -Clink-arg=--growable-table";

/// What the program looks for beside itself.
pub(crate) const FOLDER: &str = "sandbox-formats";

/// Whether Rust's standard library is there for modules.
pub(crate) fn can_build() -> bool {
    let asked = ["--print", "target-libdir", "--target", TARGET];
    let folder = cargo::output(Command::new("rustc").args(asked));
    folder.is_ok_and(|folder| Path::new(folder.trim()).is_dir())
}

/// Builds all modules and puts them beside the program.
pub(crate) fn run() -> Result<(), String> {
    if !can_build() {
        return Err(format!(
            "Rust has no standard library for {TARGET} here; `rustup target add {TARGET}` installs it"
        ));
    }
    let release = cargo::release_folder()?;
    let mut build = cargo::bare();
    build.args(["build", "--release", "--locked", "--target", TARGET]);
    for format in FORMATS {
        build.args(["--package", &format!("surfelshop-{format}")]);
    }
    // Beside the program's own folder, so that neither build makes the other compile anything again.
    let target_folder = release.with_file_name("modules");
    build.arg("--target-dir").arg(&target_folder);
    build.env("CARGO_TARGET_WASM32_UNKNOWN_UNKNOWN_RUSTFLAGS", FLAGS);
    cargo::status(&mut build)?;
    let folder = release.join(FOLDER);
    let said = |path: &Path, error: &std::io::Error| format!("{}: {error}", path.display());
    fs::create_dir_all(&folder).map_err(|error| said(&folder, &error))?;
    for format in FORMATS {
        let name = format!("surfelshop_{format}.wasm");
        let built: PathBuf = target_folder.join(TARGET).join("release").join(&name);
        let copy = folder.join(&name);
        let bytes = fs::copy(&built, &copy).map_err(|error| said(&built, &error))?;
        println!("{} ({:.2} MB)", copy.display(), bytes as f64 * 1e-6);
    }
    Ok(())
}
