//! Memory over a long flight: `window flight PYRAMID MEMORY`.
//!
//! The real program at 1280 x 800 under Xvfb shows a pyramid with so much memory (as in `--memory 500MB`). The eye turns
//! around it, goes in, looks about, and comes back elsewhere, until 2,000 pictures were shown; what the process holds and
//! the most it ever held are told on the way, beside those of a window that shows nothing.

use super::memory::{peak_bytes, resident_bytes};
use super::{FILL, pause};
use anyhow::Result;
use std::ffi::OsStr;
use std::time::{Duration, Instant};
use surfelshop_tests::screen::{Program, Screen};

const SIZE: [u32; 2] = [1280, 800];
const N_PICTURES: usize = 2000;
/// Pictures between two lines.
const TOLD_EACH: usize = 200;
/// Steps of the wheel into the cloud, and as many out of it.
const N_WHEEL: usize = 25;
/// Steps of the mouse between, and pixels of each.
const N_DRAGS: usize = 40;
const STEP: i32 = 12;

pub(super) fn run(file: &str, memory: &str) -> Result<()> {
    let file = std::path::absolute(file)?;
    let state = tempfile::tempdir()?;
    let screen = Screen::start(SIZE);
    let empty = Program::start_with(&screen, &[], state.path(), &[]);
    screen.xdotool(FILL);
    pause(3.0);
    println!("| pictures | seconds | resident, MB | most ever, MB |");
    println!("|---|---|---|---|");
    println!("| start page | | {} | {} |", of(&empty, resident_bytes)?, of(&empty, peak_bytes)?);
    empty.key("ctrl+q");
    drop(empty);
    let arguments = [file.as_os_str(), OsStr::new("--memory"), OsStr::new(memory)];
    let mut program = Program::start_with(&screen, &arguments, state.path(), &[]);
    screen.xdotool(FILL);
    program.picture(0, "ewa-phong");
    let mut flight = Flight { screen: &screen, program, n_pictures: 0, start: Instant::now() };
    flight.tell()?;
    let middle = [490, 430];
    let mut turn = 0;
    while flight.n_pictures < N_PICTURES {
        let before = flight.n_pictures;
        turn += 1;
        // Each time around from elsewhere, and towards another place.
        let aside = [(turn * 97) % 300 - 150, (turn * 61) % 160 - 80];
        flight.drag(middle, [STEP, if turn % 2 == 0 { 3 } else { -3 }])?;
        flight.wheel([middle[0] + aside[0], middle[1] + aside[1]], 4)?;
        flight.drag(middle, [-STEP, 2])?;
        flight.wheel(middle, 5)?;
        anyhow::ensure!(
            flight.n_pictures > before,
            "expected pictures, found none while the mouse moved"
        );
    }
    // What is loaded beside comes last.
    pause(5.0);
    flight.tell()
}

/// A flight before the window.
struct Flight<'a> {
    screen: &'a Screen,
    program: Program<'a>,
    n_pictures: usize,
    start: Instant,
}

impl Flight<'_> {
    /// Drags from a place, each step as soon as there is a picture of the last one.
    fn drag(&mut self, [x, y]: [i32; 2], [dx, dy]: [i32; 2]) -> Result<()> {
        self.screen.xdotool(&format!("mousemove {x} {y} sleep 0.1 mousedown 1"));
        for step in 1..=N_DRAGS as i32 {
            self.screen.xdotool(&format!("mousemove {} {}", x + step * dx, y + step * dy));
            self.wait()?;
        }
        self.screen.xdotool("mouseup 1");
        Ok(())
    }

    fn wheel(&mut self, [x, y]: [i32; 2], button: u32) -> Result<()> {
        for _ in 0..N_WHEEL {
            self.screen.xdotool(&format!("mousemove {x} {y} click {button}"));
            self.wait()?;
        }
        Ok(())
    }

    /// Waits for a picture; where the view has come to its end there is none.
    fn wait(&mut self) -> Result<()> {
        if self.program.says(&["pane=0", "picture"], Duration::from_secs(1)) {
            self.n_pictures += 1;
            if self.n_pictures.is_multiple_of(TOLD_EACH) {
                self.tell()?;
            }
        }
        self.program.seen.clear();
        Ok(())
    }

    fn tell(&self) -> Result<()> {
        let seconds = self.start.elapsed().as_secs_f64();
        let [now, most] = [resident_bytes, peak_bytes].map(|bytes| of(&self.program, bytes));
        println!("| {} | {seconds:.0} | {} | {} |", self.n_pictures, now?, most?);
        Ok(())
    }
}

/// Megabytes of a program.
fn of(program: &Program<'_>, bytes: fn(u32) -> Result<u64>) -> Result<u64> {
    Ok(bytes(program.child.id())? / 1_000_000)
}
