//! A look at a file reads its head, and its points only where the head does not say enough. Costs 1 s.

use crate::formats::stage::{Files, formats};
use std::io;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use surfelshop_api::columns::Values;
use surfelshop_api::format::{CloudHeader, CloudSinkHost, CloudSourceHost, FileHost};
use surfelshop_cloud::{
    FormatCall, Formats, Progress, ReadFault, ReadOptions, SharedSink, WriteFault, inspect,
};
use surfelshop_tests::clouds;

/// What went through formats.
#[derive(Default)]
struct Counts {
    bytes: AtomicU64,
    batches: AtomicU64,
    /// Columns of the widest batch.
    columns: AtomicU64,
}

/// The project's formats, counted.
#[derive(Default)]
struct Counted(Arc<Counts>);

struct CountedFile(Arc<dyn FileHost>, Arc<Counts>);

impl FileHost for CountedFile {
    fn length(&self) -> u64 {
        self.0.length()
    }

    fn read_at(&self, offset: u64, buffer: &mut [u8]) -> io::Result<usize> {
        let found = self.0.read_at(offset, buffer)?;
        self.1.bytes.fetch_add(found as u64, Ordering::Relaxed);
        Ok(found)
    }
}

struct CountedSink(SharedSink, Arc<Counts>);

impl CloudSinkHost for CountedSink {
    fn begin(&mut self, header: &CloudHeader) -> surfelshop_api::Result<bool> {
        self.0.lock().unwrap().begin(header)
    }

    fn batch(&mut self, values: &[Values<'_>]) -> surfelshop_api::Result<()> {
        self.1.batches.fetch_add(1, Ordering::Relaxed);
        self.1.columns.fetch_max(values.len() as u64, Ordering::Relaxed);
        self.0.lock().unwrap().batch(values)
    }

    fn faces(&mut self, triangles: &[[u32; 3]]) -> surfelshop_api::Result<()> {
        self.0.lock().unwrap().faces(triangles)
    }

    fn warn(&mut self, line: &str) {
        self.0.lock().unwrap().warn(line);
    }
}

impl Formats for Counted {
    fn by_bytes(&self, head: &[u8]) -> Option<String> {
        formats().by_bytes(head)
    }

    fn by_name(&self, name: &str, written: bool) -> Option<String> {
        formats().by_name(name, written)
    }

    fn takes_several(&self, id: &str) -> bool {
        formats().takes_several(id)
    }

    fn takes_grids(&self, id: &str) -> bool {
        formats().takes_grids(id)
    }

    fn beside(&self, id: &str) -> Vec<String> {
        formats().beside(id)
    }

    fn endings(&self, written: bool) -> Vec<String> {
        formats().endings(written)
    }

    fn read(
        &self,
        id: &str,
        file: Arc<dyn FileHost>,
        call: FormatCall<'_>,
        sink: SharedSink,
        progress: Progress<'_>,
    ) -> Result<(), ReadFault> {
        let file = Arc::new(CountedFile(file, Arc::clone(&self.0)));
        let sink = Arc::new(Mutex::new(CountedSink(sink, Arc::clone(&self.0))));
        formats().read(id, file, call, sink, progress)
    }

    fn write(
        &self,
        _id: &str,
        _clouds: Box<dyn CloudSourceHost + Send>,
        _file: Arc<dyn FileHost>,
        _call: FormatCall<'_>,
        _progress: Progress<'_>,
    ) -> Result<Vec<String>, WriteFault> {
        Err(WriteFault::Line("nothing is written here".to_owned()))
    }
}

const POINTS: usize = 100_000;

/// Invariant: to look at a file whose head says how many points it has and where reads no points
#[test]
fn heads_alone_are_read_where_they_say_enough() {
    let files = Files::new();
    let cloud = clouds::wavy_sphere(POINTS);
    for name in ["a.las", "a.laz", "a.e57", "a.sfl", "a.pcd", "a.xyz", "a.pts", "a.ptx"] {
        files.write(name, &cloud);
        let counted = Counted::default();
        let options = ReadOptions { formats: &counted, ..ReadOptions::default() };
        let contents = inspect(files.at(name), &options).unwrap();
        assert_eq!(contents.clouds.len(), 1, "{name}");
        let found = &contents.clouds[0];
        assert_eq!(found.n_points, POINTS as u64, "{name}");
        let [low, high] = found.bounds.unwrap();
        let (facts, off) = (cloud.facts(), 2e-3);
        assert!(low.abs_diff_eq(facts.bounds_min, off), "{name}: {low} to {high}");
        assert!(high.abs_diff_eq(facts.bounds_max, off), "{name}: {low} to {high}");
        let length = files.at(name).metadata().unwrap().len();
        let count = |count: &AtomicU64| count.load(Ordering::Relaxed);
        let (batches, bytes) = (count(&counted.0.batches), count(&counted.0.bytes));
        println!("{name}: {batches} batches, {bytes} of {length} bytes");
        // These say how many points there are and where.
        let says_all = ["a.las", "a.laz", "a.e57", "a.sfl"].contains(&name);
        assert_eq!(contents.points_read, !says_all, "{name}");
        if says_all {
            // Whether colours of an SFL file have opacity is known only when all were looked at.
            let most = if name == "a.sfl" { length } else { length / 20 };
            assert_eq!(batches, 0, "{name}");
            assert!(bytes < most, "{name}: {bytes} of {length} bytes were read");
        } else {
            assert!(batches > 0, "{name}");
            assert!(bytes <= 3 * length, "{name}: {bytes} of {length} bytes were read");
        }
    }
}

#[test]
fn looking_keeps_no_points_of_columns_that_nobody_asked_for() {
    let files = Files::new();
    files.write("a.pcd", &clouds::wavy_sphere(POINTS));
    let counted = Counted::default();
    let options = ReadOptions { formats: &counted, ..ReadOptions::default() };
    let contents = inspect(files.at("a.pcd"), &options).unwrap();
    // The header has all, the batches positions alone.
    assert!(contents.clouds[0].header.columns.len() > 1);
    assert_eq!(counted.0.columns.load(Ordering::Relaxed), 1);
}
