//! Gaussian splats as trainers write them, so that other viewers read the files: logits and logarithms, the names
//! `f_dc_*`, `f_rest_*`, `opacity`, `scale_*` and `rot_*`, and floats of single precision.
//!
//! What follows from splats is left out: colours, radii and tangents. Other columns come behind.

use super::properties::{binary_value, property_name, text_value};
use crate::cloud::Cloud;
use crate::cloud::splats::{is_flipped, n_rest, rest_index, splat_kind};
use glam::DVec3;
use std::io::{self, Write as _};
use surfelshop_api::CloudView;
use surfelshop_api::columns::{
    COLOR, Element, NORMAL, OPACITY, POSITION, RADIUS, SH, SPLAT_ROTATION, SPLAT_SCALE, TANGENT_U,
    TANGENT_V, Values,
};
use surfelshop_api::format::{CloudHeader, FileColumn};
use surfelshop_geometry::Bounds;

/// Columns that follow from splats and the direction of their shortest axes.
const DERIVED: [&str; 4] = [COLOR, RADIUS, TANGENT_U, TANGENT_V];

/// Logarithm of a length of 0, and logit of an opacity of 0: their exponentials round to 0 in single precision.
const OF_ZERO: f64 = -104.0;

/// The largest opacity that has a logit: a full one becomes this, the number below 1 in single precision.
const LARGEST_OPACITY: f64 = 1.0 - 5.960_464_477_539_063e-8;

/// Distance from zero, in extents of the cloud, beyond which coordinates are written in double precision.
const FAR: f64 = 256.0;

/// One property of the file.
struct Property {
    name: String,
    element: Element,
    source: Source,
}

/// Where a property's values come from.
#[derive(Clone, Copy)]
enum Source {
    /// A coordinate of the world.
    Position { column: usize, axis: usize },
    /// A component of a column, as it is written.
    Component { column: usize, component: usize, form: Form },
    /// What is in no column.
    Zero,
}

/// How values are written.
#[derive(Clone, Copy)]
enum Form {
    /// In the column's own type.
    Own,
    /// In single precision.
    Single,
    Negative,
    Logit,
    Logarithm,
}

/// The records of a cloud of splats.
pub(super) struct SplatRecords {
    properties: Vec<Property>,
    /// Whether coordinates are written in double precision.
    pub(super) are_wide: bool,
    /// Columns that are no part of splats, as numbers among those of the cloud.
    others: Vec<usize>,
}

impl SplatRecords {
    /// The records of a cloud; `None` where it has not all the columns of splats with harmonics.
    pub(super) fn of_cloud(cloud: &Cloud) -> Option<Self> {
        let column = |column: &crate::Column| {
            FileColumn::new(column.name(), column.components(), column.values().element())
        };
        let columns: Vec<FileColumn> = cloud.columns().iter().map(column).collect();
        let are_wide = || {
            let facts = cloud.facts();
            cloud.origin() != DVec3::ZERO && is_far([facts.bounds_min, facts.bounds_max])
        };
        Self::of(&columns, are_wide)
    }

    /// The records of a cloud that is handed over in batches.
    pub(super) fn of_header(header: &CloudHeader) -> Option<Self> {
        let (_, position) = header.column(POSITION)?;
        let is_far = || header.bounds.is_none_or(is_far);
        Self::of(&header.columns, || position.element == Element::F64 && is_far())
    }

    fn of(columns: &[FileColumn], are_wide: impl Fn() -> bool) -> Option<Self> {
        let place = |name: &str| columns.iter().position(|column| column.name == name);
        let kind = splat_kind(|name| {
            let column = &columns[place(name)?];
            Some((column.element, column.components))
        })?;
        let highest = usize::from(kind.order?);
        let position = place(POSITION)?;
        let are_wide = are_wide();
        let mut properties = Vec::new();
        let mut add = |name: String, element, source| {
            properties.push(Property { name, element, source });
        };
        let element = if are_wide { Element::F64 } else { Element::F32 };
        for axis in 0..3 {
            let name = property_name(POSITION, 3, axis);
            add(name, element, Source::Position { column: position, axis });
        }
        let own = |name: &str, component: usize, form: Form| {
            place(name).map_or(Source::Zero, |column| Source::Component { column, component, form })
        };
        for axis in 0..3 {
            add(property_name(NORMAL, 3, axis), Element::F32, own(NORMAL, axis, Form::Single));
        }
        for channel in 0..3 {
            add(format!("f_dc_{channel}"), Element::F32, own(SH[0], channel, Form::Own));
        }
        for (i, (order, component, form)) in rest(highest).into_iter().enumerate() {
            add(format!("f_rest_{i}"), Element::F32, own(SH[order], component, form));
        }
        add(OPACITY.to_owned(), Element::F32, own(OPACITY, 0, Form::Logit));
        for axis in 0..usize::from(kind.dimensions) {
            add(format!("scale_{axis}"), Element::F32, own(SPLAT_SCALE, axis, Form::Logarithm));
        }
        for (i, component) in [3, 0, 1, 2].into_iter().enumerate() {
            add(format!("rot_{i}"), Element::F32, own(SPLAT_ROTATION, component, Form::Own));
        }
        let are_splats = |name: &str| {
            [POSITION, NORMAL, OPACITY, SPLAT_SCALE, SPLAT_ROTATION].contains(&name)
                || SH.iter().take(highest + 1).any(|known| *known == name)
        };
        let is_other = |name: &str| !are_splats(name) && !DERIVED.contains(&name);
        let others = (0..columns.len()).filter(|&i| is_other(&columns[i].name));
        let others: Vec<usize> = others.collect();
        // Flat splats would be read as others.
        if kind.dimensions == 2 && others.iter().any(|&other| columns[other].name == "scale_2") {
            return None;
        }
        for &column in &others {
            let FileColumn { name, components, element, .. } = &columns[column];
            let n = *components as usize;
            for component in 0..n {
                let source = Source::Component { column, component, form: Form::Own };
                add(property_name(name, n, component), *element, source);
            }
        }
        Some(Self { properties, are_wide, others })
    }

    /// Names and types of the properties.
    pub(super) fn properties(&self) -> impl Iterator<Item = (&str, Element)> {
        self.properties.iter().map(|property| (property.name.as_str(), property.element))
    }

    /// Whether a column is no part of splats, and is written behind them.
    pub(super) fn is_other(&self, column: usize) -> bool {
        self.others.contains(&column)
    }

    /// Whether a column of this name follows from splats and is left out.
    pub(super) fn is_derived(name: &str) -> bool {
        name == NORMAL || DERIVED.contains(&name)
    }

    /// Appends a splat.
    pub(super) fn append(
        &self,
        block: &mut Vec<u8>,
        view: &CloudView<'_>,
        row: usize,
        ascii: bool,
    ) -> io::Result<()> {
        for (i, property) in self.properties.iter().enumerate() {
            if ascii && i > 0 {
                block.push(b' ');
            }
            let number = match property.source {
                Source::Zero => 0.0,
                Source::Position { column, axis } => {
                    view.origin[axis] + number(view, column, 3 * row + axis)
                }
                Source::Component { column, component, form } => {
                    let Some(found) = view.columns.get(column) else { continue };
                    let index = row * found.components as usize + component;
                    match form {
                        Form::Own if ascii => {
                            text_value(block, &found.values, index)?;
                            continue;
                        }
                        Form::Own => {
                            binary_value(block, &found.values, index);
                            continue;
                        }
                        Form::Single => number(view, column, index),
                        Form::Negative => -number(view, column, index),
                        Form::Logit => logit(number(view, column, index)),
                        Form::Logarithm => logarithm(number(view, column, index)),
                    }
                }
            };
            match (property.element, ascii) {
                (Element::F64, true) => write!(block, "{number}")?,
                (_, true) => write!(block, "{}", number as f32)?,
                (Element::F64, false) => block.extend_from_slice(&number.to_le_bytes()),
                (_, false) => block.extend_from_slice(&(number as f32).to_le_bytes()),
            }
        }
        if ascii {
            block.push(b'\n');
        }
        Ok(())
    }
}

/// For each property `f_rest_*` up to an order: the order, the component of its column, and the sign.
fn rest(highest: usize) -> Vec<(usize, usize, Form)> {
    let n = n_rest(highest);
    let mut found = vec![(0, 0, Form::Own); n];
    for order in 1..=highest {
        for k in 0..=2 * order {
            let form = if is_flipped(order, k) { Form::Negative } else { Form::Own };
            for channel in 0..3 {
                found[rest_index(n, order, k, channel)] = (order, 3 * k + channel, form);
            }
        }
    }
    found
}

fn number(view: &CloudView<'_>, column: usize, index: usize) -> f64 {
    match view.columns.get(column).map(|column| column.values) {
        Some(Values::F32(values)) => values.get(index).map_or(0.0, |&value| f64::from(value)),
        Some(Values::F64(values)) => values.get(index).copied().unwrap_or_default(),
        _ => 0.0,
    }
}

fn logit(opacity: f64) -> f64 {
    let opacity = opacity.min(LARGEST_OPACITY);
    // That of a tiny number is far enough below; a negative one counts as 0.
    if opacity > 0.0 { (opacity / (1.0 - opacity)).ln().max(OF_ZERO) } else { OF_ZERO }
}

fn logarithm(length: f64) -> f64 {
    if length > 0.0 { length.ln().max(OF_ZERO) } else { OF_ZERO }
}

/// Whether single precision rounds coordinates in a box so that it shows.
fn is_far([min, max]: [DVec3; 2]) -> bool {
    let bounds = Bounds { min, max };
    bounds.reach() > FAR * bounds.extent()
}
