//! The page of trusted plugins: whose code may run, and how that is taken back.

use crate::render_thread::RenderCommand;
use crate::theme::{dismiss, space};
use crate::window::Window;
use eframe::egui::{Label, RichText, Ui};
use surfelshop_session::trust_file::TrustFile;

/// What is taken back.
enum Removed {
    Build(usize),
    Place(usize),
}

/// Shows the page.
pub(super) fn show(window: &mut Window, ui: &mut Ui) {
    let named = window.plugins.trust_file.clone();
    let trusted = window.panels.settings.trusted.get_or_insert_with(|| {
        TrustFile::named(named.as_deref()).map_err(|error| format!("{error:#}"))
    });
    ui.add(
        Label::new(
            "The code of these plugins may run. Plugins that came with the program always may.",
        )
        .wrap(),
    );
    ui.add_space(space::SMALL);
    let mut removed = None;
    match trusted {
        Err(reason) => {
            let text = RichText::new(reason.as_str()).color(ui.visuals().error_fg_color);
            ui.add(Label::new(text).wrap());
        }
        Ok(list) if list.builds.is_empty() && list.places.is_empty() => {
            ui.weak("None was trusted yet: the program asks when it finds one.");
        }
        Ok(list) => {
            for (i, build) in list.builds.iter().enumerate() {
                let name = if build.package.is_empty() { "a plugin" } else { &build.package };
                let about = format!("this build of {}", build.file.display());
                if row(ui, name, &about) {
                    removed = Some(Removed::Build(i));
                }
            }
            for (i, place) in list.places.iter().enumerate() {
                let file = place.file.display().to_string();
                if row(ui, &file, "whatever is built there") {
                    removed = Some(Removed::Place(i));
                }
            }
        }
    }
    if let Some(removed) = removed {
        take_back(window, &removed);
    }
    ui.add_space(space::MEDIUM);
    ui.weak("What runs already goes on until the window is closed.");
    if ui.button("all plugins …").clicked() {
        window.panels.plugin_list = true;
    }
}

fn row(ui: &mut Ui, name: &str, about: &str) -> bool {
    ui.horizontal(|ui| {
        let is_removed = dismiss(ui, &format!("do not trust {name}"));
        ui.vertical(|ui| {
            ui.add(Label::new(RichText::new(name).strong()).wrap());
            ui.add(Label::new(RichText::new(about).weak()).wrap());
        });
        is_removed
    })
    .inner
}

fn take_back(window: &mut Window, removed: &Removed) {
    let Some(Ok(shown)) = &window.panels.settings.trusted else { return };
    let shown = shown.clone();
    let changed = TrustFile::path(window.plugins.trust_file.as_deref()).and_then(|path| {
        TrustFile::change(&path, |list| {
            // As it was shown: others may have changed the list.
            match removed {
                Removed::Build(i) => {
                    let gone = shown.builds.get(*i);
                    list.builds.retain(|build| Some(build) != gone);
                }
                Removed::Place(i) => {
                    let gone = shown.places.get(*i);
                    list.places.retain(|place| Some(place) != gone);
                }
            }
            Ok(())
        })
    });
    window.panels.settings.trusted = None;
    match changed {
        Ok(()) => window.render.thread.add(RenderCommand::Trust(None)),
        Err(error) => window.messages.warn(format!("{error:#}")),
    }
}
