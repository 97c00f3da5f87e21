//! Which options were typed: a scene says the rest, where there is one.

use clap::ArgMatches;
use clap::parser::ValueSource;

/// The options of a command that were typed, by the names of their fields.
#[derive(Clone, Debug, Default)]
pub(crate) struct Given(Vec<String>);

impl Given {
    /// Those of the command in a command line.
    pub(crate) fn of(matches: &ArgMatches) -> Self {
        let Some((_, command)) = matches.subcommand() else { return Self::default() };
        let is_typed = |id: &str| command.value_source(id) == Some(ValueSource::CommandLine);
        let typed = command.ids().map(clap::Id::as_str).filter(|id| is_typed(id));
        Self(typed.map(str::to_owned).collect())
    }

    /// Whether an option was typed.
    pub(crate) fn has(&self, option: &str) -> bool {
        self.0.iter().any(|typed| typed == option)
    }
}
