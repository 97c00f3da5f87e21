//! Changes of plugin files are reported once, when the file is whole.

use crate::plugins::fixture::{PluginFolder, faulty_bytes, rival};
use std::fs::{self, File};
use std::io::Write;
use std::sync::mpsc::{self, Receiver};
use std::thread::sleep;
use std::time::{Duration, Instant};
use surfelshop_runtime::plugins::{Changed, Origin, Place, QUIET, SearchPath, Watcher};

/// Far longer than a change takes to be noticed, even by looking alone.
const LONG: Duration = Duration::from_secs(30);
/// Time in which a second report of one change would have come.
const AFTER: Duration = Duration::from_millis(1500);

fn watch(search: &SearchPath) -> (Watcher, Receiver<Changed>) {
    let (send, receive) = mpsc::channel();
    let watcher = Watcher::start(search, move |changed| drop(send.send(changed))).unwrap();
    (watcher, receive)
}

/// Invariant: a file is reported as changed once, when it is whole
#[test]
fn a_file_written_in_pieces_is_reported_once_when_it_is_whole() {
    let shelf = PluginFolder::with_good_plugin();
    let bytes = faulty_bytes();
    let path = shelf.put("subject", &bytes);
    let (_watcher, changes) = watch(&shelf.search());
    let mut file = File::create(&path).unwrap();
    let (mut written_at, mut longest_pause) = (Instant::now(), Duration::ZERO);
    for piece in bytes.chunks(bytes.len() / 6) {
        file.write_all(piece).unwrap();
        longest_pause = longest_pause.max(written_at.elapsed());
        written_at = Instant::now();
        sleep(QUIET / 8);
    }
    drop(file);
    let changed = loop {
        let changed = changes.recv_timeout(LONG).unwrap();
        assert_eq!((&changed.path, changed.exists), (&path, true));
        assert!(changed.debounce() >= QUIET);
        // Where this thread was held up for long, part of the file did stay the same.
        if longest_pause < QUIET / 2 || changed.settled_at > written_at + QUIET / 2 {
            break changed;
        }
    };
    assert!(changed.settled_at >= written_at + QUIET / 2, "it was reported while it was written");
    assert!(changes.recv_timeout(AFTER).is_err(), "it was reported twice");
}

#[test]
fn files_that_are_replaced_appear_or_go_are_reported() {
    let shelf = PluginFolder::with_good_plugin();
    let (watcher, changes) = watch(&shelf.search());
    let is_next = |stem: &str, exists: bool| {
        let changed = changes.recv_timeout(LONG).unwrap();
        assert_eq!((changed.path, changed.exists), (shelf.at(stem), exists));
    };
    fs::copy(rival(), shelf.path().join("unfinished")).unwrap();
    fs::rename(shelf.path().join("unfinished"), shelf.at("good")).unwrap();
    is_next("good", true);
    shelf.put("another", b"no plugin, but that is for others to say");
    is_next("another", true);
    fs::remove_file(shelf.at("good")).unwrap();
    is_next("good", false);
    shelf.put("good", b"back");
    is_next("good", true);
    fs::write(shelf.path().join("notes.txt"), "not a library").unwrap();
    assert!(changes.recv_timeout(AFTER).is_err());
    drop(watcher);
    shelf.put("good", b"nobody looks");
    assert!(changes.recv_timeout(LONG).is_err(), "the watch is over and its end of the line gone");
}

#[test]
fn places_that_do_not_exist_yet_are_watched_too() {
    let shelf = PluginFolder::new();
    let (folder, file) = (shelf.path().join("later"), shelf.at("single"));
    let (watcher, changes) = watch(&SearchPath::default());
    watcher.add(Place::new(&folder, Origin::UserFolder));
    watcher.add(Place::new(&file, Origin::CommandLine));
    fs::create_dir(&folder).unwrap();
    let inner = folder.join(file.file_name().unwrap());
    fs::write(&inner, "a").unwrap();
    assert_eq!(changes.recv_timeout(LONG).unwrap().path, inner);
    fs::write(&file, "a").unwrap();
    assert_eq!(changes.recv_timeout(LONG).unwrap().path, file);
}
