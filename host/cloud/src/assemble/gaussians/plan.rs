//! Where a table holds what Gaussian splats consist of.

use crate::cloud::splats::{is_flipped, n_rest, rest_index, splat_kind};
use crate::table::{Field, Table};
use std::collections::{HashMap, HashSet};
use surfelshop_api::columns::{Element, OPACITY, SH, SPLAT_ROTATION, SPLAT_SCALE};
use surfelshop_api::format::FileColumn;

/// What the properties of harmonics above order 0 begin with.
const REST: &str = "f_rest_";

/// A column of numbers: a field, which of its names, and the factor on its values.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lane {
    pub(super) field: usize,
    pub(super) place: usize,
    pub(super) factor: f32,
}

/// Where all of it is.
#[derive(Debug)]
pub(super) struct Plan {
    /// Opacities are logits and scales logarithms, as trainers write them.
    pub(super) is_raw: bool,
    pub(super) opacity: Lane,
    pub(super) scales: Vec<Lane>,
    /// In the order x, y, z, w.
    pub(super) rotation: Vec<Lane>,
    /// For each order its coefficients, red, green and blue of each together.
    pub(super) harmonics: Vec<Vec<Lane>>,
}

/// The places of columns of floats by their names in lower case.
struct Places(HashMap<String, (usize, usize)>);

impl Places {
    fn of(fields: &[Field]) -> Self {
        let is_float =
            |field: &Field| matches!(field.values.element(), Element::F32 | Element::F64);
        let fields = fields.iter().enumerate().filter(|(_, field)| is_float(field));
        let places = fields.flat_map(|(i, field)| {
            let names = field.names.iter().enumerate();
            names.map(move |(place, name)| (name.to_ascii_lowercase(), (i, place)))
        });
        Self(places.collect())
    }

    fn lane(&self, name: &str) -> Option<Lane> {
        let &(field, place) = self.0.get(name)?;
        Some(Lane { field, place, factor: 1.0 })
    }

    fn all(&self, names: impl IntoIterator<Item = String>) -> Option<Vec<Lane>> {
        names.into_iter().map(|name| self.lane(&name)).collect()
    }

    /// Two components or three of one name, and no more.
    fn two_or_three(&self, name: &str) -> Option<Vec<Lane>> {
        let of = |n: usize| self.all((0..n).map(|i| format!("{name}_{i}")));
        of(3).filter(|_| self.lane(&format!("{name}_3")).is_none()).or_else(|| of(2))
    }
}

/// Whether columns of these names can be Gaussian splats.
pub(crate) fn may_be_splats<'a>(names: impl Iterator<Item = &'a str> + Clone) -> bool {
    let has = |name: &str| names.clone().any(|own| own.eq_ignore_ascii_case(name));
    let has_first = |name: &str| has(&format!("{name}_0"));
    let all_of = |columns: &[&str]| columns.iter().all(|name| has_first(name));
    let is_named = all_of(&["rot", "scale", "f_dc"]) || all_of(&[SPLAT_ROTATION, SPLAT_SCALE]);
    is_named && has(OPACITY)
}

/// What columns lack to be the Gaussian splats of a trainer, where they have all but one of their kinds.
fn incomplete<'a>(names: impl Iterator<Item = &'a str> + Clone) -> Option<String> {
    let has = |name: &str| names.clone().any(|own| own.eq_ignore_ascii_case(name));
    let kinds = ["f_dc_0", "opacity", "scale_0", "rot_0"];
    let mut missing = kinds.into_iter().filter(|name| !has(name));
    let first = missing.next().filter(|_| missing.next().is_none())?;
    Some(format!(
        "its columns are those of Gaussian splats but for `{first}`, which is missing: they stay plain columns"
    ))
}

/// Whether columns of a file are Gaussian splats without a doubt.
pub(crate) fn are_splats<'a>(columns: impl Iterator<Item = &'a FileColumn> + Clone) -> bool {
    let is_ready = splat_kind(|name| {
        let column = columns.clone().find(|column| column.name == name)?;
        Some((column.element, column.components))
    });
    let is_number = |name: &str| {
        columns.clone().any(|column| {
            let is_float = matches!(column.element, Element::F32 | Element::F64);
            column.components == 1 && is_float && column.name.eq_ignore_ascii_case(name)
        })
    };
    let all = |name: &str, n: usize| (0..n).all(|i| is_number(&format!("{name}_{i}")));
    let is_raw = || is_number(OPACITY) && all("scale", 2) && all("rot", 4) && all("f_dc", 3);
    is_ready.is_some() || is_raw()
}

/// The columns of splats that these fields hold, each as its components in the host's order: fields, and which of their
/// names. What is put together so when it is read is taken into the cloud without a copy.
pub(crate) fn woven(fields: &[Field]) -> Vec<Vec<(usize, usize)>> {
    let Some(plan) = Plan::find(fields, &mut Vec::new()) else { return Vec::new() };
    let columns = [&plan.scales, &plan.rotation].into_iter().chain(&plan.harmonics);
    let places = |lanes: &Vec<Lane>| lanes.iter().map(|lane| (lane.field, lane.place)).collect();
    columns.map(places).collect()
}

impl Plan {
    /// Where a table has Gaussian splats; `None` where it does not have all of them. What is odd about their
    /// harmonics becomes a warning.
    pub(super) fn find(fields: &[Field], warnings: &mut Vec<String>) -> Option<Self> {
        let names = fields.iter().flat_map(|field| &field.names).map(String::as_str);
        if !may_be_splats(names.clone()) {
            warnings.extend(incomplete(names));
            return None;
        }
        let places = Places::of(fields);
        Self::ready(&places).or_else(|| Self::raw(&places, fields, warnings))
    }

    /// Columns under the names that the host gives them.
    fn ready(places: &Places) -> Option<Self> {
        let components = |name: &str, n: usize| {
            let found = places.all((0..n).map(|i| format!("{name}_{i}")))?;
            places.lane(&format!("{name}_{n}")).is_none().then_some(found)
        };
        let harmonics = SH.iter().enumerate();
        let harmonics = harmonics.map_while(|(order, name)| components(name, 3 * (2 * order + 1)));
        Some(Self {
            is_raw: false,
            opacity: places.lane(OPACITY)?,
            scales: places.two_or_three(SPLAT_SCALE)?,
            rotation: components(SPLAT_ROTATION, 4)?,
            harmonics: harmonics.collect(),
        })
    }

    /// Columns as trainers write them.
    ///
    /// Source: Kerbl et al. 2023 and Huang et al. 2024, "2D Gaussian Splatting for Geometrically Accurate Radiance
    /// Fields": the files of their programs, which begin rotations with w.
    fn raw(places: &Places, fields: &[Field], warnings: &mut Vec<String>) -> Option<Self> {
        let scales = match places.all((0..3).map(|i| format!("scale_{i}"))) {
            Some(scales) => scales,
            None => places.all((0..2).map(|i| format!("scale_{i}")))?,
        };
        let mut harmonics = vec![places.all((0..3).map(|i| format!("f_dc_{i}")))?];
        let mut found = Self {
            is_raw: true,
            opacity: places.lane(OPACITY)?,
            scales,
            rotation: places.all([1, 2, 3, 0].map(|i| format!("rot_{i}")))?,
            harmonics: Vec::new(),
        };
        let names = fields.iter().flat_map(|field| &field.names);
        let is_rest = |name: &&String| {
            name.get(..REST.len()).is_some_and(|start| start.eq_ignore_ascii_case(REST))
        };
        let n = names.filter(is_rest).count();
        let rest = (1..=3).find(|order| n_rest(*order) == n).and_then(|highest| {
            let rest = places.all((0..n).map(|i| format!("{REST}{i}")))?;
            Some((1..=highest).map(|order| of_order(&rest, order)).collect::<Vec<_>>())
        });
        match rest {
            Some(rest) => harmonics.extend(rest),
            None if n > 0 => warnings.push(format!(
                "the {n} columns `{REST}*` are not the 9, 24 or 45 floats of spherical harmonics up to order 1, \
                 2 or 3; they stay plain columns"
            )),
            None => {}
        }
        found.harmonics = harmonics;
        Some(found)
    }

    pub(super) fn lanes(&self) -> impl Iterator<Item = &Lane> {
        let harmonics = self.harmonics.iter().flatten();
        [&self.opacity].into_iter().chain(&self.scales).chain(&self.rotation).chain(harmonics)
    }

    /// Takes all of it out of the table.
    pub(super) fn remove_from(&self, table: &mut Table) {
        let name = |lane: &Lane| table.fields[lane.field].names[lane.place].to_ascii_lowercase();
        let used: HashSet<String> = self.lanes().map(name).collect();
        table.split(|names| {
            let n_used = names.iter().filter(|name| used.contains(*name)).count();
            n_used > 0 && n_used < names.len()
        });
        let is_used = |field: &Field| {
            field.names.iter().any(|name| used.contains(&name.to_ascii_lowercase()))
        };
        table.fields.retain(|field| !is_used(field));
    }
}

/// The coefficients of one order among all above order 0.
fn of_order(rest: &[Lane], order: usize) -> Vec<Lane> {
    let coefficients = (0..=2 * order).flat_map(|k| (0..3).map(move |channel| (k, channel)));
    let lane = |(k, channel)| Lane {
        factor: if is_flipped(order, k) { -1.0 } else { 1.0 },
        ..rest[rest_index(rest.len(), order, k, channel)]
    };
    coefficients.map(lane).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_of_splats_are_known_by_all_of_them() {
        let column = |(name, n): &(&str, u32)| FileColumn::new(*name, *n, Element::F32);
        let are = |all: &[(&str, u32)]| {
            let columns: Vec<FileColumn> = all.iter().map(column).collect();
            are_splats(columns.iter())
        };
        let ready = [(OPACITY, 1), (SPLAT_SCALE, 3), (SPLAT_ROTATION, 4)];
        let names = ["scale_0", "SCALE_1", "rot_0", "rot_1", "rot_2", "rot_3"];
        let raw = names.iter().chain(&["f_dc_0", "f_dc_1", "f_dc_2", "opacity"]);
        let raw: Vec<(&str, u32)> = raw.map(|name| (*name, 1)).collect();
        assert!(are(&ready) && are(&raw));
        assert!(!are(&[(OPACITY, 1), (SPLAT_SCALE, 3), (SPLAT_ROTATION, 3)]));
        for missing in 0..raw.len() {
            let mut others = raw.clone();
            others.remove(missing);
            assert!(!are(&others), "{missing}");
        }
        assert!(!are(&[]));
    }

    #[test]
    fn a_kind_of_columns_that_splats_lack_is_named() {
        let named = |names: &[&'static str]| incomplete(names.iter().copied());
        let line = named(&["x", "f_dc_0", "scale_0", "Rot_0"]).unwrap();
        assert!(line.contains("`opacity`"), "{line}");
        assert_eq!(named(&["f_dc_0", "opacity", "scale_0", "rot_0"]), None);
        assert_eq!(named(&["opacity", "scale_0"]), None);
    }
}
