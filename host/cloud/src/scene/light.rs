//! A light of a scene as a table: directional by `towards`, with a place by `position`, a spot by
//! `target` besides.

use super::angle::degrees;
use super::keyed::Keyed;
use super::limits::{DEFAULT_SPOT_DEG, DEFAULT_SPOT_SOFTNESS};
use super::parts::{direction, floats, place};
use super::source::{Entry, Fault, Section};
use crate::toml_text::{Entries, color, entry, float, vector, with_unknown};
use glam::{DVec3, Vec3};
use surfelshop_api::Light;

/// The keys that only some kinds of lights have.
struct Keys<'a> {
    radiance: Option<Entry<'a>>,
    follows_camera: Option<Entry<'a>>,
    intensity: Option<Entry<'a>>,
    target: Option<Entry<'a>>,
    angle: Option<Entry<'a>>,
    softness: Option<Entry<'a>>,
}

pub(super) fn light(mut section: Section<'_>) -> Result<Keyed<Light>, Fault> {
    let towards = section.find("towards");
    let position = section.find("position");
    let keys = Keys {
        radiance: section.find("radiance"),
        follows_camera: section.find("follows_camera"),
        intensity: section.find("intensity"),
        target: section.find("target"),
        angle: section.find("angle"),
        softness: section.find("softness"),
    };
    let light = match (towards, position) {
        (Some(_), Some(position)) => {
            return Err(position.wrong("either `towards` or `position`, not both"));
        }
        (Some(towards), None) => directional(&towards, &keys)?,
        (None, Some(position)) => placed(&position, &keys)?,
        (None, None) => {
            let expected = "the direction towards the light, or `position` where it has a place";
            directional(&section.need("towards", expected)?, &keys)?
        }
    };
    Ok(Keyed { known: light, unknown: section.unknown()? })
}

fn directional(towards: &Entry<'_>, keys: &Keys<'_>) -> Result<Light, Fault> {
    let foreign = [&keys.intensity, &keys.target, &keys.angle, &keys.softness];
    if let Some(entry) = foreign.into_iter().flatten().next() {
        return Err(entry.wrong("`position` beside it, in place of `towards`"));
    }
    let towards = direction(towards)?;
    let radiance = amount(keys.radiance.as_ref())?;
    let follows_camera = keys.follows_camera.as_ref().map_or(Ok(false), Entry::flag)?;
    Ok(Light::Directional { towards, radiance, follows_camera })
}

fn placed(position_entry: &Entry<'_>, keys: &Keys<'_>) -> Result<Light, Fault> {
    if let Some(entry) = &keys.radiance {
        return Err(entry.wrong("`intensity` in its place where a light has a `position`"));
    }
    if let Some(entry) = &keys.follows_camera {
        return Err(entry.wrong("`towards` beside it, in place of `position`"));
    }
    let position = place(position_entry)?;
    let intensity = amount(keys.intensity.as_ref())?;
    let Some(target_entry) = &keys.target else {
        return match keys.angle.as_ref().or(keys.softness.as_ref()) {
            Some(entry) => Err(entry.wrong("`target` beside it, which makes the light a spot")),
            None => Ok(Light::Point { position, intensity }),
        };
    };
    let target = place(target_entry)?;
    if (target - position).try_normalize().is_none() {
        return Err(target_entry.wrong("another place than `position`"));
    }
    let angle = keys.angle.as_ref().map_or(Ok(DEFAULT_SPOT_DEG), |entry| {
        let expected = "an angle in degrees from 0 to 180, between the axis and the edge";
        entry.number(expected, |n| (0.0..=180.0).contains(&n))
    })?;
    let softness = keys.softness.as_ref().map_or(Ok(DEFAULT_SPOT_SOFTNESS), |entry| {
        let softness = entry.number("a share from 0 to 1", |n| (0.0..=1.0).contains(&n))?;
        Ok(softness as f32)
    })?;
    Ok(Light::Spot { position, target, intensity, angle: angle.to_radians(), softness })
}

/// Radiance or intensity.
fn amount(entry: Option<&Entry<'_>>) -> Result<Vec3, Fault> {
    let Some(entry) = entry else { return Ok(Vec3::ONE) };
    floats(entry, "three numbers of 0 or more", |channel| channel >= 0.0).map(Vec3::from)
}

pub(super) fn light_entries(light: &Keyed<Light>) -> Entries {
    let place = |key: &str, place: DVec3| entry(key, vector(place.to_array()));
    let mut entries = match light.known {
        Light::Directional { towards, radiance, follows_camera } => vec![
            place("towards", towards),
            entry("radiance", color(radiance)),
            entry("follows_camera", follows_camera),
        ],
        Light::Point { position, intensity } => {
            vec![place("position", position), entry("intensity", color(intensity))]
        }
        Light::Spot { position, target, intensity, angle, softness } => vec![
            place("position", position),
            place("target", target),
            entry("intensity", color(intensity)),
            entry("angle", degrees(angle)),
            entry("softness", float(softness)),
        ],
    };
    with_unknown(&mut entries, &light.unknown);
    entries
}
