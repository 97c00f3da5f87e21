//! The extra bytes of a file that is written: their places and their descriptions.

use crate::extra::{DESCRIPTOR, IN_PLACE_OF, LONGEST_NAME, descriptor, shortened};
use crate::layout::NORMALS;
use crate::numbers::Number;
use std::collections::HashSet;
use surfelshop_api::columns::{Element, NORMAL};
use surfelshop_api::format::FileColumn;

/// Most fields: their descriptions are one record, whose length has two bytes.
const MOST: usize = u16::MAX as usize / DESCRIPTOR;

/// Whether a column has a place.
pub(super) enum Fitting {
    /// Its first component lies at this byte, the others follow.
    At(usize),
    /// There is no room.
    LeftOut,
}

/// Extra bytes that were given out so far.
pub(super) struct ExtraFields {
    start: usize,
    len: usize,
    descriptions: Vec<u8>,
    /// Names that are taken, in lower case.
    names: HashSet<String>,
}

impl ExtraFields {
    /// None so far, behind fields of so many bytes, for a cloud of these columns.
    pub(super) fn new(start: usize, columns: &[FileColumn]) -> Self {
        let names = columns.iter().map(|column| column.name.to_lowercase()).collect();
        Self { start, len: 0, descriptions: Vec::new(), names }
    }

    /// Bytes of all of them.
    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// The descriptions, one after the other.
    pub(super) fn into_descriptions(self) -> Vec<u8> {
        self.descriptions
    }

    /// Gives a column its place; one that has the name of a standard field, which cannot hold it, is said to be in
    /// its place. Adds to `lines` what cannot be held.
    pub(super) fn add(
        &mut self,
        column: &FileColumn,
        is_standard: bool,
        lines: &mut Vec<String>,
    ) -> Fitting {
        let n = column.components as usize;
        let start = self.start + self.len;
        let len = n * column.element.size();
        let n_fields = self.descriptions.len() / DESCRIPTOR + n;
        if n_fields > MOST || start + len > usize::from(u16::MAX) {
            lines.push(format!(
                "`{}` is left out: point records hold at most {MOST} fields and {} bytes",
                column.name,
                u16::MAX
            ));
            return Fitting::LeftOut;
        }
        let code = Number::code_of(column.element);
        let is_float = matches!(column.element, Element::F32 | Element::F64);
        if column.name == NORMAL && n == 3 && is_float {
            for name in NORMALS {
                self.descriptions.extend(descriptor(name, "", code));
            }
        } else {
            let base = self.name(column, is_standard, lines);
            for i in 0..n {
                let (name, description) = match (n, is_standard) {
                    (1, true) => (base.clone(), format!("{IN_PLACE_OF}{}", column.name)),
                    (1, false) => (base.clone(), column.description.clone()),
                    _ => (format!("{base}_{i}"), format!("component {} of {n}", i + 1)),
                };
                self.descriptions.extend(descriptor(&name, &description, code));
            }
        }
        self.len += len;
        Fitting::At(start)
    }

    /// A name of its own for a column, which leaves room for the number of a component.
    fn name(&mut self, column: &FileColumn, is_standard: bool, lines: &mut Vec<String>) -> String {
        let digits = column.components.checked_ilog10().unwrap_or(0) as usize + 1;
        let room = LONGEST_NAME - if column.components > 1 { digits + 1 } else { 0 };
        let mut name = column.name.clone();
        if is_standard {
            name.push('_');
        }
        let mut short = shortened(&name, room).to_owned();
        let is_new = is_standard || short.len() < name.len() || column.name == "alpha";
        let mut number = 0;
        while is_new && self.names.contains(&short.to_lowercase()) {
            number += 1;
            let end = number.to_string();
            short = format!("{}{end}", shortened(&name, room - end.len()));
        }
        if name.len() > room {
            lines.push(format!("the name `{}` is too long and becomes `{short}`", column.name));
        }
        self.names.insert(short.to_lowercase());
        short
    }
}
