//! Text files: a line for each corner, between lines that begin and end facets.

use crate::mesh::Mesh;
use std::ops::Range;
use surfelshop_api::format::{CloudSink, FileSource};
use surfelshop_api::prelude::{Error, Job, Result};

/// Bytes of text that are read at once; no line may be longer.
const BLOCK: usize = 8 << 20;

/// Bytes of text that a thread takes at once, about.
const PIECE: usize = 1 << 16;

/// Reads a file that begins with `head`.
pub(crate) fn read(
    file: &FileSource,
    head: &[u8],
    clouds: &mut CloudSink<'_>,
    job: &Job<'_>,
) -> Result<()> {
    let Some(mesh) = Mesh::<f64>::begin(clouds, "ascii", name(head), Vec::new())? else {
        return Ok(());
    };
    let mut facets = Facets { mesh, open: Vec::new(), unknown: None, is_ended: false };
    let (mut text, mut place) = (Vec::new(), 0);
    let share = |place: u64| place as f64 / file.length().max(1) as f64;
    loop {
        job.check()?;
        let n_carried = text.len();
        let room = block_room(file, place, n_carried);
        text.try_reserve(room)?;
        text.resize(n_carried + room, 0);
        let n_read = file.read_at(place, &mut text[n_carried..])?;
        text.truncate(n_carried + n_read);
        let is_last = n_read < room || place + n_read as u64 >= file.length();
        let end = if is_last {
            text.len()
        } else {
            let newline = text.iter().rposition(|&byte| byte == b'\n');
            let endless = || Error::new(format!("expected lines, found one of {BLOCK} bytes"));
            newline.ok_or_else(endless)? + 1
        };
        let shares = share(place)..share(place + n_read as u64).min(1.0);
        place += n_read as u64;
        let pieces = pieces(&text[..end]);
        let parsed = job.map(pieces.len(), shares, |i| Piece::of(&text[pieces[i].clone()]))?;
        parsed.into_iter().try_for_each(|piece| facets.take(piece))?;
        text.drain(..end);
        if is_last {
            return facets.finish();
        }
    }
}

/// Bytes that a block has room for behind those carried over, no more than the file has.
fn block_room(file: &FileSource, place: u64, n_carried: usize) -> usize {
    let left = usize::try_from(file.length().saturating_sub(place)).unwrap_or(usize::MAX);
    left.min(BLOCK.saturating_sub(n_carried))
}

/// What the first line calls the solid.
fn name(head: &[u8]) -> String {
    let line = head
        .split(|&byte| matches!(byte, b'\n' | b'\r'))
        .find(|line| !line.trim_ascii().is_empty());
    let line = String::from_utf8_lossy(line.unwrap_or_default()).into_owned();
    let name = line.trim_start_matches('\u{feff}').trim_start().get(5..).unwrap_or_default();
    name.trim().chars().filter(|c| !c.is_control()).take(200).collect()
}

/// Text in pieces of whole lines.
fn pieces(text: &[u8]) -> Vec<Range<usize>> {
    let mut pieces = Vec::new();
    let mut start = 0;
    while start < text.len() {
        let least = (start + PIECE).min(text.len());
        let newline = text[least..].iter().position(|&byte| byte == b'\n');
        let end = newline.map_or(text.len(), |newline| least + newline + 1);
        pieces.push(start..end);
        start = end;
    }
    pieces
}

/// What lines say.
#[derive(Default)]
struct Piece {
    corners: Vec<[f64; 3]>,
    /// How many of the corners come before each end of a facet.
    ends: Vec<usize>,
    /// The first line that is none of STL.
    unknown: Option<String>,
    /// Whether the last solid was ended.
    is_ended: Option<bool>,
    /// A corner that is none, after those before it.
    failure: Option<String>,
}

impl Piece {
    fn of(text: &[u8]) -> Self {
        let mut piece = Self::default();
        for line in text.split(|&byte| matches!(byte, b'\n' | b'\r')) {
            if let Err(failure) = piece.line(line.trim_ascii()) {
                piece.failure = Some(failure);
                break;
            }
        }
        piece
    }

    fn line(&mut self, line: &[u8]) -> Result<(), String> {
        let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
        let (word, rest) = line.split_at(end);
        let is = |keyword: &[u8]| word.eq_ignore_ascii_case(keyword);
        if is(b"vertex") {
            self.corners.push(corner(rest).ok_or_else(|| {
                format!(
                    "expected three numbers behind `vertex`, found `{}`",
                    shown(rest.trim_ascii())
                )
            })?);
        } else if is(b"endloop") {
            self.ends.push(self.corners.len());
        } else if is(b"solid") || is(b"endsolid") {
            self.is_ended = Some(is(b"endsolid"));
        } else if !(word.is_empty() || is(b"facet") || is(b"outer") || is(b"endfacet"))
            && self.unknown.is_none()
            && word != b"\xef\xbb\xbfsolid"
        {
            self.unknown = Some(shown(line));
        }
        Ok(())
    }
}

fn corner(text: &[u8]) -> Option<[f64; 3]> {
    let mut words = std::str::from_utf8(text).ok()?.split_ascii_whitespace();
    let mut next = || words.next()?.parse().ok();
    let corner = [next()?, next()?, next()?];
    words.next().is_none().then_some(corner)
}

/// Text of a file as a message has it.
fn shown(text: &[u8]) -> String {
    let text: String = String::from_utf8_lossy(text).chars().take(40).collect();
    text.escape_debug().to_string()
}

/// Facets as far as they were read.
struct Facets<'a, 'b> {
    mesh: Mesh<'a, 'b, f64>,
    /// Corners of a facet that is not ended yet.
    open: Vec<[f64; 3]>,
    unknown: Option<String>,
    is_ended: bool,
}

impl Facets<'_, '_> {
    fn wrong(&self, line: &str) -> Error {
        Error::new(format!("facet {}: {line}", self.mesh.n_triangles() + 1))
    }

    fn take(&mut self, piece: Piece) -> Result<()> {
        let mut from = 0;
        for end in piece.ends {
            self.keep(&piece.corners[from..end])?;
            from = end;
            let triangle = std::mem::take(&mut self.open);
            let found = triangle.len();
            let corners = <[[f64; 3]; 3]>::try_from(triangle).ok();
            let wrong = || self.wrong(&format!("expected three corners, found {found}"));
            let corners = corners.ok_or_else(wrong)?;
            self.mesh.push(&corners)?;
        }
        self.keep(&piece.corners[from..])?;
        self.is_ended = piece.is_ended.unwrap_or(self.is_ended);
        self.unknown = self.unknown.take().or(piece.unknown);
        match piece.failure {
            None => Ok(()),
            Some(line) => Err(self.wrong(&line)),
        }
    }

    /// Takes corners of a facet that is not ended yet.
    fn keep(&mut self, corners: &[[f64; 3]]) -> Result<()> {
        if self.open.len() + corners.len() > 3 {
            return Err(self.wrong("expected a line `endloop` behind three corners, found none"));
        }
        self.open.extend_from_slice(corners);
        Ok(())
    }

    fn finish(mut self) -> Result<()> {
        if !self.open.is_empty() {
            return Err(self.wrong("expected its end, found none: the file is cut short"));
        }
        if let Some(line) = self.unknown.take() {
            if self.mesh.n_triangles() == 0 {
                return Err(Error::new(format!("expected facets, found `{line}`")));
            }
            self.mesh.warn(&format!("lines that are none of STL were left out, first `{line}`"));
        }
        if !self.is_ended {
            self.mesh.warn("there is no line `endsolid` at the end: the file may be cut short");
        }
        self.mesh.flush()
    }
}
