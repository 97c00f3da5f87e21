//! Libraries in processes of their own: what they make is the same, and what they do to their process they do to no other.
//!
//! Costs the compilation of some C files, small pictures, and a minute at most.

use crate::third_party::c::cc;
use crate::third_party::project::{folder, graph, request, root, surfelshop};
use glam::DVec3;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;
use std::time::{Duration, Instant};
use surfelshop_api::params::Values;
use surfelshop_api::{HostInfo, UnitKind};
use surfelshop_runtime::boundary::Fault;
use surfelshop_runtime::isolate::use_program;
use surfelshop_runtime::plugins::{
    LoadedUnit, Origin, Place, Registry, SearchPath, Timeouts, Trust,
};
use surfelshop_tests::octree::write_octree;
use surfelshop_tests::stage::build_folder;

/// The package of `rim.c`, and of `astray.c`.
const PACKAGE: &str = "org.example.rim-c";

/// `rim.c` with a fault of `astray.c`, or as it is; under a name of its own for each test, which compiles it.
fn library(fault: &str, test: &str) -> PathBuf {
    let astray = root().join("tests/program/third_party/astray.c");
    let library = folder(&format!("astray_{}_{test}.so", fault.to_lowercase()));
    let fault = format!("-DFAULT={fault}");
    cc(&astray, &library, &["-shared", "-fPIC", &fault]);
    library
}

/// Its renderer, which runs in a process of its own.
fn isolated(library: &Path, timeouts: &Timeouts) -> LoadedUnit {
    // This test is not the program.
    use_program(build_folder().join(format!("surfelshop{}", std::env::consts::EXE_SUFFIX)));
    let files = vec![Place::new(library, Origin::CommandLine)];
    let mut trust = Trust::everything();
    trust.isolate(PACKAGE);
    let registry = Registry::scan(&SearchPath { files, trust, ..SearchPath::default() });
    let unit = registry.find(UnitKind::Renderer, "rim-c").unwrap();
    assert!(unit.is_isolated());
    unit.load(timeouts).unwrap_or_else(|error| panic!("{error}"))
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Renders the sample with a library, with these words behind the command.
fn render(library: &Path, png: &Path, words: &[&str]) -> Output {
    drop(fs::remove_file(png));
    let sample = root().join("assets/sample.ply");
    let line = ["render", text(&sample), "-r", "rim-c", "--size", "96", "-o", text(png), "--trust"];
    surfelshop(&[&line[..], &["--plugin", text(library)], words].concat())
}

#[track_caller]
fn done(output: &Output) {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Invariant: a library in a process of its own draws the very picture that it draws in the program, whatever rounding
/// mode, locale and folder it chooses there, and what it prints is no result
#[test]
fn a_renderer_draws_the_same_picture_isolated() {
    let (plain, modes) = (library("0", "same"), library("MODES", "same"));
    let picture = |library: &Path, words: &[&str]| {
        let png = folder("isolated-same.png");
        let output = render(library, &png, words);
        done(&output);
        assert!(!String::from_utf8_lossy(&output.stdout).contains("no result"), "{output:?}");
        fs::read(png).unwrap()
    };
    let expected = picture(&plain, &[]);
    assert!(picture(&plain, &["--isolate", PACKAGE]) == expected, "by its package");
    assert!(picture(&plain, &["--isolate", text(&plain)]) == expected, "by its file");
    assert!(picture(&modes, &["--isolate", PACKAGE]) == expected, "with other modes");
}

/// Invariant: a crash, an abort, closed descriptors and an exit of an isolated library are one line of the command, which
/// exits as where any plugin fails, and leaves no half file
#[test]
fn whatever_ends_the_process_is_one_line_of_the_command() {
    for (fault, words) in [
        ("SEGFAULT", "its process ended: signal 11"),
        ("ABORT", "its process ended: signal 6"),
        ("CLOSE", "its connection to the program was closed"),
        ("EXIT", "its process ended: its code called exit, with 3"),
    ] {
        let png = folder("isolated-never.png");
        let output = render(&library(fault, "line"), &png, &["--isolate", PACKAGE]);
        let said = String::from_utf8_lossy(&output.stderr);
        let lines: Vec<&str> = said.lines().collect();
        let [line] = lines[..] else { panic!("{fault}: one line is expected: {said}") };
        assert!(line.contains(words) && line.contains(PACKAGE), "{fault}: {line}");
        assert_eq!(output.status.code(), Some(1), "{fault}: {output:?}");
        assert!(!png.exists(), "{fault}");
    }
}

/// Invariant: what an isolated library starts besides ends with its process, unless it leaves the group of that
#[test]
#[cfg(target_os = "linux")]
fn what_an_isolated_library_starts_ends_with_it() {
    let (named, library) = (folder("isolated-left.txt"), folder("astray_fork.so"));
    drop(fs::remove_file(&named));
    let astray = root().join("tests/program/third_party/astray.c");
    let left = format!("-DLEFT=\"{}\"", named.display());
    cc(&astray, &library, &["-shared", "-fPIC", "-DFAULT=FORK", &left]);
    done(&render(&library, &folder("isolated-fork.png"), &["--isolate", PACKAGE]));
    let left: u32 = fs::read_to_string(&named).unwrap().parse().unwrap();
    let started = Instant::now();
    // What has ended and was not waited for has no command line.
    while fs::read(format!("/proc/{left}/cmdline")).is_ok_and(|line| !line.is_empty()) {
        assert!(started.elapsed() < Duration::from_secs(30), "process {left} is left");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Invariant: where an isolated renderer is lost in the middle, other units of the same program go on and so does this one:
/// its next frame is asked for in another process
#[test]
fn other_units_go_on_after_a_crash() {
    let good = isolated(&library("0", "others"), &Timeouts::default());
    let expected = graph(&good, &Values::new()).unwrap();
    for fault in ["SEGFAULT", "ABORT", "CLOSE", "EXIT"] {
        let bad = isolated(&library(fault, "others"), &Timeouts::default());
        let mut hosted = bad.start(&HostInfo::default(), &Timeouts::default()).unwrap();
        for _ in 0..2 {
            let lost = hosted.frame(request(&Values::new())).unwrap_err();
            assert!(matches!(&lost, Fault::Panic(line) if !line.contains('\n')), "{lost:?}");
            assert!(hosted.given_up().is_none(), "a crash is an answer");
        }
        let next = graph(&good, &Values::new()).unwrap();
        assert!(next.structure == expected.structure && next.data == expected.data, "{fault}");
    }
}

/// A frame without end is given up after its deadline, and its process is killed: nothing is left at work. Costs
/// some seconds.
#[test]
#[cfg(target_os = "linux")]
fn a_deadline_ends_the_process() {
    let limits = Timeouts { frame: Duration::from_secs(1), ..Timeouts::default() };
    let library = library("ENDLESS", "deadline");
    let unit = isolated(&library, &limits);
    let mut hosted = unit.start(&HostInfo::default(), &limits).unwrap();
    let busy = || {
        let listing = fs::read_dir("/proc").unwrap().flatten();
        let maps = |found: &fs::DirEntry| {
            fs::read_to_string(found.path().join("maps")).unwrap_or_default()
        };
        let name = library.file_name().unwrap().to_str().unwrap();
        listing.filter(|found| maps(found).contains(name)).count()
    };
    assert_eq!(busy(), 1);
    let started = Instant::now();
    let fault = hosted.frame(request(&Values::new())).unwrap_err();
    assert!(matches!(fault, Fault::TimedOut(_)), "{fault:?}");
    while busy() > 0 {
        assert!(started.elapsed() < Duration::from_secs(20), "it is still at work");
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// Invariant: tools, formats and tracers make the same bytes in processes of their own
#[test]
fn tools_formats_and_tracers_make_the_same_bytes_isolated() {
    let sample = root().join("assets/sample.ply");
    for (package, line, ending) in [
        ("org.surfelshop.ambient-occlusion", "bake IN -t ambient-occlusion -o OUT", "ply"),
        ("org.surfelshop.las", "convert IN OUT", "las"),
        ("org.surfelshop.reference", "render IN -r reference --size 32 -o OUT", "png"),
    ] {
        let made = [false, true].map(|is_isolated| {
            let out = folder(&format!("isolated-{is_isolated}.{ending}"));
            drop(fs::remove_file(&out));
            let mut words: Vec<&str> = line.split(' ').collect();
            for word in &mut words {
                match *word {
                    "IN" => *word = text(&sample),
                    "OUT" => *word = text(&out),
                    _ => {}
                }
            }
            if is_isolated {
                words.extend(["--isolate", package]);
            }
            done(&surfelshop(&words));
            out
        });
        // The head of a baked cloud says when it was made.
        let bytes = |out: &PathBuf| {
            let bytes = fs::read(out).unwrap();
            let head = bytes.windows(11).position(|window| window == b"end_header\n");
            bytes[head.unwrap_or(0)..].to_vec()
        };
        let [native, isolated] = made.each_ref().map(bytes);
        assert!(native.len() > 500 && native == isolated, "{line}");
        if ending != "las" {
            continue;
        }
        let back = [&[][..], &["--isolate", package]].map(|words| {
            let back = folder("isolated-back.ply");
            done(&surfelshop(&[&["convert", text(&made[0]), text(&back)], words].concat()));
            fs::read(back).unwrap()
        });
        assert!(back[0] == back[1], "what was read differs");
    }
}

/// Invariant: files beside the one that is read cross into processes of their own. Cost: a second.
#[test]
fn files_beside_one_are_read_isolated() {
    let points: Vec<DVec3> =
        (0..600).map(|i| DVec3::new(f64::from(i % 30), f64::from(i / 30), 0.0)).collect();
    let octree = write_octree(&folder("isolated-town"), &points);
    let read = [&[][..], &["--isolate", "org.surfelshop.potree"]].map(|words| {
        let back = folder("isolated-town.ply");
        done(&surfelshop(&[&["convert", text(&octree), text(&back)], words].concat()));
        fs::read(back).unwrap()
    });
    assert!(read[0].len() > 10_000 && read[0] == read[1], "what was read differs");
}

/// What is to be isolated and is not there is refused, and what is remembered is isolated at the next start: a crash is a
/// line then.
#[test]
fn isolation_is_remembered_and_slips_are_refused() {
    let (library, png) = (library("SEGFAULT", "remembered"), folder("isolated-list.png"));
    let output = render(&library, &png, &["--isolate", "org.example.rim"]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.code() == Some(1) && said.contains("--isolate org.example.rim:"),
        "{said}"
    );
    let list = folder("isolated.toml");
    drop(fs::remove_file(&list));
    let named = ["--trust-file", text(&list)];
    done(&surfelshop(&[&["plugins", "isolate", PACKAGE], &named[..]].concat()));
    let told = surfelshop(&[&["plugins", "--plugin", text(&library)], &named[..]].concat());
    let told = String::from_utf8_lossy(&told.stdout).into_owned();
    assert!(told.contains("runs      in a process of its own"), "{told}");
    let output = render(&library, &png, &named);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(1) && said.contains("signal 11"), "{said}");
    done(&surfelshop(&[&["plugins", "isolate", text(&library), "--undo"], &named[..]].concat()));
    assert_eq!(render(&library, &png, &named).status.code(), None, "a signal ends the program");
}
