//! The tasks behind `cargo demo`, `cargo verify`, `cargo package-all` and `cargo sandbox-formats`.
//!
//! They are aliases in `.cargo/config.toml`, because a first visitor should need two commands and
//! no reading. This crate has no dependencies, so that it compiles in a second and can say what
//! the machine lacks before the long build starts.

#![expect(clippy::print_stdout, clippy::print_stderr, reason = "printing is this program's work")]

mod cargo;
mod install;
mod machine;
mod modules;
mod package;
mod programs;
mod steps;
mod verify;

use std::process::ExitCode;

const USAGE: &str = "\
Usage: cargo demo [ARGUMENTS]     build the host and every plugin, then run `surfelshop demo`
       cargo verify [--long]      check formatting, lints and documentation, and run all tests
       cargo package-all          build packages of everything: a .tar.gz that runs in any folder, a .deb
       cargo sandbox-formats      build the formats as WebAssembly modules, for `--sandbox-formats`

The first two make sure that the machine has a graphics driver (a software driver will do), and ask
before they install one. With CI=true in the environment they install without asking.

Options of demo:
  everything after `demo` is handed to `surfelshop demo`; see `cargo demo --help`
Options of verify:
  --long       also run the long measurements (sets SURFELSHOP_LONG=1 for the tests)
  -h, --help   print this";

/// What the command line asked for.
#[derive(Debug, PartialEq)]
enum Task {
    Help,
    Demo(Vec<String>),
    Verify { long: bool },
    Package,
    Modules,
}

/// Reads the command line; the error says what was not understood.
fn parse(arguments: &[String]) -> Result<Task, String> {
    let Some((task, rest)) = arguments.split_first() else {
        return Err("no task given".into());
    };
    match task.as_str() {
        "-h" | "--help" | "help" => Ok(Task::Help),
        "demo" => Ok(Task::Demo(rest.to_vec())),
        "verify" => parse_verify(rest),
        "package-all" => alone(rest, task, Task::Package),
        "sandbox-formats" => alone(rest, task, Task::Modules),
        unknown => Err(format!(
            "unknown task `{unknown}`: expected `demo`, `verify`, `package-all` or `sandbox-formats`"
        )),
    }
}

/// A task that takes no options.
fn alone(options: &[String], name: &str, task: Task) -> Result<Task, String> {
    match options {
        [] => Ok(task),
        [first, ..] if first == "-h" || first == "--help" => Ok(Task::Help),
        [first, ..] => Err(format!("unknown option `{first}` of `{name}`")),
    }
}

fn parse_verify(options: &[String]) -> Result<Task, String> {
    let mut long = false;
    for option in options {
        match option.as_str() {
            "--long" => long = true,
            "-h" | "--help" => return Ok(Task::Help),
            unknown => return Err(format!("unknown option `{unknown}` of `verify`")),
        }
    }
    Ok(Task::Verify { long })
}

/// Builds everything and shows the sample; the program's own exit code is passed on.
fn demo(arguments: &[String]) -> ExitCode {
    install::ensure(&[machine::VULKAN]);
    match cargo::status(&mut cargo::build()) {
        Ok(()) => {}
        Err(reason) => {
            eprintln!("error: the build failed: {reason}");
            return ExitCode::FAILURE;
        }
    }
    match cargo::run_host(arguments) {
        Ok(code) => code,
        Err(reason) => {
            eprintln!("error: {reason}");
            ExitCode::FAILURE
        }
    }
}

/// The exit code of a task that succeeds or says why not.
fn ended(result: Result<(), String>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(reason) => {
            eprintln!("error: {reason}");
            ExitCode::FAILURE
        }
    }
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match parse(&arguments) {
        Ok(Task::Help) => {
            println!("{USAGE}");
            ExitCode::SUCCESS
        }
        Ok(Task::Demo(rest)) => demo(&rest),
        Ok(Task::Verify { long }) => {
            install::ensure(&[machine::VULKAN, machine::OPENGL, machine::SCREEN, machine::PYTHON]);
            verify::run(long)
        }
        Ok(Task::Package) => ended(package::run()),
        Ok(Task::Modules) => ended(modules::run()),
        Err(reason) => {
            eprintln!("error: {reason}\n\n{USAGE}");
            ExitCode::from(2)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(line: &str) -> Result<Task, String> {
        parse(&line.split_whitespace().map(String::from).collect::<Vec<_>>())
    }

    #[test]
    fn demo_hands_on_every_argument() {
        let handed_on = vec!["--size".to_string(), "64x64".to_string()];
        assert_eq!(parsed("demo --size 64x64"), Ok(Task::Demo(handed_on)));
    }

    #[test]
    fn verify_knows_long_and_help_only_and_package_all_nothing() {
        assert_eq!(parsed("verify"), Ok(Task::Verify { long: false }));
        assert_eq!(parsed("verify --long"), Ok(Task::Verify { long: true }));
        assert_eq!(parsed("verify --help"), Ok(Task::Help));
        assert_eq!(parsed("package-all"), Ok(Task::Package));
        assert_eq!(parsed("sandbox-formats"), Ok(Task::Modules));
        assert!(parsed("package-all --fast").is_err_and(|reason| reason.contains("--fast")));
        assert!(parsed("verify --fast").is_err_and(|reason| reason.contains("--fast")));
    }

    #[test]
    fn unknown_or_missing_task_is_an_error() {
        assert!(parsed("").is_err());
        assert!(parsed("deploy").is_err_and(|reason| reason.contains("deploy")));
    }
}
