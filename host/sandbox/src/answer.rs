//! What the host does when a module calls it.

use crate::clouds::len_of;
use crate::function::{HostFunction, Request};
use crate::host::Host;
use crate::instance::{Instance, Pace};
use crate::layout::{PAIR_LEN, Written, u32_at};
use crate::stop::Stop;
use surfelshop_api::CloudView;
use surfelshop_api::abi::format_table::{END, HEADER_CHANNEL};
use surfelshop_api::abi::table::{channel, status};
use wasmi::Val;

/// Most columns, values and buffers that are named at once.
const MAX_NAMED: u32 = 4096;
/// Longest text of progress and warnings that is taken, in bytes.
const MAX_TEXT: usize = 4096;
/// How many steps of a loop are run between two looks at whether somebody asked to stop.
const RANGE: u32 = 4096;

/// What goes back to a module; nothing of functions that return nothing.
pub(crate) type Answer = Option<Val>;

/// The start of a text.
fn shortened(text: &[u8]) -> &[u8] {
    &text[..text.len().min(MAX_TEXT)]
}

impl Instance {
    /// Does what a module asks for, and says how many bytes went to or fro.
    ///
    /// # Errors
    /// Where what it names is not in its memory. What the host refuses is no error here: the module is told.
    pub(crate) fn answer(
        &mut self,
        request: &Request,
        pace: &mut Pace,
        host: &mut dyn Host,
        depth: u32,
    ) -> Result<(Answer, usize), Stop> {
        let word = |i| request.word(i);
        match request.function {
            HostFunction::Write => {
                let bytes = self.named(word(2))?;
                host.write(word(1), bytes);
                return Ok((None, bytes.len()));
            }
            HostFunction::Progress => {
                host.progress(request.float(1), shortened(self.named(word(2))?));
                return Ok((None, MAX_TEXT));
            }
            HostFunction::Warn => {
                host.warn(shortened(self.named(word(1))?));
                return Ok((None, MAX_TEXT));
            }
            HostFunction::Length => return Ok((Some(Val::I64(host.length() as i64)), 0)),
            HostFunction::Cancelled => {
                return Ok((Some(Val::I32(i32::from(host.cancelled()))), 0));
            }
            HostFunction::Parallel => {
                let left_out = self.parallel(request, pace, host, depth)?;
                return Ok((Some(Val::I32(i32::from(left_out))), 0));
            }
            HostFunction::Compute => {
                return self.compute(request, pace, host, depth);
            }
            HostFunction::NextCloud => {
                return self.next_cloud(word(1), pace, host, depth);
            }
            _ => {}
        }
        let (outcome, bytes, sink) = self.exchange(request, host)?;
        let status = match outcome {
            Ok(status) => status,
            Err(line) => self.refuse(&line, sink, pace, host, depth)?,
        };
        Ok((Some(Val::I32(status)), bytes))
    }

    /// Requests that end with a status or a line: with the bytes that went to or fro, and the module's sink.
    fn exchange(
        &mut self,
        request: &Request,
        host: &mut dyn Host,
    ) -> Result<(Result<i32, String>, usize, u32), Stop> {
        let word = |i| request.word(i);
        let done = |outcome: Result<(), String>| outcome.map(|()| status::OK);
        Ok(match request.function {
            HostFunction::Stage => {
                let (header, values) = (self.named(word(1))?, self.named_all(word(2), word(3))?);
                let bytes = values.iter().map(|value| value.len()).sum();
                (done(host.stage(header, &values)), bytes, word(4))
            }
            HostFunction::ReadAt => {
                let (offset, at, len, found_at) = (request.long(1), word(2), word(3), word(4));
                let outcome = host.read_at(offset, self.slice_mut(at, len as usize)?);
                if let Ok(found) = &outcome {
                    let found = u32::try_from(*found).unwrap_or(len).min(len);
                    self.put(found_at, &found.to_le_bytes())?;
                }
                (outcome.map(|_found| status::OK), len as usize, word(5))
            }
            HostFunction::WriteAt => {
                let bytes = self.named(word(2))?;
                (done(host.write_at(request.long(1), bytes)), bytes.len(), word(3))
            }
            HostFunction::Begin => {
                let header = self.named(word(1))?;
                let wanted = host.begin(header);
                let outcome = wanted.map(|wanted| if wanted { status::OK } else { END });
                (outcome, header.len(), word(2))
            }
            HostFunction::Batch => {
                let columns = self.named_all(word(1), word(2))?;
                let bytes = columns.iter().map(|column| column.len()).sum();
                (done(host.batch(&columns)), bytes, word(3))
            }
            HostFunction::Faces => {
                let len = word(2).checked_mul(12).ok_or_else(|| {
                    Stop::misbehaved(format!(
                        "it named {} triangles, more than its memory holds",
                        word(2)
                    ))
                })?;
                let bytes = if len == 0 { &[] } else { self.slice(word(1), len)? };
                let triangles: Vec<[u32; 3]> = bytes
                    .chunks_exact(12)
                    .map(|corners| [0, 4, 8].map(|at| u32_at(corners, at)))
                    .collect();
                (done(host.faces(&triangles)), bytes.len(), word(3))
            }
            _ => {
                return self
                    .next_batch(word(1), host)
                    .map(|(outcome, bytes)| (outcome, bytes, word(2)));
            }
        })
    }

    /// What an array of `Bytes` names.
    fn named_all(&self, at: u32, n: u32) -> Result<Vec<&[u8]>, Stop> {
        if n > MAX_NAMED {
            return Err(Stop::misbehaved(format!(
                "it named {n} columns, at most {MAX_NAMED} are taken"
            )));
        }
        let all = (0..n).map(|i| self.named(at.saturating_add(i * PAIR_LEN as u32)));
        let all = all.collect::<Result<Vec<_>, _>>()?;
        // The same bytes may be named many times, which would cost the host many times the module's memory.
        let total = all.iter().map(|bytes| bytes.len()).sum::<usize>();
        match total <= self.most_memory() {
            true => Ok(all),
            false => {
                Err(Stop::misbehaved(format!("it named {total} bytes, more than it may have")))
            }
        }
    }

    /// Writes to a channel of a sink of the module's own.
    fn tell(
        &mut self,
        sink: u32,
        (channel, bytes): (u32, &[u8]),
        pace: &mut Pace,
        host: &mut dyn Host,
        depth: u32,
    ) -> Result<(), Stop> {
        let (context, write) = self.pair(sink)?;
        if write == self.place_of(HostFunction::Write) {
            // The sink of the call, passed on.
            host.write(channel, bytes);
            return Ok(());
        }
        let mark = self.arena.mark();
        let at = self.lend(bytes)?;
        let named = self.lend(&Written::default().u32s([at, bytes.len() as u32]).bytes())?;
        let arguments = [context, channel, named].map(|word| Val::I32(word as i32));
        let [] = self.call((write, &arguments), pace, host, depth + 1)?;
        self.arena.release(&mark);
        Ok(())
    }

    /// Says to a module why it is refused; returns the status that goes with it.
    fn refuse(
        &mut self,
        line: &str,
        sink: u32,
        pace: &mut Pace,
        host: &mut dyn Host,
        depth: u32,
    ) -> Result<i32, Stop> {
        self.tell(sink, (channel::ERROR, shortened(line.as_bytes())), pace, host, depth)?;
        Ok(status::ERROR)
    }

    /// Runs a loop of the module, range by range; returns whether some were left out.
    fn parallel(
        &mut self,
        request: &Request,
        pace: &mut Pace,
        host: &mut dyn Host,
        depth: u32,
    ) -> Result<bool, Stop> {
        let (count, from, to) = (request.word(1), request.float(2), request.float(3));
        let (work, context) = (request.word(4), request.word(5));
        let mut start = 0;
        while start < count {
            if host.cancelled() {
                return Ok(true);
            }
            // However little is done in it.
            self.charge(0)?;
            let end = start.saturating_add(RANGE).min(count);
            let arguments = [context, start, end].map(|word| Val::I32(word as i32));
            let [] = self.call((work, &arguments), pace, host, depth + 1)?;
            host.progress(from + (to - from) * f64::from(end) / f64::from(count), b"");
            start = end;
        }
        Ok(false)
    }

    fn compute(
        &mut self,
        request: &Request,
        pace: &mut Pace,
        host: &mut dyn Host,
        depth: u32,
    ) -> Result<(Answer, usize), Stop> {
        let (at, n, sink) = (request.word(3), request.word(4), request.word(5));
        if n > MAX_NAMED {
            return Err(Stop::misbehaved(format!(
                "it named {n} buffers, at most {MAX_NAMED} are taken"
            )));
        }
        let buffers = if n == 0 { &[] } else { self.slice(at, 4 * n)? };
        let buffers: Vec<u32> = buffers.chunks_exact(4).map(|word| u32_at(word, 0)).collect();
        let (structure, data) = (self.named(request.word(1))?, self.named(request.word(2))?);
        let sent = structure.len() + data.len();
        let contents = match host.compute(structure, data, &buffers) {
            Ok(contents) => contents,
            Err(line) => {
                let status = self.refuse(&line, sink, pace, host, depth)?;
                return Ok((Some(Val::I32(status)), sent));
            }
        };
        for (channel, bytes) in (channel::BUFFERS..).zip(&contents) {
            self.tell(sink, (channel, bytes), pace, host, depth)?;
        }
        let bytes = sent + contents.iter().map(Vec::len).sum::<usize>();
        Ok((Some(Val::I32(status::OK)), bytes))
    }

    fn next_cloud(
        &mut self,
        sink: u32,
        pace: &mut Pace,
        host: &mut dyn Host,
        depth: u32,
    ) -> Result<(Answer, usize), Stop> {
        let status = match host.next_cloud() {
            Ok(None) => END,
            Ok(Some(header)) => {
                self.tell(sink, (HEADER_CHANNEL, &header), pace, host, depth)?;
                status::OK
            }
            Err(line) => self.refuse(&line, sink, pace, host, depth)?,
        };
        Ok((Some(Val::I32(status)), 0))
    }

    /// Copies the next points to where the last ones were, and stores the structure that names them.
    fn next_batch(
        &mut self,
        out: u32,
        host: &mut dyn Host,
    ) -> Result<(Result<i32, String>, usize), Stop> {
        let mut bytes = 0;
        let outcome = host.next_batch(&mut |points: &CloudView<'_>| {
            bytes = len_of(points);
            let at = match self.batch {
                Some((at, room)) if room >= bytes => at,
                _ => {
                    let at = self.room(bytes)?;
                    self.batch = Some((at, bytes));
                    at
                }
            };
            let named = self.put_cloud(points, at)?;
            self.put(out, &named)
        });
        let outcome = match outcome {
            Ok(taken) => Ok(if taken? { status::OK } else { END }),
            Err(line) => Err(line),
        };
        Ok((outcome, bytes))
    }
}
