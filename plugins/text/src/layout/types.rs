//! Types of columns, by their meaning and by what a sample holds.

use super::facts::Facts;
use surfelshop_api::columns::{AO, COLOR, Element, MATERIAL, NORMAL, POSITION, RADIUS};
use surfelshop_api::format::{
    CLASSIFICATION, GPS_TIME, INTENSITY, N_RETURNS, POINT_SOURCE, RETURN_NUMBER, SCAN, SCAN_ANGLE,
};

/// The type of a column that a sample looks like this.
///
/// Whole numbers are taken only where the meaning of a column asks for them: what is unknown may hold a fraction
/// behind the sample, so it is `f32`, or `f64` where more digits are written or numbers are large.
pub(crate) fn element(column: &str, facts: &Facts) -> Element {
    match column {
        POSITION | GPS_TIME => Element::F64,
        COLOR => color(facts),
        NORMAL | RADIUS | AO | SCAN_ANGLE | INTENSITY | "tangent_u" | "tangent_v"
        | "normal_field" | "clip" => Element::F32,
        column if is_whole(column) => whole(column, facts),
        _ => float(facts),
    }
}

/// Whether a column of whole numbers is read as one, by its meaning.
pub(crate) fn is_whole(column: &str) -> bool {
    const WHOLE: [&str; 6] =
        [CLASSIFICATION, RETURN_NUMBER, N_RETURNS, POINT_SOURCE, MATERIAL, SCAN];
    WHOLE.contains(&column)
}

fn float(facts: &Facts) -> Element {
    let is_short =
        facts.short && (!facts.whole || facts.min.abs().max(facts.max.abs()) <= 65_535.0);
    if is_short || facts.n == 0 { Element::F32 } else { Element::F64 }
}

fn whole(column: &str, facts: &Facts) -> Element {
    let smallest = match column {
        POINT_SOURCE => Element::U16,
        MATERIAL | SCAN => Element::U32,
        _ => Element::U8,
    };
    let wider = [smallest, Element::U16, Element::U32, Element::I32];
    let fits = |element: &Element| {
        limits(*element).is_none_or(|[low, high]| facts.min >= low && facts.max <= high)
    };
    match facts.n_missing == 0 && facts.whole {
        true if facts.n == 0 => smallest,
        true => wider.into_iter().find(fits).unwrap_or(Element::F64),
        false => float(facts),
    }
}

/// Colours: whole numbers of 8 or 16 bits, or fractions. Means of such numbers have fractions, too; they are
/// rounded.
fn color(facts: &Facts) -> Element {
    let to = |most: f64| facts.min >= 0.0 && facts.max <= most;
    match facts {
        Facts { n: 0, .. } => Element::U8,
        _ if facts.pointed && to(1.0) => Element::F32,
        _ if !facts.whole && to(16.0) => Element::F32,
        _ if to(255.0) => Element::U8,
        _ if to(65_535.0) => Element::U16,
        _ => Element::F32,
    }
}

/// Smallest and largest whole number of a type; `None` for types that hold fractions.
pub(crate) fn limits(element: Element) -> Option<[f64; 2]> {
    let of = |low: f64, high: f64| Some([low, high]);
    match element {
        Element::I8 => of(f64::from(i8::MIN), f64::from(i8::MAX)),
        Element::U8 => of(0.0, f64::from(u8::MAX)),
        Element::I16 => of(f64::from(i16::MIN), f64::from(i16::MAX)),
        Element::U16 => of(0.0, f64::from(u16::MAX)),
        Element::I32 => of(f64::from(i32::MIN), f64::from(i32::MAX)),
        Element::U32 => of(0.0, f64::from(u32::MAX)),
        Element::F32 | Element::F64 => None,
    }
}

/// The names of all types, for people.
pub(crate) fn type_names() -> String {
    let names = (0..8).filter_map(Element::from_code).map(Element::name);
    names.collect::<Vec<_>>().join(", ")
}

/// The type of a name such as `u16`.
pub(crate) fn named(name: &str) -> Option<Element> {
    (0..8).filter_map(Element::from_code).find(|element| element.name() == name)
}
