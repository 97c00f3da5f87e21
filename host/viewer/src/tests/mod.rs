//! Tests of the whole window without a screen.

mod antialias;
mod colors;
mod commands;
mod edits;
mod files;
mod hands;
mod light_handles;
mod measure;
mod measuring;
mod memory_use;
mod outliner;
mod plugins;
mod previews;
mod refining;
mod scenes;
mod tools;
mod traced;
mod trust;
mod views;

use crate::ViewerArguments;
use crate::commands::Keymap;
use crate::render_thread::Detail;
use crate::render_thread::ViewRequest;
use crate::window::Window;
use eframe::egui::{Context, Vec2};
use egui_kittest::Harness;
use std::path::PathBuf;
use std::time::{Duration, Instant};
use surfelshop_session::options::DeviceArguments;
use surfelshop_session::options::PluginFiles;
use surfelshop_session::options::UpAxis;

const SAMPLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/sample.ply");

/// More than any step takes on a busy machine: a test that waits this long has failed.
const TIMEOUT: Duration = Duration::from_secs(120);

/// The built plugins, one folder above the test program.
fn built_plugins() -> PluginFiles {
    let test = std::env::current_exe().unwrap();
    let folder = test.ancestors().nth(2).unwrap();
    let file = |name: &str| {
        let (prefix, suffix) = (std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
        let path = folder.join(format!("{prefix}{name}{suffix}"));
        assert!(path.exists(), "{} is missing: `cargo verify` builds it", path.display());
        path
    };
    let plugin = ["flat", "ewa_phong", "environment", "procedural"]
        .map(|id| file(&format!("surfelshop_{id}")));
    let plugin = plugin.to_vec();
    PluginFiles { plugin, trust: true, ..PluginFiles::default() }
}

/// A window with a test harness.
struct Screen {
    harness: Harness<'static, Window>,
}

impl Screen {
    fn open(files: &[&str]) -> Self {
        Self::with(&ViewerArguments {
            memory: None,
            in_place: false,
            colors: Default::default(),
            files: files.iter().map(PathBuf::from).collect(),
            up: UpAxis::Y,
            plugins: built_plugins(),
            device: DeviceArguments::default(),
        })
    }

    fn with(arguments: &ViewerArguments) -> Self {
        // The harness has a context of its own; this one wakes nothing.
        let mut window = Window::new(&Context::default(), arguments).unwrap();
        // A crash of another program must not affect the test.
        (window.plugins.crash, window.plugins.crash_mark) = (None, None);
        (window.document.state_folder, window.document.recovery) = (None, None);
        // Nor must what the user of this machine chose.
        (window.preferences, window.preference_file) = Default::default();
        window.keymap = Keymap::default();
        let harness = Harness::builder()
            .with_size(Vec2::new(900.0, 640.0))
            .build_ui_state(|ui, window: &mut Window| window.frame(ui), window);
        Self { harness }
    }

    fn window(&mut self) -> &mut Window {
        self.harness.state_mut()
    }

    /// Runs frames until a condition holds.
    #[track_caller]
    fn until(&mut self, what: &str, mut holds: impl FnMut(&mut Window) -> bool) {
        let started = Instant::now();
        loop {
            self.harness.step();
            if holds(self.harness.state_mut()) {
                return;
            }
            let message = self.harness.state().messages.last().map(str::to_owned);
            assert!(started.elapsed() < TIMEOUT, "waited for {what}; message: {message:?}");
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// Runs as many frames as a menu or window takes to open.
    fn frames(&mut self) {
        for _ in 0..4 {
            self.harness.step();
        }
    }

    /// Runs frames until all pictures are there in full detail.
    #[track_caller]
    fn settle(&mut self) {
        self.until("the pictures", |window| {
            window.settings.panes.iter().all(|settings| {
                let pane = &window.views.panes[&settings.id];
                pane.sides[..settings.mode.sides()].iter().enumerate().all(|(i, side)| {
                    let shown = side.shown.as_ref();
                    side.is_converged()
                        && shown.is_some_and(|s| s.renderer == settings.renderers[i])
                })
            })
        });
    }

    fn sample() -> Self {
        let mut screen = Self::open(&[SAMPLE]);
        screen.settle();
        screen
    }
}

/// A request for the first view's picture by another renderer with default parameters.
fn request_of(window: &Window, renderer: &str) -> ViewRequest {
    let shown = window.views.panes[&0].sides[0].shown.as_ref().unwrap();
    ViewRequest {
        renderer: renderer.to_owned(),
        values: Default::default(),
        clouds: window.document.clouds.as_ref().unwrap().clouds.clone(),
        named: window.document.clouds.as_ref().unwrap().named(),
        scene: window.settings.scene.clone(),
        environment: None,
        display: window.settings.display_transform(),
        view: shown.rendered.view,
        antialias: 1,
        tint_backs: false,
        eye_dome: None,
        detail: Detail::FULL,
        in_motion: false,
        for_measurement: false,
        serial: 1,
    }
}
