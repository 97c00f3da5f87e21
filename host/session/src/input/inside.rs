//! Where one stands inside a scan: where its device stood, else in its largest free space, looking where most of
//! it lies.

use crate::input::clouds::{Clouds, Standpoint};
use crate::options::camera::CameraSpec;
use crate::options::{LensArguments, UpAxis};
use crate::output::terminal;
use glam::{DVec3, Vec3};
use surfelshop_api::columns::NORMAL;
use surfelshop_cloud::{Cloud, Source};
use surfelshop_geometry::free_space::{Standing, is_seen_from_within, viewpoints};
use surfelshop_geometry::silent;

/// Vertical field of view inside, degrees: about that of a person's attention, wide enough for a room.
const FOV_DEG: f64 = 65.0;

/// Height of eyes above the floor, metres.
const EYES: f64 = 1.6;

/// Most points among which a place to stand is looked for.
const STOOD_AMONG: usize = 1_000_000;

/// Points that are looked at for a direction.
const LOOKED_AT: usize = 4096;

/// Directions around the eye that are compared.
const SECTORS: usize = 24;

/// The lens with a place inside the clouds, where it asks for one and there is one.
#[must_use]
pub fn lens(lens: &LensArguments, clouds: &Clouds) -> LensArguments {
    let camera = match lens.camera {
        CameraSpec::Inside => {
            let clouds = with_standpoint(clouds.clone(), lens.up);
            let found = stand(&clouds, lens.up);
            if let Some(CameraSpec::Placed { eye, .. }) = found
                && is_outside(&clouds, eye)
            {
                terminal::note(
                    "--camera inside: a device took it from here, as its file or its points tell, outside of what it took",
                );
            }
            found.unwrap_or_else(|| {
                terminal::note(
                    "--camera inside: no scanner's place is known and no room was found, so the \
                     picture is taken from outside",
                );
                CameraSpec::three_quarter()
            })
        }
        camera => camera,
    };
    LensArguments { camera, ..lens.clone() }
}

/// Whether a place is outside of the box around everything.
fn is_outside(clouds: &Clouds, place: DVec3) -> bool {
    let facts = &clouds.facts;
    place.cmplt(facts.bounds_min).any() || place.cmpgt(facts.bounds_max).any()
}

/// The clouds with a place in their largest free space, at eye height where units are known; unchanged where a
/// device's place is known.
#[must_use]
pub fn with_standpoint(clouds: Clouds, up: UpAxis) -> Clouds {
    if has_scanner(&clouds) {
        return clouds;
    }
    // The largest cloud is what others stand in.
    let size = |cloud: &&Cloud| {
        let facts = cloud.facts();
        (facts.bounds_max - facts.bounds_min).length_squared()
    };
    let all = clouds.loaded.iter().map(|loaded| &loaded.cloud);
    let largest = all.max_by(|a, b| size(a).total_cmp(&size(b)));
    let standpoint = largest.and_then(|cloud| free_place(cloud, up));
    Clouds { standpoint, ..clouds }
}

/// The best place to stand in a cloud.
fn free_place(cloud: &Cloud, up: UpAxis) -> Option<Standpoint> {
    let source = cloud.source();
    let axis = upright(up, [source]);
    let facts = cloud.facts();
    let widest = (facts.bounds_max - facts.bounds_min).max_element();
    // Nobody stands in what is smaller than a person.
    let eye_height = source.metres().map(|metres| EYES / metres).filter(|eyes| widest > 2.0 * eyes);
    let eye_height = eye_height.map(|eyes| eyes as f32);
    let standing = Standing { up: axis.as_vec3(), eye_height };
    let step = cloud.len().div_ceil(STOOD_AMONG).max(1);
    let every = |all: &[Vec3]| -> Vec<Vec3> { all.iter().copied().step_by(step).collect() };
    let normals = every(cloud.vectors(NORMAL));
    let places = viewpoints(&every(cloud.positions()), Some(&normals), standing, 1, &silent);
    let places = places.unwrap_or_default();
    let place = cloud.origin() + places.first()?.position.as_dvec3();
    Some(Standpoint { place, is_within: is_seen_from_within(&places) })
}

/// The direction that is up: what a camera saw has its own upright near the axis.
fn upright<'a>(up: UpAxis, sources: impl IntoIterator<Item = &'a Source> + Clone) -> DVec3 {
    /// Cosine of 60 degrees, by which a camera may look up or down.
    const NEAR: f64 = 0.5;
    let axis = up.or_of(sources.clone()).axis().direction();
    let of_rows = sources.into_iter().find_map(|source| source.grid_up);
    of_rows.filter(|rows| rows.dot(axis) > NEAR).unwrap_or(axis)
}

/// A place inside the clouds and where to look from it; `None` where nobody can.
#[must_use]
pub fn stand(clouds: &Clouds, up: UpAxis) -> Option<CameraSpec> {
    let found = clouds.standpoint.map(|found| found.place);
    let clouds: Vec<&Cloud> = clouds.loaded.iter().map(|loaded| &loaded.cloud).collect();
    let eye = scanner(&clouds).or(found)?;
    let sources = clouds.iter().map(|cloud| cloud.source());
    let up = upright(up, sources.clone());
    let target = eye + direction(&clouds, eye, up)?;
    Some(CameraSpec::Placed { eye, target, up: Some(up), fov_deg: Some(FOV_DEG) })
}

/// Whether one can stand inside the clouds; costs less than to say where.
#[must_use]
pub fn can_stand(clouds: &Clouds) -> bool {
    clouds.facts.n_surfels > 0 && (clouds.standpoint.is_some() || has_scanner(clouds))
}

/// Whether a first look at the clouds is one from inside: a device stood there, or they are seen from within.
#[must_use]
pub fn is_first_view(clouds: &Clouds) -> bool {
    has_scanner(clouds) || clouds.standpoint.is_some_and(|found| found.is_within)
}

/// Whether a file says where a device stood.
fn has_scanner(clouds: &Clouds) -> bool {
    clouds.loaded.iter().any(|loaded| loaded.cloud.source().scanners().is_some())
}

/// The place of a device: of several the one nearest to the middle of all.
fn scanner(clouds: &[&Cloud]) -> Option<DVec3> {
    let places: Vec<DVec3> = clouds
        .iter()
        .flat_map(|cloud| cloud.source().scanners().unwrap_or_default())
        .flatten()
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
    use surfelshop_cloud::{Buffer, Column, Loaded, Scan, Summary};

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
        let nowhere = seen_from(None, &[[1.0; 3]]);
        assert_eq!((stand(&nowhere, UpAxis::Auto), can_stand(&nowhere)), (None, false));
        // Where no device stood, one stands in free space, if a load found some.
        let mut clouds = seen_from(None, &[[5.0, 0.0, 0.0]]);
        assert!(can_stand(&Clouds {
            standpoint: Some(Standpoint { place: DVec3::X, is_within: false }),
            ..clouds.clone()
        }));
        clouds.standpoint = Some(Standpoint { place: DVec3::X, is_within: true });
        let Some(CameraSpec::Placed { eye, target, .. }) = stand(&clouds, UpAxis::Auto) else {
            panic!("nobody stands inside")
        };
        assert_eq!((eye, (target - eye).normalize_or_zero()), (DVec3::X, DVec3::X));
        assert_eq!(stand(&seen_from(Some(DVec3::X), &[]), UpAxis::Auto), None);
    }

    #[test]
    fn nobody_stands_beside_what_is_smaller_than_a_person() {
        let ball = |radius: f32| -> Vec<[f32; 3]> {
            (0..4000)
                .map(|i| {
                    let (z, turn) = (1.0 - (i as f32 + 0.5) / 2000.0, 2.399_963 * i as f32);
                    let around = (1.0 - z * z).sqrt();
                    [around * turn.cos(), around * turn.sin(), z].map(|part| radius * part)
                })
                .collect()
        };
        for radius in [0.08f32, 8.0] {
            let mut clouds = seen_from(None, &ball(radius));
            for Loaded { cloud, .. } in &mut clouds.loaded {
                let source = Source { metres_per_unit: 1.0, ..Source::default() };
                *cloud = cloud.clone().with_source(source);
            }
            let found = with_standpoint(clouds, UpAxis::Auto).standpoint;
            // In a hollow ball there may be a place, beside it there is none.
            let is_inside = |found: Standpoint| found.place.length() < f64::from(radius);
            assert!(found.is_none_or(is_inside), "{radius}: {:?}", found.map(|found| found.place));
        }
    }
}
