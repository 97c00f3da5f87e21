//! Triangles whose corners are put together, on their way to the host.

use std::collections::HashMap;
use std::hash::{BuildHasher, Hash, Hasher, RandomState};
use surfelshop_api::columns::{Element, POSITION, Values};
use surfelshop_api::format::{BATCH, CloudHeader, CloudSink, FileColumn};
use surfelshop_api::prelude::{Error, Result};

/// A coordinate: `f32` or `f64`.
pub(crate) trait Coordinate: Copy {
    /// What tells two of them apart.
    type Bits: Copy + Eq + Hash;
    /// Their type in a column.
    const ELEMENT: Element;
    /// The bits; those of 0 for -0.
    fn bits(self) -> Self::Bits;
    /// What the sink takes.
    fn values(values: &[Self]) -> Values<'_>;
}

macro_rules! coordinate {
    ($type:ident, $bits:ident, $variant:ident) => {
        impl Coordinate for $type {
            type Bits = $bits;
            const ELEMENT: Element = Element::$variant;

            fn bits(self) -> $bits {
                (self + 0.0).to_bits()
            }

            fn values(values: &[Self]) -> Values<'_> {
                Values::$variant(values)
            }
        }
    };
}

coordinate!(f32, u32, F32);
coordinate!(f64, u64, F64);

/// Hashes corners fast, with a seed that no file knows.
#[derive(Clone, Copy)]
struct Seed(u64);

impl BuildHasher for Seed {
    type Hasher = Folded;

    fn build_hasher(&self) -> Folded {
        Folded(self.0)
    }
}

/// Multiplies, and folds the halves of the product.
struct Folded(u64);

impl Hasher for Folded {
    fn write(&mut self, bytes: &[u8]) {
        for chunk in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            self.write_u64(u64::from_ne_bytes(word));
        }
    }

    fn write_u64(&mut self, word: u64) {
        let product = u128::from(self.0 ^ word) * u128::from(0x9e37_79b9_7f4a_7c15_u64);
        self.0 = (product >> 64) as u64 ^ product as u64;
    }

    fn write_usize(&mut self, _length: usize) {
        // Every key has the same.
    }

    fn finish(&self) -> u64 {
        self.0
    }
}

/// A mesh as far as it was read.
pub(crate) struct Mesh<'a, 'b, T: Coordinate> {
    clouds: &'a mut CloudSink<'b>,
    known: HashMap<[T::Bits; 3], u32, Seed>,
    n_corners: u32,
    /// Corners and triangles that the host does not have yet.
    corners: Vec<T>,
    triangles: Vec<[u32; 3]>,
    n_triangles: u64,
}

impl<'a, 'b, T: Coordinate> Mesh<'a, 'b, T> {
    /// Hands the header over; `None` where nobody wants the points.
    ///
    /// # Errors
    /// Where the host refuses.
    pub(crate) fn begin(
        clouds: &'a mut CloudSink<'b>,
        encoding: &str,
        name: String,
        comments: Vec<String>,
    ) -> Result<Option<Self>> {
        let header = CloudHeader {
            format: format!("STL, {encoding}"),
            name,
            columns: vec![FileColumn::new(POSITION, 3, T::ELEMENT)],
            has_faces: true,
            comments,
            ..CloudHeader::default()
        };
        if !clouds.begin(&header)? {
            return Ok(None);
        }
        let seed = Seed(RandomState::new().hash_one(0));
        Ok(Some(Self {
            clouds,
            known: HashMap::with_hasher(seed),
            n_corners: 0,
            corners: Vec::new(),
            triangles: Vec::new(),
            n_triangles: 0,
        }))
    }

    /// Number of triangles so far.
    pub(crate) fn n_triangles(&self) -> u64 {
        self.n_triangles
    }

    /// Says something doubtful of the file.
    pub(crate) fn warn(&mut self, line: &str) {
        self.clouds.warn(line);
    }

    /// Takes the next triangle.
    ///
    /// # Errors
    /// Where there are too many corners, memory runs out, or the host refuses.
    pub(crate) fn push(&mut self, corners: &[[T; 3]; 3]) -> Result<()> {
        if self.triangles.is_empty() {
            self.triangles.try_reserve(BATCH)?;
            self.corners.try_reserve(9 * BATCH)?;
        }
        let mut triangle = [0; 3];
        for (index, corner) in triangle.iter_mut().zip(corners) {
            *index = match self.known.get(&corner.map(T::bits)) {
                Some(known) => *known,
                None => self.add(corner)?,
            };
        }
        self.triangles.push(triangle);
        self.n_triangles += 1;
        if self.triangles.len() >= BATCH { self.flush() } else { Ok(()) }
    }

    fn add(&mut self, corner: &[T; 3]) -> Result<u32> {
        let index = self.n_corners;
        self.n_corners = index.checked_add(1).ok_or_else(|| {
            Error::new("expected at most 4294967295 different corners, found more")
        })?;
        self.known.try_reserve(1)?;
        self.known.insert(corner.map(T::bits), index);
        self.corners.extend_from_slice(corner);
        Ok(index)
    }

    /// Hands over what the host does not have yet: corners before triangles that use them.
    ///
    /// # Errors
    /// Where the host refuses.
    pub(crate) fn flush(&mut self) -> Result<()> {
        if !self.corners.is_empty() {
            self.clouds.batch(&[T::values(&self.corners)])?;
        }
        if !self.triangles.is_empty() {
            self.clouds.faces(&self.triangles)?;
        }
        self.corners.clear();
        self.triangles.clear();
        Ok(())
    }
}
