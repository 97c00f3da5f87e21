//! A surfel set: its layout, its transform, and where its records lie.

use super::streamed::{UNKNOWN, end_of_data};
use crate::gff::{Directory, Gff, kind, tags};
use crate::surfel::layout::{Layout, Tables};
use surfelshop_api::glam::DVec3;
use surfelshop_api::{Error, Result};

/// Words of the property vector that are read; real ones have two.
const MAX_WORDS: u32 = 64;

/// Properties of a record that are read; 36 are known.
const MAX_PROPERTIES: u32 = 1024;

/// Bytes of a record that are read; the known properties take 180.
const MAX_RECORD: u32 = 1 << 16;

/// A surfel set.
#[derive(Clone, Debug)]
pub(crate) struct SurfelSet {
    /// What the file calls it.
    pub(crate) name: String,
    /// Version of its records.
    pub(crate) version: u32,
    /// What its records have.
    pub(crate) layout: Layout,
    /// From its coordinates to the file's, row by row.
    pub(crate) transform: Option<[f64; 16]>,
    /// Its box, in its own coordinates.
    pub(crate) bounds: Option<[DVec3; 2]>,
    /// Where its records begin in the file.
    pub(crate) start: u64,
    /// How many there are, all within the file.
    pub(crate) rows: u64,
    /// For people.
    pub(crate) comments: Vec<String>,
    /// What is doubtful.
    pub(crate) warnings: Vec<String>,
}

/// Two corners of a box, where they are finite.
pub(crate) fn bounds(gff: &Gff<'_>, directory: &Directory) -> Result<Option<[DVec3; 2]>> {
    let numbers = gff.numbers(directory, tags::BOUNDS, 6)?;
    Ok(match numbers.as_deref() {
        Some(&[a, b, c, d, e, f]) => {
            let corners = [DVec3::new(a, b, c), DVec3::new(d, e, f)];
            let is_finite = corners.iter().all(|corner| corner.is_finite());
            is_finite.then(|| [corners[0].min(corners[1]), corners[0].max(corners[1])])
        }
        _ => None,
    })
}

/// The 16 numbers of a matrix.
pub(crate) fn matrix(gff: &Gff<'_>, directory: &Directory, tag: u16) -> Result<Option<[f64; 16]>> {
    let Some(numbers) = gff.numbers(directory, tag, 16)? else { return Ok(None) };
    let found = numbers.len();
    let wrong =
        |_: Vec<f64>| Error::new(format!("tag {tag:04x}: expected 16 numbers, found {found}"));
    numbers.try_into().map(Some).map_err(wrong)
}

/// The value, or a warning of why there is none.
pub(crate) fn or_warn<T>(found: Result<Option<T>>, warnings: &mut Vec<String>) -> Option<T> {
    found.unwrap_or_else(|error| {
        warnings.push(format!("{error}: it is left out"));
        None
    })
}

impl SurfelSet {
    /// Reads what the directory of a set says, and those of its resolutions up to the full one.
    ///
    /// # Errors
    /// Where the set is damaged so that no surfel of it can be found.
    pub(crate) fn of(gff: &mut Gff<'_>, directory: &Directory, number: usize) -> Result<Self> {
        let (mut comments, mut warnings) = (Vec::new(), Vec::new());
        let version = gff.whole_number(directory, tags::SURFEL_FORMAT)?.unwrap_or(1);
        if version > 1 {
            warnings.push(format!(
                "surfel format {version} is newer than what is known, and is read as 1"
            ));
        }
        let layout = read_layout(gff, directory, version, &mut warnings)?;
        let name = or_warn(gff.text(directory, tags::IDENTIFIER), &mut warnings)
            .unwrap_or_else(|| format!("surfelSet{number:02}"));
        for (tag, what) in [(tags::MARKERS, "markers"), (tags::RELATIONS, "feature relations")] {
            if let Some(entry) = directory.entry(tag) {
                comments.push(format!("{what} of surfels are not read: {} numbers", entry.count));
            }
        }
        let transform = or_warn(matrix(gff, directory, tags::TRANSFORM), &mut warnings);
        let bounds = or_warn(bounds(gff, directory), &mut warnings);
        let n_resolutions = gff.whole_number(directory, tags::N_RESOLUTIONS)?.unwrap_or(1).max(1);
        let last = n_resolutions - 1;
        let mut full = gff.whole_number(directory, tags::FULL_RESOLUTION)?.unwrap_or(last);
        if full > last {
            warnings.push(format!(
                "the full resolution is number {full} of {n_resolutions}: the last one is read"
            ));
            full = last;
        }
        if n_resolutions > 1 {
            comments.push(format!("{last} other resolutions of the set are not read"));
        }
        let resolution = gff.child(directory, full)?;
        let next_set = directory.next().filter(|_next| full == last);
        let found = Data::of(gff, &resolution, &layout, (full == last, next_set), &mut warnings)?;
        let Data { start, rows } = found;
        Ok(Self { name, version, layout, transform, bounds, start, rows, comments, warnings })
    }

    /// Bytes of all records.
    pub(crate) fn bytes(&self) -> u64 {
        self.rows * self.layout.record as u64
    }
}

fn read_layout(
    gff: &Gff<'_>,
    directory: &Directory,
    version: u32,
    warnings: &mut Vec<String>,
) -> Result<Layout> {
    let lacking = |what: &str| Error::new(format!("expected {what} of a surfel set, found none"));
    let record = gff
        .whole_number(directory, tags::SURFEL_BYTES)?
        .ok_or_else(|| lacking("the size of the surfels"))?;
    if !(1..=MAX_RECORD).contains(&record) {
        return Err(Error::new(format!(
            "expected surfels of 1 to {MAX_RECORD} bytes, found {record}"
        )));
    }
    let table = |tag: u16, most: u32, what: &str| {
        gff.whole_numbers(directory, tag, most)?.ok_or_else(|| lacking(what))
    };
    let bits = table(tags::PROPERTY_BITS, MAX_WORDS, "the properties")?;
    let ids = table(tags::PROPERTY_IDS, MAX_PROPERTIES, "the numbers of properties")?;
    let offsets = table(tags::PROPERTY_OFFSETS, MAX_PROPERTIES, "the places of properties")?;
    let tables = Tables { version, record, bits: &bits, ids: &ids, offsets: &offsets };
    Layout::of_tables(&tables, warnings)
}

/// Where records lie.
struct Data {
    start: u64,
    rows: u64,
}

impl Data {
    fn of(
        gff: &Gff<'_>,
        resolution: &Directory,
        layout: &Layout,
        (is_last, next_set): (bool, Option<u32>),
        warnings: &mut Vec<String>,
    ) -> Result<Self> {
        let record = layout.record as u64;
        let length = gff.file().length();
        let n_surfels = gff
            .whole_number(resolution, tags::N_SURFELS)?
            .ok_or_else(|| Error::new("expected the count of the surfels, found none"))?;
        let data = resolution
            .entry(tags::SURFELS)
            .filter(|entry| entry.kind == kind::DATA)
            .ok_or_else(|| Error::new("expected the data of the surfels, found none"))?;
        let start = gff.place(data.offset());
        if n_surfels == UNKNOWN {
            if !is_last {
                return Err(Error::new(
                    "the count of surfels was not known, and other resolutions follow: expected it for the last one alone",
                ));
            }
            let bytes = end_of_data(gff, start, next_set)?.saturating_sub(start);
            let rows = bytes / record;
            if bytes % record > 3 {
                let rest = bytes % record;
                warnings.push(format!("{rest} bytes behind the last whole surfel are left out"));
            }
            warnings.push(format!(
                "the file was written without a count of its surfels: {rows} are found"
            ));
            return Ok(Self { start, rows });
        }
        let announced = u64::from(n_surfels);
        let stored = u64::from(data.count) / record;
        if announced * record != u64::from(data.count) {
            warnings.push(format!(
                "{announced} surfels of {record} bytes are announced in {} bytes of data",
                data.count
            ));
        }
        let expected = announced.min(stored);
        let rows = expected.min(length.saturating_sub(start) / record);
        if rows == 0 && expected > 0 {
            return Err(Error::new(format!(
                "expected {expected} surfels from byte {start}, found none: the file is cut short"
            )));
        }
        if rows < expected {
            warnings
                .push(format!("expected {expected} surfels, found {rows}: the file is cut short"));
        }
        Ok(Self { start, rows })
    }
}
