//! The Surfelshop program: its command line.
//!
//! Every command lives in a file of its name. What it has to say goes through `terminal`: results
//! to the standard output, one readable line about a failure to the standard error. The exit code
//! is 0 where the work is done, 1 where it failed, 2 where the command line was not understood.

mod arguments;
mod bake;
mod bench;
mod camera;
mod captured;
mod chart;
mod check;
mod clouds;
mod command_line;
mod compare;
mod convert;
mod cpu_time;
mod csv;
mod demo;
mod explain;
mod exr_file;
mod files;
mod given;
mod info;
mod interrupt;
mod light_spec;
mod made;
mod page;
mod pictures;
mod plugins;
mod probe_info;
mod render;
mod report;
mod scene_info;
mod scenes;
mod settings;
mod staging;
mod studio;
mod surroundings;
mod sweep;
mod terminal;
mod times;
mod tool_run;
mod traced;
mod values;
mod viewer;

use arguments::{Cli, Command};
use clap::{CommandFactory as _, FromArgMatches as _};
use given::Given;
use std::process::ExitCode;

fn main() -> ExitCode {
    terminal::start_log();
    let parsed = Cli::command().try_get_matches().and_then(|matches| {
        let given = Given::of(&matches);
        Ok((Cli::from_arg_matches(&matches)?.checked()?, given))
    });
    let (cli, given) = match parsed {
        Ok(parsed) => parsed,
        Err(error) => return terminal::not_understood(&error),
    };
    // Plugins may change the folder that the program is in; names that were typed are of this one.
    surfelshop_cloud::files::keep_folder();
    let _ends = surfelshop_engine::plugins::guard_exit();
    if cli.command.is_some() {
        interrupt::watch();
    }
    let done = match cli.command {
        Some(Command::Render(arguments)) => render::run(&arguments, &given),
        Some(Command::Compare(arguments)) => compare::run(&arguments, &given),
        Some(Command::Report(arguments)) => sweep::run(&arguments, &given),
        Some(Command::Bench(arguments)) => bench::run(&arguments, &given),
        Some(Command::Check(arguments)) => check::run(&arguments),
        Some(Command::Explain(arguments)) => explain::run(&arguments, &given),
        Some(Command::Bake(arguments)) => bake::run(&arguments),
        Some(Command::Info(arguments)) => info::run(&arguments),
        Some(Command::Plugins(arguments)) => plugins::run(&arguments),
        Some(Command::Convert(arguments)) => convert::run(&arguments),
        Some(Command::Demo(arguments)) => demo::run(&arguments),
        None => viewer::run(&cli.viewer),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => terminal::failed(&error),
    }
}
