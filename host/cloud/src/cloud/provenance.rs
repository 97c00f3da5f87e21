//! Which tool made a column or a cloud, with which parameters: kept with both through edits, and
//! through files as comments.
//!
//! A file has one line for each, whose last part is a TOML table:
//!
//! ```text
//! comment surfelshop made ao: org.example.bake/ao 1.2.0 2026-03-01T09:30:00Z { rays = 64 }
//! comment surfelshop kept 900 of 1000: org.example.bake/clean 1.2.0 2026-03-01T09:31:00Z {}
//! comment surfelshop derived 500 from 900: org.example.bake/thin 1.2.0 2026-03-01T09:32:00Z {}
//! ```

use crate::cloud::column::Column;
use crate::toml_text::{values_of_text, values_text};
use std::collections::HashMap;
use std::fmt;
use std::sync::Arc;
use std::time::{SystemTime, UNIX_EPOCH};
use surfelshop_api::params::{Value, Values};

/// A run of a tool.
#[derive(Clone, Debug, PartialEq)]
pub struct ToolRun {
    /// The tool, qualified by its package: `org.example.bake/ao`.
    pub tool: String,
    /// The package's version.
    pub version: String,
    /// Every parameter of the tool with the value it ran with.
    pub values: Values,
    /// When the run ended: UTC, RFC 3339, to the second.
    pub time: String,
}

impl ToolRun {
    /// A run that ended at this time.
    ///
    /// Numbers that single precision holds are taken as the shortest that stand for the same one
    /// there, so that 0.1 is not noted as 0.10000000149011612.
    #[must_use]
    pub fn new(tool: String, version: String, values: &Values, time: SystemTime) -> Self {
        let shortest = |value: &Value| match value {
            Value::Float(number) if f64::from(*number as f32).to_bits() == number.to_bits() => {
                Value::Float((*number as f32).to_string().parse().unwrap_or(*number))
            }
            other => other.clone(),
        };
        let values = values.iter().map(|(id, value)| (id.clone(), shortest(value))).collect();
        Self { tool, version, values, time: rfc_3339(time) }
    }

    /// The same without one of the values.
    pub(crate) fn without(&self, id: &str) -> Self {
        let mut other = self.clone();
        other.values.remove(id);
        other
    }

    /// The seed of the run: its parameter `seed`, where the tool has one.
    #[must_use]
    pub fn seed(&self) -> Option<i64> {
        match self.values.get("seed") {
            Some(Value::Int(seed)) => Some(*seed),
            _ => None,
        }
    }

    /// Reads what [`Display`](fmt::Display) writes.
    fn parse(text: &str) -> Option<Self> {
        let (tool, rest) = text.trim().split_once(' ')?;
        let (version, rest) = rest.split_once(' ')?;
        let (time, values) = rest.split_once(' ')?;
        let [tool, version, time] = [tool, version, time].map(str::to_owned);
        Some(Self { tool, version, values: values_of_text(values)?, time })
    }
}

impl fmt::Display for ToolRun {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let word = |text: &str| match text.split_whitespace().collect::<String>() {
            empty if empty.is_empty() => "-".to_owned(),
            word => word,
        };
        let [tool, version, time] = [&self.tool, &self.version, &self.time].map(|text| word(text));
        write!(f, "{tool} {version} {time} {}", values_text(&self.values))
    }
}

/// What a run did to a cloud as a whole.
#[derive(Clone, Debug, PartialEq)]
pub struct CloudEdit {
    /// What it did.
    pub how: How,
    /// Surfels of the cloud after the run; of a stroke, those that it concerned.
    pub n_surfels: u64,
    /// Surfels of the cloud that the tool ran on.
    pub n_before: u64,
    /// The run.
    pub made: Arc<ToolRun>,
}

/// What a run can do to a cloud as a whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum How {
    /// It left surfels out.
    Kept,
    /// It made a cloud of its own from the other.
    Derived,
    /// It added surfels.
    Enlarged,
    /// It was led over some surfels by hand.
    Stroked,
}

impl How {
    /// All.
    const ALL: [Self; 4] = [Self::Kept, Self::Derived, Self::Enlarged, Self::Stroked];

    /// The word in files, and the one between the numbers of surfels.
    fn words(self) -> [&'static str; 2] {
        match self {
            Self::Kept => ["kept", "of"],
            Self::Derived => ["derived", "from"],
            Self::Enlarged => ["enlarged", "from"],
            Self::Stroked => ["stroked", "of"],
        }
    }
}

impl CloudEdit {
    fn parse(note: &str) -> Option<Self> {
        let (what, run) = note.split_once(": ")?;
        let [word, n_surfels, between, n_before] =
            what.split_ascii_whitespace().collect::<Vec<_>>().try_into().ok()?;
        let how = How::ALL.into_iter().find(|h| h.words() == [word, between])?;
        let (n_surfels, n_before) = (n_surfels.parse().ok()?, n_before.parse().ok()?);
        Some(Self { how, n_surfels, n_before, made: Arc::new(ToolRun::parse(run)?) })
    }
}

impl fmt::Display for CloudEdit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { how, n_surfels, n_before, made } = self;
        let [word, between] = how.words();
        write!(f, "{word} {n_surfels} {between} {n_before}: {made}")
    }
}

/// What begins every comment of this program.
const OURS: &str = "surfelshop ";
/// What begins those that say who made a column.
const MADE: &str = "made ";

/// The comments that say all this of a cloud.
pub(crate) fn comments<'a>(
    columns: &'a [Column],
    history: &'a [CloudEdit],
) -> impl Iterator<Item = String> + 'a {
    let of_column = |column: &Column| {
        let made = column.made()?;
        Some(format!("{OURS}{MADE}{}: {made}", column.name()))
    };
    let of_cloud = |note: &CloudEdit| format!("{OURS}{note}");
    columns.iter().filter_map(of_column).chain(history.iter().map(of_cloud))
}

/// What the comments of a file say; those that no version of this program wrote are passed over.
pub(crate) fn of_comments(comments: &[String]) -> (HashMap<String, Arc<ToolRun>>, Vec<CloudEdit>) {
    let (mut columns, mut history) = (HashMap::new(), Vec::new());
    for note in comments.iter().filter_map(|comment| comment.strip_prefix(OURS)) {
        if let Some((name, run)) = note.strip_prefix(MADE).and_then(|note| note.split_once(": ")) {
            columns.extend(ToolRun::parse(run).map(|made| (name.to_owned(), Arc::new(made))));
        } else {
            history.extend(CloudEdit::parse(note));
        }
    }
    (columns, history)
}

/// A time in UTC to the second; before 1970 it is taken as 1970.
///
/// Days are counted in years that begin in March, so that a leap day is the last one of its year;
/// 400 years have 146,097 days.
fn rfc_3339(time: SystemTime) -> String {
    let seconds = time.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
    let (days, second) = (seconds / 86_400, seconds % 86_400);
    // From 1 March of year 0 to 1 January 1970.
    let days = days + 719_468;
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1_460 + day / 36_524 - day / 146_096) / 365;
    let day = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day + 2) / 153;
    let day = day - (153 * month + 2) / 5 + 1;
    let month = if month < 10 { month + 3 } else { month - 9 };
    let year = 400 * era + year + u64::from(month <= 2);
    let (hour, minute, second) = (second / 3600, second / 60 % 60, second % 60);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}Z")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    fn run() -> ToolRun {
        let values = Values::from([
            ("seed".to_owned(), Value::Int(-7)),
            ("gain".to_owned(), Value::Float(f64::from(0.1f32))),
            ("exact".to_owned(), Value::Float(0.1)),
            ("on".to_owned(), Value::Bool(true)),
            ("tint".to_owned(), Value::Color([0.5, 0.25, 0.1])),
            ("name".to_owned(), Value::Text("two\nlines: \"a\"  = { é }".to_owned())),
        ]);
        let time = UNIX_EPOCH + Duration::from_secs(1_709_208_000);
        ToolRun::new("org.example/ao".to_owned(), "1.2.0".to_owned(), &values, time)
    }

    #[test]
    fn runs_are_read_as_they_are_written() {
        let made = run();
        let text = made.to_string();
        assert!(text.starts_with("org.example/ao 1.2.0 2024-02-29T12:00:00Z { "), "{text}");
        assert!(text.contains("gain = 0.1,") && !text.contains('\n'), "{text}");
        assert_eq!(ToolRun::parse(&text), Some(made.clone()));
        assert_eq!(made.seed(), Some(-7));
        let none = ToolRun { values: Values::new(), ..made };
        assert_eq!(ToolRun::parse(&none.to_string()), Some(none));
    }

    #[test]
    fn notes_of_clouds_are_read_as_they_are_written() {
        for how in How::ALL {
            let note = CloudEdit { how, n_surfels: 900, n_before: 1000, made: Arc::new(run()) };
            assert_eq!(CloudEdit::parse(&note.to_string()), Some(note));
        }
    }

    #[test]
    fn what_is_no_note_is_passed_over() {
        let comments = [
            "made ao: org.example/ao 1.2.0 2024-02-29T12:00:00Z {}",
            "surfelshop made ao org.example/ao 1.2.0 2024-02-29T12:00:00Z {}",
            "surfelshop made ao: org.example/ao 1.2.0",
            "surfelshop made ao: org.example/ao 1.2.0 now {a = ",
            "surfelshop made ao: org.example/ao 1.2.0 now {a = {}}",
            "surfelshop kept many of 10: a 1 now {}",
            "surfelshop kept 1 from 10: a 1 now {}",
            "surfelshop origin 1 2 3",
        ];
        let (columns, history) = of_comments(&comments.map(str::to_owned));
        assert!(columns.is_empty() && history.is_empty(), "{columns:?} {history:?}");
    }

    #[test]
    fn days_are_those_of_the_calendar() {
        for (seconds, expected) in [
            (0, "1970-01-01T00:00:00Z"),
            (951_782_399, "2000-02-28T23:59:59Z"),
            (951_782_400, "2000-02-29T00:00:00Z"),
            (951_868_800, "2000-03-01T00:00:00Z"),
            (1_798_761_599, "2026-12-31T23:59:59Z"),
            (4_107_542_400, "2100-03-01T00:00:00Z"),
        ] {
            assert_eq!(rfc_3339(UNIX_EPOCH + Duration::from_secs(seconds)), expected);
        }
    }
}
