//! One-line messages over the views.
//!
//! Reports disappear after some seconds; warnings stay until they are dismissed. A window lists the last
//! messages of both kinds.

use crate::theme::dismiss;
use eframe::egui::{self, Align2, Context, Frame, Rect, Response, RichText, ScrollArea, Ui, vec2};
use std::borrow::Cow;
use std::collections::VecDeque;
use std::path::Path;
use std::time::{Duration, Instant};

/// How long a report stays over the pictures.
const REPORT_DURATION: Duration = Duration::from_secs(8);

/// Most messages over the pictures at once; the others are counted below them.
const MOST_SHOWN: usize = 3;

/// Most messages in the list.
const MOST_LISTED: usize = 200;

/// Height of the scale bar and the caption below it, points.
const ABOVE_SCALE_BAR: f32 = 60.0;

struct Message {
    text: String,
    warns: bool,
    since: Instant,
    dismissed: bool,
    /// How often the same message came in a row.
    times: u32,
}

impl Message {
    /// The time for which the message stays over the pictures; `None` where it does not.
    fn remaining(&self) -> Option<Duration> {
        if self.dismissed {
            None
        } else if self.warns {
            Some(Duration::MAX)
        } else {
            REPORT_DURATION.checked_sub(self.since.elapsed())
        }
    }

    /// Shows these words of the message.
    fn show(&self, ui: &mut Ui, words: &str) -> Response {
        let color =
            if self.warns { ui.visuals().warn_fg_color } else { ui.visuals().strong_text_color() };
        let times = if self.times > 1 { format!(" ({} times)", self.times) } else { String::new() };
        let text = RichText::new(format!("{words}{times}")).color(color);
        ui.add(egui::Label::new(text).wrap())
    }

    /// Shows the message, where the file that it begins with stands by its name alone.
    fn show_short(&self, ui: &mut Ui) {
        let short = short(&self.text);
        let shown = self.show(ui, &short);
        if short != self.text {
            shown.on_hover_text(&self.text);
        }
    }
}

/// A message in which the absolute path that it begins with has become the file's name.
fn short(text: &str) -> Cow<'_, str> {
    let shortened = text.split_once(": ").and_then(|(path, rest)| {
        let path = Path::new(path);
        let name = path.file_name().filter(|_| path.is_absolute())?;
        Some(format!("{}: {rest}", name.display()))
    });
    shortened.map_or(Cow::Borrowed(text), Cow::Owned)
}

/// The messages, the newest last.
#[derive(Default)]
pub(crate) struct Messages {
    lines: VecDeque<Message>,
    /// Whether the window that lists them is open.
    pub(crate) open: bool,
}

impl Messages {
    /// Adds a report.
    pub(crate) fn report(&mut self, text: impl Into<String>) {
        self.add(text.into(), false);
    }

    /// Adds a warning.
    pub(crate) fn warn(&mut self, text: impl Into<String>) {
        self.add(text.into(), true);
    }

    fn add(&mut self, text: String, warns: bool) {
        tracing::debug!(warns, text, "message");
        // What is still shown is not shown twice.
        let same = |last: &Message| last.text == text && last.warns == warns;
        let again = self.lines.iter().rposition(|line| same(line) && line.remaining().is_some());
        let last = self.lines.len().checked_sub(1).filter(|&last| same(&self.lines[last]));
        let before = again.or(last).and_then(|at| self.lines.remove(at));
        let times = before.map_or(1, |before| before.times + 1);
        self.lines.push_back(Message {
            text,
            warns,
            since: Instant::now(),
            dismissed: false,
            times,
        });
        while self.lines.len() > MOST_LISTED {
            self.lines.pop_front();
        }
    }

    /// Dismisses what told of things done: they were taken back.
    pub(crate) fn dismiss_reports(&mut self) {
        self.lines.iter_mut().filter(|line| !line.warns).for_each(|line| line.dismissed = true);
    }

    /// Dismisses all messages.
    pub(crate) fn dismiss_all(&mut self) {
        self.lines.iter_mut().for_each(|line| line.dismissed = true);
    }

    /// The last message, unless it was dismissed.
    #[cfg(test)]
    pub(crate) fn last(&self) -> Option<&str> {
        self.lines.back().filter(|line| !line.dismissed).map(|line| line.text.as_str())
    }

    /// How often a message with these words came.
    #[cfg(test)]
    pub(crate) fn count(&self, words: &str) -> u32 {
        self.lines.iter().filter(|line| line.text.contains(words)).map(|line| line.times).sum()
    }

    /// Whether a message with these words is not yet dismissed.
    #[cfg(test)]
    pub(crate) fn contains(&self, words: &str) -> bool {
        self.lines.iter().any(|line| !line.dismissed && line.text.contains(words))
    }

    /// Shows the newest messages at the lower edge of `over`, without changing the size of pictures.
    pub(crate) fn show(&mut self, ctx: &Context, over: Rect) {
        let current: Vec<usize> =
            (0..self.lines.len()).filter(|&i| self.lines[i].remaining().is_some()).collect();
        let Some(soonest) = current.iter().filter_map(|&i| self.lines[i].remaining()).min() else {
            return;
        };
        if soonest < Duration::MAX {
            ctx.request_repaint_after(soonest + Duration::from_millis(20));
        }
        let n_waiting = current.len().saturating_sub(MOST_SHOWN);
        egui::Area::new(egui::Id::unique("messages"))
            .pivot(Align2::LEFT_BOTTOM)
            .fixed_pos(over.left_bottom() + vec2(8.0, -ABOVE_SCALE_BAR))
            .show(ctx, |ui| {
                // The right lower corner is the legend's.
                ui.set_max_width((0.6 * over.width()).clamp(300.0, 620.0).min(over.width() - 16.0));
                Frame::popup(ui.style()).show(ui, |ui| {
                    for &i in &current[n_waiting..] {
                        ui.horizontal_top(|ui| {
                            if dismiss(ui, "dismiss") {
                                self.lines[i].dismissed = true;
                            }
                            self.lines[i].show_short(ui);
                        });
                    }
                    if n_waiting > 0 {
                        ui.horizontal(|ui| {
                            if ui.small_button("all messages").clicked() {
                                self.open = true;
                            }
                            if ui.small_button("dismiss all").clicked() {
                                self.dismiss_all();
                            }
                            ui.weak(format!("{n_waiting} more"));
                        });
                    }
                });
            });
    }

    /// The window that lists all messages.
    pub(crate) fn show_all(&mut self, ctx: &Context) {
        let mut open = self.open;
        let window = egui::Window::new("Messages").open(&mut open).default_width(560.0);
        let window = window.pivot(Align2::CENTER_CENTER).default_pos(ctx.content_rect().center());
        window.show(ctx, |ui| {
            if self.lines.is_empty() {
                ui.weak("There are no messages.");
                return;
            }
            ScrollArea::vertical().max_height(360.0).stick_to_bottom(true).show(ui, |ui| {
                self.lines.iter().for_each(|line| drop(line.show(ui, &line.text)));
            });
        });
        self.open = open;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_stands_by_its_name() {
        assert_eq!(short("/a folder/b.ply: no such file"), "b.ply: no such file");
        for whole in ["b.ply: no such file", "wrote /a/b.ply", "a/b.ply: no", "/: no", "/a/b"] {
            assert_eq!(short(whole), whole);
        }
    }

    #[test]
    fn warnings_outlive_news_and_repetitions_are_counted() {
        let mut messages = Messages::default();
        messages.warn("gone wrong");
        messages.report("done");
        messages.report("done");
        assert_eq!(messages.lines.len(), 2);
        assert_eq!(messages.lines[1].times, 2);
        let long_ago = Instant::now() - REPORT_DURATION - Duration::from_secs(1);
        messages.lines.iter_mut().for_each(|line| line.since = long_ago);
        assert!(messages.lines[0].remaining().is_some() && messages.lines[1].remaining().is_none());
        messages.dismiss_all();
        assert!(messages.lines[0].remaining().is_none() && messages.last().is_none());
        for i in 0..2 * MOST_LISTED {
            messages.report(i.to_string());
        }
        assert_eq!(messages.lines.len(), MOST_LISTED);
        assert_eq!(messages.last(), Some((2 * MOST_LISTED - 1).to_string().as_str()));
    }
}
