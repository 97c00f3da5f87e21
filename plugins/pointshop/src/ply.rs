//! The surfels of a PLY file, for tools that take a second cloud.
//!
//! The host gives a tool one cloud. The second is named by a parameter, and this reads it: text, and
//! binary of both byte orders, with properties called as Surfelshop writes them. Any other format is
//! converted first (`surfelshop convert`).

use crate::surfels::{Surfels, progress_of};
use std::ops::Range;
use std::path::Path;
use surfelshop_api::columns::{COLOR, Element, NORMAL, POSITION, RADIUS, TANGENT_U, TANGENT_V};
use surfelshop_api::glam::{DVec3, Vec3};
use surfelshop_api::prelude::*;
use surfelshop_geometry::{Bounds, normals, radii};

/// Longest header that is read, in bytes.
const MOST_HEADER: usize = 1 << 20;

/// Neighbours that missing normals are fitted to.
const NEIGHBOURS: usize = 16;

/// How values are written.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

/// A property of each vertex.
#[derive(Clone, Debug)]
struct Property {
    name: String,
    element: Element,
    /// Bytes before it in a vertex.
    offset: usize,
}

/// A file whose vertices have been found, and all of whose values are there.
#[derive(Debug)]
pub(crate) struct PlyFile {
    /// Number of vertices.
    pub(crate) len: usize,
    encoding: Encoding,
    properties: Vec<Property>,
    /// Bytes of a vertex.
    stride: usize,
    /// The vertices of a binary file, with what is around them.
    bytes: Vec<u8>,
    first: usize,
    /// The values of a text, vertex by vertex.
    numbers: Vec<f64>,
    /// What the file is called.
    name: String,
}

/// What a component of a column is called.
pub(crate) fn property_name(column: &str, components: usize, component: usize) -> String {
    let axis = ["x", "y", "z"].get(component).copied().unwrap_or_default();
    match column {
        POSITION => axis.to_owned(),
        NORMAL => format!("n{axis}"),
        COLOR => ["red", "green", "blue", "alpha"][component.min(3)].to_owned(),
        TANGENT_U | TANGENT_V => format!("{column}_{axis}"),
        _ if components == 1 => column.to_owned(),
        _ => format!("{column}_{component}"),
    }
}

impl PlyFile {
    /// Reads a file.
    ///
    /// # Errors
    /// A line that says what was expected of the file and what was found.
    pub(crate) fn read(path: &Path) -> Result<Self> {
        let size = std::fs::metadata(path).at(path)?.len();
        let mut bytes = Vec::new();
        usize::try_from(size)
            .ok()
            .and_then(|size| bytes.try_reserve_exact(size).ok())
            .ok_or_else(|| Error::new(format!("expected memory for {size} bytes")).at(path))?;
        let mut file = std::fs::File::open(path).at(path)?;
        std::io::Read::read_to_end(&mut file, &mut bytes).at(path)?;
        let file = Self::parse(bytes).map_err(|error| error.at(path))?;
        Ok(Self { name: path.display().to_string(), ..file })
    }

    /// A file's bytes.
    ///
    /// # Errors
    /// As [`read`](Self::read), without the file's name.
    pub(crate) fn parse(bytes: Vec<u8>) -> Result<Self> {
        if !bytes.starts_with(b"ply") {
            return Err(Error::new(
                "expected a PLY file, found another one; `surfelshop convert` makes one of it",
            ));
        }
        let mut header = Header::default();
        let mut at = 0;
        loop {
            let rest = &bytes[at..bytes.len().min(MOST_HEADER)];
            let end = rest.iter().position(|byte| *byte == b'\n');
            let end = end.ok_or_else(|| Error::new("expected a header that ends, found none"))?;
            let line = String::from_utf8_lossy(&rest[..end]).trim().to_owned();
            at += end + 1;
            if line == "end_header" {
                break;
            }
            header.line(&line)?;
        }
        header.finish(bytes, at)
    }

    /// The values of a property; `None` where there is none of this name.
    pub(crate) fn values(&self, name: &str) -> Option<Vec<f64>> {
        let column = self.properties.iter().position(|property| property.name == name)?;
        if self.encoding == Encoding::Text {
            let rows = self.numbers.chunks_exact(self.properties.len());
            return Some(rows.map(|row| row[column]).collect());
        }
        let Property { element, offset, .. } = &self.properties[column];
        let rows = self.bytes[self.first..].chunks_exact(self.stride).take(self.len);
        let big = self.encoding == Encoding::BigEndian;
        Some(rows.map(|row| number(&row[*offset..], *element, big)).collect())
    }

    /// The type of a property.
    pub(crate) fn element(&self, name: &str) -> Option<Element> {
        let property = self.properties.iter().find(|property| property.name == name)?;
        Some(property.element)
    }

    /// Three properties as vectors.
    fn vectors(&self, column: &str) -> Option<Vec<DVec3>> {
        let [x, y, z] = [0, 1, 2].map(|i| self.values(&property_name(column, 3, i)));
        let (x, y, z) = (x?, y?, z?);
        Some(x.into_iter().zip(y).zip(z).map(|((x, y), z)| DVec3::new(x, y, z)).collect())
    }

    /// The surfels relative to an origin; normals and radii that are missing are estimated.
    ///
    /// # Errors
    /// Where there are no finite positions, or the job is to stop.
    pub(crate) fn surfels(
        &self,
        origin: DVec3,
        job: &Job<'_>,
        share: Range<f64>,
    ) -> Result<Surfels> {
        let refused = |why: &str| Error::new(why).at(&self.name);
        let places = self.vectors(POSITION).ok_or_else(|| {
            refused("expected vertices with the properties x, y and z, found others")
        })?;
        let places: Vec<DVec3> = places.into_iter().map(|place| place - origin).collect();
        let bounds = Bounds::of(places.iter().copied());
        let middle = bounds.ok_or_else(|| refused("expected surfels, found none"))?.centre();
        if !places.iter().all(|place| place.is_finite()) {
            return Err(refused("expected finite positions, found others"));
        }
        let positions: Vec<Vec3> = places.iter().map(|place| (place - middle).as_vec3()).collect();
        let half = 0.5 * (share.start + share.end);
        let normals = match self.vectors(NORMAL) {
            Some(normals) => normals,
            None => {
                let progress = progress_of(job, share.start..half, "estimating normals");
                let found = normals::estimate(&positions, NEIGHBOURS, &progress)?;
                found.normals.iter().map(|normal| normal.as_dvec3()).collect()
            }
        };
        let normals: Vec<DVec3> =
            normals.into_iter().map(|normal| normal.normalize_or(DVec3::Z)).collect();
        let valid =
            |radii: &Vec<f64>| radii.iter().all(|radius| *radius > 0.0 && radius.is_finite());
        let radii = match self.values(RADIUS).filter(valid) {
            Some(radii) => radii,
            None => {
                let progress = progress_of(job, half..share.end, "estimating radii");
                let normals: Vec<Vec3> = normals.iter().map(|normal| normal.as_vec3()).collect();
                let found = radii::estimate(&positions, &normals, &progress)?;
                found.into_iter().map(f64::from).collect()
            }
        };
        Ok(Surfels { places, normals, radii })
    }

    /// The half axes of surfels; `None` where the file has none.
    pub(crate) fn tangents(&self) -> Option<Vec<[DVec3; 2]>> {
        let (us, vs) = (self.vectors(TANGENT_U)?, self.vectors(TANGENT_V)?);
        Some(us.into_iter().zip(vs).map(|(u, v)| [u, v]).collect())
    }
}

/// A property's name and type.
type HeaderProperty = (String, Option<Element>);

/// What a header has said so far.
#[derive(Default)]
struct Header {
    encoding: Option<Encoding>,
    /// Each element: its name, count, and properties; of lists there is no type.
    elements: Vec<(String, usize, Vec<HeaderProperty>)>,
}

impl Header {
    fn line(&mut self, line: &str) -> Result<()> {
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        match words[..] {
            ["format", encoding, _] => {
                self.encoding = Some(match encoding {
                    "ascii" => Encoding::Text,
                    "binary_little_endian" => Encoding::LittleEndian,
                    "binary_big_endian" => Encoding::BigEndian,
                    _ => {
                        return Err(Error::new(format!("expected a known format, found `{line}`")));
                    }
                });
            }
            ["element", name, count] => {
                let count = count.parse().ok();
                let count = count.ok_or_else(|| {
                    Error::new(format!("expected the count of an element, found `{line}`"))
                })?;
                self.elements.push((name.to_owned(), count, Vec::new()));
            }
            ["property", "list", _, _, name] => self.property(name, None)?,
            ["property", kind, name] => {
                let element = match kind {
                    "char" | "int8" => Element::I8,
                    "uchar" | "uint8" => Element::U8,
                    "short" | "int16" => Element::I16,
                    "ushort" | "uint16" => Element::U16,
                    "int" | "int32" => Element::I32,
                    "uint" | "uint32" => Element::U32,
                    "float" | "float32" => Element::F32,
                    "double" | "float64" => Element::F64,
                    _ => {
                        return Err(Error::new(format!("expected a known type, found `{line}`")));
                    }
                };
                self.property(name, Some(element))?;
            }
            ["property", ..] => {
                return Err(Error::new(format!("expected a property, found `{line}`")));
            }
            _ => {}
        }
        Ok(())
    }

    fn property(&mut self, name: &str, element: Option<Element>) -> Result<()> {
        let (_, _, properties) = self
            .elements
            .last_mut()
            .ok_or_else(|| Error::new("expected an element before its properties, found none"))?;
        properties.push((name.to_owned(), element));
        Ok(())
    }

    fn finish(self, bytes: Vec<u8>, start: usize) -> Result<PlyFile> {
        let encoding =
            self.encoding.ok_or_else(|| Error::new("expected a line `format`, found none"))?;
        let mut first = start;
        let mut lines_before = 0;
        for (name, len, properties) in self.elements {
            let fixed: Option<Vec<(String, Element)>> =
                properties.into_iter().map(|(name, element)| Some((name, element?))).collect();
            let Some(fixed) = fixed else {
                return Err(Error::new(format!(
                    "expected vertices without lists before all else, found lists in `{name}`; \
                     `surfelshop convert` writes such a file"
                )));
            };
            let mut stride = 0;
            let properties: Vec<Property> = fixed
                .into_iter()
                .map(|(name, element)| {
                    let offset = stride;
                    stride += element.size();
                    Property { name, element, offset }
                })
                .collect();
            if name != "vertex" {
                lines_before += len;
                first = first.saturating_add(len.saturating_mul(stride));
                continue;
            }
            let mut file = PlyFile {
                len,
                encoding,
                properties,
                stride: stride.max(1),
                bytes,
                first,
                numbers: Vec::new(),
                name: String::new(),
            };
            if encoding == Encoding::Text {
                file.numbers =
                    text(&file.bytes[start..], lines_before, len, file.properties.len())?;
                file.bytes = Vec::new();
                return Ok(file);
            }
            let end = len.checked_mul(file.stride).and_then(|size| size.checked_add(first));
            if end.is_none_or(|end| end > file.bytes.len()) {
                let there = file.bytes.len().saturating_sub(first) / file.stride;
                return Err(Error::new(format!("expected {len} vertices, found {there}")));
            }
            return Ok(file);
        }
        Err(Error::new("expected an element `vertex`, found none"))
    }
}

/// The numbers of the vertices of a text.
fn text(bytes: &[u8], lines_before: usize, len: usize, width: usize) -> Result<Vec<f64>> {
    let text = String::from_utf8_lossy(bytes);
    let lines = text.lines().filter(|line| !line.trim().is_empty()).skip(lines_before).take(len);
    let mut numbers = Vec::new();
    let mut n_lines = 0;
    for line in lines {
        let before = numbers.len();
        for word in line.split_ascii_whitespace().take(width) {
            let number = word.parse::<f64>();
            numbers.push(number.map_err(|_wrong| {
                Error::new(format!("expected a number of vertex {n_lines}, found `{word}`"))
            })?);
        }
        if numbers.len() - before != width {
            let found = numbers.len() - before;
            return Err(Error::new(format!(
                "expected {width} numbers of vertex {n_lines}, found {found}"
            )));
        }
        n_lines += 1;
    }
    if n_lines != len {
        return Err(Error::new(format!("expected {len} vertices, found {n_lines}")));
    }
    Ok(numbers)
}

/// The number at the beginning of these bytes.
fn number(bytes: &[u8], element: Element, big: bool) -> f64 {
    macro_rules! read {
        ($type:ty) => {{
            let word = bytes.first_chunk().copied().unwrap_or_default();
            f64::from(if big { <$type>::from_be_bytes(word) } else { <$type>::from_le_bytes(word) })
        }};
    }
    match element {
        Element::I8 => read!(i8),
        Element::U8 => read!(u8),
        Element::I16 => read!(i16),
        Element::U16 => read!(u16),
        Element::I32 => read!(i32),
        Element::U32 => read!(u32),
        Element::F32 => read!(f32),
        Element::F64 => read!(f64),
    }
}
