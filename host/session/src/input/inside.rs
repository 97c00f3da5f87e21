//! Where one stands inside a scan: where its device stood, looking where most of it lies.

use crate::input::clouds::Clouds;
use crate::options::camera::CameraSpec;
use crate::options::{LensArguments, UpAxis};
use glam::DVec3;
use surfelshop_cloud::Cloud;

/// Vertical field of view inside, degrees: about that of a person's attention, wide enough for a room.
const FOV_DEG: f64 = 65.0;

/// Points that are looked at for a direction.
const LOOKED_AT: usize = 4096;

/// Directions around the eye that are compared.
const SECTORS: usize = 24;

/// The lens with a place inside the clouds, where it asks for one and there is one.
#[must_use]
pub fn lens(lens: &LensArguments, clouds: &Clouds) -> LensArguments {
    let camera = match lens.camera {
        CameraSpec::Inside => stand(clouds, lens.up).unwrap_or_else(CameraSpec::three_quarter),
        camera => camera,
    };
    LensArguments { camera, ..lens.clone() }
}

/// A place inside the clouds and where to look from it; `None` where nobody stood in them.
#[must_use]
pub fn stand(clouds: &Clouds, up: UpAxis) -> Option<CameraSpec> {
    let clouds: Vec<&Cloud> = clouds.loaded.iter().map(|loaded| &loaded.cloud).collect();
    let eye = scanner(&clouds)?;
    let sources = clouds.iter().map(|cloud| cloud.source());
    let up = match up.or_of(sources.clone()) {
        UpAxis::Z => DVec3::Z,
        // What a camera saw has its own upright.
        _ => sources.clone().find_map(|source| source.grid_up).unwrap_or(DVec3::Y),
    };
    let target = eye + direction(&clouds, eye, up)?;
    Some(CameraSpec::Placed { eye, target, up: Some(up), fov_deg: Some(FOV_DEG) })
}

/// The place of a device: of several the one nearest to the middle of all.
fn scanner(clouds: &[&Cloud]) -> Option<DVec3> {
    let places: Vec<DVec3> = clouds
        .iter()
        .flat_map(|cloud| cloud.source().scans.iter().filter_map(|scan| scan.scanner))
        .collect();
    let middle = places.iter().sum::<DVec3>() / places.len().max(1) as f64;
    let distance = |place: &&DVec3| place.distance_squared(middle);
    places.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))).copied()
}

/// Where most lies, seen from the eye, at the distance of its middle: level, where the eye sees all around.
fn direction(clouds: &[&Cloud], eye: DVec3, up: DVec3) -> Option<DVec3> {
    let mut seen = Vec::new();
    for cloud in clouds {
        let step = (cloud.len() / LOOKED_AT).max(1);
        let origin = cloud.origin() - eye;
        let points = cloud.positions().iter().step_by(step);
        seen.extend(points.map(|offset| origin + offset.as_dvec3()));
    }
    seen.retain(|point| point.length_squared() > 0.0);
    if seen.is_empty() {
        return None;
    }
    let mut distances: Vec<f64> = seen.iter().map(|point| point.length()).collect();
    let middle = distances.len() / 2;
    let (_, &mut typical, _) = distances.select_nth_unstable_by(middle, f64::total_cmp);
    let mean =
        seen.iter().map(|point| point.normalize_or_zero()).sum::<DVec3>() / seen.len() as f64;
    // A device that looks one way has most of its points there; one that turns has them all around.
    if mean.length() > 0.5 {
        return Some(typical * mean.normalize_or_zero());
    }
    let (right, forward) = up.any_orthonormal_pair();
    // The longest way out of the eye over a floor: the farthest of a sector's typical distances.
    let mut sectors: Vec<Vec<f64>> = vec![Vec::new(); SECTORS];
    for point in &seen {
        let (x, y) = (point.dot(right), point.dot(forward));
        let turn = y.atan2(x) / std::f64::consts::TAU + 0.5;
        let sector = ((turn * SECTORS as f64) as usize).min(SECTORS - 1);
        sectors[sector].push(x.hypot(y));
    }
    let enough = seen.len() / (4 * SECTORS);
    let typical_of = |sector: &mut Vec<f64>| {
        let middle = sector.len() / 2;
        if sector.len() <= enough {
            0.0
        } else {
            *sector.select_nth_unstable_by(middle, f64::total_cmp).1
        }
    };
    let lengths: Vec<f64> = sectors.iter_mut().map(typical_of).collect();
    let best = (0..SECTORS).max_by(|&a, &b| lengths[a].total_cmp(&lengths[b]))?;
    let angle = ((best as f64 + 0.5) / SECTORS as f64 - 0.5) * std::f64::consts::TAU;
    Some(typical * (right * angle.cos() + forward * angle.sin()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_cloud::{Buffer, Column, Loaded, Scan, Source, Summary};

    fn seen_from(scanner: Option<DVec3>, points: &[[f32; 3]]) -> Clouds {
        let positions = Buffer::F32(points.as_flattened().to_vec());
        let cloud = Cloud::new(DVec3::ZERO, vec![Column::new("position", 3, positions)]).unwrap();
        let scan = Scan { name: String::new(), pose: Default::default(), scanner };
        let cloud = cloud.with_source(Source { scans: vec![scan], ..Source::default() });
        Clouds::of(vec![Loaded { cloud, summary: Summary::default() }])
    }

    #[test]
    fn the_eye_is_where_the_device_was_and_looks_at_what_it_saw() {
        let clouds = seen_from(Some(DVec3::X), &[[1.0, 0.0, -2.0], [1.1, 0.1, -2.0]]);
        let Some(CameraSpec::Placed { eye, target, .. }) = stand(&clouds, UpAxis::Auto) else {
            panic!("nobody stands inside")
        };
        assert_eq!(eye, DVec3::X);
        assert!((target - eye).normalize_or_zero().dot(DVec3::NEG_Z) > 0.99, "{target}");
        assert_eq!(stand(&seen_from(None, &[[1.0; 3]]), UpAxis::Auto), None);
        assert_eq!(stand(&seen_from(Some(DVec3::X), &[]), UpAxis::Auto), None);
    }
}
