//! What commands read and write: nothing but regular files, nothing over what they read, and nothing is left
//! behind. Costs 15 s, most of it for pictures.

#![cfg(unix)]

use crate::cli::hostile::links::cc;
use crate::cli::program::{TestFolder, facing_front};
use std::fs;
use std::os::unix::fs::{PermissionsExt as _, symlink};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Far longer than anything here takes.
const LONG: Duration = Duration::from_secs(60);

fn desk() -> TestFolder {
    let desk = TestFolder::new();
    desk.put_cloud("one.ply", &[facing_front(0.0, 0.0, 0.5)]);
    desk
}

fn pipe(path: &Path) {
    assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
}

/// Runs a command that must not wait for anybody.
#[track_caller]
fn ended(desk: &TestFolder, arguments: &str) -> (Option<i32>, String) {
    let mut command = desk.command();
    command.args(arguments.split_whitespace()).stdin(Stdio::null()).stdout(Stdio::null());
    let mut child = command.stderr(Stdio::piped()).spawn().unwrap();
    let status = wait(&mut child, arguments);
    let mut said = String::new();
    std::io::Read::read_to_string(&mut child.stderr.take().unwrap(), &mut said).unwrap();
    (status, said)
}

#[track_caller]
fn wait(child: &mut Child, what: &str) -> Option<i32> {
    let started = Instant::now();
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            return status.code();
        }
        if started.elapsed() > LONG {
            child.kill().unwrap();
            panic!("it waits: {what}");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Invariant: nothing but regular files is read or replaced, and no command writes over what it
/// reads or writes
#[test]
fn a_graph_replaces_neither_what_is_read_nor_what_is_written() {
    let desk = desk();
    desk.put("a.scene.toml", "format = 1\n[[clouds]]\npath = 'one.ply'\n");
    fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/sky.hdr"), desk.at("sky.hdr"))
        .unwrap();
    desk.put("checks.wgsl", "fn pattern(p: Point) -> Material { return plain(p); }");
    let before = |name: &str| fs::read(desk.at(name)).unwrap();
    for (command, target) in [
        ("render one.ply -o y.png --save-graph one.ply", "one.ply"),
        ("render one.ply -o y.png --save-graph ./one.ply", "one.ply"),
        ("render a.scene.toml -o y.png --save-graph a.scene.toml", "a.scene.toml"),
        ("render a.scene.toml -o y.png --save-graph one.ply", "one.ply"),
        ("render one.ply --env sky.hdr -r environment -o y.png --save-graph sky.hdr", "sky.hdr"),
    ] {
        let old = before(target);
        desk.run(&format!("{command} --size 16")).failed(&[target, "the same command reads"]);
        assert!(before(target) == old && !desk.at("y.png").exists(), "{command}");
    }
    desk.run("render one.ply --size 16 -o y.png --save-graph y.png")
        .failed(&["y.png", "the same command writes already"]);
    desk.run("render one.ply --size 16 -o y.png -o y.png").failed(&["writes already"]);
    desk.put_cloud("two.ply", &[facing_front(0.0, 0.0, 0.5)]);
    desk.put("b.scene.toml", "format = 1\n[[clouds]]\npath = 'two.ply'\n");
    desk.run("bake b.scene.toml -t radii -o two.ply")
        .failed(&["two.ply", "the same command reads"]);
}

#[test]
fn what_is_no_regular_file_is_neither_waited_for_nor_replaced() {
    let desk = desk();
    pipe(&desk.at("p.scene.toml"));
    pipe(&desk.at("p.ply"));
    pipe(&desk.at("p.hdr"));
    pipe(&desk.at("p.png"));
    symlink("/dev/null", desk.at("null.png")).unwrap();
    symlink("/dev/null", desk.at("null.ply")).unwrap();
    for (command, name) in [
        ("info p.scene.toml", "p.scene.toml"),
        ("render p.scene.toml -o y.png", "p.scene.toml"),
        ("info p.ply", "p.ply"),
        ("info p.hdr", "p.hdr"),
        ("render one.ply --graph p.ply -o y.png", "p.ply"),
        ("render one.ply -o p.png", "p.png"),
        ("render one.ply -o null.png", "null.png"),
        ("convert one.ply p.ply", "p.ply"),
        ("convert one.ply null.ply", "null.ply"),
        ("bake one.ply -t radii -o null.ply", "null.ply"),
    ] {
        let (code, said) = ended(&desk, command);
        assert_eq!(code, Some(1), "{command}: {said}");
        assert!(said.starts_with("surfelshop: ") && said.contains(name), "{command}: {said}");
        assert_eq!(said.lines().count(), 1, "{command}: {said}");
    }
    for name in ["p.scene.toml", "p.ply", "p.hdr", "p.png"] {
        assert!(desk.at(name).exists() && !desk.at(name).is_file(), "{name}");
    }
    assert!(desk.at("null.png").is_symlink() && !Path::new("/dev/null").is_file());
}

#[test]
fn pipes_among_what_is_kept_for_the_next_start_are_passed_over() {
    let desk = desk();
    let command = "render one.ply -r environment --env sky -o y.png --size 16";
    desk.run(command).done();
    let before = fs::read(desk.at("y.png")).unwrap();
    let mut n_kept = 0;
    for found in fs::read_dir(desk.cache().join("surfelshop")).unwrap().flatten() {
        fs::remove_file(found.path()).unwrap();
        pipe(&found.path());
        n_kept += 1;
    }
    assert!(n_kept > 0, "nothing is kept");
    let (code, said) = ended(&desk, command);
    assert_eq!(code, Some(0), "{said}");
    assert!(fs::read(desk.at("y.png")).unwrap() == before);
}

#[test]
fn outputs_keep_the_rights_of_the_files_they_replace() {
    let desk = desk();
    let mode = |name: &str| desk.at(name).metadata().unwrap().permissions().mode() & 0o777;
    for (command, name) in
        [("render one.ply -o y.png --size 16", "y.png"), ("convert one.ply y.ply", "y.ply")]
    {
        desk.put(name, "old");
        fs::set_permissions(desk.at(name), fs::Permissions::from_mode(0o640)).unwrap();
        desk.run(command).done();
        assert_eq!(mode(name), 0o640, "{name}");
        fs::set_permissions(desk.at(name), fs::Permissions::from_mode(0o444)).unwrap();
        let old = fs::read(desk.at(name)).unwrap();
        desk.run(command).failed(&[name, "write-protected"]);
        assert!(fs::read(desk.at(name)).unwrap() == old);
    }
}

/// Invariant: names from files do not steer the terminal
#[test]
fn names_of_columns_do_not_steer_the_terminal() {
    let desk = TestFolder::new();
    desk.put(
        "esc.ply",
        "ply\nformat ascii 1.0\ncomment \u{1b}[31m\nelement vertex 1\nproperty float x\nproperty float \
         y\nproperty float z\nproperty float a\u{1b}]0;owned\u{7}\u{1b}[31mRED\nend_header\n0 0 0 1\n",
    );
    let name = "e\u{1b}[31m.ply";
    fs::copy(desk.at("esc.ply"), desk.at(name)).unwrap();
    for arguments in [
        vec!["info", "esc.ply"],
        vec!["info", name],
        vec!["info", "esc.ply", "--json"],
        vec!["convert", "esc.ply", "out.ply"],
        vec!["bake", "esc.ply", "-t", "radii", "-o", "out.ply"],
        vec!["explain", "esc.ply", "-r", "flat"],
        vec!["render", name, "-o", "y.png", "--size", "16"],
    ] {
        // A name that PLY files cannot have is refused where it would be written, in a line.
        let ended = desk.run_with(&arguments);
        assert!(ended.code == 0 || ended.stderr.contains("cannot be written"), "{ended:?}");
        let steers = |c: char| c.is_control() && c != '\n';
        let said = format!("{}{}", ended.stdout, ended.stderr);
        assert!(!said.contains(steers), "{arguments:?}: {}", said.escape_debug());
    }
    let told = desk.run("info esc.ply").done().stdout;
    assert!(told.contains(r"a\u{1b}]0;owned\u{7}\u{1b}[31mRED"), "{told}");
}

/// Waits until a file is being written in the desk's folder; `false` where the command was faster.
fn is_writing(desk: &TestFolder, child: &mut Child) -> bool {
    let started = Instant::now();
    while started.elapsed() < LONG {
        if desk.files().iter().any(|name| name.ends_with(".part")) {
            return true;
        }
        if child.try_wait().unwrap().is_some() {
            return false;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    panic!("nothing is written");
}

/// Invariant: a command that is ended leaves nothing unfinished, and the next one removes what a
/// killed one left
#[test]
fn a_command_that_is_ended_leaves_nothing_behind_and_what_was_killed_goes_with_the_next() {
    let desk = TestFolder::new();
    let surfels: Vec<_> = (0..200_000).map(|i| facing_front(i as f32, 0.0, 0.5)).collect();
    desk.put_cloud("in.ply", &surfels);
    desk.put("out.ply", "old");
    let mut n_ended = 0;
    for signal in ["-INT", "-TERM", "-HUP", "-KILL"] {
        let mut command = desk.command_of_a_terminal();
        command.args(["convert", "in.ply", "out.ply", "--ascii"]);
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        if !is_writing(&desk, &mut child) {
            continue;
        }
        let sent = Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
        assert!(sent.success());
        let code = wait(&mut child, signal);
        if code == Some(0) {
            // It was done before the signal arrived.
            desk.put("out.ply", "old");
            continue;
        }
        n_ended += 1;
        assert_eq!(fs::read(desk.at("out.ply")).unwrap(), b"old");
        if signal != "-KILL" {
            assert_eq!(code, Some(1), "{signal}");
            assert_eq!(desk.files(), ["in.ply", "out.ply"], "{signal}");
        }
    }
    assert!(n_ended > 0, "every command was done before it could be ended");
    // What the last one left is removed by whoever writes next.
    desk.put("tiny.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    desk.run("convert tiny.obj next.ply").done();
    assert_eq!(desk.files(), ["in.ply", "next.ply", "out.ply", "tiny.obj"]);
}

/// Runs a command after a line of the shell's, and sends it a signal once it is at work.
#[track_caller]
fn signalled(desk: &TestFolder, before: &str, arguments: &[&str], signal: &str) -> Option<i32> {
    let program = desk.command();
    let mut shell = Command::new("sh");
    shell.args(["-c", &format!("{before}; exec \"$@\""), "sh"]).arg(program.get_program());
    shell.args(arguments).current_dir(desk.at(""));
    let mut child = shell.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    if is_writing(desk, &mut child) {
        let sent = Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
        assert!(sent.success());
    }
    wait(&mut child, arguments[0])
}

#[test]
fn commands_that_were_started_to_outlive_a_hangup_do() {
    let desk = TestFolder::new();
    let surfels: Vec<_> = (0..100_000).map(|i| facing_front(i as f32, 0.0, 0.5)).collect();
    desk.put_cloud("in.ply", &surfels);
    // Whether a command looks at signals itself, as bake does, or leaves that to others.
    for command in [
        &["convert", "in.ply", "out.ply", "--ascii"][..],
        &["bake", "in.ply", "-t", "radii", "-o", "out.ply"],
    ] {
        assert_eq!(signalled(&desk, "trap '' HUP", command, "-HUP"), Some(0), "{command:?}");
        assert!(desk.at("out.ply").is_file());
        fs::remove_file(desk.at("out.ply")).unwrap();
    }
    // The other signals end it still.
    let ascii = ["convert", "in.ply", "out.ply", "--ascii"];
    let code = signalled(&desk, "trap '' HUP", &ascii, "-TERM");
    assert!(code == Some(1) || desk.at("out.ply").is_file(), "{code:?}");
}

#[test]
fn a_file_that_grows_beyond_the_limit_is_one_line_and_leaves_nothing() {
    let desk = TestFolder::new();
    let surfels: Vec<_> = (0..10_000).map(|i| facing_front(i as f32, 0.0, 0.5)).collect();
    desk.put_cloud("in.ply", &surfels);
    // In blocks of 512 bytes.
    let ended = desk.run_within("ulimit -f 200", &["convert", "in.ply", "out.ply", "--ascii"]);
    let said = ended.stderr;
    assert_eq!(ended.code, 1, "{said}");
    assert!(said.contains("out.ply") && said.lines().count() == 1, "{said}");
    assert_eq!(desk.files(), ["in.ply"]);
}

/// Invariant: a plugin that calls `exit`, or changes the folder of the program, is noticed
#[test]
fn plugins_that_end_the_program_or_leave_its_folder_are_noticed() {
    let desk = desk();
    for (name, does) in [("leaves", "chdir(\"/\")"), ("ends", "exit(0)")] {
        desk.put(
            &format!("{name}.c"),
            &format!(
                "#include \"rim.c\"\n#include <stdlib.h>\n#include <unistd.h>\n\
                 __attribute__((constructor)) static void run(void) {{ if ({does}) {{}} }}\n"
            )
            .replace("if (exit(0)) {}", "exit(0);"),
        );
        cc(&desk.at(&format!("{name}.c")), &desk.at(&format!("{name}.so")));
    }
    let command = "render one.ply -o y.png --size 16 -r rim-c --trust --plugin";
    desk.run(&format!("{command} leaves.so")).done();
    assert!(desk.at("y.png").is_file() && !Path::new("/y.png").exists());
    fs::remove_file(desk.at("y.png")).unwrap();
    fs::create_dir(desk.at("sub")).unwrap();
    desk.run(&format!("{} leaves.so", command.replace("y.png", "sub/y.png"))).done();
    assert!(desk.at("sub/y.png").is_file());
    let plugin = "--trust --plugin leaves.so";
    desk.run(&format!("compare one.ply -r flat -r rim-c -o sub/cmp --size 16 {plugin}")).done();
    assert!(desk.at("sub/cmp").is_dir() && !Path::new("/sub").exists());
    desk.run(&format!("{command} ends.so")).failed(&["ends.so", "calling exit()"]);
    assert!(!desk.at("y.png").exists());
}
