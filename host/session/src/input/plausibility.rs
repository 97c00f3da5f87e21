//! What of a scene cannot be seen as it stands: clouds far apart, and lamps that do not suit its size.

use crate::input::clouds::Clouds;
use crate::output::terminal;
use glam::DVec3;
use surfelshop_api::{CloudFacts, Light, Scene};

/// Share of the scene's diagonal below which the largest cloud is a speck: 15 pixels of 768.
const SPECK: f64 = 0.02;

/// Radiance of a white surface below which a lamp adds less than two levels of 255 to black, as sRGB.
const DARKEST: f64 = 5e-4;

/// Radiance of a white surface above which it is white at any exposure that people choose first: 5 stops.
const BRIGHTEST: f64 = 32.0;

/// Says in lines what cannot be seen.
pub fn note(clouds: &Clouds, scene: &Scene) {
    if let Some(line) = nothing_to_see(clouds) {
        terminal::note(line);
    }
    if let Some(line) = far_apart(clouds) {
        terminal::note(format!("{line}: render one of them alone"));
    }
    for (i, light) in scene.lights.iter().enumerate() {
        if let Some(line) = unsuited(light, [clouds.facts.bounds_min, clouds.facts.bounds_max]) {
            terminal::note(format!("light {}: {line}", i + 1));
        }
    }
}

/// Why there is nothing to see, in a line: files without points, or with all of them in one place.
#[must_use]
pub fn nothing_to_see(clouds: &Clouds) -> Option<String> {
    let summaries = || clouds.loaded.iter().map(|loaded| &loaded.summary);
    let in_files = summaries().map(|summary| summary.n_surfels).sum::<u64>();
    let facts = &clouds.facts;
    if clouds.loaded.is_empty() {
        return None;
    }
    if in_files == 0 {
        let dropped = summaries().find(|summary| summary.n_dropped > 0);
        return Some(match dropped {
            None => "there are no points to show".to_owned(),
            Some(summary) => format!(
                "there are no points to show: {} of {} are left out, {}",
                summary.n_dropped,
                summary.file,
                summary.why_dropped()
            ),
        });
    }
    let in_one_place = facts.bounds_min == facts.bounds_max;
    (in_files > 1 && facts.n_surfels > 1 && in_one_place)
        .then(|| "all points lie in one place".to_owned())
}

/// Whether clouds lie so far apart that none can be seen beside the others, in a line.
#[must_use]
pub fn far_apart(clouds: &Clouds) -> Option<String> {
    let facts = clouds.loaded.iter().map(|loaded| loaded.cloud.facts());
    let sizes: Vec<f64> = facts.filter(|facts| facts.n_surfels > 0).map(diagonal).collect();
    let (whole, largest) = (diagonal(&clouds.facts), sizes.iter().copied().fold(0.0, f64::max));
    let is_far = sizes.len() > 1 && largest < SPECK * whole;
    is_far.then(|| {
        format!(
            "the clouds lie {} units apart and the largest is {} units across: none of them can be seen beside the others; \
             their coordinate systems may differ",
            rounded(whole),
            rounded(largest)
        )
    })
}

/// A length of about four digits.
fn rounded(length: f64) -> String {
    match length {
        0.0 => "0".to_owned(),
        _ if !(1e-3..1e7).contains(&length) => format!("{length:.2e}"),
        _ if length < 1000.0 => format!("{length:.3}"),
        _ => format!("{length:.0}"),
    }
}

fn diagonal(facts: &CloudFacts) -> f64 {
    (facts.bounds_max - facts.bounds_min).length()
}

/// Why a lamp cannot suit a scene between two corners, in a line; directional lights suit all.
#[must_use]
pub fn unsuited(light: &Light, [min, max]: [DVec3; 2]) -> Option<String> {
    let (Light::Point { position, intensity } | Light::Spot { position, intensity, .. }) = light
    else {
        return None;
    };
    let (size, most) = ((max - min).length(), f64::from(intensity.max_element()));
    if !(position.is_finite() && size > 0.0 && most > 0.0 && most.is_finite()) {
        return None;
    }
    // Within the scene it has to light more than what is right beside it.
    let nearest = position.distance(position.clamp(min, max)).max(0.125 * size);
    let farthest =
        position.distance(DVec3::select((*position - min).cmpgt(max - *position), min, max));
    let middle = position.distance(0.5 * (min + max)).max(0.125 * size);
    let suits = format!("an intensity of {} would suit", rounded(middle * middle));
    if most / (nearest * nearest) < DARKEST {
        return Some(format!("it is too weak for its distance to be seen; {suits}"));
    }
    if most / (farthest * farthest) > BRIGHTEST {
        return Some(format!("it is so strong that everything is white; {suits}"));
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use surfelshop_cloud::{Buffer, Cloud, Column, Loaded, Summary};

    fn pair(distance: f32) -> Clouds {
        let cloud = |at: f32| {
            let positions = Buffer::F32(vec![at, 0.0, 0.0, at + 1.0, 0.0, 0.0]);
            let columns = vec![Column::new("position", 3, positions)];
            Loaded { cloud: Cloud::new(DVec3::ZERO, columns).unwrap(), summary: Summary::default() }
        };
        Clouds::of(vec![cloud(0.0), cloud(distance)])
    }

    #[test]
    fn clouds_that_are_nothing_beside_the_others_are_far_apart() {
        assert_eq!(far_apart(&pair(20.0)), None);
        let line = far_apart(&pair(1000.0)).unwrap();
        assert!(line.contains("1001 units apart and the largest is 1.000 units across"), "{line}");
        assert_eq!(far_apart(&Clouds::of(Vec::new())), None);
    }

    #[test]
    fn files_without_anything_to_see_are_said() {
        let dropping = |n: usize, n_dropped: u64, at: &[f32]| {
            let positions = Buffer::F32(at.iter().flat_map(|x| [*x, 0.0, 0.0]).collect());
            let cloud =
                Cloud::new(DVec3::ZERO, vec![Column::new("position", 3, positions)]).unwrap();
            let (file, n_surfels) = ("a.ply".to_owned(), n as u64);
            let summary = Summary { file, n_surfels, n_dropped, ..Summary::default() };
            nothing_to_see(&Clouds::of(vec![Loaded { cloud, summary }]))
        };
        let of = |n: usize, at: &[f32]| dropping(n, 0, at);
        assert_eq!(of(0, &[]).as_deref(), Some("there are no points to show"));
        let line = dropping(0, 3, &[]).unwrap();
        assert!(line.ends_with("3 of a.ply are left out, their coordinates are not finite"));
        assert_eq!(of(2, &[1.0, 1.0]).as_deref(), Some("all points lie in one place"));
        assert_eq!(of(2, &[1.0, 2.0]), None);
        assert_eq!(of(1, &[1.0]), None);
        assert_eq!(of(2, &[]), None, "filters hide them, which is said elsewhere");
        assert_eq!(nothing_to_see(&Clouds::of(Vec::new())), None);
    }

    #[test]
    fn lamps_suit_the_size_of_the_scene() {
        let scene = [DVec3::splat(-1.0), DVec3::splat(1.0)];
        let lamp = |x: f64, intensity: f32| Light::Point {
            position: DVec3::new(x, 0.0, 0.0),
            intensity: Vec3::splat(intensity),
        };
        for light in [lamp(0.0, 1.0), lamp(3.0, 4.0), lamp(3.0, 0.0), lamp(f64::NAN, 1.0)] {
            assert_eq!(unsuited(&light, scene), None, "{light:?}");
        }
        let line = unsuited(&lamp(1000.0, 1.0), scene).unwrap();
        assert!(line.contains("too weak") && line.contains("1000000 would suit"), "{line}");
        assert!(unsuited(&lamp(0.0, 1e-6), scene).unwrap().contains("too weak"));
        assert!(unsuited(&lamp(3.0, 1e5), scene).unwrap().contains("everything is white"));
        assert_eq!(unsuited(&Scene::default().lights[0], scene), None);
    }
}
