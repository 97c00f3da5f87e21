//! Columns of a new cloud from rows of others.

use crate::ply::{PlyFile, property_name};
use surfelshop_api::columns::{COLOR, Element, NEUTRAL_ALBEDO, Values};
use surfelshop_api::params::{linear_to_srgb, srgb_to_linear};
use surfelshop_api::prelude::*;
use surfelshop_api::tool::NewColumn;

/// Values of a new column.
#[derive(Clone, Debug)]
pub(crate) enum Column {
    I8(Vec<i8>),
    U8(Vec<u8>),
    I16(Vec<i16>),
    U16(Vec<u16>),
    I32(Vec<i32>),
    U32(Vec<u32>),
    F32(Vec<f32>),
    F64(Vec<f64>),
}

macro_rules! each_type {
    ($call:ident) => {
        $call!(I8, U8, I16, U16, I32, U32, F32, F64)
    };
}

impl Column {
    /// These rows of a column.
    pub(crate) fn rows(column: &ColumnView<'_>, rows: &[usize]) -> Self {
        let n = column.components as usize;
        macro_rules! chosen {
            ($($variant:ident),*) => {
                match column.values {
                    $(Values::$variant(values) => Self::$variant(
                        rows.iter().flat_map(|&i| values[n * i..n * (i + 1)].iter().copied()).collect(),
                    ),)*
                }
            };
        }
        each_type!(chosen)
    }

    /// Adds numbers, rounded to what the type can hold.
    pub(crate) fn extend(&mut self, numbers: impl Iterator<Item = f64>) {
        macro_rules! whole {
            ($($variant:ident: $type:ty),*) => {
                match self {
                    Self::F32(values) => values.extend(numbers.map(|number| number as f32)),
                    Self::F64(values) => values.extend(numbers),
                    // The casts end at the type's limits.
                    $(Self::$variant(values) => {
                        values.extend(numbers.map(|number| number.round() as $type));
                    })*
                }
            };
        }
        whole!(I8: i8, U8: u8, I16: i16, U16: u16, I32: i32, U32: u32);
    }

    /// The column of this name.
    pub(crate) fn named<'a>(&'a self, name: &'a str, components: u32) -> NewColumn<'a> {
        macro_rules! values {
            ($($variant:ident),*) => {
                match self { $(Self::$variant(values) => Values::$variant(values),)* }
            };
        }
        NewColumn { name, components, values: each_type!(values) }
    }
}

/// Colour codes of a type in linear light; alpha, the fourth, is no light.
pub(crate) fn to_linear(element: Element, component: usize, code: f64) -> f64 {
    let share = match element {
        Element::U8 => code / 255.0,
        Element::U16 => code / 65535.0,
        _ => return code,
    };
    if component == 3 { share } else { f64::from(srgb_to_linear(share as f32)) }
}

/// Linear light as a colour code of a type.
pub(crate) fn from_linear(element: Element, component: usize, light: f64) -> f64 {
    let most = match element {
        Element::U8 => 255.0,
        Element::U16 => 65535.0,
        _ => return light,
    };
    let light = light.clamp(0.0, 1.0);
    most * if component == 3 { light } else { f64::from(linear_to_srgb(light as f32)) }
}

/// These rows of a file's vertices as values of a column of another cloud, component by component
/// of each; where the file has none such, colours are grey and all else is 0. The second is whether
/// the file has them.
pub(crate) fn rows_of_file(
    file: &PlyFile,
    column: &ColumnView<'_>,
    rows: &[usize],
) -> (Vec<f64>, bool) {
    let components = column.components as usize;
    let element = column.values.element();
    let is_color = column.name == COLOR;
    let mut numbers = vec![0.0; rows.len() * components];
    let mut is_there = true;
    for component in 0..components {
        let name = property_name(column.name, components, component);
        let found = file.values(&name).zip(file.element(&name));
        is_there &= found.is_some() || is_color && component == 3;
        for (row, &i) in rows.iter().enumerate() {
            numbers[components * row + component] = match &found {
                Some((values, other)) if is_color && *other != element => {
                    from_linear(element, component, to_linear(*other, component, values[i]))
                }
                Some((values, _)) => values[i],
                None if is_color => {
                    let light = if component == 3 { 1.0 } else { f64::from(NEUTRAL_ALBEDO[0]) };
                    from_linear(element, component, light)
                }
                None => 0.0,
            };
        }
    }
    (numbers, is_there)
}
