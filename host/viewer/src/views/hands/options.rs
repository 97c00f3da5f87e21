//! What a hand does, in a small window over the pictures: how large it is, what else is selected, and the parameters of
//! a tool.

use super::handles;
use super::pairs::{self, can_be_picked};
use super::state::HandMode;
use crate::commands::{find, icon_button};
use crate::dialogs::{ParameterOwner, files};
use crate::panels::parameters;
use crate::plugins::{Readiness, title_and_summary};
use crate::theme::space;
use crate::views::measuring;
use crate::window::Window;
use eframe::egui::{self, ComboBox, Context, DragValue, Rect, Slider, TextEdit, Ui, vec2};
use surfelshop_api::{Dabs, Falloff, Reach};
use surfelshop_cloud::in_groups;

/// Radii that can be chosen, shares of the picture's height.
const RADII: std::ops::RangeInclusive<f32> = 0.002..=0.4;

/// Shows it where a hand does something else than to move the camera.
pub(crate) fn show(window: &mut Window, ctx: &Context, pictures: Rect) {
    let mode = window.views.hands.mode.clone();
    if mode == HandMode::Camera || window.document.clouds.is_none() {
        return;
    }
    let title = match &mode {
        HandMode::Tool(name) => {
            title_and_summary(window, name).map_or_else(|| name.clone(), |(title, _)| title)
        }
        HandMode::Measure(_) => "Measure".to_owned(),
        HandMode::Pairs => pairs_title(window),
        _ => "Select".to_owned(),
    };
    let mut open = true;
    egui::Window::new(title)
        .id(egui::Id::unique("hand"))
        .open(&mut open)
        .resizable(false)
        .default_width(270.0)
        // Below the views' rows and captions, where neither legend nor scale bar nor axes are.
        .default_pos(pictures.min + vec2(space::MEDIUM, 70.0))
        .show(ctx, |ui| {
            ui.set_max_width(300.0);
            match &mode {
                HandMode::Tool(name) => tool(window, ui, name),
                HandMode::Measure(kind) => measuring::show_options(window, ui, *kind),
                HandMode::Pairs => pairs::show_options(window, ui),
                _ => select(window, ui),
            }
        });
    if !open {
        window.end_pairs();
        window.views.hands.mode = HandMode::Camera;
    }
}

/// The tool that pairs are clicked for.
fn pairs_title(window: &Window) -> String {
    let tool = window.views.hands.pairing.as_ref().map(|pairing| pairing.tool.as_str());
    let title = tool.and_then(|tool| title_and_summary(window, tool));
    title.map_or_else(|| "Pairs".to_owned(), |(title, _)| format!("{title}: pairs"))
}

fn radius(window: &mut Window, ui: &mut Ui) {
    let slider = Slider::new(&mut window.views.hands.radius, RADII)
        .logarithmic(true)
        .text("radius")
        .custom_formatter(|share, _| format!("{:.1} %", 100.0 * share));
    ui.add(slider).on_hover_text("Share of the picture's height; [ and ] change it.");
}

fn select(window: &mut Window, ui: &mut Ui) {
    ui.horizontal(|ui| {
        for id in ["select-rectangle", "select-lasso", "select-brush", "select-box", "select-plane"]
        {
            icon_button(window, ui, id);
        }
        ui.separator();
        for id in ["select-all", "select-invert", "select-grow", "select-shrink"] {
            icon_button(window, ui, id);
        }
    });
    match window.views.hands.mode {
        HandMode::Box | HandMode::Plane => handles::show_options(window, ui),
        HandMode::Brush => radius(window, ui),
        _ => {
            ui.checkbox(&mut window.views.hands.through, "also what lies behind")
                .on_hover_text("Selects all that is in the shape, and not only what is seen.");
        }
    }
    if window.views.hands.mode.selects() {
        ui.weak("Shift adds, Ctrl removes, Shift+Ctrl intersects.");
    }
    let (n, of) = window.n_selected();
    ui.separator();
    let about = window.about_selected();
    ui.label(format!("{about}{} of {} surfels", in_groups(n as u64), in_groups(of as u64)));
    if n == 0 {
        return;
    }
    ui.horizontal(|ui| {
        for id in ["surfels-delete", "surfels-crop", "surfels-split"] {
            if let Some(command) = find(id)
                && ui.button(command.name).on_hover_text(command.about).clicked()
            {
                (command.run)(window, &ui.ctx().clone());
            }
        }
    });
    ui.horizontal(|ui| {
        let label = ui.label("set");
        let (name, value) = &mut window.views.hands.value;
        ui.add(TextEdit::singleline(name).desired_width(100.0)).labelled_by(label.id);
        ui.add(DragValue::new(value).speed(1.0)).labelled_by(label.id);
        let about = "Writes the number into this column of what is selected.";
        if ui.button("set value").on_hover_text(about).clicked() {
            window.set_value_of_surfels();
        }
    });
}

fn tool(window: &mut Window, ui: &mut Ui, name: &str) {
    let names = window.hand_tools();
    let mut chosen = name.to_owned();
    ui.horizontal(|ui| {
        let label = ui.label("tool");
        let combo = ComboBox::from_id_salt("hand tool").selected_text(&chosen);
        let shown = combo.show_ui(ui, |ui| {
            for name in names {
                ui.selectable_value(&mut chosen, name.clone(), name);
            }
        });
        shown.response.labelled_by(label.id);
    });
    if chosen != name {
        return window.take_tool(chosen);
    }
    if let Some((_, summary)) = title_and_summary(window, name) {
        ui.weak(summary);
    }
    radius(window, ui);
    window.plugins.tools.units.prepare(ui.ctx(), &window.plugins.registry, name);
    let (declared, handling) = match window.plugins.tools.units.readiness(name) {
        Readiness::Loading => {
            ui.spinner();
            return;
        }
        Readiness::Refused(reason) => {
            ui.colored_label(ui.visuals().error_fg_color, reason.to_owned());
            return;
        }
        Readiness::Ready(unit) => (unit.description.params.clone(), unit.description.handling),
    };
    let before = window.dabs_of(handling);
    let after = dabs(ui, before);
    if after != before {
        window.views.hands.dabs = Some(after);
    }
    ui.separator();
    let values = window.plugins.tools.values.entry(name.to_owned()).or_default();
    if let Some(parameter) = parameters::show_of_tool(ui, &declared, values) {
        if can_be_picked(&parameter) {
            return window.pick_pairs(ui.ctx(), name, &parameter.id, &declared);
        }
        let owner = ParameterOwner::Tool(name.to_owned());
        files::open_for_parameter(window, ui.ctx(), owner, &parameter);
    }
    if window.color_parameter(name).is_some() {
        ui.weak("Ctrl and a click take the colour under the pointer.");
    }
    let (n, _) = window.n_selected();
    if n > 0 {
        ui.weak(format!("Works on the {} selected surfels alone.", in_groups(n as u64)));
    }
    if !window.views.hands.said.is_empty() {
        ui.weak(&window.views.hands.said);
    }
}

/// How strokes are made.
fn dabs(ui: &mut Ui, mut dabs: Dabs) -> Dabs {
    ui.horizontal(|ui| {
        let label = ui.label("edge");
        let combo = ComboBox::from_id_salt("falloff").selected_text(dabs.falloff.name());
        let shown = combo.width(90.0).show_ui(ui, |ui| {
            for falloff in Falloff::ALL {
                ui.selectable_value(&mut dabs.falloff, falloff, falloff.name());
            }
        });
        shown.response.labelled_by(label.id);
        let mut is_all = dabs.reach == Reach::Volume;
        ui.checkbox(&mut is_all, "both sides")
            .on_hover_text("Also surfels that face the other way than what is under the pointer.");
        dabs.reach = if is_all { Reach::Volume } else { Reach::Facing };
    });
    dabs
}
