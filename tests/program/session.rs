//! A cloud edited by hand in the real program under Xvfb, and the same done again on the command line.

#![cfg(target_os = "linux")]
use std::path::Path;
use std::process::Command;
use std::time::Duration;
use surfelshop_cloud::{Cloud, Column, ReadOptions, WriteOptions, write};
use surfelshop_tests::clouds;
use surfelshop_tests::screen::{Program, Screen};
use surfelshop_tests::stage::build_folder;

/// In the picture of a sphere, beside the windows of tools: a line across, another one below, and one around a part.
const ACROSS: [[i32; 2]; 4] = [[620, 300], [660, 320], [700, 330], [740, 330]];
const BELOW: [[i32; 2]; 4] = [[500, 600], [540, 610], [600, 615], [640, 610]];
const AROUND: [[i32; 2]; 7] =
    [[640, 400], [690, 400], [740, 410], [740, 470], [690, 490], [640, 490], [630, 440]];
/// The button that runs the tool whose window is open.
const RUN: [i32; 2] = [480, 461];

/// Larger than the time that xdotool and the window take to agree.
const MOMENT: Duration = Duration::from_millis(700);

/// What somebody does in a window that shows a cloud.
struct Session<'a> {
    screen: &'a Screen,
    program: Program<'a>,
}

impl<'a> Session<'a> {
    fn start(screen: &'a Screen, scene: &Path, state: &Path) -> Self {
        let mut program = Program::start(screen, scene, state);
        program.picture(0, "ewa-phong");
        // Without a window manager nobody gives the keyboard to the window.
        screen.xdotool("search --sync --onlyvisible --name Surfelshop windowfocus");
        screen.xdotool("mousemove 800 400");
        Self { screen, program }
    }

    /// Looks from the same place, whatever came before.
    fn look_from_the_front(&mut self) {
        self.program.key("0");
        std::thread::sleep(Duration::from_secs(1));
        self.program.key("f");
        self.program.picture(0, "ewa-phong");
    }

    /// Draws a line and waits for a picture of what it does.
    fn draw(&mut self, line: &[[i32; 2]]) {
        let to = |[x, y]: [i32; 2]| self.screen.xdotool(&format!("mousemove {x} {y}"));
        to(line[0]);
        std::thread::sleep(MOMENT);
        self.screen.xdotool("mousedown 1");
        for at in line {
            to(*at);
            std::thread::sleep(Duration::from_millis(80));
        }
        self.screen.xdotool("mouseup 1");
        self.program.picture(0, "ewa-phong");
        std::thread::sleep(2 * MOMENT);
    }

    fn click(&self, [x, y]: [i32; 2]) {
        self.screen.xdotool(&format!("mousemove {x} {y}"));
        std::thread::sleep(MOMENT);
        self.screen.xdotool("click 1");
        std::thread::sleep(MOMENT);
    }

    /// Types words and ends them with the key for it.
    fn enter(&self, words: &str) {
        std::thread::sleep(MOMENT);
        self.screen.xdotool(&format!("type {words}"));
        std::thread::sleep(MOMENT);
        self.program.key("Return");
        std::thread::sleep(MOMENT);
    }

    /// Runs what is found by these letters.
    fn command(&self, letters: &str) {
        self.program.key("ctrl+shift+p");
        self.enter(letters);
    }

    /// Names the file that a dialog of the program's own asks for.
    fn name_file(&mut self, name: &str) {
        self.program.said(&["a file dialog of the program's own"]);
        self.enter(name);
        self.program.said(&["wrote", name]);
    }

    fn end(mut self) {
        self.program.key("ctrl+q");
        self.program.ends_well();
    }
}

fn read(path: &Path) -> Cloud {
    surfelshop_cloud::read(path, &ReadOptions::default()).unwrap().cloud
}

/// Whether two clouds have the same columns, to the last bit.
fn are_equal(one: &Cloud, other: &Cloud) -> bool {
    let same = |(a, b): (&Column, &Column)| {
        (a.name(), a.components()) == (b.name(), b.components())
            && (a.values().element(), a.values().len()) == (b.values().element(), b.values().len())
            && (0..a.values().len()).all(|i| {
                a.values().get_f64(i).map(f64::to_bits) == b.values().get_f64(i).map(f64::to_bits)
            })
    };
    let (one, other) = (one.columns(), other.columns());
    one.len() == other.len() && one.iter().zip(other).all(same)
}

/// Invariant: what is painted, sculpted, deleted, filled and measured by hand is undone, saved and opened again, and
/// strokes do the same on the command line, to the last bit
///
/// Forty seconds, most of them waiting as a hand does.
#[test]
fn a_cloud_is_edited_by_hand_saved_opened_again_and_done_again_on_the_command_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let before = clouds::sphere(30_000, 1.0).cloud();
    write(path("ball.ply"), &before, &WriteOptions::default()).unwrap();
    let scene = path("session.scene.toml");
    std::fs::write(&scene, "format = 1\n[[clouds]]\npath = 'ball.ply'\n").unwrap();
    let screen = Screen::start([1280, 800]);
    let mut session = Session::start(&screen, &scene, folder.path());
    session.look_from_the_front();
    // Strokes of two tools.
    session.program.key("p");
    session.draw(&ACROSS);
    session.command("inflate");
    session.draw(&BELOW);
    session.command("save the strokes");
    session.program.said(&["ball.strokes.json", "2 strokes"]);
    session.program.key("ctrl+shift+e");
    session.name_file("led.ply");
    // A part is deleted, back again, and deleted for good.
    session.program.key("l");
    session.draw(&AROUND);
    session.program.key("Delete");
    session.program.said(&["deleted"]);
    session.program.key("ctrl+z");
    session.program.picture(0, "ewa-phong");
    std::thread::sleep(MOMENT);
    session.program.key("ctrl+shift+e");
    session.name_file("undone.ply");
    session.program.key("Delete");
    session.program.said(&["deleted"]);
    session.program.key("Escape");
    session.command("fill holes");
    session.click(RUN);
    session.program.said(&["fill-holes made a cloud of", "1 hole filled"]);
    session.program.key("Escape");
    session.program.key("k");
    session.click(AROUND[0]);
    session.click(AROUND[4]);
    session.command("save cloud undone");
    session.name_file("cut.ply");
    session.command("save cloud fill");
    session.name_file("whole.ply");
    session.program.key("ctrl+s");
    session.program.said(&["wrote", "session.scene.toml"]);
    session.end();
    let text = std::fs::read_to_string(&scene).unwrap();
    assert!(text.contains("whole.ply") && text.contains("[[measure]]"), "{text}");

    let (led, whole) = (read(&path("led.ply")), read(&path("whole.ply")));
    assert!(!are_equal(&led, &before));
    assert!(are_equal(&read(&path("undone.ply")), &led), "undone");
    assert!(whole.column("filled").is_some() && whole.len() > 29_000);
    // The same strokes on the command line.
    let done = Command::new(build_folder().join("surfelshop"))
        .args(["bake", "ball.ply", "-t", "brush", "-t", "inflate", "--strokes"])
        .args(["ball.strokes.json", "-o", "again.ply"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    assert!(are_equal(&read(&path("again.ply")), &led), "strokes done again");
    // The same cloud in a new window.
    let mut session = Session::start(&screen, &scene, folder.path());
    session.command("save cloud whole");
    session.name_file("opened.ply");
    session.end();
    assert!(are_equal(&read(&path("opened.ply")), &whole), "opened again");
}
