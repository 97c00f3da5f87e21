//! What the columns that drawing reads are made of, and how they stand on the device.

use crate::graph::RenderError;
use half::f16;
use surfelshop_api::columns::{self, CloudView, ColumnView, Values};
use surfelshop_api::params::srgb_to_linear;
use surfelshop_raster::{Geometry, Part};

/// What a variable holds of columns in memory.
pub(crate) fn part_of(variable: &str) -> Part {
    match variable {
        columns::POSITION => Part::Position,
        columns::NORMAL => Part::Normal,
        columns::RADIUS => Part::Radius,
        columns::TANGENT_U => Part::TangentU,
        columns::TANGENT_V => Part::TangentV,
        columns::NORMAL_FIELD => Part::Field,
        columns::CLIP => Part::Clip,
        columns::AO => Part::Ao,
        columns::MATERIAL => Part::Material,
        _ => Part::Color,
    }
}

/// Numbers that a surfel has in a column of floats.
pub(crate) fn components_of(name: &str) -> u32 {
    match name {
        columns::RADIUS | columns::AO => 1,
        columns::NORMAL_FIELD => 4,
        columns::CLIP => 7,
        _ => 3,
    }
}

/// Whether surfels are ellipses.
pub(crate) fn are_ellipses(cloud: &CloudView<'_>) -> bool {
    [columns::TANGENT_U, columns::TANGENT_V].iter().all(|name| cloud.floats(name, 3).is_some())
}

/// Which surfels are round splats, not 0, where a cloud says so and has no ellipses.
pub(crate) fn round_of<'a>(cloud: &CloudView<'a>) -> Option<&'a [u8]> {
    if are_ellipses(cloud) {
        return None;
    }
    let column = cloud.column(columns::ROUND).filter(|column| column.components == 1)?;
    match column.values {
        Values::U8(values) if values.len() == cloud.len => Some(values),
        _ => None,
    }
}

/// The largest radius of a cloud's round splats in perspective, in shares of their distance from the eye and times the
/// scene's factor on radii; infinity where it says that they are as large as they are.
pub(crate) fn round_reach(cloud: &CloudView<'_>) -> f32 {
    columns::round_reach(round_of(cloud).unwrap_or_default())
}

/// The generation of what a column is drawn as: radii say which surfels are round splats, too.
pub(crate) fn drawn_generation(cloud: &CloudView<'_>, column: &ColumnView<'_>) -> u64 {
    let round = cloud.column(columns::ROUND).filter(|_| column.name == columns::RADIUS);
    match round.filter(|_| round_of(cloud).is_some()) {
        // Generations count upwards from 1: what a multiplication by an odd number spreads meets no other.
        Some(round) => {
            column.generation ^ round.generation.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1 << 63
        }
        None => column.generation,
    }
}

/// The normal fields of ellipses, where a cloud has them.
pub(crate) fn fields_of<'a>(cloud: &CloudView<'a>) -> Option<&'a [[f32; 4]]> {
    let values = cloud.floats(columns::NORMAL_FIELD, 4).filter(|_| are_ellipses(cloud))?;
    Some(values.as_chunks().0)
}

/// The lines that cut ellipses, where a cloud has them.
pub(crate) fn clips_of<'a>(cloud: &CloudView<'a>) -> Option<&'a [[f32; 7]]> {
    let values = cloud.floats(columns::CLIP, 7).filter(|_| are_ellipses(cloud))?;
    Some(values.as_chunks().0)
}

/// The field of a surfel as it is drawn: none, zeros, where it is not of finite numbers.
pub(crate) fn field_drawn(field: [f32; 4]) -> [f32; 4] {
    if field.iter().all(|value| value.is_finite()) { field } else { [0.0; 4] }
}

/// Whether lines cut something off: none do that are not of finite numbers.
pub(crate) fn cuts(clip: &[f32; 7]) -> bool {
    clip[6] > 0.5 && clip.iter().all(|value| value.is_finite())
}

/// Lines as they are drawn: zeros where they cut nothing.
pub(crate) fn clip_drawn(clip: [f32; 7]) -> [f32; 7] {
    if cuts(&clip) { clip } else { [0.0; 7] }
}

/// A column of floats that drawing needs.
pub(crate) fn floats_of<'a>(cloud: &CloudView<'a>, name: &str) -> Result<&'a [f32], RenderError> {
    let components = components_of(name);
    cloud.floats(name, components).ok_or_else(|| {
        let what = match cloud.column(name) {
            None => "none".to_owned(),
            Some(c) => format!("{} x {}", c.components, c.values.element().name()),
        };
        RenderError::Cloud(format!(
            "drawing needs a column `{name}` of {components} x f32, found {what}"
        ))
    })
}

/// Where the surfels of a cloud are, how they stand and how large they are.
///
/// # Errors
/// Where a column of these is missing or of another type.
pub(crate) fn geometry_of<'a>(cloud: &CloudView<'a>) -> Result<Geometry<'a>, RenderError> {
    let tangents = [columns::TANGENT_U, columns::TANGENT_V];
    let tangents = match tangents.map(|name| cloud.floats(name, 3)) {
        [Some(u), Some(v)] => Some([u, v]),
        _ => None,
    };
    Ok(Geometry {
        positions: floats_of(cloud, columns::POSITION)?,
        normals: floats_of(cloud, columns::NORMAL)?,
        radii: match tangents {
            Some(_) => &[],
            None => floats_of(cloud, columns::RADIUS)?,
        },
        round: round_of(cloud),
        tangents,
    })
}

/// Whether a column is of a type that colours have.
pub(crate) fn is_color(column: &ColumnView<'_>) -> bool {
    matches!(column.components, 3 | 4)
        && matches!(column.values, Values::U8(_) | Values::U16(_) | Values::F32(_))
}

/// Linear values of all 8-bit sRGB codes, as the surfel shaders read them.
pub(crate) fn linear_of_srgb() -> Vec<u8> {
    let linear = |code: u8| srgb_to_linear(f32::from(code) / 255.0);
    (0..=255).flat_map(|code| linear(code).to_le_bytes()).collect()
}

/// Appends a surfel's colour: four bytes of 8-bit codes as they are, or four half-precision
/// floats, linear red, green, blue and one.
pub(crate) fn encode_color(column: &ColumnView<'_>, i: usize, out: &mut Vec<u8>) {
    let first = column.components as usize * i;
    let halves = match column.values {
        Values::U8(values) => {
            out.extend_from_slice(&values[first..first + 3]);
            out.push(u8::MAX);
            return;
        }
        Values::U16(values) => {
            [0, 1, 2].map(|c| srgb_to_linear(f32::from(values[first + c]) / 65535.0))
        }
        // Finite in half precision, so that no infinity reaches the sums.
        Values::F32(values) => [0, 1, 2].map(|c| values[first + c].clamp(0.0, f16::MAX.to_f32())),
        _ => [0.0; 3],
    };
    for half in halves.map(f16::from_f32).into_iter().chain([f16::ONE]) {
        out.extend_from_slice(&half.to_le_bytes());
    }
}
