//! The small tables of a scene and the ranges of their numbers.

use super::display::{Backdrop, EyeDomeLighting, EyeDomeUse, ToneMap};
use super::keyed::Keyed;
use super::limits::{
    ANTIALIAS, DEFAULT_FIELD_OF_VIEW_DEG, DEPTH_TOLERANCE, EYE_DOME_RADIUS, EYE_DOME_STRENGTH,
    FIELD_OF_VIEW_DEG, LOW_PASS, RADIUS_SCALE, STOPS,
};
use super::source::{Entry, Fault, Section};
use crate::cloud::transform::{Rotation, Transform};
use glam::{DQuat, DVec3};
use surfelshop_api::params::srgb_to_linear;
use surfelshop_api::{Camera, Projection, SurfaceSettings};

/// Coordinates beyond this are no place in a scene: f32 ends at 3.4e38, and sums must fit.
const FARTHEST: f64 = 1e37;

fn is_near(number: f64) -> bool {
    number.abs() <= FARTHEST
}

/// A place in world space.
pub(super) fn place(entry: &Entry<'_>) -> Result<DVec3, Fault> {
    entry.numbers::<3>("three numbers from -1e37 to 1e37", is_near).map(DVec3::from)
}

pub(super) fn direction(entry: &Entry<'_>) -> Result<DVec3, Fault> {
    let direction = place(entry)?;
    match direction.try_normalize() {
        Some(_) => Ok(direction),
        None => Err(entry.wrong("a direction, whose three numbers are not all zero")),
    }
}

/// Three numbers that single precision holds.
pub(super) fn floats(
    entry: &Entry<'_>,
    expected: &str,
    allowed: impl Fn(f64) -> bool,
) -> Result<[f32; 3], Fault> {
    let allowed = |number: f64| (number as f32).is_finite() && allowed(number);
    Ok(entry.numbers::<3>(expected, allowed)?.map(|number| number as f32))
}

pub(super) fn stops(entry: &Entry<'_>) -> Result<f32, Fault> {
    Ok(entry.within(&STOPS)? as f32)
}

pub(super) fn antialias(entry: &Entry<'_>) -> Result<u32, Fault> {
    let is_allowed = |n: f64| n.fract() == 0.0 && ANTIALIAS.contains(n);
    Ok(entry.number(&ANTIALIAS.expected(), is_allowed)? as u32)
}

/// The keys of eye-dome lighting that a scene has.
pub(super) fn eye_dome(whole: &mut Section<'_>, of: &mut EyeDomeLighting) -> Result<(), Fault> {
    if let Some(entry) = whole.find("eye_dome_lighting") {
        let when = entry.text().and_then(EyeDomeUse::named);
        of.when = when.ok_or_else(|| entry.wrong("\"automatic\", \"off\" or \"on\""))?;
    }
    if let Some(entry) = whole.find("eye_dome_strength") {
        of.strength = entry.within(&EYE_DOME_STRENGTH)? as f32;
    }
    if let Some(entry) = whole.find("eye_dome_radius") {
        of.radius = entry.within(&EYE_DOME_RADIUS)? as f32;
    }
    Ok(())
}

pub(super) fn tone_map(entry: &Entry<'_>) -> Result<ToneMap, Fault> {
    match entry.text() {
        Some("clamp") => Ok(ToneMap::Clamp),
        Some("neutral") => Ok(ToneMap::Neutral),
        _ => Err(entry.wrong("\"clamp\" or \"neutral\"")),
    }
}

pub(super) fn backdrop(entry: &Entry<'_>) -> Result<Backdrop, Fault> {
    const COLOR: &str = "\"#rrggbb\" or a linear colour of three numbers from 0 to 1";
    let color = |entry: &Entry<'_>, expected: &str| match entry.text() {
        Some(text) => hexadecimal(text).ok_or_else(|| entry.wrong(expected)),
        None => floats(entry, expected, |channel| (0.0..=1.0).contains(&channel)),
    };
    if entry.text() == Some("transparent") {
        return Ok(Backdrop::Transparent);
    }
    if let Some([top, bottom]) = entry.items().as_deref() {
        return Ok(Backdrop::Gradient { top: color(top, COLOR)?, bottom: color(bottom, COLOR)? });
    }
    let expected = format!("\"transparent\", {COLOR}, or two colours: [upper edge, lower edge]");
    color(entry, &expected).map(Backdrop::Color)
}

/// The linear colour of `#rrggbb`, which is sRGB-encoded.
fn hexadecimal(text: &str) -> Option<[f32; 3]> {
    hexadecimal_codes(text).map(|codes| codes.map(channel))
}

/// The sRGB-encoded channels of `#rrggbb`.
pub(super) fn hexadecimal_codes(text: &str) -> Option<[u8; 3]> {
    let digits = text.strip_prefix('#')?;
    let is_hexadecimal = digits.len() == 6 && digits.bytes().all(|digit| digit.is_ascii_hexdigit());
    let bits = u32::from_str_radix(digits, 16).ok().filter(|_| is_hexadecimal)?;
    Some([16, 8, 0].map(|shift| (bits >> shift) as u8))
}

/// The linear value of an sRGB-encoded channel of 8 bits.
pub(super) fn channel(code: u8) -> f32 {
    srgb_to_linear(f32::from(code) / 255.0)
}

pub(super) fn camera(mut section: Section<'_>) -> Result<Keyed<Camera>, Fault> {
    let expected = "a place of three numbers";
    let eye = place(&section.need("eye", expected)?)?;
    let target_entry = section.need("target", expected)?;
    let target = place(&target_entry)?;
    if (target - eye).try_normalize().is_none() {
        return Err(target_entry.wrong("another place than `eye`"));
    }
    let up = section.find("up").map_or(Ok(DVec3::Y), |entry| direction(&entry))?;
    let angle = section.find("fov");
    let projection = match (section.find("height"), angle) {
        (Some(entry), Some(_)) => {
            return Err(entry.wrong("either `fov` (perspective) or `height` (parallel), not both"));
        }
        (Some(entry), None) => {
            let expected = "a height from 1e-30 to 1e37";
            let height = entry.number(expected, |n| (1e-30..=FARTHEST).contains(&n))?;
            Projection::Orthographic { height }
        }
        (None, angle) => {
            let angle = angle
                .map_or(Ok(DEFAULT_FIELD_OF_VIEW_DEG), |entry| entry.within(&FIELD_OF_VIEW_DEG))?;
            Projection::Perspective { fov_y: angle.to_radians() }
        }
    };
    let camera = Camera { eye, target, up, projection };
    Ok(Keyed { known: camera, unknown: section.unknown()? })
}

pub(super) fn surface(mut section: Section<'_>) -> Result<Keyed<SurfaceSettings>, Fault> {
    let mut surface = SurfaceSettings::default();
    if let Some(entry) = section.find("depth_tolerance") {
        surface.depth_tolerance = entry.within(&DEPTH_TOLERANCE)? as f32;
    }
    if let Some(entry) = section.find("two_sided") {
        surface.two_sided = entry.flag()?;
    }
    if let Some(entry) = section.find("radius_scale") {
        surface.radius_scale = entry.within(&RADIUS_SCALE)? as f32;
    }
    if let Some(entry) = section.find("low_pass") {
        surface.low_pass = entry.within(&LOW_PASS)? as f32;
    }
    Ok(Keyed { known: surface, unknown: section.unknown()? })
}

pub(super) fn transform(mut section: Section<'_>) -> Result<Keyed<Transform>, Fault> {
    let mut transform = Transform::default();
    if let Some(entry) = section.find("translation") {
        transform.translation = place(&entry)?;
    }
    let angles = section.find("rotation");
    if let Some(entry) = &angles {
        let expected = "three angles in degrees, about x, y and z, from -1e6 to 1e6";
        let angles = entry.numbers::<3>(expected, |angle| angle.abs() <= 1e6)?;
        transform.rotation = Rotation::Euler(DVec3::from(angles.map(f64::to_radians)));
    }
    if let Some(entry) = section.find("quaternion") {
        if angles.is_some() {
            return Err(entry.wrong("either `rotation` or `quaternion`, not both"));
        }
        let expected = "a quaternion of four numbers x, y, z, w that are not all zero";
        let numbers = entry.numbers::<4>(expected, f64::is_finite)?;
        transform.rotation = Rotation::Quaternion(DQuat::from_array(numbers));
        transform.rotation.quaternion().ok_or_else(|| entry.wrong(expected))?;
    }
    if let Some(entry) = section.find("scale") {
        let expected = "a factor above 0, at most 1e37";
        transform.scale = entry.number(expected, |n| n > 0.0 && n <= FARTHEST)?;
    }
    Ok(Keyed { known: transform, unknown: section.unknown()? })
}
