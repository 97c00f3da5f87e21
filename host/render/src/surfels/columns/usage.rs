//! Which columns drawing reads, and what those it lacks save.

use crate::surfels::columns::Columns;
use crate::surfels::columns::elements::{
    are_ellipses, clips_of, cuts, drawn_generation, fields_of, floats_of, is_color, round_of,
};
use serde::Serialize;
use surfelshop_api::columns::{self, CloudView, ColumnView, Values};

/// A column of the clouds, or one that drawing knows and they lack.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ColumnUse {
    /// Its name.
    pub name: String,
    /// Whether drawing reads it.
    pub read: bool,
    /// Bytes where surfels are drawn: taken by all clouds that have it, or saved by those that lack it.
    pub bytes: u64,
    /// Why it is read or not.
    pub why: String,
}

/// Columns that drawing can do without, with the bytes that one takes a surfel and what is done without.
const OPTIONAL: [(&str, u64, &str); 6] = [
    (columns::COLOR, 4, "one albedo for all, in a constant"),
    (columns::AO, 4, "accessibility is 1"),
    (columns::MATERIAL, 4, "material 0 everywhere, looked up by nothing"),
    (columns::TANGENT_U, 20, "discs: a radius each instead of two half axes"),
    (columns::NORMAL_FIELD, 16, "one normal for each ellipse"),
    (columns::CLIP, 28, "ellipses are whole"),
];

/// How clouds are drawn.
pub(crate) struct DrawnHow<'a> {
    pub(crate) held: &'a Columns,
    /// Whether the CPU does it.
    pub(crate) on_host: bool,
    /// Whether surfels are merged.
    pub(crate) merged: bool,
}

impl DrawnHow<'_> {
    /// Whether a column is read.
    fn reads(&self, cloud: &CloudView<'_>, name: &str) -> bool {
        self.held.wanted_of(cloud.len).for_merged(self.merged).reads(name)
    }

    /// Whether radii are one, in a constant.
    fn in_a_constant(&self, generation: u64) -> bool {
        !self.on_host && !self.merged && self.held.radii.in_a_constant(generation)
    }
}

/// The columns of clouds, and those they lack.
pub(crate) fn columns_used(clouds: &[CloudView<'_>], how: &DrawnHow<'_>) -> Vec<ColumnUse> {
    let mut all: Vec<ColumnUse> = Vec::new();
    for cloud in clouds {
        for column in &cloud.columns {
            let one = used(cloud, column, how);
            match all.iter_mut().find(|known| known.name == one.name && known.why == one.why) {
                Some(known) => known.bytes += one.bytes,
                None => all.push(one),
            }
        }
    }
    for (name, bytes_each, without) in OPTIONAL {
        // What only ellipses have is missed of ellipses alone.
        let is_of_ellipses = [columns::NORMAL_FIELD, columns::CLIP].contains(&name);
        let lacking = || {
            let lacks = |cloud: &&CloudView<'_>| {
                cloud.column(name).is_none() && (!is_of_ellipses || are_ellipses(cloud))
            };
            clouds.iter().filter(lacks)
        };
        let n: u64 = lacking().map(|cloud| cloud.len as u64).sum();
        let of = match (lacking().count(), clouds.len()) {
            (_, 1) => String::new(),
            (n, all) => format!(" in {n} of {all} clouds"),
        };
        let would_be_read = lacking().any(|cloud| how.reads(cloud, name));
        if n > 0 {
            all.push(ColumnUse {
                name: name.to_owned(),
                read: false,
                // Accessibility counts where there is some; of the others is known whether they would be read.
                bytes: if would_be_read || name == columns::AO { n * bytes_each } else { 0 },
                why: match would_be_read || name == columns::AO {
                    true => {
                        format!("no `{name}` column{of}: {without}; surfels are drawn without it")
                    }
                    false => format!("no `{name}` column{of}, and no pass that runs would read it"),
                },
            });
        }
    }
    all
}

fn used(cloud: &CloudView<'_>, column: &ColumnView<'_>, how: &DrawnHow<'_>) -> ColumnUse {
    let are_ellipses = are_ellipses(cloud);
    let is_floats = floats_of(cloud, column.name).is_ok();
    let (bytes_each, why): (u64, Result<&str, &str>) = match column.name {
        columns::POSITION => (12, Ok("where surfels are")),
        columns::NORMAL => (12, Ok("how surfels stand")),
        columns::RADIUS if are_ellipses => (0, Err("ellipses have half axes instead")),
        columns::RADIUS if how.in_a_constant(drawn_generation(cloud, column)) => {
            (4, Err("all discs are as large: one radius, in a constant"))
        }
        columns::RADIUS => (4, Ok("how large discs are")),
        // It is the sign of the radius.
        columns::ROUND if round_of(cloud).is_some() => (0, Ok("which surfels face the eye")),
        columns::TANGENT_U | columns::TANGENT_V if are_ellipses => {
            (12, Ok("half axes of ellipses"))
        }
        columns::TANGENT_U | columns::TANGENT_V => (0, Err("one half axis alone says nothing")),
        columns::NORMAL_FIELD if fields_of(cloud).is_some() => {
            (16, Ok("normals that vary over ellipses"))
        }
        columns::CLIP if are_ellipses && is_floats => {
            let n_cut =
                clips_of(cloud).unwrap_or_default().iter().filter(|clip| cuts(clip)).count();
            return ColumnUse {
                name: column.name.to_owned(),
                read: n_cut > 0,
                bytes: 28 * n_cut as u64,
                why: format!(
                    "lines cut {n_cut} of {} ellipses, which are drawn after the others",
                    cloud.len
                ),
            };
        }
        columns::NORMAL_FIELD | columns::CLIP => {
            (0, Err("drawing knows these of ellipses alone, as 4 and 7 x f32"))
        }
        columns::AO if is_floats => (4, Ok("ambient accessibility")),
        columns::MATERIAL if matches!(column.values, Values::U32(_)) => (4, Ok("materials")),
        columns::COLOR if is_color(column) && matches!(column.values, Values::U8(_)) => {
            (4, Ok("albedo, in four bytes"))
        }
        columns::COLOR if is_color(column) => (8, Ok("albedo, in half precision")),
        columns::AO | columns::MATERIAL | columns::COLOR => {
            (0, Err("drawing knows no values of this type"))
        }
        _ => (0, Err("drawing knows no column of this name")),
    };
    let why = match how.reads(cloud, column.name) {
        true => why,
        false => why.and(Err("no pass that runs reads what comes of it")),
    };
    ColumnUse {
        name: column.name.to_owned(),
        read: why.is_ok(),
        bytes: bytes_each * cloud.len as u64,
        why: why.unwrap_or_else(|why| why).to_owned(),
    }
}
