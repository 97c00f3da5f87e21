//! A screen without a monitor, and the real program in its window there, used with mouse and keys.

use crate::stage::build_folder;
use image::RgbImage;
use std::ffi::OsStr;
use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Far more than any step takes on a busy machine: a test that waits this long has failed.
pub const PATIENCE: Duration = Duration::from_secs(120);

/// A screen without a monitor.
pub struct Screen {
    server: Child,
    display: String,
    /// Pixels.
    pub size: [u32; 2],
}

impl Screen {
    /// One of this size.
    ///
    /// # Panics
    /// Where Xvfb is not installed.
    #[must_use]
    pub fn start(size: [u32; 2]) -> Self {
        let [width, height] = size;
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-nolisten", "tcp", "-screen", "0"])
            .arg(format!("{width}x{height}x24"))
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("Xvfb starts; `cargo verify` installs it");
        let mut number = String::new();
        let stdout = server.stdout.take().expect("it is piped");
        BufReader::new(stdout).read_line(&mut number).expect("Xvfb says its number");
        Self { server, display: format!(":{}", number.trim()), size }
    }

    /// A program that shows itself here.
    pub fn command(&self, program: impl AsRef<OsStr>) -> Command {
        let mut command = Command::new(program);
        command.env("DISPLAY", &self.display).env_remove("WAYLAND_DISPLAY");
        command
    }

    /// Moves the mouse and presses keys.
    ///
    /// # Panics
    /// Where xdotool is not installed or refuses.
    #[track_caller]
    pub fn xdotool(&self, line: &str) {
        let status = self.command("xdotool").args(line.split(' ')).status();
        assert!(status.is_ok_and(|status| status.success()), "xdotool {line}");
    }

    /// What the screen shows.
    ///
    /// # Panics
    /// Where xwd is not installed or fails.
    #[must_use]
    pub fn picture(&self) -> RgbImage {
        let dump = self.command("xwd").args(["-root", "-silent"]).output();
        let dump = dump.expect("xwd starts; `cargo verify` installs it");
        assert!(dump.status.success());
        let bytes = dump.stdout;
        let number = |i: usize| {
            u32::from_be_bytes([bytes[4 * i], bytes[4 * i + 1], bytes[4 * i + 2], bytes[4 * i + 3]])
        };
        // Fields of the X window dump, version 7: header, width, height, bits, row, colours.
        let (header, width, height) = (number(0) as usize, number(4), number(5));
        let (bits, row, n_colors) = (number(11), number(12) as usize, number(19) as usize);
        assert_eq!((width, height, bits), (self.size[0], self.size[1], 32));
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
pub struct Program<'a> {
    screen: &'a Screen,
    /// The process.
    pub child: Child,
    lines: Receiver<String>,
    /// What it said so far, in its log.
    pub seen: Vec<String>,
}

impl<'a> Program<'a> {
    /// Opens a file, with its state in this folder.
    ///
    /// # Panics
    /// Where the program is not built.
    #[must_use]
    pub fn start(screen: &'a Screen, file: &Path, state: &Path) -> Self {
        Self::start_with(screen, &[file.as_os_str()], state, &[])
    }

    /// The same with these arguments and variables of the environment.
    ///
    /// # Panics
    /// Where the program is not built.
    #[must_use]
    pub fn start_with(
        screen: &'a Screen,
        arguments: &[&OsStr],
        state: &Path,
        variables: &[(&str, &str)],
    ) -> Self {
        let mut child = screen
            .command(build_folder().join("surfelshop"))
            .args(arguments)
            .envs(variables.iter().copied())
            .env("XDG_STATE_HOME", state)
            .env("XDG_CONFIG_HOME", state)
            .env("XDG_CACHE_HOME", state)
            .env("MESA_SHADER_CACHE_DIR", build_folder())
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
        let stderr = BufReader::new(child.stderr.take().expect("it is piped"));
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
    ///
    /// # Panics
    /// Where none comes.
    #[track_caller]
    pub fn picture(&mut self, pane: u32, renderer: &str) {
        let (pane, renderer) = (format!("pane={pane}"), format!("renderer=\"{renderer}\""));
        self.said(&[&pane, &renderer, "full detail"]);
    }

    /// Waits for a line with all of these words.
    ///
    /// # Panics
    /// Where none comes.
    #[track_caller]
    pub fn said(&mut self, words: &[&str]) {
        let is_said = self.says(words, PATIENCE);
        assert!(is_said, "no {words:?}; so far:\n{}", self.seen.join("\n"));
    }

    /// Whether a line with all of these words comes within this time.
    ///
    /// # Panics
    /// Where the program ends.
    #[track_caller]
    pub fn says(&mut self, words: &[&str], within: Duration) -> bool {
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
            let runs = matches!(self.child.try_wait(), Ok(None));
            assert!(runs, "the program ended:\n{seen}");
            if started.elapsed() > within {
                return false;
            }
        }
    }

    /// Drags until a picture follows. On a busy machine press, moves and release can arrive in one frame of
    /// the window, which are a click.
    ///
    /// # Panics
    /// Where none follows.
    #[track_caller]
    pub fn drag_to_picture(&mut self, from: [i32; 2], to: [i32; 2], renderer: &str) {
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
    ///
    /// # Panics
    /// Where it does not end so.
    #[track_caller]
    pub fn ends_well(&mut self) {
        let started = Instant::now();
        let status = loop {
            if let Some(status) = self.child.try_wait().expect("it was started") {
                break status;
            }
            assert!(started.elapsed() < PATIENCE, "the program does not end");
            std::thread::sleep(Duration::from_millis(20));
        };
        assert!(status.success(), "{status}");
    }

    /// Presses keys, as xdotool calls them.
    pub fn key(&self, keys: &str) {
        self.screen.xdotool(&format!("key {keys}"));
    }

    /// Drags with the left button, pixels of the screen.
    pub fn drag(&self, [x0, y0]: [i32; 2], [x1, y1]: [i32; 2]) {
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
