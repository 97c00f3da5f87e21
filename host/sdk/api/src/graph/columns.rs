//! Columns of clouds as buffers of a graph.

use crate::graph::resources::BufferId;
use serde::{Deserialize, Serialize};
use std::hash::{Hash, Hasher};

/// How the values of a column are stored in a buffer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Stored {
    /// 32-bit floats.
    #[default]
    F32,
    /// 16-bit floats, two in a word: eleven significant bits, at most 65,504.
    F16,
    /// 8-bit numbers from 0 to 1, four in a word.
    Unorm8,
}

impl Stored {
    /// Values in a word of 32 bits.
    const fn per_word(self) -> u32 {
        match self {
            Self::F32 => 1,
            Self::F16 => 2,
            Self::Unorm8 => 4,
        }
    }
}

/// A column of a buffer.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct BufferColumn {
    /// The name. `position` is from the scene's origin, in world axes, three values.
    pub name: String,
    /// Values of a surfel: those that the cloud has more are left out.
    pub components: u32,
    /// How they are stored.
    #[serde(default)]
    pub stored: Stored,
    /// The value where the cloud has no such column, or fewer components. Colours of 8 and 16 bits are given from 0 to
    /// 1, other whole numbers as they are.
    #[serde(default)]
    pub otherwise: f32,
}

impl PartialEq for BufferColumn {
    /// Equal bit by bit: what is equal is filled alike.
    fn eq(&self, other: &Self) -> bool {
        (&self.name, self.components, self.stored, self.otherwise.to_bits())
            == (&other.name, other.components, other.stored, other.otherwise.to_bits())
    }
}

impl Eq for BufferColumn {}

impl Hash for BufferColumn {
    fn hash<H: Hasher>(&self, state: &mut H) {
        (&self.name, self.components, self.stored, self.otherwise.to_bits()).hash(state);
    }
}

impl BufferColumn {
    /// A column of so many values, as 32-bit floats.
    #[must_use]
    pub fn new(name: &str, components: u32) -> Self {
        Self { name: name.to_owned(), components, stored: Stored::F32, otherwise: 0.0 }
    }

    /// As 16-bit floats.
    #[must_use]
    pub fn f16(mut self) -> Self {
        self.stored = Stored::F16;
        self
    }

    /// As 8-bit numbers from 0 to 1.
    #[must_use]
    pub fn unorm8(mut self) -> Self {
        self.stored = Stored::Unorm8;
        self
    }

    /// The value where a cloud has none; else 0.
    #[must_use]
    pub fn or(mut self, value: f32) -> Self {
        self.otherwise = value;
        self
    }

    /// Words of a surfel.
    #[must_use]
    pub fn words(&self) -> u32 {
        self.components.div_ceil(self.stored.per_word())
    }
}

/// What a buffer is filled with. ABI 3.9.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct ColumnsOf {
    /// The clouds whose surfels it holds, by their number in [`CloudFacts::clouds`](crate::CloudFacts::clouds),
    /// ascending.
    pub objects: Vec<u32>,
    /// The columns of a surfel, one behind the other.
    pub columns: Vec<BufferColumn>,
}

/// Words before the first surfel: the number of that surfel, which is not 0 in parts of a buffer, and three zeros.
pub const COLUMNS_HEADER_WORDS: u32 = 4;

impl ColumnsOf {
    /// Words of a surfel, all columns together.
    #[must_use]
    pub fn stride_words(&self) -> u32 {
        self.columns.iter().map(BufferColumn::words).fold(0, u32::saturating_add)
    }

    /// Bytes of a buffer of so many surfels; as large as can be where it would be larger than all memory.
    #[must_use]
    pub fn bytes(&self, n_surfels: u64) -> u64 {
        let surfels = n_surfels.saturating_mul(4 * u64::from(self.stride_words()));
        surfels.saturating_add(4 * u64::from(COLUMNS_HEADER_WORDS))
    }

    /// The WGSL module of a path that reads the buffer: a function of each column's name from the number of a surfel to
    /// its value, `f32` or a vector of two to four. Longer ones are read word by word, since drivers are slow with
    /// arrays: `fn NAME(i: u32, k: u32)` gives the `k`-th word, an `f32`, two or four of what is stored shorter.
    fn module(&self, path: &str) -> String {
        let mut text = format!(
            "#define_import_path {path}\n\
             var<storage, read> {WORDS}: array<u32>;\n\
             fn at(i: u32) -> u32 {{ return {COLUMNS_HEADER_WORDS}u + (i - {WORDS}[0]) * {}u; }}\n",
            self.stride_words()
        );
        let mut first = 0;
        for column in &self.columns {
            if column.components > MOST_IN_A_VECTOR {
                let word = format!("{WORDS}[at(i) + {first}u + k]");
                let (shape, value) = match column.stored {
                    Stored::F32 => ("f32", format!("bitcast<f32>({word})")),
                    Stored::F16 => ("vec2<f32>", format!("unpack2x16float({word})")),
                    Stored::Unorm8 => ("vec4<f32>", format!("unpack4x8unorm({word})")),
                };
                let name = &column.name;
                let function =
                    format!("fn {name}(i: u32, k: u32) -> {shape} {{ return {value}; }}");
                text = format!("{text}{function}\n");
                first += column.words();
                continue;
            }
            let value = |i: u32| match column.stored {
                Stored::F32 => format!("bitcast<f32>({WORDS}[first + {i}u])"),
                Stored::F16 => {
                    format!("unpack2x16float({WORDS}[first + {}u])[{}]", i / 2, i % 2)
                }
                Stored::Unorm8 => {
                    format!("unpack4x8unorm({WORDS}[first + {}u])[{}]", i / 4, i % 4)
                }
            };
            let values: Vec<String> = (0..column.components).map(value).collect();
            let shape = match column.components {
                1 => "f32".to_owned(),
                n => format!("vec{n}<f32>"),
            };
            let name = &column.name;
            let values = values.join(", ");
            text = format!(
                "{text}fn {name}(i: u32) -> {shape} {{ let first = at(i) + {first}u; return {shape}({values}); }}\n"
            );
            first += column.words();
        }
        text
    }
}

/// Components that a vector of WGSL holds.
const MOST_IN_A_VECTOR: u32 = 4;

/// The variable of a module of columns.
const WORDS: &str = "words";

/// A buffer of columns, and the WGSL module that reads it: see [`Graph::columns`](crate::Graph::columns). ABI 3.9.
#[derive(Clone, Debug, PartialEq)]
pub struct Columns {
    id: BufferId,
    path: String,
    wgsl: String,
}

impl Columns {
    pub(super) fn new(id: BufferId, path: &str, of: &ColumnsOf) -> Self {
        Self { id, path: path.to_owned(), wgsl: of.module(path) }
    }

    /// The buffer, for passes that declare a variable of their own.
    #[must_use]
    pub fn buffer(&self) -> BufferId {
        self.id
    }

    /// The path that its module is imported by.
    #[must_use]
    pub fn path(&self) -> &str {
        &self.path
    }

    /// The text of the module.
    #[must_use]
    pub fn wgsl(&self) -> &str {
        &self.wgsl
    }

    /// The variable that the buffer is bound to.
    pub(super) fn variable(&self) -> String {
        format!("{}::{WORDS}", self.path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_lie_behind_one_another_in_whole_words() {
        let columns = vec![
            BufferColumn::new("position", 3),
            BufferColumn::new("sh_1", 9).f16(),
            BufferColumn::new("opacity", 1).unorm8().or(1.0),
        ];
        let of = ColumnsOf { objects: vec![0], columns };
        assert_eq!((of.stride_words(), of.bytes(10)), (3 + 5 + 1, 16 + 10 * 36));
        let text = of.module("splats");
        assert!(text.contains("(i - words[0]) * 9u"), "{text}");
        let word = "fn sh_1(i: u32, k: u32) -> vec2<f32> { return unpack2x16float(words[at(i) + 3u + k]); }";
        assert!(text.contains(word), "{text}");
        assert!(text.contains("fn opacity(i: u32) -> f32 { let first = at(i) + 8u"), "{text}");
        assert_eq!(of.bytes(u64::MAX), u64::MAX);
    }
}
