//! Where the fields of a point record lie, by the number of its format.

/// A format of point records. What is not named here lies at the same place in all of them, or in all of
/// 0 to 5 and all of 6 to 10.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct PointFormat {
    /// The number, 0 to 10.
    pub(crate) id: u8,
    /// Bytes of a record without extra bytes.
    pub(crate) len: usize,
    /// Where the time of the pulse is.
    pub(crate) gps_time: Option<usize>,
    /// Where red, green and blue are.
    pub(crate) color: Option<usize>,
    /// Where near infrared is.
    pub(crate) nir: Option<usize>,
    /// Where the 29 bytes of the waveform are.
    pub(crate) waveform: Option<usize>,
}

impl PointFormat {
    /// The format of a number; `None` above 10.
    pub(crate) const fn of(id: u8) -> Option<Self> {
        let (len, gps_time, color, nir, waveform) = match id {
            0 => (20, None, None, None, None),
            1 => (28, Some(20), None, None, None),
            2 => (26, None, Some(20), None, None),
            3 => (34, Some(20), Some(28), None, None),
            4 => (57, Some(20), None, None, Some(28)),
            5 => (63, Some(20), Some(28), None, Some(34)),
            6 => (30, Some(22), None, None, None),
            7 => (36, Some(22), Some(30), None, None),
            8 => (38, Some(22), Some(30), Some(36), None),
            9 => (59, Some(22), None, None, Some(30)),
            10 => (67, Some(22), Some(30), Some(36), Some(38)),
            _ => return None,
        };
        Some(Self { id, len, gps_time, color, nir, waveform })
    }

    /// Whether the record is one of LAS 1.4: up to 15 returns, 256 classes, fine scan angles.
    pub(crate) const fn is_extended(self) -> bool {
        self.id >= 6
    }
}
