//! What separates the words of a line.

use crate::text::is_blank;

/// What separates the words of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Delimiter {
    Comma,
    Semicolon,
    Tab,
    /// Any number of blanks.
    Space,
}

impl Delimiter {
    pub(crate) const ALL: [Self; 4] = [Self::Comma, Self::Semicolon, Self::Tab, Self::Space];

    pub(crate) const fn byte(self) -> u8 {
        match self {
            Self::Comma => b',',
            Self::Semicolon => b';',
            Self::Tab => b'\t',
            Self::Space => b' ',
        }
    }

    pub(crate) const fn words(self) -> &'static str {
        match self {
            Self::Comma => "commas",
            Self::Semicolon => "semicolons",
            Self::Tab => "tabs",
            Self::Space => "spaces",
        }
    }

    /// Whether a byte is passed over before and behind a word.
    pub(crate) const fn passes_over(self, byte: u8) -> bool {
        is_blank(byte) && !(matches!(self, Self::Tab) && byte == b'\t')
    }

    /// The words of a line, without blanks and quotation marks around them.
    pub(crate) fn split(self, line: &[u8]) -> Vec<&[u8]> {
        let mut words = Vec::new();
        let mut rest = line.trim_ascii();
        if rest.is_empty() {
            return words;
        }
        loop {
            let (word, behind) = self.first_word(rest);
            words.push(word);
            match behind {
                Some(behind) => rest = behind,
                None => return words,
            }
        }
    }

    /// The first word, and what comes behind the delimiter where there is one.
    fn first_word(self, text: &[u8]) -> (&[u8], Option<&[u8]>) {
        let start = text.iter().position(|&byte| !self.passes_over(byte)).unwrap_or(text.len());
        let text = &text[start..];
        // A quoted word may hold delimiters.
        if let Some(inside) = text.strip_prefix(b"\"")
            && let Some(end) = inside.iter().position(|&byte| byte == b'"')
            && let (0, behind) = self.end(&inside[end + 1..])
        {
            return (inside[..end].trim_ascii(), behind);
        }
        let (end, behind) = self.end(text);
        (text[..end].trim_ascii(), behind)
    }

    /// Where the next delimiter is, blanks before it left out, and what comes behind it.
    fn end(self, text: &[u8]) -> (usize, Option<&[u8]>) {
        if self == Self::Space {
            let Some(end) = text.iter().position(|&byte| is_blank(byte)) else {
                return (text.len(), None);
            };
            let behind = text[end..].trim_ascii_start();
            return (end, (!behind.is_empty()).then_some(behind));
        }
        let Some(end) = text.iter().position(|&byte| byte == self.byte()) else {
            return (text.trim_ascii_end().len(), None);
        };
        (text[..end].trim_ascii_end().len(), Some(&text[end + 1..]))
    }
}
