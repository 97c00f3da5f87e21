//! `cargo verify`: everything that must hold, in one command.

use std::process::{Command, ExitCode, Stdio};

use crate::cargo;
use crate::install::in_ci;
use crate::programs;
use crate::steps::{Outcome, Steps};

const BUILD: &str = "build";

/// Runs all steps and sums up; exit code 1 when one failed.
///
/// Every step uses the release profile. Clippy and rustdoc need only the metadata of the
/// dependencies, which Cargo keeps apart from their code; in the same profile the two share it
/// with each other, and build scripts and procedural macros with the build.
pub(crate) fn run(long: bool) -> ExitCode {
    let mut steps = Steps::new();
    steps.run("fmt", || component("rustfmt", "fmt", &mut fmt()));
    steps.run(BUILD, || outcome(&mut cargo::build()));
    let built = steps.passed(BUILD);
    steps.run("clippy", || after(built, || component("clippy", "clippy", &mut clippy())));
    steps.run("doc", || after(built, || outcome(&mut doc())));
    steps.run("test", || after(built, || programs::run(long)));
    if long {
        steps.run("no sandbox", || after(built, || outcome(&mut without_sandbox())));
    }
    steps.run("examples", || after(built, || outcome(cargo::step("test").arg("--doc"))));
    if steps.sum_up() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn fmt() -> Command {
    let mut command = cargo::bare();
    command.args(["fmt", "--all", "--", "--check"]);
    command
}

fn clippy() -> Command {
    let mut command = cargo::step("clippy");
    command.args(["--all-targets", "--", "-D", "warnings"]);
    command
}

fn doc() -> Command {
    let mut command = cargo::step("doc");
    command.arg("--no-deps").env("RUSTDOCFLAGS", "-D warnings");
    command
}

/// What is built without the feature `sandbox` compiles, and refuses modules in a line. Another selection of features, so
/// that its dependencies are compiled again.
fn without_sandbox() -> Command {
    let mut command = cargo::bare();
    command.args(["test", "--release", "--locked", "--package", "surfelshop-runtime"]);
    command.args(["--no-default-features", "--lib", "without_a_sandbox"]);
    command
}

fn outcome(command: &mut Command) -> Outcome {
    cargo::status(command).map_or_else(Outcome::Failed, |()| Outcome::Passed)
}

/// A step that makes no sense without a build: the same errors would only be printed again.
fn after(built: bool, step: impl FnOnce() -> Outcome) -> Outcome {
    if built { step() } else { Outcome::Failed("not run, since the build failed".into()) }
}

/// A step that needs a toolchain component, which is added where rustup can add it.
fn component(component: &str, subcommand: &str, command: &mut Command) -> Outcome {
    if works(subcommand) || (add(component) && works(subcommand)) {
        return outcome(command);
    }
    let reason =
        format!("the toolchain has no {component}; try `rustup component add {component}`");
    if in_ci() { Outcome::Failed(reason) } else { Outcome::NotChecked(reason) }
}

/// Whether Cargo can run this subcommand.
fn works(subcommand: &str) -> bool {
    let silent = cargo::bare()
        .args([subcommand, "--version"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    silent.is_ok_and(|status| status.success())
}

/// Adds a component with rustup, where there is one.
fn add(component: &str) -> bool {
    println!("running: rustup component add {component}");
    cargo::status(Command::new("rustup").args(["component", "add", component])).is_ok()
}
