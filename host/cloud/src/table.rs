//! A file's points as named columns, before they become a cloud.

use crate::cloud::buffer::{Buffer, unweave};
use crate::cloud::column::Column;
use crate::faces;
use glam::DVec3;
use surfelshop_api::columns::Role;
use surfelshop_geometry::Bounds;

/// Spellings of normals.
pub(crate) const NORMALS: [[&str; 3]; 3] =
    [["nx", "ny", "nz"], ["normal_x", "normal_y", "normal_z"], ["normalx", "normaly", "normalz"]];

/// Spellings of colours with their opacity.
pub(crate) const COLORS: [[&str; 4]; 3] = [
    ["red", "green", "blue", "alpha"],
    ["r", "g", "b", "a"],
    ["diffuse_red", "diffuse_green", "diffuse_blue", "diffuse_alpha"],
];

/// Spellings of radii.
pub(crate) const RADII: [[&str; 1]; 2] = [["radius"], ["scalar_radius"]];

/// How many of the names at the start of a list are the components of one thing, in its order; such
/// columns are kept woven, the components of a row together, as the cloud will have them.
pub(crate) fn n_together<'a>(names: impl Iterator<Item = &'a str> + Clone) -> usize {
    let starts = |with: &[&str]| {
        let mut names = names.clone();
        with.iter().all(|with| names.next().is_some_and(|name| name.eq_ignore_ascii_case(with)))
    };
    if COLORS.iter().any(|color| starts(color)) {
        return 4;
    }
    let three = starts(&["x", "y", "z"])
        || NORMALS.iter().any(|normal| starts(normal))
        || COLORS.iter().any(|color| starts(&color[..3]));
    if three { 3 } else { 1 }
}

/// One scalar column of a file, or several that are woven.
#[derive(Debug)]
pub(crate) struct Field {
    /// The file's own names, distinct in the whole table but for case.
    pub(crate) names: Vec<String>,
    /// For each row a value per name.
    pub(crate) values: Buffer,
}

impl Field {
    /// Whether the field has exactly these names.
    fn is(&self, names: &[&str]) -> bool {
        self.names.len() == names.len()
            && self.names.iter().zip(names).all(|(own, name)| own.eq_ignore_ascii_case(name))
    }
}

impl Field {
    /// Coordinates of points from a text file, three per point.
    ///
    /// Decimals are no exact numbers of either type. They are kept in single precision unless the
    /// points lie so far from zero, in terms of their extent, that it would round them coarsely.
    pub(crate) fn coordinates(numbers: Vec<f64>) -> Self {
        const FAR: f64 = 256.0;
        let (points, _) = numbers.as_chunks::<3>();
        let bounds = Bounds::of(points.iter().map(|&point| DVec3::from_array(point)));
        // A row of zeros among coordinates of a map is not what they are near to.
        let core =
            bounds.map(|all| all.without_strays(points.len(), |i| DVec3::from_array(points[i])));
        let is_far = core.is_some_and(|b| b.extent() > 0.0 && b.reach() > FAR * b.extent());
        let values = match is_far {
            true => Buffer::F64(numbers),
            false => Buffer::F32(numbers.iter().map(|&number| number as f32).collect()),
        };
        Self { names: ["x", "y", "z"].map(str::to_owned).to_vec(), values }
    }
}

/// The points of a file before they are a cloud: scalar columns under the file's own names.
#[derive(Debug, Default)]
pub(crate) struct Table {
    /// Format and encoding, for people.
    pub(crate) format: String,
    /// What the file calls its points.
    pub(crate) element: String,
    pub(crate) n_rows: usize,
    /// The columns, in the file's order.
    pub(crate) fields: Vec<Field>,
    /// Triangles between the rows, where the file has faces.
    pub(crate) faces: Vec<[u32; 3]>,
    pub(crate) comments: Vec<String>,
    pub(crate) warnings: Vec<String>,
    /// These are a part of the points, of which nothing is told that follows from all: 16-bit colours are such even
    /// where none is larger than 255, and normals keep the sides that they were estimated with unless a scanner or a
    /// guide says.
    pub(crate) is_part: bool,
    /// Columns that have another role than their names say.
    pub(crate) roles: Vec<(String, Role)>,
}

impl Table {
    /// The names of all columns.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> + Clone {
        self.fields.iter().flat_map(|field| &field.names).map(String::as_str)
    }

    /// Takes the columns of these names out, in this order; `None`, and nothing taken, where one is
    /// missing. Case does not matter.
    pub(crate) fn take<const N: usize>(&mut self, names: [&str; N]) -> Option<[Buffer; N]> {
        if !names.iter().all(|name| self.names().any(|own| own.eq_ignore_ascii_case(name))) {
            return None;
        }
        self.split(|field| names.iter().any(|name| field.iter().any(|own| own == name)));
        let mut taken = [const { Buffer::U8(Vec::new()) }; N];
        for (taken, name) in taken.iter_mut().zip(names) {
            *taken = self.take_woven(&[name])?;
        }
        Some(taken)
    }

    /// The first of several spellings that is there.
    pub(crate) fn take_any<const N: usize>(
        &mut self,
        spellings: &[[&str; N]],
    ) -> Option<[Buffer; N]> {
        spellings.iter().find_map(|names| self.take(*names))
    }

    /// The columns of these names, where they are woven in this order and are no others.
    pub(crate) fn woven(&self, names: &[&str]) -> Option<&Buffer> {
        self.fields.iter().find(|field| field.is(names)).map(|field| &field.values)
    }

    /// Takes out what [`Table::woven`] finds.
    pub(crate) fn take_woven(&mut self, names: &[&str]) -> Option<Buffer> {
        let place = self.fields.iter().position(|field| field.is(names))?;
        Some(self.fields.remove(place).values)
    }

    /// Makes columns of their own of those woven fields that a test chooses by their names, which
    /// are given in lower case.
    pub(crate) fn split(&mut self, chosen: impl Fn(&[String]) -> bool) {
        let lower = |field: &Field| -> Vec<String> {
            field.names.iter().map(|name| name.to_ascii_lowercase()).collect()
        };
        let split = |field: &Field| field.names.len() > 1 && chosen(&lower(field));
        if !self.fields.iter().any(split) {
            return;
        }
        for field in std::mem::take(&mut self.fields) {
            if split(&field) {
                let parts = unweave(&field.values, field.names.len());
                let single = |(name, values)| Field { names: vec![name], values };
                self.fields.extend(field.names.into_iter().zip(parts).map(single));
            } else {
                self.fields.push(field);
            }
        }
    }

    /// The rows whose entry in `mask` is true.
    pub(crate) fn keep(&mut self, mask: &[bool]) {
        for field in &mut self.fields {
            field.values = field.values.select(field.names.len(), mask);
        }
        self.faces = faces::kept(&self.faces, mask);
        self.n_rows = mask.iter().filter(|&&keep| keep).count();
    }

    /// A column that has the role that is known of its name.
    pub(crate) fn in_role(&self, column: Column) -> Column {
        let known = self.roles.iter().find(|(name, _)| name == column.name());
        known.map_or_else(|| column.clone(), |(_, role)| column.with_role(*role))
    }

    /// The words after a prefix in each comment that this program wrote into the file.
    pub(crate) fn notes<'a>(&'a self, kind: &str) -> impl Iterator<Item = Vec<&'a str>> {
        self.comments.iter().filter_map(move |comment| {
            let mut words = comment.split_ascii_whitespace();
            let is_ours = words.next() == Some("surfelshop") && words.next() == Some(kind);
            is_ours.then(|| words.collect())
        })
    }
}
