//! The tree of a file: the scene, the list of surfel sets, and the sets.

use super::placement::is_invertible;
use super::set::{SurfelSet, matrix, or_warn};
use crate::gff::{Directory, Gff, MAX_CHILDREN, root_offset, tags};
use crate::write::axes_of;
use surfelshop_api::format::{FileSource, UpAxis};
use surfelshop_api::glam::{DMat3, DVec3, Vec3};
use surfelshop_api::{Error, Result};

/// What a file says of all its sets.
#[derive(Clone, Debug)]
pub(crate) struct Facts {
    /// Rows: the directions to the right, upwards and back, of the file's coordinates; these as they are where the file's
    /// own point up along x or z.
    pub(crate) axes: DMat3,
    /// What points up of the coordinates that come of it.
    pub(crate) up: UpAxis,
    /// Length of a unit; 0 where the file has none.
    pub(crate) metres_per_unit: f64,
    /// When the file was made; may be empty.
    pub(crate) date: String,
    /// For people.
    pub(crate) comments: Vec<String>,
}

/// A file.
#[derive(Clone, Debug)]
pub(crate) struct Scene {
    /// What it says of all its sets.
    pub(crate) facts: Facts,
    /// The sets, at least one.
    pub(crate) sets: Vec<SurfelSet>,
    /// What is doubtful.
    pub(crate) warnings: Vec<String>,
}

/// Ways to find the root directory: bytes that are skipped before it, and bytes that all offsets lack. The original library wrote
/// a stray byte behind the header where it wrote to a pipe.
const WAYS: [(u32, u64); 3] = [(0, 0), (1, 0), (0, 1)];

impl Scene {
    /// Reads the directories of a file.
    ///
    /// # Errors
    /// Where no surfel set can be found.
    pub(crate) fn open(file: &FileSource) -> Result<Self> {
        let root = root_offset(file)?;
        let mut why = None;
        for (skipped, shift) in WAYS {
            match Self::of(&mut Gff::new(file, shift), root.saturating_add(skipped)) {
                Ok(mut scene) => {
                    if (skipped, shift) != WAYS[0] {
                        let line = "the file has a stray byte behind its header, as files written to a pipe have";
                        scene.warnings.push(line.to_owned());
                    }
                    return Ok(scene);
                }
                Err(error) => why = why.or(Some(error)),
            }
        }
        Err(why.unwrap_or_else(|| Error::new("the file has no root directory")))
    }

    fn of(gff: &mut Gff<'_>, root: u32) -> Result<Self> {
        let root = gff.directory(root)?;
        let index = gff.whole_number(&root, tags::SET_LIST_INDEX)?.ok_or_else(|| {
            Error::new("expected the list of surfel sets in the root directory, found none")
        })?;
        let mut warnings = Vec::new();
        let facts = Facts::of(gff, &root, &mut warnings);
        let list = gff.child(&root, index)?;
        let sets = sets(gff, &list, &mut warnings)?;
        Ok(Self { facts, sets, warnings })
    }
}

/// Reads the sets of a list as far as they can be found.
fn sets(gff: &mut Gff<'_>, list: &Directory, warnings: &mut Vec<String>) -> Result<Vec<SurfelSet>> {
    let announced = or_warn(gff.whole_number(list, tags::N_SETS), warnings);
    let mut sets: Vec<SurfelSet> = Vec::new();
    let (mut n, mut bytes, mut damage) = (0, 0, None);
    let mut next = list.first_child();
    while let Some(offset) = next {
        if n == MAX_CHILDREN as usize {
            warnings.push(format!("only the first {n} surfel sets are read"));
            break;
        }
        let directory = match gff.directory(offset) {
            Ok(directory) if directory.is_closing() => break,
            Ok(directory) => directory,
            Err(error) if n == 0 => return Err(error),
            Err(error) => {
                warnings.push(format!("surfel sets behind number {n} cannot be found: {error}"));
                break;
            }
        };
        next = directory.next();
        match SurfelSet::of(gff, &directory, n) {
            Ok(set) => {
                bytes += set.bytes();
                sets.push(set);
            }
            Err(error) => {
                warnings.push(format!("surfel set {n} is left out: {error}"));
                damage = damage.or(Some(error));
            }
        }
        if bytes > gff.file().length() {
            return Err(Error::new(
                "surfel sets have more data than the file has bytes: they share it",
            ));
        }
        n += 1;
    }
    if let Some(announced) = announced.filter(|&announced| usize::try_from(announced) != Ok(n)) {
        warnings.push(format!("{announced} surfel sets are announced, {n} are found"));
    }
    if sets.is_empty() {
        return Err(damage.unwrap_or_else(|| Error::new("expected surfel sets, found none")));
    }
    Ok(sets)
}

impl Facts {
    fn of(gff: &Gff<'_>, root: &Directory, warnings: &mut Vec<String>) -> Self {
        let mut comments = Vec::new();
        let texts = [
            (tags::TITLE, "title"),
            (tags::AUTHOR, "author"),
            (tags::APPLICATION, "application"),
            (tags::DESCRIPTION, "description"),
            (tags::DATE, "date"),
        ];
        let mut date = String::new();
        for (tag, what) in texts {
            if let Some(text) = or_warn(gff.text(root, tag), warnings) {
                comments.push(format!("{what}: {text}"));
                if tag == tags::DATE {
                    date = text;
                }
            }
        }
        if let Some(version) = or_warn(gff.whole_number(root, tags::VERSION), warnings) {
            comments.push(format!("version: {version}"));
        }
        let units = or_warn(gff.numbers(root, tags::DEFAULT_UNITS, 1), warnings);
        let metres_per_unit = units
            .and_then(|units| units.first().copied())
            .filter(|&units| units.is_finite() && units > 0.0)
            .unwrap_or(0.0);
        let camera = or_warn(matrix(gff, root, tags::CAMERA_TRANSFORM), warnings);
        if camera.is_some() {
            comments.push("the camera of the scene is not read".to_owned());
        }
        let (axes, up) = upright(axes(gff, root, warnings));
        Self { axes, up, metres_per_unit, date, comments }
    }
}

/// Axes, and what points up with them. A file whose x or z points up, and whose other two axes follow from it, keeps its
/// coordinates: those that are written so come back as they were.
fn upright(axes: DMat3) -> (DMat3, UpAxis) {
    let as_written = |up: &UpAxis| {
        let rows = axes_of(*up).map(|row| Vec3::from(row).as_dvec3());
        DMat3::from_cols(rows[0], rows[1], rows[2]).transpose() == axes
    };
    match [UpAxis::X, UpAxis::Z].into_iter().find(as_written) {
        Some(up) => (DMat3::IDENTITY, up),
        None => (axes, UpAxis::Y),
    }
}

/// The directions to the right, upwards and back as rows; x, y and z where the file has none.
fn axes(gff: &Gff<'_>, root: &Directory, warnings: &mut Vec<String>) -> DMat3 {
    let mut axis = |tag: u16, usual: DVec3| {
        let numbers = or_warn(gff.numbers(root, tag, 3), warnings);
        let Some(numbers) = numbers else { return usual };
        <[f64; 3]>::try_from(numbers).map_or(DVec3::NAN, DVec3::from)
    };
    let rows = [axis(tags::RIGHT, DVec3::X), axis(tags::UP, DVec3::Y), axis(tags::BACK, DVec3::Z)];
    let axes = DMat3::from_cols(rows[0], rows[1], rows[2]).transpose();
    if is_invertible(axes) {
        return axes;
    }
    warnings
        .push("the file's axes are none: x is taken for right, y for up, z for back".to_owned());
    DMat3::IDENTITY
}
