//! One header for several clouds.

use super::select::{CropBox, Selection};
use glam::DVec3;
use surfelshop_api::columns::{COLOR, Element, POSITION, Role};
use surfelshop_api::format::{CloudHeader, FileColumn, SCAN, UpAxis};
use surfelshop_geometry::Bounds;

/// The header of all clouds as one in common coordinates: every column that one of them has, in a type that
/// holds the values of all.
pub(super) fn header(headers: &[CloudHeader], selection: &Selection) -> CloudHeader {
    let mut columns: Vec<FileColumn> = Vec::new();
    for column in headers.iter().flat_map(|header| &header.columns) {
        if !selection.keeps(&column.name) || (headers.len() > 1 && column.name == SCAN) {
            continue;
        }
        match columns.iter_mut().find(|known| known.name == column.name) {
            None => columns.push(column.clone()),
            Some(known) => {
                known.element = common(&known.name, known.element, column.element);
                known.components = known.components.max(column.components);
                if known.role != column.role {
                    known.role = Role::Plain;
                }
            }
        }
    }
    let moved = headers.iter().any(|header| header.pose != Default::default());
    for column in columns.iter_mut().filter(|column| column.name == POSITION && moved) {
        column.element = Element::F64;
    }
    if headers.len() > 1 && selection.keeps(SCAN) {
        columns.push(FileColumn::new(SCAN, 1, Element::U16));
    }
    let first = headers.first().cloned().unwrap_or_default();
    let text = |text: fn(&CloudHeader) -> &String| {
        headers.iter().map(text).find(|text| !text.is_empty()).cloned().unwrap_or_default()
    };
    let scanner = match headers {
        [only] => only.scanner.map(|place| only.pose.place(place)),
        _ => None,
    };
    let grid = match headers {
        [only] => only.grid.filter(|_| !selection.thins()),
        _ => None,
    };
    let mut comments: Vec<String> =
        headers.iter().flat_map(|header| header.comments.iter().cloned()).collect();
    comments.dedup();
    CloudHeader {
        format: first.format.clone(),
        name: first.name.clone(),
        rows: None,
        columns,
        bounds: bounds(headers, selection.crop),
        step: headers.iter().filter_map(|header| header.step).reduce(DVec3::min),
        scanner,
        up: headers
            .iter()
            .map(|header| header.up)
            .find(|&up| up != UpAxis::Unknown)
            .unwrap_or_default(),
        // Clouds of different units were refused.
        metres_per_unit: headers.iter().map(|header| header.metres_per_unit).fold(0.0, f64::max),
        grid,
        coordinate_system: text(|header| &header.coordinate_system),
        time: text(|header| &header.time),
        has_faces: headers.iter().any(|header| header.has_faces) && !selection.thins(),
        comments,
        ..CloudHeader::default()
    }
}

/// The type that holds the values of both. Of colours it holds what they mean: see `target`.
fn common(name: &str, a: Element, b: Element) -> Element {
    let is_float = |element| matches!(element, Element::F32 | Element::F64);
    if a == b {
        return a;
    }
    if name == COLOR {
        let both = [a, b];
        let are_codes = both.iter().all(|element| matches!(element, Element::U8 | Element::U16));
        return if are_codes { Element::U16 } else { Element::F32 };
    }
    if is_float(a) || is_float(b) {
        return Element::F64;
    }
    let is_signed = |element| matches!(element, Element::I8 | Element::I16 | Element::I32);
    match (is_signed(a), is_signed(b), a.size().max(b.size())) {
        (true, true, 2) => Element::I16,
        (true, true, _) => Element::I32,
        (false, false, 2) => Element::U16,
        (false, false, _) => Element::U32,
        // A signed type twice as wide holds an unsigned one.
        _ => match [(a, is_signed(a)), (b, is_signed(b))]
            .map(|(e, s)| if s { e.size() } else { 2 * e.size() })
        {
            [x, y] if x.max(y) <= 2 => Element::I16,
            [x, y] if x.max(y) <= 4 => Element::I32,
            _ => Element::F64,
        },
    }
}

/// The box of what is written, as far as headers say; points may lie in a smaller one.
pub(super) fn bounds(headers: &[CloudHeader], crop: Option<CropBox>) -> Option<[DVec3; 2]> {
    let mut corners = Vec::new();
    for header in headers {
        let [low, high] = header.bounds?;
        corners.extend((0..8).map(|i| {
            let pick = |axis: usize| if i >> axis & 1 == 0 { low[axis] } else { high[axis] };
            header.pose.place(DVec3::new(pick(0), pick(1), pick(2)))
        }));
    }
    let Bounds { min, max } = Bounds::of(corners)?;
    Some(match crop {
        Some([low, high]) => [min.max(low), max.min(high)],
        None => [min, max],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_common_type_holds_what_both_mean() {
        use Element::{F32, F64, I8, I16, I32, U8, U16, U32};
        for (a, b, expected) in [
            (U8, U16, U16),
            (U8, U32, U32),
            (I8, I16, I16),
            (I8, U8, I16),
            (I16, U8, I16),
            (I8, U16, I32),
            (I32, U32, F64),
            (F32, U8, F64),
            (F32, F64, F64),
        ] {
            assert_eq!(common("class", a, b), expected, "{a:?} {b:?}");
            assert_eq!(common("class", b, a), expected, "{b:?} {a:?}");
        }
        assert_eq!((common(COLOR, U8, U16), common(COLOR, F64, U8)), (U16, F32));
    }
}
