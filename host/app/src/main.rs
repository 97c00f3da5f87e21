//! The Surfelshop program: its command line.
//!
//! Every command lives in a file of its name. What it has to say goes through `terminal`: results
//! to the standard output, one readable line about a failure to the standard error. The exit code
//! is 0 where the work is done, 1 where it failed, 2 where the command line was not understood.

mod arguments;
mod camera;
mod clouds;
mod convert;
mod demo;
mod exr_file;
mod files;
mod info;
mod pictures;
mod plugins;
mod render;
mod report;
mod settings;
mod studio;
mod terminal;
mod values;

use arguments::{Cli, Command};
use clap::{CommandFactory as _, Parser as _};
use std::process::ExitCode;

fn main() -> ExitCode {
    terminal::start_log();
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return terminal::not_understood(&error),
    };
    let done = match cli.command {
        Some(Command::Render(arguments)) => render::run(&arguments),
        Some(Command::Info(arguments)) => info::run(&arguments),
        Some(Command::Plugins(arguments)) => plugins::run(&arguments),
        Some(Command::Convert(arguments)) => convert::run(&arguments),
        Some(Command::Demo(arguments)) => demo::run(&arguments),
        None => terminal::line(Cli::command().render_long_help()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => terminal::failed(&error),
    }
}
