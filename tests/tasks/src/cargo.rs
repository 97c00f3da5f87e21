//! Cargo as the tasks call it: one selection of packages, features and profile everywhere, so that
//! no dependency is compiled twice.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::{Command, ExitCode, Stdio};

/// The selection that every compiling step shares. Were one step to leave out a package, Cargo
/// could choose other features for a shared dependency and compile it again.
const SELECTION: [&str; 3] = ["--release", "--workspace", "--locked"];

/// Cargo with the selection; `step` is the subcommand such as `build`.
pub(crate) fn step(subcommand: &str) -> Command {
    let mut command = bare();
    command.arg(subcommand).args(SELECTION);
    command
}

/// The build of the host, every plugin and the tests' libraries. `cargo test` alone would build no
/// plugin, since nothing links a `cdylib`.
pub(crate) fn build() -> Command {
    step("build")
}

/// The Cargo that runs these tasks.
pub(crate) fn program() -> OsString {
    std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into())
}

/// Runs to the end and gives what was written to the standard output.
pub(crate) fn output(command: &mut Command) -> Result<String, String> {
    let failed = |error: &dyn std::fmt::Display| error.to_string();
    let output = command.stderr(Stdio::inherit()).output().map_err(|error| failed(&error))?;
    match output.status.success() {
        true => Ok(String::from_utf8_lossy(&output.stdout).into_owned()),
        false => Err(failed(&output.status)),
    }
}

/// Cargo without a subcommand, freed of the variables that the outer `cargo run` set: build
/// scripts may watch them and would run again.
pub(crate) fn bare() -> Command {
    let mut command = Command::new(program());
    let set_by_cargo_run = ["CARGO_PKG_", "CARGO_MANIFEST_", "CARGO_CRATE_", "CARGO_BIN_"];
    for (name, _) in std::env::vars_os() {
        if set_by_cargo_run.iter().any(|prefix| name.to_string_lossy().starts_with(prefix)) {
            command.env_remove(name);
        }
    }
    command
}

/// Runs to the end with the terminal's own input and output.
pub(crate) fn status(command: &mut Command) -> Result<(), String> {
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(status.to_string()),
        Err(error) => Err(format!("`{}`: {error}", command.get_program().to_string_lossy())),
    }
}

/// Runs `surfelshop demo` as built by [`build`].
pub(crate) fn run_host(arguments: &[String]) -> Result<ExitCode, String> {
    let program = release_folder()?.join(format!("surfelshop{}", std::env::consts::EXE_SUFFIX));
    let status = Command::new(&program)
        .arg("demo")
        .args(arguments)
        .status()
        .map_err(|error| format!("`{}` cannot be run: {error}", program.display()))?;
    // A program ended by a signal has no code; that is a failure too.
    let code = status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(1);
    Ok(ExitCode::from(code))
}

/// The folder of release programs. It is found from this program's own place, which is right
/// whatever variable or configuration file moved Cargo's target folder.
pub(crate) fn release_folder() -> Result<PathBuf, String> {
    let own = std::env::current_exe().map_err(|error| format!("own place unknown: {error}"))?;
    let profile_folder = own.parent().ok_or("own place has no folder")?;
    Ok(profile_folder.with_file_name("release"))
}
