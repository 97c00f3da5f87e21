//! Colours of categories: those of the classes of scans, and others by their number.

use super::maps::encoded;

/// Colours by category.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Palette {
    /// A colour of its own for each number, always the same.
    Numbers,
    /// Classes of scans, with their names.
    Classes,
}

/// Names that columns of classes have.
const CLASS_COLUMNS: [&str; 3] = ["classification", "scalar_classification", "class"];

/// Names of columns whose whole numbers are categories even where they are stored as floats.
const CATEGORY_COLUMNS: [&str; 4] = ["label", "scalar_label", "labels", "segment"];

impl Palette {
    /// The palette of a column, by its name.
    #[must_use]
    pub fn of_column(name: &str) -> Self {
        let is_class = CLASS_COLUMNS.iter().any(|known| known.eq_ignore_ascii_case(name));
        if is_class { Self::Classes } else { Self::Numbers }
    }

    /// Whether a column of this name holds categories, whatever type its numbers have.
    pub(super) fn names_categories(name: &str) -> bool {
        CLASS_COLUMNS.iter().chain(&CATEGORY_COLUMNS).any(|known| known.eq_ignore_ascii_case(name))
    }

    /// The colour of a category, sRGB-encoded.
    #[must_use]
    pub fn color(self, value: i64) -> [u8; 3] {
        let class = self.class(value);
        class.map_or_else(|| number_color(value), |(_, color)| color)
    }

    /// The name of a category, where it has one.
    #[must_use]
    pub fn name(self, value: i64) -> Option<&'static str> {
        self.class(value).map(|(name, _)| name)
    }

    fn class(self, value: i64) -> Option<(&'static str, [u8; 3])> {
        let value = usize::try_from(value).ok().filter(|_| self == Self::Classes)?;
        CLASSES.get(value).copied()
    }
}

/// Classes of scans by their number, each with a colour that is usual for it.
///
/// Source: American Society for Photogrammetry and Remote Sensing 2019, "LAS Specification 1.4 - R15",
/// table 17. Of 8 and 12, which it reserves, the names are those of earlier versions.
const CLASSES: [(&str, [u8; 3]); 23] = [
    ("never classified", [150, 150, 150]),
    ("unclassified", [188, 188, 188]),
    ("ground", [166, 118, 72]),
    ("low vegetation", [170, 208, 110]),
    ("medium vegetation", [96, 172, 72]),
    ("high vegetation", [30, 120, 50]),
    ("building", [214, 78, 60]),
    ("low noise", [240, 60, 200]),
    ("model key point", [250, 170, 60]),
    ("water", [56, 128, 214]),
    ("rail", [110, 84, 150]),
    ("road", [92, 96, 104]),
    ("overlap", [220, 200, 160]),
    ("wire guard", [250, 220, 90]),
    ("wire conductor", [250, 200, 20]),
    ("transmission tower", [120, 200, 220]),
    ("wire connector", [200, 160, 20]),
    ("bridge deck", [180, 130, 170]),
    ("high noise", [255, 120, 220]),
    ("overhead structure", [150, 170, 210]),
    ("ignored ground", [120, 90, 62]),
    ("snow", [236, 242, 250]),
    ("temporal exclusion", [70, 70, 70]),
];

/// Parts of a turn between the hues of neighbouring numbers: none of many comes near another.
const GOLDEN: f64 = 0.618_033_988_749_895;

/// Lightness and chroma of neighbouring numbers in turn, as [`oklch`] takes them.
const SHADES: [[f32; 2]; 3] = [[0.70, 0.15], [0.82, 0.12], [0.56, 0.14]];

/// The colour of a number; -1, which stands for none in many files, is grey.
fn number_color(value: i64) -> [u8; 3] {
    if value == -1 {
        return [120; 3];
    }
    let number = value.rem_euclid(1 << 20);
    let [lightness, chroma] = SHADES[(number % 3) as usize];
    // The first is blue.
    let hue = (0.72 + number as f64 * GOLDEN).fract();
    oklch(lightness, chroma, hue as f32 * std::f32::consts::TAU)
}

/// The sRGB-encoded colour of a lightness and a chroma and a hue in radians, cut off where it cannot be shown.
///
/// Source: Ottosson 2020, "A perceptual color space for image processing".
pub(super) fn oklch(lightness: f32, chroma: f32, hue: f32) -> [u8; 3] {
    oklab(lightness, chroma * hue.cos(), chroma * hue.sin())
}

/// The same of a place on the two axes of colour.
pub(super) fn oklab(lightness: f32, a: f32, b: f32) -> [u8; 3] {
    let long = lightness + 0.396_337_78 * a + 0.215_803_76 * b;
    let middle = lightness - 0.105_561_346 * a - 0.063_854_17 * b;
    let short = lightness - 0.089_484_18 * a - 1.291_485_5 * b;
    let [l, m, s] = [long, middle, short].map(|root| root * root * root);
    [
        encoded(4.076_741_7 * l - 3.307_711_6 * m + 0.230_969_94 * s),
        encoded(-1.268_438 * l + 2.609_757_4 * m - 0.341_319_4 * s),
        encoded(-0.004_196_086_3 * l - 0.703_418_6 * m + 1.707_614_7 * s),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn distance(a: [u8; 3], b: [u8; 3]) -> u32 {
        a.iter().zip(b).map(|(a, b)| u32::from(a.abs_diff(b)).pow(2)).sum()
    }

    #[test]
    fn a_dozen_neighbouring_categories_are_told_apart() {
        for (i, j) in (0..12).flat_map(|i| (i + 1..12).map(move |j| (i, j))) {
            let [a, b] = [i, j].map(|value| Palette::Numbers.color(value));
            assert!(distance(a, b) > 30 * 30, "{i} {a:?}, {j} {b:?}");
        }
    }

    #[test]
    fn classes_have_their_names_and_other_numbers_a_colour() {
        let palette = Palette::of_column("Classification");
        assert_eq!(palette, Palette::Classes);
        assert_eq!((palette.name(2), palette.name(6)), (Some("ground"), Some("building")));
        assert_eq!((palette.name(23), palette.name(-1)), (None, None));
        assert_eq!(palette.color(200), Palette::Numbers.color(200));
        assert_eq!(Palette::of_column("label"), Palette::Numbers);
        assert_eq!(Palette::Numbers.color(i64::MIN), Palette::Numbers.color(i64::MIN));
        for (i, j) in (0..23).flat_map(|i| (i + 1..23).map(move |j| (i, j))) {
            assert_ne!(palette.color(i), palette.color(j), "{i} {j}");
        }
    }

    #[test]
    fn greys_of_the_colour_space_are_grey() {
        assert_eq!(oklch(1.0, 0.0, 0.0), [255; 3]);
        assert_eq!(oklch(0.0, 0.0, 2.0), [0; 3]);
        let [r, g, b] = oklch(0.6, 0.0, 1.0);
        assert!(r.abs_diff(g) <= 1 && g.abs_diff(b) <= 1);
    }
}
