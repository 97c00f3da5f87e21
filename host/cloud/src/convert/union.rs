//! One header for several clouds.

use super::select::{CropBox, Selection};
use glam::DVec3;
use surfelshop_api::columns::{Element, POSITION};
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
                if known.element != column.element {
                    known.element = Element::F64;
                }
                known.components = known.components.max(column.components);
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
    let same = |value: fn(&CloudHeader) -> f64| {
        let first = value(&first);
        if headers.iter().all(|header| value(header).to_bits() == first.to_bits()) {
            first
        } else {
            0.0
        }
    };
    let scanner = match headers {
        [only] => only.scanner.map(|place| only.pose.place(place)),
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
        metres_per_unit: same(|header| header.metres_per_unit),
        coordinate_system: text(|header| &header.coordinate_system),
        time: text(|header| &header.time),
        has_faces: headers.iter().any(|header| header.has_faces) && !selection.thins(),
        comments,
        ..CloudHeader::default()
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
