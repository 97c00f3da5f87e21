//! Colours of surfels: what a source means for the clouds that are displayed together, and the column that
//! comes of it.

use super::cache;
use super::error::DisplayError;
use super::keys::ColorKey;
use super::maps::{ColorMap, encoded};
use super::palette::{Palette, oklab};
use super::scalar::{BLOCK, Scalar};
use super::settings::{Attribute, ColorBy, ColorSource, MapChoice, RangeEnd, Scale};
use super::statistics::{MOST_CATEGORIES, Statistics};
use crate::cloud::Cloud;
use crate::cloud::axis::Axis;
use crate::cloud::buffer::Buffer;
use crate::cloud::column::Column;
use crate::memory::ask;
use glam::Vec3;
use rayon::prelude::*;
use std::collections::BTreeMap;
use surfelshop_api::columns::{COLOR, NEUTRAL_ALBEDO, NORMAL};

/// Most different whole numbers that are categories where nobody says so.
const FEW: usize = 32;

/// What colours the clouds that are displayed together: a number has the same colour in all of them.
#[derive(Clone, Debug, PartialEq)]
pub enum Colors {
    /// Those of the files.
    File,
    /// One for all, sRGB-encoded.
    Uniform([u8; 3]),
    /// By the direction of normals.
    Normal(Axis),
    /// By numbers along a map.
    Ramp(Ramp),
    /// By category.
    Categories(Categories),
}

/// Numbers along a colour map.
#[derive(Clone, Debug, PartialEq)]
pub struct Ramp {
    /// The attribute.
    pub attribute: Attribute,
    /// The map.
    pub map: ColorMap,
    /// How numbers are spread over it.
    pub scale: Scale,
    /// The numbers at its ends, the lower first; both above 0 on a logarithmic scale.
    pub range: [f64; 2],
    /// Whether there are numbers below and above it, which have the colours of its ends.
    pub beyond: [bool; 2],
}

/// Categories, each with a colour.
#[derive(Clone, Debug, PartialEq)]
pub struct Categories {
    /// The attribute.
    pub attribute: Attribute,
    /// What their colours and names are.
    pub palette: Palette,
    /// How many surfels of all clouds are in each.
    pub counts: BTreeMap<i64, u64>,
}

/// The colour of what has no number, sRGB-encoded.
pub(super) fn neutral() -> [u8; 3] {
    NEUTRAL_ALBEDO.map(encoded)
}

impl Colors {
    /// What a source means for these clouds.
    ///
    /// # Errors
    /// Where no cloud has the column, or its numbers cannot be displayed like this.
    pub(super) fn of(
        source: &ColorSource,
        clouds: &[&Cloud],
        up: Axis,
    ) -> Result<Self, DisplayError> {
        let attribute = match &source.by {
            ColorBy::File => return Ok(Self::File),
            ColorBy::Uniform(color) => return Ok(Self::Uniform(*color)),
            ColorBy::Normal if clouds.iter().all(|cloud| cloud.normals().len() < cloud.len()) => {
                return if clouds.iter().all(|cloud| cloud.is_empty()) {
                    Ok(Self::File)
                } else {
                    Err(DisplayError::NoNormals)
                };
            }
            ColorBy::Normal => return Ok(Self::Normal(up)),
            ColorBy::Attribute(attribute) => attribute,
        };
        let known = Statistics::of(clouds, attribute, up)?;
        if known.n_clouds() == 0 {
            return match clouds.is_empty() {
                true => Ok(Self::File),
                false => Err(unknown(clouds, attribute)),
            };
        }
        match source.map {
            MapChoice::Map(map) => ramp(source, &known, map).map(Self::Ramp),
            MapChoice::Categories => categories(&known).map(Self::Categories),
            MapChoice::Automatic if are_categories(&known) => {
                categories(&known).map(Self::Categories)
            }
            MapChoice::Automatic => ramp(source, &known, ColorMap::default()).map(Self::Ramp),
        }
    }

    /// The attribute that colours come of, where it is one.
    #[must_use]
    pub fn attribute(&self) -> Option<&Attribute> {
        match self {
            Self::Ramp(ramp) => Some(&ramp.attribute),
            Self::Categories(categories) => Some(&categories.attribute),
            Self::File | Self::Uniform(_) | Self::Normal(_) => None,
        }
    }

    /// The column of colours for a cloud; `None` where it keeps its own.
    pub(super) fn column(&self, cloud: &Cloud, up: Axis) -> Result<Option<Column>, DisplayError> {
        let scalar = match self.attribute() {
            Some(attribute) => Scalar::of(cloud, attribute, up)?,
            None => None,
        };
        let key = match (self, &scalar) {
            (Self::File, _) => return Ok(None),
            (Self::Uniform(color), _) => ColorKey::Uniform(cloud.len(), *color),
            (Self::Normal(up), _) => match cloud.column(NORMAL) {
                Some(column) => ColorKey::Normal(column.generation(), *up),
                None => ColorKey::Uniform(cloud.len(), neutral()),
            },
            (Self::Ramp(ramp), Some(scalar)) => {
                let range = ramp.range.map(f64::to_bits);
                ColorKey::Ramp(scalar.key(), ramp.map, ramp.scale, range)
            }
            (Self::Categories(categories), Some(scalar)) => {
                ColorKey::Categories(scalar.key(), categories.palette)
            }
            (Self::Ramp(_) | Self::Categories(_), None) => {
                ColorKey::Uniform(cloud.len(), neutral())
            }
        };
        let column = cache::colors(key, || -> Result<Column, DisplayError> {
            ask((cloud.len() as u64).saturating_mul(3))?;
            let values = match (self, &scalar) {
                (Self::Normal(up), _) => by_normal(cloud, *up),
                (Self::Ramp(ramp), Some(scalar)) => by_number(scalar, |number| ramp.color(number)),
                (Self::Categories(categories), Some(scalar)) => {
                    by_number(scalar, |number| categories.color(number))
                }
                (Self::Uniform(color), _) => color.repeat(cloud.len()),
                _ => neutral().repeat(cloud.len()),
            };
            Ok(Column::new(COLOR, 3, Buffer::U8(values)))
        })?;
        Ok(Some(column))
    }
}

impl Ramp {
    /// The colour of a number, sRGB-encoded; that of NaN is neutral.
    #[must_use]
    pub fn color(&self, number: f64) -> [u8; 3] {
        match number.is_nan() {
            true => neutral(),
            false => self.map.color(self.scale.share(number, self.range)),
        }
    }
}

impl Categories {
    /// The colour of a number, sRGB-encoded; neutral where it is no category.
    #[must_use]
    pub fn color(&self, number: f64) -> [u8; 3] {
        super::settings::whole(number).map_or_else(neutral, |whole| self.palette.color(whole))
    }

    /// What a category is called: its number, and behind it its name where it has one.
    #[must_use]
    pub fn label(&self, value: i64) -> String {
        match self.palette.name(value) {
            Some(name) => format!("{value} {name}"),
            None => value.to_string(),
        }
    }
}

/// Says that no cloud has a column.
pub(super) fn unknown(clouds: &[&Cloud], attribute: &Attribute) -> DisplayError {
    let column = match attribute {
        Attribute::Height => "position".to_owned(),
        Attribute::Column { name, .. } => name.clone(),
    };
    let mut names: Vec<&str> =
        clouds.iter().flat_map(|cloud| cloud.columns()).map(Column::name).collect();
    names.sort_unstable();
    names.dedup();
    let names: Vec<String> = names.into_iter().map(|name| format!("`{name}`")).collect();
    DisplayError::UnknownColumn { column, available: names.join(", ") }
}

/// Whether an attribute is one of categories, where nobody says.
fn are_categories(known: &Statistics) -> bool {
    let Attribute::Column { name, .. } = known.attribute() else { return false };
    let is_named = Palette::names_categories(name);
    let most = if is_named { MOST_CATEGORIES } else { FEW };
    (is_named || known.is_integer() && name != COLOR)
        && known.categories().is_some_and(|counts| counts.len() <= most)
}

fn categories(known: &Statistics) -> Result<Categories, DisplayError> {
    let attribute = known.attribute().clone();
    let palette = match &attribute {
        Attribute::Column { name, .. } => Palette::of_column(name),
        Attribute::Height => Palette::Numbers,
    };
    match known.categories() {
        Some(counts) => Ok(Categories { attribute, palette, counts }),
        None if known.n_finite() == 0 => {
            Ok(Categories { attribute, palette, counts: BTreeMap::new() })
        }
        None => Err(DisplayError::NotCategories {
            attribute: attribute.title(),
            most: MOST_CATEGORIES,
            found: "other numbers, or more of them",
        }),
    }
}

fn ramp(source: &ColorSource, known: &Statistics, map: ColorMap) -> Result<Ramp, DisplayError> {
    let (attribute, scale) = (known.attribute().clone(), source.scale);
    let [mut low, high] = source.range.map(|end| match end {
        RangeEnd::Value(value) => value,
        RangeEnd::Percent(percent) => known.percentile(percent).unwrap_or(0.0),
    });
    if scale == Scale::Logarithmic && low <= 0.0 {
        low = match known.least_positive() {
            Some(least) => least,
            None if known.n_finite() == 0 => 1.0,
            None => return Err(DisplayError::NotPositive { attribute: attribute.title() }),
        };
    }
    let range = if high > low { [low, high] } else { around(low, scale) };
    let beyond =
        known.ends().map_or([false; 2], |[least, most]| [least < range[0], most > range[1]]);
    Ok(Ramp { attribute, map, scale, range, beyond })
}

/// A range around a number that all share: it has the colour of the middle.
fn around(number: f64, scale: Scale) -> [f64; 2] {
    /// More than rounding, and less than what matters.
    const SHARE: f64 = 1e-6;
    match scale {
        Scale::Linear => {
            let half = (number.abs() * SHARE).max(0.5);
            [number - half, number + half]
        }
        Scale::Logarithmic => [0.5 * number, 2.0 * number],
    }
}

/// Colours of numbers, three bytes each.
fn by_number(scalar: &Scalar<'_>, color: impl Fn(f64) -> [u8; 3] + Sync) -> Vec<u8> {
    let mut colors = vec![0; 3 * scalar.len()];
    let blocks = colors.par_chunks_mut(3 * BLOCK).enumerate();
    blocks.for_each_init(
        || vec![0.0; BLOCK],
        |numbers, (i, colors)| {
            let numbers = &mut numbers[..colors.len() / 3];
            scalar.read(i * BLOCK, numbers);
            let (colors, _) = colors.as_chunks_mut::<3>();
            for (out, number) in colors.iter_mut().zip(numbers) {
                *out = color(*number);
            }
        },
    );
    colors
}

/// Colours of normals.
fn by_normal(cloud: &Cloud, up: Axis) -> Vec<u8> {
    let normals = cloud.normals();
    let mut colors = vec![0; 3 * cloud.len()];
    let (rows, _) = colors.as_chunks_mut::<3>();
    rows.par_iter_mut().zip(normals).with_min_len(BLOCK).for_each(|(out, normal)| {
        *out = normal_color(*normal, up);
    });
    colors
}

/// The colour of a direction, sRGB-encoded: what faces upwards is light, what faces downwards dark, and what
/// faces sideways has the hue of its azimuth. Neutral where it is no direction.
pub(super) fn normal_color(normal: Vec3, up: Axis) -> [u8; 3] {
    /// Lightness of what faces sideways, and how much lighter what faces upwards is.
    const LIGHTNESS: [f32; 2] = [0.70, 0.25];
    const CHROMA: f32 = 0.14;
    // The hue of the first axis is that of red.
    const FIRST: (f32, f32) = (0.489, 0.872);
    let Some(n) = normal.try_normalize() else { return neutral() };
    let n = up.to_y_up(n.as_dvec3()).as_vec3();
    let (x, y, upwards) = (n.x, -n.z, n.y);
    let (sin, cos) = FIRST;
    let (a, b) = (x * cos - y * sin, x * sin + y * cos);
    oklab(LIGHTNESS[0] + LIGHTNESS[1] * upwards, CHROMA * a, CHROMA * b)
}
