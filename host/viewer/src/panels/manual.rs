//! The manual in a window: its contents, and the page that was chosen.

use eframe::egui::{self, Context, RichText, ScrollArea, Ui};
use surfelshop_session::manual::PAGES;

/// The window of the manual.
#[derive(Default)]
pub(crate) struct ManualWindow {
    pub(crate) open: bool,
    /// The index of the shown page.
    page: usize,
}

/// Shows the window if it is open.
pub(super) fn show(window: &mut ManualWindow, ctx: &Context) {
    let ManualWindow { open, page } = window;
    let manual = egui::Window::new("Manual").open(open).default_size([900.0, 560.0]);
    let manual = manual.pivot(egui::Align2::CENTER_CENTER).default_pos(ctx.content_rect().center());
    manual.show(ctx, |ui| {
        egui::Panel::left("contents").show(ui, |ui| contents(page, ui));
        let page = &PAGES[(*page).min(PAGES.len() - 1)];
        ScrollArea::vertical().id_salt(page.topic).show(ui, |ui| text(page.text, ui));
    });
}

fn contents(shown: &mut usize, ui: &mut Ui) {
    ScrollArea::vertical().id_salt("contents").show(ui, |ui| {
        let mut part = "";
        for (i, page) in PAGES.iter().enumerate() {
            if page.part != part {
                part = page.part;
                ui.strong(part);
            }
            ui.selectable_value(shown, i, page.title);
        }
    });
}

/// The paragraph and the table that are being read; shown as soon as they are complete.
#[derive(Default)]
struct PendingText {
    paragraph: String,
    rows: Vec<Vec<String>>,
    n_tables: usize,
}

impl PendingText {
    fn show(&mut self, ui: &mut Ui) {
        if !self.paragraph.is_empty() {
            ui.label(plain(&self.paragraph));
            self.paragraph.clear();
        }
        let n_columns = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        if n_columns == 0 {
            return;
        }
        self.n_tables += 1;
        let width = ui.available_width() / n_columns as f32 - 12.0;
        let grid = egui::Grid::new(self.n_tables).striped(true).max_col_width(width.max(60.0));
        grid.show(ui, |ui| {
            for (i, row) in self.rows.drain(..).enumerate() {
                for cell in row {
                    let cell = RichText::new(plain(&cell));
                    ui.label(if i == 0 { cell.strong() } else { cell });
                }
                ui.end_row();
            }
        });
    }
}

/// A page: headings are larger, code has letters of one width, paragraphs are filled.
fn text(markdown: &str, ui: &mut Ui) {
    let mut pending = PendingText::default();
    let mut is_code = false;
    for line in markdown.lines() {
        let is_fence = line.starts_with("```");
        let heading = line.trim_start_matches('#');
        let is_heading = !is_code && line.len() > heading.len();
        if !is_code && line.starts_with('|') {
            let cells = line.trim_matches('|').split(" | ").map(|cell| cell.trim().to_owned());
            let cells: Vec<String> = cells.collect();
            let is_rule = cells.iter().all(|cell| cell.chars().all(|c| "-:|".contains(c)));
            if !is_rule {
                pending.rows.push(cells);
            }
            continue;
        }
        let starts_anew =
            is_fence || is_code || is_heading || line.starts_with("- ") || line.is_empty();
        if starts_anew || !pending.rows.is_empty() {
            pending.show(ui);
        }
        if is_fence {
            is_code = !is_code;
        } else if is_heading {
            ui.add_space(6.0);
            ui.heading(heading.trim());
        } else if is_code {
            ui.label(RichText::new(line).monospace());
        } else if line.is_empty() {
            ui.add_space(4.0);
        } else if !line.starts_with("![") {
            if !pending.paragraph.is_empty() {
                pending.paragraph.push(' ');
            }
            pending.paragraph.push_str(line.trim());
        }
    }
    pending.show(ui);
}

/// A text without marks: of a link its words.
fn plain(markdown: &str) -> String {
    let mut text = String::with_capacity(markdown.len());
    let mut rest = markdown;
    while let Some((before, link)) = rest.split_once('[') {
        text.push_str(before);
        match link
            .split_once("](")
            .and_then(|(words, after)| Some((words, after.split_once(')')?.1)))
        {
            Some((words, after)) => {
                text.push_str(words);
                rest = after;
            }
            None => {
                text.push('[');
                rest = link;
            }
        }
    }
    text.push_str(rest);
    text.replace(['`', '*'], "")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_not_shown() {
        assert_eq!(plain("a **b** `c` [d e](f.md), g[0] [h"), "a b c d e, g[0] [h");
    }
}
