//! Everything the program says: results on the standard output, failures and progress on the
//! standard error.

use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;
use std::cell::{Cell, OnceCell, RefCell};
use std::fmt::Display;
use std::io::{self, IsTerminal as _, Write};
use std::ops::ControlFlow;
use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};
use surfelshop_runtime::plugins::is_deceptive;
use surfelshop_runtime::tools;
use tracing_subscriber::EnvFilter;

/// Filter of the log, such as `debug` or `surfelshop_render=trace`.
const LOG_VARIABLE: &str = "SURFELSHOP_LOG";

/// Sends the log to the standard error; by default only this program's own errors.
///
/// Graphics libraries note every driver they could not load as an error, which is no failure while
/// another driver works, so they are silent unless asked for.
pub fn start_log() {
    let filter = EnvFilter::try_from_env(LOG_VARIABLE)
        .unwrap_or_else(|_| EnvFilter::new("off,surfelshop=error"));
    tracing_subscriber::fmt().with_env_filter(filter).with_writer(io::stderr).init();
}

/// What is printed instead of shown, while a command runs within another.
static CAPTURED: Mutex<Option<String>> = Mutex::new(None);

/// Runs work and takes the results that it prints: they do not reach the standard output.
pub fn captured<T>(work: impl FnOnce() -> T) -> (T, String) {
    let swap = |text| {
        let mut captured = CAPTURED.lock().unwrap_or_else(PoisonError::into_inner);
        std::mem::replace(&mut *captured, text)
    };
    let before = swap(Some(String::new()));
    let done = work();
    (done, swap(before).unwrap_or_default())
}

/// Prints text of the result and ends the line.
fn print(text: &str) -> anyhow::Result<()> {
    let mut captured = CAPTURED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(captured) = &mut *captured {
        captured.push_str(text);
        captured.push('\n');
        return Ok(());
    }
    drop(captured);
    written(writeln!(io::stdout().lock(), "{text}"))
}

/// Prints a line of the result, or several.
pub fn line(text: impl Display) -> anyhow::Result<()> {
    print(&escaped(&text.to_string()))
}

/// A text with its control characters written out, line ends aside: names from files must not steer the
/// terminal.
fn escaped(text: &str) -> String {
    let shown = |c: char| match c {
        '\n' => c.to_string(),
        _ if is_deceptive(c) => c.escape_unicode().to_string(),
        _ => c.to_string(),
    };
    text.chars().map(shown).collect()
}

/// Prints one JSON object.
pub fn json(value: &impl Serialize) -> anyhow::Result<()> {
    // JSON has escapes of its own for what steers a terminal, but not for all of it.
    let text = serde_json::to_string_pretty(value)?;
    let shown = |c: char| match c {
        '\n' => c.to_string(),
        _ if is_deceptive(c) => {
            let mut units = [0; 2];
            c.encode_utf16(&mut units).iter().map(|unit| format!("\\u{unit:04x}")).collect()
        }
        _ => c.to_string(),
    };
    let text: String = text.chars().map(shown).collect();
    print(&text)
}

/// A reader such as `head` that has seen enough closes the pipe, which is no failure.
fn written(result: io::Result<()>) -> anyhow::Result<()> {
    match result {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(anyhow::anyhow!("the standard output cannot be written: {error}"))
        }
        _ => Ok(()),
    }
}

/// Prints a line beside the result: a warning, or what went wrong with a part of the work.
pub fn note(text: impl Display) {
    let text = one_line(&text.to_string());
    // With the standard error closed there is nobody left to tell.
    drop(writeln!(io::stderr().lock(), "surfelshop: {text}"));
}

/// Prints a warning beside the result.
pub fn warn(text: impl Display) {
    note(format!("warning: {text}"));
}

/// Prints a warning unless it was the last of its kind: what reads a faulty file several times warns once.
/// Says whether it did.
pub fn warn_once(text: impl Display) -> bool {
    static SAID: Mutex<String> = Mutex::new(String::new());
    let text = text.to_string();
    let mut said = SAID.lock().unwrap_or_else(PoisonError::into_inner);
    if *said == text {
        return false;
    }
    warn(&text);
    *said = text;
    true
}

/// Says why the command failed.
pub fn failed(error: &anyhow::Error) -> ExitCode {
    note(format!("{error:#}"));
    ExitCode::FAILURE
}

/// Says why the command failed and ends the program at once, where letting go of the graphics
/// device would wait for a plugin that is still being loaded.
pub fn leave(error: &anyhow::Error) -> ! {
    note(format!("{error:#}"));
    surfelshop_runtime::plugins::leave(1)
}

/// Answers a command line that names no command to run: help and version are results, all else is
/// a mistake.
pub fn not_understood(error: &clap::Error) -> ExitCode {
    if !error.use_stderr() {
        return match written(error.print()) {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => failed(&error),
        };
    }
    let text = error.to_string();
    let text = text.strip_prefix("error: ").unwrap_or(&text);
    drop(write!(io::stderr().lock(), "surfelshop: {text}"));
    ExitCode::from(2)
}

/// Messages of compilers and drivers span lines; scripts read one.
fn one_line(text: &str) -> String {
    let words = text.split_whitespace().collect::<Vec<_>>().join(" ");
    // Names and messages of plugins and files must not steer the terminal.
    words.chars().map(|c| if is_deceptive(c) { '?' } else { c }).collect()
}

/// Work shorter than this shows no progress bar.
const PATIENCE: Duration = Duration::from_secs(1);

/// A log has a line of long work each time that so much has passed.
const LOGGED_EVERY: Duration = Duration::from_secs(20);

/// A progress bar on the terminal for work that takes longer than a moment.
pub struct Progress {
    what: String,
    started: Instant,
    pace: RefCell<tools::Pace>,
    bar: OnceCell<ProgressBar>,
    /// When a log was told last.
    logged: Cell<Duration>,
}

impl Progress {
    /// Starts to wait; `what` stands before the bar.
    pub fn new(what: impl Into<String>) -> Self {
        let (pace, bar) = (RefCell::default(), OnceCell::new());
        let logged = Cell::new(Duration::ZERO);
        Self { what: what.into(), started: Instant::now(), pace, bar, logged }
    }

    /// Tells how far the work is, in [0, 1].
    pub fn tell(&self, fraction: f64) -> ControlFlow<()> {
        let left = self.pace.borrow_mut().left(fraction, self.started.elapsed());
        if let Some(bar) = self.shown() {
            show(bar, fraction, left);
        }
        self.log(&self.what, fraction, left);
        ControlFlow::Continue(())
    }

    /// Tells how far a tool is.
    pub fn tell_tool(&self, progress: &tools::Progress) {
        if let Some(bar) = self.shown() {
            let what = [self.what.as_str(), &progress.message].into_iter();
            let what: Vec<&str> = what.filter(|part| !part.is_empty()).collect();
            bar.set_message(one_line(&what.join(": ")));
            show(bar, progress.fraction, progress.left);
        }
        self.log(&self.what, progress.fraction, progress.left);
    }

    /// A line in a log now and then, where no bar can be shown.
    fn log(&self, what: &str, fraction: f64, left: Option<Duration>) {
        let passed = self.started.elapsed();
        if passed < self.logged.get() + LOGGED_EVERY || io::stderr().is_terminal() {
            return;
        }
        self.logged.set(passed);
        let left = left.map_or_else(String::new, |left| format!(", {} left", in_words(left)));
        note(format!("{what}: {:.0} %{left}", 100.0 * fraction.clamp(0.0, 1.0)));
    }

    /// The bar, once the work has taken a moment.
    fn shown(&self) -> Option<&ProgressBar> {
        let is_shown = self.started.elapsed() > PATIENCE && io::stderr().is_terminal();
        is_shown.then(|| self.bar.get_or_init(|| bar(&self.what)))
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = self.bar.get() {
            bar.finish_and_clear();
        }
    }
}

fn bar(what: &str) -> ProgressBar {
    let bar = ProgressBar::new(1000).with_message(one_line(what));
    match ProgressStyle::with_template("{msg} [{bar:40}] {percent} %{prefix}") {
        Ok(style) => bar.with_style(style.progress_chars("=> ")),
        Err(_) => bar,
    }
}

fn show(bar: &ProgressBar, fraction: f64, left: Option<Duration>) {
    let left = left.map_or_else(String::new, |left| format!(", {} left", in_words(left)));
    bar.set_prefix(left);
    bar.set_position((fraction.clamp(0.0, 1.0) * 1000.0) as u64);
}

/// A time to wait: as many seconds as matter.
pub fn in_words(time: Duration) -> String {
    match time.as_secs() {
        seconds @ 0..120 => format!("{} s", seconds.max(1)),
        seconds @ 120..7200 => format!("{} min", seconds.div_ceil(60)),
        seconds => format!("{:.1} h", seconds as f64 / 3600.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failures_take_one_line() {
        assert_eq!(one_line("a.wgsl:\n   expected `;`\n\t^ here\n"), "a.wgsl: expected `;` ^ here");
    }

    #[test]
    fn names_from_files_do_not_steer_the_terminal() {
        let name = "a\x1b]0;owned\x07\u{9b}31m\u{202e}b";
        let shown = r"a\u{1b}]0;owned\u{7}\u{9b}31m\u{202e}b";
        assert_eq!(
            escaped(&format!("{name}\n  columns {name}")),
            format!("{shown}\n  columns {shown}")
        );
        assert_eq!(one_line(name), "a?]0;owned??31m?b");
    }

    #[test]
    fn times_to_wait_are_short() {
        let words = |seconds| in_words(Duration::from_secs(seconds));
        assert_eq!([0, 119, 121, 7200].map(words), ["1 s", "119 s", "3 min", "2.0 h"]);
    }

    #[test]
    fn closed_pipe_is_no_failure_and_full_disk_is() {
        assert!(written(Err(io::ErrorKind::BrokenPipe.into())).is_ok());
        assert!(written(Err(io::ErrorKind::StorageFull.into())).is_err());
    }
}
