//! How well pictures follow the hand: `window rates [whole] FILE...`; with `whole` nothing is drawn coarser in motion.
//!
//! The real program at 1280 x 800 under Xvfb shows each file with a lamp in the middle. While the mouse turns the view,
//! and then drags the lamp, the pictures that arrive in the window are counted, those in full detail among them, and the
//! longest time between two is kept; on a quiet machine, and again beside a process that takes a core. Last, what the
//! window takes while nothing moves.

use super::{FILL, pause};
use anyhow::{Context as _, Result};
use glam::DVec3;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};
use surfelshop_pyramid::Pyramid;
use surfelshop_tests::screen::{Program, Screen};

/// Pixels, as of a small laptop.
const SIZE: [u32; 2] = [1280, 800];

/// How long the hand moves, and how often, seconds.
const DRAG: f64 = 8.0;
const STEP: f64 = 0.016;

/// How long nothing moves, seconds.
const IDLE: f64 = 10.0;

/// Ticks of a second in the system's times of processes: the same on every Linux.
const TICKS: f64 = 100.0;

pub(super) fn run(arguments: &[String]) -> Result<()> {
    let (whole, files) = match arguments {
        [first, files @ ..] if first == "whole" => (true, files),
        files => (false, files),
    };
    anyhow::ensure!(!files.is_empty(), "expected files of clouds");
    println!(
        "| cloud | million | machine | what moves | pictures a second | in full detail, % | worst gap, s |"
    );
    println!("|---|---|---|---|---|---|---|");
    for file in files {
        let path = std::path::absolute(file)?;
        let name = path.file_name().unwrap_or_default().display().to_string();
        let (scene, n_surfels) = with_lamp(&path)?;
        let million = n_surfels as f64 * 1e-6;
        for machine in ["quiet", "one core taken"] {
            let load = (machine != "quiet").then(CoreTaker::start).transpose()?;
            let state = tempfile::tempdir()?;
            let screen = Screen::start(SIZE);
            let mut program =
                Program::start_with(&screen, &[scene.path.as_os_str()], state.path(), &[]);
            screen.xdotool(FILL);
            program.picture(0, "ewa-phong");
            // Antialiasing, and a subset that is shown until all is uploaded, are over.
            while program.says(&["pane=0", "picture"], Duration::from_secs(6)) {}
            if whole {
                screen.xdotool("key ctrl+shift+p sleep 1");
                for word in ["Draw", "less", "while"] {
                    screen.xdotool(&format!("type {word}"));
                    screen.xdotool("key space");
                }
                screen.xdotool("sleep 1 key Return sleep 1");
            }
            let middle = middle_of_view(SIZE);
            for (what, start) in [("view", [middle[0] - 200, middle[1] + 240]), ("lamp", middle)] {
                let (arrivals, n_full) = drag(&screen, &mut program, start);
                let (rate, gap) = rate_and_gap(&arrivals);
                let full = 100.0 * n_full as f64 / arrivals.len().saturating_sub(2).max(1) as f64;
                println!(
                    "| {name} | {million:.2} | {machine} | {what} | {rate:.1} | {full:.0} | {gap:.2} |"
                );
                while program.says(&["pane=0", "picture"], Duration::from_secs(4)) {}
            }
            let pid = program.child.id();
            let before = cpu_seconds(pid)?;
            pause(IDLE);
            let share = (cpu_seconds(pid)? - before) / IDLE;
            println!(
                "| {name} | {million:.2} | {machine} | nothing: {:.2} % of a core | | | |",
                100.0 * share
            );
            drop(load);
        }
    }
    Ok(())
}

/// A scene file in a folder of its own.
struct SceneFile {
    path: PathBuf,
    _folder: tempfile::TempDir,
}

/// A scene of a cloud and a lamp in the middle of it, and how many surfels there are.
fn with_lamp(cloud: &Path) -> Result<(SceneFile, usize)> {
    let ([low, high], n) = extent(cloud)?;
    let (middle, size) = (0.5 * (low + high), (high - low).length());
    let intensity = size * size;
    let DVec3 { x, y, z } = middle;
    let mut text = String::from("format = 1\n");
    writeln!(text, "[[lights]]\nposition = [{x:?}, {y:?}, {z:?}]")?;
    writeln!(text, "intensity = [{intensity:?}, {intensity:?}, {intensity:?}]")?;
    writeln!(text, "[[clouds]]\npath = {:?}", cloud.display().to_string())?;
    writeln!(text, "[[views]]\nrenderer = \"ewa-phong\"")?;
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("lamp.scene.toml");
    std::fs::write(&path, text)?;
    Ok((SceneFile { path, _folder: folder }, n))
}

/// The corners of a cloud's box, and its number of surfels; of a pyramid as its head has them.
fn extent(file: &Path) -> Result<([DVec3; 2], usize)> {
    if file.extension().is_some_and(|extension| extension == "surfels") {
        let pyramid = Pyramid::open(file)?;
        let head = pyramid.directory();
        return Ok((head.bounds, head.n_surfels as usize));
    }
    let read = surfelshop_cloud::read(file, &Default::default())?.cloud;
    Ok(([read.facts().bounds_min, read.facts().bounds_max], read.len()))
}

/// The middle of the only view, pixels: between the outliner and the properties, below menu, toolbar and the view's row.
fn middle_of_view([width, height]: [u32; 2]) -> [i32; 2] {
    let (left, right, top, bottom) = (218, 336, 90, 28);
    [(left + width as i32 - right) / 2, (top + height as i32 - bottom) / 2]
}

/// Drags back and forth from a place, and returns when the drag began, when each picture arrived, and when it ended; and how
/// many pictures were in full detail.
fn drag(screen: &Screen, program: &mut Program<'_>, [x0, y0]: [i32; 2]) -> (Vec<Instant>, usize) {
    screen.xdotool(&format!("mousemove {x0} {y0} sleep 0.3 mousedown 1 sleep 0.1"));
    let mut line = String::new();
    let n_steps = (DRAG / STEP) as i32;
    for step in 1..=n_steps {
        let phase = f64::from(step) * 0.04;
        let (x, y) = (160.0 * phase.sin(), 60.0 * (0.7 * phase).sin());
        line.push_str(&format!(" mousemove {} {} sleep {STEP}", x0 + x as i32, y0 + y as i32));
    }
    line.push_str(" mouseup 1");
    let (mut arrivals, mut n_full) = (Vec::new(), 0);
    std::thread::scope(|scope| {
        arrivals.push(Instant::now());
        let mover = scope.spawn(|| screen.xdotool(line.trim_start()));
        while !mover.is_finished() {
            if program.says(&["picture", "pane=0"], Duration::from_millis(50)) {
                arrivals.push(Instant::now());
                let line = program.seen.last();
                n_full += usize::from(line.is_some_and(|line| line.contains("full detail")));
            }
        }
        arrivals.push(Instant::now());
    });
    (arrivals, n_full)
}

/// Pictures a second between the first and the last time, and the longest time between two, seconds.
fn rate_and_gap(arrivals: &[Instant]) -> (f64, f64) {
    let gaps = arrivals.windows(2).map(|two| (two[1] - two[0]).as_secs_f64());
    let (Some(first), Some(last)) = (arrivals.first(), arrivals.last()) else { return (0.0, 0.0) };
    let n_pictures = arrivals.len().saturating_sub(2) as f64;
    (n_pictures / (*last - *first).as_secs_f64(), gaps.fold(0.0, f64::max))
}

/// User and system time of a process, seconds.
fn cpu_seconds(pid: u32) -> Result<f64> {
    let text = std::fs::read_to_string(format!("/proc/{pid}/stat"))?;
    // Behind the name, which may hold spaces, the 12th and 13th field.
    let (_, fields) = text.rsplit_once(')').context("a line of /proc/PID/stat")?;
    let fields: Vec<&str> = fields.split_whitespace().collect();
    let ticks = |i: usize| fields.get(i).and_then(|field| field.parse::<f64>().ok()).unwrap_or(0.0);
    Ok((ticks(11) + ticks(12)) / TICKS)
}

/// A process that takes a core for as long as this lives.
struct CoreTaker(std::process::Child);

impl CoreTaker {
    fn start() -> Result<Self> {
        let child = Command::new("sh").args(["-c", "while :; do :; done"]).spawn();
        Ok(Self(child.context("sh")?))
    }
}

impl Drop for CoreTaker {
    fn drop(&mut self) {
        drop(self.0.kill());
        drop(self.0.wait());
    }
}
