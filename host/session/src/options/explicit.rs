//! Which options were typed: a scene says the rest, where there is one.

use clap::parser::ValueSource;
use clap::{ArgMatches, Args, Command};

/// The options of a command that were typed, by the names of their fields.
#[derive(Clone, Debug, Default)]
pub struct ExplicitOptions(Vec<String>);

impl ExplicitOptions {
    /// Those of the command in a command line.
    pub fn of(matches: &ArgMatches) -> Self {
        let Some((_, command)) = matches.subcommand() else { return Self::default() };
        let is_typed = |id: &str| command.value_source(id) == Some(ValueSource::CommandLine);
        let typed = command.ids().map(clap::Id::as_str).filter(|id| is_typed(id));
        Self(typed.map(str::to_owned).collect())
    }

    /// Whether an option was typed.
    pub fn has(&self, option: &str) -> bool {
        self.0.iter().any(|typed| typed == option)
    }
}

/// The options of a command and those of them that were typed, of a command line that begins with the
/// program and the command.
pub fn parse<A: Args>(line: &[&str]) -> Result<(A, ExplicitOptions), clap::Error> {
    let words = line.iter().enumerate().map(|(i, word)| if i == 1 { COMMAND } else { word });
    let command = A::augment_args(Command::new(COMMAND));
    let matches = Command::new("surfelshop").subcommand(command).try_get_matches_from(words)?;
    let options = matches.subcommand().map(|(_, options)| options.clone());
    Ok((A::from_arg_matches(&options.unwrap_or_default())?, ExplicitOptions::of(&matches)))
}

/// Stands for the name of any command.
const COMMAND: &str = "command";
