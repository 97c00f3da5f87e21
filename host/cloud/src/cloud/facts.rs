//! Facts of a cloud as a whole: bounds, columns, equal radii and colours.

use crate::cloud::Cloud;
use crate::cloud::buffer::with_vec;
use crate::cloud::column::Column;
use glam::DVec3;
use surfelshop_api::columns::COLOR;
use surfelshop_api::columns::NEUTRAL_ALBEDO;
use surfelshop_api::{CloudFacts, CloudInfo, ColumnInfo, ObjectFrame};
use surfelshop_geometry::Bounds;

/// What can be said of a cloud as a whole.
pub(crate) fn of(cloud: &Cloud) -> CloudFacts {
    let bounds = Bounds::of_positions(cloud.positions());
    let corner = |corner: fn(&Bounds) -> DVec3| {
        bounds.as_ref().map_or(DVec3::ZERO, |bounds| cloud.origin() + corner(bounds))
    };
    let (bounds_min, bounds_max) = (corner(|bounds| bounds.min), corner(|bounds| bounds.max));
    let object = cloud.moved_object().unwrap_or_else(|| {
        let largest = cloud.radii().iter().copied().fold(0.0, f32::max);
        ObjectFrame::around(bounds_min, bounds_max, 2.0 * f64::from(largest))
    });
    let mut columns: Vec<String> = cloud.columns().iter().map(|c| c.name().to_owned()).collect();
    columns.sort_unstable();
    CloudFacts {
        n_surfels: cloud.len() as u64,
        bounds_min,
        bounds_max,
        columns,
        equal_radius: equal_radius(cloud.radii()),
        equal_color: equal_color(cloud),
        objects: vec![object],
        colored: vec![cloud.column(COLOR).is_some()],
        clouds: vec![info(cloud)],
    }
}

/// The columns of a cloud without their values.
fn info(cloud: &Cloud) -> CloudInfo {
    let column = |column: &Column| ColumnInfo {
        name: column.name().to_owned(),
        components: column.components(),
        element: column.values().element(),
        role: column.role(),
    };
    let columns = cloud.columns().iter().map(column).collect();
    CloudInfo { name: String::new(), n_surfels: cloud.len() as u64, columns }
}

/// Facts of a cloud whose colours changed, and nothing else.
pub(super) fn recolored(facts: &CloudFacts, cloud: &Cloud) -> CloudFacts {
    let mut facts = facts.clone();
    if let Err(place) = facts.columns.binary_search_by(|column| column.as_str().cmp(COLOR)) {
        facts.columns.insert(place, COLOR.to_owned());
    }
    facts.equal_color = equal_color(cloud);
    facts.colored = vec![true];
    facts.clouds = vec![info(cloud)];
    facts
}

/// The radius all surfels share, compared bit by bit.
fn equal_radius(radii: &[f32]) -> Option<f32> {
    let first = *radii.first()?;
    radii.iter().all(|radius| radius.to_bits() == first.to_bits()).then_some(first)
}

/// The colour all surfels share; opacity does not count.
fn equal_color(cloud: &Cloud) -> Option<[f32; 3]> {
    if cloud.is_empty() {
        return None;
    }
    let Some(column) = cloud.column(COLOR) else { return Some(NEUTRAL_ALBEDO) };
    let components = column.components() as usize;
    let equal = with_vec!(column.values(), vec => {
        vec.chunks_exact(components).all(|color| color[..3] == vec[..3])
    });
    if equal { cloud.color_linear(0) } else { None }
}
