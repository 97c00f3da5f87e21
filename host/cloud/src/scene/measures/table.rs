//! A measure as a table of a scene: `[[measure]]`.

use super::{LONGEST_NOTE, MOST_PLACES, Measure, MeasureKind};
use crate::scene::keyed::Keyed;
use crate::scene::parts::place;
use crate::scene::source::{Entry, Fault, Section};
use crate::toml_text::{Entries, entry, vector, with_unknown};
use toml::Value;

/// A table of `measure`.
pub(in crate::scene) fn read(mut section: Section<'_>) -> Result<Keyed<Measure>, Fault> {
    let expected = || format!("one of {}", MeasureKind::ALL.map(MeasureKind::name).join(", "));
    let kind_entry = section.need("kind", &expected())?;
    let kind = kind_entry.text().and_then(MeasureKind::from_name);
    let kind = kind.ok_or_else(|| kind_entry.wrong(expected()))?;
    let (least, most) = kind.n_places().into_inner();
    let expected = match least == most {
        true => format!("{least} places of three numbers each"),
        false => format!("{least} places of three numbers each, or more"),
    };
    let places_entry = section.need("places", &expected)?;
    let items = places_entry.items().ok_or_else(|| places_entry.wrong(expected.as_str()))?;
    if items.len() > MOST_PLACES {
        return Err(places_entry.too_many("places", MOST_PLACES, items.len()));
    }
    if !kind.n_places().contains(&items.len()) {
        return Err(places_entry.wrong(expected));
    }
    let places = items.iter().map(place).collect::<Result<_, _>>()?;
    let mut measure = Measure::new(kind, places);
    if let Some(entry) = section.find("name") {
        measure.name = text(&entry, "a name")?;
    }
    if let Some(entry) = section.find("text") {
        if kind != MeasureKind::Note {
            return Err(entry.wrong("`kind = \"note\"` beside it"));
        }
        measure.text = text(&entry, "a text")?;
    }
    if let Some(entry) = section.find("thickness") {
        if kind != MeasureKind::Profile {
            return Err(entry.wrong("`kind = \"profile\"` beside it"));
        }
        let expected = "a length above 0, at most 1e37";
        let thickness = entry.number(expected, |n| n > 0.0 && n <= 1e37)?;
        measure.thickness = Some(thickness);
    }
    if let Some(entry) = section.find("visible") {
        measure.hidden = !entry.flag()?;
    }
    Ok(Keyed { known: measure, unknown: section.unknown()? })
}

/// A text that is not too long.
fn text(entry: &Entry<'_>, what: &str) -> Result<String, Fault> {
    let text = entry.text().filter(|text| text.chars().count() <= LONGEST_NOTE);
    text.map(str::to_owned)
        .ok_or_else(|| entry.wrong(format!("{what} of at most {LONGEST_NOTE} characters")))
}

/// The entries of a measure.
pub(in crate::scene) fn entries(measure: &Keyed<Measure>) -> Entries {
    let Measure { kind, name, text, places, thickness, hidden } = &measure.known;
    let mut entries = vec![entry("kind", kind.name())];
    if !name.is_empty() {
        entries.push(entry("name", name.as_str()));
    }
    if !text.is_empty() {
        entries.push(entry("text", text.as_str()));
    }
    let places = places.iter().map(|place| vector(place.to_array())).collect();
    entries.push(entry("places", Value::Array(places)));
    entries.extend(thickness.map(|thickness| entry("thickness", thickness)));
    entries.extend(hidden.then(|| entry("visible", false)));
    with_unknown(&mut entries, &measure.unknown);
    entries
}
