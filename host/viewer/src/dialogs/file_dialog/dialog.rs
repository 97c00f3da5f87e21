//! The dialog: it lists one folder, from which files are chosen by mouse, by arrow keys, or typed.
//! No file is overwritten without a question.

use super::listing::{Entry, Listing, list, typed};
use eframe::egui::text::{CCursor, CCursorRange};
use eframe::egui::text_edit::TextEditState;
use eframe::egui::{self, Align, Context, Id, Key, Label, Layout, Modal, Modifiers, RichText, Ui};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// How wide the dialog is, and how high its list, in points.
const WIDTH: f32 = 560.0;
const LIST_HEIGHT: f32 = 260.0;

/// The description of a dialog.
#[derive(Clone, Debug)]
pub(crate) struct Request {
    pub(crate) title: String,
    /// The name of files with these endings.
    pub(crate) filter: String,
    /// Endings of the files that are listed; none for all.
    pub(crate) endings: Vec<String>,
    pub(crate) purpose: Purpose,
}

/// Adds a missing ending to the name of a file.
#[derive(Clone)]
pub(crate) struct Completion(Arc<dyn Fn(&Path) -> PathBuf + Send + Sync>);

impl Completion {
    pub(crate) fn new(complete: impl Fn(&Path) -> PathBuf + Send + Sync + 'static) -> Self {
        Self(Arc::new(complete))
    }
}

impl std::fmt::Debug for Completion {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Completion")
    }
}

/// The use of the files.
#[derive(Clone, Debug)]
pub(crate) enum Purpose {
    /// One file is read.
    Open,
    /// One or more files are read.
    OpenSeveral,
    /// One file is written: the suggested name, and a function that adds a missing ending.
    Save { name: String, completed: Completion },
}

/// The result of a dialog.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    Cancelled,
    Chosen(Vec<PathBuf>),
}

/// An open dialog.
pub(crate) struct FileDialog {
    request: Request,
    /// Why the desktop's dialog is not used.
    why: String,
    folder: PathBuf,
    /// The text of the folder's field.
    folder_text: String,
    listing: Listing,
    /// Whether files of all endings are listed.
    all: bool,
    /// The entry of the cursor, and all chosen entries.
    at: Option<usize>,
    chosen: BTreeSet<usize>,
    /// Whether the list has to scroll to the cursor.
    follows: bool,
    name: String,
    /// What went wrong last, in one line.
    error: Option<String>,
    /// A file that would be overwritten, until the user has decided.
    overwrite: Option<PathBuf>,
    is_new: bool,
}

impl FileDialog {
    pub(crate) fn new(request: Request, folder: &Path, why: String) -> Self {
        let name = match &request.purpose {
            Purpose::Save { name, .. } => name.clone(),
            Purpose::Open | Purpose::OpenSeveral => String::new(),
        };
        let mut dialog = Self {
            request,
            why,
            folder: PathBuf::new(),
            folder_text: String::new(),
            listing: Listing::default(),
            all: false,
            at: None,
            chosen: BTreeSet::new(),
            follows: false,
            name,
            error: None,
            overwrite: None,
            is_new: true,
        };
        dialog.enter(folder);
        dialog
    }

    fn saves(&self) -> bool {
        matches!(self.request.purpose, Purpose::Save { .. })
    }

    fn endings(&self) -> &[String] {
        if self.all { &[] } else { &self.request.endings }
    }

    /// Lists a folder; the former one stays where it cannot be listed.
    fn enter(&mut self, folder: &Path) {
        let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
        match list(&folder, self.endings()) {
            Ok(listing) => {
                self.folder_text = folder.display().to_string();
                (self.folder, self.listing, self.error) = (folder, listing, None);
                (self.at, self.chosen) = (None, BTreeSet::new());
            }
            Err(error) => self.error = Some(format!("{}: {error}", folder.display())),
        }
    }

    /// Moves the cursor to an entry, and chooses it.
    fn select(&mut self, to: usize, also: bool) {
        let Some(entry) = self.listing.entries.get(to).cloned() else { return };
        let several = matches!(self.request.purpose, Purpose::OpenSeveral) && !entry.is_folder;
        if !(also && several) {
            self.chosen.clear();
        }
        if !self.chosen.remove(&to) {
            self.chosen.insert(to);
        }
        self.at = Some(to);
        if !entry.is_folder {
            self.name = entry.name();
        }
    }

    /// The action of Enter: enters a folder, or accepts a file.
    fn accept(&mut self) -> Option<Outcome> {
        let at = self.at.and_then(|at| self.listing.entries.get(at)).cloned();
        let files = self.chosen.iter().filter_map(|i| self.listing.entries.get(*i));
        let files: Vec<PathBuf> =
            files.filter(|entry| !entry.is_folder).map(|entry| entry.path.clone()).collect();
        if files.len() > 1 {
            return Some(Outcome::Chosen(files));
        }
        // The cursor identifies a file whose name is not UTF-8.
        let path = match &at {
            Some(entry) if entry.is_folder => entry.path.clone(),
            Some(entry) if entry.name() == self.name => entry.path.clone(),
            _ if self.name.trim().is_empty() => return None,
            _ => typed(&self.name, &self.folder),
        };
        if path.is_dir() {
            self.enter(&path);
            return None;
        }
        let Purpose::Save { completed, .. } = &self.request.purpose else {
            if path.exists() {
                return Some(Outcome::Chosen(vec![path]));
            }
            self.error = Some(format!("{}: there is no such file", path.display()));
            return None;
        };
        let path = completed.0(&path);
        if let Err(error) = surfelshop_session::output::files::check_folder(&path) {
            self.error = Some(format!("{error:#}"));
            return None;
        }
        if path.exists() {
            self.overwrite = Some(path);
            return None;
        }
        Some(Outcome::Chosen(vec![path]))
    }

    /// Shows the dialog; returns its result.
    pub(crate) fn show(&mut self, ctx: &Context) -> Option<Outcome> {
        let by_key = self.take_keys(ctx);
        let shown = Modal::new(Id::unique("file dialog")).show(ctx, |ui| {
            ui.set_width(WIDTH.min(ctx.content_rect().width() - 40.0));
            ui.heading(&self.request.title);
            ui.add(Label::new(RichText::new(&self.why).weak().small()).wrap());
            ui.add_space(4.0);
            match self.overwrite.clone() {
                Some(path) => self.ask(ui, &path),
                None => self.form(ui),
            }
        });
        by_key.or(shown.inner)
    }

    /// Arrow keys, Enter and Escape, with any focus; a focused button keeps its Enter.
    fn take_keys(&mut self, ctx: &Context) -> Option<Outcome> {
        let hit = |key: Key| ctx.input_mut(|input| input.consume_key(Modifiers::NONE, key));
        if self.overwrite.is_some() {
            if hit(Key::Escape) {
                self.overwrite = None;
            }
            return None;
        }
        if hit(Key::Escape) {
            return Some(Outcome::Cancelled);
        }
        let n = self.listing.entries.len();
        if hit(Key::ArrowDown) && n > 0 {
            self.select(self.at.map_or(0, |at| (at + 1).min(n - 1)), false);
            self.follows = true;
        }
        if hit(Key::ArrowUp) && n > 0 {
            self.select(self.at.map_or(n - 1, |at| at.saturating_sub(1)), false);
            self.follows = true;
        }
        // A text field handles its own Enter, after the typed text.
        if ctx.memory(|memory| memory.focused()).is_none() && hit(Key::Enter) {
            return self.accept();
        }
        None
    }

    fn form(&mut self, ui: &mut Ui) -> Option<Outcome> {
        self.folder_row(ui);
        let mut outcome = self.list(ui);
        if !self.request.endings.is_empty() {
            let text = format!("files of all kinds, not only {}", self.request.filter);
            if ui.checkbox(&mut self.all, text).changed() {
                let folder = self.folder.clone();
                self.enter(&folder);
            }
        }
        ui.horizontal(|ui| {
            let label = ui.label("name");
            let field = egui::TextEdit::singleline(&mut self.name).id(name_id());
            let field = ui.add(field.desired_width(f32::INFINITY)).labelled_by(label.id);
            if field.changed() {
                // Typed text replaces the choice.
                (self.at, self.chosen) = (None, BTreeSet::new());
            }
            let entered = is_entered(ui, &field);
            if std::mem::take(&mut self.is_new) {
                field.request_focus();
                select_all(ui, field.id, &self.name);
            }
            if entered {
                field.request_focus();
            }
            if entered {
                outcome = self.accept();
            }
        });
        if let Some(error) = &self.error {
            ui.colored_label(ui.visuals().error_fg_color, error);
        }
        ui.add_space(4.0);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let (text, n_files) = (if self.saves() { "save" } else { "open" }, self.chosen.len());
            let text =
                if n_files > 1 { format!("{text} {n_files} files") } else { text.to_owned() };
            if ui.button(text).clicked() {
                outcome = self.accept();
            }
            if ui.button("cancel").clicked() {
                outcome = Some(Outcome::Cancelled);
            }
        });
        outcome
    }

    /// The folder's field, and buttons that leave it.
    fn folder_row(&mut self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            let above = self.folder.parent().map(Path::to_owned);
            if ui.add_enabled(above.is_some(), egui::Button::new("up")).clicked()
                && let Some(above) = above
            {
                self.enter(&above);
            }
            if let Some(home) = std::env::home_dir()
                && ui.button("home").clicked()
            {
                self.enter(&home);
            }
            let label = ui.label("folder");
            let field = egui::TextEdit::singleline(&mut self.folder_text).id(folder_id());
            let field = ui.add(field.desired_width(f32::INFINITY)).labelled_by(label.id);
            if is_entered(ui, &field) {
                let folder = typed(&self.folder_text, &self.folder);
                self.enter(&folder);
            }
        });
    }

    fn list(&mut self, ui: &mut Ui) -> Option<Outcome> {
        let (mut clicked, mut outcome) = (None, None);
        let height =
            ui.text_style_height(&egui::TextStyle::Body) + 2.0 * ui.spacing().button_padding.y;
        let n = self.listing.entries.len();
        let mut area = egui::ScrollArea::vertical().auto_shrink(false).max_height(LIST_HEIGHT);
        if std::mem::take(&mut self.follows)
            && let Some(at) = self.at
        {
            let row = height + ui.spacing().item_spacing.y;
            area = area.vertical_scroll_offset((at as f32 * row - LIST_HEIGHT / 2.0).max(0.0));
        }
        egui::Frame::group(ui.style()).show(ui, |ui| {
            if n == 0 {
                ui.weak("nothing to list here");
            }
            area.show_rows(ui, height, n, |ui, rows| {
                for i in rows {
                    let Some(entry) = self.listing.entries.get(i) else { continue };
                    let row = row(ui, entry, self.chosen.contains(&i), height);
                    if row.double_clicked() {
                        clicked = Some((i, true));
                    } else if row.clicked() {
                        clicked = Some((i, false));
                    }
                }
            });
        });
        if self.listing.is_cut {
            ui.weak(format!("only {n} are listed; the others can be typed"));
        }
        if let Some((i, twice)) = clicked {
            self.select(i, ui.input(|input| input.modifiers.command) && !twice);
            if twice {
                outcome = self.accept();
            }
        }
        outcome
    }

    /// Asks whether a file may be overwritten.
    fn ask(&mut self, ui: &mut Ui, path: &Path) -> Option<Outcome> {
        ui.label(format!("{} is there already.", path.display()));
        ui.add_space(4.0);
        let mut outcome = None;
        ui.horizontal(|ui| {
            if ui.button("replace").clicked() {
                outcome = Some(Outcome::Chosen(vec![path.to_owned()]));
            }
            if ui.button("back").clicked() {
                self.overwrite = None;
            }
        });
        outcome
    }
}

/// Selects the text of a field, so that what is typed takes its place.
fn select_all(ui: &Ui, field: Id, text: &str) {
    let mut state = TextEditState::load(ui.ctx(), field).unwrap_or_default();
    let whole = CCursorRange::two(CCursor::default(), CCursor::new(text.chars().count()));
    state.cursor.set_char_range(Some(whole));
    state.store(ui.ctx(), field);
}

/// Whether Enter ended the text of a field.
fn is_entered(ui: &Ui, field: &egui::Response) -> bool {
    field.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter))
}

fn folder_id() -> Id {
    Id::unique("file dialog folder")
}

fn name_id() -> Id {
    Id::unique("file dialog name")
}

/// One line of the list.
fn row(ui: &mut Ui, entry: &Entry, chosen: bool, height: f32) -> egui::Response {
    let name = RichText::new(entry.name());
    let name = if entry.is_folder { name.strong() } else { name };
    let mut button =
        egui::Button::selectable(chosen, name).min_size([ui.available_width(), height].into());
    if !entry.is_folder {
        button = button.right_text(RichText::new(size(entry.len)).weak());
    }
    ui.add(button.truncate())
}

/// The size of a file as text.
fn size(bytes: u64) -> String {
    match bytes {
        0..1_000 => format!("{bytes} B"),
        1_000..1_000_000 => format!("{:.0} kB", bytes as f64 / 1e3),
        1_000_000..1_000_000_000 => format!("{:.1} MB", bytes as f64 / 1e6),
        _ => format!("{:.1} GB", bytes as f64 / 1e9),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui_kittest::Harness;

    #[test]
    fn what_is_typed_takes_the_place_of_the_name_that_is_proposed() {
        let folder = tempfile::tempdir().unwrap();
        let completed = Completion::new(Path::to_owned);
        let request = Request {
            title: "Save the scene".to_owned(),
            filter: "scenes".to_owned(),
            endings: Vec::new(),
            purpose: Purpose::Save { name: "usual.scene.toml".to_owned(), completed },
        };
        let dialog = FileDialog::new(request, folder.path(), String::new());
        let mut harness = Harness::builder().build_ui_state(
            |ui, dialog: &mut FileDialog| {
                assert_eq!(dialog.show(ui.ctx()), None);
            },
            dialog,
        );
        harness.run_steps(4);
        harness.event(egui::Event::Text("other".to_owned()));
        harness.run_steps(2);
        assert_eq!(harness.state().name, "other");
    }
}
