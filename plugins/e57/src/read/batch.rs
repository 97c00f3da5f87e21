//! Points decoded into columns.

use crate::element::{Buffer, Number, with_values};
use crate::read::layout::{Column, Conversion, Layout};
use crate::read::streams::Streams;
use surfelshop_api::columns::Values;

/// What was left out or replaced.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Tally {
    /// Points without a position.
    pub(crate) n_invalid: u64,
    /// Those of them that have a direction.
    pub(crate) n_directions: u64,
    /// Colours that are invalid.
    pub(crate) n_colors: u64,
    /// Other values that are invalid.
    pub(crate) n_values: u64,
    /// Whole numbers that the column's type does not hold.
    pub(crate) n_clamped: u64,
}

impl Tally {
    pub(crate) fn add(&mut self, other: Self) {
        self.n_invalid += other.n_invalid;
        self.n_directions += other.n_directions;
        self.n_colors += other.n_colors;
        self.n_values += other.n_values;
        self.n_clamped += other.n_clamped;
    }

    /// Lines for people.
    pub(crate) fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        if self.n_invalid > 0 {
            let directions = match self.n_directions {
                0 => String::new(),
                n => format!(", {n} of them with a direction alone"),
            };
            lines.push(format!(
                "{} points that the file marks as invalid are left out{directions}",
                self.n_invalid
            ));
        }
        if self.n_colors > 0 {
            lines.push(format!(
                "{} colours that the file marks as invalid are neutral grey",
                self.n_colors
            ));
        }
        if self.n_values > 0 {
            lines.push(format!(
                "{} values (intensity, time_stamp) that the file marks as invalid are 0",
                self.n_values
            ));
        }
        if self.n_clamped > 0 {
            lines.push(format!(
                "{} whole numbers lie outside the range of their column and are at its end",
                self.n_clamped
            ));
        }
        lines
    }
}

/// Points of a scan, without those that are invalid.
pub(crate) struct Batch {
    columns: Vec<Buffer>,
    pub(crate) tally: Tally,
}

impl Batch {
    /// No points.
    pub(crate) fn new(layout: &Layout) -> Self {
        let columns = layout.file_columns();
        let columns = columns.iter().map(|column| Buffer::zeros(column.element, 0)).collect();
        Self { columns, tally: Tally::default() }
    }

    /// Becomes the points from `first` on, `n` of them, all of which are there. Memory is used again.
    pub(crate) fn decode(&mut self, layout: &Layout, streams: &Streams, first: usize, n: usize) {
        let span = Span { layout, streams, first, n };
        self.tally = Tally::default();
        let Some((position, others)) = self.columns.split_first_mut() else { return };
        let keep = span.positions(position, &mut self.tally);
        for (buffer, column) in others.iter_mut().zip(&layout.columns) {
            span.column(column, buffer, &keep, &mut self.tally);
        }
        if self.tally.n_invalid > 0 {
            position.retain(3, &keep);
            for (buffer, column) in others.iter_mut().zip(&layout.columns) {
                buffer.retain(column.fields.len(), &keep);
            }
        }
    }

    /// The values as the host takes them.
    pub(crate) fn values(&self) -> Vec<Values<'_>> {
        self.columns.iter().map(Buffer::values).collect()
    }

    /// Whether no point is left.
    pub(crate) fn is_empty(&self) -> bool {
        self.columns.first().is_none_or(|position| position.values().is_empty())
    }
}

/// Points among those that were read.
struct Span<'a> {
    layout: &'a Layout,
    streams: &'a Streams,
    first: usize,
    n: usize,
}

impl Span<'_> {
    fn floats(&self, field: usize, put: impl FnMut(usize, f64)) {
        let (bytes, bit) = self.streams.at(field, self.first);
        self.layout.fields[field].floats(bytes, bit, self.n, put);
    }

    fn whole(&self, field: usize, put: impl FnMut(usize, i64)) {
        let (bytes, bit) = self.streams.at(field, self.first);
        self.layout.fields[field].whole(bytes, bit, self.n, put);
    }

    /// Calls `put` with the places where a field is not 0, and its value.
    fn marked(&self, field: Option<usize>, mut put: impl FnMut(usize, i64)) {
        if let Some(field) = field {
            self.whole(field, |i, value| {
                if value != 0 {
                    put(i, value);
                }
            });
        }
    }

    /// Positions of all points, and which of them are valid; none are named where all are.
    fn positions(&self, xyz: &mut Buffer, tally: &mut Tally) -> Vec<bool> {
        let places = &self.layout.places;
        // 0 where there is a position, 1 where there is a direction.
        let mut states = Vec::new();
        xyz.resize(3 * self.n);
        if let Some(cartesian) = places.cartesian {
            with_values!(&mut *xyz, values => self.components(&cartesian, values));
            states = self.states(places.cartesian_state);
        }
        if let (Some(spherical), Buffer::F64(xyz)) = (places.spherical, &mut *xyz) {
            let replaced = places.cartesian.map(|_| states.as_slice());
            // Most batches of scans that have both are valid in the first.
            if replaced.is_none_or(|states| !states.is_empty()) {
                self.spherical(spherical, replaced, xyz);
                let others = self.states(places.spherical_state);
                states = merged(places.cartesian.is_some(), &states, &others);
            }
        }
        let keep: Vec<bool> = states.iter().map(|&state| state == 0).collect();
        tally.n_invalid += keep.iter().filter(|keep| !**keep).count() as u64;
        tally.n_directions += states.iter().filter(|&&state| state == 1).count() as u64;
        keep
    }

    /// The state of each point; empty where all are valid.
    fn states(&self, field: Option<usize>) -> Vec<u8> {
        let mut states = Vec::new();
        self.marked(field, |i, state| {
            if states.is_empty() {
                states = vec![0; self.n];
            }
            states[i] = if state == 1 { 1 } else { 2 };
        });
        states
    }

    /// The components of a column, one behind the other.
    fn components<T: Number>(&self, fields: &[usize], values: &mut [T]) {
        for (component, &field) in fields.iter().enumerate() {
            self.floats(field, |i, value| {
                values[fields.len() * i + component] = T::of_float(value)
            });
        }
    }

    /// Positions of range, azimuth and elevation, for the points with another state than 0, or all.
    fn spherical(&self, fields: [usize; 3], states: Option<&[u8]>, xyz: &mut [f64]) {
        let mut polar = vec![0.0f64; 3 * self.n];
        self.components(&fields, &mut polar);
        for (i, (xyz, polar)) in xyz.chunks_exact_mut(3).zip(polar.chunks_exact(3)).enumerate() {
            if states.is_none_or(|states| states[i] != 0) {
                let ((sin_a, cos_a), (sin_e, cos_e)) = (polar[1].sin_cos(), polar[2].sin_cos());
                let across = polar[0] * cos_e;
                xyz.copy_from_slice(&[across * cos_a, across * sin_a, polar[0] * sin_e]);
            }
        }
    }

    fn column(&self, column: &Column, buffer: &mut Buffer, keep: &[bool], tally: &mut Tally) {
        buffer.resize(column.fields.len() * self.n);
        with_values!(&mut *buffer, values => self.fill(column, values, tally));
        let is_kept = |i: usize| keep.is_empty() || keep[i];
        let width = column.fields.len();
        if let Conversion::Color(scale) = column.conversion {
            let grey = scale.neutral();
            with_values!(&mut *buffer, values => self.marked(column.invalid, |i, _| {
                tally.n_colors += u64::from(is_kept(i));
                values[width * i..width * (i + 1)].fill(Number::of_whole(grey).0);
            }));
        } else {
            with_values!(&mut *buffer, values => self.marked(column.invalid, |i, _| {
                tally.n_values += u64::from(is_kept(i));
                values[width * i..width * (i + 1)].fill(Number::of_whole(0).0);
            }));
        }
    }

    fn fill<T: Number>(&self, column: &Column, values: &mut [T], tally: &mut Tally) {
        let width = column.fields.len();
        let mut n_clamped = 0;
        for (component, &field) in column.fields.iter().enumerate() {
            let whole = self.layout.fields[field].is_whole();
            let mut exact = |i: usize, value: i64| {
                let (value, fits) = T::of_whole(value);
                values[width * i + component] = value;
                n_clamped += u64::from(!fits);
            };
            match column.conversion {
                Conversion::Color(scale) if !(whole && scale.is_identity()) => {
                    self.floats(field, |i, value| {
                        let value = (value - scale.min) * scale.factor;
                        values[width * i + component] = T::of_float(value);
                    });
                }
                Conversion::CountedFromOne => {
                    self.whole(field, |i, value| exact(i, value.saturating_add(1)));
                }
                _ if whole => self.whole(field, exact),
                _ => self.floats(field, |i, value| {
                    values[width * i + component] = T::of_float(value);
                }),
            }
        }
        tally.n_clamped += n_clamped;
    }
}

/// States of points that may have a position in either of two ways.
fn merged(has_cartesian: bool, cartesian: &[u8], spherical: &[u8]) -> Vec<u8> {
    if !has_cartesian {
        return spherical.to_vec();
    }
    if spherical.is_empty() {
        return Vec::new();
    }
    cartesian.iter().zip(spherical).map(|(&a, &b)| a.min(b)).collect()
}
