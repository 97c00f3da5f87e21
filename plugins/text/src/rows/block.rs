//! A block of a body of lines: its bytes, and the columns they make.

use super::line::{LineParser, Outcome};
use crate::layout::{Column, Layout};
use crate::text::{MAX_LINE, ends_line, line_end, long_line};
use surfelshop_api::Result;
use surfelshop_api::columns::{Element, POSITION, Values};
use surfelshop_api::format::FileSource;
use surfelshop_api::glam::{DMat4, DVec3};

/// What becomes of points at zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum NoReturn {
    /// They are points.
    #[default]
    Point,
    /// They are left out: nothing came back from there.
    LeftOut,
    /// They are places without a point, at NaN.
    Nan,
}

/// What a format asks of its lines.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Options {
    /// Whether a line with a count alone may begin another cloud.
    pub(crate) has_marks: bool,
    /// What becomes of points at zero.
    pub(crate) no_return: NoReturn,
    /// Moves positions.
    pub(crate) matrix: Option<DMat4>,
}

/// A line with a count alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Mark {
    /// Where the line begins.
    pub(crate) place: u64,
    /// Its number, counted from the first of the block.
    pub(crate) line: u64,
    /// Rows of the block before it.
    pub(crate) rows: usize,
    /// Lines of the block before it that cannot be read.
    pub(crate) unreadable: u64,
}

/// Where a block lies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BlockPlace {
    /// Where the body begins: a line begins there.
    pub(crate) body: u64,
    /// Where the lines of this block begin and where those of the next one do: lines belong to the block in
    /// which they begin.
    pub(crate) start: u64,
    pub(crate) end: u64,
}

/// Values of a column.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Data {
    I8(Vec<i8>),
    U8(Vec<u8>),
    I16(Vec<i16>),
    U16(Vec<u16>),
    I32(Vec<i32>),
    U32(Vec<u32>),
    F32(Vec<f32>),
    F64(Vec<f64>),
}

impl Data {
    /// The first so many elements.
    pub(crate) fn values(&self, len: usize) -> Values<'_> {
        match self {
            Self::I8(all) => Values::I8(&all[..len]),
            Self::U8(all) => Values::U8(&all[..len]),
            Self::I16(all) => Values::I16(&all[..len]),
            Self::U16(all) => Values::U16(&all[..len]),
            Self::I32(all) => Values::I32(&all[..len]),
            Self::U32(all) => Values::U32(&all[..len]),
            Self::F32(all) => Values::F32(&all[..len]),
            Self::F64(all) => Values::F64(&all[..len]),
        }
    }
}

/// What the lines of a block say.
#[derive(Clone, Debug, Default)]
pub(crate) struct Block {
    pub(crate) columns: Vec<Data>,
    /// Lines that are points, with those that stand for none.
    pub(crate) n_rows: usize,
    /// The rows that stand for no point, in order; the columns do not have them.
    pub(crate) none: Vec<u32>,
    pub(crate) marks: Vec<Mark>,
    /// Lines that begin in the block, blank ones as well.
    pub(crate) n_lines: u64,
    /// Lines that cannot be read; and of the first its number, counted from the first of the block, and place.
    pub(crate) n_unreadable: u64,
    pub(crate) unreadable: Option<(u64, u64)>,
}

impl Block {
    /// Points among the first so many rows.
    pub(crate) fn points(&self, n_rows: usize) -> usize {
        n_rows - self.none.partition_point(|&row| (row as usize) < n_rows)
    }
}

/// Reads a block.
///
/// # Errors
/// Where a line is too long, or the system refuses.
pub(crate) fn read(
    file: &FileSource,
    place: BlockPlace,
    layout: &Layout,
    options: &Options,
) -> Result<Block> {
    let (mut text, begin) = text(file, place)?;
    let start = place.start - u64::from(place.start > place.body);
    if layout.decimal != b'.' {
        // What separates words is another byte. A number with a point is one with two then, and is refused.
        for byte in &mut text {
            *byte = match *byte {
                b'.' => b',',
                byte if byte == layout.decimal => b'.',
                byte => byte,
            };
        }
    }
    parsed(&text, begin, start, layout, options)
}

/// The bytes of a block, with an end of line behind the last line that begins in it, and where in them the first
/// line begins. A byte more stands before them where the block is not the body's first.
fn text(file: &FileSource, place: BlockPlace) -> Result<(Vec<u8>, usize)> {
    // The byte before tells whether a line begins at the start.
    let before = u64::from(place.start > place.body);
    let first = place.start - before;
    let mut text = file.bytes_at(first, place.end - first)?;
    let begin = match (before, text.as_slice()) {
        (0, _) => 0,
        (_, [b'\r', b'\n', ..]) => 2,
        (_, [byte, ..]) if ends_line(*byte) => 1,
        (_, text) => line_end(text, 1).1,
    };
    if begin >= text.len() {
        return Ok((Vec::new(), 0));
    }
    let mut len = 4 << 10;
    while !text.last().copied().is_some_and(ends_line) {
        let read = text.len();
        if read as u64 > MAX_LINE + (place.end - place.start) {
            return Err(long_line(place.start));
        }
        text.try_reserve(len)?;
        text.resize(read + len, 0);
        let n = file.read_at(first + read as u64, &mut text[read..])?;
        text.truncate(read + n);
        if n == 0 {
            text.push(b'\n');
        } else if let Some(end) = text[read..].iter().position(|&byte| ends_line(byte)) {
            text.truncate(read + end + 1);
        }
        len *= 2;
    }
    Ok((text, begin))
}

/// The bytes that a number and what separates it take at least in most files.
const NUMBER_BYTES: usize = 6;

fn parsed(
    text: &[u8],
    begin: usize,
    start: u64,
    layout: &Layout,
    options: &Options,
) -> Result<Block> {
    let parser = LineParser::new(layout);
    let (mut block, mut values, mut at) = (Block::default(), Vec::new(), begin);
    values.try_reserve(text.len() / NUMBER_BYTES)?;
    while at < text.len() {
        let (outcome, next) = parser.line(text, at, &mut values);
        match outcome {
            Outcome::Row => block.n_rows += 1,
            Outcome::Nothing => {}
            Outcome::Count if options.has_marks => block.marks.push(Mark {
                place: start + at as u64,
                line: block.n_lines,
                rows: block.n_rows,
                unreadable: block.n_unreadable,
            }),
            Outcome::Count | Outcome::Unreadable => {
                block.n_unreadable += 1;
                block.unreadable.get_or_insert((block.n_lines, start + at as u64));
            }
        }
        block.n_lines += 1;
        at = next;
    }
    fill(&mut block, &values, layout, options);
    Ok(block)
}

/// Makes columns of the numbers of all rows.
fn fill(block: &mut Block, values: &[f64], layout: &Layout, options: &Options) {
    let stride = layout.n_read().max(1);
    let position = layout.columns.iter().find(|column| column.file.name == POSITION);
    let places = position.and_then(|column| column.places.first_chunk::<3>());
    let mut none = Vec::new();
    if let (true, Some(places)) = (options.no_return != NoReturn::Point, places) {
        let rows = (0u32..).zip(values.chunks_exact(stride));
        let at_zero = rows.filter(|(_, row)| places.iter().all(|&place| row[place] == 0.0));
        none.extend(at_zero.map(|(row, _)| row));
    }
    let mut moved = Vec::new();
    let mut values = values;
    if let (Some(matrix), Some(places)) = (options.matrix, places) {
        moved.extend_from_slice(values);
        for row in moved.chunks_exact_mut(stride) {
            let point = matrix.transform_point3(DVec3::from_array(places.map(|place| row[place])));
            for (place, coordinate) in places.iter().zip(point.to_array()) {
                row[*place] = coordinate;
            }
        }
        values = &moved;
    }
    let mut placed = Vec::new();
    match (options.no_return, places) {
        (NoReturn::Nan, Some(places)) if !none.is_empty() => {
            placed.extend_from_slice(values);
            for row in none {
                places.iter().for_each(|place| placed[row as usize * stride + place] = f64::NAN);
            }
            values = &placed;
        }
        (NoReturn::Nan, _) => {}
        _ => block.none = none,
    }
    let column = |column: &Column| data(column, values, stride, block);
    block.columns = layout.columns.iter().map(column).collect();
}

/// The values of a column; the fields have checked that its type holds them.
fn data(column: &Column, values: &[f64], stride: usize, block: &Block) -> Data {
    macro_rules! gathered {
        ($($variant:ident: $type:ty),*) => {
            match column.file.element {
                $(Element::$variant => {
                    let mut all: Vec<$type> = Vec::with_capacity(block.n_rows * column.places.len());
                    let mut none = block.none.iter().copied().peekable();
                    for (row, numbers) in (0u32..).zip(values.chunks_exact(stride)) {
                        if none.next_if_eq(&row).is_none() {
                            all.extend(column.places.iter().map(|&place| numbers[place] as $type));
                        }
                    }
                    Data::$variant(all)
                })*
            }
        };
    }
    gathered!(I8: i8, U8: u8, I16: i16, U16: u16, I32: i32, U32: u32, F32: f32, F64: f64)
}
