//! The window on a screen: the real program under Xvfb, used with mouse and keys.

#![cfg(target_os = "linux")]
use image::imageops::{FilterType, resize};
use std::ffi::OsStr;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};
use surfelshop_tests::screen::{PATIENCE, Program, Screen};
use surfelshop_tests::stage::build_folder;

const SAMPLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/sample.ply");

/// The screen's size, pixels.
const SCREEN: [u32; 2] = [1280, 800];

fn golden(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("golden").join(format!("{name}.png"))
}

/// Compares half the screen's resolution with a stored picture, times and messages aside:
/// captions with milliseconds, the list of passes and the adapter's name differ from run to run
/// and make up about a twentieth of the picture. `SURFELSHOP_BLESS=1` stores it anew.
#[track_caller]
fn looks_like(screen: &Screen, name: &str) {
    // On a busy machine the coarse picture of a motion is replaced late.
    const LATEST: Duration = Duration::from_secs(20);
    let started = Instant::now();
    let path = golden(name);
    if std::env::var_os("SURFELSHOP_BLESS").is_some() {
        // What is stored must be the last picture.
        std::thread::sleep(Duration::from_secs(8));
    }
    let (found, share) = loop {
        let found = resize(&screen.picture(), SCREEN[0] / 2, SCREEN[1] / 2, FilterType::Triangle);
        if std::env::var_os("SURFELSHOP_BLESS").is_some() {
            found.save(&path).unwrap();
        }
        let stored = image::open(&path).unwrap().into_rgb8();
        assert_eq!(found.dimensions(), stored.dimensions());
        let far = |(a, b): (&image::Rgb<u8>, &image::Rgb<u8>)| {
            a.0.iter().zip(b.0).any(|(a, b)| a.abs_diff(b) > 40)
        };
        let differ = found.pixels().zip(stored.pixels()).filter(|pair| far(*pair)).count();
        let share = differ as f64 / f64::from(found.width() * found.height());
        if share < 0.01 || started.elapsed() > LATEST {
            break (found, share);
        }
        std::thread::sleep(Duration::from_millis(250));
    };
    println!("{name}: {:.2} % of the pixels differ by more than 40 levels", 100.0 * share);
    if share >= 0.01 {
        let beside = std::env::temp_dir().join(format!("surfelshop-{name}.png"));
        found.save(&beside).unwrap();
        panic!("{name} looks different: {:.1} %, see {}", 100.0 * share, beside.display());
    }
}

#[test]
fn a_session_with_mouse_and_keys() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("session.scene.toml");
    let sample = Path::new(SAMPLE).canonicalize().unwrap();
    std::fs::write(&scene, format!("format = 1\n[[clouds]]\npath = '{}'\n", sample.display()))
        .unwrap();
    let screen = Screen::start(SCREEN);
    let mut program = Program::start(&screen, &scene, folder.path());
    program.picture(0, "ewa-phong");
    // Without a window manager nobody gives the keyboard to the window.
    screen.xdotool("search --sync --onlyvisible --name Surfelshop windowfocus");
    screen.xdotool("mousemove 800 400");
    program.drag_to_picture([900, 600], [820, 580], "ewa-phong");
    // How far a drag turns depends on when its events arrive; this view does not.
    program.key("0");
    std::thread::sleep(Duration::from_secs(1));
    program.key("f");
    program.picture(0, "ewa-phong");
    std::thread::sleep(Duration::from_millis(500));
    looks_like(&screen, "window-single");

    for renderer in
        ["flat", "global-illumination", "phong-splatting", "procedural", "environment", "ewa-phong"]
    {
        program.key("r");
        program.picture(0, renderer);
    }
    program.key("n");
    program.picture(1, "ewa-phong");
    screen.xdotool("mousemove 400 500 click 1");
    // A key of the same frame would still be for the new view.
    std::thread::sleep(Duration::from_secs(1));
    program.key("alt+3");
    program.picture(0, "flat");
    std::thread::sleep(Duration::from_millis(500));
    looks_like(&screen, "window-wipe");

    // The second slider of the panel is `specular`.
    program.drag([1095, 231], [1130, 231]);
    program.picture(0, "ewa-phong");
    program.key("ctrl+s");
    wait_for(&scene, |text| text.contains("specular") && text.contains("wipe"));
    program.key("ctrl+z");
    program.picture(0, "ewa-phong");
    program.key("ctrl+s");
    wait_for(&scene, |text| !text.contains("specular"));
    program.key("ctrl+q");
    program.ends_well();
}

/// Invariant: being asked to end is no crash
#[test]
fn a_request_to_end_closes_the_window_and_is_no_crash() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("hangs.scene.toml");
    let sample = Path::new(SAMPLE).canonicalize().unwrap();
    let renderer = "org.surfelshop.test.faulty/hangs-in-frame";
    let text = format!(
        "format = 1\n[[clouds]]\npath = '{}'\n[[views]]\nrenderer = '{renderer}'\n",
        sample.display()
    );
    std::fs::write(&scene, text).unwrap();
    let library = format!("{}faulty{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let library = build_folder().join("examples").join(library);
    assert!(library.is_file(), "{} is not built; `cargo verify` builds it", library.display());
    let screen = Screen::start(SCREEN);
    let mut arguments = ["--patience", "100", "--trust", "--plugin"].map(OsStr::new).to_vec();
    arguments.extend([library.as_os_str(), scene.as_os_str()]);
    let mut program = Program::start_with(&screen, &arguments, folder.path(), &[]);
    // The renderer is at its first picture once its mark stands.
    let marks = folder.path().join("surfelshop/at-work");
    let n_marks = || marks.read_dir().map_or(0, Iterator::count);
    let started = Instant::now();
    while n_marks() == 0 {
        assert!(started.elapsed() < PATIENCE, "no mark in {}", marks.display());
        std::thread::sleep(Duration::from_millis(50));
    }
    let id = program.child.id().to_string();
    assert!(Command::new("kill").args(["-TERM", &id]).status().unwrap().success());
    program.ends_well();
    assert_eq!(n_marks(), 0, "the next start would take this for a crash");
}

/// Invariant: without a desktop files are chosen all the same
#[test]
fn without_a_desktop_files_are_chosen_in_a_dialog_of_the_programs_own() {
    let folder = tempfile::tempdir().unwrap();
    let sample = Path::new(SAMPLE).canonicalize().unwrap();
    let scene = |name: &str, renderer: &str| {
        let path = folder.path().join(name);
        let text = format!(
            "format = 1\n[[clouds]]\npath = '{}'\n[[views]]\nrenderer = '{renderer}'\n",
            sample.display()
        );
        std::fs::write(&path, text).unwrap();
        path
    };
    let (first, second) = (scene("a.scene.toml", "ewa-phong"), scene("b.scene.toml", "flat"));
    // What is wrong with it is said once, however often the list is read.
    std::fs::create_dir(folder.path().join("surfelshop")).unwrap();
    std::fs::write(folder.path().join("surfelshop/trust.toml"), "no list").unwrap();
    let screen = Screen::start(SCREEN);
    let mut program = Program::start(&screen, &first, folder.path());
    program.picture(0, "ewa-phong");
    screen.xdotool("search --sync --onlyvisible --name Surfelshop windowfocus");
    screen.xdotool("mousemove 800 400");
    program.key("ctrl+o");
    program.said(&["a file dialog of the program's own"]);
    std::thread::sleep(Duration::from_millis(500));
    screen.xdotool(&format!("type {}", second.display()));
    program.key("Return");
    program.picture(0, "flat");
    let n_warnings = program.seen.iter().filter(|line| line.contains("trust.toml")).count();
    assert_eq!(n_warnings, 1, "{:?}", program.seen);
    program.key("ctrl+q");
    program.ends_well();
}

/// Waits until a file says something.
#[track_caller]
fn wait_for(path: &Path, holds: impl Fn(&str) -> bool) {
    let started = Instant::now();
    loop {
        let mut text = String::new();
        let read = std::fs::File::open(path).and_then(|mut file| file.read_to_string(&mut text));
        if read.is_ok() && holds(&text) {
            return;
        }
        assert!(started.elapsed() < PATIENCE, "{} says:\n{text}", path.display());
        std::thread::sleep(Duration::from_millis(50));
    }
}
