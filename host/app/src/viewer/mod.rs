//! The window: look at clouds, switch renderers, put two beside each other.
//!
//! What is shown and how is in `settings`, the clouds are in `stock`; `history` undoes changes of both. `window` runs each frame and places
//! the orders, `worker` makes the pictures on a thread of its own, which `darkroom` leads to, `news`
//! takes those that come back, `pane` keeps them, `canvas` takes the mouse and `paint` shows them; `lamps` are the lights over them that can be dragged.
//! `tools` runs tools over clouds. `opened` and `saving` read and write clouds and scenes, `panels`, `menus`, `dialogs` and `tool_window` are what stands around.
//! `measure` measures what is shown.

mod arrangement;
mod arriving;
mod canvas;
mod compare;
mod darkroom;
mod detail;
mod dialogs;
mod export;
mod file_dialog;
mod film;
mod history;
mod lamps;
mod leaving;
mod lights;
mod loading;
mod made_of;
mod measure;
mod memory;
mod menus;
mod messages;
mod navigation;
mod news;
mod opened;
mod paint;
mod pane;
mod panels;
mod parameters;
mod plugin_list;
mod portal;
mod presets;
mod recovery;
mod saving;
mod scene_file;
mod settings;
mod shelf;
mod sight;
mod stock;
mod surfel;
mod surroundings;
mod timings;
mod tool_window;
mod tools;
mod trust;
mod window;
mod worker;

use crate::arguments::ViewerArguments;
use crate::interrupt;
use anyhow::anyhow;
use eframe::egui;
use std::sync::atomic::{AtomicBool, Ordering};
use surfelshop_engine::plugins;

/// Opens the window and returns when it is closed.
pub(crate) fn run(arguments: &ViewerArguments) -> anyhow::Result<()> {
    if let Some(missing) = arguments.files.iter().find(|file| !file.exists()) {
        anyhow::bail!("{}: expected a cloud, found no such file", missing.display());
    }
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_title("Surfelshop")
            .with_app_id("surfelshop")
            .with_inner_size([1280.0, 800.0])
            .with_min_inner_size([480.0, 320.0]),
        wgpu_options: for_any_screen(),
        ..Default::default()
    };
    let arguments = arguments.clone();
    let closed = eframe::run_native(
        "surfelshop",
        options,
        Box::new(move |cc| {
            close_when_asked(&cc.egui_ctx);
            Ok(Box::new(window::Window::new(&cc.egui_ctx, &arguments)?))
        }),
    );
    // A renderer that is still at its first picture is left behind, not crashed.
    withdraw_marks();
    if darkroom::was_abandoned() || plugins::loader_is_busy() {
        plugins::leave(i32::from(closed.is_err()));
    }
    closed.map_err(|error| {
        // What comes before the last colon are places in libraries.
        let text = error.to_string();
        let reason = text.rsplit(": ").next().unwrap_or_default().trim_end_matches('.');
        anyhow!("no window could be opened: {reason}; `surfelshop render` needs none")
    })
}

/// The window's own device, with pictures as large as its adapter allows: several screens side by
/// side are wider than what every adapter has.
fn for_any_screen() -> eframe::egui_wgpu::WgpuConfiguration {
    use eframe::egui_wgpu::WgpuSetup;
    let mut options = eframe::NativeOptions::default().wgpu_options;
    if let WgpuSetup::CreateNew(setup) = &mut options.wgpu_setup {
        let usual = setup.device_descriptor.clone();
        setup.device_descriptor = std::sync::Arc::new(move |adapter| {
            let mut device = usual(adapter);
            let limits = &mut device.required_limits;
            limits.max_texture_dimension_2d =
                adapter.limits().max_texture_dimension_2d.max(limits.max_texture_dimension_2d);
            // It holds a few pictures, which come and go.
            device.memory_hints = eframe::wgpu::MemoryHints::MemoryUsage;
            device
        });
    }
    options
}

/// Closes the window when the system asks the program to end: at a logout, by `kill` or Ctrl C.
/// A second request ends it at once.
fn close_when_asked(ctx: &egui::Context) {
    let ctx = ctx.clone();
    let asked = AtomicBool::new(false);
    interrupt::on_request(move || {
        withdraw_marks();
        leaving::end();
        if asked.swap(true, Ordering::Relaxed) {
            plugins::leave(INTERRUPTED);
        }
        ctx.send_viewport_cmd(egui::ViewportCommand::Close);
        ctx.request_repaint();
    });
}

/// Exit code of a program that was interrupted, as shells count it: 128 and the signal's number.
const INTERRUPTED: i32 = 130;

fn withdraw_marks() {
    if let Some(marks) = plugins::Marks::of_user() {
        marks.withdraw();
    }
}

#[cfg(test)]
mod tests;
