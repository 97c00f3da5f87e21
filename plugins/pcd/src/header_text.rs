//! The header of a file that is written.

use crate::Encoding;
use crate::encode::Field;
use std::fmt::Write;
use surfelshop_api::glam::{DQuat, DVec3};

/// What a header says besides the fields.
pub(crate) struct Facts {
    pub encoding: Encoding,
    pub width: u64,
    pub height: u64,
    pub viewpoint: DVec3,
    /// How the sensor was turned.
    pub orientation: DQuat,
}

impl Facts {
    /// Points that are no grid.
    fn of_rows(&self, rows: u64) -> Self {
        Self { width: rows, height: 1, ..*self }
    }

    /// A length that a header of any number of points, or of this grid, fits into.
    pub(crate) fn room(&self, fields: &[Field]) -> usize {
        // Sixteen digits are more points than any disk holds.
        let most = text(fields, &self.of_rows(9_999_999_999_999_999), 0).len();
        most.max(text(fields, self, 0).len())
    }
}

/// The text, made this long by spaces behind its comment: numbers that are filled up with zeros or spaces are not
/// understood by every reader.
pub(crate) fn text(fields: &[Field], facts: &Facts, len: usize) -> String {
    let column =
        |value: fn(&Field) -> String| fields.iter().map(value).collect::<Vec<_>>().join(" ");
    let data = match facts.encoding {
        Encoding::Ascii => "ascii",
        Encoding::Binary => "binary",
        Encoding::BinaryCompressed => "binary_compressed",
    };
    let mut body = String::new();
    let DVec3 { x, y, z } = facts.viewpoint;
    let turn = facts.orientation;
    // Writing to a string cannot fail.
    let _written = write!(
        body,
        "\nVERSION 0.7\nFIELDS {}\nSIZE {}\nTYPE {}\nCOUNT {}\nWIDTH {}\nHEIGHT {}\n\
         VIEWPOINT {x} {y} {z} {} {} {} {}\nPOINTS {}\nDATA {data}\n",
        column(|field| field.name.clone()),
        column(|field| field.size.to_string()),
        column(|field| field.letter.to_string()),
        column(|field| field.count.to_string()),
        facts.width,
        facts.height,
        turn.w,
        turn.x,
        turn.y,
        turn.z,
        facts.width.saturating_mul(facts.height),
    );
    let title = "# .PCD v0.7 - Point Cloud Data file format";
    format!("{title:<width$}{body}", width = len.saturating_sub(body.len()))
}
