//! Signs of life of a format at work, and what it may not do without end.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};
use surfelshop_api::format::{FileBeside, FileHost};

/// A format may read a file so many times over, and so many bytes besides: small files are read in many passes.
const PASSES: u64 = 64;
const BESIDES: u64 = 4 << 30;

/// What is known of a format at work; shared between its threads and the host's.
pub(super) struct Watch {
    started: Instant,
    /// Time of the last sign of life since the start, milliseconds; `PAUSED` while the host itself is at work.
    last: AtomicU64,
    cancelled: AtomicBool,
    ended: AtomicBool,
    /// The bits of the share done, in [0, 1].
    fraction: AtomicU64,
    /// Bytes read, and the file's length.
    read: AtomicU64,
    length: AtomicU64,
}

const PAUSED: u64 = u64::MAX;

impl Watch {
    pub(super) fn new() -> Self {
        Self {
            started: Instant::now(),
            last: AtomicU64::new(0),
            cancelled: AtomicBool::new(false),
            ended: AtomicBool::new(false),
            fraction: AtomicU64::new(0),
            read: AtomicU64::new(0),
            length: AtomicU64::new(0),
        }
    }

    /// Takes a sign of life.
    pub(super) fn sign(&self) {
        let now = u64::try_from(self.started.elapsed().as_millis()).unwrap_or(PAUSED - 1);
        self.last.store(now, Ordering::Relaxed);
    }

    /// Until the next sign the host is at work.
    pub(super) fn pause(&self) {
        self.last.store(PAUSED, Ordering::Relaxed);
    }

    /// Time since the last sign of life.
    pub(super) fn silent_for(&self) -> Duration {
        match self.last.load(Ordering::Relaxed) {
            PAUSED => Duration::ZERO,
            last => self.started.elapsed().saturating_sub(Duration::from_millis(last)),
        }
    }

    /// Asks the format to stop.
    pub(super) fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    pub(super) fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }

    /// Refuses all that the format asks for from now on.
    pub(super) fn end(&self) {
        self.ended.store(true, Ordering::Relaxed);
    }

    /// # Errors
    /// Where the format was asked to stop, or is given up.
    pub(super) fn check(&self) -> surfelshop_api::Result<()> {
        let stops = self.is_cancelled() || self.ended.load(Ordering::Relaxed);
        if stops { Err(cancelled()) } else { Ok(()) }
    }

    /// Takes the share done; what is no number is passed over.
    pub(super) fn set(&self, fraction: f64) {
        if !fraction.is_nan() {
            self.fraction.store(fraction.clamp(0.0, 1.0).abs().to_bits(), Ordering::Relaxed);
        }
    }

    /// The share done: what the format tells, and where it does not, how much of the file it read.
    pub(super) fn fraction(&self) -> f64 {
        let told = f64::from_bits(self.fraction.load(Ordering::Relaxed));
        let length = self.length.load(Ordering::Relaxed);
        let read = self.read.load(Ordering::Relaxed);
        let read = if length > 0 { (read as f64 / length as f64).min(0.99) } else { 0.0 };
        told.max(read)
    }

    /// Why a format is given up that reads without end.
    pub(super) fn in_circles(&self) -> Option<String> {
        let (length, read) =
            (self.length.load(Ordering::Relaxed), self.read.load(Ordering::Relaxed));
        let most = length.saturating_mul(PASSES).saturating_add(BESIDES);
        (length > 0 && read > most)
            .then(|| format!("it read {read} bytes of a file of {length}: it reads in circles"))
    }
}

/// A file whose bytes are counted on their way to a format.
pub(super) struct WatchedFile {
    file: Arc<dyn FileHost>,
    watch: Arc<Watch>,
    /// The files beside it, and whether they were read.
    beside: Vec<(FileBeside, AtomicBool)>,
}

impl WatchedFile {
    pub(super) fn new(file: Arc<dyn FileHost>, watch: Arc<Watch>) -> Self {
        watch.length.store(file.length(), Ordering::Relaxed);
        let beside = file.beside().into_iter().map(|file| (file, AtomicBool::default())).collect();
        Self { file, watch, beside }
    }

    fn check(&self) -> io::Result<()> {
        self.watch.check().map_err(|error| io::Error::other(error.message().to_owned()))
    }
}

impl FileHost for WatchedFile {
    fn length(&self) -> u64 {
        self.file.length()
    }

    fn read_at(&self, offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
        self.check()?;
        let found = self.file.read_at(offset, buffer)?;
        let of = self.beside.partition_point(|(file, _)| file.at <= offset);
        if let Some((file, was_read)) = of.checked_sub(1).and_then(|of| self.beside.get(of))
            && !was_read.swap(true, Ordering::Relaxed)
        {
            self.watch.length.fetch_add(file.length, Ordering::Relaxed);
        }
        self.watch.read.fetch_add(found as u64, Ordering::Relaxed);
        // One that reads nothing again and again gives no sign of life.
        if found > 0 {
            self.watch.sign();
        }
        Ok(found)
    }

    fn write_at(&self, offset: u64, bytes: &[u8]) -> io::Result<()> {
        self.check()?;
        self.file.write_at(offset, bytes)?;
        self.watch.sign();
        Ok(())
    }

    fn beside(&self) -> Vec<FileBeside> {
        self.beside.iter().map(|(file, _)| file.clone()).collect()
    }
}

/// What an error of a call that was asked to stop says.
pub(super) fn cancelled() -> surfelshop_api::Error {
    surfelshop_api::Error::new(surfelshop_api::job::CANCELLED)
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Zeros(u64);

    impl FileHost for Zeros {
        fn length(&self) -> u64 {
            self.0
        }

        fn read_at(&self, _offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
            Ok(buffer.len())
        }
    }

    #[test]
    fn reads_are_signs_of_life_and_are_counted() {
        let watch = Arc::new(Watch::new());
        let file = WatchedFile::new(Arc::new(Zeros(1000)), Arc::clone(&watch));
        assert_eq!(file.read_at(0, &mut [0; 100]).unwrap(), 100);
        assert!((watch.fraction() - 0.1).abs() < 1e-9);
        watch.set(0.5);
        watch.set(f64::NAN);
        assert!((watch.fraction() - 0.5).abs() < 1e-9);
        assert_eq!(watch.in_circles(), None);
        watch.read.store(BESIDES + 65_000, Ordering::Relaxed);
        assert!(watch.in_circles().unwrap().contains("reads in circles"));
        watch.pause();
        assert_eq!(watch.silent_for(), Duration::ZERO);
        watch.end();
        assert!(file.read_at(0, &mut [0; 1]).is_err());
    }
}
