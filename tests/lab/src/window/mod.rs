//! The first ten minutes with the window: `window FOLDER [SCAN]`; and `window rates FILE...`, `window memory FILE...`,
//! `window flight PYRAMID MEMORY`.
//!
//! The real program under Xvfb, at 1280 x 720, 1920 x 1080, and at 200 % on 2560 x 1440 pixels: start page, a file that
//! is opened, colours by a column, a view by the axes, a look, a split, a wipe line, a sweep, pictures and a scene that
//! are saved, an edit, undo, and a window that is closed with unsaved edits. Each step leaves a picture in the folder.

mod flight;
mod memory;
mod rates;

use anyhow::{Context as _, Result};
use std::path::{Path, PathBuf};
use std::time::Duration;
use surfelshop_tests::screen::{Program, Screen};

/// Name, pixels of the screen, and how large everything is.
const SCREENS: [(&str, [u32; 2], u32); 3] =
    [("720", [1280, 720], 1), ("1080", [1920, 1080], 1), ("200-percent", [2560, 1440], 2)];

/// Makes the window as large as the screen, and gives it the keys.
const FILL: &str =
    "search --sync --onlyvisible --name Surfelshop windowmove 0 0 windowsize 100% 100% windowfocus";

const SAMPLE: &str = "assets/sample.ply";

pub(crate) fn run() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(2).collect();
    let (folder, scan) = match arguments.as_slice() {
        [first, files @ ..] if first == "rates" => return rates::run(files),
        [first, files @ ..] if first == "memory" => return memory::run(files),
        [first, file, memory] if first == "flight" => return flight::run(file, memory),
        [folder] => (folder, SAMPLE),
        [folder, scan] => (folder, scan.as_str()),
        _ => anyhow::bail!("expected a folder to write and perhaps a scan, found {arguments:?}"),
    };
    let scan = std::path::absolute(scan)?;
    std::fs::create_dir_all(folder).with_context(|| folder.clone())?;
    for (name, size, scale) in SCREENS {
        let state = tempfile::tempdir()?;
        let screen = Screen::start(size);
        let scales = scale.to_string();
        let variables = [("WINIT_X11_SCALE_FACTOR", scales.as_str())];
        let program = Program::start_with(&screen, &[], state.path(), &variables);
        let mut visit = Visit {
            screen: &screen,
            program,
            scale: scale as i32,
            pictures: Path::new(folder).join(name),
            n_steps: 0,
        };
        visit.ten_minutes(&scan, state.path())?;
    }
    Ok(())
}

/// A new user before the window.
struct Visit<'a> {
    screen: &'a Screen,
    program: Program<'a>,
    /// Pixels of a point.
    scale: i32,
    /// How files of pictures begin.
    pictures: PathBuf,
    n_steps: u32,
}

impl Visit<'_> {
    fn ten_minutes(&mut self, scan: &Path, folder: &Path) -> Result<()> {
        self.screen.xdotool(FILL);
        pause(2.0);
        self.shot("start-page")?;
        self.key("ctrl+o");
        self.program.said(&["a file dialog of the program's own"]);
        pause(0.5);
        self.shot("open-dialog")?;
        self.words(&scan.display().to_string());
        self.key("Return");
        pause(0.3);
        self.shot("reading")?;
        self.program.picture(0, "ewa-phong");
        pause(4.0);
        self.shot("opened")?;
        self.palette("colour by classification", "palette")?;
        pause(3.0);
        self.shot("coloured")?;
        // The end of the x axis, in the corner of the view beside the properties.
        let [width, height] = self.points();
        self.click([width - 358, 166]);
        pause(3.0);
        self.shot("view-by-axes")?;
        self.key("f");
        self.palette("look studio", "palette-look")?;
        self.program.picture(0, "environment");
        pause(3.0);
        self.shot("look-studio")?;
        self.key("n");
        self.program.picture(1, "environment");
        pause(3.0);
        self.shot("split")?;
        self.key("alt+3");
        pause(4.0);
        self.shot("wipe")?;
        self.key("m");
        pause(3.0);
        // The button below the values that are tried.
        self.click([width - 311, 394]);
        pause(12.0);
        self.shot("swept")?;
        self.key("Escape");
        pause(0.5);
        self.key("ctrl+p");
        pause(1.0);
        self.shot("save-pictures")?;
        self.key("Escape");
        pause(0.5);
        self.key("ctrl+s");
        self.program.said(&["a file dialog of the program's own"]);
        pause(0.5);
        self.words(&folder.join("visit.scene.toml").display().to_string());
        self.key("Return");
        pause(2.0);
        self.shot("scene-saved")?;
        self.key("ctrl+w");
        pause(1.0);
        self.key("t");
        pause(0.5);
        // Clear of the window with what a selection does.
        self.drag([width / 2 + 10, height / 2 + 20], [width / 2 + 150, height / 2 + 110]);
        pause(3.0);
        self.shot("selected")?;
        self.key("Delete");
        pause(3.0);
        self.shot("deleted")?;
        self.key("ctrl+z");
        pause(2.0);
        self.shot("undone")?;
        self.key("ctrl+shift+z");
        pause(2.0);
        self.key("ctrl+q");
        pause(1.0);
        self.shot("closing")?;
        Ok(())
    }

    /// The window's size, points.
    fn points(&self) -> [i32; 2] {
        self.screen.size.map(|side| side as i32 / self.scale)
    }

    fn key(&self, keys: &str) {
        self.program.key(keys);
    }

    fn words(&self, words: &str) {
        self.screen.xdotool(&format!("type --delay 8 {words}"));
        pause(0.3);
    }

    fn click(&self, [x, y]: [i32; 2]) {
        let (x, y) = (x * self.scale, y * self.scale);
        self.screen.xdotool(&format!("mousemove {x} {y} sleep 0.2 click 1"));
    }

    fn drag(&self, from: [i32; 2], to: [i32; 2]) {
        self.program.drag(from.map(|at| at * self.scale), to.map(|at| at * self.scale));
    }

    /// Runs what the palette finds first.
    fn palette(&mut self, words: &str, picture: &str) -> Result<()> {
        self.key("ctrl+shift+p");
        pause(0.8);
        for word in words.split(' ') {
            self.words(word);
            self.key("space");
        }
        pause(0.5);
        self.shot(picture)?;
        self.key("Return");
        pause(0.5);
        Ok(())
    }

    /// Keeps what the screen shows.
    fn shot(&mut self, step: &str) -> Result<()> {
        self.n_steps += 1;
        let name = format!("{}-{:02}-{step}.png", self.pictures.display(), self.n_steps);
        self.screen.picture().save(&name).with_context(|| name.clone())?;
        println!("{name}");
        Ok(())
    }
}

fn pause(seconds: f64) {
    std::thread::sleep(Duration::from_secs_f64(seconds));
}
