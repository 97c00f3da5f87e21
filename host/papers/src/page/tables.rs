//! The tables of all entries: the state of each figure and table, and the effect of each erratum; for pages, and as
//! Markdown for notes.

use super::entry::why;
use crate::effects::Effect;
use crate::entries::Paper;
use crate::outcome::{Made, State};
use std::fmt::Write as _;

/// How many entries are in which state: made, with something that stands in, not made, failed.
pub(super) fn counts(entries: &[Made<'_>]) -> [usize; 4] {
    let state = |made: &Made<'_>| made.outcome.as_ref().map(|outcome| outcome.state).ok();
    [Some(State::Made), Some(State::StoodIn), Some(State::Impossible), None]
        .map(|wanted| entries.iter().filter(|made| state(made) == wanted).count())
}

/// Such counts in words.
pub(super) fn counted(entries: &[Made<'_>]) -> String {
    let [n_made, n_stood_in, n_not, n_failed] = counts(entries);
    let failed = if n_failed > 0 { format!(", {n_failed} failed") } else { String::new() };
    format!(
        "{} entries: {n_made} made, {n_stood_in} with something that stands in, {n_not} not made{failed}.",
        entries.len()
    )
}

/// The state of an entry in a word or two, and why.
pub(super) fn state(made: &Made<'_>) -> [String; 2] {
    match &made.outcome {
        Ok(outcome) => [outcome.state.word().to_owned(), why(made.entry, outcome)],
        Err(line) => ["failed".to_owned(), line.clone()],
    }
}

/// The columns of [`effect`].
pub(super) const EFFECT: [&str; 6] =
    ["erratum", "on the screen", "what", "error as printed", "as corrected", "of"];

/// An erratum's row.
pub(super) fn effect(made: &Made<'_>) -> [String; 6] {
    let none = Effect { on_screen: None, error: String::new(), printed: None, corrected: None };
    let effect = made.effect.clone().unwrap_or(none);
    let shown = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:.4}"));
    let on_screen = match effect.on_screen {
        Some(difference) => format!("{:.1} %", 100.0 * difference),
        None => "not shown".to_owned(),
    };
    let [printed, corrected] = [effect.printed, effect.corrected].map(shown);
    [made.entry.id.clone(), on_screen, made.entry.shows.clone(), printed, corrected, effect.error]
}

/// How many errata show, the largest effect and the smallest; nothing where none does.
pub(super) fn extremes(entries: &[Made<'_>]) -> String {
    let of = |made: &Made<'_>| {
        made.effect
            .as_ref()
            .and_then(|effect| effect.on_screen)
            .map(|on| (on, made.entry.id.clone()))
    };
    let mut all: Vec<(f64, String)> = entries.iter().filter_map(of).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (Some((small, smallest)), Some((large, largest))) = (all.first(), all.last()) else {
        return String::new();
    };
    let worse = entries.iter().filter_map(|made| made.effect.as_ref());
    let worse = worse.filter(|effect| effect.printed < effect.corrected).count();
    let worse = match worse {
        0 => String::new(),
        n => format!(" In {n} the printed form has the smaller RMSE."),
    };
    format!(
        "{} of {} errata show. The largest effect on the screen has {largest}, {:.1} % of white; the smallest \
         {smallest}, {:.1} %.{worse}",
        all.len(),
        entries.len(),
        100.0 * large,
        100.0 * small
    )
}

/// All tables as Markdown.
pub(super) fn markdown(made: &[(&Paper, Vec<Made<'_>>)]) -> Result<String, std::fmt::Error> {
    let mut text = String::new();
    for (paper, entries) in made {
        writeln!(text, "## {}\n\n{}\n", paper.title, counted(entries))?;
        writeln!(text, "| | where | what | state | why |\n|---|---|---|---|---|")?;
        for made in entries {
            let [word, why] = state(made);
            let entry = made.entry;
            row(&mut text, &[&entry.id, &entry.at, &entry.shows, &word, &why])?;
        }
        writeln!(text)?;
        if entries.iter().any(|made| made.effect.is_some()) {
            writeln!(text, "### Effects\n\n{}\n", extremes(entries))?;
            writeln!(text, "| {} |\n|{}", EFFECT.join(" | "), "---|".repeat(EFFECT.len()))?;
            for made in entries {
                row(&mut text, &effect(made))?;
            }
            writeln!(text)?;
        }
    }
    Ok(text)
}

fn row(text: &mut String, cells: &[impl AsRef<str>]) -> std::fmt::Result {
    let cells = cells.iter().map(|cell| cell.as_ref().replace('|', "\\|"));
    writeln!(text, "| {} |", cells.collect::<Vec<_>>().join(" | "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::entries::Entry;
    use crate::outcome::Outcome;

    #[test]
    fn the_largest_and_the_smallest_effect_are_named() {
        let entry = |id: &str| Entry { id: id.to_owned(), ..Entry::default() };
        let entries = [entry("T1"), entry("T2"), entry("T3")];
        let effects = [Some((0.5, 0.3)), Some((0.01, 0.1)), None];
        let made: Vec<Made<'_>> = entries
            .iter()
            .zip(effects)
            .map(|(entry, effect)| Made {
                entry,
                outcome: Ok(Outcome::empty(State::Made)),
                effect: effect.map(|(on_screen, printed)| Effect {
                    on_screen: Some(on_screen),
                    error: "RMSE".to_owned(),
                    printed: Some(printed),
                    corrected: Some(0.2),
                }),
            })
            .collect();
        let line = extremes(&made);
        for words in ["2 of 3 errata", "has T1, 50.0 %", "smallest T2, 1.0 %", "In 1 the printed"] {
            assert!(line.contains(words), "{line}");
        }
        assert_eq!(effect(&made[2])[1], "not shown");
        assert_eq!(extremes(&[]), "");
        assert_eq!(counts(&made), [3, 0, 0, 0]);
    }
}
