//! Manual pages and completions, made from the command line's own declaration.

use super::File;
use crate::arguments::Cli;
use anyhow::Context as _;
use clap::{Command, CommandFactory as _};
use clap_complete::Shell;
use std::path::PathBuf;

/// A manual page for the program and each command, and completions for three shells.
pub(super) fn files() -> anyhow::Result<Vec<File>> {
    let mut files = Vec::new();
    pages(&program(), &mut files)?;
    for (shell, path) in [
        (Shell::Bash, "share/bash-completion/completions/surfelshop"),
        (Shell::Zsh, "share/zsh/site-functions/_surfelshop"),
        (Shell::Fish, "share/fish/vendor_completions.d/surfelshop.fish"),
    ] {
        let mut bytes = Vec::new();
        clap_complete::generate(shell, &mut program(), "surfelshop", &mut bytes);
        files.push(File { path: PathBuf::from(path), bytes });
    }
    Ok(files)
}

fn program() -> Command {
    let mut program = Cli::command();
    program.build();
    program
}

/// The page of a command, and those of the commands below it.
fn pages(command: &Command, files: &mut Vec<File>) -> anyhow::Result<()> {
    let name = command.get_display_name().unwrap_or(command.get_name()).replace(' ', "-");
    let mut bytes = Vec::new();
    let page = clap_mangen::Man::new(command.clone()).title(name.to_uppercase());
    page.render(&mut bytes).with_context(|| format!("the manual page of {name}"))?;
    files.push(File { path: PathBuf::from(format!("share/man/man1/{name}.1")), bytes });
    for below in command.get_subcommands().filter(|below| !below.is_hide_set()) {
        pages(below, files)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_has_a_page_with_its_options_and_shells_know_it() {
        let files = files().unwrap();
        let text = |path: &str| {
            let file = files.iter().find(|file| file.path == std::path::Path::new(path));
            String::from_utf8(file.unwrap_or_else(|| panic!("{path}")).bytes.clone()).unwrap()
        };
        for command in program().get_subcommands() {
            let name = command.get_name();
            let page = text(&format!("share/man/man1/surfelshop-{name}.1"));
            assert!(page.contains(".SH NAME") && page.contains(".SH SYNOPSIS"), "{name}:\n{page}");
            for shell in [
                "share/bash-completion/completions/surfelshop",
                "share/zsh/site-functions/_surfelshop",
                "share/fish/vendor_completions.d/surfelshop.fish",
            ] {
                assert!(text(shell).contains(name), "{shell} does not know {name}");
            }
        }
        assert!(text("share/man/man1/surfelshop-render.1").contains("eye\\-dome\\-lighting"));
        text("share/man/man1/surfelshop-plugins-new.1");
    }
}
