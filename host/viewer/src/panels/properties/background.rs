//! The background of the pictures: a colour, a gradient, nothing, or the environment.

use super::row_of;
use crate::document::{PaneSettings, Settings, USUAL_BACKGROUND};
use crate::window::Window;
use eframe::egui::{self, Role, Ui, WidgetInfo};
use surfelshop_api::params::{Value, linear_to_srgb, srgb_to_linear};
use surfelshop_image::display_transform::Background;

/// The renderer that can show the environment, and its parameter for that.
const RENDERER: &str = "environment";
const PARAMETER: &str = "background";

#[derive(Clone, Copy, PartialEq, Eq)]
enum Choice {
    Color,
    Gradient,
    Transparent,
    Environment,
}

impl Choice {
    const ALL: [Self; 4] = [Self::Color, Self::Gradient, Self::Transparent, Self::Environment];

    fn name(self) -> &'static str {
        match self {
            Self::Color => "colour",
            Self::Gradient => "gradient",
            Self::Transparent => "transparent",
            Self::Environment => "environment",
        }
    }

    fn of(settings: &Settings, focused: u32) -> Self {
        let shows = |value: &Value| matches!(value, Value::Text(text) if text != "none");
        let pane = settings.pane(focused).filter(|pane| draws_environment(pane));
        let value = pane.and_then(|pane| pane.values.get(RENDERER)?.get(PARAMETER));
        match settings.background {
            _ if value.is_some_and(shows) && settings.environment.is_some() => Self::Environment,
            Background::Color(_) => Self::Color,
            Background::Gradient { .. } => Self::Gradient,
            Background::Transparent => Self::Transparent,
        }
    }
}

fn draws_environment(pane: &PaneSettings) -> bool {
    pane.renderers[..pane.mode.sides()].iter().any(|name| name == RENDERER)
}

/// Shows the choice.
pub(super) fn show(window: &mut Window, ui: &mut Ui) {
    let focused = window.views.focused;
    let before = Choice::of(&window.settings, focused);
    let mut chosen = before;
    let pane = window.settings.pane(focused);
    let can_show = window.settings.environment.is_some() && pane.is_some_and(draws_environment);
    let settings = &mut window.settings;
    row_of(ui, "background", "What is behind what is open.", |ui, label| {
        let combo = egui::ComboBox::from_id_salt("background").selected_text(chosen.name());
        let n_buttons = if before == Choice::Gradient { 2.0 } else { 1.0 };
        let width = ui.available_width() - 52.0 * n_buttons;
        let shown = combo.width(width.max(60.0)).show_ui(ui, |ui| {
            for choice in Choice::ALL {
                let is_enabled = choice != Choice::Environment || can_show;
                ui.add_enabled_ui(is_enabled, |ui| {
                    let one = ui.selectable_value(&mut chosen, choice, choice.name());
                    one.on_disabled_hover_text(
                        "Choose an environment, and the renderer `environment`, first.",
                    );
                });
            }
        });
        let combo = shown.response;
        combo.widget_info(|| WidgetInfo::labeled(Role::ComboBox, true, "background"));
        match (before, &mut settings.background) {
            (Choice::Color, Background::Color(encoded)) => edit(ui, label, encoded),
            (Choice::Gradient, Background::Gradient { top, bottom }) => {
                edit(ui, label, top);
                edit(ui, label, bottom);
            }
            _ => {}
        }
        combo
    });
    if chosen != before {
        choose(settings, focused, chosen);
    }
}

/// A button with a colour, sRGB-encoded, that opens what changes it.
fn edit(ui: &mut Ui, label: egui::Id, encoded: &mut [f32; 3]) {
    let mut linear = encoded.map(srgb_to_linear);
    if ui.color_edit_button_rgb(&mut linear).labelled_by(label).changed() {
        *encoded = linear.map(linear_to_srgb);
    }
}

/// A gradient about a colour: lighter above and darker below by this share.
const GRADIENT_SHARE: f32 = 0.3;

fn gradient_about(encoded: [f32; 3]) -> Background {
    let scaled = |factor: f32| encoded.map(|channel| (channel * factor).clamp(0.0, 1.0));
    Background::Gradient { top: scaled(1.0 + GRADIENT_SHARE), bottom: scaled(1.0 - GRADIENT_SHARE) }
}

fn choose(settings: &mut Settings, focused: u32, choice: Choice) {
    settings.background = match (choice, settings.background) {
        (Choice::Transparent, _) => Background::Transparent,
        (Choice::Environment, background) => background,
        (Choice::Gradient, Background::Color(encoded)) => gradient_about(encoded),
        (Choice::Gradient, gradient @ Background::Gradient { .. }) => gradient,
        (Choice::Gradient, Background::Transparent) => USUAL_BACKGROUND,
        (Choice::Color, background) => {
            let mean = background.mean().or(USUAL_BACKGROUND.mean());
            mean.map_or(background, Background::Color)
        }
    };
    let Some(pane) = settings.pane_mut(focused).filter(|pane| draws_environment(pane)) else {
        return;
    };
    let values = pane.values.entry(RENDERER.to_owned()).or_default();
    match choice {
        Choice::Environment => {
            values.insert(PARAMETER.to_owned(), Value::Text("sharp".to_owned()));
        }
        Choice::Color | Choice::Gradient | Choice::Transparent => drop(values.remove(PARAMETER)),
    }
    if values.is_empty() {
        pane.values.remove(RENDERER);
    }
}
