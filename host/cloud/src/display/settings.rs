//! What colours surfels, which are shown and how they look, as a scene says it.

use super::filter::Filter;
use super::hidden::HIDDEN;
use super::maps::ColorMap;
use super::splat_settings::SplatSettings;
use crate::cloud::Cloud;
use crate::cloud::axis::Axis;
use serde::{Deserialize, Serialize};

/// How clouds are displayed: what colours their surfels, which of them are shown, and how they look.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DisplaySettings {
    /// What colours surfels.
    pub color: ColorSource,
    /// Surfels are shown that all of these let through.
    pub filters: Vec<Filter>,
    /// How surfels look.
    pub splats: SplatSettings,
    /// The axis that heights are measured along.
    pub up: Axis,
}

impl DisplaySettings {
    /// Whether clouds are displayed as they are.
    pub fn is_plain<'a>(&self, mut clouds: impl Iterator<Item = &'a Cloud>) -> bool {
        let is_plain = self.color.by == ColorBy::File && self.filters.is_empty();
        is_plain && clouds.all(|cloud| self.splats.leaves(cloud) && cloud.column(HIDDEN).is_none())
    }
}

/// What colours surfels, and how its numbers become colours.
#[derive(Clone, Debug, PartialEq)]
pub struct ColorSource {
    /// What colours them.
    pub by: ColorBy,
    /// What numbers become.
    pub map: MapChoice,
    /// How numbers are spread over the map.
    pub scale: Scale,
    /// The numbers at the two ends of the map, the lower first. Numbers beyond have the colours of the ends.
    pub range: [RangeEnd; 2],
}

impl ColorSource {
    /// The range where none is said: a few numbers far from all others do not take the map for themselves.
    pub const USUAL_RANGE: [RangeEnd; 2] = [RangeEnd::Percent(2.0), RangeEnd::Percent(98.0)];

    /// Colours by a column that holds shares: 0 is black and 1 white.
    #[must_use]
    pub fn of_share(column: &str) -> Self {
        let attribute = Attribute::Column { name: column.to_owned(), component: 0 };
        Self {
            by: ColorBy::Attribute(attribute),
            map: MapChoice::Map(ColorMap::Grey),
            scale: Scale::default(),
            range: [RangeEnd::Value(0.0), RangeEnd::Value(1.0)],
        }
    }

    /// Colours by something, in the usual way.
    #[must_use]
    pub fn new(by: ColorBy) -> Self {
        let (map, scale) = (MapChoice::default(), Scale::default());
        Self { by, map, scale, range: Self::USUAL_RANGE }
    }
}

impl std::fmt::Display for ColorSource {
    /// For people: `height, turbo, log, from 5% to 12.0`, without what is as usual.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.by {
            ColorBy::File => f.write_str("file")?,
            ColorBy::Normal => f.write_str("normal")?,
            ColorBy::Uniform([red, green, blue]) => write!(f, "#{red:02x}{green:02x}{blue:02x}")?,
            ColorBy::Attribute(attribute) => f.write_str(&attribute.title())?,
        }
        if self.map != MapChoice::Automatic {
            write!(f, ", {}", self.map.name())?;
        }
        if self.scale != Scale::Linear {
            write!(f, ", {}", self.scale.name())?;
        }
        if self.range != Self::USUAL_RANGE {
            write!(f, ", from {} to {}", self.range[0], self.range[1])?;
        }
        Ok(())
    }
}

impl Default for ColorSource {
    fn default() -> Self {
        Self::new(ColorBy::File)
    }
}

/// What colours surfels.
#[derive(Clone, Debug, PartialEq)]
pub enum ColorBy {
    /// The colours of the file, neutral where it has none.
    File,
    /// One colour for all, sRGB-encoded.
    Uniform([u8; 3]),
    /// The direction of the normal: its azimuth is the hue, and what faces upwards is light.
    Normal,
    /// A number of each surfel.
    Attribute(Attribute),
}

/// A number of each surfel.
#[derive(Clone, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Attribute {
    /// The world coordinate along the scene's upward axis, scene units.
    Height,
    /// A component of a column.
    Column {
        /// The column's name.
        name: String,
        /// The component, counted from 0.
        component: u32,
    },
}

/// What stands before the name of a column that is called like something else.
const PREFIX: &str = "column:";

/// Names that are no columns.
const RESERVED: [&str; 4] = ["file", "uniform", "normal", "height"];

impl Attribute {
    /// The first component of a column.
    #[must_use]
    pub fn column(name: impl Into<String>) -> Self {
        Self::Column { name: name.into(), component: 0 }
    }

    /// The attribute of a name: `height`, or that of a column, which stands behind `column:` where it is
    /// called like something else.
    #[must_use]
    pub fn from_name(name: &str) -> Self {
        match name.strip_prefix(PREFIX) {
            Some(column) => Self::column(column),
            None if name == "height" => Self::Height,
            None => Self::column(name),
        }
    }

    /// The name that is read as this one, but for the component.
    #[must_use]
    pub fn name(&self) -> String {
        match self {
            Self::Height => "height".to_owned(),
            Self::Column { name, .. }
                if RESERVED.contains(&name.as_str()) || name.starts_with(PREFIX) =>
            {
                format!("{PREFIX}{name}")
            }
            Self::Column { name, .. } => name.clone(),
        }
    }

    /// The component of a column; 0 for heights.
    #[must_use]
    pub fn component(&self) -> u32 {
        match self {
            Self::Height => 0,
            Self::Column { component, .. } => *component,
        }
    }

    /// The same with another component; heights have none.
    #[must_use]
    pub fn with_component(self, component: u32) -> Self {
        match self {
            Self::Height => Self::Height,
            Self::Column { name, .. } => Self::Column { name, component },
        }
    }

    /// What it is called among people: `height`, `intensity` or `normal[2]`.
    #[must_use]
    pub fn title(&self) -> String {
        match self {
            Self::Height => "height".to_owned(),
            Self::Column { name, component: 0 } => name.clone(),
            Self::Column { name, component } => format!("{name}[{component}]"),
        }
    }
}

/// What the numbers of an attribute become.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MapChoice {
    /// Categories where a column holds few different whole numbers, else [`ColorMap::Viridis`].
    #[default]
    Automatic,
    /// Colours of a map.
    Map(ColorMap),
    /// A colour for each whole number.
    Categories,
}

impl MapChoice {
    /// All but the automatic one.
    pub const ALL: [Self; 5] = [
        Self::Map(ColorMap::Viridis),
        Self::Map(ColorMap::Turbo),
        Self::Map(ColorMap::Grey),
        Self::Map(ColorMap::Diverging),
        Self::Categories,
    ];

    /// The name in files and on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Automatic => "automatic",
            Self::Map(map) => map.name(),
            Self::Categories => "categories",
        }
    }

    /// The choice of a name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        let name = if name == "gray" { "grey" } else { name };
        [Self::Automatic].into_iter().chain(Self::ALL).find(|choice| choice.name() == name)
    }
}

/// How numbers are spread over a map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    /// Evenly.
    #[default]
    Linear,
    /// Equal ratios as equal steps. What is not above 0 has the colour of the lower end.
    Logarithmic,
}

impl Scale {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Linear, Self::Logarithmic];

    /// The name in files and on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Logarithmic => "log",
        }
    }

    /// The scale of a name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|scale| scale.name() == name)
    }
}

/// One end of a range of numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RangeEnd {
    /// The number below which so many percent of all lie, 0 to 100.
    Percent(f64),
    /// A number, finite.
    Value(f64),
}

impl RangeEnd {
    /// Reads `5%` or `0.25`; `None` where it is no such thing.
    #[must_use]
    pub fn parse(text: &str) -> Option<Self> {
        let number = |text: &str| text.trim().parse().ok().filter(|n: &f64| n.is_finite());
        match text.trim().strip_suffix('%') {
            Some(percent) => Some(Self::Percent(number(percent)?)).filter(|end| end.is_valid()),
            None => number(text).map(Self::Value),
        }
    }

    /// Whether it is a finite number, or a percentage from 0 to 100.
    #[must_use]
    pub fn is_valid(self) -> bool {
        match self {
            Self::Percent(percent) => (0.0..=100.0).contains(&percent),
            Self::Value(value) => value.is_finite(),
        }
    }

    /// Whether this end may be the lower one of a range with another; ends of different kinds are compared
    /// when the numbers are known.
    #[must_use]
    pub fn is_below(self, upper: Self) -> bool {
        match (self, upper) {
            (Self::Percent(low), Self::Percent(high)) | (Self::Value(low), Self::Value(high)) => {
                low <= high
            }
            _ => true,
        }
    }
}

impl std::fmt::Display for RangeEnd {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Percent(percent) => write!(f, "{percent}%"),
            Self::Value(value) => write!(f, "{value:?}"),
        }
    }
}

/// The whole number that a float is; `None` where it has a fraction or cannot be told from its neighbours.
pub(super) fn whole(number: f64) -> Option<i64> {
    const MOST: f64 = (1u64 << 53) as f64;
    (number.fract() == 0.0 && number.abs() <= MOST).then_some(number as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_that_are_called_like_something_else_have_a_name_of_their_own() {
        for name in ["height", "normal", "file", "uniform", "column:", "intensity", "a b"] {
            let column = Attribute::column(name);
            assert_eq!(Attribute::from_name(&column.name()), column, "{name}");
        }
        assert_eq!(Attribute::from_name("height"), Attribute::Height);
        assert_eq!(Attribute::from_name("column:height"), Attribute::column("height"));
        assert_eq!(Attribute::column("ao").with_component(2).title(), "ao[2]");
    }

    #[test]
    fn ends_of_ranges_are_read_as_they_are_written() {
        for end in [RangeEnd::Percent(2.5), RangeEnd::Value(-1e-7), RangeEnd::Value(3.0)] {
            assert_eq!(RangeEnd::parse(&end.to_string()), Some(end));
        }
        for wrong in ["", "%", "101%", "-1%", "nan", "inf", "1e999", "5 %%"] {
            assert_eq!(RangeEnd::parse(wrong), None, "{wrong}");
        }
        assert!(!RangeEnd::Value(2.0).is_below(RangeEnd::Value(1.0)));
        assert!(RangeEnd::Value(2.0).is_below(RangeEnd::Percent(1.0)));
    }

    #[test]
    fn every_choice_has_a_name() {
        for choice in MapChoice::ALL {
            assert_eq!(MapChoice::from_name(choice.name()), Some(choice));
        }
        assert_eq!(MapChoice::from_name("gray"), Some(MapChoice::Map(ColorMap::Grey)));
        for scale in Scale::ALL {
            assert_eq!(Scale::from_name(scale.name()), Some(scale));
        }
    }
}
