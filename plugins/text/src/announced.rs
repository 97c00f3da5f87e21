//! Clouds whose number of lines a file announces, one behind the other: PTS and PTX.

use crate::layout::Found;
use crate::layout::by_ranges;
use crate::layout::sample::Sample;
use crate::rows::{Body, Mark, Options, Taken, Unreadable};
use crate::text::{LineReader, count};
use surfelshop_api::Result;
use surfelshop_api::columns::{Element, POSITION};
use surfelshop_api::format::{CloudHeader, CloudSink, FileColumn, FileSource, UpAxis};
use surfelshop_api::job::Job;

/// Bytes that a line of three numbers takes at least.
const LEAST_LINE: u64 = 6;

/// Clouds of a file that are read. A host takes no more, and each takes its time.
pub(crate) const MOST_CLOUDS: usize = 1 << 16;

/// A file while its clouds are read.
pub(crate) struct Reading<'a, 'b> {
    pub(crate) file: &'a FileSource,
    pub(crate) clouds: &'a mut CloudSink<'b>,
    pub(crate) job: &'a Job<'a>,
    pub(crate) unreadable: Unreadable,
}

/// A cloud of a file as far as its announcement says.
pub(crate) struct Announced {
    /// Lines that are announced; `None` where the file does not say.
    pub(crate) lines: Option<u64>,
    /// Where the first line begins, and its number, counted from 1.
    pub(crate) start: u64,
    pub(crate) line: u64,
}

impl Announced {
    /// What is left of an announcement of no lines: nothing follows, or the number was not known.
    ///
    /// # Errors
    /// Where a line is too long, or the system refuses.
    pub(crate) fn checked(self, file: &FileSource) -> Result<Self> {
        if self.lines != Some(0) {
            return Ok(self);
        }
        let next = LineReader::new(file, self.start, self.line).next()?;
        let follows = next.is_some_and(|line| count(&line.text).is_none());
        Ok(Self { lines: self.lines.filter(|_| !follows), ..self })
    }

    /// The lines, where the rest of the file has room for them.
    fn plausible(&self, file: &FileSource) -> Option<u64> {
        let room = file.length().saturating_sub(self.start) / LEAST_LINE + 1;
        self.lines.filter(|&lines| lines <= room)
    }
}

impl Reading<'_, '_> {
    /// Reads a cloud. `complete` makes its header of what was found out of its lines; `header` has what is known.
    /// Whether a count alone in a line begins the next cloud is for `is_next` to say.
    ///
    /// # Errors
    /// Where there are no lines of numbers, or reading fails.
    pub(crate) fn cloud(
        &mut self,
        announced: &Announced,
        complete: impl FnOnce(Option<&Found>, CloudHeader) -> (CloudHeader, Options),
        is_next: impl Fn(&Mark) -> Result<bool>,
    ) -> Result<Taken> {
        let header = CloudHeader { up: UpAxis::Z, ..CloudHeader::default() };
        if announced.lines == Some(0) {
            let columns = vec![FileColumn::new(POSITION, 3, Element::F64)];
            let header = CloudHeader { rows: Some(0), columns, ..header };
            self.clouds.begin(&complete(None, header).0)?;
            let next = LineReader::new(self.file, announced.start, announced.line).next()?;
            let next = next.map(|line| (line.place, line.number));
            return Ok(Taken { next, ..Taken::default() });
        }
        let plausible = announced.plausible(self.file);
        let rest = self.file.length().saturating_sub(announced.start);
        let most = plausible.unwrap_or(u64::MAX);
        let has_counts = announced.lines.is_some();
        let mut sample = Sample::of_head(self.file, announced.start, 0, most, has_counts)?;
        let (mean, is_whole) = sample.cut(most, has_counts);
        let likely = if is_whole {
            sample.head.len() as u64
        } else {
            plausible.map_or(rest, |lines| rest.min((mean * lines as f64) as u64))
        };
        if !is_whole {
            sample.spread(self.file, announced.start + likely)?;
        }
        let found = by_ranges(&sample, announced.line)?;
        let layout = found.layout(|column| self.clouds.wants(column));
        let columns = layout.columns.iter().map(|column| column.file.clone()).collect();
        let header = CloudHeader { rows: plausible, columns, ..header };
        let (header, options) = complete(Some(&found), header);
        let is_wanted = self.clouds.begin(&header)?;
        let has_marks = announced.lines.is_some() || options.has_marks;
        let options = Options { has_marks, ..options };
        let skipping = layout.skipping();
        let body = Body {
            file: self.file,
            layout: if is_wanted { &layout } else { &skipping },
            options,
            start: announced.start,
            line: announced.line,
            most,
            likely,
            // Some lines may be shorter still.
            least: plausible.map_or(0, |lines| {
                rest.min(lines.saturating_mul(sample.short_line() as u64) / 10 * 9)
            }),
        };
        if !is_wanted {
            // Without counts there is one cloud.
            let next = if has_marks { body.find_next(self.job, is_next)? } else { None };
            return Ok(Taken { next, ..Taken::default() });
        }
        let taken = body.hand_over(self.clouds, &mut self.unreadable, self.job, is_next)?;
        self.say_counts(announced, &header, &taken);
        Ok(taken)
    }

    /// Says where numbers of points do not agree; of fewer than a header has, the host says so.
    fn say_counts(&mut self, announced: &Announced, header: &CloudHeader, taken: &Taken) {
        let Some(lines) = announced.lines else { return };
        if taken.left_out > 0 {
            let left_out = taken.left_out;
            let which = if header.name.is_empty() { "the file" } else { &header.name };
            self.clouds.warn(&format!(
                "{which} announces {lines} points and has {left_out} more, which are left out"
            ));
        }
        let found = taken.points + taken.none;
        if header.rows.is_none() && found < lines {
            let which = if header.name.is_empty() { "" } else { &header.name };
            let of = if which.is_empty() { String::new() } else { format!("{which}: ") };
            self.clouds.warn(&format!("{of}{lines} points are announced, {found} were read"));
        }
    }

    /// Says what could not be read of all clouds.
    ///
    /// # Errors
    /// Where it is too much.
    pub(crate) fn finish(self) -> Result<()> {
        self.unreadable.finish(self.file, self.clouds)
    }
}
