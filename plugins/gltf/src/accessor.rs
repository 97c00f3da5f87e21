//! Accessors whose every byte was found before one is read.

use crate::buffers::{Buffers, Span};
use gltf::json::Root;
use gltf::json::accessor::{ComponentType, Type, sparse};
use gltf::json::validation::Checked;
use surfelshop_api::prelude::{Error, Result};

/// Most bytes between neighbouring elements.
const MAX_STRIDE: u64 = 252;

/// Most elements of an accessor that has no bytes, whose elements are 0.
const MAX_ZEROS: u64 = 1 << 24;

/// What elements are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Shape {
    pub kind: ComponentType,
    /// 1 to 4, or those of a matrix.
    pub components: usize,
    /// Whether whole numbers stand for 0 to 1, or -1 to 1.
    pub normalized: bool,
}

impl Shape {
    /// Bytes of an element.
    pub(crate) fn bytes(&self) -> usize {
        self.kind.size() * self.components
    }
}

/// Elements that stand in the place of others.
#[derive(Clone, Debug)]
struct Sparse {
    count: u64,
    indices: Span,
    index_kind: ComponentType,
    values: Span,
}

/// An accessor.
#[derive(Clone, Debug)]
pub(crate) struct Accessor {
    pub shape: Shape,
    pub count: u32,
    /// The elements and the bytes from one to the next; zeros where there are none.
    dense: Option<(Span, u64)>,
    sparse: Option<Sparse>,
}

impl Accessor {
    /// Finds an accessor.
    ///
    /// # Errors
    /// Where it, or a byte of it, is not there.
    pub(crate) fn find(root: &Root, buffers: &Buffers, index: usize) -> Result<Self> {
        let missing = || Error::new(format!("expected an accessor {index}, found none"));
        let json = root.accessors.get(index).ok_or_else(missing)?;
        let wrong = |line: &str| Error::new(format!("accessor {index}: {line}"));
        let (Checked::Valid(kind), Checked::Valid(of)) = (json.component_type, json.type_) else {
            return Err(wrong("expected a type of glTF, found another"));
        };
        // The columns of these two are padded.
        if matches!((of, kind.0.size()), (Type::Mat2, 1) | (Type::Mat3, 1 | 2)) {
            return Err(wrong("matrices of small numbers are not read"));
        }
        let shape =
            Shape { kind: kind.0, components: of.multiplicity(), normalized: json.normalized };
        let too_many = || wrong("expected at most 4294967295 elements, found more");
        let count = u32::try_from(json.count.0).ok().ok_or_else(too_many)?;
        let dense = match json.buffer_view {
            Some(view) => {
                let (view, all) = (view.value(), buffers.view(root, view.value())?);
                let stride = root.buffer_views.get(view).and_then(|view| view.byte_stride);
                let size = shape.bytes() as u64;
                // Zero stands for no stride in the files of some programs.
                let stride = stride.map(|stride| stride.0 as u64).filter(|&stride| stride > 0);
                let stride = stride.unwrap_or(size);
                if stride < size || stride > MAX_STRIDE.max(size) {
                    return Err(wrong(&format!(
                        "{stride} bytes are no distance of elements of {size}"
                    )));
                }
                let len = elements_bytes(u64::from(count), stride, size);
                let offset = json.byte_offset.map_or(0, |offset| offset.0);
                let span = all.part(offset, len).ok_or_else(|| {
                    wrong(&format!(
                        "expected {len} bytes from byte {offset} of its buffer view, found {} in it",
                        all.len()
                    ))
                })?;
                Some((span, stride))
            }
            None if u64::from(count) > MAX_ZEROS => {
                return Err(wrong(&format!("expected bytes of {count} elements, found none")));
            }
            None => None,
        };
        let sparse = json.sparse.as_ref().map(|json| Sparse::find(root, buffers, json, shape));
        let sparse = sparse.transpose().map_err(|error| wrong(error.message()))?;
        Ok(Self { shape, count, dense, sparse })
    }

    /// One of floats that lie behind one another in a span, which is as long.
    pub(crate) fn of_floats(span: Span, components: usize, count: u32) -> Self {
        let shape = Shape { kind: ComponentType::F32, components, normalized: false };
        let stride = shape.bytes() as u64;
        Self { shape, count, dense: Some((span, stride)), sparse: None }
    }

    /// Whether no byte of the file is behind it.
    pub(crate) fn is_empty_inside(&self) -> bool {
        self.dense.is_none() && self.sparse.is_none()
    }

    /// Ready to be read.
    ///
    /// # Errors
    /// Where sparse elements are damaged, memory runs out, or the system refuses.
    pub(crate) fn reader<'a>(&'a self, buffers: &'a Buffers) -> Result<Reader<'a>> {
        let mut reader =
            Reader { accessor: self, buffers, indices: Vec::new(), values: Vec::new() };
        if let Some(sparse) = &self.sparse {
            reader.indices = sparse.indices(buffers, self.count)?;
            reader.values = buffers.bytes(&sparse.values)?;
        }
        Ok(reader)
    }
}

/// Bytes from the first to the last element.
fn elements_bytes(count: u64, stride: u64, size: u64) -> u64 {
    // At most 2^32 elements of at most 64 bytes, or 252 apart.
    if count == 0 { 0 } else { (count - 1) * stride + size }
}

impl Sparse {
    fn find(root: &Root, buffers: &Buffers, json: &sparse::Sparse, shape: Shape) -> Result<Self> {
        let count = json.count.0;
        let Checked::Valid(index_kind) = json.indices.component_type else {
            return Err(Error::new("expected indices of a type of glTF, found another"));
        };
        let part = |view: usize, offset: u64, size: usize| {
            let all = buffers.view(root, view)?;
            let len = count.checked_mul(size as u64);
            len.and_then(|len| all.part(offset, len)).ok_or_else(|| {
                Error::new(format!(
                    "expected {count} sparse elements of {size} bytes from byte {offset} of a buffer view, found {} bytes in it",
                    all.len()
                ))
            })
        };
        let (indices, values) = (&json.indices, &json.values);
        let index_kind = index_kind.0;
        Ok(Self {
            count,
            indices: part(indices.buffer_view.value(), indices.byte_offset.0, index_kind.size())?,
            index_kind,
            values: part(values.buffer_view.value(), values.byte_offset.0, shape.bytes())?,
        })
    }

    /// Where the elements stand, in rising order.
    fn indices(&self, buffers: &Buffers, count: u32) -> Result<Vec<u32>> {
        let bytes = buffers.bytes(&self.indices)?;
        let indices = whole_numbers(&bytes, self.index_kind)?;
        let rises = indices.is_sorted_by(|a, b| a < b);
        if rises && indices.last().is_none_or(|&last| last < count) {
            return Ok(indices);
        }
        Err(Error::new(format!(
            "expected {} sparse elements in rising order among {count}, found others",
            self.count
        )))
    }
}

/// Bytes as indices.
///
/// # Errors
/// Where they are none, or memory runs out.
pub(crate) fn whole_numbers(bytes: &[u8], kind: ComponentType) -> Result<Vec<u32>> {
    let mut numbers = Vec::new();
    numbers.try_reserve_exact(bytes.len() / kind.size())?;
    match kind {
        ComponentType::U8 => numbers.extend(bytes.iter().map(|&byte| u32::from(byte))),
        ComponentType::U16 => {
            let words = bytes.as_chunks::<2>().0.iter();
            numbers.extend(words.map(|word| u32::from(u16::from_le_bytes(*word))));
        }
        ComponentType::U32 => {
            numbers.extend(bytes.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word)));
        }
        other => {
            return Err(Error::new(format!("expected whole numbers as indices, found {other:?}")));
        }
    }
    Ok(numbers)
}

/// An accessor that is read, piece by piece.
pub(crate) struct Reader<'a> {
    accessor: &'a Accessor,
    buffers: &'a Buffers,
    indices: Vec<u32>,
    values: Vec<u8>,
}

impl Reader<'_> {
    /// What elements are.
    pub(crate) fn shape(&self) -> Shape {
        self.accessor.shape
    }

    /// The bytes of `n` elements from the `first` on, which are there, one after the other.
    ///
    /// # Errors
    /// Where memory runs out, or the system refuses.
    pub(crate) fn elements(&self, first: u32, n: usize) -> Result<Vec<u8>> {
        let size = self.accessor.shape.bytes();
        let mut bytes = Vec::new();
        match &self.accessor.dense {
            None => {
                bytes.try_reserve_exact(n * size)?;
                bytes.resize(n * size, 0);
            }
            Some((span, stride)) => {
                let len = elements_bytes(n as u64, *stride, size as u64);
                let ends = || Error::new("an accessor ends too early");
                let part = span.part(u64::from(first) * stride, len).ok_or_else(ends)?;
                bytes = self.buffers.bytes(&part)?;
                // The stride is at most 252, or the size.
                let stride = *stride as usize;
                if stride != size {
                    for i in 1..n {
                        bytes.copy_within(i * stride..i * stride + size, i * size);
                    }
                    bytes.truncate(n * size);
                }
            }
        }
        let from = self.indices.partition_point(|&index| index < first);
        for (place, &index) in self.indices.iter().enumerate().skip(from) {
            // Not before the first.
            let element = (index - first) as usize;
            if element >= n {
                break;
            }
            bytes[element * size..][..size].copy_from_slice(&self.values[place * size..][..size]);
        }
        Ok(bytes)
    }
}
