//! What the machine must have, and how to see whether it has it.
//!
//! Only Linux may lack something: macOS and Windows come with their graphics interface. Nothing is
//! loaded to find out, since loading a driver would need `unsafe` and could fail in its own ways;
//! the files that the loaders read are looked up instead.

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::install::find_program;

/// Something that must be installed, with the packages that bring it.
#[derive(Clone, Copy)]
pub(crate) struct Need {
    /// What is missing, for people.
    pub(crate) name: &'static str,
    /// What becomes of the tasks without it.
    pub(crate) without: &'static str,
    /// Whether the machine has it.
    pub(crate) present: fn() -> bool,
    /// Packages by package manager; see [`crate::install::MANAGERS`].
    pub(crate) packages: &'static [(&'static str, &'static [&'static str])],
}

/// A Vulkan loader and at least one driver; Mesa's software driver is enough.
pub(crate) const VULKAN: Need = Need {
    name: "a Vulkan driver",
    without: "pictures may still be made through OpenGL, more slowly",
    present: has_vulkan,
    packages: &[
        ("apt-get", &["mesa-vulkan-drivers", "libvulkan1", "libegl1"]),
        ("dnf", &["mesa-vulkan-drivers", "vulkan-loader"]),
        ("pacman", &["vulkan-swrast", "vulkan-icd-loader"]),
        ("zypper", &["libvulkan_lvp", "libvulkan1"]),
        ("apk", &["mesa-vulkan-swrast", "vulkan-loader"]),
    ],
};

/// OpenGL through EGL without a window: the path taken where there is no Vulkan, which has tests.
pub(crate) const OPENGL: Need = Need {
    name: "an OpenGL driver with EGL",
    without: "the tests of the path without Vulkan will fail",
    present: has_opengl,
    packages: &[
        ("apt-get", &["libegl1", "libegl-mesa0", "libgl1-mesa-dri"]),
        ("dnf", &["libglvnd-egl", "mesa-libEGL", "mesa-dri-drivers"]),
        ("pacman", &["libglvnd", "mesa"]),
        ("zypper", &["libglvnd", "Mesa-libEGL1", "Mesa-dri"]),
        ("apk", &["mesa-egl", "mesa-dri-gallium"]),
    ],
};

/// A screen without a monitor, and the means to use the mouse on it and to look at it.
pub(crate) const SCREEN: Need = Need {
    name: "a virtual screen (Xvfb, xdotool, xwd and the libraries of a window)",
    without: "the test of the window on a screen will fail",
    present: has_screen,
    packages: &[
        ("apt-get", SCREEN_ON_DEBIAN),
        (
            "dnf",
            &["xorg-x11-server-Xvfb", "xdotool", "xwd", "libXcursor", "libXi", "libxkbcommon-x11"],
        ),
        (
            "pacman",
            &["xorg-server-xvfb", "xdotool", "xorg-xwd", "libxcursor", "libxi", "libxkbcommon-x11"],
        ),
        (
            "zypper",
            &[
                "xorg-x11-server-Xvfb",
                "xdotool",
                "xwd",
                "libXcursor1",
                "libXi6",
                "libxkbcommon-x11-0",
            ],
        ),
        ("apk", &["xvfb", "xdotool", "xwd", "libxcursor", "libxi", "libxkbcommon-x11"]),
    ],
};

/// Python with `NumPy`, for the package in `host/python`.
pub(crate) const PYTHON: Need = Need {
    name: "Python 3 with NumPy",
    without: "the tests of the Python package will fail",
    present: has_numpy,
    packages: &[
        ("apt-get", &["python3", "python3-numpy"]),
        ("dnf", &["python3", "python3-numpy"]),
        ("pacman", &["python", "python-numpy"]),
        ("zypper", &["python3", "python3-numpy"]),
        ("apk", &["python3", "py3-numpy"]),
    ],
};

/// The interpreter that is found first may be another than the system's, which packages are for.
fn has_numpy() -> bool {
    ["python3", "/usr/bin/python3"].iter().any(|python| {
        let silent = |ended: std::process::Output| ended.status.success();
        Command::new(python).args(["-c", "import numpy"]).output().is_ok_and(silent)
    })
}

const SCREEN_ON_DEBIAN: &[&str] = &[
    "xvfb",
    "xdotool",
    "x11-apps",
    "libx11-xcb1",
    "libxcursor1",
    "libxi6",
    "libxrandr2",
    "libxkbcommon-x11-0",
];

fn has_screen() -> bool {
    let programs = ["Xvfb", "xdotool", "xwd"];
    let libraries = ["libX11.so.6", "libXcursor.so.1", "libXi.so.6", "libxkbcommon-x11.so.0"];
    programs.iter().all(|program| find_program(program).is_some())
        && libraries.iter().all(|library| has_library(library))
}

fn has_vulkan() -> bool {
    has_library("libvulkan.so.1") && has_vulkan_driver()
}

/// The loader reads the listed files if a variable lists some, and its folders otherwise.
fn has_vulkan_driver() -> bool {
    match listed_drivers() {
        Some((_, list)) => any_exists(&list),
        None => vulkan_folders().iter().any(|folder| holds(folder, is_json)),
    }
}

/// The variable that points the Vulkan loader at files that do not exist, if one does. No package
/// can help then, so nothing is installed.
pub(crate) fn misdirecting_variable() -> Option<&'static str> {
    listed_drivers().filter(|(_, list)| !any_exists(list)).map(|(name, _)| name)
}

fn listed_drivers() -> Option<(&'static str, OsString)> {
    let variables = ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"];
    variables.into_iter().find_map(|name| Some((name, std::env::var_os(name)?)))
}

fn any_exists(list: &OsStr) -> bool {
    std::env::split_paths(list).any(|path| path.exists())
}

fn vulkan_folders() -> Vec<PathBuf> {
    let roots = ["/usr/share", "/usr/local/share", "/etc", "/usr/local/etc"];
    let mut folders: Vec<_> = roots.iter().map(PathBuf::from).collect();
    // NixOS links the drivers of the running system here.
    folders.push("/run/opengl-driver/share".into());
    if let Some(home) = std::env::home_dir() {
        folders.push(home.join(".local/share"));
    }
    folders.into_iter().map(|root| root.join("vulkan/icd.d")).collect()
}

/// Three things make OpenGL: the EGL library, a vendor's entry behind it (where the library only
/// hands on), and a Mesa driver that can draw in software.
fn has_opengl() -> bool {
    let vendors = ["/usr/share/glvnd/egl_vendor.d", "/etc/glvnd/egl_vendor.d"];
    let hands_on = has_library("libGLdispatch.so.0");
    has_library("libEGL.so.1")
        && (!hands_on || vendors.iter().any(|folder| holds(Path::new(folder), is_json)))
        && library_folders().iter().any(|folder| {
            holds(folder, is_gallium)
                || holds(&folder.join("dri"), |name| ends_with(name, "_dri.so"))
        })
}

/// Whether the dynamic linker can find this library.
fn has_library(name: &str) -> bool {
    library_folders().iter().any(|folder| folder.join(name).exists()) || linker_knows(name)
}

/// Asks the linker's cache, which also knows folders named in its configuration.
fn linker_knows(name: &str) -> bool {
    // Debian keeps `ldconfig` out of the search path of ordinary users.
    ["ldconfig", "/sbin/ldconfig", "/usr/sbin/ldconfig"].iter().any(|ldconfig| {
        Command::new(ldconfig).arg("-p").output().is_ok_and(|output| {
            let listed = String::from_utf8_lossy(&output.stdout);
            listed.lines().any(|line| line.split_whitespace().next() == Some(name))
        })
    })
}

fn library_folders() -> Vec<PathBuf> {
    let triple = format!("{}-linux-gnu", std::env::consts::ARCH);
    let mut folders: Vec<PathBuf> = std::env::var_os("LD_LIBRARY_PATH")
        .map(|list| std::env::split_paths(&list).collect())
        .unwrap_or_default();
    for root in ["/lib", "/usr/lib", "/usr/local/lib"] {
        folders.push(root.into());
        folders.push(Path::new(root).join(&triple));
    }
    folders.push("/lib64".into());
    folders.push("/usr/lib64".into());
    folders.push("/run/opengl-driver/lib".into());
    folders
}

/// Whether a folder exists and holds a file with such a name.
fn holds(folder: &Path, wanted: impl Fn(&OsStr) -> bool) -> bool {
    let Ok(entries) = folder.read_dir() else { return false };
    entries.flatten().any(|entry| wanted(&entry.file_name()))
}

fn is_json(name: &OsStr) -> bool {
    ends_with(name, ".json")
}

/// Recent versions of Mesa hold all drivers in one library of this name.
fn is_gallium(name: &OsStr) -> bool {
    name.to_string_lossy().starts_with("libgallium") && name.to_string_lossy().contains(".so")
}

fn ends_with(name: &OsStr, end: &str) -> bool {
    name.to_string_lossy().ends_with(end)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_folder_holds_nothing() {
        assert!(!holds(Path::new("/nonexistent/icd.d"), |_| true));
    }

    #[test]
    fn missing_library_is_not_found() {
        assert!(!has_library("libsurfelshop-does-not-exist.so.7"));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn c_library_is_found() {
        // A test program is linked to the C library on glibc and to the loader on musl.
        let arch = std::env::consts::ARCH;
        assert!(has_library("libc.so.6") || has_library(&format!("ld-musl-{arch}.so.1")));
    }

    #[test]
    fn every_need_names_a_package_for_every_manager() {
        for need in [VULKAN, OPENGL, SCREEN, PYTHON] {
            for manager in crate::install::MANAGERS {
                let named = need.packages.iter().find(|(name, _)| *name == manager.program);
                assert!(
                    named.is_some_and(|(_, packages)| !packages.is_empty()),
                    "{} names no package for {}",
                    need.name,
                    manager.program
                );
            }
        }
    }
}
