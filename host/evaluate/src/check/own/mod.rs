//! Cases of a plugin's own: scenes with the pictures that are expected of them.

mod declared;
mod drawn;
mod judged;

pub(super) use declared::OwnCase;

use super::CheckArguments;
use crate::conformance::{Case, Outcome, Verdict};
use drawn::Bench;
use std::time::Instant;
use surfelshop_image::Image;
use surfelshop_runtime::plugins::UnitRef;

/// The own cases of a check, and what they are drawn with.
pub(super) struct OwnCases<'a> {
    arguments: &'a CheckArguments,
    /// Each with the unit that draws it.
    cases: Vec<(OwnCase, UnitRef)>,
    bench: Bench,
}

impl<'a> OwnCases<'a> {
    /// Finds the cases and who draws each of them, of the units that are checked.
    pub(super) fn find(arguments: &'a CheckArguments, units: &[UnitRef]) -> anyhow::Result<Self> {
        let cases = declared::all(arguments, units)?;
        Ok(Self { arguments, cases, bench: Bench::default() })
    }

    pub(super) fn is_empty(&self) -> bool {
        self.cases.is_empty()
    }

    /// The names, each once.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.cases.iter().map(|(case, _)| case.name.as_str())
    }

    /// Whether a unit draws one that is wanted.
    pub(super) fn has(&self, unit: &UnitRef) -> bool {
        self.cases.iter().any(|(case, drawer)| drawer == unit && self.is_wanted(case))
    }

    fn is_wanted(&self, case: &OwnCase) -> bool {
        let typed = &self.arguments.case;
        typed.is_empty() || typed.contains(&case.name)
    }

    /// Draws and judges, or accepts, the cases of a unit; `tell` hears of each and says whether to go on.
    pub(super) fn run(
        &mut self,
        unit: &UnitRef,
        tell: &mut dyn FnMut(&Outcome) -> bool,
    ) -> Vec<Outcome> {
        let mut all = Vec::new();
        for i in 0..self.cases.len() {
            let (case, drawer) = &self.cases[i];
            if drawer != unit || !self.is_wanted(case) {
                continue;
            }
            let started = Instant::now();
            let (verdict, said, pictures) = self.outcome(i);
            let (case, _) = &self.cases[i];
            let name = Case::named(unit.kind, &case.name, &case.about());
            let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
            let took = started.elapsed();
            let outcome = Outcome { case: name, verdict, said, pictures, took };
            let goes_on = tell(&outcome);
            all.push(outcome);
            if !goes_on {
                break;
            }
        }
        all
    }

    fn outcome(&mut self, i: usize) -> (Verdict, String, Vec<(String, Image)>) {
        let (case, unit) = &self.cases[i];
        let judged = self.bench.draw(self.arguments, case, unit).and_then(|drawn| {
            match self.arguments.accept {
                true => judged::accept(case, &drawn).map(judged::Judged::passed),
                false => judged::judge(case, &drawn, self.arguments.out.is_none()),
            }
        });
        match judged {
            Ok(judged) => (judged.verdict, judged.said, judged.pictures),
            Err(error) => (Verdict::Failed, format!("{error:#}"), Vec::new()),
        }
    }
}
