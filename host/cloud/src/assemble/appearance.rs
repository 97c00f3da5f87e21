//! Appearance: colour, ambient occlusion and material.

use crate::cloud::buffer::{Buffer, interleave};
use crate::cloud::color::is_usable;
use crate::cloud::column::Column;
use crate::options::ColorBits;
use crate::summary::Summary;
use crate::table::{COLORS, Field, Table};
use surfelshop_api::columns::NEUTRAL_ALBEDO;
use surfelshop_api::columns::{AO, COLOR, Element, MATERIAL};

/// Takes colour, accessibility and material out of the table.
pub(super) fn take(table: &mut Table, bits: ColorBits, summary: &mut Summary) -> Vec<Column> {
    let color = color(table, bits, summary);
    if color.is_none() {
        summary.colors.neutral = table.n_rows as u64;
    }
    let ao = accessibility(table, summary);
    [color, ao, material(table, summary)].into_iter().flatten().collect()
}

/// What is said of colours that are narrower than their type.
pub(crate) const NARROW_COLORS: &str = "the 16-bit colours hold 8-bit values and were read as such; `--color-bits 16` reads them as 16-bit values";

fn color(table: &mut Table, bits: ColorBits, summary: &mut Summary) -> Option<Column> {
    let (components, mut values) = COLORS
        .iter()
        .find_map(|names| whole(table, names).or_else(|| woven(table, names, summary)))?;
    match &mut values {
        Buffer::F32(values) => sanitise(values, components, summary),
        Buffer::U16(wide) => {
            if let Some(narrow) = eight_bits(wide, bits).filter(|_| !table.is_part) {
                if bits == ColorBits::Told {
                    summary.warnings.push(NARROW_COLORS.to_owned());
                }
                values = Buffer::U8(narrow);
            }
        }
        _ => {}
    }
    summary.colors.given = table.n_rows as u64 - summary.colors.replaced;
    Some(Column::new(COLOR, components as u32, values))
}

/// 16-bit colours as 8-bit ones, where none is larger than those can be: programs that write LAS files often
/// leave them unscaled. Black stays as it is.
fn eight_bits(wide: &[u16], bits: ColorBits) -> Option<Vec<u8>> {
    let most = wide.iter().copied().max().unwrap_or(0);
    bits.are_eight(most).then(|| narrowed(wide))
}

/// Values of 16 bits as those of 8; larger ones are taken as 255.
#[must_use]
pub fn narrowed(wide: &[u16]) -> Vec<u8> {
    wide.iter().map(|&value| u8::try_from(value).unwrap_or(u8::MAX)).collect()
}

/// Colours that the file has as the cloud will have them, and how many channels they have.
fn whole(table: &mut Table, names: &[&str; 4]) -> Option<(usize, Buffer)> {
    let n_channels =
        if table.names().any(|own| own.eq_ignore_ascii_case(names[3])) { 4 } else { 3 };
    let names = &names[..n_channels];
    let kept = [Element::U8, Element::U16, Element::F32];
    table.woven(names).filter(|values| kept.contains(&values.element()))?;
    Some((n_channels, table.take_woven(names)?))
}

/// Colours put together from channels that the file has apart or in another type.
fn woven(table: &mut Table, names: &[&str; 4], summary: &mut Summary) -> Option<(usize, Buffer)> {
    let [red, green, blue, alpha] = *names;
    let rgb = table.take([red, green, blue])?;
    let field = |name: &str, values| Field { names: vec![name.to_owned()], values };
    let Some(mut channels) = channels(&rgb) else {
        summary.warnings.push(
            "colours are neither 8 nor 16 bits nor floats and were kept as plain columns"
                .to_owned(),
        );
        table.fields.extend(names.iter().zip(rgb).map(|(name, values)| field(name, values)));
        return None;
    };
    if let Some([values]) = table.take([alpha]) {
        if values.element() == rgb[0].element()
            && let Some(values) = convert(&values, channels[0].element())
        {
            channels.push(values);
        } else if let (Buffer::U8(narrow), Buffer::U16(_)) = (&values, &channels[0]) {
            // LAS files have 16 bits for colours and no field for the opacity of 8 beside them.
            channels
                .push(Buffer::U16(narrow.iter().map(|&value| u16::from(value) * 257).collect()));
        } else {
            table.fields.push(field(alpha, values));
        }
    }
    Some((channels.len(), interleave(&channels)?))
}

/// The channels in the smallest of the types a colour may have that holds them.
fn channels(rgb: &[Buffer; 3]) -> Option<Vec<Buffer>> {
    if rgb.iter().any(|channel| channel.element() != rgb[0].element()) {
        return None;
    }
    let target = match rgb[0].element() {
        Element::F32 | Element::F64 => Element::F32,
        Element::U8 => Element::U8,
        Element::U16 => Element::U16,
        // Signed and 32-bit types hold 8 or 16-bit colours in files of some programs.
        Element::I8 | Element::I16 | Element::I32 | Element::U32 => {
            let most = rgb.iter().flat_map(Buffer::iter_f64).fold(0.0, f64::max);
            if most <= f64::from(u8::MAX) { Element::U8 } else { Element::U16 }
        }
    };
    rgb.iter().map(|channel| convert(channel, target)).collect()
}

/// The values in another type; `None` where it does not hold them.
fn convert(buffer: &Buffer, target: Element) -> Option<Buffer> {
    if buffer.element() == target {
        return Some(buffer.clone());
    }
    let mut converted = Buffer::with_capacity(target, buffer.len());
    buffer.iter_f64().all(|value| converted.push(value)).then_some(converted)
}

/// Replaces float colours that cannot be shaded with; opacity that is not finite becomes 1.
fn sanitise(values: &mut [f32], components: usize, summary: &mut Summary) {
    let mut most: f32 = 0.0;
    for surfel in values.chunks_exact_mut(components) {
        let (color, alpha) = surfel.split_at_mut(3);
        if !is_usable(color) {
            color.copy_from_slice(&NEUTRAL_ALBEDO);
            summary.colors.replaced += 1;
        }
        most = color.iter().copied().fold(most, f32::max);
        for alpha in alpha.iter_mut().filter(|alpha| !alpha.is_finite()) {
            *alpha = 1.0;
        }
    }
    if most > 1.0 {
        summary.warnings.push(format!(
            "float colours reach {most}; an albedo above 1 makes more light than it receives"
        ));
    }
}

/// Accessibility in [0, 1]; other numbers are clamped, and what is not a number counts as open.
fn accessibility(table: &mut Table, summary: &mut Summary) -> Option<Column> {
    let [values] = table.take([AO])?;
    // Integers have the whole range of their type.
    let scale = match values.element() {
        Element::U8 => f32::from(u8::MAX),
        Element::U16 => f32::from(u16::MAX),
        _ => 1.0,
    };
    let mut values = values.to_f32();
    let mut changed = 0u64;
    for value in &mut values {
        let scaled = *value / scale;
        let open = if scaled.is_nan() { 1.0 } else { scaled.clamp(0.0, 1.0) };
        changed += u64::from(open.to_bits() != scaled.to_bits() && open != scaled);
        *value = open;
    }
    if changed > 0 {
        summary.warnings.push(format!("{changed} values of `ao` were outside [0, 1]"));
    }
    Some(Column::new(AO, 1, Buffer::F32(values)))
}

/// Indices into the material table; what is no index becomes 0.
fn material(table: &mut Table, summary: &mut Summary) -> Option<Column> {
    let [values] = table.take([MATERIAL])?;
    let mut replaced = 0u64;
    let indices: Vec<u32> = values
        .iter_f64()
        .map(|value| {
            let fits = value.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&value);
            replaced += u64::from(!fits);
            if fits { value as u32 } else { 0 }
        })
        .collect();
    if replaced > 0 {
        summary
            .warnings
            .push(format!("{replaced} values of `material` were no index and became 0"));
    }
    Some(Column::new(MATERIAL, 1, Buffer::U32(indices)))
}
