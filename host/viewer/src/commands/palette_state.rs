//! What the palette remembers.

/// The state of the palette.
#[derive(Default)]
pub(crate) struct Palette {
    pub(super) open: bool,
    pub(super) typed: String,
    /// The row that Enter runs.
    pub(super) row: usize,
}

impl Palette {
    /// Opens it, empty.
    pub(crate) fn open(&mut self) {
        self.open_with("");
    }

    /// Opens it with words.
    pub(crate) fn open_with(&mut self, words: &str) {
        *self = Self { open: true, typed: words.to_owned(), row: 0 };
    }

    pub(crate) fn is_open(&self) -> bool {
        self.open
    }
}
