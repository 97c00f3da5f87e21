//! `cargo package-all`: the program with everything that it needs, as an archive that runs in any folder, and as a
//! package for Debian.

mod debian;
mod licences;
mod sdk;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::{cargo, modules};

/// Built-in plugins are the crates of this folder.
const PLUGINS: &str = "plugins";

/// What the program looks for beside itself.
const ASSETS: [&str; 4] = ["sample.ply", "cornell-box.ply", "cornell-box.scene.toml", "sky.hdr"];

/// Builds everything, and puts both packages into `target/package`.
pub(crate) fn run() -> Result<(), String> {
    if !cfg!(target_os = "linux") {
        return Err(
            "packages are made on Linux; elsewhere run the program from its target folder".into()
        );
    }
    cargo::status(&mut cargo::build())?;
    let root = std::env::current_dir().map_err(|error| format!("the current folder: {error}"))?;
    if !root.join("host/sdk").is_dir() {
        return Err("run this in the root folder of a checkout of Surfelshop".into());
    }
    let release = cargo::release_folder()?;
    let name = format!("surfelshop-{}-{}-linux", env!("CARGO_PKG_VERSION"), std::env::consts::ARCH);
    let out = release.with_file_name("package");
    let folder = out.join(&name);
    if folder.exists() {
        fs::remove_dir_all(&folder).map_err(|error| said(&folder, &error))?;
    }
    stage(&root, &release, &folder)?;
    let archive = out.join(format!("{name}.tar.gz"));
    // Owners and order that do not depend on who builds.
    let tar = ["--owner=0", "--group=0", "--numeric-owner", "--sort=name", "-czf"];
    let mut command = Command::new("tar");
    cargo::status(command.args(tar).arg(&archive).arg("-C").arg(&out).arg(&name))?;
    println!("{} ({})", archive.display(), megabytes(&archive));
    match debian::build(&folder, &out) {
        Ok(package) => println!("{} ({})", package.display(), megabytes(&package)),
        Err(reason) => println!("no package for Debian: {reason}"),
    }
    Ok(())
}

/// Puts the program with all that belongs to it into a folder.
fn stage(root: &Path, release: &Path, folder: &Path) -> Result<(), String> {
    copy_program(&release.join("surfelshop"), &folder.join("surfelshop"))?;
    let mut packages = plugins(root)?;
    for package in &packages {
        let library = format!("lib{}.so", package.replace('-', "_"));
        copy_program(&release.join(&library), &folder.join("plugins").join(&library))?;
    }
    match modules::can_build() {
        true => {
            modules::run()?;
            copy_folder(&release.join(modules::FOLDER), &folder.join(modules::FOLDER))?;
        }
        false => println!("no modules of formats: Rust has no standard library for them here"),
    }
    for asset in ASSETS {
        copy(&root.join("assets").join(asset), &folder.join("assets").join(asset))?;
    }
    copy_folder(&root.join("host/manual"), &folder.join("host/manual"))?;
    copy(&root.join("LICENSE"), &folder.join("LICENSE"))?;
    copy(&root.join("README.md"), &folder.join("README.md"))?;
    sdk::stage(root, folder)?;
    packages.push("surfelshop".to_owned());
    licences::write(&folder.join("THIRD-PARTY-LICENSES.txt"), &packages)?;
    // What a desktop and a shell need is the program's own to say.
    let mut setup = Command::new(folder.join("surfelshop"));
    cargo::output(setup.args(["setup", "--program", "surfelshop", "--prefix"]).arg(folder))?;
    Ok(())
}

/// The packages of the built-in plugins.
fn plugins(root: &Path) -> Result<Vec<String>, String> {
    let folder = root.join(PLUGINS);
    let entries = fs::read_dir(&folder).map_err(|error| said(&folder, &error))?;
    let mut names: Vec<String> = entries
        .filter_map(Result::ok)
        .filter(|entry| entry.path().join("Cargo.toml").is_file())
        .map(|entry| format!("surfelshop-{}", entry.file_name().to_string_lossy()))
        .collect();
    names.sort();
    Ok(names)
}

/// Copies a program or library without the names of its functions, where `strip` is there.
fn copy_program(from: &Path, to: &Path) -> Result<(), String> {
    copy(from, to)?;
    let strip = Command::new("strip").arg("--strip-unneeded").arg(to).status();
    match strip {
        Ok(status) if !status.success() => Err(format!("strip {}: {status}", to.display())),
        _ => Ok(()),
    }
}

/// Copies a file, and makes its folder.
fn copy(from: &Path, to: &Path) -> Result<(), String> {
    if let Some(folder) = to.parent() {
        fs::create_dir_all(folder).map_err(|error| said(folder, &error))?;
    }
    fs::copy(from, to).map(drop).map_err(|error| said(from, &error))
}

/// Copies a folder with all that is in it.
fn copy_folder(from: &Path, to: &Path) -> Result<(), String> {
    let mut entries: Vec<PathBuf> = fs::read_dir(from)
        .map_err(|error| said(from, &error))?
        .filter_map(|entry| Some(entry.ok()?.path()))
        .collect();
    entries.sort();
    for entry in entries {
        let Some(name) = entry.file_name() else { continue };
        let target = to.join(name);
        if entry.is_dir() { copy_folder(&entry, &target)? } else { copy(&entry, &target)? }
    }
    Ok(())
}

fn said(path: &Path, error: &std::io::Error) -> String {
    format!("{}: {error}", path.display())
}

fn megabytes(path: &Path) -> String {
    let bytes = fs::metadata(path).map_or(0, |metadata| metadata.len());
    format!("{:.1} MB", bytes as f64 * 1e-6)
}
