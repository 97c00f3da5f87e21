//! What a plugin writes during a call.

use super::fault::Fault;
use super::{MAX_DESCRIPTION_BYTES, MAX_ERROR_BYTES, MAX_OUTPUT_BYTES, MAX_STRUCTURE_BYTES};
use core::ffi::c_void;
use surfelshop_api::abi::table::{Bytes, Sink, channel, status};

/// Most bytes of what goes through a channel.
fn most(of: u32) -> usize {
    match of {
        channel::STRUCTURE => MAX_STRUCTURE_BYTES,
        channel::DESCRIPTION => MAX_DESCRIPTION_BYTES,
        _ => MAX_OUTPUT_BYTES,
    }
}

/// What a plugin wrote during one call.
#[derive(Default)]
pub(crate) struct Outputs {
    channels: Vec<(u32, Vec<u8>)>,
    total: usize,
    /// What was too much: so many bytes, where so many are taken.
    too_much: Option<(usize, usize)>,
}

impl Outputs {
    pub(super) fn sink(&mut self) -> Sink {
        unsafe extern "C" fn write(context: *mut c_void, channel: u32, bytes: Bytes) {
            // SAFETY: the context is the `Outputs` whose sink this is, alive for the call and
            // used by one thread at a time; the plugin lends the bytes for the call.
            let (outputs, bytes) = unsafe { (&mut *context.cast::<Outputs>(), bytes.as_slice()) };
            outputs.write(channel, bytes);
        }
        Sink { context: std::ptr::from_mut(self).cast(), write }
    }

    /// Takes a copy of what goes through a channel, within the limits.
    pub(crate) fn write(&mut self, channel: u32, bytes: &[u8]) {
        let bytes = match channel {
            channel::ERROR => &bytes[..bytes.len().min(MAX_ERROR_BYTES)],
            _ => bytes,
        };
        self.total = self.total.saturating_add(bytes.len());
        for (found, most) in [(bytes.len(), most(channel)), (self.total, MAX_OUTPUT_BYTES)] {
            if found > most {
                self.too_much.get_or_insert((found, most));
                return;
            }
        }
        self.channels.retain(|(other, _)| *other != channel);
        self.channels.push((channel, bytes.to_vec()));
    }

    pub(super) fn channel(&self, channel: u32) -> &[u8] {
        self.channels.iter().find(|(id, _)| *id == channel).map_or(&[], |(_, bytes)| bytes)
    }

    pub(super) fn take(&mut self, channel: u32) -> Vec<u8> {
        let found = self.channels.iter_mut().find(|(id, _)| *id == channel);
        found.map(|(_, bytes)| std::mem::take(bytes)).unwrap_or_default()
    }

    /// What was written, channel by channel.
    #[cfg(unix)]
    pub(crate) fn channels(&self) -> impl Iterator<Item = (u32, &[u8])> {
        self.channels.iter().map(|(channel, bytes)| (*channel, &bytes[..]))
    }

    /// The line on the error channel; empty where there is none.
    pub(super) fn line(&self) -> String {
        one_line(&String::from_utf8_lossy(self.channel(channel::ERROR)))
    }

    pub(crate) fn check(&self, status: i32) -> Result<(), Fault> {
        let line = || {
            let line = self.line();
            if line.is_empty() { "it gave no reason".to_owned() } else { line }
        };
        match status {
            status::OK => match self.too_much {
                None => Ok(()),
                Some((found, most)) => Err(Fault::Misbehaved(format!(
                    "it wrote {found} bytes where at most {most} are taken"
                ))),
            },
            status::ERROR => Err(Fault::Error(line())),
            status::PANIC => Err(Fault::Panic(line())),
            other => Err(Fault::Misbehaved(format!("it returned the unknown status {other}"))),
        }
    }
}

/// A text of a plugin as one line. Bytes of a file that it quotes may be any: they must not steer a terminal.
pub(crate) fn one_line(text: &str) -> String {
    let words = text.split_whitespace().collect::<Vec<_>>().join(" ");
    words.chars().map(|c| if c.is_control() { '?' } else { c }).collect()
}
