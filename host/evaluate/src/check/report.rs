//! What a check tells: lines as cases end, JSON and `JUnit` XML for programs, and pictures of failures.

use super::{Checked, KINDS};
use crate::check::CheckArguments;
use crate::compare::put;
use crate::conformance::{Outcome, Verdict, cases};
use serde_json::{Value, json};
use std::fmt::{self, Write as _};
use std::path::Path;
use surfelshop_api::graph::Output;
use surfelshop_image::display_transform::DisplayTransform;
use surfelshop_image::{Image, exr, outputs, png};
use surfelshop_runtime::plugins::UnitRef;
use surfelshop_session::output::{command_line, terminal};

/// Lists all cases.
pub(super) fn list(arguments: &CheckArguments, own: &[&str]) -> anyhow::Result<()> {
    let all = || KINDS.into_iter().flat_map(cases);
    if arguments.report.json {
        let object = |case: crate::conformance::Case| json!({ "kind": case.kind.word(), "name": case.name, "about": case.about });
        return terminal::json(&json!({
            "command": "check",
            "version": env!("CARGO_PKG_VERSION"),
            "cases": all().map(object).collect::<Vec<_>>(),
            "own_cases": own,
        }));
    }
    for kind in KINDS {
        terminal::line(format!("{}s:", kind.word()))?;
        for case in cases(kind) {
            terminal::line(format!("  {:<16} {}", case.name, case.about))?;
        }
    }
    if !own.is_empty() {
        terminal::line("cases of their own:")?;
    }
    own.iter().try_for_each(|name| terminal::line(format!("  {name}")))
}

/// Tells as it goes.
pub(super) struct CheckOutput<'a> {
    pub(super) arguments: &'a CheckArguments,
    /// Files that are no plugins that could be checked, in a line each.
    pub(super) refused: &'a [String],
    /// Why something could not be told or written.
    pub(super) failure: Option<anyhow::Error>,
}

impl CheckOutput<'_> {
    /// Tells which files could not be opened.
    pub(super) fn refusals(&self) -> anyhow::Result<()> {
        let is_quiet = self.arguments.report.json;
        let mut lines = self.refused.iter().filter(|_| !is_quiet);
        lines.try_for_each(|line| terminal::line(format!("refused: {line}")))
    }

    pub(super) fn begin(&self, unit: &UnitRef) -> anyhow::Result<()> {
        match self.arguments.report.json {
            true => Ok(()),
            false => terminal::line(unit),
        }
    }

    pub(super) fn not_checked(&self, line: &str) -> anyhow::Result<()> {
        match self.arguments.report.json {
            true => Ok(()),
            false => terminal::line(format!("  cannot be checked: {line}")),
        }
    }

    /// Tells of a case, and writes its pictures.
    pub(super) fn outcome(&self, unit: &UnitRef, outcome: &Outcome) -> anyhow::Result<()> {
        if !self.arguments.report.json {
            let Outcome { case, verdict, said, .. } = outcome;
            terminal::line(format!("  {:<8} {:<16} {said}", verdict.word(), case.name))?;
            if *verdict == Verdict::Failed {
                let again = again(self.arguments, unit, outcome);
                terminal::line(format!("           again: {again}"))?;
            }
        }
        let Some(folder) = &self.arguments.out else { return Ok(()) };
        for (name, image) in &outcome.pictures {
            write(folder, &stem(unit, outcome, name), name, image)?;
        }
        Ok(())
    }

    fn object(&self, all: &[Checked]) -> Value {
        json!({
            "command": "check",
            "version": env!("CARGO_PKG_VERSION"),
            "refused": self.refused,
            "units": all.iter().map(|one| object(self.arguments, one)).collect::<Vec<_>>(),
            "counts": counts(all, self.refused),
        })
    }

    /// Writes the files of all that is known so far.
    pub(super) fn write(&self, all: &[Checked]) -> anyhow::Result<()> {
        let Some(folder) = &self.arguments.out else { return Ok(()) };
        let object = serde_json::to_string_pretty(&self.object(all))?;
        put(folder, "check.json", object.as_bytes())?;
        put(folder, "check.xml", junit(self.arguments, all, self.refused)?.as_bytes())
    }

    /// Tells of all.
    pub(super) fn end(&self, all: &[Checked]) -> anyhow::Result<()> {
        if self.arguments.report.json {
            return terminal::json(&self.object(all));
        }
        let counts = counts(all, self.refused);
        let count = |verdict: Verdict| {
            format!("{} {}", counts[key(verdict)].as_u64().unwrap_or(0), verdict.word())
        };
        let verdicts = [Verdict::Passed, Verdict::Failed, Verdict::Limited, Verdict::LeftOut];
        let line = verdicts.map(count).join(", ");
        let units = if all.len() == 1 { "unit" } else { "units" };
        terminal::line(format!("{} {units}: {line}", all.len()))
    }
}

/// A verdict as programs read it.
fn key(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::LeftOut => "left_out",
        other => other.word(),
    }
}

fn counts(all: &[Checked], refused: &[String]) -> Value {
    let outcomes = || all.iter().filter_map(|one| one.outcomes.as_ref().ok()).flatten();
    let n = |verdict| outcomes().filter(|outcome| outcome.verdict == verdict).count();
    json!({
        "passed": n(Verdict::Passed),
        "failed": all.iter().map(Checked::n_failed).sum::<usize>() + refused.len(),
        "limited": n(Verdict::Limited),
        "left_out": n(Verdict::LeftOut),
    })
}

fn object(arguments: &CheckArguments, checked: &Checked) -> Value {
    let Checked { reference, outcomes } = checked;
    let case = |outcome: &Outcome| {
        let files: Vec<String> = (outcome.pictures.iter())
            .filter(|_| arguments.out.is_some())
            .map(|(name, _)| format!("{}.png", stem(reference, outcome, name)))
            .collect();
        json!({
            "case": outcome.case.name,
            "about": outcome.case.about,
            "verdict": key(outcome.verdict),
            "said": outcome.said,
            "ms": outcome.took.as_secs_f64() * 1e3,
            "pictures": files,
            "again": again(arguments, reference, outcome),
        })
    };
    json!({
        "unit": reference,
        "error": outcomes.as_ref().err(),
        "cases": outcomes.as_ref().map(|all| all.iter().map(case).collect::<Vec<_>>()).ok(),
    })
}

/// The name of a picture's file, without its ending.
fn stem(unit: &UnitRef, outcome: &Outcome, picture: &str) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || c == '-' { c } else { '-' };
    let kind = unit.kind.word();
    let UnitRef { package, id, .. } = unit;
    let stem = format!("{package}-{kind}-{id}-{}-{picture}", outcome.case.name);
    stem.chars().map(plain).collect()
}

/// A picture as it is seen, and with its numbers.
fn write(folder: &Path, stem: &str, name: &str, image: &Image) -> anyhow::Result<()> {
    let output = match name {
        "depth" => Output::Depth,
        "normal" | "here" | "turned" => Output::Normal,
        "albedo" => Output::Albedo,
        _ => Output::Color,
    };
    let seen = outputs::visible(&output, image, &DisplayTransform::default());
    put(folder, &format!("{stem}.png"), &png::encode(&seen, png::Bits::Eight)?)?;
    put(folder, &format!("{stem}.exr"), &exr::encode(&[&(output, image.clone())])?)
}

/// The command that runs a case again: as typed, for one unit and one case.
fn again(arguments: &CheckArguments, unit: &UnitRef, outcome: &Outcome) -> String {
    let typed: Vec<String> = command_line::typed_words().skip(1).collect();
    let typed = command_line::without(&typed, &["--case", "--out", "-o"]);
    let is_other = |word: &String| {
        let is_wanted = arguments.wanted.contains(word) && super::file(word).is_none();
        !is_wanted && !["--json", "--accept"].contains(&word.as_str())
    };
    let mut words = vec!["check".to_owned(), format!("{}/{}", unit.package, unit.id)];
    // A file that was named as what is to be checked would have all its units checked.
    for word in typed.into_iter().filter(is_other) {
        if arguments.wanted.contains(&word) {
            words.push("--plugin".to_owned());
        }
        words.push(word);
    }
    // A scene that was typed is the only case.
    if arguments.scene.is_none() {
        words.extend(["--case".to_owned(), outcome.case.name.to_owned()]);
    }
    words.extend(["-o".to_owned(), "checked".to_owned()]);
    command_line::words("surfelshop", words)
}

/// As `JUnit` writes it: a suite for each unit.
fn junit(
    arguments: &CheckArguments,
    all: &[Checked],
    refused: &[String],
) -> Result<String, fmt::Error> {
    let mut text = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n");
    if !refused.is_empty() {
        let n = refused.len();
        writeln!(text, "  <testsuite name=\"files\" tests=\"{n}\" errors=\"{n}\">")?;
        for line in refused {
            let line = escaped(line);
            writeln!(text, "    <testcase name=\"load\"><error message=\"{line}\"/></testcase>")?;
        }
        writeln!(text, "  </testsuite>")?;
    }
    for Checked { reference, outcomes } in all {
        let suite = escaped(&format!("{}/{}", reference.package, reference.id));
        let none = Vec::new();
        let cases = outcomes.as_ref().unwrap_or(&none);
        let n = |verdict| cases.iter().filter(|one| one.verdict == verdict).count();
        let (failed, skipped) = (n(Verdict::Failed), n(Verdict::LeftOut) + n(Verdict::Limited));
        let errors = usize::from(outcomes.is_err());
        let tests = cases.len() + errors;
        writeln!(
            text,
            "  <testsuite name=\"{suite}\" tests=\"{tests}\" failures=\"{failed}\" \
             errors=\"{errors}\" skipped=\"{skipped}\">"
        )?;
        if let Err(line) = outcomes {
            let line = escaped(line);
            writeln!(text, "    <testcase name=\"load\"><error message=\"{line}\"/></testcase>")?;
        }
        for outcome in cases {
            let (name, said) = (outcome.case.name, escaped(&outcome.said));
            write!(
                text,
                "    <testcase classname=\"{suite}\" name=\"{name}\" time=\"{:.3}\">",
                outcome.took.as_secs_f64()
            )?;
            let again = escaped(&again(arguments, reference, outcome));
            let inner = match outcome.verdict {
                Verdict::Passed => format!("<system-out>{said}</system-out>"),
                Verdict::Failed => format!("<failure message=\"{said}\">{again}</failure>"),
                Verdict::Limited | Verdict::LeftOut => format!("<skipped message=\"{said}\"/>"),
            };
            writeln!(text, "{inner}</testcase>")?;
        }
        text.push_str("  </testsuite>\n");
    }
    text.push_str("</testsuites>\n");
    Ok(text)
}

/// Text as XML takes it; what it cannot hold is left out.
fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            c if c.is_control() && c != '\n' && c != '\t' => {}
            '\u{FFFE}' | '\u{FFFF}' => {}
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_escaped() {
        assert_eq!(escaped("a<b> & \"c\"\u{0}\u{1b}"), "a&lt;b&gt; &amp; &quot;c&quot;");
    }
}
