//! The menu, the keys that do the same, and the windows that menus open.

use super::canvas;
use super::darkroom::Task;
use super::dialogs::{open_dialog, save_cloud, save_scene, scene_dialog};
use super::export;
use super::history::State;
use super::leaving;
use super::navigation;
use super::plugin_list;
use super::recovery::{self, Recovery};
use super::settings::Mode;
use super::tool_window;
use super::trust;
use super::window::Window;
use eframe::egui::{self, Context, Key, KeyboardShortcut, Modifiers, Ui};
use surfelshop_api::UnitKind;

/// Windows beside the panels, open or not.
#[derive(Default)]
pub(crate) struct OpenWindows {
    plugins: bool,
    keys: bool,
}

const OPEN: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::O);
const SAVE: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::S);
const SAVE_AS: KeyboardShortcut =
    KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::S);
const QUIT: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::Q);
const UNDO: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::Z);
const REDO: KeyboardShortcut =
    KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::Z);
const PICTURE: KeyboardShortcut = KeyboardShortcut::new(Modifiers::COMMAND, Key::P);
const FRAME: KeyboardShortcut = KeyboardShortcut::new(Modifiers::NONE, Key::F);
const PROJECTION: KeyboardShortcut = KeyboardShortcut::new(Modifiers::NONE, Key::O);
const FLICKER: KeyboardShortcut = KeyboardShortcut::new(Modifiers::NONE, Key::Space);
const NEXT_RENDERER: KeyboardShortcut = KeyboardShortcut::new(Modifiers::NONE, Key::R);
const MEASURE: KeyboardShortcut = KeyboardShortcut::new(Modifiers::NONE, Key::M);
const SPLIT: KeyboardShortcut = KeyboardShortcut::new(Modifiers::NONE, Key::N);

/// What the keys do, for the help window.
const KEYS: [(&str, &str); 16] = [
    ("drag", "orbit"),
    ("right or middle drag, Shift drag", "pan"),
    ("Ctrl drag", "look around"),
    ("wheel", "zoom to the pointer"),
    ("double click", "orbit about the surface under the pointer"),
    ("drag a lamp; Shift or Alt drag", "move the light across; nearer or farther"),
    ("W A S D, E Q", "fly: forward, left, back, right, up, down"),
    ("F", "see everything"),
    ("O", "perspective or parallel projection"),
    ("R", "next renderer"),
    ("1 … 5", "single, side by side, wipe, flicker, difference"),
    ("Space", "the other picture of a flicker"),
    ("N", "split the view"),
    ("M", "measure what is shown, and error against time"),
    ("Ctrl O, Ctrl S, Ctrl P, Ctrl Q", "open, save the scene, save pictures, quit"),
    ("Ctrl Z, Ctrl Shift Z", "undo, redo"),
];

/// The menu bar.
pub(crate) fn show(window: &mut Window, ui: &mut Ui) {
    let ctx = ui.ctx().clone();
    egui::MenuBar::new().ui(ui, |ui| {
        ui.menu_button("File", |ui| {
            if item(ui, "Open …", &OPEN) {
                open_dialog(window, &ctx);
            }
            recent(window, ui, &ctx);
            if item(ui, "Save scene", &SAVE) {
                save_scene(window, &ctx);
            }
            if item(ui, "Save scene as …", &SAVE_AS) {
                scene_dialog(window, &ctx);
            }
            save_cloud(window, ui, &ctx);
            if item(ui, "Save pictures …", &PICTURE) {
                window.export_window.open = true;
            }
            ui.separator();
            if item(ui, "Quit", &QUIT) {
                ctx.send_viewport_cmd(egui::ViewportCommand::Close);
            }
        });
        ui.menu_button("Edit", |ui| {
            let now = window.state();
            let (undo, redo) = (window.history.has_undo(&now), window.history.has_redo(&now));
            ui.add_enabled_ui(undo, |ui| {
                if item(ui, "Undo", &UNDO) {
                    step_back(window);
                }
            });
            ui.add_enabled_ui(redo, |ui| {
                if item(ui, "Redo", &REDO) {
                    step_forward(window);
                }
            });
        });
        ui.menu_button("Tools", |ui| tool_window::menu(window, ui));
        ui.menu_button("View", |ui| {
            if item(ui, "See everything", &FRAME) {
                window.frame_all();
            }
            if item(ui, "Perspective or parallel", &PROJECTION) {
                toggle_projection(window);
            }
            if item(ui, "Next renderer", &NEXT_RENDERER) {
                next_renderer(window);
            }
            if item(ui, "Split", &SPLIT) {
                split(window);
            }
            if item(ui, "Measure", &MEASURE) {
                toggle_measure(window);
            }
            ui.separator();
            ui.checkbox(&mut window.adaptive, "Draw less while something moves");
        });
        ui.menu_button("Help", |ui| {
            ui.checkbox(&mut window.open_windows.plugins, "Plugins");
            ui.checkbox(&mut window.messages.open, "Messages");
            ui.checkbox(&mut window.open_windows.keys, "Mouse and keys");
        });
    });
}

/// Files opened lately, and what was shown when the program ended.
fn recent(window: &mut Window, ui: &mut Ui, ctx: &Context) {
    let mut chosen = None;
    ui.menu_button("Open recent", |ui| {
        for path in &window.recent {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            if ui.button(name).on_hover_text(path.display().to_string()).clicked() {
                chosen = Some(path.clone());
                ui.close();
            }
        }
        let last = window.memory.as_ref().and_then(|memory| memory.scene_before());
        if let Some(last) = last
            && ui.button("the last session").clicked()
        {
            chosen = Some(last);
            ui.close();
        }
    });
    if let Some(path) = chosen {
        window.open(ctx, vec![path]);
    }
}

fn item(ui: &mut Ui, text: &str, shortcut: &KeyboardShortcut) -> bool {
    let shortcut = ui.ctx().format_shortcut(shortcut);
    let clicked = ui.add(egui::Button::new(text).shortcut_text(shortcut)).clicked();
    if clicked {
        ui.close();
    }
    clicked
}

/// Obeys the keys.
pub(crate) fn take_keys(window: &mut Window, ctx: &Context) {
    let asks = window.leaving.is_some() || window.recovery.as_ref().is_some_and(Recovery::asks);
    if ctx.egui_wants_keyboard_input() || asks || window.dialogs.own_is_open() {
        return;
    }
    let pressed =
        |shortcut: &KeyboardShortcut| ctx.input_mut(|input| input.consume_shortcut(shortcut));
    // The longer one first: its modifiers include the other's.
    if pressed(&REDO) {
        step_forward(window);
    }
    if pressed(&UNDO) {
        step_back(window);
    }
    if pressed(&OPEN) {
        open_dialog(window, ctx);
    }
    if pressed(&SAVE_AS) {
        scene_dialog(window, ctx);
    }
    if pressed(&SAVE) {
        save_scene(window, ctx);
    }
    if pressed(&PICTURE) {
        window.export_window.open = true;
    }
    if pressed(&QUIT) {
        ctx.send_viewport_cmd(egui::ViewportCommand::Close);
    }
    if pressed(&FRAME) {
        window.frame_all();
    }
    if pressed(&PROJECTION) {
        toggle_projection(window);
    }
    if pressed(&MEASURE) {
        toggle_measure(window);
    }
    // Keys that were hit several times within a frame count as often.
    let times = |shortcut: &KeyboardShortcut| {
        ctx.input_mut(|input| input.count_and_consume_key(shortcut.modifiers, shortcut.logical_key))
    };
    for _ in 0..times(&NEXT_RENDERER) {
        next_renderer(window);
    }
    for _ in 0..times(&SPLIT) {
        split(window);
    }
    if pressed(&FLICKER)
        && let Some(pane) = window.panes.get_mut(&window.focused)
    {
        pane.flicker = !pane.flicker;
    }
    let keys = [Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5];
    for (key, mode) in keys.into_iter().zip(Mode::ALL) {
        if pressed(&KeyboardShortcut::new(Modifiers::NONE, key))
            && let Some(pane) = window.settings.pane_mut(window.focused)
        {
            pane.mode = mode;
        }
    }
}

fn step_back(window: &mut Window) {
    let state = window.history.undo(&window.state());
    show_again(window, state);
}

fn step_forward(window: &mut Window) {
    let state = window.history.redo(&window.state());
    show_again(window, state);
}

/// Shows what was shown before.
fn show_again(window: &mut Window, state: Option<State>) {
    let Some(State { settings, stock }) = state else { return };
    window.settings = settings;
    canvas::follow_settings(window);
    if let Some(stock) = stock {
        window.restock(stock);
    }
}

fn split(window: &mut Window) {
    let mut tree =
        std::mem::replace(&mut window.tree, egui_tiles::Tree::empty(egui::Id::unique("panes")));
    canvas::split(window, &mut tree, window.focused);
    window.tree = tree;
}

fn toggle_projection(window: &mut Window) {
    let mut camera = window.camera_of(window.focused);
    navigation::toggle_projection(&mut camera, 35f64.to_radians());
    window.set_camera(window.focused, camera);
}

fn toggle_measure(window: &mut Window) {
    window.measure.form.open = !window.measure.form.open;
}

fn next_renderer(window: &mut Window) {
    let names = window.renderers();
    if let Some(pane) = window.settings.pane_mut(window.focused) {
        let at = names.iter().position(|name| *name == pane.renderers[0]).map_or(0, |at| at + 1);
        // Beside another one, that one is passed over where there is a third.
        let beside = |name: &str| pane.mode.sides() == 2 && name == pane.renderers[1];
        let after = names.iter().cycle().skip(at).take(names.len());
        if let Some(name) = after.clone().find(|name| !beside(name)).or(after.clone().next()) {
            let name = name.clone();
            pane.renderers[0] = name;
        }
    }
}

/// The windows that are open.
pub(crate) fn show_windows(window: &mut Window, ctx: &Context) {
    export::show(window, ctx);
    tool_window::show(window, ctx);
    ask_about_crash(window, ctx);
    leaving::show(window, ctx);
    // One question at a time.
    match window.crash.is_none() && window.recovery.as_ref().is_some_and(Recovery::asks) {
        true => recovery::ask(window, ctx),
        false => trust::ask(window, ctx),
    }
    window.messages.show_all(ctx);
    let mut open = window.open_windows.plugins;
    let plugins = egui::Window::new("Plugins").open(&mut open).default_width(1100.0);
    plugins.show(ctx, |ui| plugin_list::show(window, ui));
    window.open_windows.plugins = open;
    egui::Window::new("Mouse and keys").open(&mut window.open_windows.keys).show(ctx, |ui| {
        egui::Grid::new("keys").num_columns(2).striped(true).show(ui, |ui| {
            for (keys, what) in KEYS {
                ui.strong(keys);
                ui.label(what);
                ui.end_row();
            }
        });
    });
}

/// Offers to go on without the plugin that was at work when the program crashed.
fn ask_about_crash(window: &mut Window, ctx: &Context) {
    let Some(crash) = window.crash.clone() else { return };
    let modal = egui::Modal::new(egui::Id::unique("crash"));
    modal.show(ctx, |ui| {
        ui.heading("The program ended unexpectedly the last time");
        ui.label(format!(
            "{} was being tried, from {}. That may or may not be the cause.",
            crash.unit, crash.file
        ));
        ui.horizontal(|ui| {
            if ui.button("start without it").clicked() {
                let unit = crash.unit.rsplit('/').next().unwrap_or_default().to_owned();
                let is = |kind: UnitKind| crash.unit.starts_with(kind.word());
                match (is(UnitKind::Tool), is(UnitKind::Tracer)) {
                    (true, _) => window.tools.shelf.avoid(unit),
                    (_, true) => window.measure.shelf.avoid(unit),
                    _ => avoid(window, unit),
                }
                (window.crash, window.crash_mark) = (None, None);
            }
            if ui.button("use it all the same").clicked() {
                (window.crash, window.crash_mark) = (None, None);
            }
        });
    });
}

/// Shows views with another renderer than this one.
fn avoid(window: &mut Window, renderer: String) {
    // The plainest one, where it is there.
    let mut others = window.renderers();
    others.retain(|name| *name != renderer);
    let other = others.iter().find(|name| *name == "flat").or(others.first()).cloned();
    for pane in &mut window.settings.panes {
        for name in &mut pane.renderers {
            if *name == renderer
                && let Some(other) = &other
            {
                name.clone_from(other);
            }
        }
    }
    window.darkroom.add(Task::Avoid(renderer));
}
