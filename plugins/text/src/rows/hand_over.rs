//! Reads the lines of a cloud window by window, and hands the columns over.

use super::block::{self, Block, BlockPlace, Mark, Options};
use super::unreadable::Unreadable;
use crate::layout::Layout;
use surfelshop_api::Result;
use surfelshop_api::format::{CloudSink, FileSource};
use surfelshop_api::job::Job;

/// Bytes of a block: a few thousand lines.
const BLOCK: u64 = 256 << 10;
/// Bytes of the smallest and of the largest window, which is in memory at once.
const LEAST_WINDOW: u64 = 4 << 10;
const MOST_WINDOW: u64 = 64 * BLOCK;

/// The lines of a cloud.
pub(crate) struct Body<'a> {
    pub(crate) file: &'a FileSource,
    pub(crate) layout: &'a Layout,
    pub(crate) options: Options,
    /// Where the first line begins, and its number, counted from 1.
    pub(crate) start: u64,
    pub(crate) line: u64,
    /// Lines that are taken at most; what comes behind is counted.
    pub(crate) most: u64,
    /// Bytes that the lines are likely to take, and those that they take at least.
    pub(crate) likely: u64,
    pub(crate) least: u64,
}

/// What came of a cloud's lines.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Taken {
    /// Points that were handed over.
    pub(crate) points: u64,
    /// Lines that stand for no point.
    pub(crate) none: u64,
    /// Lines behind those that were taken.
    pub(crate) left_out: u64,
    /// Where the next cloud begins, and the number of that line.
    pub(crate) next: Option<(u64, u64)>,
}

impl Body<'_> {
    /// Hands over points until the next cloud begins or the file ends. Whether a count alone in a line begins a
    /// cloud is for `is_next` to say.
    ///
    /// # Errors
    /// Where a line is too long, the user asked to stop, or the host or the system refuses.
    pub(crate) fn hand_over(
        &self,
        clouds: &mut CloudSink<'_>,
        unreadable: &mut Unreadable,
        job: &Job<'_>,
        is_next: impl Fn(&Mark) -> Result<bool>,
    ) -> Result<Taken> {
        let (mut line, mut taken) = (self.line, Taken::default());
        let mut windows = Windows::new(self, self.start);
        while let Some((start, end)) = windows.next() {
            for block in self.window(start, end, job)? {
                let n_damaged = first_next(&block, &is_next)?;
                let mark = block.marks.get(n_damaged);
                let n_rows = mark.map_or(block.n_rows, |mark| mark.rows);
                let n_unreadable = mark.map_or(block.n_unreadable, |mark| mark.unreadable);
                let damaged = block.marks[..n_damaged].first().map(|mark| (mark.line, mark.place));
                let first = damaged.into_iter().chain(block.unreadable).min();
                let first = first.map(|(number, place)| (line + number, place));
                unreadable.add(n_rows as u64, n_unreadable + n_damaged as u64, first);
                self.hand_over_block(&block, n_rows, clouds, &mut taken)?;
                if let Some(mark) = mark {
                    taken.next = Some((mark.place, line + mark.line));
                    return Ok(taken);
                }
                line += block.n_lines;
            }
            if unreadable.is_hopeless() {
                break;
            }
        }
        Ok(taken)
    }

    /// Where the next cloud begins, without reading this one: the bytes that its lines take at least are passed
    /// over. The number of its line is what it is where no lines are blank or missing.
    ///
    /// # Errors
    /// As [`hand_over`](Self::hand_over).
    pub(crate) fn find_next(
        &self,
        job: &Job<'_>,
        is_next: impl Fn(&Mark) -> Result<bool>,
    ) -> Result<Option<(u64, u64)>> {
        let mut windows = Windows::new(self, self.start + self.least);
        while let Some((start, end)) = windows.next() {
            for block in self.window(start, end, job)? {
                if let Some(mark) = block.marks.get(first_next(&block, &is_next)?) {
                    return Ok(Some((mark.place, self.line.saturating_add(self.most))));
                }
            }
        }
        Ok(None)
    }

    /// Reads the blocks between two places on all threads.
    fn window(&self, start: u64, end: u64, job: &Job<'_>) -> Result<Vec<Block>> {
        let n_blocks = usize::try_from((end - start).div_ceil(BLOCK))?;
        let length = self.file.length().max(1) as f64;
        let share = start as f64 / length..end as f64 / length;
        let blocks = job.map(n_blocks, share, |i| {
            let start = start + i as u64 * BLOCK;
            let place = BlockPlace { body: self.start, start, end: end.min(start + BLOCK) };
            block::read(self.file, place, self.layout, &self.options)
        })?;
        blocks.into_iter().collect()
    }

    fn hand_over_block(
        &self,
        block: &Block,
        n_rows: usize,
        clouds: &mut CloudSink<'_>,
        taken: &mut Taken,
    ) -> Result<()> {
        let room = self.most.saturating_sub(taken.points + taken.none);
        let n_taken = n_rows.min(usize::try_from(room).unwrap_or(usize::MAX));
        let n_points = block.points(n_taken);
        taken.left_out += (n_rows - n_taken) as u64;
        taken.points += n_points as u64;
        taken.none += (n_taken - n_points) as u64;
        if n_points == 0 {
            return Ok(());
        }
        let columns = block.columns.iter().zip(&self.layout.columns);
        let values: Vec<_> =
            columns.map(|(data, column)| data.values(n_points * column.places.len())).collect();
        clouds.batch(&values)
    }
}

/// How many of a block's marks come before the one that begins the next cloud.
fn first_next(block: &Block, is_next: &impl Fn(&Mark) -> Result<bool>) -> Result<usize> {
    for (i, mark) in block.marks.iter().enumerate() {
        if is_next(mark)? {
            return Ok(i);
        }
    }
    Ok(block.marks.len())
}

/// The parts of a file that are read one after the other: small at first, and again where the cloud is likely to
/// end. So what is read behind its end is at most about as much as was its own.
struct Windows {
    place: u64,
    likely_end: u64,
    length: u64,
    size: u64,
}

impl Windows {
    fn new(body: &Body<'_>, place: u64) -> Self {
        let likely_end = body.start.saturating_add(body.likely);
        Self { place, likely_end, length: body.file.length(), size: LEAST_WINDOW }
    }

    fn next(&mut self) -> Option<(u64, u64)> {
        if self.place >= self.length {
            return None;
        }
        let start = self.place;
        let to_end = self.likely_end.saturating_sub(start);
        let size = if to_end > 0 { self.size.min(to_end.max(LEAST_WINDOW)) } else { self.size };
        self.place = self.length.min(start + size);
        let reaches_end = to_end > 0 && self.place >= self.likely_end;
        self.size = if reaches_end { LEAST_WINDOW } else { (self.size * 2).min(MOST_WINDOW) };
        Some((start, self.place))
    }
}
