//! Directories as they are written: entries, then the values that do not fit into them, each at a multiple of four.

use super::{kind, tags};

/// Bytes of an entry.
pub(crate) const ENTRY_BYTES: u32 = 12;
/// Bytes of the file's header, behind which the root directory lies.
pub(crate) const HEADER_BYTES: u32 = 20;

/// The file's header.
pub(crate) fn header() -> Vec<u8> {
    let mut bytes = Vec::new();
    bytes.extend(b"GFLF");
    bytes.extend(0_u32.to_be_bytes());
    bytes.extend(b"SFLF");
    bytes.extend(0_u32.to_be_bytes());
    bytes.extend(HEADER_BYTES.to_be_bytes());
    bytes
}

fn entry(tag: u16, kind: u16, count: u32, value: [u8; 4]) -> [u8; 12] {
    let mut bytes = [0; 12];
    bytes[..2].copy_from_slice(&tag.to_be_bytes());
    bytes[2..4].copy_from_slice(&kind.to_be_bytes());
    bytes[4..8].copy_from_slice(&count.to_be_bytes());
    bytes[8..].copy_from_slice(&value);
    bytes
}

/// The directory that closes a list of siblings; `parents_next` is where the parent's next sibling lies, 0 at
/// the root.
pub(crate) fn closing(parents_next: u32) -> [u8; 12] {
    entry(tags::UPLINK, kind::OFFSET, 1, parents_next.to_be_bytes())
}

/// How a directory that is written is linked to others.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Link {
    /// It has no children.
    Leaf {
        /// Where the next sibling lies.
        next: u32,
    },
    /// Its first child lies right behind it.
    Parent {
        /// Where the next sibling lies.
        next: u32,
        /// How many children it has.
        n_children: u32,
    },
}

/// A directory with its values. Its length depends on how many values of which types it has, not on what they are.
#[derive(Clone, Debug, Default)]
pub(crate) struct Block {
    entries: Vec<(u16, u16, u32, Vec<u8>)>,
    /// A block of data that lies behind the directory: tag and bytes.
    data: Option<(u16, u32)>,
}

impl Block {
    fn with(mut self, tag: u16, kind: u16, count: usize, bytes: Vec<u8>) -> Self {
        // Values are few by construction: names are cut, and the rest has fixed lengths.
        self.entries.push((tag, kind, u32::try_from(count).unwrap_or(u32::MAX), bytes));
        self
    }

    /// Adds 32-bit numbers.
    pub(crate) fn words(self, tag: u16, values: &[u32]) -> Self {
        let bytes = values.iter().flat_map(|value| value.to_be_bytes()).collect();
        self.with(tag, kind::U32, values.len(), bytes)
    }

    /// Adds 16-bit numbers.
    pub(crate) fn shorts(self, tag: u16, values: &[u16]) -> Self {
        let bytes = values.iter().flat_map(|value| value.to_be_bytes()).collect();
        self.with(tag, kind::U16, values.len(), bytes)
    }

    /// Adds 32-bit floats.
    pub(crate) fn floats(self, tag: u16, values: &[f32]) -> Self {
        let bytes = values.iter().flat_map(|value| value.to_be_bytes()).collect();
        self.with(tag, kind::F32, values.len(), bytes)
    }

    /// Adds 64-bit floats.
    pub(crate) fn doubles(self, tag: u16, values: &[f64]) -> Self {
        let bytes = values.iter().flat_map(|value| value.to_be_bytes()).collect();
        self.with(tag, kind::F64, values.len(), bytes)
    }

    /// Adds text; nothing where it is empty.
    pub(crate) fn text(self, tag: u16, text: &str) -> Self {
        if text.is_empty() {
            return self;
        }
        let bytes: Vec<u8> = text.bytes().chain([0]).collect();
        self.with(tag, kind::ASCII, bytes.len(), bytes)
    }

    /// Adds a block of data of so many bytes, right behind the directory.
    pub(crate) fn data(mut self, tag: u16, bytes: u32) -> Self {
        self.data = Some((tag, bytes));
        self
    }

    /// The bytes of the directory and its values at a place of the file, a multiple of four.
    pub(crate) fn bytes(&self, place: u32, link: Link) -> Vec<u8> {
        let extra = match link {
            Link::Leaf { .. } => 1,
            Link::Parent { .. } => 2,
        };
        let n_entries = self.entries.len() + usize::from(self.data.is_some()) + extra;
        let mut directory = Vec::new();
        let mut values: Vec<u8> = Vec::new();
        // All of it is a few hundred bytes, and names are cut: the sums are far from the ends of the types.
        let start = place + n_entries as u32 * ENTRY_BYTES;
        for (tag, kind, count, bytes) in &self.entries {
            let mut value = [0; 4];
            if bytes.len() <= 4 {
                value[..bytes.len()].copy_from_slice(bytes);
            } else {
                value = (start + values.len() as u32).to_be_bytes();
                values.extend(bytes);
                values.resize(values.len().next_multiple_of(4), 0);
            }
            directory.extend(entry(*tag, *kind, *count, value));
        }
        let end = start + values.len() as u32;
        if let Some((tag, bytes)) = self.data {
            directory.extend(entry(tag, kind::DATA, bytes, end.to_be_bytes()));
        }
        match link {
            Link::Leaf { next } => {
                directory.extend(entry(tags::LINK, kind::OFFSET, 1, next.to_be_bytes()));
            }
            Link::Parent { next, n_children } => {
                let counted = (n_children + 1).to_be_bytes();
                directory.extend(entry(tags::N_CHILDREN, kind::U32, 1, counted));
                directory.extend(entry(tags::DOWNLINK, kind::OFFSETS, next, end.to_be_bytes()));
            }
        }
        directory.extend(values);
        directory
    }
}
