//! The Surfelshop program: its command line.
//!
//! Every command lives in a file of its name. What it has to say goes through `terminal`: results
//! to the standard output, one readable line about a failure to the standard error. The exit code
//! is 0 where the work is done, 1 where it failed, 2 where the command line was not understood.

mod arguments;
mod bake;
mod bake_pyramid;
mod bake_strokes;
mod contents_info;
mod convert;
mod farm;
mod index;
mod info;
mod measure;
mod plugins;
mod pyramid_info;
mod scene_info;
mod select;
mod select_pyramid;
mod setup;
mod tool_object;

use anyhow::Context as _;
use arguments::{Cli, Command};
use clap::{CommandFactory as _, FromArgMatches as _};
use std::process::ExitCode;
use surfelshop_evaluate::{bench, check, compare, demo, explain, merge, report, share};
#[cfg(unix)]
use surfelshop_runtime::isolate;
use surfelshop_session::input::{budget, pyramids};
use surfelshop_session::options::explicit::ExplicitOptions;
use surfelshop_session::output::terminal;
use surfelshop_session::{interrupt, manual, render};
use surfelshop_viewer::ViewerArguments;

fn main() -> ExitCode {
    #[cfg(unix)]
    if std::env::args_os().nth(1).is_some_and(|word| word == isolate::ARGUMENT) {
        return serve();
    }
    terminal::start_log();
    let parsed = Cli::command().try_get_matches().and_then(|matches| {
        let given = ExplicitOptions::of(&matches);
        Ok((Cli::from_arg_matches(&matches)?.checked()?, given))
    });
    let (cli, given) = match parsed {
        Ok(parsed) => parsed,
        Err(error) => return terminal::not_understood(&error),
    };
    #[cfg(target_os = "linux")]
    start_again(cli.command.is_none());
    // Plugins may change the folder that the program is in; names that were typed are of this one.
    surfelshop_cloud::files::keep_folder();
    let _ends = surfelshop_runtime::plugins::guard_exit();
    if cli.command.is_some() {
        interrupt::watch();
    }
    // Plugins of formats are asked which axis points up, where files need one and nobody said it.
    let command = cli.command.map(upright);
    let (memory, in_place) = pyramids_of(command.as_ref(), &cli.viewer);
    budget::use_memory(memory);
    pyramids::use_in_place(in_place);
    let done = match command {
        Some(command) => dispatch(command, &given),
        None => surfelshop_viewer::run(&cli.viewer),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => terminal::failed(&error),
    }
}

/// Does what the program orders that started this one for a plugin.
#[cfg(unix)]
fn serve() -> ExitCode {
    terminal::start_log();
    let Err(_no_socket) = isolate::serve();
    let line = "the program starts itself so, for plugins in processes of their own; see --isolate";
    terminal::failed(&anyhow::anyhow!("{}: {line}", isolate::ARGUMENT))
}

/// Runs a command.
fn dispatch(command: Command, given: &ExplicitOptions) -> anyhow::Result<()> {
    match command {
        Command::Render(arguments) => render::run(&arguments, given),
        Command::Compare(arguments) => compare::run(&arguments, given),
        Command::Report(arguments) => report::run(&arguments, given),
        Command::Share(arguments) => share::run(&arguments, given),
        Command::Farm(arguments) => farm::run(&arguments),
        Command::Merge(arguments) => merge::run(&arguments),
        Command::Papers(arguments) => surfelshop_papers::run(&arguments, &run_words),
        Command::Bench(arguments) => bench::run(&arguments, given),
        Command::Check(arguments) => check::run(&arguments),
        Command::Explain(arguments) => explain::run(&arguments, given),
        Command::Bake(arguments) => bake::run(&arguments),
        Command::Info(arguments) => info::run(&arguments),
        Command::Plugins(arguments) => plugins::run(&arguments),
        Command::Select(arguments) => select::run(&arguments),
        Command::Measure(arguments) => measure::run(&arguments),
        Command::Convert(arguments) => convert::run(&arguments),
        Command::Index(arguments) => index::run(&arguments),
        Command::Demo(arguments) => demo::run(&arguments),
        Command::Setup(arguments) => setup::run(&arguments),
        Command::Help { topic } => help(topic.as_deref()),
    }
}

/// Runs a command line within a command.
fn run_words(words: &[String]) -> anyhow::Result<()> {
    let matches = Cli::command().try_get_matches_from(words)?;
    let given = ExplicitOptions::of(&matches);
    let command = Cli::from_arg_matches(&matches)?.command.context("there is no command")?;
    dispatch(upright(command), &given)
}

/// The memory that was typed for pyramids, and whether files are read in place.
fn pyramids_of(command: Option<&Command>, viewer: &ViewerArguments) -> (Option<u64>, bool) {
    let picture = match command {
        Some(Command::Render(given)) => &given.picture,
        Some(Command::Compare(given)) => &given.picture,
        Some(Command::Report(given)) => &given.picture,
        Some(Command::Explain(given)) => &given.picture,
        Some(Command::Share(given)) => &given.picture,
        Some(_) => return (None, false),
        None => return (viewer.memory, viewer.in_place),
    };
    (picture.memory, picture.in_place)
}

/// The command with the axis that its files have upwards, where none was typed.
fn upright(mut command: Command) -> Command {
    let (lens, files, plugins) = match &mut command {
        Command::Render(given) => (&mut given.picture.lens, &given.files, &given.plugins),
        Command::Compare(given) => (&mut given.picture.lens, &given.files, &given.plugins),
        Command::Report(given) => (&mut given.picture.lens, &given.files, &given.plugins),
        Command::Explain(given) => (&mut given.picture.lens, &given.files, &given.plugins),
        Command::Share(given) => (&mut given.picture.lens, &given.files, &given.plugins),
        Command::Bench(given) => (&mut given.lens, &given.files, &given.plugins),
        _ => return command,
    };
    surfelshop_session::input::formats::stand_upright(lens, files, plugins);
    command
}

/// Prints a page of the manual, or its contents.
fn help(topic: Option<&str>) -> anyhow::Result<()> {
    let Some(topic) = topic else { return terminal::line(manual::contents()) };
    let page = manual::page(topic).with_context(|| {
        format!("no page of the manual is called `{topic}`; `surfelshop help` lists them")
    })?;
    terminal::line(page.text)
}

/// Starts the program again with what has to be in its environment before libraries are loaded: changing that within a
/// running program is not safe.
#[cfg(target_os = "linux")]
fn start_again(shows_window: bool) {
    use std::os::unix::process::CommandExt as _;
    let mut wanted = Vec::new();
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // Mesa's device-selection layer looks for a desktop session and complains on the standard error where there is
        // none. It has nothing to select here: the program ranks adapters itself.
        wanted.push(("NODEVICE_SELECT", "1"));
    }
    if shows_window && cfg!(target_env = "gnu") {
        // The C library gives blocks from this size back as soon as they are let go. By itself it raises the limit to
        // 32 MB with the first that it is given back, and what a software driver lets go of stays in its heaps: a third
        // more memory in long use. Just below the blocks that a software device takes.
        wanted.push(("MALLOC_MMAP_THRESHOLD_", "4190000"));
    }
    wanted.retain(|(name, _)| std::env::var_os(name).is_none());
    let Ok(own) = std::env::current_exe() else { return };
    if wanted.is_empty() {
        return;
    }
    let mut arguments = std::env::args_os();
    let mut again = std::process::Command::new(own);
    if let Some(name) = arguments.next() {
        again.arg0(name);
    }
    // It returns only where that did not work; then all goes on without.
    drop(again.args(arguments).envs(wanted).exec());
}
