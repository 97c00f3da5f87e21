//! What colours surfels in a scene, and which are shown, as tables: `[color]` and `[[filter]]`.

use super::keyed::Keyed;
use super::limits::MOST_FILTER_VALUES;
use super::parts::hexadecimal_codes;
use super::source::{Entry, Fault, Section};
use crate::cloud::axis::Axis;
use crate::display::{
    Attribute, ColorBy, ColorSource, Filter, FilterAction, FilterTest, MapChoice, RangeEnd, Scale,
};
use crate::toml_text::{Entries, entry, vector, with_unknown};
use toml::Value;

/// The axis that points upwards.
pub(super) fn up(entry: &Entry<'_>) -> Result<Axis, Fault> {
    let up = entry.text().and_then(Axis::from_name);
    up.ok_or_else(|| entry.wrong("\"y\", \"z\", \"-y\", \"-z\", \"x\" or \"-x\""))
}

/// The section `color`.
pub(super) fn color(mut section: Section<'_>) -> Result<Keyed<ColorSource>, Fault> {
    let expected = "\"file\", \"uniform\", \"normal\", \"height\" or the name of a column";
    let by_entry = section.need("by", expected)?;
    let name = name(&by_entry, expected)?;
    let component = component(&mut section)?;
    let uniform = section.find("color");
    let by = match name {
        "file" => ColorBy::File,
        "normal" => ColorBy::Normal,
        "uniform" => {
            let expected = "a colour as \"#rrggbb\"";
            let entry = section.need("color", expected)?;
            let codes = entry.text().and_then(hexadecimal_codes);
            ColorBy::Uniform(codes.ok_or_else(|| entry.wrong(expected))?)
        }
        name => ColorBy::Attribute(Attribute::from_name(name)),
    };
    let mut source = ColorSource::new(by);
    source.by = with_component(source.by, component)?;
    if let Some(entry) = uniform.filter(|_| !matches!(source.by, ColorBy::Uniform(_))) {
        return Err(entry.wrong("`by = \"uniform\"` beside it"));
    }
    if let Some(entry) = section.find("map") {
        let names = MapChoice::ALL.map(MapChoice::name).join(", ");
        let map = entry.text().and_then(MapChoice::from_name);
        source.map = map.ok_or_else(|| entry.wrong(format!("one of {names}")))?;
    }
    if let Some(entry) = section.find("scale") {
        let scale = entry.text().and_then(Scale::from_name);
        source.scale = scale.ok_or_else(|| entry.wrong("\"linear\" or \"log\""))?;
    }
    if let Some(entry) = section.find("range") {
        source.range = range(&entry)?;
    }
    Ok(Keyed { known: source, unknown: section.unknown()? })
}

/// A name that is not empty.
fn name<'a>(entry: &Entry<'a>, expected: &str) -> Result<&'a str, Fault> {
    let name = entry.text().filter(|name| !name.trim().is_empty() && *name != "column:");
    name.ok_or_else(|| entry.wrong(expected))
}

/// The component of a column, where one is given.
fn component<'a>(section: &mut Section<'a>) -> Result<Option<(u32, Entry<'a>)>, Fault> {
    let Some(entry) = section.find("component") else { return Ok(None) };
    let component = entry.whole().and_then(|whole| u32::try_from(whole).ok());
    let component = component.ok_or_else(|| entry.wrong("a component, counted from 0"))?;
    Ok(Some((component, entry)))
}

fn with_component(by: ColorBy, component: Option<(u32, Entry<'_>)>) -> Result<ColorBy, Fault> {
    match (by, component) {
        (ColorBy::Attribute(attribute), component) => {
            attribute_with(attribute, component).map(ColorBy::Attribute)
        }
        (by, None) => Ok(by),
        (_, Some((_, entry))) => Err(entry.wrong("the name of a column in `by` beside it")),
    }
}

fn attribute_with(
    attribute: Attribute,
    component: Option<(u32, Entry<'_>)>,
) -> Result<Attribute, Fault> {
    match (attribute, component) {
        (Attribute::Height, Some((_, entry))) => {
            Err(entry.wrong("the name of a column beside it: heights have no components"))
        }
        (attribute, component) => {
            Ok(attribute.with_component(component.map_or(0, |(component, _)| component)))
        }
    }
}

/// The ends of a range: numbers, or percentages as text.
fn range(entry: &Entry<'_>) -> Result<[RangeEnd; 2], Fault> {
    let expected = "two numbers or percentages such as \"5%\", the lower first";
    let items = entry.items().ok_or_else(|| entry.wrong(expected))?;
    let end = |item: &Entry<'_>| match item.text() {
        Some(text) => RangeEnd::parse(text).filter(|end| matches!(end, RangeEnd::Percent(_))),
        None => item.number("", f64::is_finite).ok().map(RangeEnd::Value),
    };
    let ends: Option<Vec<RangeEnd>> = items.iter().map(end).collect();
    match ends.as_deref() {
        Some([low, high]) if low.is_below(*high) => Ok([*low, *high]),
        _ => Err(entry.wrong(expected)),
    }
}

/// A table of `filter`.
pub(super) fn filter(mut section: Section<'_>) -> Result<Keyed<Filter>, Fault> {
    let expected = "\"height\" or the name of a column";
    let attribute = Attribute::from_name(name(&section.need("column", expected)?, expected)?);
    let component = component(&mut section)?;
    let attribute = attribute_with(attribute, component)?;
    let expected = "\"keep\" or \"hide\"";
    let action = section.need("action", expected)?;
    let action =
        action.text().and_then(FilterAction::from_name).ok_or_else(|| action.wrong(expected))?;
    let test = match (section.find("range"), section.find("values")) {
        (Some(_), Some(entry)) => return Err(entry.wrong("either `range` or `values`, not both")),
        (Some(entry), None) => {
            let expected = "two numbers, the lower first, which may be inf";
            let [low, high] = entry.numbers::<2>(expected, |number| !number.is_nan())?;
            if low > high {
                return Err(entry.wrong(expected));
            }
            FilterTest::Range([low, high])
        }
        (None, Some(entry)) => FilterTest::Values(values(&entry)?),
        (None, None) => {
            let expected = "two numbers, or `values` with whole numbers";
            return Err(match section.need("range", expected) {
                Err(missing) => missing,
                Ok(entry) => entry.wrong(expected),
            });
        }
    };
    let filter = Filter { attribute, action, test };
    Ok(Keyed { known: filter, unknown: section.unknown()? })
}

fn values(entry: &Entry<'_>) -> Result<Vec<i64>, Fault> {
    let expected = "whole numbers, at least one";
    let items = entry.items().ok_or_else(|| entry.wrong(expected))?;
    if items.len() > MOST_FILTER_VALUES {
        return Err(entry.too_many("values", MOST_FILTER_VALUES, items.len()));
    }
    let values: Option<Vec<i64>> = items.iter().map(Entry::whole).collect();
    values.filter(|values| !values.is_empty()).ok_or_else(|| entry.wrong(expected))
}

/// The entries of `color`; none where everything is as usual.
pub(super) fn color_entries(color: &Keyed<ColorSource>) -> Option<Entries> {
    let ColorSource { by, map, scale, range } = &color.known;
    if color.known == ColorSource::default() && color.unknown.is_empty() {
        return None;
    }
    let mut entries = match by {
        ColorBy::File => vec![entry("by", "file")],
        ColorBy::Normal => vec![entry("by", "normal")],
        ColorBy::Uniform([red, green, blue]) => {
            let color = format!("#{red:02x}{green:02x}{blue:02x}");
            vec![entry("by", "uniform"), entry("color", color)]
        }
        ColorBy::Attribute(attribute) => attribute_entries("by", attribute),
    };
    if *map != MapChoice::Automatic {
        entries.push(entry("map", map.name()));
    }
    if *scale != Scale::Linear {
        entries.push(entry("scale", scale.name()));
    }
    if *range != ColorSource::USUAL_RANGE {
        let end = |end: RangeEnd| match end {
            RangeEnd::Value(value) => Value::Float(value),
            percent @ RangeEnd::Percent(_) => Value::String(percent.to_string()),
        };
        entries.push(entry("range", Value::Array(range.map(end).to_vec())));
    }
    with_unknown(&mut entries, &color.unknown);
    Some(entries)
}

fn attribute_entries(key: &str, attribute: &Attribute) -> Entries {
    let mut entries = vec![entry(key, attribute.name())];
    if attribute.component() > 0 {
        entries.push(entry("component", i64::from(attribute.component())));
    }
    entries
}

pub(super) fn filter_entries(filter: &Keyed<Filter>) -> Entries {
    let Filter { attribute, action, test } = &filter.known;
    let mut entries = attribute_entries("column", attribute);
    entries.push(entry("action", action.name()));
    entries.push(match test {
        FilterTest::Range(range) => entry("range", vector(*range)),
        FilterTest::Values(values) => {
            entry("values", Value::Array(values.iter().copied().map(Value::Integer).collect()))
        }
    });
    with_unknown(&mut entries, &filter.unknown);
    entries
}
