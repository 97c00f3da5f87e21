//! What was measured, as tables and programs take it.

use super::timing::{Timed, What};
use crate::chart::ticks::label;
use crate::csv;
use serde_json::{Map, Value, json};
use surfelshop_session::timing::{all_of, median, spread};

/// What a cell is of, by names of columns.
pub(super) type Of = Vec<(&'static str, Value)>;

/// Times of a variant in one place.
pub(super) struct Cell {
    pub(super) of: Of,
    /// What was drawn.
    pub(super) what: String,
    pub(super) is_frame: bool,
    pub(super) timed: Timed,
    /// Time and CPU time over those of the variant that all are compared with.
    ratios: [Option<f64>; 2],
}

/// Medians of the runs.
fn wall_ms(timed: &Timed) -> Option<f64> {
    median(&all_of(&timed.runs, |run| Some(run.wall_ms)))
}

fn cpu_ms(timed: &Timed) -> Option<f64> {
    median(&all_of(&timed.runs, |run| run.cpu_ms))
}

/// What variants took in one place; `base` is the one they are compared with.
pub(super) fn cells(of: &Of, what: What<'_>, all: Vec<Timed>, base: &str) -> Vec<Cell> {
    let base = all.iter().find(|timed| timed.variant == base);
    let [wall, cpu] = [base.and_then(wall_ms), base.and_then(cpu_ms)];
    let ratio = |own: Option<f64>, base: Option<f64>| Some(own? / base.filter(|ms| *ms > 0.0)?);
    let cell = |timed: Timed| Cell {
        of: of.clone(),
        what: what.name().to_owned(),
        is_frame: matches!(what, What::Frame(_)),
        ratios: [ratio(wall_ms(&timed), wall), ratio(cpu_ms(&timed), cpu)],
        timed,
    };
    all.into_iter().map(cell).collect()
}

impl Cell {
    /// Median of the time, milliseconds.
    pub(super) fn wall_ms(&self) -> Option<f64> {
        wall_ms(&self.timed)
    }

    /// Median of the CPU time, milliseconds.
    pub(super) fn cpu_ms(&self) -> Option<f64> {
        cpu_ms(&self.timed)
    }

    /// Its numbers by names of columns and of JSON.
    fn numbers(&self) -> [(&'static str, &'static str, Value); 10] {
        let runs = &self.timed.runs;
        let wall = all_of(runs, |run| Some(run.wall_ms));
        let cpu = all_of(runs, |run| run.cpu_ms);
        let device = all_of(runs, |run| run.own_passes_ms);
        let rate = self.wall_ms().filter(|ms| self.is_frame && *ms > 0.0).map(|ms| 1e3 / ms);
        let [wall_ratio, cpu_ratio] = self.ratios;
        [
            ("wall, ms", "wall_ms", json!(median(&wall))),
            ("spread, ms", "wall_spread_ms", json!(spread(&wall))),
            ("CPU, ms", "cpu_ms", json!(median(&cpu))),
            ("CPU spread, ms", "cpu_spread_ms", json!(spread(&cpu))),
            ("device, ms", "device_ms", json!(median(&device))),
            ("first, ms", "first_ms", json!(self.timed.first_ms)),
            ("frames/s", "frames_per_second", json!(rate)),
            ("wall ratio", "wall_ratio", json!(wall_ratio)),
            ("CPU ratio", "cpu_ratio", json!(cpu_ratio)),
            ("runs", "n_runs", json!(runs.len())),
        ]
    }

    /// All of it, run by run.
    pub(super) fn object(&self) -> Value {
        let of = self.of.iter().map(|(name, value)| ((*name).to_owned(), value.clone()));
        let mut object: Map<String, Value> = of.collect();
        object.insert("what".to_owned(), json!(self.what));
        object.insert("variant".to_owned(), json!(self.timed.variant));
        for (_, name, value) in self.numbers() {
            object.insert(name.to_owned(), value);
        }
        object.insert("runs".to_owned(), json!(self.timed.runs));
        object.insert("surfel_passes".to_owned(), json!(self.timed.passes));
        Value::Object(object)
    }
}

/// A head and rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Table {
    pub(super) head: Vec<String>,
    pub(super) rows: Vec<Vec<Value>>,
}

impl Table {
    /// A row for each cell.
    pub(super) fn of(cells: &[Cell]) -> Self {
        let Some(first) = cells.first() else { return Self::default() };
        let head = first.of.iter().map(|(name, _)| *name).chain(["drawn", "variant"]);
        let head = head.chain(first.numbers().map(|(name, ..)| name));
        let row = |cell: &Cell| {
            let of = cell.of.iter().map(|(_, value)| value.clone());
            let own = [json!(cell.what), json!(cell.timed.variant)];
            of.chain(own).chain(cell.numbers().map(|(.., value)| value)).collect()
        };
        Self { head: head.map(str::to_owned).collect(), rows: cells.iter().map(row).collect() }
    }

    /// For programs.
    pub(super) fn csv(&self) -> String {
        csv::table(&self.head.iter().map(String::as_str).collect::<Vec<_>>(), &self.rows)
    }

    /// For programs, each row by these names instead of the head.
    pub(super) fn objects(&self, names: &[&str]) -> Value {
        let row = |row: &Vec<Value>| -> Value {
            let named =
                names.iter().zip(row).map(|(name, value)| ((*name).to_owned(), value.clone()));
            Value::Object(named.collect())
        };
        self.rows.iter().map(row).collect()
    }

    /// For people: texts to the left and numbers to the right, without columns that say nothing.
    pub(super) fn text(&self) -> String {
        let mut lines = vec![String::new(); 1 + self.rows.len()];
        for (at, head) in self.head.iter().enumerate() {
            let column = || self.rows.iter().map(|row| row.get(at).unwrap_or(&Value::Null));
            if column().all(Value::is_null) {
                continue;
            }
            let is_text = column().any(Value::is_string);
            let cells: Vec<String> =
                std::iter::once(head.clone()).chain(column().map(shown)).collect();
            let width = cells.iter().map(|cell| cell.chars().count()).max().unwrap_or(0);
            for (line, cell) in lines.iter_mut().zip(cells) {
                let gap = if line.is_empty() { "" } else { "  " };
                line.push_str(gap);
                line.push_str(&match is_text {
                    true => format!("{cell:<width$}"),
                    false => format!("{cell:>width$}"),
                });
            }
        }
        lines.iter().map(|line| line.trim_end()).collect::<Vec<_>>().join("\n")
    }
}

/// A value in three digits; counts in all of theirs.
fn shown(value: &Value) -> String {
    match value {
        Value::Null => "-".to_owned(),
        Value::String(text) => text.clone(),
        Value::Number(number) if number.is_f64() => number.as_f64().map_or_else(String::new, label),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_session::timing::Run;

    fn timed(variant: &str, wall_ms: &[f64]) -> Timed {
        let run =
            |&wall_ms: &f64| Run { wall_ms, own_passes_ms: None, cpu_ms: Some(2.0 * wall_ms) };
        let runs = wall_ms.iter().map(run).collect();
        Timed { variant: variant.to_owned(), first_ms: 9.0, runs, passes: Vec::new() }
    }

    #[test]
    fn ratios_are_those_of_medians() {
        let all = || vec![timed("a", &[1.0, 8.0, 2.0]), timed("b", &[4.0, 3.0, 90.0])];
        let ratios = |base| -> Vec<_> {
            cells(&Of::new(), What::Surfels, all(), base).iter().map(|cell| cell.ratios).collect()
        };
        assert_eq!(ratios("b"), [[Some(0.5); 2], [Some(1.0); 2]]);
        assert_eq!(ratios("c"), [[None; 2]; 2]);
    }

    #[test]
    fn texts_stand_to_the_left_and_numbers_to_the_right() {
        let table = Table {
            head: ["of", "n", "empty", "ms"].map(str::to_owned).to_vec(),
            rows: vec![
                vec![json!("a"), json!(1_234_567), json!(null), json!(12.345)],
                vec![json!("longer"), json!(2), json!(null), json!(null)],
            ],
        };
        assert_eq!(
            table.text(),
            "of            n    ms\na       1234567  12.3\nlonger        2     -"
        );
        assert!(table.csv().starts_with("\"of\",\"n\",\"empty\",\"ms\"\n\"a\",1234567,,12.345\n"));
        assert_eq!(Table::of(&[]).text(), "");
    }

    #[test]
    fn frames_have_a_rate_and_surfels_alone_have_none() {
        let cell = |what| cells(&vec![("file", json!("x"))], what, vec![timed("a", &[4.0])], "a");
        let object = cell(What::Surfels)[0].object();
        assert_eq!((&object["file"], &object["frames_per_second"]), (&json!("x"), &json!(null)));
        assert_eq!((&object["wall_ms"], &object["cpu_ratio"]), (&json!(4.0), &json!(1.0)));
        let table = Table::of(&cell(What::Surfels));
        assert_eq!(table.head.len(), table.rows[0].len());
    }
}
