//! What colours mean, as a legend says it; how it is drawn is up to whoever shows it.

use super::colors::{Categories, Colors, Ramp, normal_color};
use super::filter::Filter;
use super::settings::Attribute;
use super::ticks::{Tick, ticks};
use crate::cloud::axis::Axis;
use glam::Vec3;

/// What colours mean.
#[derive(Clone, Debug, PartialEq)]
pub struct Legend {
    /// What they show: the attribute.
    pub title: String,
    /// The unit of its numbers, where it is known.
    pub unit: Option<&'static str>,
    /// The colours.
    pub body: LegendBody,
}

/// The colours of a legend.
#[derive(Clone, Debug, PartialEq)]
pub enum LegendBody {
    /// A ramp.
    Ramp {
        /// Its colours from low to high, sRGB-encoded.
        colors: Vec<[u8; 3]>,
        /// Its labels.
        ticks: Vec<Tick>,
        /// Whether there are numbers below and above its ends: such an end is drawn pointed.
        beyond: [bool; 2],
    },
    /// A list.
    List(Vec<LegendEntry>),
}

/// One of several colours.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LegendEntry {
    /// The colour, sRGB-encoded.
    pub color: [u8; 3],
    /// What has it.
    pub label: String,
    /// How many surfels have it, where that is known.
    pub n: Option<u64>,
}

impl Legend {
    /// The legend of these colours; `None` where they say nothing of numbers. Categories that a filter of the
    /// same attribute hides are left out.
    #[must_use]
    pub fn of(colors: &Colors, filters: &[Filter]) -> Option<Self> {
        match colors {
            Colors::File | Colors::Uniform(_) => None,
            Colors::Normal(up) => Some(normals(*up)),
            Colors::Ramp(ramp) => Some(of_ramp(ramp)),
            Colors::Categories(categories) => Some(of_categories(categories, filters)),
        }
    }
}

/// Units of columns that scans have, by their names there.
const UNITS: [(&str, &str); 3] = [("gps_time", "s"), ("scan_angle", "°"), ("scan_angle_rank", "°")];

fn unit(attribute: &Attribute) -> Option<&'static str> {
    let Attribute::Column { name, .. } = attribute else { return None };
    UNITS.iter().find(|(known, _)| known.eq_ignore_ascii_case(name)).map(|(_, unit)| *unit)
}

fn of_ramp(ramp: &Ramp) -> Legend {
    Legend {
        title: ramp.attribute.title(),
        unit: unit(&ramp.attribute),
        body: LegendBody::Ramp {
            colors: ramp.map.colors().to_vec(),
            ticks: ticks(ramp.range, ramp.scale),
            beyond: ramp.beyond,
        },
    }
}

fn of_categories(categories: &Categories, filters: &[Filter]) -> Legend {
    let own = || filters.iter().filter(|filter| filter.attribute == categories.attribute);
    let is_shown = |value: &i64| own().all(|filter| filter.shows(*value as f64));
    let shown = categories.counts.iter().filter(|(value, _)| is_shown(value));
    let entry = |(value, n): (&i64, &u64)| LegendEntry {
        color: categories.palette.color(*value),
        label: categories.label(*value),
        n: Some(*n),
    };
    let body = LegendBody::List(shown.map(entry).collect());
    Legend { title: categories.attribute.title(), unit: None, body }
}

/// The six directions of the axes.
fn normals(up: Axis) -> Legend {
    let along = |axis: usize, sign: f32| {
        let mut direction = [0.0; 3];
        direction[axis] = sign;
        let name = ["x", "y", "z"][axis];
        let name = if sign > 0.0 { name.to_owned() } else { format!("-{name}") };
        let label = match (axis == up.index(), f64::from(sign) == up.sign()) {
            (true, true) => format!("up, {name}"),
            (true, false) => format!("down, {name}"),
            (false, _) => name,
        };
        LegendEntry { color: normal_color(Vec3::from(direction), up), label, n: None }
    };
    let (up_axis, sign) = (up.index(), up.sign() as f32);
    let sideways = (0..3).filter(|axis| *axis != up_axis);
    let mut all = vec![along(up_axis, sign)];
    all.extend(sideways.flat_map(|axis| [along(axis, 1.0), along(axis, -1.0)]));
    all.push(along(up_axis, -sign));
    Legend { title: "normal".to_owned(), unit: None, body: LegendBody::List(all) }
}
