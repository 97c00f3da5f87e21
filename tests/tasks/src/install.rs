//! Installs what the machine lacks, saying what would be run and asking first.
//!
//! Nothing here ends the task: a refusal or a failure prints what to install by hand and goes on,
//! since another way to draw may exist and the host's own message is better than a guess.

use std::io::{BufRead, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use crate::machine::{Need, VULKAN, misdirecting_variable};

/// A package manager and how it installs without further questions.
pub(crate) struct Manager {
    /// The program's name.
    pub(crate) program: &'static str,
    install: &'static [&'static str],
    /// Fetches the lists of packages, where installing does not do so itself.
    refresh: Option<&'static [&'static str]>,
}

/// The package managers known here, most widespread first.
pub(crate) const MANAGERS: &[Manager] = &[
    Manager {
        program: "apt-get",
        install: &["install", "--yes", "--no-install-recommends"],
        refresh: Some(&["update"]),
    },
    Manager { program: "dnf", install: &["install", "--assumeyes"], refresh: None },
    // Pacman mixes versions when lists are refreshed without an upgrade, so they are left alone.
    Manager { program: "pacman", install: &["-S", "--needed", "--noconfirm"], refresh: None },
    Manager { program: "zypper", install: &["--non-interactive", "install"], refresh: None },
    Manager { program: "apk", install: &["add", "--update-cache"], refresh: None },
];

/// Whether an automatic run asked not to be asked.
pub(crate) fn in_ci() -> bool {
    std::env::var("CI").is_ok_and(|value| value == "true")
}

/// Makes sure that the machine has all of these, or says what to do by hand.
pub(crate) fn ensure(needs: &[Need]) {
    if !cfg!(target_os = "linux") {
        return;
    }
    let mut missing: Vec<_> = needs.iter().filter(|need| !(need.present)()).collect();
    if let Some(variable) = misdirecting_variable() {
        println!("{variable} names no file that exists, so no Vulkan driver will be found.");
        missing.retain(|need| need.name != VULKAN.name);
    }
    if missing.is_empty() {
        return;
    }
    for need in &missing {
        println!("This machine lacks {}.", need.name);
    }
    let Some(manager) = MANAGERS.iter().find(|manager| find_program(manager.program).is_some())
    else {
        println!("No package manager known here was found.");
        return by_hand(&missing, None);
    };
    let packages = packages(&missing, manager.program);
    if !agreed(manager, &packages) || !install(manager, &packages) {
        return by_hand(&missing, Some(manager));
    }
    let still: Vec<_> = missing.into_iter().filter(|need| !(need.present)()).collect();
    if !still.is_empty() {
        println!("The packages were installed, but something is still not found.");
        by_hand(&still, Some(manager));
    }
}

/// The packages that bring all the needs, each named once.
fn packages(needs: &[&Need], manager: &str) -> Vec<&'static str> {
    let mut all = Vec::new();
    for need in needs {
        let of_manager = need.packages.iter().filter(|(name, _)| *name == manager);
        for package in of_manager.flat_map(|(_, packages)| packages.iter()) {
            if !all.contains(package) {
                all.push(*package);
            }
        }
    }
    all
}

/// Shows the exact commands and asks, unless an automatic run already agreed.
fn agreed(manager: &Manager, packages: &[&str]) -> bool {
    println!("To install it, this would be run:");
    for line in commands(manager, packages) {
        println!("    {}", line.join(" "));
    }
    if in_ci() {
        return true;
    }
    if !std::io::stdin().is_terminal() {
        println!("There is no terminal to ask on, so nothing is installed (CI=true agrees).");
        return false;
    }
    print!("Run it now? [y/N] ");
    let mut answer = String::new();
    let asked =
        std::io::stdout().flush().and_then(|()| std::io::stdin().lock().read_line(&mut answer));
    asked.is_ok() && matches!(answer.trim(), "y" | "Y" | "yes" | "Yes")
}

/// The command lines of an installation, in order.
fn commands(manager: &Manager, packages: &[&str]) -> Vec<Vec<String>> {
    let mut lines = Vec::new();
    if let Some(refresh) = manager.refresh
        && lists_are_missing(Path::new("/var/lib/apt/lists"))
    {
        lines.push(command_line(manager, refresh, &[]));
    }
    lines.push(command_line(manager, manager.install, packages));
    lines
}

fn command_line(manager: &Manager, arguments: &[&str], packages: &[&str]) -> Vec<String> {
    let mut line: Vec<&str> = Vec::new();
    if needs_sudo() {
        line.push("sudo");
    }
    if manager.program == "apt-get" {
        // `sudo` drops the environment, so the wish not to be asked travels through `env`.
        line.extend(["env", "DEBIAN_FRONTEND=noninteractive"]);
    }
    line.push(manager.program);
    line.extend(arguments);
    line.extend(packages);
    line.into_iter().map(String::from).collect()
}

/// Runs the installation; lists that have gone stale are refreshed once after a failure.
fn install(manager: &Manager, packages: &[&str]) -> bool {
    if commands(manager, packages).iter().all(|line| runs(line)) {
        return true;
    }
    let Some(refresh) = manager.refresh else { return false };
    println!("Trying once more with fresh lists of packages.");
    runs(&command_line(manager, refresh, &[]))
        && runs(&command_line(manager, manager.install, packages))
}

fn runs(line: &[String]) -> bool {
    let Some((program, arguments)) = line.split_first() else { return false };
    println!("running: {}", line.join(" "));
    let mut command = Command::new(program);
    command.args(arguments);
    if in_ci() {
        // A question nobody can answer must fail instead of waiting.
        command.stdin(Stdio::null());
    }
    command.status().is_ok_and(|status| status.success())
}

/// Says what to install by hand and what happens without it.
fn by_hand(needs: &[&Need], manager: Option<&Manager>) {
    for need in needs {
        match manager {
            Some(manager) => {
                let packages = packages(&[need], manager.program).join(" ");
                println!("To get {} by hand, install: {packages}", need.name);
            }
            None => {
                println!("To get {} by hand, install one of:", need.name);
                for (manager, packages) in need.packages {
                    println!("    {manager}: {}", packages.join(" "));
                }
            }
        }
        println!("Going on without it: {}.", need.without);
    }
}

/// Whether the lists of packages were never fetched, as in a fresh container.
fn lists_are_missing(folder: &Path) -> bool {
    let Ok(entries) = folder.read_dir() else { return true };
    !entries.flatten().any(|entry| entry.file_name().to_string_lossy().contains("_Packages"))
}

/// Whether commands must be handed to `sudo`: it exists, and this is not root already.
fn needs_sudo() -> bool {
    find_program("sudo").is_some() && !is_root()
}

/// Asks the `id` program, since the standard library does not tell.
fn is_root() -> bool {
    let id = Command::new("id").arg("-u").output();
    id.is_ok_and(|output| output.stdout.trim_ascii() == b"0")
}

pub(crate) fn find_program(name: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path).map(|folder| folder.join(name)).find(|file| file.is_file())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::OPENGL;

    #[test]
    fn package_of_two_needs_is_installed_once() {
        let all = packages(&[&VULKAN, &OPENGL], "apt-get");
        assert_eq!(all.iter().filter(|package| **package == "libegl1").count(), 1);
        assert!(all.contains(&"mesa-vulkan-drivers") && all.contains(&"libgl1-mesa-dri"));
    }

    #[test]
    fn folder_without_lists_is_seen() {
        let folder = std::env::temp_dir().join(format!("surfelshop-lists-{}", std::process::id()));
        assert!(lists_are_missing(&folder), "no folder, no lists");
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("lock"), "").unwrap();
        assert!(lists_are_missing(&folder), "a lock file is no list");
        std::fs::write(folder.join("deb.example_main_binary-amd64_Packages.lz4"), "").unwrap();
        assert!(!lists_are_missing(&folder));
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn command_line_ends_with_the_packages() {
        let line = command_line(&MANAGERS[0], MANAGERS[0].install, &["libvulkan1"]);
        assert!(line.contains(&"apt-get".to_string()));
        assert_eq!(line.last().map(String::as_str), Some("libvulkan1"));
    }
}
