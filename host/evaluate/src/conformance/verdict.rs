//! Cases, and what came of them.

use std::time::{Duration, Instant};
use surfelshop_api::{Limit, UnitKind};
use surfelshop_image::Image;
use surfelshop_runtime::plugins::LoadedUnit;

/// A case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Case {
    /// Which units it is for.
    pub kind: UnitKind,
    /// Its name, as it is typed.
    pub name: &'static str,
    /// What must hold, in a sentence.
    pub about: &'static str,
}

impl Case {
    /// A case that is declared in a file. Its texts stay until the program ends: a check names few.
    #[must_use]
    pub fn named(kind: UnitKind, name: &str, about: &str) -> Self {
        let stay = |text: &str| -> &'static str { Box::leak(text.to_owned().into_boxed_str()) };
        Self { kind, name: stay(name), about: stay(about) }
    }
}

/// How a case ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// What must hold does.
    Passed,
    /// It does not.
    Failed,
    /// It does not, as the unit says itself.
    Limited,
    /// It could not be asked here.
    LeftOut,
}

impl Verdict {
    /// A word.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Passed => "passed",
            Self::Failed => "failed",
            Self::Limited => "limited",
            Self::LeftOut => "left out",
        }
    }
}

/// What came of a case.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The case.
    pub case: Case,
    /// How it ended.
    pub verdict: Verdict,
    /// What was measured, what is wrong, or why it was left out: one line.
    pub said: String,
    /// Pictures that show what is wrong, each with a name of letters, digits and hyphens.
    pub pictures: Vec<(String, Image)>,
    /// How long it took.
    pub took: Duration,
}

/// What is wrong.
#[derive(Debug)]
pub(crate) struct Failure {
    pub(crate) line: String,
    pub(crate) pictures: Vec<(String, Image)>,
    /// What share of what was counted is wrong, 0 to 1, where something was.
    pub(crate) share: Option<f64>,
    /// Whether the unit did not answer in time: it is not asked again.
    pub(crate) is_silent: bool,
    /// Whether the unit failed, and not only what it made: no limit excuses that, nor a value that it may
    /// refuse.
    pub(crate) is_fault: bool,
}

impl Failure {
    pub(crate) fn new(line: impl Into<String>) -> Self {
        let (is_silent, is_fault) = (false, false);
        Self { line: line.into(), pictures: Vec::new(), share: None, is_silent, is_fault }
    }

    /// A failure of the unit itself.
    pub(crate) fn fault(line: impl Into<String>) -> Self {
        Self { is_fault: true, ..Self::new(line) }
    }

    /// No answer.
    pub(crate) fn silence(line: impl Into<String>) -> Self {
        Self { is_silent: true, ..Self::fault(line) }
    }

    /// The same with pictures.
    pub(crate) fn showing<'a>(
        line: impl Into<String>,
        pictures: impl IntoIterator<Item = (&'a str, &'a Image)>,
    ) -> Self {
        let owned = |(name, image): (&str, &Image)| (name.to_owned(), image.clone());
        Self { pictures: pictures.into_iter().map(owned).collect(), ..Self::new(line) }
    }

    /// The same, where so many of all that was counted are wrong.
    pub(crate) fn counting(self, wrong: usize, of: usize) -> Self {
        Self { share: Some(wrong as f64 / of.max(1) as f64), ..self }
    }

    /// The same, of one of several things that were tried.
    pub(crate) fn of(mut self, what: &str) -> Self {
        self.line = format!("{what}: {}", self.line);
        self
    }
}

/// What a case that does not fail says.
#[derive(Debug)]
pub(crate) enum Said {
    /// What was measured.
    Measured(String),
    /// Why it was left out.
    LeftOut(String),
}

pub(crate) type Judged = Result<Said, Failure>;

/// What judges a case, with what units are checked at.
pub(crate) type Judges<B> = fn(&mut B) -> Judged;

/// Runs cases one after the other; a unit that did not answer once has the others left out.
pub(crate) fn run<B>(
    unit: &LoadedUnit,
    cases: &[(Case, Judges<B>)],
    wanted: &dyn Fn(&Case) -> bool,
    tell: &mut dyn FnMut(&Outcome) -> bool,
    bench: &mut B,
) -> Vec<Outcome> {
    let (mut all, mut is_silent) = (Vec::new(), false);
    for (case, judge) in cases.iter().filter(|(case, _)| wanted(case)) {
        let started = Instant::now();
        let judged = match is_silent {
            true => Ok(Said::LeftOut("it did not answer before".to_owned())),
            false => judge(bench),
        };
        is_silent |= judged.as_ref().is_err_and(|failure| failure.is_silent);
        let outcome = outcome(*case, judged, &unit.description.limits, started.elapsed());
        let goes_on = tell(&outcome);
        all.push(outcome);
        if !goes_on {
            break;
        }
    }
    all
}

/// Fails where a declared limit names no case.
pub(crate) fn limits_name(limits: &[Limit], cases: &[Case]) -> Judged {
    let known: Vec<&str> = cases.iter().map(|case| case.name).collect();
    match limits.iter().find(|limit| !known.contains(&limit.case.as_str())) {
        None => Ok(Said::Measured(format!("{} declared", limits.len()))),
        Some(limit) => Err(Failure::fault(format!(
            "it declares a limit in the case `{}`; there are {}",
            limit.case,
            known.join(", ")
        ))),
    }
}

fn outcome(case: Case, judged: Judged, limits: &[Limit], took: Duration) -> Outcome {
    let limit = limits.iter().find(|limit| limit.case == case.name);
    let (verdict, said, pictures) = match judged {
        Ok(Said::Measured(line)) if limit.is_some() => {
            let line = format!("{line}; it declares a limit here that it does not need");
            (Verdict::Passed, line, Vec::new())
        }
        Ok(Said::Measured(line)) => (Verdict::Passed, line, Vec::new()),
        Ok(Said::LeftOut(line)) => (Verdict::LeftOut, line, Vec::new()),
        Err(failure) => match limit {
            Some(limit) if !failure.is_fault => match (failure.share, limit.at_most) {
                (Some(share), Some(most)) if share > f64::from(most) => {
                    let line = format!(
                        "{}: {:.2} % are wrong, and it declares at most {:.2} %",
                        failure.line,
                        100.0 * share,
                        100.0 * most
                    );
                    (Verdict::Failed, line, failure.pictures)
                }
                (None, Some(_)) => {
                    let line = format!(
                        "{}: this is counted in no share, of which it declares the most",
                        failure.line
                    );
                    (Verdict::Failed, line, failure.pictures)
                }
                (_, most) => {
                    let bound = most.map(|most| format!(", at most {:.2} %", 100.0 * most));
                    let bound = bound.unwrap_or_else(|| ", without a bound".to_owned());
                    let line = format!("{}{bound} ({})", limit.why, failure.line);
                    (Verdict::Limited, line, failure.pictures)
                }
            },
            _ => (Verdict::Failed, failure.line, failure.pictures),
        },
    };
    // A plugin's words may have any form.
    let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
    Outcome { case, verdict, said, pictures, took }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CASE: Case = Case { kind: UnitKind::Renderer, name: "turned", about: "" };

    fn judged(failure: Failure) -> (Verdict, String) {
        judged_within(failure, None)
    }

    fn judged_within(failure: Failure, at_most: Option<f32>) -> (Verdict, String) {
        let (case, why) = ("turned".to_owned(), "patterns stay".to_owned());
        let limit = Limit { case, why, at_most };
        let outcome = outcome(CASE, Err(failure), &[limit], Duration::ZERO);
        (outcome.verdict, outcome.said)
    }

    #[test]
    fn limits_with_a_bound_let_pass_no_more() {
        let wrong = || Failure::new("some").counting(3, 4);
        let line = "patterns stay, at most 80.00 % (some)".to_owned();
        assert_eq!(judged_within(wrong(), Some(0.8)), (Verdict::Limited, line));
        let line = "some: 75.00 % are wrong, and it declares at most 50.00 %".to_owned();
        assert_eq!(judged_within(wrong(), Some(0.5)), (Verdict::Failed, line));
        assert_eq!(judged_within(Failure::new("none"), Some(0.5)).0, Verdict::Failed);
        let limit = |case: &str| Limit { case: case.to_owned(), why: String::new(), at_most: None };
        assert!(limits_name(&[limit("turned")], &[CASE]).is_ok());
        assert!(limits_name(&[limit("turnd")], &[CASE]).is_err());
    }

    #[test]
    fn declared_limits_are_shown_and_silence_is_none() {
        let line = "patterns stay, without a bound (3 pixels)".to_owned();
        assert_eq!(judged(Failure::new("3\npixels")), (Verdict::Limited, line));
        let silent = Failure::silence("no answer");
        assert_eq!(judged(silent), (Verdict::Failed, "no answer".to_owned()));
        assert_eq!(judged(Failure::fault("a panic")), (Verdict::Failed, "a panic".to_owned()));
    }
}
