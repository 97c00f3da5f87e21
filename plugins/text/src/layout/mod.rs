//! What the columns of lines hold, and how it is found out.

mod delimiter;
mod facts;
mod found;
mod guess;
mod names;
mod ranges;
pub(crate) mod sample;
mod types;

pub(crate) use delimiter::Delimiter;
pub(crate) use found::{Found, Settings, by_ranges, in_table, noted};
pub(crate) use names::{Target, have_position, shown, targets};
pub(crate) use types::{is_whole, named, type_names};

use facts::Numbers;
use guess::Cut;
use surfelshop_api::columns::{COLOR, Element};
use surfelshop_api::format::FileColumn;
use types::limits;

/// What becomes of a word of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Field {
    /// It is passed over.
    Skipped,
    /// A number of 64 bits.
    Long,
    /// A number of 32 bits.
    Short,
    /// A whole number within limits.
    Whole([f64; 2]),
    /// A number within limits that is rounded; a missing one is 0.
    Rounded([f64; 2]),
}

/// A column that is handed over, and for each of its components which of the words that are not skipped it is.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Column {
    pub(crate) file: FileColumn,
    pub(crate) places: Vec<usize>,
}

/// How lines are read into columns.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Layout {
    pub(crate) delimiter: Delimiter,
    pub(crate) decimal: u8,
    /// What becomes of each word of a line.
    pub(crate) fields: Vec<Field>,
    /// The columns in the order of their first words.
    pub(crate) columns: Vec<Column>,
}

/// A column of the file: what it holds and, where that is set, its type.
pub(crate) type Typed = (Option<Target>, Option<Element>);

impl Layout {
    /// A layout of these columns, where `wants` says so of them; positions are always read.
    pub(crate) fn new(
        cut: &Cut,
        typed: &[Typed],
        numbers: &Numbers,
        wants: impl Fn(&str) -> bool,
    ) -> Self {
        let mut layout = Self {
            delimiter: cut.delimiter,
            decimal: cut.decimal,
            fields: Vec::with_capacity(typed.len()),
            columns: Vec::new(),
        };
        let is_read = |target: &Target| {
            target.column == surfelshop_api::columns::POSITION || wants(&target.column)
        };
        let mut n_read = 0;
        for (target, _) in typed {
            let Some(target) = target.as_ref().filter(|target| is_read(target)) else {
                layout.fields.push(Field::Skipped);
                continue;
            };
            let place = layout.columns.iter().position(|c| c.file.name == target.column);
            let place = place.unwrap_or_else(|| {
                let element = type_of(&target.column, typed, numbers);
                let components = n_components(&target.column, typed);
                let file = FileColumn::new(&target.column, components as u32, element);
                layout.columns.push(Column { file, places: vec![0; components] });
                layout.columns.len() - 1
            });
            let column = &mut layout.columns[place];
            column.places[target.component] = n_read;
            layout.fields.push(field(&column.file));
            n_read += 1;
        }
        layout
    }

    /// The same that hands nothing over, for lines that nobody wants.
    pub(crate) fn skipping(&self) -> Self {
        let fields = vec![Field::Skipped; self.fields.len()];
        Self { fields, columns: Vec::new(), ..self.clone() }
    }

    /// Numbers of a line that are read.
    pub(crate) fn n_read(&self) -> usize {
        self.fields.iter().filter(|field| **field != Field::Skipped).count()
    }
}

fn field(column: &FileColumn) -> Field {
    match (column.element, limits(column.element)) {
        (Element::F64, _) => Field::Long,
        (_, None) => Field::Short,
        (_, Some(limits)) if column.name == COLOR => Field::Rounded(limits),
        (_, Some(limits)) => Field::Whole(limits),
    }
}

fn parts<'a>(column: &'a str, typed: &'a [Typed]) -> impl Iterator<Item = (usize, &'a Typed)> {
    let is_part =
        move |target: &Option<Target>| target.as_ref().is_some_and(|t| t.column == column);
    typed.iter().enumerate().filter(move |(_, (target, _))| is_part(target))
}

fn n_components(column: &str, typed: &[Typed]) -> usize {
    parts(column, typed).count()
}

/// The type that is set for a column, or the one that its numbers suggest.
fn type_of(column: &str, typed: &[Typed], numbers: &Numbers) -> Element {
    let set = parts(column, typed).find_map(|(_, (_, element))| *element);
    set.unwrap_or_else(|| {
        let all = parts(column, typed).filter_map(|(i, _)| numbers.facts.get(i));
        types::element(column, &facts::Facts::of_all(all))
    })
}
