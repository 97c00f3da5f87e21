//! The surfel under the pointer.

use glam::DVec3;
use rayon::prelude::*;
use surfelshop_api::columns::{ROUND, TANGENT_U, TANGENT_V, round_reach};
use surfelshop_api::{Camera, Projection};
use surfelshop_cloud::{Buffer, Cloud, Column};
use surfelshop_session::input::clouds::Clouds;
use surfelshop_session::input::displayed::DisplayedClouds;

/// The surfel among those that are displayed whose disc holds a point that a camera sees: of which cloud, and its index
/// there.
pub(crate) fn nearest_of(
    displayed: &DisplayedClouds,
    camera: &Camera,
    point: DVec3,
) -> Option<(usize, usize)> {
    let distance = match camera.projection {
        Projection::Perspective { .. } => point.distance(camera.eye) as f32,
        Projection::Orthographic { .. } => f32::INFINITY,
    };
    let clouds = displayed.clouds.loaded.iter().enumerate();
    let all = clouds.filter_map(|(i, loaded)| Some((i, nearest(&loaded.cloud, distance, point)?)));
    let (file, (index, _)) = all.min_by(|(_, a), (_, b)| a.1.total_cmp(&b.1))?;
    Some((file, index))
}

/// Describes a surfel at a point, in one line: with its number, colour and shown value in the whole cloud.
pub(crate) fn describe(
    displayed: &DisplayedClouds,
    whole: &Clouds,
    point: DVec3,
    (file, index): (usize, usize),
) -> String {
    let Some(loaded) = whole.loaded.get(file) else { return String::new() };
    let (cloud, index) = (&loaded.cloud, displayed.source_index(file, index));
    let [x, y, z] = point.to_array();
    let normal = cloud.normals().get(index).copied().unwrap_or_default();
    let color = color(cloud, index);
    let name = match whole.loaded.len() {
        0 | 1 => String::new(),
        _ => {
            let file = std::path::Path::new(&loaded.summary.file);
            format!(" of {}", file.file_name().unwrap_or_default().to_string_lossy())
        }
    };
    let attribute = displayed.display().colors().attribute();
    let number = attribute.and_then(|attribute| {
        let number = displayed.display().number(cloud, attribute, index)?;
        Some(format!("   {} {}", attribute.name(), shortened(number)))
    });
    format!(
        "({x:.6}, {y:.6}, {z:.6})   surfel {index}{name}   normal ({:.3}, {:.3}, {:.3}){color}{}",
        normal.x,
        normal.y,
        normal.z,
        number.unwrap_or_default()
    )
}

/// A number with the decimals that matter: heights are sums of what single precision holds, and an origin.
fn shortened(number: f64) -> String {
    if number != 0.0 && number.abs() < 1e-3 {
        return format!("{number:.3e}");
    }
    let text = format!("{number:.6}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Which surfels are round splats, not 0; empty where none is.
pub(crate) fn round_of(cloud: &Cloud) -> &[u8] {
    let are_ellipses = [TANGENT_U, TANGENT_V].iter().all(|name| cloud.column(name).is_some());
    match cloud.column(ROUND).map(Column::values).filter(|_| !are_ellipses) {
        Some(Buffer::U8(round)) => round,
        _ => &[],
    }
}

/// The surfel whose disc is nearest to a point at a distance from the eye, with its own distance in its radii; round
/// splats are as large as they are drawn there.
fn nearest(cloud: &Cloud, eye_distance: f32, point: DVec3) -> Option<(usize, f32)> {
    let at = (point - cloud.origin()).as_vec3();
    let round = round_of(cloud);
    let largest_round = round_reach(round) * eye_distance;
    let (normals, radii) = (cloud.normals(), cloud.radii());
    let distance = |i: usize| {
        let offset = at - cloud.positions()[i];
        let radius = radii.get(i).copied().unwrap_or(1.0).max(f32::MIN_POSITIVE);
        if round.get(i).is_some_and(|&is_round| is_round != 0) {
            return offset.length() / radius.min(largest_round).max(f32::MIN_POSITIVE);
        }
        let normal = normals.get(i).copied().unwrap_or_default();
        let above = offset.dot(normal);
        // Height above a disc counts more than distance along it: the point is on another surface.
        (offset.length() + 4.0 * above.abs()) / radius
    };
    (0..cloud.len())
        .into_par_iter()
        .with_min_len(1 << 14)
        .map(|i| (i, distance(i)))
        .filter(|(_, distance)| distance.is_finite())
        .min_by(|a, b| a.1.total_cmp(&b.1))
}

fn color(cloud: &Cloud, index: usize) -> String {
    let Some(column) = cloud.column(surfelshop_api::columns::COLOR) else { return String::new() };
    let n = column.components() as usize;
    let range = n * index..n * index + 3;
    match column.values() {
        Buffer::U8(values) => {
            values.get(range).map(|c| format!("   colour {} {} {}", c[0], c[1], c[2]))
        }
        Buffer::U16(values) => {
            values.get(range).map(|c| format!("   colour {} {} {}", c[0], c[1], c[2]))
        }
        Buffer::F32(values) => {
            values.get(range).map(|c| format!("   colour {:.3} {:.3} {:.3}", c[0], c[1], c[2]))
        }
        _ => None,
    }
    .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_api::columns::{ROUND_REACH, ROUND_UNBOUNDED};

    fn cloud(round: u8, are_ellipses: bool) -> Cloud {
        let column = |name, n, values: &[f32]| Column::new(name, n, Buffer::F32(values.to_vec()));
        let mut columns = vec![
            column("position", 3, &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]),
            column("normal", 3, &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]),
            column("radius", 1, &[0.25, 4.0]),
            Column::new(ROUND, 1, Buffer::U8(vec![0, round])),
        ];
        if are_ellipses {
            columns.extend([TANGENT_U, TANGENT_V].map(|name| column(name, 3, &[1.0; 6])));
        }
        Cloud::new(DVec3::ZERO, columns).unwrap()
    }

    #[test]
    fn near_round_splats_are_taken_as_large_as_they_are_drawn() {
        // Beside a small disc, a large splat that is drawn as large as 0.1 there.
        let near = 0.1 / ROUND_REACH;
        let of = |round: u8, are_ellipses: bool, eye_distance: f32| {
            nearest(&cloud(round, are_ellipses), eye_distance, DVec3::X * 0.125).unwrap().0
        };
        assert_eq!(of(0, false, near), 1, "a disc");
        assert_eq!(of(1, false, near), 0, "a round splat");
        assert_eq!(of(1, false, f32::INFINITY), 1, "one in a parallel projection");
        assert_eq!(of(ROUND_UNBOUNDED, false, near), 1, "one that is not bounded");
        assert_eq!(of(1, true, near), 1, "an ellipse");
    }
}
