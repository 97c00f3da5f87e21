use super::*;

#[test]
fn files_are_replaced_whole_and_nothing_else_is_left() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    write_whole(&path, b"first").unwrap();
    write_whole(&path, b"second").unwrap();
    let failed = replace(
        &path,
        |out| {
            out.write_all(b"third")?;
            Err(io::Error::other("no"))
        },
        |error| error,
    );
    assert!(failed.is_err());
    assert_eq!(read(&path, 6).unwrap(), b"second");
    assert!(matches!(read(&path, 5), Err(OpenFault::TooLong { most: 5, found: 6 })));
    assert_eq!(folder.path().read_dir().unwrap().count(), 1);
}

#[test]
fn whoever_locks_every_new_file_holds_nobody_up() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path().to_owned();
    let done = Arc::new(std::sync::atomic::AtomicBool::new(false));
    let is_done = done.clone();
    // Holds whatever appears.
    let other = std::thread::spawn(move || {
        let mut held = Vec::new();
        while !is_done.load(Ordering::Relaxed) {
            for found in at.read_dir().unwrap().flatten() {
                if let Ok(file) = File::open(found.path())
                    && file.try_lock().is_ok()
                {
                    held.push(file);
                }
            }
        }
    });
    for _ in 0..200 {
        write_whole(&folder.path().join("a"), b"whole").unwrap();
    }
    done.store(true, Ordering::Relaxed);
    other.join().unwrap();
    assert_eq!(read(&folder.path().join("a"), 5).unwrap(), b"whole");
}

#[test]
fn what_others_left_unfinished_is_removed_and_what_is_held_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at(".surfelshop-dead.part"), "half").unwrap();
    fs::write(at(".surfelshop-notes"), "a user's").unwrap();
    fs::write(at("scan.part"), "a user's").unwrap();
    let held = TemporaryFile::create(folder.path()).unwrap();
    assert!(!at(".surfelshop-dead.part").exists());
    write_whole(&at("a.ply"), b"whole").unwrap();
    assert!(held.path.exists());
    let held_path = held.path.clone();
    drop(held);
    assert!(!held_path.exists());
    let mut left: Vec<_> =
        folder.path().read_dir().unwrap().flatten().map(|found| found.file_name()).collect();
    left.sort();
    assert_eq!(left, [".surfelshop-notes", "a.ply", "scan.part"]);
}

#[cfg(unix)]
mod unix {
    use super::*;
    use std::os::unix::fs::{PermissionsExt as _, symlink};

    fn mode(path: &Path) -> u32 {
        path.metadata().unwrap().permissions().mode() & 0o777
    }

    fn pipe(path: &Path) {
        let made = std::process::Command::new("mkfifo").arg(path).status().unwrap();
        assert!(made.success());
    }

    #[test]
    fn new_files_have_the_usual_rights_and_replaced_ones_those_of_the_old() {
        let folder = tempfile::tempdir().unwrap();
        let (ours, usual) = (folder.path().join("a"), folder.path().join("b"));
        write_whole(&ours, b"").unwrap();
        fs::write(&usual, b"").unwrap();
        assert_eq!(mode(&ours), mode(&usual));
        fs::set_permissions(&ours, fs::Permissions::from_mode(0o600)).unwrap();
        write_whole(&ours, b"again").unwrap();
        assert_eq!((mode(&ours), fs::read(&ours).unwrap()), (0o600, b"again".to_vec()));
        fs::set_permissions(&ours, fs::Permissions::from_mode(0o444)).unwrap();
        let line = write_whole(&ours, b"more").unwrap_err().to_string();
        assert!(line.contains("write-protected"), "{line}");
    }

    #[test]
    fn links_stay_and_the_files_they_lead_to_are_replaced_or_made() {
        let folder = tempfile::tempdir().unwrap();
        let (link, file) = (folder.path().join("link"), folder.path().join("file"));
        symlink("file", &link).unwrap();
        for contents in [b"new", b"old"] {
            write_whole(&link, contents).unwrap();
            assert!(link.is_symlink());
            assert_eq!(fs::read(&file).unwrap(), contents);
        }
    }

    #[test]
    fn pipes_and_devices_are_neither_read_nor_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let (fifo, link) = (folder.path().join("fifo"), folder.path().join("link"));
        pipe(&fifo);
        symlink("/dev/null", &link).unwrap();
        for path in [&fifo, &link, Path::new("/dev/null")] {
            // Would wait for ever, were a pipe opened.
            assert!(matches!(read(path, 10), Err(OpenFault::NotAFile { .. })), "{path:?}");
            let line = write_whole(path, b"x").unwrap_err().to_string();
            assert!(line.contains("found a pipe or device"), "{line}");
            assert!(check_writable(path).is_err());
        }
        assert!(fifo.exists() && !fifo.is_file() && link.is_symlink());
    }
}
