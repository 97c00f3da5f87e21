//! Bakes, and runs of several commands, that are ended from outside or run out of room: what stood there before still does.

#![cfg(unix)]

use crate::cli::bake::{OLD, assert_untouched, desk, faulty};
use crate::cli::program::TestFolder;
use std::io::Read as _;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::RecvTimeoutError;
use std::time::Duration;

/// Far longer than anything here takes.
const LONG: Duration = Duration::from_secs(60);

/// A bake that is about to run.
fn bake(desk: &TestFolder, arguments: &str) -> Command {
    let mut command = desk.command_of_a_terminal();
    command.args(["bake", "in.ply", "-o", "out.ply", "--trust", "--plugin", &faulty()]);
    command.args(arguments.split_whitespace());
    let log = "off,surfelshop::bake=debug,surfelshop_session::tool_run=debug";
    command.env("SURFELSHOP_LOG", log);
    command.stdout(Stdio::null()).stderr(Stdio::piped());
    command
}

fn send(signal: &str, id: u32) {
    let sent = Command::new("kill").args([signal, &id.to_string()]).status().unwrap();
    assert!(sent.success());
}

/// Waits until a bake says that it has come so far, and sends it a signal.
fn signal_when(child: &mut Child, says: &str, signal: &str) {
    let mut said = Vec::new();
    let id = child.id();
    // Reading waits for as long as nothing is said, so somebody else looks at the clock.
    let (heard, hears) = std::sync::mpsc::channel::<()>();
    let clock = std::thread::spawn(move || {
        let is_late = hears.recv_timeout(LONG) == Err(RecvTimeoutError::Timeout);
        is_late.then(|| send("-KILL", id));
    });
    let stderr = child.stderr.as_mut().unwrap();
    while !String::from_utf8_lossy(&said).contains(says) {
        let mut byte = [0];
        let n_read = stderr.read(&mut byte).unwrap();
        assert!(n_read > 0, "it ended: {}", String::from_utf8_lossy(&said));
        said.extend(byte);
    }
    drop(heard);
    clock.join().unwrap();
    send(signal, id);
}

/// How a bake ended and what it said last.
fn end(mut child: Child) -> (ExitStatus, String) {
    let id = child.id();
    let (ended, ends) = std::sync::mpsc::channel::<()>();
    let clock = std::thread::spawn(move || {
        // What does not end on its signal does not keep the tests.
        let is_late = ends.recv_timeout(LONG) == Err(RecvTimeoutError::Timeout);
        is_late.then(|| send("-KILL", id));
    });
    let mut said = String::new();
    child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
    drop(ended);
    clock.join().unwrap();
    (child.wait().unwrap(), said.lines().last().unwrap_or_default().to_owned())
}

#[test]
fn a_tool_is_cancelled_and_nothing_is_written() {
    for signal in ["-INT", "-TERM"] {
        let desk = desk(10);
        let mut child = bake(&desk, "-t works-slowly --set items=1000000").spawn().unwrap();
        signal_when(&mut child, "works-slowly", signal);
        let (status, said) = end(child);
        assert_eq!(status.code(), Some(1), "{said}");
        assert_eq!(said, "surfelshop: cancelled; out.ply was not written");
        assert_untouched(&desk);
    }
}

/// A command that runs several looks at requests only while a bake does. Costs 1 s.
///
/// Invariant: a run of the papers that is asked to end writes no pages, and counts nothing as failed
#[test]
fn papers_end_when_they_are_asked_to_and_write_no_page() {
    for signal in ["-INT", "-TERM"] {
        let folder = TestFolder::new();
        let mut command = folder.command_of_a_terminal();
        command.args(["papers", "thesis", "-o", "page", "--size", "40", "--samples", "4"]);
        command
            .env("SURFELSHOP_LOG", "off,surfelshop::bake=debug,surfelshop_session::tool_run=debug");
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        signal_when(&mut child, "writing", signal);
        let printed = child.stdout.take().unwrap();
        let (status, said) = end(child);
        assert_eq!(status.code(), Some(1), "{said}");
        assert!(said.starts_with("surfelshop: cancelled"), "{said}");
        let printed = std::io::read_to_string(printed).unwrap();
        assert!(!printed.contains("failed: "), "{printed}");
        assert!(!std::path::Path::new(&folder.at("page/index.html")).exists());
    }
}

#[test]
fn a_tool_that_does_not_stop_does_not_keep_the_program() {
    let desk = desk(10);
    let mut child = bake(&desk, "-t ignores-cancel --patience 2").spawn().unwrap();
    signal_when(&mut child, "ignores-cancel", "-INT");
    let (status, said) = end(child);
    assert_eq!(status.code(), Some(1), "{said}");
    assert!(said.contains("did not stop within 2 s and was left behind"), "{said}");
    assert_untouched(&desk);
}

#[test]
fn a_killed_bake_leaves_the_old_file() {
    let desk = desk(10);
    let mut child = bake(&desk, "-t works-slowly --set items=1000000").spawn().unwrap();
    signal_when(&mut child, "works-slowly", "-KILL");
    assert_eq!(end(child).0.code(), None);
    assert_untouched(&desk);
}

#[test]
fn a_bake_ended_while_it_writes_leaves_the_old_file() {
    for signal in ["-INT", "-TERM", "-KILL"] {
        let desk = desk(400_000);
        let mut child = bake(&desk, "-t stages-ao").spawn().unwrap();
        signal_when(&mut child, "writing", signal);
        let (status, said) = end(child);
        let found = std::fs::read_to_string(desk.at("out.ply"));
        // The signal may arrive when the file is there already; what is killed then has not said so.
        let info = desk.run("info out.ply --json");
        let is_whole = info.code == 0 && info.json()["clouds"][0]["n_points"] == 400_000;
        if status.success() || (signal == "-KILL" && is_whole) {
            assert!(is_whole, "{said}");
            continue;
        }
        assert_eq!(found.unwrap(), OLD, "{said}");
        // Only what cannot clean up may leave its unfinished file, which has another name.
        let files = desk.files().into_iter().filter(|name| !name.ends_with(".part"));
        assert_eq!(files.collect::<Vec<_>>(), ["in.ply", "out.ply"]);
        if signal != "-KILL" {
            assert_untouched(&desk);
        }
    }
}

#[test]
fn a_file_that_does_not_fit_is_one_line() {
    let desk = desk(200_000);
    let bake = bake(&desk, "-t stages-ao");
    // Smaller than the result, and larger than the plugin's copy. The signal that would end the
    // program is turned into an error as a full disk is.
    let mut shell = Command::new("sh");
    shell.arg("-c").arg("trap '' XFSZ; ulimit -f 8192; exec \"$@\"").arg("sh");
    shell.arg(bake.get_program()).args(bake.get_args()).current_dir(desk.at(""));
    let variables = bake.get_envs().filter_map(|(name, value)| Some((name, value?)));
    shell.envs(variables).env_remove("SURFELSHOP_LOG");
    let output = shell.output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(said.starts_with("surfelshop: out.ply: cannot be written: "), "{said}");
    assert_untouched(&desk);
}
