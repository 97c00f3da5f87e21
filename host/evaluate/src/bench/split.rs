//! `bench --split`: where the CPU time of frames goes, stage by stage.

use super::cells::{Of, Table};
use super::timing::What;
use super::variant::{Contestant, LeftOut};
use crate::compare::Stage;
use crate::compare::candidate::Candidate;
use serde_json::{Value, json};
use surfelshop_api::View;
use surfelshop_render::{StageClock, StageTime};
use surfelshop_session::timing::{median, spread};

/// The stages of some frames of a variant.
pub(super) struct Split {
    of: Of,
    what: String,
    variant: String,
    /// The median of whole frames that were not split, milliseconds of CPU time.
    pub(super) whole_ms: Option<f64>,
    stages: Vec<StageRuns>,
}

/// A stage with what it took in each frame.
struct StageRuns {
    name: String,
    clock: StageClock,
    is_part: bool,
    cpu_ms: Vec<f64>,
    wall_ms: Vec<f64>,
}

/// Splits a frame of each view, the variants in turns, behind one of the first view that does not count.
pub(super) fn split(
    contestants: &mut [Contestant],
    what: What<'_>,
    stage: &Stage<'_>,
    views: &[View],
    of: &Of,
    left_out: &mut LeftOut,
) -> Vec<Split> {
    let What::Frame(wanted) = what else { return Vec::new() };
    let mut all: Vec<(&mut Contestant, Candidate, Split)> = Vec::with_capacity(contestants.len());
    for contestant in contestants.iter_mut() {
        let candidate = Candidate::new(Some(&contestant.studio), wanted.clone());
        let split = Split {
            of: of.clone(),
            what: what.name().to_owned(),
            variant: contestant.variant.name.clone(),
            whole_ms: None,
            stages: Vec::new(),
        };
        all.push((contestant, candidate, split));
    }
    let first = views.first().copied();
    let mut number = 0;
    for (i, view) in first.into_iter().chain(views.iter().copied()).enumerate() {
        all.retain_mut(|(contestant, candidate, split)| {
            number += 1;
            let staging = contestant.variant.staging(stage.staging);
            let stage = Stage { staging: &staging, view, ..*stage };
            match candidate.split(&stage, &mut contestant.studio, number) {
                Ok(stages) => {
                    // The first frame has everything to make.
                    if i > 0 {
                        split.add(stages);
                    }
                    true
                }
                Err(error) => {
                    left_out.add(&contestant.variant, &error);
                    false
                }
            }
        });
    }
    all.into_iter().map(|(.., split)| split).collect()
}

impl Split {
    /// The variant.
    pub(super) fn variant(&self) -> &str {
        &self.variant
    }

    fn add(&mut self, stages: Vec<StageTime>) {
        for StageTime { name, clock, cpu_ms, wall_ms, is_part } in stages {
            let at = self.stages.iter().position(|known| known.name == name);
            let at = at.unwrap_or_else(|| {
                let (cpu_ms, wall_ms) = (Vec::new(), Vec::new());
                self.stages.push(StageRuns { name, clock, is_part, cpu_ms, wall_ms });
                self.stages.len() - 1
            });
            self.stages[at].cpu_ms.push(cpu_ms);
            self.stages[at].wall_ms.extend(wall_ms);
        }
    }

    /// The sum of stages that are not parts of others, milliseconds.
    fn sum_ms(&self) -> f64 {
        let whole = self.stages.iter().filter(|stage| !stage.is_part);
        whole.filter_map(|stage| median(&stage.cpu_ms)).sum()
    }

    /// A row for each stage: what it is called, its clock, CPU time, its spread, time, percent of the sum.
    fn rows(&self) -> Vec<[Value; 6]> {
        let sum = self.sum_ms();
        let percent = |ms: Option<f64>| ms.filter(|_| sum > 0.0).map(|ms| 100.0 * ms / sum);
        let mut rows: Vec<_> = self
            .stages
            .iter()
            .map(|stage| {
                let name =
                    if stage.is_part { format!("  {}", stage.name) } else { stage.name.clone() };
                let clock = match stage.clock {
                    StageClock::Process => "process",
                    StageClock::Threads => "threads",
                };
                let cpu = median(&stage.cpu_ms);
                [
                    json!(name),
                    json!(clock),
                    json!(cpu),
                    json!(spread(&stage.cpu_ms)),
                    json!(median(&stage.wall_ms)),
                    json!(percent(cpu)),
                ]
            })
            .collect();
        let of_process = |name: &str, ms: Option<f64>| {
            [json!(name), json!("process"), json!(ms), Value::Null, Value::Null, json!(percent(ms))]
        };
        rows.push(of_process("sum", Some(sum)));
        rows.push(of_process("the frame whole, without display and PNG", self.whole_ms));
        rows
    }

    /// For programs.
    pub(super) fn object(&self) -> Value {
        let of = self.of.iter().map(|(name, value)| ((*name).to_owned(), value.clone()));
        let mut object: serde_json::Map<String, Value> = of.collect();
        object.insert("what".to_owned(), json!(self.what));
        object.insert("variant".to_owned(), json!(self.variant));
        object.insert("sum_ms".to_owned(), json!(self.sum_ms()));
        object.insert("whole_ms".to_owned(), json!(self.whole_ms));
        let stage = |stage: &StageRuns| {
            json!({
                "stage": stage.name,
                "clock": stage.clock,
                "is_part": stage.is_part,
                "cpu_ms": median(&stage.cpu_ms),
                "cpu_spread_ms": spread(&stage.cpu_ms),
                "wall_ms": median(&stage.wall_ms),
                "runs_cpu_ms": stage.cpu_ms,
                "runs_wall_ms": stage.wall_ms,
            })
        };
        object.insert("stages".to_owned(), self.stages.iter().map(stage).collect());
        Value::Object(object)
    }
}

/// All of them as one table.
pub(super) fn table(splits: &[Split]) -> Table {
    let Some(first) = splits.first() else { return Table::default() };
    let of = first.of.iter().map(|(name, _)| *name).chain(["drawn", "variant"]);
    let own = ["stage", "clock", "CPU, ms", "CPU spread, ms", "wall, ms", "% of the sum"];
    let rows = splits.iter().flat_map(|split| {
        let of: Vec<Value> = split.of.iter().map(|(_, value)| value.clone()).collect();
        let named = [json!(split.what), json!(split.variant)];
        split.rows().into_iter().map(move |row| {
            of.iter().cloned().chain(named.iter().cloned()).chain(row).collect::<Vec<Value>>()
        })
    });
    Table { head: of.chain(own).map(str::to_owned).collect(), rows: rows.collect() }
}

/// A table of each for readers, below what it is of.
pub(super) fn texts(splits: &[Split]) -> Vec<String> {
    let own = ["stage", "clock", "CPU, ms", "spread, ms", "wall, ms", "%"];
    let text = |split: &Split| {
        let of = split.of.iter().map(|(_, value)| match value {
            Value::String(text) => text.clone(),
            other => other.to_string(),
        });
        let of: Vec<String> = of.chain([split.what.clone(), split.variant.clone()]).collect();
        let rows = split.rows().into_iter().map(|row| row.to_vec()).collect();
        let table = Table { head: own.map(str::to_owned).to_vec(), rows };
        format!("{}\n{}", of.join(", "), table.text())
    };
    splits.iter().map(text).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stage(name: &str, cpu_ms: f64, is_part: bool) -> StageTime {
        let clock = if is_part { StageClock::Threads } else { StageClock::Process };
        let wall_ms = (!is_part).then_some(0.5 * cpu_ms);
        StageTime { name: name.to_owned(), clock, cpu_ms, wall_ms, is_part }
    }

    #[test]
    fn a_sum_counts_stages_once_and_their_parts_not_at_all() {
        let of = vec![("file", json!("x"))];
        let (what, variant) = ("flat".to_owned(), "cpu".to_owned());
        let mut split = Split { of, what, variant, whole_ms: Some(9.0), stages: Vec::new() };
        for ms in [1.0, 3.0, 50.0] {
            split.add(vec![
                stage("surfels", 2.0 * ms, false),
                stage("surfels: packing", ms, true),
                stage("pass flat", 4.0, false),
            ]);
        }
        assert_eq!(split.sum_ms(), 10.0);
        let rows = split.rows();
        assert_eq!(rows.len(), 5);
        assert_eq!(rows[1][0], json!("  surfels: packing"));
        assert_eq!(
            (&rows[1][1], &rows[1][2], &rows[1][4]),
            (&json!("threads"), &json!(3.0), &Value::Null)
        );
        assert_eq!(
            (&rows[2][2], &rows[2][4], &rows[2][5]),
            (&json!(4.0), &json!(2.0), &json!(40.0))
        );
        assert_eq!((&rows[3][2], &rows[4][2]), (&json!(10.0), &json!(9.0)));
        let splits = [split];
        assert_eq!(table(&splits).head.len(), table(&splits).rows[0].len());
        assert_eq!(table(&[]), Table::default());
        assert!(texts(&splits)[0].starts_with("x, flat, cpu\nstage"), "{:?}", texts(&splits));
        assert_eq!(splits[0].object()["stages"][0]["runs_cpu_ms"], json!([2.0, 6.0, 100.0]));
    }
}
