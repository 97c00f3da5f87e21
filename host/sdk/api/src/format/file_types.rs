//! What files a format recognises, in a plugin's manifest, so that no code runs to find out.

use serde::{Deserialize, Serialize};

/// Bytes of a file's beginning that a host looks at to recognise it.
pub const HEAD_LEN: usize = 64;

/// Most endings, and most first bytes, of a format.
const MOST: usize = 8;

/// Letters of the longest ending that hosts know.
pub const MAX_ENDING_LEN: usize = 16;

/// What tells the files of a format: their endings, and bytes at a place near their beginning.
///
/// The host opens a file with the format whose bytes are there; where none are known, with the one
/// of its ending. A format whose bytes say nothing (text) names endings alone.
///
/// ```
/// use surfelshop_api::format::FileTypes;
/// const LAS: FileTypes = FileTypes::new().ending("las").ending("laz").magic(0, b"LASF").written();
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FileTypes {
    pub(crate) endings: [&'static str; MOST],
    pub(crate) n_endings: usize,
    pub(crate) magics: [(u32, &'static [u8]); MOST],
    pub(crate) n_magics: usize,
    pub(crate) written: bool,
    pub(crate) several: bool,
    pub(crate) grid: bool,
    pub(crate) beside: [&'static str; MOST],
    pub(crate) n_beside: usize,
}

impl FileTypes {
    /// A format that recognises nothing yet.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            endings: [""; MOST],
            n_endings: 0,
            magics: [(0, b""); MOST],
            n_magics: 0,
            written: false,
            several: false,
            grid: false,
            beside: [""; MOST],
            n_beside: 0,
        }
    }

    /// Adds an ending, in lower case and without the dot, such as `laz`. The first one names the files that
    /// dialogs offer to write. One with a dot in it, such as `metadata.json`, is also the whole name of a file.
    ///
    /// # Panics
    /// At compile time, where there are more than eight, or it is not made of 1 to 16 of `a-z`, `0-9`, `-`, `_`
    /// and `.`.
    #[must_use]
    pub const fn ending(mut self, ending: &'static str) -> Self {
        assert!(self.n_endings < MOST, "a format has at most eight endings");
        let bytes = ending.as_bytes();
        assert!(
            !bytes.is_empty() && bytes.len() <= MAX_ENDING_LEN,
            "an ending has 1 to 16 letters"
        );
        let mut i = 0;
        while i < bytes.len() {
            assert!(
                matches!(bytes[i], b'a'..=b'z' | b'0'..=b'9' | b'-' | b'_' | b'.'),
                "an ending has only a-z, 0-9, -, _ and ."
            );
            i += 1;
        }
        self.endings[self.n_endings] = ending;
        self.n_endings += 1;
        self
    }

    /// Adds bytes that files have at an offset; any of several tells the format.
    ///
    /// # Panics
    /// At compile time, where there are more than eight, or they do not lie in the first
    /// [`HEAD_LEN`] bytes.
    #[must_use]
    pub const fn magic(mut self, offset: u32, bytes: &'static [u8]) -> Self {
        assert!(self.n_magics < MOST, "a format has at most eight kinds of first bytes");
        assert!(
            !bytes.is_empty() && offset as usize + bytes.len() <= HEAD_LEN,
            "first bytes lie within the first 64 bytes"
        );
        self.magics[self.n_magics] = (offset, bytes);
        self.n_magics += 1;
        self
    }

    /// Says that the format is written, too: it implements [`Format::write`](super::Format::write).
    #[must_use]
    pub const fn written(mut self) -> Self {
        self.written = true;
        self
    }

    /// Says that files hold several clouds, each with a pose, when they are written: the host hands over each
    /// scan by itself, in its own axes. Else all is handed over as one cloud in common coordinates.
    #[must_use]
    pub const fn several(mut self) -> Self {
        self.several = true;
        self
    }

    /// Says that files hold the grids of organised clouds when they are written: the host hands over every place of a
    /// [grid](super::CloudHeader::grid), and those that hold no point as points at NaN. Else it leaves these out. Hosts
    /// that do not know this do, too.
    #[must_use]
    pub const fn grid(mut self) -> Self {
        self.grid = true;
        self
    }

    /// Adds files of the same folder that the format reads, too: a name such as `octree.bin`, or `*` with what names
    /// end with, such as `*.bin`. The format is lent these and no others, by
    /// [`FileSource::beside`](super::FileSource::beside). Came while ABI 3.11 was current; older hosts lend none.
    ///
    /// # Panics
    /// At compile time, where there are more than eight, or it is not made of 1 to 64 of `a-z`, `0-9`, `-`, `_` and
    /// `.`, after a `*` before the `.` of an ending.
    #[must_use]
    pub const fn beside(mut self, name: &'static str) -> Self {
        assert!(self.n_beside < MOST, "a format names at most eight kinds of files beside its own");
        let bytes = name.as_bytes();
        assert!(!bytes.is_empty() && bytes.len() <= 64, "a name has 1 to 64 letters");
        let mut i = 0;
        if bytes[0] == b'*' {
            assert!(
                bytes.len() > 2 && bytes[1] == b'.',
                "a `*` stands before the `.` of an ending"
            );
            i = 1;
        }
        while i < bytes.len() {
            assert!(
                matches!(bytes[i], b'a'..=b'z' | b'0'..=b'9' | b'-' | b'_' | b'.'),
                "a name has only a-z, 0-9, -, _ and ."
            );
            i += 1;
        }
        self.beside[self.n_beside] = name;
        self.n_beside += 1;
        self
    }
}

impl Default for FileTypes {
    fn default() -> Self {
        Self::new()
    }
}

/// Bytes at a place near the beginning of a file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Magic {
    /// Where they are, bytes from the beginning.
    pub offset: u32,
    /// The bytes.
    pub bytes: Vec<u8>,
}

/// [`FileTypes`] as a manifest has them.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Recognition {
    /// Endings, lower case, without the dot.
    pub endings: Vec<String>,
    /// First bytes, any of which tells the format.
    pub magics: Vec<Magic>,
    /// Whether such files are written, too.
    pub written: bool,
    /// Whether they hold several clouds with poses when they are written.
    pub several: bool,
    /// Whether they hold grids with empty places when they are written.
    #[serde(default)]
    pub grid: bool,
    /// Names of files of the same folder that the format reads, too, or `*` with what they end with.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub beside: Vec<String>,
}

impl Recognition {
    /// Whether a file that begins like this has the bytes of the format.
    #[must_use]
    pub fn knows_bytes(&self, head: &[u8]) -> bool {
        self.magics.iter().any(|magic| {
            let rest = head.get(magic.offset as usize..).unwrap_or_default();
            !magic.bytes.is_empty() && rest.starts_with(&magic.bytes)
        })
    }

    /// Whether a file's name has an ending of the format; case does not matter.
    #[must_use]
    pub fn knows_name(&self, name: &str) -> bool {
        self.endings.iter().any(|ending| {
            if ending.contains('.') && name.eq_ignore_ascii_case(ending) {
                return true;
            }
            let start = name.len().checked_sub(ending.len() + 1);
            let end = start.and_then(|start| name.get(start..));
            end.and_then(|end| end.strip_prefix('.'))
                .is_some_and(|end| end.eq_ignore_ascii_case(ending))
        })
    }

    /// Whether the format reads a file of this name, without its folder, beside its own; case does not matter.
    #[must_use]
    pub fn reads_beside(&self, name: &str) -> bool {
        self.beside.iter().any(|beside| match beside.strip_prefix('*') {
            Some(end) => {
                let start = name.len().checked_sub(end.len());
                start
                    .and_then(|start| name.get(start..))
                    .is_some_and(|it| it.eq_ignore_ascii_case(end))
            }
            None => name.eq_ignore_ascii_case(beside),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_told_by_their_bytes_and_by_their_names() {
        let las = Recognition {
            endings: vec!["las".to_owned(), "copc.laz".to_owned()],
            magics: vec![Magic { offset: 2, bytes: b"SF".to_vec() }],
            ..Recognition::default()
        };
        assert!(las.knows_bytes(b"LASF\x01") && !las.knows_bytes(b"LAS") && !las.knows_bytes(b""));
        assert!(las.knows_name("A.LAS") && las.knows_name("b.copc.laz"));
        assert!(!las.knows_name("las") && !las.knows_name("b.laz") && !las.knows_name("ä.la"));
        assert!(las.knows_name("copc.laz") && !las.knows_name("opc.laz"));
    }

    #[test]
    fn files_beside_one_are_told_by_their_names() {
        let beside = vec!["octree.bin".to_owned(), "*.glbin".to_owned()];
        let format = Recognition { beside, ..Recognition::default() };
        assert!(format.reads_beside("octree.bin") && format.reads_beside("A.GLBIN"));
        let others = ["", "a.octree.bin", "glbin", "ä.bin", "a.glbin.txt", "../octree.bin"];
        assert!(!others.iter().any(|name| format.reads_beside(name)));
    }
}
