//! How surfels look, as a table: `[splats]`.

use super::keyed::Keyed;
use super::limits::{LARGEST_RADIUS, PLANARITIES, POINT_RADIUS};
use super::source::{Fault, Section};
use crate::display::{Look, SplatSettings};
use crate::toml_text::{Entries, entry, float, with_unknown};

/// The table `splats`.
pub(super) fn read(mut section: Section<'_>) -> Result<Keyed<SplatSettings>, Fault> {
    let mut splats = SplatSettings::default();
    if let Some(look) = section.find("look") {
        splats.look = match look.text() {
            Some("surface") => Look::Surface,
            Some("points") => Look::Points { radius: 0.0 },
            _ => return Err(look.wrong("\"surface\" or \"points\"")),
        };
    }
    if let Some(entry) = section.find("point_radius") {
        let given = entry.within(&POINT_RADIUS)? as f32;
        match &mut splats.look {
            Look::Points { radius } => *radius = given,
            Look::Surface => return Err(entry.wrong("`look = \"points\"` beside it")),
        }
    }
    if let Some(entry) = section.find("round_below") {
        splats.round_below = entry.within(&PLANARITIES)? as f32;
    }
    if let Some(entry) = section.find("largest_radius") {
        splats.largest_radius = Some(entry.within(&LARGEST_RADIUS)? as f32);
    }
    if let Some(entry) = section.find("tint_backs") {
        splats.tint_backs = entry.flag()?;
    }
    Ok(Keyed { known: splats, unknown: section.unknown()? })
}

/// The entries of `splats`; none where everything is as usual.
pub(super) fn splat_entries(splats: &Keyed<SplatSettings>) -> Option<Entries> {
    let SplatSettings { look, round_below, largest_radius, tint_backs } = splats.known;
    if splats.known == SplatSettings::default() && splats.unknown.is_empty() {
        return None;
    }
    let mut entries = match look {
        Look::Surface => Vec::new(),
        Look::Points { radius } => {
            vec![entry("look", "points"), entry("point_radius", float(radius))]
        }
    };
    if round_below.to_bits() != SplatSettings::ROUND_BELOW.to_bits() {
        entries.push(entry("round_below", float(round_below)));
    }
    entries.extend(largest_radius.map(|radius| entry("largest_radius", float(radius))));
    entries.extend(tint_backs.then(|| entry("tint_backs", true)));
    with_unknown(&mut entries, &splats.unknown);
    Some(entries)
}
