//! The file `metadata.json`: what the octree is of, and how its points are stored.

use serde::Deserialize;
use surfelshop_api::format::FileSource;
use surfelshop_api::glam::DVec3;
use surfelshop_api::{Error, Result};

/// Most bytes of the file; those of clouds with a hundred attributes have some hundred thousand.
const MOST_BYTES: u64 = 1 << 20;
/// Most attributes of a point.
const MOST_ATTRIBUTES: usize = 256;
/// Most bytes of a point.
const MOST_POINT_BYTES: u64 = 1 << 16;

/// The whole file, as far as it is read.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Metadata {
    pub(crate) version: String,
    #[serde(default)]
    pub(crate) name: String,
    #[serde(default)]
    pub(crate) description: String,
    /// Number of points, for people: what the hierarchy says counts.
    #[serde(default)]
    pub(crate) points: u64,
    #[serde(default)]
    pub(crate) projection: String,
    pub(crate) hierarchy: Hierarchy,
    /// What whole coordinates are multiplied by, and what is then added.
    pub(crate) scale: [f64; 3],
    pub(crate) offset: [f64; 3],
    /// Distance between the points of the root.
    pub(crate) spacing: f64,
    /// The root's cube.
    pub(crate) bounding_box: Bounds,
    #[serde(default)]
    pub(crate) encoding: String,
    pub(crate) attributes: Vec<Attribute>,
}

/// Where the hierarchy begins.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Hierarchy {
    /// Bytes of its first chunk.
    pub(crate) first_chunk_size: u64,
}

/// A box.
#[derive(Clone, Copy, Debug, Deserialize)]
pub(crate) struct Bounds {
    pub(crate) min: [f64; 3],
    pub(crate) max: [f64; 3],
}

/// A value of points.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase", default)]
pub(crate) struct Attribute {
    pub(crate) name: String,
    pub(crate) description: String,
    /// Bytes of a point's value.
    pub(crate) size: u64,
    /// Its components, of so many bytes each.
    pub(crate) num_elements: u64,
    pub(crate) element_size: u64,
    #[serde(rename = "type")]
    pub(crate) kind: String,
    /// Smallest and largest value of each component.
    pub(crate) min: Vec<f64>,
    pub(crate) max: Vec<f64>,
    /// What each component is multiplied by, and what is then added.
    pub(crate) scale: Vec<f64>,
    pub(crate) offset: Vec<f64>,
}

/// How the points of a node are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Encoding {
    /// Point after point, as they are.
    Plain,
    /// Attribute after attribute, compressed together.
    Brotli,
}

/// What to do about a damaged file.
pub(crate) const INSTEAD: &str = "convert the cloud again";

impl Metadata {
    /// Reads the file and checks what the others are found by.
    ///
    /// # Errors
    /// Where it is of no Potree 2 octree, or damaged.
    pub(crate) fn read(file: &FileSource) -> Result<Self> {
        let length = file.length();
        if length > MOST_BYTES {
            return Err(Error::new(format!(
                "expected a metadata.json of Potree 2 of at most {MOST_BYTES} bytes, found {length}"
            )));
        }
        let bytes = file.bytes_at(0, length)?;
        let read: Self = serde_json::from_slice(&bytes).map_err(|error| {
            Error::new(format!("expected a metadata.json of Potree 2; {error}; {INSTEAD}"))
        })?;
        read.check()?;
        Ok(read)
    }

    fn check(&self) -> Result<()> {
        let fault = |line: String| Err(Error::new(format!("{line}; {INSTEAD}")));
        if !self.version.starts_with("2.") {
            let version = self.version.escape_debug();
            return fault(format!("expected a Potree octree of version 2, found `{version}`"));
        }
        self.encoding()?;
        let is_length = |x: f64| x.is_finite() && x > 0.0;
        let Bounds { min, max } = self.bounding_box;
        let numbers = [min, max, self.scale, self.offset];
        let are_numbers = numbers.iter().flatten().all(|x| x.is_finite());
        if !are_numbers || !is_length(self.side()) || !is_length(self.spacing) {
            return fault(format!(
                "expected a boundingBox and a spacing above 0, and finite scale and offset, found {min:?} to {max:?}, \
                 {}, {:?} and {:?}",
                self.spacing, self.scale, self.offset
            ));
        }
        if self.attributes.len() > MOST_ATTRIBUTES {
            let n = self.attributes.len();
            return fault(format!("expected at most {MOST_ATTRIBUTES} attributes, found {n}"));
        }
        let mut point_bytes = 0u64;
        for Attribute { name, size, num_elements: n, element_size, .. } in &self.attributes {
            point_bytes = point_bytes.saturating_add(*size);
            if *size == 0
                || n.checked_mul(*element_size) != Some(*size)
                || point_bytes > MOST_POINT_BYTES
            {
                return fault(format!(
                    "expected the attribute `{}` of 1 byte or more, and {MOST_POINT_BYTES} of all at most, found {n} elements of \
                     {element_size} bytes, {size} together",
                    name.escape_debug()
                ));
            }
        }
        Ok(())
    }

    /// How points are stored.
    ///
    /// # Errors
    /// Where nobody knows.
    pub(crate) fn encoding(&self) -> Result<Encoding> {
        match self.encoding.as_str() {
            "" | "DEFAULT" | "UNCOMPRESSED" => Ok(Encoding::Plain),
            "BROTLI" => Ok(Encoding::Brotli),
            other => Err(Error::new(format!(
                "expected points of the encoding DEFAULT or BROTLI, found `{}`; convert the cloud again with one of \
                 them",
                other.escape_debug()
            ))),
        }
    }

    /// The smallest corner of the root's cube.
    pub(crate) fn low(&self) -> DVec3 {
        DVec3::from_array(self.bounding_box.min)
    }

    /// Its side: the longest, should it be no cube.
    pub(crate) fn side(&self) -> f64 {
        (DVec3::from_array(self.bounding_box.max) - self.low()).max_element()
    }
}
