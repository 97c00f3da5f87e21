//! What is on the disk while a knob turns.

use super::*;
use surfelshop_session::options::explicit::parse;

/// What a run was, and which values were kept by then, with their numbers of runs.
type RunRecord = (String, Vec<(String, usize)>);

/// A bench that says which of its runs were on the disk whenever it was asked for another.
struct Clerk<'a> {
    folder: &'a Path,
    seen: Vec<RunRecord>,
}

impl Clerk<'_> {
    fn look(&mut self, what: String) {
        // What a report that is killed now finds when it goes on, in a folder of its own.
        let copy = tempfile::tempdir().unwrap();
        for name in ["cells.json", "cells.log"] {
            std::fs::copy(self.folder.join(name), copy.path().join(name)).unwrap();
        }
        let kept = ResultsFile::open(copy.path(), "key").unwrap();
        let found = |value: &&str| kept.cell("k", value);
        let cells = ["1", "2", "3"].iter().filter_map(found);
        self.seen.push((what, cells.map(|cell| (cell.value, cell.runs.len())).collect()));
    }
}

impl Bench for Clerk<'_> {
    fn first(&mut self, knob: &str, value: &str) -> Result<Cell, String> {
        self.look(format!("first {value}"));
        // The value is the seconds that it takes.
        let seconds: f64 = value.parse().unwrap();
        Ok(Cell::new(knob, value, &[("rmse", 0.5)], 1e3 * seconds))
    }

    fn again(&mut self, _knob: &str, value: &str) -> Result<Run, String> {
        self.look(format!("again {value}"));
        Ok(Run { wall_ms: 1.0, own_passes_ms: None, cpu_ms: None })
    }
}

fn turn(folder: &Path, options: &str) -> (Vec<Cell>, Vec<RunRecord>) {
    let line = format!("surfelshop report a.ply -t x -o out {options}");
    let line: Vec<&str> = line.split(' ').collect();
    let (arguments, _given) = parse::<ReportArguments>(&line).unwrap();
    let values = ["1", "2", "3"].map(str::to_owned).to_vec();
    let knob = Knob { id: "k".to_owned(), values };
    let mut clerk = Clerk { folder, seen: Vec::new() };
    let kept = ResultsFile::open(folder, "key").unwrap();
    let cells = sweep(&mut clerk, &knob, &arguments, &kept).unwrap();
    (cells, clerk.seen)
}

#[test]
fn every_run_is_on_the_disk_before_the_next_begins() {
    let folder = tempfile::tempdir().unwrap();
    let (cells, seen) = turn(folder.path(), "--repeats 2");
    assert_eq!(seen.len(), 9);
    for (i, (what, kept)) in seen.iter().enumerate() {
        let n_runs: usize = kept.iter().map(|(_, runs)| runs).sum();
        assert_eq!((kept.len(), n_runs), (i.min(3), i.saturating_sub(3)), "{what}");
    }
    let order: Vec<&str> = seen.iter().map(|(what, _)| what.as_str()).collect();
    assert_eq!(order[3..6], ["again 1", "again 2", "again 3"], "in turns");
    // Nothing is done twice; more repeats go on where these ended, each value warmed up before.
    let (same, seen) = turn(folder.path(), "--repeats 2");
    assert_eq!((same, seen.len()), (cells, 0));
    let (more, seen) = turn(folder.path(), "--repeats 3");
    assert_eq!(seen.len(), 6);
    assert!(more.iter().all(|cell| cell.runs.len() == 3), "{more:?}");
}

#[test]
fn values_behind_one_that_took_too_long_are_not_begun() {
    let folder = tempfile::tempdir().unwrap();
    for n_runs in [4, 0] {
        let (cells, seen) = turn(folder.path(), "--repeats 1 --longest 1.5");
        assert_eq!((cells.len(), seen.len()), (2, n_runs), "{seen:?}");
    }
    let (cells, seen) = turn(folder.path(), "--repeats 1 --longest 60");
    assert_eq!((cells.len(), seen.len()), (3, 2), "only the third is new: {seen:?}");
}

/// Invariant: a run that is measured takes as much to write however many there are
#[test]
fn a_run_takes_as_much_to_write_however_many_there_are() {
    let folder = tempfile::tempdir().unwrap();
    let kept = ResultsFile::open(folder.path(), "key").unwrap();
    let log = folder.path().join("cells.log");
    let length = || log.metadata().unwrap().len();
    let before = kept.n_whole_writes.get();
    let mut steps = Vec::new();
    for i in 0..3000u32 {
        let value = format!("{i:04}");
        let start = length();
        kept.put(Cell::new("k", &value, &[("rmse", 0.5)], 1.0));
        kept.store().unwrap();
        kept.add("k", &value, Ok(Run { wall_ms: 1.0, own_passes_ms: None, cpu_ms: None }));
        kept.store().unwrap();
        steps.push(length() - start);
    }
    assert_eq!(kept.n_whole_writes.get(), before, "nothing is written whole");
    assert!(steps.iter().all(|bytes| *bytes == steps[0]), "each takes as many bytes");
    // A line that a kill cut short is passed over; what stands before it is found.
    let mut text = std::fs::read(&log).unwrap();
    text.truncate(text.len() - 3);
    std::fs::write(&log, text).unwrap();
    let again = ResultsFile::open(folder.path(), "key").unwrap();
    assert_eq!(again.cell("k", "2998").unwrap().runs.len(), 1);
    assert_eq!(again.cell("k", "2999").unwrap().runs.len(), 0);
    // Lines of another key are not its own.
    assert!(ResultsFile::open(folder.path(), "another").unwrap().cell("k", "0000").is_none());
}

/// The time left follows from the share of these.
#[test]
fn what_is_known_is_no_run_to_come() {
    let folder = tempfile::tempdir().unwrap();
    let to_come = |n_repeats| {
        let values = ["1", "2", "3"].map(str::to_owned).to_vec();
        let kept = ResultsFile::open(folder.path(), "key").unwrap();
        n_runs_to_come(&Knob { id: "k".to_owned(), values }, n_repeats, &kept)
    };
    assert_eq!(to_come(2), 9);
    // The third takes too long and is not begun.
    let (_, seen) = turn(folder.path(), "--repeats 2 --longest 1.5");
    assert_eq!((seen.len(), to_come(2)), (6, 3));
    // More repeats: a warm-up and a run of each that is known.
    assert_eq!(to_come(3), 2 + 2 + 4);
}
