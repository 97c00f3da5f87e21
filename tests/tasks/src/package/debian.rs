//! The package for Debian: the same files where Debian has them.
//!
//! Source: Debian Policy Manual 4.7, chapters 3, 5 and 9.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::{copy, copy_folder, said};
use crate::cargo;

/// Where the program and what it looks for beside itself lie.
const LIBRARY: &str = "usr/lib/surfelshop";

const MAINTAINER: &str = "The Surfelshop developers <surfelshop@example.org>";

/// Debian's name of this machine's processor.
fn architecture() -> &'static str {
    match std::env::consts::ARCH {
        "x86_64" => "amd64",
        "aarch64" => "arm64",
        other => other,
    }
}

/// Builds the package from the staged folder of the archive.
pub(super) fn build(folder: &Path, out: &Path) -> Result<PathBuf, String> {
    let version = env!("CARGO_PKG_VERSION");
    let name = format!("surfelshop_{version}_{}", architecture());
    let root = out.join(&name);
    if root.exists() {
        fs::remove_dir_all(&root).map_err(|error| said(&root, &error))?;
    }
    for entry in fs::read_dir(folder).map_err(|error| said(folder, &error))?.filter_map(Result::ok)
    {
        let target = match entry.file_name().to_string_lossy().as_ref() {
            "share" => root.join("usr/share"),
            "LICENSE" | "THIRD-PARTY-LICENSES.txt" => continue,
            name => root.join(LIBRARY).join(name),
        };
        let from = entry.path();
        if from.is_dir() { copy_folder(&from, &target)? } else { copy(&from, &target)? }
    }
    // Packages remove what they brought; the list of `surfelshop setup` has no use.
    let list = root.join("usr/share/surfelshop");
    fs::remove_dir_all(&list).map_err(|error| said(&list, &error))?;
    compress_pages(&root.join("usr/share/man/man1"))?;
    copyright(folder, &root.join("usr/share/doc/surfelshop/copyright"))?;
    changelog(version, &root)?;
    link(Path::new("../lib/surfelshop/surfelshop"), &root.join("usr/bin/surfelshop"))?;
    let control = root.join("DEBIAN/control");
    fs::create_dir_all(root.join("DEBIAN")).map_err(|error| said(&control, &error))?;
    fs::write(&control, control_text(version, kilobytes(&root)))
        .map_err(|error| said(&control, &error))?;
    let package = out.join(format!("{name}.deb"));
    let mut command = Command::new("dpkg-deb");
    cargo::output(command.args(["--root-owner-group", "--build"]).arg(&root).arg(&package))?;
    fs::remove_dir_all(&root).map_err(|error| said(&root, &error))?;
    Ok(package)
}

/// What is linked when the program starts comes first; the window's libraries and drivers are opened while it runs.
fn control_text(version: &str, kilobytes: u64) -> String {
    format!(
        "Package: surfelshop\n\
         Version: {version}\n\
         Architecture: {}\n\
         Maintainer: {MAINTAINER}\n\
         Installed-Size: {kilobytes}\n\
         Section: graphics\n\
         Priority: optional\n\
         Depends: libc6 (>= 2.34), libgcc-s1\n\
         Recommends: libvulkan1, mesa-vulkan-drivers | vulkan-driver, libegl1, libxkbcommon0, libxkbcommon-x11-0, \
         libx11-6, libxcursor1, libxi6, libwayland-client0\n\
         Suggests: cargo, gcc\n\
         Description: renders point clouds as surfaces, with renderers that are plugins\n\
         \x20Surfelshop draws scans and other point clouds as surfaces of oriented discs,\n\
         \x20Gaussian splats and clouds larger than memory, in a window and on the\n\
         \x20command line. Renderers, tools and file formats are plugins that are switched\n\
         \x20at run time, compared side by side and written by anybody: the crates that\n\
         \x20they link and a header for C come with it.\n",
        architecture()
    )
}

fn compress_pages(folder: &Path) -> Result<(), String> {
    let entries = fs::read_dir(folder).map_err(|error| said(folder, &error))?;
    let pages: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    cargo::status(Command::new("gzip").args(["-9", "--no-name", "--force"]).args(pages))
}

fn copyright(folder: &Path, to: &Path) -> Result<(), String> {
    let mut text = String::new();
    for name in ["LICENSE", "THIRD-PARTY-LICENSES.txt"] {
        let file = folder.join(name);
        text += &fs::read_to_string(&file).map_err(|error| said(&file, &error))?;
        text.push('\n');
    }
    for (first, last, file) in COMMON_LICENCES {
        text = by_reference(&text, first, last, file);
    }
    fs::create_dir_all(to.parent().unwrap_or(to)).map_err(|error| said(to, &error))?;
    fs::write(to, text).map_err(|error| said(to, &error))
}

/// Licences that Debian has: the lines that their terms begin and end with, and the file that holds them.
const COMMON_LICENCES: [(&str, &str, &str); 2] = [
    ("Apache License", "END OF TERMS AND CONDITIONS", "Apache-2.0"),
    ("GNU GENERAL PUBLIC LICENSE", "Public License instead of this License.", "GPL-2"),
];

/// Puts the name of Debian's file into the place of the terms of a licence; terms without an end stay.
fn by_reference(text: &str, first: &str, last: &str, file: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut terms: Option<String> = None;
    for line in text.split_inclusive('\n') {
        let own = line.trim();
        let Some(found) = &mut terms else {
            match own == first {
                true => terms = Some(line.to_owned()),
                false => out.push_str(line),
            }
            continue;
        };
        found.push_str(line);
        if own.ends_with(last) {
            out += &format!("{first}: on Debian its text is /usr/share/common-licenses/{file}.\n");
            terms = None;
        } else if own.len() == super::licences::RULE && own.bytes().all(|byte| byte == b'-') {
            // The next crate's: these terms end otherwise.
            out.extend(terms.take());
        }
    }
    out.extend(terms);
    out
}

/// Policy asks for one: what changed is told by the checkout's history.
fn changelog(version: &str, root: &Path) -> Result<(), String> {
    let folder = root.join("usr/share/doc/surfelshop");
    let file = folder.join("changelog");
    let mut date = Command::new("git");
    let date = cargo::output(date.args(["log", "-1", "--format=%aD"]))
        .unwrap_or_else(|_| "Thu, 01 Jan 1970 00:00:00 +0000".to_owned());
    let text = format!(
        "surfelshop ({version}) unstable; urgency=medium\n\n  * Version {version}.\n\n -- {MAINTAINER}  {}\n",
        date.trim()
    );
    fs::create_dir_all(&folder).map_err(|error| said(&folder, &error))?;
    fs::write(&file, text).map_err(|error| said(&file, &error))?;
    cargo::status(Command::new("gzip").args(["-9", "--no-name", "--force"]).arg(&file))
}

#[cfg(unix)]
fn link(target: &Path, at: &Path) -> Result<(), String> {
    fs::create_dir_all(at.parent().unwrap_or(at)).map_err(|error| said(at, &error))?;
    std::os::unix::fs::symlink(target, at).map_err(|error| said(at, &error))
}

#[cfg(not(unix))]
fn link(_: &Path, at: &Path) -> Result<(), String> {
    Err(format!("{}: links are made on Unix alone", at.display()))
}

/// Kilobytes of all files below a folder, each rounded up.
fn kilobytes(folder: &Path) -> u64 {
    let Ok(entries) = fs::read_dir(folder) else { return 0 };
    let size = |entry: fs::DirEntry| match entry.metadata() {
        Ok(found) if found.is_dir() => kilobytes(&entry.path()),
        Ok(found) => found.len().div_ceil(1024),
        Err(_) => 0,
    };
    entries.filter_map(Result::ok).map(size).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_control_file_is_one_paragraph_of_fields() {
        let text = control_text("1.2.3", 4);
        for line in text.lines() {
            assert!(line.starts_with(' ') || line.contains(": "), "{line}");
        }
        for field in ["Package", "Version", "Architecture", "Maintainer", "Description"] {
            assert_eq!(
                text.lines().filter(|line| line.starts_with(&format!("{field}: "))).count(),
                1
            );
        }
        assert!(text.ends_with('\n'));
    }

    #[test]
    fn terms_that_debian_has_are_named() {
        let rule = "-".repeat(super::super::licences::RULE);
        let text = format!(
            "MIT\nterms\n   Apache License\nVersion 2.0\nEND OF TERMS AND CONDITIONS\n\nCopyright A\n{rule}\n\
             Apache License\nof another kind\n{rule}\nnext\n"
        );
        let [(first, last, file), _] = COMMON_LICENCES;
        assert_eq!(
            by_reference(&text, first, last, file),
            format!(
                "MIT\nterms\nApache License: on Debian its text is /usr/share/common-licenses/Apache-2.0.\n\n\
                 Copyright A\n{rule}\nApache License\nof another kind\n{rule}\nnext\n"
            )
        );
    }
}
