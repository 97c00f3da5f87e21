//! The window on a screen: the real program under Xvfb, used with mouse and keys.

#![cfg(target_os = "linux")]
use image::RgbImage;
use image::imageops::{FilterType, resize};
use std::io::{BufRead as _, BufReader, Read as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};
use surfelshop_tests::stage::build_folder;

const SAMPLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/sample.ply");

/// Far more than any step takes on a busy machine: a test that waits this long has failed.
const PATIENCE: Duration = Duration::from_secs(120);

/// The screen's size, pixels.
const SCREEN: [u32; 2] = [1280, 800];

/// A screen without a monitor.
struct Screen {
    server: Child,
    display: String,
}

impl Screen {
    fn start() -> Self {
        let [width, height] = SCREEN;
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-nolisten", "tcp", "-screen", "0"])
            .arg(format!("{width}x{height}x24"))
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("Xvfb starts; `cargo verify` installs it");
        let mut number = String::new();
        BufReader::new(server.stdout.take().unwrap()).read_line(&mut number).unwrap();
        Self { server, display: format!(":{}", number.trim()) }
    }

    fn command(&self, program: impl AsRef<std::ffi::OsStr>) -> Command {
        let mut command = Command::new(program);
        command.env("DISPLAY", &self.display).env_remove("WAYLAND_DISPLAY");
        command
    }

    fn xdotool(&self, line: &str) {
        let status = self.command("xdotool").args(line.split(' ')).status().unwrap();
        assert!(status.success(), "xdotool {line}");
    }

    /// What the screen shows.
    fn picture(&self) -> RgbImage {
        let dump = self.command("xwd").args(["-root", "-silent"]).output().unwrap();
        assert!(dump.status.success());
        let bytes = dump.stdout;
        let number = |i: usize| {
            u32::from_be_bytes([bytes[4 * i], bytes[4 * i + 1], bytes[4 * i + 2], bytes[4 * i + 3]])
        };
        // Fields of the X window dump, version 7: header, width, height, bits, row, colours.
        let (header, width, height) = (number(0) as usize, number(4), number(5));
        let (bits, row, n_colors) = (number(11), number(12) as usize, number(19) as usize);
        assert_eq!((width, height, bits), (SCREEN[0], SCREEN[1], 32));
        let first = header + 12 * n_colors;
        RgbImage::from_fn(width, height, |x, y| {
            let at = first + y as usize * row + 4 * x as usize;
            image::Rgb([bytes[at + 2], bytes[at + 1], bytes[at]])
        })
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        drop(self.server.kill());
        drop(self.server.wait());
    }
}

/// The program in its window.
struct Program<'a> {
    screen: &'a Screen,
    child: Child,
    lines: Receiver<String>,
    seen: Vec<String>,
}

impl<'a> Program<'a> {
    fn start(screen: &'a Screen, scene: &Path, state: &Path) -> Self {
        Self::start_with(screen, scene, state, &[])
    }

    fn start_with(screen: &'a Screen, scene: &Path, state: &Path, options: &[&str]) -> Self {
        let mut child = screen
            .command(build_folder().join("surfelshop"))
            .args(options)
            .arg(scene)
            .env("XDG_STATE_HOME", state)
            .env("XDG_CONFIG_HOME", state)
            .env("XDG_CACHE_HOME", state)
            .env("XDG_RUNTIME_DIR", state)
            .env("XDG_DATA_HOME", state)
            .env_remove("DBUS_SESSION_BUS_ADDRESS")
            .env("NODEVICE_SELECT", "1")
            .env("SURFELSHOP_LOG", "off,surfelshop=debug")
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("`cargo verify` builds the program");
        let (send, lines) = channel();
        let stderr = BufReader::new(child.stderr.take().unwrap());
        std::thread::spawn(move || {
            for line in stderr.lines().map_while(Result::ok) {
                if send.send(line).is_err() {
                    return;
                }
            }
        });
        Self { screen, child, lines, seen: Vec::new() }
    }

    /// Waits for a new picture in full detail, of a pane by a renderer.
    #[track_caller]
    fn picture(&mut self, pane: u32, renderer: &str) {
        let (pane, renderer) = (format!("pane={pane}"), format!("renderer=\"{renderer}\""));
        self.said(&[&pane, &renderer, "full detail"]);
    }

    /// Waits for a line with all of these words.
    #[track_caller]
    fn said(&mut self, words: &[&str]) {
        let is_said = self.says(words, PATIENCE);
        assert!(is_said, "no {words:?}; so far:\n{}", self.seen.join("\n"));
    }

    /// Whether a line with all of these words comes within this time.
    #[track_caller]
    fn says(&mut self, words: &[&str], within: Duration) -> bool {
        let started = Instant::now();
        loop {
            let line = self.lines.recv_timeout(Duration::from_millis(200)).unwrap_or_default();
            let line = plain(&line);
            if !line.is_empty() {
                self.seen.push(line.clone());
            }
            if words.iter().all(|word| line.contains(*word)) {
                return true;
            }
            let seen = self.seen.join("\n");
            assert!(self.child.try_wait().unwrap().is_none(), "the program ended:\n{seen}");
            if started.elapsed() > within {
                return false;
            }
        }
    }

    /// Drags until a picture follows. On a busy machine press, moves and release can arrive in one frame of
    /// the window, which are a click.
    #[track_caller]
    fn drag_to_picture(&mut self, from: [i32; 2], to: [i32; 2], renderer: &str) {
        let renderer = format!("renderer=\"{renderer}\"");
        let words = ["pane=0", renderer.as_str(), "full detail"];
        let mut tries = 0..6;
        while tries.next().is_some() {
            self.drag(from, to);
            if self.says(&words, Duration::from_secs(15)) {
                return;
            }
        }
        panic!("no picture follows a drag; so far:\n{}", self.seen.join("\n"));
    }

    /// Waits for the end, with exit code 0.
    #[track_caller]
    fn ends_well(&mut self) {
        let started = Instant::now();
        let status = loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                break status;
            }
            assert!(started.elapsed() < PATIENCE, "the program does not end");
            std::thread::sleep(Duration::from_millis(20));
        };
        assert!(status.success(), "{status}");
    }

    fn key(&self, keys: &str) {
        self.screen.xdotool(&format!("key {keys}"));
    }

    fn drag(&self, [x0, y0]: [i32; 2], [x1, y1]: [i32; 2]) {
        self.screen.xdotool(&format!("mousemove {x0} {y0} mousedown 1"));
        for step in 1..=6 {
            let (x, y) = (x0 + (x1 - x0) * step / 6, y0 + (y1 - y0) * step / 6);
            self.screen.xdotool(&format!("mousemove {x} {y}"));
            std::thread::sleep(Duration::from_millis(40));
        }
        self.screen.xdotool("mouseup 1");
    }
}

impl Drop for Program<'_> {
    fn drop(&mut self) {
        drop(self.child.kill());
        drop(self.child.wait());
    }
}

/// A line of the log without colours.
fn plain(line: &str) -> String {
    let mut parts = line.split('\u{1b}');
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |text, part| text + part.split_once('m').map_or("", |(_, rest)| rest))
}

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
    let screen = Screen::start();
    let mut program = Program::start(&screen, &scene, folder.path());
    program.picture(0, "ewa-phong");
    // Without a window manager nobody gives the keyboard to the window.
    screen.xdotool("search --sync --onlyvisible --name Surfelshop windowfocus");
    screen.xdotool("mousemove 800 400");
    program.drag_to_picture([900, 600], [820, 580], "ewa-phong");
    // How far a drag turns depends on when its events arrive; this view does not.
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
    let screen = Screen::start();
    let options = ["--patience", "100", "--trust", "--plugin", library.to_str().unwrap()];
    let mut program = Program::start_with(&screen, &scene, folder.path(), &options);
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
    let screen = Screen::start();
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
