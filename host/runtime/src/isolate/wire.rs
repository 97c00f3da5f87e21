//! Messages through a socket: a head, and parts of any bytes.
//!
//! ```text
//! u32  length of the head
//! u32  number of parts
//! u64  length of each part
//! ...  head, parts
//! ```

use serde::Serialize;
use serde::de::DeserializeOwned;
use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::net::UnixStream;

/// Most bytes of a head, and most parts.
const MOST_HEAD: u32 = 1 << 20;
const MOST_PARTS: u32 = 1 << 14;
/// What is asked for at once of the memory that a length announces.
const STEP: usize = 16 << 20;
/// Messages up to this length are sent in one piece.
const SHORT: usize = 1 << 16;

/// Why there is no message, or it was not sent.
#[derive(Debug)]
pub(super) enum Cut<E> {
    /// The other side is gone, or says what cannot be read.
    Closed(String),
    /// Whoever waited does so no longer.
    Stopped(E),
}

/// Bytes at an address that is a multiple of 8.
#[derive(Debug, Default)]
pub(super) struct Part {
    words: Vec<u64>,
    len: usize,
}

impl Part {
    pub(super) fn bytes(&self) -> &[u8] {
        &bytemuck::cast_slice(&self.words)[..self.len]
    }
}

/// A message that was received.
#[derive(Debug)]
pub(super) struct Message {
    head: Vec<u8>,
    pub(super) parts: Vec<Part>,
}

impl Message {
    /// What its head says.
    pub(super) fn head<T: DeserializeOwned, E>(&self) -> Result<T, Cut<E>> {
        rmp_serde::from_slice(&self.head)
            .map_err(|error| Cut::Closed(format!("what it says is unreadable: {error}")))
    }

    /// A part by its position; no bytes where there is none.
    pub(super) fn part(&self, i: usize) -> &[u8] {
        self.parts.get(i).map_or(&[], Part::bytes)
    }
}

/// One end of the connection between a program and a process of it.
#[derive(Debug)]
pub(super) struct Wire {
    socket: UnixStream,
}

impl Wire {
    pub(super) fn new(socket: UnixStream) -> Self {
        Self { socket }
    }

    /// Lets the other side know that nothing will follow.
    pub(super) fn close(&self) {
        // Where the other side is gone there is nothing to close.
        drop(self.socket.shutdown(std::net::Shutdown::Both));
    }

    /// Sends a message. Whenever the socket's timeout passes, `wait` is asked whether to go on.
    pub(super) fn send<E>(
        &mut self,
        head: &impl Serialize,
        parts: &[&[u8]],
        wait: &mut dyn FnMut() -> Result<(), E>,
    ) -> Result<(), Cut<E>> {
        let head = rmp_serde::to_vec(head).map_err(|error| Cut::Closed(error.to_string()))?;
        let mut start = Vec::with_capacity(16 + head.len());
        start.extend((head.len() as u32).to_le_bytes());
        start.extend((parts.len() as u32).to_le_bytes());
        start.extend(parts.iter().flat_map(|part| (part.len() as u64).to_le_bytes()));
        start.extend(head);
        let total = parts.iter().map(|part| part.len()).sum::<usize>();
        if total <= SHORT {
            parts.iter().for_each(|part| start.extend(*part));
            return self.write(&start, wait);
        }
        self.write(&start, wait)?;
        parts.iter().try_for_each(|part| self.write(part, wait))
    }

    /// Waits for a message. Whenever the socket's timeout passes, `wait` is asked whether to go on.
    pub(super) fn receive<E>(
        &mut self,
        wait: &mut dyn FnMut() -> Result<(), E>,
    ) -> Result<Message, Cut<E>> {
        let mut start = [0; 8];
        self.fill(&mut start, wait)?;
        let [head, parts] = [0, 4].map(|at| {
            start[at..].first_chunk().map_or(0, |word: &[u8; 4]| u32::from_le_bytes(*word))
        });
        if head > MOST_HEAD || parts > MOST_PARTS {
            return Err(Cut::Closed("what it says is no message".to_owned()));
        }
        let mut lengths = vec![0; 8 * parts as usize];
        self.fill(&mut lengths, wait)?;
        let mut bytes = vec![0; head as usize];
        self.fill(&mut bytes, wait)?;
        let lengths = lengths.as_chunks().0.iter().map(|length| u64::from_le_bytes(*length));
        let parts = lengths.map(|length| self.part(length, wait)).collect::<Result<_, _>>()?;
        Ok(Message { head: bytes, parts })
    }

    fn part<E>(
        &mut self,
        len: u64,
        wait: &mut dyn FnMut() -> Result<(), E>,
    ) -> Result<Part, Cut<E>> {
        let no_memory = || Cut::Closed(format!("there is no memory for {len} bytes of it"));
        let len = usize::try_from(len).map_err(|_beyond| no_memory())?;
        let mut part = Part::default();
        while part.len < len {
            let step = (len - part.len).min(STEP);
            let words = (part.len + step).div_ceil(8);
            let more = words - part.words.len();
            part.words.try_reserve(more).map_err(|_out| no_memory())?;
            part.words.resize(words, 0);
            let all = bytemuck::cast_slice_mut(&mut part.words);
            self.fill(&mut all[part.len..part.len + step], wait)?;
            part.len += step;
        }
        Ok(part)
    }

    fn fill<E>(
        &mut self,
        mut bytes: &mut [u8],
        wait: &mut dyn FnMut() -> Result<(), E>,
    ) -> Result<(), Cut<E>> {
        while !bytes.is_empty() {
            match self.socket.read(bytes) {
                Ok(0) => return Err(Cut::Closed("it closed its connection".to_owned())),
                Ok(n) => bytes = &mut bytes[n..],
                Err(error) => waited(&error, wait)?,
            }
        }
        Ok(())
    }

    fn write<E>(
        &mut self,
        mut bytes: &[u8],
        wait: &mut dyn FnMut() -> Result<(), E>,
    ) -> Result<(), Cut<E>> {
        while !bytes.is_empty() {
            match self.socket.write(bytes) {
                Ok(n) => bytes = &bytes[n..],
                Err(error) => waited(&error, wait)?,
            }
        }
        Ok(())
    }
}

/// Whether an error says only that nothing happened for a while, and whoever waits does so on.
fn waited<E>(error: &io::Error, wait: &mut dyn FnMut() -> Result<(), E>) -> Result<(), Cut<E>> {
    match error.kind() {
        ErrorKind::Interrupted => Ok(()),
        ErrorKind::WouldBlock | ErrorKind::TimedOut => wait().map_err(Cut::Stopped),
        _ => Err(Cut::Closed("it closed its connection".to_owned())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    fn forever() -> Result<(), ()> {
        Ok(())
    }

    #[test]
    fn messages_arrive_as_they_were_sent_and_aligned() {
        let (here, there) = UnixStream::pair().unwrap();
        let (mut here, mut there) = (Wire::new(here), Wire::new(there));
        let long = vec![7; 3 * STEP + 5];
        let sender = std::thread::spawn(move || {
            here.send(&("head", 1.5), &[b"abc", b"", &long], &mut forever).unwrap();
        });
        let message = there.receive(&mut forever).unwrap();
        sender.join().unwrap();
        assert_eq!(message.head::<(String, f64), ()>().unwrap(), ("head".to_owned(), 1.5));
        assert_eq!((message.part(0), message.part(1)), (&b"abc"[..], &b""[..]));
        assert_eq!(message.part(2).len(), 3 * STEP + 5);
        assert!(message.part(2).iter().all(|byte| *byte == 7));
        assert_eq!(message.part(2).as_ptr().align_offset(8), 0);
        assert!(there.receive(&mut forever).is_err(), "nobody is there any more");
    }

    #[test]
    fn lies_in_lengths_take_no_memory_and_silence_is_not_waited_for() {
        let (mut here, there) = UnixStream::pair().unwrap();
        there.set_read_timeout(Some(Duration::from_millis(10))).unwrap();
        let mut there = Wire::new(there);
        let stop = |n: &mut u32| {
            *n += 1;
            if *n < 3 { Ok(()) } else { Err("enough") }
        };
        let mut n = 0;
        here.write_all(&[1, 0, 0, 0, 1, 0, 0, 0]).unwrap();
        here.write_all(&(u64::MAX / 2).to_le_bytes()).unwrap();
        here.write_all(&[0, 1, 2, 3]).unwrap();
        let cut = there.receive(&mut || stop(&mut n));
        assert!(matches!(cut, Err(Cut::Stopped("enough"))), "{cut:?}");
        here.write_all(&[255; 8]).unwrap();
        let cut = there.receive(&mut forever);
        assert!(matches!(&cut, Err(Cut::Closed(line)) if line.contains("no message")), "{cut:?}");
    }
}
