//! What a benchmark tells: tables on the terminal, and the same numbers for programs.

use super::cells::{Cell, Table};
use super::memory::{self, Memory};
use super::split::{self, Split};
use super::variant::LeftOut;
use crate::bench::BenchArguments;
use crate::compare::put;
use serde_json::{Value, json};
use surfelshop_session::output::terminal;

/// What is told to programs.
pub(super) type Object = serde_json::Map<String, Value>;

/// What every benchmark says: of what, on what, by what.
pub(super) fn object(
    measured: &str,
    adapter: Option<Value>,
    base: &str,
    left_out: &LeftOut,
) -> Object {
    let all = json!({
        "command": "bench",
        "measured": measured,
        "version": env!("CARGO_PKG_VERSION"),
        "adapter": adapter,
        "threads": rayon::current_num_threads(),
        "ratios_to": base,
        "left_out": left_out.object(),
    });
    match all {
        Value::Object(all) => all,
        _ => Object::new(),
    }
}

/// A line about where it was measured.
pub(super) fn place(object: &Object) -> String {
    let text = |value: Option<&Value>| value.and_then(Value::as_str).unwrap_or("-").to_owned();
    let device = object.get("adapter").and_then(|adapter| adapter.get("description"));
    let threads = object.get("threads").cloned().unwrap_or_default();
    format!(
        "Surfelshop {}, {}, {threads} threads; ratios are to {}",
        text(object.get("version")),
        text(device),
        text(object.get("ratios_to"))
    )
}

/// What was measured of pictures.
#[derive(Default)]
pub(super) struct Measured {
    pub(super) cells: Vec<Cell>,
    pub(super) memory: Vec<Memory>,
    pub(super) splits: Vec<Split>,
}

impl Measured {
    /// Adds it to what is told to programs.
    pub(super) fn add_to(&self, object: &mut Object) {
        object.insert("cells".to_owned(), self.cells.iter().map(Cell::object).collect());
        object.insert("memory".to_owned(), memory::table(&self.memory).objects(&memory::NAMES));
        if !self.splits.is_empty() {
            object.insert("splits".to_owned(), self.splits.iter().map(Split::object).collect());
        }
    }

    /// Writes the tables and the object into the folder, where there is one.
    pub(super) fn write(
        &self,
        arguments: &BenchArguments,
        name: &str,
        object: &Object,
    ) -> anyhow::Result<()> {
        let Some(folder) = &arguments.out else { return Ok(()) };
        put(folder, &format!("{name}.csv"), Table::of(&self.cells).csv().as_bytes())?;
        put(folder, "memory.csv", memory::table(&self.memory).csv().as_bytes())?;
        if !self.splits.is_empty() {
            put(folder, "split.csv", split::table(&self.splits).csv().as_bytes())?;
        }
        put(folder, &format!("{name}.json"), serde_json::to_string_pretty(object)?.as_bytes())
    }

    /// Prints the tables.
    pub(super) fn print(&self) -> anyhow::Result<()> {
        terminal::line(format!("\n{}", Table::of(&self.cells).text()))?;
        terminal::line(format!("\n{}", memory::table(&self.memory).text()))?;
        split::texts(&self.splits).iter().try_for_each(|text| terminal::line(format!("\n{text}")))
    }
}
