//! The bytes that accessors refer to.

use base64::Engine;
use base64::engine::general_purpose::STANDARD_PAD_INDIFFERENT;
use gltf::json::Root;
use std::ops::Range;
use surfelshop_api::format::FileSource;
use surfelshop_api::prelude::{Error, Result};

/// Where the bytes of a buffer are.
enum Place {
    /// In the binary chunk, from this byte of the file on.
    File(u64),
    Memory(Vec<u8>),
    /// In a file beside the scene.
    Beside(FileSource),
    /// Elsewhere: why it cannot be read.
    Nowhere(String),
}

struct Buffer {
    place: Place,
    length: u64,
}

/// All buffers of a file.
pub(crate) struct Buffers {
    file: FileSource,
    buffers: Vec<Buffer>,
}

/// Bytes of a buffer that are there.
#[derive(Clone, Debug)]
pub(crate) struct Span {
    buffer: usize,
    range: Range<u64>,
}

impl Span {
    /// Number of bytes.
    pub(crate) fn len(&self) -> u64 {
        self.range.end - self.range.start
    }

    /// A part of it; `None` where it is not as long.
    pub(crate) fn part(&self, offset: u64, len: u64) -> Option<Self> {
        let start = self.range.start.checked_add(offset)?;
        let end = start.checked_add(len).filter(|&end| end <= self.range.end)?;
        Some(Self { buffer: self.buffer, range: start..end })
    }
}

impl Buffers {
    /// Finds all buffers, and takes the text of those that are in the JSON out of it.
    ///
    /// # Errors
    /// Where memory runs out.
    pub(crate) fn new(
        file: &FileSource,
        root: &mut Root,
        binary: Option<Range<u64>>,
    ) -> Result<Self> {
        let mut buffers = Vec::with_capacity(root.buffers.len());
        for (number, buffer) in root.buffers.iter_mut().enumerate() {
            let length = buffer.byte_length.0;
            let (place, found) = match (buffer.uri.take(), &binary) {
                (Some(uri), _) => match uri.strip_prefix("data:") {
                    Some(data) => match decoded(data)? {
                        Ok(bytes) => {
                            let found = bytes.len() as u64;
                            (Place::Memory(bytes), found)
                        }
                        Err(line) => (Place::Nowhere(line), 0),
                    },
                    None => match beside(file, &uri) {
                        Ok(file) => {
                            let found = file.length();
                            (Place::Beside(file), found)
                        }
                        Err(line) => (Place::Nowhere(line), 0),
                    },
                },
                (None, Some(binary)) if number == 0 => {
                    (Place::File(binary.start), binary.end - binary.start)
                }
                (None, _) => (Place::Nowhere(format!("buffer {number} has no bytes")), 0),
            };
            let is_short = found < length && !matches!(place, Place::Nowhere(_));
            let line = || format!("expected {length} bytes in buffer {number}, found {found}");
            let place = if is_short { Place::Nowhere(line()) } else { place };
            buffers.push(Buffer { place, length });
        }
        Ok(Self { file: file.clone(), buffers })
    }

    /// Bytes of a buffer view.
    ///
    /// # Errors
    /// Where they are not there.
    pub(crate) fn view(&self, root: &Root, view: usize) -> Result<Span> {
        let missing = || Error::new(format!("expected a buffer view {view}, found none"));
        let json = root.buffer_views.get(view).ok_or_else(missing)?;
        let buffer = json.buffer.value();
        let missing = || Error::new(format!("expected a buffer {buffer}, found none"));
        let known = self.buffers.get(buffer).ok_or_else(missing)?;
        if let Place::Nowhere(line) = &known.place {
            return Err(Error::new(line.clone()));
        }
        let (offset, len) = (json.byte_offset.map_or(0, |offset| offset.0), json.byte_length.0);
        let all = Span { buffer, range: 0..known.length };
        all.part(offset, len).ok_or_else(|| {
            Error::new(format!(
                "buffer view {view}: expected {len} bytes from byte {offset} of buffer {buffer}, found {} bytes in it",
                known.length
            ))
        })
    }

    /// The bytes of a span.
    ///
    /// # Errors
    /// Where memory runs out, or the system refuses.
    pub(crate) fn bytes(&self, span: &Span) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let len = usize::try_from(span.len())?;
        bytes.try_reserve_exact(len)?;
        bytes.resize(len, 0);
        self.read(span, &mut bytes)?;
        Ok(bytes)
    }

    /// Holds numbers that no buffer of the file has.
    ///
    /// # Errors
    /// Where memory runs out.
    pub(crate) fn add(&mut self, numbers: &[f32]) -> Result<Span> {
        let mut bytes = Vec::new();
        bytes.try_reserve_exact(size_of_val(numbers))?;
        bytes.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
        let length = bytes.len() as u64;
        self.buffers.push(Buffer { place: Place::Memory(bytes), length });
        Ok(Span { buffer: self.buffers.len() - 1, range: 0..length })
    }

    /// Fills `out` from the beginning of a span, which is as long.
    ///
    /// # Errors
    /// Where the system refuses.
    pub(crate) fn read(&self, span: &Span, out: &mut [u8]) -> Result<()> {
        match self.buffers.get(span.buffer).map(|buffer| &buffer.place) {
            Some(Place::Beside(file)) => file.read_exact_at(span.range.start, out),
            Some(Place::File(start)) => self.file.read_exact_at(start + span.range.start, out),
            Some(Place::Memory(bytes)) => {
                let start = usize::try_from(span.range.start)?;
                let found = bytes.get(start..).and_then(|rest| rest.get(..out.len()));
                out.copy_from_slice(found.ok_or_else(|| Error::new("a buffer ends too early"))?);
                Ok(())
            }
            _ => Err(Error::new("a buffer has no bytes")),
        }
    }
}

/// The file that a relative URI names, or why it cannot be read.
fn beside(file: &FileSource, uri: &str) -> Result<FileSource, String> {
    let name = unescaped(uri.strip_prefix("./").unwrap_or(uri));
    file.beside(&name).map_err(|_none| {
        let name: String = name.chars().take(60).collect();
        format!(
            "expected a buffer in the file `{}` in the folder of the scene, with a name that ends in .bin or .glbin, \
             found none; put it there, or convert the scene to .glb, which holds everything",
            name.escape_debug()
        )
    })
}

/// A text with the bytes that `%` and two digits stand for.
fn unescaped(text: &str) -> String {
    let (mut bytes, mut rest) = (Vec::with_capacity(text.len()), text.as_bytes());
    while let Some((&first, after)) = rest.split_first() {
        let digits = after.get(..2).filter(|digits| digits.iter().all(u8::is_ascii_hexdigit));
        let digits = digits.and_then(|digits| std::str::from_utf8(digits).ok());
        let byte = digits.and_then(|digits| u8::from_str_radix(digits, 16).ok());
        let (byte, left) = match (first, byte) {
            (b'%', Some(byte)) => (byte, &after[2..]),
            _ => (first, after),
        };
        bytes.push(byte);
        rest = left;
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// The bytes of a `data:` URI after its scheme, or why there are none.
fn decoded(data: &str) -> Result<Result<Vec<u8>, String>> {
    let Some((_, text)) = data.split_once(',').filter(|(kind, _)| kind.ends_with(";base64")) else {
        return Ok(Err("a buffer is no `data:` URI of base64".to_owned()));
    };
    let mut bytes = Vec::new();
    bytes.try_reserve(text.len() / 4 * 3 + 3)?;
    match STANDARD_PAD_INDIFFERENT.decode_vec(text, &mut bytes) {
        Ok(()) => Ok(Ok(bytes)),
        Err(error) => Ok(Err(format!("a buffer has damaged base64: {error}"))),
    }
}
