//! The surfel under the pointer.

use glam::DVec3;
use rayon::prelude::*;
use surfelshop_cloud::Cloud;
use surfelshop_session::input::clouds::Clouds;
use surfelshop_session::input::displayed::DisplayedClouds;

/// The surfel among those that are displayed whose disc holds a point: of which cloud, and its index there.
pub(crate) fn nearest_of(displayed: &DisplayedClouds, point: DVec3) -> Option<(usize, usize)> {
    let clouds = displayed.clouds.loaded.iter().enumerate();
    let all = clouds.filter_map(|(i, loaded)| Some((i, nearest(&loaded.cloud, point)?)));
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

/// The surfel whose disc is nearest to a point, with the distance in its radii.
fn nearest(cloud: &Cloud, point: DVec3) -> Option<(usize, f32)> {
    let at = (point - cloud.origin()).as_vec3();
    let (normals, radii) = (cloud.normals(), cloud.radii());
    let distance = |i: usize| {
        let offset = at - cloud.positions()[i];
        let normal = normals.get(i).copied().unwrap_or_default();
        let above = offset.dot(normal);
        // Height above a disc counts more than distance along it: the point is on another surface.
        let radius = radii.get(i).copied().unwrap_or(1.0).max(f32::MIN_POSITIVE);
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
    use surfelshop_cloud::Buffer;
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
