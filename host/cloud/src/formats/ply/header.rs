//! The header, read leniently where that is safe: any line ends, a byte order mark, blank lines,
//! old and new type names, comments in any encoding.
//!
//! `ply-rs-bw` reads headers too, but merges properties of one name, which silently changes the
//! size of a record, refuses names and comments that other programs write, and reports errors
//! on several lines.

use crate::error::{ReadFault, quoted};
use std::io::{BufRead, Read};
use surfelshop_api::columns::Element;

/// What some editors put before the first byte of a text file.
pub(super) const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// Longest header read; real ones have a few kilobytes, and a file without `end_header` must not be
/// taken into memory whole.
pub(super) const MAX_HEADER: u64 = 16 << 20;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    Binary { big: bool },
}

impl Encoding {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Ascii => "ascii",
            Self::Binary { big: false } => "binary little endian",
            Self::Binary { big: true } => "binary big endian",
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Scalar(Element),
    List { length: Element, item: Element },
}

#[derive(Clone, Debug)]
pub(super) struct Property {
    pub(super) name: String,
    pub(super) kind: Kind,
    /// Line of the header, counted from 1.
    pub(super) line: usize,
}

#[derive(Clone, Debug)]
pub(super) struct ElementDef {
    pub(super) name: String,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
}

#[derive(Clone, Debug)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<ElementDef>,
    pub(super) comments: Vec<String>,
    /// Lines of the header.
    pub(super) n_lines: usize,
    /// Bytes of the header, the end of its last line included.
    pub(super) length: u64,
}

/// Lines of a header.
struct Lines<R> {
    reader: R,
    /// The byte that ends lines: a carriage return in files of old Macintoshes only.
    end: u8,
    line: usize,
    length: u64,
    text: Vec<u8>,
}

impl<R: BufRead> Lines<R> {
    /// Reads the next line into `text`, without its end.
    fn next(&mut self) -> Result<(), ReadFault> {
        self.text.clear();
        self.line += 1;
        let allowed = MAX_HEADER.saturating_sub(self.length);
        let n_read = self.reader.by_ref().take(allowed).read_until(self.end, &mut self.text)?;
        self.length += n_read as u64;
        if n_read == 0 || self.text.last() != Some(&self.end) && self.length >= MAX_HEADER {
            let found =
                if self.length >= MAX_HEADER { "16 MiB without it" } else { "the file's end" };
            return Err(self.fault("`end_header`", found.to_owned()));
        }
        let trimmed = self.text.trim_ascii_end().len();
        self.text.truncate(trimmed);
        Ok(())
    }

    fn fault(&self, expected: &str, found: String) -> ReadFault {
        ReadFault::Header { line: self.line, expected: expected.to_owned(), found }
    }
}

/// Reads a header up to and including the line `end_header`.
pub(super) fn read(reader: impl BufRead) -> Result<Header, ReadFault> {
    let mut lines = first_line(reader)?;
    let mut encoding = None;
    let mut elements: Vec<ElementDef> = Vec::new();
    let mut comments = Vec::new();
    loop {
        lines.next()?;
        let text = String::from_utf8_lossy(&lines.text).into_owned();
        let mut words = text.split_ascii_whitespace();
        let keyword = words.next().unwrap_or_default();
        let words: Vec<&str> = words.take(6).collect();
        match keyword {
            "" | "obj_info" => {}
            "comment" => {
                let start = text.find("comment").map_or(0, |at| at + "comment".len());
                comments.push(text[start..].trim().to_owned());
            }
            "format" => encoding = Some(format(&lines, &words)?),
            "element" => elements.push(element(&lines, &words)?),
            "property" => {
                let property = property(&lines, &words)?;
                match elements.last_mut() {
                    Some(element) => element.properties.push(property),
                    None => return Err(lines.fault("an element first", quoted(&lines.text))),
                }
            }
            "end_header" => break,
            _ => {
                let expected = "comment, obj_info, format, element, property or end_header";
                return Err(lines.fault(expected, quoted(&lines.text)));
            }
        }
    }
    let expected = "a line `format` before it";
    let encoding = encoding.ok_or_else(|| lines.fault(expected, "`end_header`".to_owned()))?;
    Ok(Header { encoding, elements, comments, n_lines: lines.line, length: lines.length })
}

/// Reads the line `ply`, whose end tells how the others end.
fn first_line<R: BufRead>(mut reader: R) -> Result<Lines<R>, ReadFault> {
    let mut text = Vec::new();
    let mut end = b'\n';
    while let Some(&byte) = reader.fill_buf()?.first() {
        if text.last() == Some(&b'\r') && byte != b'\n' {
            end = b'\r';
            break;
        }
        reader.consume(1);
        text.push(byte);
        if byte == b'\n' || text.len() > 64 {
            break;
        }
    }
    let length = text.len() as u64;
    let word = text.strip_prefix(BYTE_ORDER_MARK).unwrap_or(&text).trim_ascii();
    if word != b"ply" {
        return Err(ReadFault::UnknownFormat {
            known: crate::read::known(&[]),
            found: quoted(&text),
        });
    }
    Ok(Lines { reader, end, line: 1, length, text })
}

fn format<R: BufRead>(lines: &Lines<R>, words: &[&str]) -> Result<Encoding, ReadFault> {
    match words {
        ["ascii", "1.0"] => Ok(Encoding::Ascii),
        ["binary_little_endian", "1.0"] => Ok(Encoding::Binary { big: false }),
        ["binary_big_endian", "1.0"] => Ok(Encoding::Binary { big: true }),
        _ => {
            let expected = "format ascii, binary_little_endian or binary_big_endian 1.0";
            Err(lines.fault(expected, quoted(&lines.text)))
        }
    }
}

fn element<R: BufRead>(lines: &Lines<R>, words: &[&str]) -> Result<ElementDef, ReadFault> {
    let parsed = match words {
        [name, count] => count.parse().ok().map(|count| (*name, count)),
        _ => None,
    };
    let (name, count) = parsed.ok_or_else(|| {
        lines.fault("an element with a name and a count below 2^64", quoted(&lines.text))
    })?;
    Ok(ElementDef { name: name.to_owned(), count, properties: Vec::new() })
}

fn property<R: BufRead>(lines: &Lines<R>, words: &[&str]) -> Result<Property, ReadFault> {
    let known = |word: &&str| {
        scalar(word).ok_or_else(|| {
            lines.fault("a type from int8 to float64 or char to double", quoted(word.as_bytes()))
        })
    };
    let (name, kind) = match words {
        ["list", length, item, name] => {
            let (length, item) = (known(length)?, known(item)?);
            if matches!(length, Element::F32 | Element::F64) {
                return Err(lines.fault("an integer type for a list's length", quoted(&lines.text)));
            }
            (name, Kind::List { length, item })
        }
        [kind, name] => (name, Kind::Scalar(known(kind)?)),
        _ => return Err(lines.fault("a property with a type and a name", quoted(&lines.text))),
    };
    Ok(Property { name: (*name).to_owned(), kind, line: lines.line })
}

/// The type of this old or new name.
fn scalar(name: &str) -> Option<Element> {
    Some(match name {
        "char" | "int8" => Element::I8,
        "uchar" | "uint8" => Element::U8,
        "short" | "int16" => Element::I16,
        "ushort" | "uint16" => Element::U16,
        "int" | "int32" => Element::I32,
        "uint" | "uint32" => Element::U32,
        "float" | "float32" => Element::F32,
        "double" | "float64" => Element::F64,
        _ => return None,
    })
}
