//! Numbers of measures as text: short ones for labels, whole ones for files.

use super::{Measure, MeasureKind, Quantity, QuantityKind};
use glam::DVec3;

/// How numbers are told.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Units {
    /// Metres of a scene unit; `None` where nobody knows.
    pub metres: Option<f64>,
}

/// Digits of a label.
const DIGITS: i32 = 5;

impl Units {
    /// A number with its unit, of five digits: `2.4187 m`, `14.2°`; in scene units without one where nobody knows how long
    /// these are.
    #[must_use]
    pub fn text(self, quantity: &Quantity) -> String {
        let value = quantity.value;
        let power = match quantity.kind {
            QuantityKind::Length => 1,
            QuantityKind::Area => 2,
            QuantityKind::Volume => 3,
            QuantityKind::Degrees => return format!("{}°", short(value)),
            QuantityKind::Share => return format!("{} %", short(100.0 * value)),
            QuantityKind::Count => return format!("{value:.0}"),
        };
        let Some(metres) = self.metres else { return short(value) };
        let value = value * metres.powi(power);
        // The unit of which there is one or more, by its side.
        let side = value.abs().powf(1.0 / f64::from(power));
        let (unit, metres) = match side {
            side if side >= 1000.0 && power == 1 => ("km", 1000.0),
            side if side >= 1.0 || side <= 0.0 => ("m", 1.0),
            side if side >= 0.01 => ("cm", 0.01),
            side if side >= 0.001 => ("mm", 0.001),
            _ => ("µm", 1e-6),
        };
        let exponent = ["", "²", "³"][power as usize - 1];
        format!("{} {unit}{exponent}", short(value / f64::powi(metres, power)))
    }

    /// The number of a file: in metres, square metres or cubic metres where these are known, else in scene units; with all
    /// digits.
    #[must_use]
    pub fn number(self, quantity: &Quantity) -> f64 {
        let metres = self.metres.unwrap_or(1.0);
        match quantity.kind {
            QuantityKind::Length => quantity.value * metres,
            QuantityKind::Area => quantity.value * metres.powi(2),
            QuantityKind::Volume => quantity.value * metres.powi(3),
            QuantityKind::Degrees | QuantityKind::Share | QuantityKind::Count => quantity.value,
        }
    }

    /// The unit of [`Units::number`]; empty for shares and counts.
    #[must_use]
    pub fn unit(self, kind: QuantityKind) -> &'static str {
        match (kind, self.metres) {
            (QuantityKind::Degrees, _) => "degrees",
            (QuantityKind::Share | QuantityKind::Count, _) => "",
            (QuantityKind::Length, Some(_)) => "m",
            (QuantityKind::Area, Some(_)) => "m2",
            (QuantityKind::Volume, Some(_)) => "m3",
            (QuantityKind::Length, None) => "units",
            (QuantityKind::Area, None) => "units2",
            (QuantityKind::Volume, None) => "units3",
        }
    }

    /// The label of a measure: its name where it has one, and its first number; the text of a note. `of_surfels` are the
    /// numbers that it has besides, which count first for a volume.
    #[must_use]
    pub fn label(self, measure: &Measure, up: DVec3, of_surfels: &[Quantity]) -> String {
        let own = measure.quantities(up);
        let first = match measure.kind {
            MeasureKind::Note => return measure.note().to_owned(),
            // Until it is known, nothing is told in its place.
            MeasureKind::Volume => of_surfels.first(),
            _ => own.first(),
        };
        let number = first.map(|quantity| self.text(quantity)).unwrap_or_default();
        let parts = [measure.name.trim(), number.as_str()];
        let parts: Vec<&str> = parts.into_iter().filter(|part| !part.is_empty()).collect();
        parts.join("  ")
    }
}

impl Measure {
    /// The text of a note, or its name where it has none.
    fn note(&self) -> &str {
        match self.text.trim() {
            "" => self.name.trim(),
            text => text,
        }
    }
}

/// A number of five digits, without zeros behind the point.
fn short(value: f64) -> String {
    if value.abs() >= 1e9 || (value != 0.0 && value.abs() < 1e-6) {
        return format!("{value:.4e}");
    }
    let before = if value.abs() < 1.0 { 0 } else { value.abs().log10().floor() as i32 + 1 };
    // Of what is below 1, zeros behind the point are no digits.
    let zeros =
        if value.abs() < 1.0 && value != 0.0 { -value.abs().log10().floor() as i32 - 1 } else { 0 };
    let places = (DIGITS - before).max(0) + zeros.max(0);
    let text = format!("{value:.*}", places as usize);
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}
