//! What a window holds after long use: `window memory FILE...`.
//!
//! The real program at 1280 x 800 under Xvfb is switched to the next renderer 2,000 times, and then opens 200 files,
//! one after the other; its resident memory after 20 of each stands beside that at the end, each time with the renderer
//! that was there first.

use super::{FILL, pause};
use anyhow::{Context as _, Result};
use std::time::Duration;
use surfelshop_tests::screen::{Program, Screen};

const SIZE: [u32; 2] = [1280, 800];
const N_SWITCHES: usize = 2000;
const N_FILES: usize = 200;
/// Switches that wait for the whole picture: more than there are renderers.
const N_WHOLE: usize = 20;

pub(super) fn run(files: &[String]) -> Result<()> {
    let files: Vec<_> = files.iter().map(std::path::absolute).collect::<Result<_, _>>()?;
    let first = files.first().context("expected files of clouds")?;
    if let Some(missing) = files.iter().find(|file| !file.exists()) {
        anyhow::bail!("{}: expected a cloud, found no such file", missing.display());
    }
    let state = tempfile::tempdir()?;
    let screen = Screen::start(SIZE);
    let mut program = Program::start_with(&screen, &[first.as_os_str()], state.path(), &[]);
    screen.xdotool(FILL);
    program.picture(0, "ewa-phong");
    pause(3.0);
    let told = |n: usize, what: &str, program: &Program<'_>| -> Result<()> {
        println!("{n} {what}: {} MB", resident_bytes(program.child.id())? / 1_000_000);
        Ok(())
    };
    told(0, "switches", &program)?;
    for n in 1..=N_SWITCHES {
        program.key("r");
        // The first switches wait for whole pictures, so that each renderer has all that it needs; of one that is only
        // passed through there may be none.
        let (words, seconds): (&[_], _) = match n <= N_WHOLE {
            true => (&["picture", "pane=0", "full detail"], 60),
            false => (&["picture", "pane=0"], 2),
        };
        let _is_there = program.says(words, Duration::from_secs(seconds));
        program.seen.clear();
        if n <= N_WHOLE {
            // Until it is smooth, too.
            pause(2.0);
        }
        if matches!(n, 20 | 200 | 500 | 1000 | 1500 | N_SWITCHES) {
            first_renderer(&mut program);
            told(n, "switches", &program)?;
        }
    }
    for n in 1..=N_FILES {
        program.key("ctrl+o");
        program.said(&["a file dialog of the program's own"]);
        pause(0.3);
        let file = &files[n % files.len()];
        screen.xdotool(&format!("type --delay 4 {}", file.display()));
        pause(0.2);
        program.key("Return");
        program.said(&["picture", "pane=0", "full detail"]);
        program.seen.clear();
        if matches!(n, 20 | 50 | 100 | 150 | N_FILES) {
            pause(5.0);
            told(n, "files", &program)?;
        }
    }
    Ok(())
}

/// Goes on to the renderer that was there first, so that the same is measured each time, and waits until what belongs to
/// others is let go.
fn first_renderer(program: &mut Program<'_>) {
    for _ in 0..N_WHOLE {
        program.key("r");
        let words = ["picture", "pane=0", "ewa-phong", "full detail"];
        let is_there = program.says(&words, Duration::from_secs(3));
        program.seen.clear();
        if is_there {
            break;
        }
    }
    pause(6.0);
}

/// Memory of a process that is in use, bytes.
pub(super) fn resident_bytes(pid: u32) -> Result<u64> {
    status_bytes(pid, "VmRSS:")
}

/// The most of it that ever was, bytes.
pub(super) fn peak_bytes(pid: u32) -> Result<u64> {
    status_bytes(pid, "VmHWM:")
}

fn status_bytes(pid: u32, name: &str) -> Result<u64> {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status"))?;
    let line = status.lines().find_map(|line| line.strip_prefix(name));
    let number = line.and_then(|line| line.trim().trim_end_matches("kB").trim().parse().ok());
    Ok(1024 * number.unwrap_or(0u64))
}
