//! A graph in a file: what a renderer described for one frame, to be drawn without it.
//!
//! 16 bytes magic, ABI major and minor (u16), length of the structure and of the data (u64 each), all
//! little endian; then the structure, msgpack with named fields, and the data.

use crate::manifest::{ABI_MAJOR, ABI_MINOR, Refusal};

/// First bytes of such a file.
const MAGIC: [u8; 16] = *b"SURFELSHOP-GRAPH";
/// Bytes before the structure.
const HEADER_LEN: usize = 36;

/// A frame as a renderer wrote it: decoding is left to the host, which compares first.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EncodedGraph {
    /// Msgpack of [`Structure`](crate::graph::Structure).
    pub structure: Vec<u8>,
    /// Bytes of uniforms and uploads.
    pub data: Vec<u8>,
}

impl EncodedGraph {
    /// The graph as a file holds it.
    #[must_use]
    pub fn to_file(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(HEADER_LEN + self.structure.len() + self.data.len());
        bytes.extend(MAGIC);
        bytes.extend(ABI_MAJOR.to_le_bytes());
        bytes.extend(ABI_MINOR.to_le_bytes());
        bytes.extend((self.structure.len() as u64).to_le_bytes());
        bytes.extend((self.data.len() as u64).to_le_bytes());
        bytes.extend(&self.structure);
        bytes.extend(&self.data);
        bytes
    }

    /// A graph out of a file's bytes; nothing is decoded yet.
    ///
    /// # Errors
    /// Where the bytes are no such file, not a whole one, or of an ABI that this host does not speak: the
    /// major version must be equal, the minor version not newer.
    pub fn from_file(bytes: &[u8]) -> Result<Self, Refusal> {
        let malformed = |what: String| Err(Refusal::Malformed(what));
        let header = bytes.get(..HEADER_LEN).filter(|header| header.starts_with(&MAGIC));
        let Some(header) = header else {
            return malformed("it does not begin as a captured graph does".to_owned());
        };
        let version = |at: usize| u16::from_le_bytes([header[at], header[at + 1]]);
        let plugin = (version(16), version(18));
        if plugin.0 != ABI_MAJOR || plugin.1 > ABI_MINOR {
            return Err(Refusal::Incompatible { plugin, host: (ABI_MAJOR, ABI_MINOR) });
        }
        let length = |at: usize| {
            let bytes = std::array::from_fn(|i| header[at + i]);
            usize::try_from(u64::from_le_bytes(bytes)).unwrap_or(usize::MAX)
        };
        let (structure, data) = (length(20), length(28));
        let rest = &bytes[HEADER_LEN..];
        if structure.checked_add(data) != Some(rest.len()) {
            return malformed(format!(
                "expected {structure} bytes of structure and {data} of data, found {} in all",
                rest.len()
            ));
        }
        let (structure, data) = rest.split_at(structure);
        Ok(Self { structure: structure.to_owned(), data: data.to_owned() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn captured_graphs_are_read_back_and_every_cut_or_newer_one_is_refused() {
        let graph = EncodedGraph { structure: vec![0x80], data: vec![1, 2, 3] };
        let bytes = graph.to_file();
        assert_eq!(EncodedGraph::from_file(&bytes), Ok(graph));
        for len in 0..bytes.len() {
            let cut = EncodedGraph::from_file(&bytes[..len]);
            assert!(matches!(cut, Err(Refusal::Malformed(_))), "{len}");
        }
        let mut newer = bytes.clone();
        newer[18] += 1;
        let newer = EncodedGraph::from_file(&newer).unwrap_err().to_string();
        assert!(newer.contains("update Surfelshop"), "{newer}");
        let mut huge = bytes;
        huge[20..36].fill(0xff);
        assert!(matches!(EncodedGraph::from_file(&huge), Err(Refusal::Malformed(_))));
    }
}
