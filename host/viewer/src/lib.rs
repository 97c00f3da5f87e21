//! The window: point clouds are viewed, and renderers are compared.
//!
//! `window` is the state and `app` runs each frame. `render_thread` draws the pictures, `views` shows
//! them, and `document` is what is open. `panels`, `dialogs`, `plugins`, `export`, `measure` and `start` are
//! around the views, and `orientation` is drawn over them. `commands` lists what the user can ask for; `theme` and
//! `preferences` say how the window looks.

mod app;
mod arguments;
mod commands;
mod desktop;
mod dialogs;
mod document;
mod export;
mod looks;
mod measure;
mod orientation;
mod panels;
mod plugins;
mod preferences;
mod render_thread;
mod start;
mod theme;
mod views;
mod window;

#[cfg(test)]
mod tests;

pub use arguments::ViewerArguments;

use anyhow::anyhow;
use document::unsaved_prompt::set_terminating;
use eframe::egui;
use std::sync::atomic::{AtomicBool, Ordering};
use surfelshop_runtime::plugins::{CrashGuard, leave, loader_is_busy};
use surfelshop_session::interrupt;

/// The exit code of an interrupted program, as in shells: 128 and the signal's number.
const INTERRUPTED: i32 = 130;

/// Pictures that a view at rest is the mean of where no scene says it: on edges as good as 16 levels.
const USUAL_ANTIALIAS: u32 = 16;

/// Opens the window and returns when it is closed.
///
/// # Errors
/// Where a file is missing or no window can be opened: one line.
pub fn run(arguments: &ViewerArguments) -> anyhow::Result<()> {
    if let Some(missing) = arguments.files.iter().find(|file| !file.exists()) {
        anyhow::bail!("{}: expected a cloud, found no such file", missing.display());
    }
    let closed = match surfelshop_render::has_graphics_card() {
        true => open(arguments, eframe::Renderer::Wgpu),
        // Software OpenGL paints the window in a fraction of the time that software Vulkan takes: it has ways of its own
        // for rectangles of one texture.
        false => open(arguments, eframe::Renderer::Glow).or_else(|error| match error {
            // Without a screen, or where the program itself could not start, Vulkan would not do either.
            eframe::Error::WinitEventLoop(_) | eframe::Error::AppCreation(_) => Err(error),
            error => {
                tracing::debug!("no window by OpenGL: {error}");
                open(arguments, eframe::Renderer::Wgpu)
            }
        }),
    };
    // A renderer that still draws its first picture is not reported as a crash.
    withdraw_crash_marks();
    if render_thread::any_abandoned() || loader_is_busy() {
        leave(i32::from(closed.is_err()));
    }
    closed.map_err(|error| {
        // Before the last colon come the names of libraries.
        let text = error.to_string();
        let reason = text.rsplit(": ").next().unwrap_or_default().trim_end_matches('.');
        anyhow!("no window could be opened: {reason}; `surfelshop render` needs none")
    })
}

/// Shows the window until it is closed.
fn open(arguments: &ViewerArguments, renderer: eframe::Renderer) -> eframe::Result {
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_title("Surfelshop")
            .with_app_id("surfelshop")
            .with_inner_size([1280.0, 800.0])
            .with_min_inner_size([480.0, 320.0]),
        renderer,
        wgpu_options: wgpu_options(),
        // Pictures are shown as they are, and every pixel of the window takes less.
        dithering: false,
        ..Default::default()
    };
    let arguments = arguments.clone();
    eframe::run_native(
        "surfelshop",
        options,
        Box::new(move |cc| {
            close_on_signal(&cc.egui_ctx);
            let mut window = window::Window::new(&cc.egui_ctx, &arguments)?;
            // A scene that is opened says how its views are.
            window.settings.antialias = USUAL_ANTIALIAS;
            window.document.usual_antialias = USUAL_ANTIALIAS;
            Ok(Box::new(window))
        }),
    )
}

/// The options of the window's own device, with textures as large as the adapter allows: several
/// screens side by side are wider than the default limit.
fn wgpu_options() -> eframe::egui_wgpu::WgpuConfiguration {
    use eframe::egui_wgpu::WgpuSetup;
    let mut options = eframe::NativeOptions::default().wgpu_options;
    if let WgpuSetup::CreateNew(setup) = &mut options.wgpu_setup {
        let usual = setup.device_descriptor.clone();
        setup.device_descriptor = std::sync::Arc::new(move |adapter| {
            let mut device = usual(adapter);
            let limits = &mut device.required_limits;
            limits.max_texture_dimension_2d =
                adapter.limits().max_texture_dimension_2d.max(limits.max_texture_dimension_2d);
            // The window holds few textures, which change often.
            device.memory_hints = eframe::wgpu::MemoryHints::MemoryUsage;
            device
        });
    }
    options
}

/// Closes the window when the system ends the program: at a logout, by `kill` or Ctrl C. A second
/// signal ends it at once.
fn close_on_signal(ctx: &egui::Context) {
    let ctx = ctx.clone();
    let signalled = AtomicBool::new(false);
    interrupt::on_request(move || {
        withdraw_crash_marks();
        set_terminating();
        if signalled.swap(true, Ordering::Relaxed) {
            leave(INTERRUPTED);
        }
        ctx.send_viewport_cmd(egui::ViewportCommand::Close);
        ctx.request_repaint();
    });
}

fn withdraw_crash_marks() {
    if let Some(guard) = CrashGuard::of_user() {
        guard.withdraw();
    }
}
