//! Colours of files as columns: 8 or 16 bits a channel.

use crate::read::fields::Field;
use e57::{ColorLimits, RecordValue};
use surfelshop_api::columns::{Element, NEUTRAL_ALBEDO};
use surfelshop_api::params::linear_to_srgb;

/// How values of a file become those of a column: `(value - min) * factor`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ColorScale {
    /// `u8` or `u16`.
    pub(crate) element: Element,
    pub(crate) min: f64,
    pub(crate) factor: f64,
}

impl ColorScale {
    /// The scale of three fields, and a line where it had to be guessed.
    ///
    /// The file's limits count where they are the same for all channels: they are those of the device then. Limits
    /// that differ are, in files that are found, the smallest and largest value of each channel, and scaling
    /// from them would change hues; they say only how many bits a channel has. The same goes for the ranges
    /// of the fields where there are no limits.
    pub(crate) fn new(fields: [&Field; 3], limits: Option<&ColorLimits>) -> (Self, Option<String>) {
        let whole = fields.iter().all(|field| field.is_whole());
        let declared = common(fields.map(Field::limits));
        let stated = common(limits.map_or([None; 3], |limits| stated(fields, limits)));
        let range = match (stated, declared) {
            // Fields that cannot hold what the limits say know better.
            (Some(stated), Some(declared)) if whole && inside(declared, stated) => Some(declared),
            (stated, declared) => stated.or(declared),
        };
        let guess = if whole { [0.0, 255.0] } else { [0.0, 1.0] };
        let doubt = range.is_none().then(|| {
            format!("colours have no limits in the file and are taken as 0 to {}", guess[1])
        });
        let [min, max] = range.unwrap_or(guess);
        let narrow = if whole { max - min <= 255.0 } else { [min, max] == [0.0, 255.0] };
        let element = if narrow { Element::U8 } else { Element::U16 };
        let scale = Self { element, min, factor: most(element) / (max - min) };
        (scale, doubt)
    }

    /// The same colours with 16 bits.
    pub(crate) fn widened(self) -> Self {
        let factor = self.factor * 65535.0 / most(self.element);
        Self { element: Element::U16, factor, ..self }
    }

    /// Whether values of the file are those of the column.
    pub(crate) fn is_identity(&self) -> bool {
        (self.min, self.factor) == (0.0, 1.0)
    }

    /// What stands for a colour that is invalid, in each channel.
    pub(crate) fn neutral(&self) -> i64 {
        // 188 of 255, which fits.
        (f64::from(linear_to_srgb(NEUTRAL_ALBEDO[0])) * most(self.element)).round() as i64
    }
}

fn most(element: Element) -> f64 {
    if element == Element::U8 { 255.0 } else { 65535.0 }
}

/// The range that is meant by those of three channels.
fn common(channels: [Option<[f64; 2]>; 3]) -> Option<[f64; 2]> {
    let [Some(r), Some(g), Some(b)] = channels else { return None };
    let all = [r[0].min(g[0]).min(b[0]), r[1].max(g[1]).max(b[1])];
    let usual = [[0.0, 1.0], [0.0, 255.0], [0.0, 65535.0]];
    // Numbers without bounds are declared with those of 64 bits.
    if !(all[1] > all[0] && all[1] - all[0] < 1e12) {
        return None;
    }
    if r == g && g == b {
        return Some(all);
    }
    Some(usual.into_iter().find(|usual| inside(all, *usual)).unwrap_or(all))
}

/// Whether a range is a part of another.
fn inside(part: [f64; 2], whole: [f64; 2]) -> bool {
    part[0] >= whole[0] && part[1] <= whole[1]
}

/// The limits of each channel, in the values of its field.
fn stated(fields: [&Field; 3], limits: &ColorLimits) -> [Option<[f64; 2]>; 3] {
    let ends = [
        (&limits.red_min, &limits.red_max),
        (&limits.green_min, &limits.green_max),
        (&limits.blue_min, &limits.blue_max),
    ];
    let mut all = [None; 3];
    for ((limit, field), (min, max)) in all.iter_mut().zip(fields).zip(ends) {
        let value = |value: &Option<RecordValue>| match value.as_ref()? {
            RecordValue::Single(value) => Some(f64::from(*value)),
            RecordValue::Double(value) => Some(*value),
            RecordValue::Integer(value) => Some(*value as f64),
            RecordValue::ScaledInteger(value) => Some(field.scaled(*value)),
        };
        *limit = value(min).zip(value(max)).map(|(min, max)| [min, max]);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use e57::{Record, RecordDataType, RecordName};

    fn field(data_type: RecordDataType) -> Field {
        Field::new(&Record { name: RecordName::ColorRed, data_type })
    }

    fn scale(data_type: &RecordDataType, limits: Option<[[f64; 2]; 3]>) -> (Element, f64, f64) {
        let field = field(data_type.clone());
        let value = |value: f64| Some(RecordValue::Double(value));
        let limits = limits.map(|[r, g, b]| ColorLimits {
            red_min: value(r[0]),
            red_max: value(r[1]),
            green_min: value(g[0]),
            green_max: value(g[1]),
            blue_min: value(b[0]),
            blue_max: value(b[1]),
        });
        let (scale, _) = ColorScale::new([&field; 3], limits.as_ref());
        (scale.element, scale.min, scale.factor)
    }

    #[test]
    fn limits_that_all_channels_share_are_those_of_the_device() {
        let all = |min, max| Some([[min, max]; 3]);
        assert_eq!(scale(&RecordDataType::U8, all(0.0, 255.0)), (Element::U8, 0.0, 1.0));
        assert_eq!(scale(&RecordDataType::U16, all(0.0, 255.0)), (Element::U8, 0.0, 1.0));
        assert_eq!(scale(&RecordDataType::U16, all(0.0, 65535.0)), (Element::U16, 0.0, 1.0));
        let (element, min, factor) = scale(&RecordDataType::U16, all(0.0, 4095.0));
        assert_eq!((element, min, (4095.0 * factor).round()), (Element::U16, 0.0, 65535.0));
        assert_eq!(scale(&RecordDataType::F32, all(0.0, 1.0)), (Element::U16, 0.0, 65535.0));
        assert_eq!(scale(&RecordDataType::F32, all(0.0, 255.0)), (Element::U8, 0.0, 1.0));
        // Bytes are not what is said to be a part of 65535.
        assert_eq!(scale(&RecordDataType::U8, all(0.0, 65535.0)), (Element::U8, 0.0, 1.0));
    }

    #[test]
    fn limits_that_differ_only_say_how_many_bits_there_are() {
        let differ = Some([[3.0, 250.0], [0.0, 190.0], [7.0, 255.0]]);
        assert_eq!(scale(&RecordDataType::U8, differ), (Element::U8, 0.0, 1.0));
        assert_eq!(scale(&RecordDataType::F32, differ), (Element::U8, 0.0, 1.0));
        let differ = Some([[3.0, 250.0], [0.0, 19000.0], [7.0, 255.0]]);
        assert_eq!(scale(&RecordDataType::U16, differ), (Element::U16, 0.0, 1.0));
        let differ = Some([[0.25, 1.0], [0.0, 0.5], [0.0, 0.5]]);
        assert_eq!(scale(&RecordDataType::F32, differ), (Element::U16, 0.0, 65535.0));
    }

    #[test]
    fn without_limits_the_fields_count_and_then_a_guess() {
        assert_eq!(scale(&RecordDataType::U16, None), (Element::U16, 0.0, 1.0));
        assert_eq!(scale(&RecordDataType::F32, None), (Element::U16, 0.0, 65535.0));
        let unbounded = RecordDataType::Integer { min: i64::MIN, max: i64::MAX };
        assert_eq!(scale(&unbounded, None), (Element::U8, 0.0, 1.0));
        let (_, doubt) = ColorScale::new([&field(unbounded); 3], None);
        assert!(doubt.unwrap().contains("0 to 255"));
        for limits in [[0.0, 0.0], [f64::NAN, 255.0], [255.0, 0.0]] {
            assert_eq!(scale(&RecordDataType::U8, Some([limits; 3])), (Element::U8, 0.0, 1.0));
        }
        let (scale, _) = ColorScale::new([&field(RecordDataType::U8); 3], None);
        assert_eq!((scale.neutral(), scale.is_identity()), (188, true));
        let wide = scale.widened();
        assert_eq!(
            (wide.element, wide.factor, wide.widened() == wide),
            (Element::U16, 257.0, true)
        );
    }
}
