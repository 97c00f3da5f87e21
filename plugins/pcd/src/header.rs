//! The text before the points.

use crate::Encoding;
use surfelshop_api::format::FileSource;
use surfelshop_api::glam::{DQuat, DVec3};
use surfelshop_api::prelude::{Error, Result};

/// Most bytes of a header: a thousand fields take a few ten thousand.
const MAX_BYTES: u64 = 1 << 20;

/// Most fields of a point, as many as a host takes columns.
const MAX_FIELDS: usize = 4096;

/// What the elements of a field are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Signed,
    Unsigned,
    Float,
    /// A letter that the format does not have.
    Unknown,
}

/// A field of a point.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Field {
    pub name: String,
    pub kind: Kind,
    /// Bytes of an element.
    pub size: usize,
    pub count: usize,
    /// Where it lies in a point.
    pub offset: usize,
}

impl Field {
    /// Bytes in a point.
    pub(crate) fn bytes(&self) -> usize {
        self.size * self.count
    }

    /// Whether it only fills space.
    pub(crate) fn is_padding(&self) -> bool {
        self.name == "_"
    }
}

/// What VIEWPOINT has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Viewpoint {
    pub rotation: DQuat,
    pub translation: DVec3,
}

impl Viewpoint {
    /// Whether it is what programs write that know none.
    pub(crate) fn is_default(&self) -> bool {
        self.translation == DVec3::ZERO && self.rotation == DQuat::IDENTITY
    }
}

/// A header.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Header {
    /// Such as `0.7`; empty where the file does not say.
    pub version: String,
    pub fields: Vec<Field>,
    /// Bytes of a point.
    pub step: usize,
    pub rows: u64,
    pub grid: Option<[u32; 2]>,
    pub viewpoint: Option<Viewpoint>,
    pub encoding: Encoding,
    /// Where the points begin.
    pub start: u64,
    pub comments: Vec<String>,
    /// What is doubtful.
    pub warnings: Vec<String>,
}

/// The entries as they are found.
#[derive(Default)]
struct Entries {
    version: String,
    names: Option<Vec<String>>,
    sizes: Option<Vec<usize>>,
    kinds: Option<Vec<Kind>>,
    counts: Option<Vec<usize>>,
    width: Option<u64>,
    height: Option<u64>,
    points: Option<u64>,
    viewpoint: Option<Viewpoint>,
    comments: Vec<String>,
    warnings: Vec<String>,
}

impl Header {
    /// Reads the header of a file.
    ///
    /// # Errors
    /// Where there is none, or it contradicts itself.
    pub(crate) fn read(file: &FileSource) -> Result<Self> {
        let text = file.bytes_at(0, file.length().min(MAX_BYTES))?;
        let (mut entries, mut start) = (Entries::default(), 0);
        for line in text.split_inclusive(|&byte| byte == b'\n') {
            start += line.len();
            let line = String::from_utf8_lossy(line);
            let line = line.trim_start_matches('\u{feff}').trim();
            let mut words = line.split_ascii_whitespace();
            let Some(keyword) = words.next() else { continue };
            let values: Vec<&str> = words.collect();
            if let Some(comment) = line.strip_prefix('#') {
                entries.comment(comment.trim());
            } else if keyword == "DATA" {
                return entries.finish(encoding(&values)?, start as u64);
            } else {
                entries.take(keyword, &values)?;
            }
        }
        Err(Error::new(format!(
            "expected a header that ends with a line DATA, found none in the first {} bytes",
            text.len()
        )))
    }
}

fn encoding(values: &[&str]) -> Result<Encoding> {
    match values.first().copied().unwrap_or_default() {
        "ascii" => Ok(Encoding::Ascii),
        "binary" => Ok(Encoding::Binary),
        "binary_compressed" => Ok(Encoding::BinaryCompressed),
        other => Err(Error::new(format!(
            "DATA: expected ascii, binary or binary_compressed, found `{}`",
            shown(other)
        ))),
    }
}

/// Text of a file as a message has it.
pub(crate) fn shown(text: &str) -> String {
    let short: String = text.chars().take(40).collect();
    short.escape_debug().to_string()
}

/// A value for each field.
fn numbers(keyword: &str, values: &[&str]) -> Result<Vec<usize>> {
    let parse = |value: &&str| {
        value.parse::<u32>().ok().and_then(|value| usize::try_from(value).ok()).ok_or_else(|| {
            Error::new(format!("{keyword}: expected whole numbers, found `{}`", shown(value)))
        })
    };
    values.iter().map(parse).collect()
}

fn number(keyword: &str, values: &[&str]) -> Result<u64> {
    let value = values.first().copied().unwrap_or_default();
    let bad =
        |_| Error::new(format!("{keyword}: expected a whole number, found `{}`", shown(value)));
    value.parse::<u64>().map_err(bad)
}

fn viewpoint(values: &[&str]) -> Option<Viewpoint> {
    let numbers: Option<Vec<f64>> =
        values.iter().map(|value| value.parse().ok().filter(|v: &f64| v.is_finite())).collect();
    let [tx, ty, tz, qw, qx, qy, qz] = numbers?.try_into().ok()?;
    let rotation = DQuat::from_xyzw(qx, qy, qz, qw);
    let length = rotation.length();
    let turns = length.is_finite() && length > 1e-6;
    // Zeros stand for no rotation in the files of some programs.
    let rotation = if turns { rotation / length } else { DQuat::IDENTITY };
    Some(Viewpoint { rotation, translation: DVec3::new(tx, ty, tz) })
}

impl Entries {
    fn comment(&mut self, comment: &str) {
        let is_title = comment.starts_with(".PCD");
        if !is_title && !comment.is_empty() && self.comments.len() < 1000 {
            self.comments.push(comment.chars().filter(|c| !c.is_control()).collect());
        }
    }

    fn take(&mut self, keyword: &str, values: &[&str]) -> Result<()> {
        match keyword {
            "VERSION" => {
                let version = values.first().copied().unwrap_or_default();
                let zero = if version.starts_with('.') { "0" } else { "" };
                self.version = format!("{zero}{}", shown(version));
            }
            "FIELDS" | "COLUMNS" => {
                if values.len() > MAX_FIELDS {
                    let found = values.len();
                    return Err(Error::new(format!(
                        "{keyword}: expected at most {MAX_FIELDS} fields, found {found}"
                    )));
                }
                self.names = Some(values.iter().map(|&name| name.to_owned()).collect());
            }
            "SIZE" => self.sizes = Some(numbers(keyword, values)?),
            "COUNT" => self.counts = Some(numbers(keyword, values)?),
            "TYPE" => {
                let kind = |value: &&str| match value.as_bytes().first() {
                    Some(b'I' | b'i') => Kind::Signed,
                    Some(b'U' | b'u') => Kind::Unsigned,
                    Some(b'F' | b'f') => Kind::Float,
                    _ => Kind::Unknown,
                };
                self.kinds = Some(values.iter().map(kind).collect());
            }
            "WIDTH" => self.width = Some(number(keyword, values)?),
            "HEIGHT" => self.height = Some(number(keyword, values)?),
            "POINTS" => self.points = Some(number(keyword, values)?),
            "VIEWPOINT" => {
                self.viewpoint = viewpoint(values);
                if self.viewpoint.is_none() {
                    self.warnings.push("VIEWPOINT has not seven finite numbers".to_owned());
                }
            }
            _ => {}
        }
        Ok(())
    }

    fn finish(mut self, encoding: Encoding, start: u64) -> Result<Header> {
        if !matches!(self.version.as_str(), "0.5" | "0.6" | "0.7") {
            let found = if self.version.is_empty() { "none" } else { &self.version };
            self.warnings.push(format!("expected a version from .5 to .7, found {found}"));
        }
        let (fields, step) = self.fields()?;
        let (rows, grid) = self.rows()?;
        Ok(Header {
            version: self.version,
            fields,
            step,
            rows,
            grid,
            viewpoint: self.viewpoint,
            encoding,
            start,
            comments: self.comments,
            warnings: self.warnings,
        })
    }

    /// The fields, and the bytes of a point.
    fn fields(&mut self) -> Result<(Vec<Field>, usize)> {
        let names =
            self.names.take().ok_or_else(|| Error::new("expected a line FIELDS, found none"))?;
        let n = names.len();
        // Version .5 has floats alone and does not say so.
        let sizes = self.sizes.take().unwrap_or_else(|| vec![4; n]);
        let kinds = self.kinds.take().unwrap_or_else(|| vec![Kind::Float; n]);
        let counts = self.counts.take().unwrap_or_else(|| vec![1; n]);
        for (keyword, found) in
            [("SIZE", sizes.len()), ("TYPE", kinds.len()), ("COUNT", counts.len())]
        {
            if found != n {
                return Err(Error::new(format!(
                    "{keyword}: expected {n} values, one for each field, found {found}"
                )));
            }
        }
        let (mut fields, mut step) = (Vec::with_capacity(n), 0usize);
        if let Some(size) = sizes.iter().find(|size| **size > 16) {
            return Err(Error::new(format!("SIZE: expected 1, 2, 4 or 8, found {size}")));
        }
        for (((name, size), kind), count) in names.into_iter().zip(sizes).zip(kinds).zip(counts) {
            let end = size.checked_mul(count).and_then(|bytes| step.checked_add(bytes));
            let end = end.filter(|&end| u32::try_from(end).is_ok()).ok_or_else(|| {
                Error::new(format!("field `{}`: {count} elements of {size} bytes", shown(&name)))
            })?;
            // PCL, too, removes fields without elements.
            if end > step {
                fields.push(Field { name, kind, size, count, offset: step });
            }
            step = end;
        }
        Ok((fields, step))
    }

    /// Number of points, and the grid of an organised cloud.
    fn rows(&self) -> Result<(u64, Option<[u32; 2]>)> {
        let product = match (self.width, self.height) {
            (Some(width), height) => {
                let height = height.unwrap_or(1);
                let too_many = || Error::new(format!("{width} x {height} points are too many"));
                Some(width.checked_mul(height).ok_or_else(too_many)?)
            }
            (None, _) => None,
        };
        let rows = match (self.points, product) {
            (Some(points), Some(product)) if points != product => {
                return Err(Error::new(format!(
                    "expected POINTS to be WIDTH times HEIGHT, {product}, found {points}"
                )));
            }
            (Some(points), _) => points,
            (None, Some(product)) => product,
            (None, None) => {
                return Err(Error::new("expected a line POINTS or WIDTH, found neither"));
            }
        };
        let grid = match (self.width, self.height) {
            (Some(width), Some(height)) if width > 0 && height > 1 => {
                u32::try_from(width).ok().zip(u32::try_from(height).ok())
            }
            _ => None,
        };
        Ok((rows, grid.map(<[u32; 2]>::from)))
    }
}
