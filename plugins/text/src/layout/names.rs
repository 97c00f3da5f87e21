//! Names of columns, and what they mean.

use std::collections::HashMap;
use surfelshop_api::columns::{
    AO, CLIP, COLOR, MATERIAL, NORMAL, NORMAL_FIELD, POSITION, RADIUS, TANGENT_U, TANGENT_V,
};
use surfelshop_api::format::{
    CLASSIFICATION, GPS_TIME, INTENSITY, N_RETURNS, POINT_SOURCE, RETURN_NUMBER, SCAN, SCAN_ANGLE,
};

/// A component of a column of ours.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Target {
    /// The column.
    pub(crate) column: String,
    pub(crate) component: usize,
}

impl Target {
    pub(crate) fn new(column: &str, component: usize) -> Self {
        Self { column: column.to_owned(), component }
    }
}

/// A component of a column that has a meaning, and the names that files use for it, the clearest first.
struct Meaning {
    column: &'static str,
    component: usize,
    names: &'static [&'static str],
}

const fn of(column: &'static str, component: usize, names: &'static [&'static str]) -> Meaning {
    Meaning { column, component, names }
}

/// All in the form that [`plain`] gives.
const MEANINGS: &[Meaning] = &[
    of(
        POSITION,
        0,
        &[
            "x",
            "x_coord",
            "xcoord",
            "coord_x",
            "x_coordinate",
            "coordinate_x",
            "pos_x",
            "position_x",
            "px",
            "point_x",
            "points_0",
            "cartesianx",
            "cartesian_x",
            "easting",
            "east",
            "e",
            "x_utm",
            "utm_x",
            "utm_easting",
            "rechtswert",
            "x_m",
        ],
    ),
    of(
        POSITION,
        1,
        &[
            "y",
            "y_coord",
            "ycoord",
            "coord_y",
            "y_coordinate",
            "coordinate_y",
            "pos_y",
            "position_y",
            "py",
            "point_y",
            "points_1",
            "cartesiany",
            "cartesian_y",
            "northing",
            "north",
            "n",
            "y_utm",
            "utm_y",
            "utm_northing",
            "hochwert",
            "y_m",
        ],
    ),
    of(
        POSITION,
        2,
        &[
            "z",
            "z_coord",
            "zcoord",
            "coord_z",
            "z_coordinate",
            "coordinate_z",
            "pos_z",
            "position_z",
            "pz",
            "point_z",
            "points_2",
            "cartesianz",
            "cartesian_z",
            "height",
            "elevation",
            "elev",
            "altitude",
            "alt",
            "h",
            "z_utm",
            "utm_z",
            "hoehe",
            "z_m",
        ],
    ),
    of(NORMAL, 0, &["nx", "normal_x", "normalx", "n_x", "x_normal", "norm_x", "normals_0"]),
    of(NORMAL, 1, &["ny", "normal_y", "normaly", "n_y", "y_normal", "norm_y", "normals_1"]),
    of(NORMAL, 2, &["nz", "normal_z", "normalz", "n_z", "z_normal", "norm_z", "normals_2"]),
    of(
        COLOR,
        0,
        &["r", "red", "color_red", "colorred", "color_r", "diffuse_red", "rf", "rgb_0", "colors_0"],
    ),
    of(
        COLOR,
        1,
        &[
            "g",
            "green",
            "color_green",
            "colorgreen",
            "color_g",
            "diffuse_green",
            "gf",
            "rgb_1",
            "colors_1",
        ],
    ),
    of(
        COLOR,
        2,
        &[
            "b",
            "blue",
            "color_blue",
            "colorblue",
            "color_b",
            "diffuse_blue",
            "bf",
            "rgb_2",
            "colors_2",
        ],
    ),
    of(COLOR, 3, &["a", "alpha", "opacity", "color_a", "color_alpha"]),
    of(RADIUS, 0, &["radius", "surfel_radius", "point_radius"]),
    of(AO, 0, &["ao", "ambient_occlusion"]),
    of(MATERIAL, 0, &["material"]),
    of(
        INTENSITY,
        0,
        &["intensity", "i", "intensities", "reflectance", "reflectivity", "amplitude", "remission"],
    ),
    of(CLASSIFICATION, 0, &["classification", "class", "classification_code", "class_id"]),
    of(RETURN_NUMBER, 0, &["return_number", "returnnumber", "return_num", "return_no", "return"]),
    of(
        N_RETURNS,
        0,
        &[
            "number_of_returns",
            "numberofreturns",
            "n_returns",
            "num_returns",
            "returns",
            "number_returns",
            "return_count",
        ],
    ),
    of(SCAN_ANGLE, 0, &["scan_angle", "scanangle", "scan_angle_rank", "scananglerank"]),
    of(GPS_TIME, 0, &["gps_time", "gpstime", "gps_timestamp", "time", "timestamp"]),
    of(
        POINT_SOURCE,
        0,
        &[
            "point_source",
            "point_source_id",
            "pointsourceid",
            "pointsource",
            "source_id",
            "flight_line",
        ],
    ),
    of(SCAN, 0, &["scan"]),
];

/// The words of names of colours and normals, for people.
const SHORT: [(&str, &[&str]); 3] =
    [(POSITION, &["x", "y", "z"]), (NORMAL, &["nx", "ny", "nz"]), (COLOR, &["r", "g", "b", "a"])];

/// How many components columns of these names have at least and at most.
const COMPONENTS: [(&str, [usize; 2]); 10] = [
    (POSITION, [3, 3]),
    (NORMAL, [3, 3]),
    (COLOR, [3, 4]),
    (TANGENT_U, [3, 3]),
    (TANGENT_V, [3, 3]),
    (NORMAL_FIELD, [4, 4]),
    (CLIP, [7, 7]),
    (RADIUS, [1, 1]),
    (AO, [1, 1]),
    (MATERIAL, [1, 1]),
];

/// The name of a component as files and people have it: `x`, `nx`, `r`, `intensity`, `flow.0`.
pub(crate) fn shown(target: &Target, n_components: usize) -> String {
    let short = SHORT.iter().find(|(column, _)| *column == target.column);
    match short.and_then(|(_, names)| names.get(target.component)) {
        Some(name) => (*name).to_owned(),
        None if n_components == 1 => target.column.clone(),
        None => format!("{}.{}", target.column, target.component),
    }
}

/// Whether a column of this name may have so many components.
fn may_have(column: &str, n_components: usize) -> bool {
    let known = COMPONENTS.iter().find(|(name, _)| *name == column);
    known.is_none_or(|(_, [least, most])| (*least..=*most).contains(&n_components))
}

/// A name in lower case, without quotation marks, units in brackets and comment signs, with `_` between words.
fn plain(name: &str) -> String {
    let name = name.trim_matches(|c: char| c.is_whitespace() || "\"'#%/".contains(c));
    let name = name.split(['(', '[']).next().unwrap_or_default().trim();
    let lower = name.to_lowercase();
    let lower = lower.strip_prefix("scalar_").unwrap_or(&lower);
    lower.replace([' ', '-', '.', ':'], "_")
}

/// What a name may mean, and how clear it is: 0 is clearest.
fn meaning(name: &str) -> Option<(&'static Meaning, usize)> {
    let plain = plain(name);
    MEANINGS.iter().find_map(|meaning| {
        let rank = meaning.names.iter().position(|&known| known == plain)?;
        Some((meaning, rank))
    })
}

/// Whether names have those of all three coordinates.
pub(crate) fn have_position(names: &[&str]) -> bool {
    let known = |component| {
        names
            .iter()
            .filter_map(|name| meaning(name))
            .any(|(meaning, _)| meaning.column == POSITION && meaning.component == component)
    };
    (0..3).all(known)
}

/// What columns of these names hold: of several names for one thing the clearest counts, and others are columns
/// of their own. `-` and empty names are left out.
pub(crate) fn targets(names: &[&str]) -> Vec<Option<Target>> {
    let meanings: Vec<_> = names.iter().map(|name| meaning(name)).collect();
    let is_clearest = |i: usize, meaning: &'static Meaning, rank: usize| {
        !meanings.iter().enumerate().any(|(other, found)| {
            found.is_some_and(|(found, found_rank)| {
                std::ptr::eq(found, meaning) && (found_rank, other) < (rank, i)
            })
        })
    };
    let mut targets: Vec<Option<Target>> = Vec::with_capacity(names.len());
    for (i, name) in names.iter().enumerate() {
        let target = match meanings[i] {
            _ if is_left_out(name) => None,
            Some((meaning, rank)) if is_clearest(i, meaning, rank) => {
                Some(Target::new(meaning.column, meaning.component))
            }
            _ => Some(own(name)).filter(|target| !target.column.is_empty()),
        };
        targets.push(target);
    }
    whole_columns(names, &mut targets);
    targets
}

/// Whether a name says that its column is left out.
pub(crate) fn is_left_out(name: &str) -> bool {
    matches!(name.trim(), "" | "-")
}

/// A column that only the file knows: `flow.1` is a component of `flow`.
fn own(name: &str) -> Target {
    let name = clean(name);
    if let Some((column, component)) = name.rsplit_once('.')
        && let Ok(component) = component.parse()
        && !column.is_empty()
    {
        return Target::new(column, component);
    }
    Target::new(&name, 0)
}

/// A name without quotation marks and comment signs around it and control characters in it, at most 64 characters.
fn clean(name: &str) -> String {
    let name = name.trim_matches(|c: char| c.is_whitespace() || "\"'#%/".contains(c));
    name.chars().take(64).map(|c| if c.is_control() { '_' } else { c }).collect()
}

/// Makes columns of their own of components whose column is not whole, and gives each column a name of its own;
/// case does not tell names apart.
fn whole_columns(names: &[&str], targets: &mut [Option<Target>]) {
    let keys: Vec<Option<String>> =
        targets.iter().map(|t| t.as_ref().map(|t| t.column.to_lowercase())).collect();
    let is_whole: Vec<bool> = keys
        .iter()
        .map(|key| {
            let parts = targets.iter().zip(&keys).filter(|(_, other)| *other == key);
            let mut components: Vec<usize> =
                parts.filter_map(|(target, _)| Some(target.as_ref()?.component)).collect();
            components.sort_unstable();
            components.iter().enumerate().all(|(i, &component)| i == component)
                && key.as_ref().is_some_and(|key| may_have(key, components.len()))
        })
        .collect();
    let mut taken: HashMap<String, String> = HashMap::new();
    for (i, target) in targets.iter_mut().enumerate().filter(|(i, _)| is_whole[*i]) {
        if let (Some(target), Some(key)) = (target, &keys[i]) {
            target.column =
                taken.entry(key.clone()).or_insert_with(|| target.column.clone()).clone();
        }
    }
    for (i, target) in targets.iter_mut().enumerate().filter(|(i, _)| !is_whole[*i]) {
        let Some(target) = target else { continue };
        let name = clean(names[i]);
        let is_free = |name: &String| {
            may_have(&name.to_lowercase(), 1) && !taken.contains_key(&name.to_lowercase())
        };
        let numbered = (2..).map(|number: usize| format!("{name}_{number}"));
        let free = std::iter::once(name.clone()).chain(numbered).find(is_free);
        *target = Target::new(&free.unwrap_or_default(), 0);
        taken.insert(target.column.to_lowercase(), target.column.clone());
    }
}
