//! Lines of a manifest, measured and written at compile time.

use crate::format::file_types::FileTypes;
use crate::need::NeedInfo;

/// Length of the lines that [`Writer::files`] writes.
pub(super) const fn files_len(files: &FileTypes) -> usize {
    let mut len = 0;
    let mut i = 0;
    while i < files.n_endings {
        len += line_len("ending", &[files.endings[i]]);
        i += 1;
    }
    i = 0;
    while i < files.n_magics {
        let (offset, bytes) = files.magics[i];
        let digits = if offset < 10 { 1 } else { 2 };
        len += line_len("magic", &[]) + 1 + digits + 1 + 2 * bytes.len();
        i += 1;
    }
    if files.written {
        len += line_len("written", &[]);
    }
    if files.several {
        len += line_len("several", &[]);
    }
    if files.grid {
        len += line_len("grid", &[]);
    }
    i = 0;
    while i < files.n_beside {
        len += line_len("beside", &[files.beside[i]]);
        i += 1;
    }
    len
}

/// Length of the line that says how a tool is handled.
pub(super) const fn handling_len(word: &str) -> usize {
    if word.is_empty() { 0 } else { line_len("handling", &[word]) }
}

/// Most components that a manifest has digits for.
const MOST_COMPONENTS: u32 = 9999;

/// Length of the lines that [`Writer::needs`] writes.
pub(super) const fn needs_len(needs: &[NeedInfo]) -> usize {
    let mut len = 0;
    let mut i = 0;
    while i < needs.len() {
        if needs[i].required {
            len += line_len("need", &[needs[i].column]) + 5;
        }
        i += 1;
    }
    len
}

/// Length of the line of a key and values.
pub(super) const fn line_len(key: &str, values: &[&str]) -> usize {
    let mut len = key.len() + 1;
    let mut i = 0;
    while i < values.len() {
        len += 1 + values[i].len();
        i += 1;
    }
    len
}

/// Bytes that are written, of a length that is known before.
pub(super) struct Writer<const N: usize> {
    pub(super) bytes: [u8; N],
    len: usize,
}

impl<const N: usize> Writer<N> {
    pub(super) const fn new() -> Self {
        Self { bytes: [0; N], len: 0 }
    }

    pub(super) const fn raw(mut self, bytes: &[u8]) -> Self {
        let mut i = 0;
        while i < bytes.len() {
            self.bytes[self.len] = bytes[i];
            self.len += 1;
            i += 1;
        }
        self
    }

    const fn text(self, text: &str) -> Self {
        let bytes = text.as_bytes();
        let mut i = 0;
        while i < bytes.len() {
            assert!(bytes[i] >= 32, "texts of a plugin's manifest have no control characters");
            i += 1;
        }
        self.raw(bytes)
    }

    pub(super) const fn line(mut self, key: &str, values: &[&str]) -> Self {
        self = self.text(key);
        let mut i = 0;
        while i < values.len() {
            self = self.raw(b"\t").text(values[i]);
            i += 1;
        }
        self.raw(b"\n")
    }

    /// The columns that a renderer cannot do without, in lines after its own: name, and components in four digits.
    pub(super) const fn needs(mut self, needs: &[NeedInfo]) -> Self {
        let mut i = 0;
        while i < needs.len() {
            if needs[i].required {
                let n = needs[i].components;
                assert!(n <= MOST_COMPONENTS, "a column has at most 9999 components");
                let digits = [n / 1000, n / 100 % 10, n / 10 % 10, n % 10];
                self = self.raw(b"need\t").text(needs[i].column).raw(b"\t");
                let mut place = 0;
                while place < digits.len() {
                    self = self.raw(&[b'0' + digits[place] as u8]);
                    place += 1;
                }
                self = self.raw(b"\n");
            }
            i += 1;
        }
        self
    }

    /// The files of a format, in lines after its own.
    pub(super) const fn files(mut self, files: &FileTypes) -> Self {
        const HEX: [u8; 16] = *b"0123456789abcdef";
        let mut i = 0;
        while i < files.n_endings {
            self = self.line("ending", &[files.endings[i]]);
            i += 1;
        }
        i = 0;
        while i < files.n_magics {
            let (offset, bytes) = files.magics[i];
            self = self.raw(b"magic\t");
            if offset >= 10 {
                self = self.raw(&[b'0' + (offset / 10) as u8]);
            }
            self = self.raw(&[b'0' + (offset % 10) as u8, b'\t']);
            let mut j = 0;
            while j < bytes.len() {
                let byte = bytes[j] as usize;
                self = self.raw(&[HEX[byte / 16], HEX[byte % 16]]);
                j += 1;
            }
            self = self.raw(b"\n");
            i += 1;
        }
        if files.written {
            self = self.line("written", &[]);
        }
        if files.several {
            self = self.line("several", &[]);
        }
        if files.grid {
            self = self.line("grid", &[]);
        }
        i = 0;
        while i < files.n_beside {
            self = self.line("beside", &[files.beside[i]]);
            i += 1;
        }
        self
    }
}
