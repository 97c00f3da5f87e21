//! The C structures of the boundary as `wasm32` lays them out: pointers and sizes have four bytes.

/// Bytes of `Bytes` and of `Sink`.
pub(crate) const PAIR_LEN: usize = 8;
/// Bytes of `PluginTable`.
pub(crate) const TABLE_LEN: usize = 40;
/// Bytes of `FormatTable`.
pub(crate) const FORMATS_LEN: usize = 24;
/// Bytes of `RawColumn`.
pub(crate) const COLUMN_LEN: usize = 32;
/// Bytes of `RawCloud`.
pub(crate) const CLOUD_LEN: usize = 112;

/// A structure that is written member by member.
#[derive(Debug, Default)]
pub(crate) struct Written(Vec<u8>);

impl Written {
    pub(crate) fn u32(mut self, value: u32) -> Self {
        self.0.extend(value.to_le_bytes());
        self
    }

    pub(crate) fn u32s(self, values: impl IntoIterator<Item = u32>) -> Self {
        values.into_iter().fold(self, Self::u32)
    }

    pub(crate) fn u64(mut self, value: u64) -> Self {
        self.0.extend(value.to_le_bytes());
        self
    }

    pub(crate) fn f64s(self, values: impl IntoIterator<Item = f64>) -> Self {
        values.into_iter().fold(self, |written, value| written.u64(value.to_bits()))
    }

    pub(crate) fn bytes(self) -> Vec<u8> {
        self.0
    }
}

/// The whole number at an offset of a structure that was read whole; 0 beyond its end.
pub(crate) fn u32_at(bytes: &[u8], offset: usize) -> u32 {
    let word = bytes.get(offset..).and_then(<[u8]>::first_chunk);
    word.map_or(0, |word| u32::from_le_bytes(*word))
}

/// The same of two bytes.
pub(crate) fn u16_at(bytes: &[u8], offset: usize) -> u16 {
    (u32_at(bytes, offset) & 0xffff) as u16
}
