//! What a file cannot hold, in lines for people.

use std::collections::{BTreeMap, BTreeSet};
use surfelshop_api::format::{CloudHeader, HeaderSupport, UpAxis, UpSupport};
use surfelshop_api::glam::DVec3;

/// Most origins that are named each.
const MAX_ORIGINS: usize = 4;

/// What was left out or rounded so far.
#[derive(Debug, Default)]
pub(super) struct Report {
    left_out: BTreeMap<String, &'static str>,
    rounded: BTreeMap<&'static str, &'static str>,
    others: BTreeSet<String>,
    origins: Vec<(String, DVec3)>,
    /// Largest difference of a coordinate.
    position_error: f64,
    /// Largest distance between unit normals.
    normal_error: f64,
}

impl Report {
    /// A column that is left out, and why.
    pub(super) fn left_out(&mut self, column: &str, why: &'static str) {
        self.left_out.insert(column.to_owned(), why);
    }

    /// A column whose values were rounded, and what to.
    pub(super) fn rounded(&mut self, column: &'static str, to: &'static str) {
        self.rounded.insert(column, to);
    }

    /// Something else.
    pub(super) fn says(&mut self, line: &str) {
        self.others.insert(line.to_owned());
    }

    /// A coordinate that is stored so far from what it was.
    pub(super) fn position_error(&mut self, error: f64) {
        self.position_error = self.position_error.max(error);
    }

    /// A normal that is stored so far from what it was.
    pub(super) fn normal_error(&mut self, error: f64) {
        self.normal_error = self.normal_error.max(error);
    }

    /// A set whose positions are relative to an origin.
    pub(super) fn origin(&mut self, set: &str, origin: DVec3) {
        self.origins.push((set.to_owned(), origin));
    }

    /// What surfel sets cannot hold of a header; `up` is the axis that the file says points up.
    pub(super) fn header(&mut self, header: &CloudHeader, up: UpAxis) {
        if header.up != up && header.up != UpAxis::Unknown {
            self.says("clouds differ in which axis points up: the file says that of the first one");
        }
        if header.up == UpAxis::Unknown {
            self.says("a cloud does not say which axis points up: the file says y");
        }
        // Of comments it is said where they are written.
        let held =
            HeaderSupport { up: UpSupport::Said, name: true, unit: true, ..Default::default() };
        let held = HeaderSupport { time: true, comments: true, ..held };
        self.others.extend(header.left_out("SFL", held));
    }

    /// All of it.
    pub(super) fn lines(self) -> Vec<String> {
        let mut by_reason: BTreeMap<&str, Vec<String>> = BTreeMap::new();
        for (column, why) in &self.left_out {
            by_reason.entry(why).or_default().push(format!("`{column}`"));
        }
        let left_out = |(why, columns): (&str, Vec<String>)| match columns.as_slice() {
            [one] => format!("column {one} is left out: {why}"),
            several => format!("columns {} are left out: {why}", several.join(", ")),
        };
        let mut lines: Vec<String> = by_reason.into_iter().map(left_out).collect();
        let rounded = self.rounded.iter();
        lines.extend(rounded.map(|(column, to)| format!("`{column}` is rounded to {to}")));
        for (set, origin) in self.origins.iter().take(MAX_ORIGINS) {
            let DVec3 { x, y, z } = origin;
            lines.push(format!(
                "positions of `{set}` are stored relative to ({x}, {y}, {z}), which the transform of its surfel set adds"
            ));
        }
        if let Some(more) = self.origins.len().checked_sub(MAX_ORIGINS).filter(|&more| more > 0) {
            lines.push(format!(
                "positions of {more} other surfel sets are stored relative to origins of their own"
            ));
        }
        if self.position_error > 0.0 {
            let error = self.position_error;
            lines.push(format!("positions are rounded to 32-bit floats, by at most {error:.1e}"));
        }
        // Smaller ones are those of 32-bit floats, not of codes.
        if self.normal_error > 1e-6 {
            let degrees = self.normal_error.to_degrees();
            lines.push(format!(
                "normals are rounded to codes of 32 bits, by at most {degrees:.4} degrees: `normals=float` keeps them"
            ));
        }
        lines.extend(self.others);
        lines
    }
}
