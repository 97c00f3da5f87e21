//! The window without a screen: every panel, switching, comparing, undo and what fails.

use super::settings::Mode;
use super::window::Window;
use crate::arguments::{DeviceArguments, PluginFiles, UpAxis, ViewerArguments};
use eframe::egui::{Context, Vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable as _;
use std::path::PathBuf;
use std::time::{Duration, Instant};

const SAMPLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/sample.ply");

/// Far more than any step takes on a busy machine: a test that waits this long has failed.
const PATIENCE: Duration = Duration::from_secs(120);

/// The plugins of this build, which lie one folder above a unit test.
fn plugins() -> PluginFiles {
    let test = std::env::current_exe().unwrap();
    let folder = test.ancestors().nth(2).unwrap();
    let file = |name: &str| {
        let (prefix, suffix) = (std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
        let path = folder.join(format!("{prefix}{name}{suffix}"));
        assert!(path.exists(), "{} is missing: `cargo verify` builds it", path.display());
        path
    };
    let plugin = vec![file("surfelshop_flat"), file("surfelshop_ewa_phong")];
    PluginFiles { plugin, patience: None }
}

/// A window over files, and the means to use it.
struct Screen {
    harness: Harness<'static, Window>,
}

impl Screen {
    fn open(files: &[&str]) -> Self {
        Self::with(&ViewerArguments {
            files: files.iter().map(PathBuf::from).collect(),
            up: UpAxis::Y,
            plugins: plugins(),
            device: DeviceArguments::default(),
        })
    }

    fn with(arguments: &ViewerArguments) -> Self {
        // The harness has a context of its own; this one only wakes nobody.
        let mut window = Window::new(&Context::default(), arguments).unwrap();
        // A crash of another program is not this test's business.
        window.crash = None;
        window.memory = None;
        let harness = Harness::builder()
            .with_size(Vec2::new(900.0, 640.0))
            .build_ui_state(|ui, window: &mut Window| window.frame(ui), window);
        Self { harness }
    }

    fn window(&mut self) -> &mut Window {
        self.harness.state_mut()
    }

    /// Runs frames until something holds.
    #[track_caller]
    fn until(&mut self, what: &str, mut holds: impl FnMut(&mut Window) -> bool) {
        let started = Instant::now();
        loop {
            self.harness.step();
            if holds(self.harness.state_mut()) {
                return;
            }
            let message = self.harness.state().message.clone();
            assert!(started.elapsed() < PATIENCE, "waited for {what}; message: {message:?}");
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
                let pane = &window.panes[&settings.id];
                pane.sides[..settings.mode.sides()].iter().enumerate().all(|(i, side)| {
                    let shown = side.shown.as_ref();
                    side.settled() && shown.is_some_and(|s| s.renderer == settings.renderers[i])
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

fn covered(window: &Window, pane: u32, side: usize) -> usize {
    let shot = &window.panes[&pane].sides[side].shown.as_ref().unwrap().shot;
    let depth = shot.depth.as_ref().unwrap();
    depth.data.chunks_exact(depth.components as usize).filter(|p| p[0] > 0.0).count()
}

#[test]
fn panels_say_what_is_shown() {
    let mut screen = Screen::sample();
    assert!(covered(screen.window(), 0, 0) > 10_000);
    let harness = &screen.harness;
    for text in ["Clouds", "Renderer", "Camera", "Light and picture", "Surface", "Passes"] {
        harness.get_by_label(text);
    }
    for text in ["sample.ply", "119 051 surfels", "shininess", "draw both sides", "phong"] {
        assert!(harness.query_all_by_label(text).count() > 0, "nothing is called `{text}`");
    }
}

#[test]
fn the_old_picture_stays_until_the_new_renderer_has_one() {
    let mut screen = Screen::sample();
    for renderer in ["flat", "ewa-phong", "flat"] {
        screen.window().settings.panes[0].renderers[0] = renderer.to_owned();
        screen.until("the other renderer", |window| {
            let shown = window.panes[&0].sides[0].shown.as_ref().unwrap();
            assert!(covered(window, 0, 0) > 10_000, "an empty picture is shown");
            shown.renderer == renderer
        });
    }
}

#[test]
fn a_renderer_that_cannot_be_had_leaves_the_old_one() {
    let mut screen = Screen::sample();
    screen.window().settings.panes[0].renderers[0] = "no-such-renderer".to_owned();
    screen.until("the message", |window| window.message.is_some());
    let window = screen.window();
    let message = window.message.clone().unwrap();
    assert!(message.contains("no-such-renderer"), "{message}");
    assert_eq!(window.settings.panes[0].renderers[0], "ewa-phong");
    screen.settle();
}

#[test]
fn two_renderers_are_compared_and_their_columns_are_on_the_device_once() {
    let mut screen = Screen::sample();
    let columns = screen.window().counters.column_bytes;
    for mode in [Mode::SideBySide, Mode::Wipe, Mode::Flicker, Mode::Difference] {
        screen.window().settings.panes[0].mode = mode;
        screen.settle();
        let window = screen.window();
        let difference = window.panes.get_mut(&0).unwrap().difference().unwrap();
        assert!(difference.rmse > 0.005 && difference.rmse < 0.2, "{}", difference.describe());
        assert_eq!(window.counters.column_bytes, columns, "{mode:?}");
    }
    screen.window().settings.panes[0].renderers[1] = "ewa-phong".to_owned();
    screen.settle();
    let difference = screen.window().panes.get_mut(&0).unwrap().difference().unwrap();
    assert_eq!(difference.describe(), "equal");
}

#[test]
fn views_split_and_share_the_columns() {
    let mut screen = Screen::sample();
    let columns = screen.window().counters.column_bytes;
    for n_panes in 2..=4 {
        screen.harness.get_all_by_label("split").next().unwrap().click();
        screen.until("another view", |window| window.settings.panes.len() == n_panes);
        screen.settle();
    }
    assert_eq!(screen.window().counters.column_bytes, columns);
    screen.harness.get_all_by_label("split").next().unwrap().click();
    screen.until("the message", |window| window.message.is_some());
    assert_eq!(screen.window().settings.panes.len(), 4);
    screen.harness.get_all_by_label("close").next().unwrap().click();
    screen.until("one less", |window| window.settings.panes.len() == 3);
    screen.settle();
}

#[test]
fn changes_of_parameters_are_seen_and_undone() {
    use surfelshop_api::params::Value;
    let mut screen = Screen::sample();
    let before = screen.window().panes[&0].sides[0].shown.as_ref().unwrap().shot.levels.clone();
    let values = screen.window().settings.panes[0].values.entry("ewa-phong".into()).or_default();
    values.insert("specular".to_owned(), Value::Float(1.0));
    screen.settle();
    let levels = |screen: &mut Screen| {
        screen.window().panes[&0].sides[0].shown.as_ref().unwrap().shot.levels.clone()
    };
    assert_ne!(levels(&mut screen), before);
    screen.until("a step to undo", |window| window.history.has_undo(&window.settings));
    use eframe::egui::{Key, Modifiers};
    screen.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    screen.until("the old values", |window| window.settings.panes[0].values.is_empty());
    screen.settle();
    assert_eq!(levels(&mut screen), before);
    screen.harness.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    screen.until("the new values", |window| !window.settings.panes[0].values.is_empty());
}

#[test]
fn a_file_that_cannot_be_read_is_named_and_the_cloud_stays() {
    let mut screen = Screen::sample();
    let context = screen.harness.ctx.clone();
    screen.window().open(&context, vec!["no/such/cloud.ply".into()]);
    screen.until("the message", |window| window.message.is_some());
    let window = screen.window();
    let message = window.message.clone().unwrap();
    assert!(message.contains("no/such/cloud.ply"), "{message}");
    assert_eq!(window.shown.as_ref().unwrap().clouds.facts.n_surfels, 119_051);
}

#[test]
fn after_a_crash_nothing_runs_until_the_user_has_decided() {
    let mut screen = Screen::open(&[SAMPLE]);
    screen.window().crash = Some(surfelshop_engine::plugins::Crash {
        unit: "renderer org.surfelshop.ewa-phong/ewa-phong".to_owned(),
        file: "libsurfelshop_ewa_phong.so".to_owned(),
        process: 1,
    });
    screen.until("the cloud", |window| window.shown.is_some());
    for _ in 0..20 {
        screen.harness.step();
    }
    assert!(screen.window().panes[&0].sides[0].shown.is_none());
    screen.harness.get_by_label("start without it").click();
    screen.until("the answer", |window| window.crash.is_none());
    screen.settle();
    assert_eq!(screen.window().settings.panes[0].renderers[0], "flat");
    screen.window().settings.panes[0].renderers[0] = "ewa-phong".to_owned();
    screen.until("the refusal", |window| window.message.is_some());
    assert!(screen.window().message.as_ref().unwrap().contains("when the program crashed"));
    assert!(screen.window().conduct.iter().all(|unit| unit.off));
}

#[test]
fn the_settled_view_is_what_render_makes_of_the_saved_scene() {
    use crate::arguments::{Cli, Command};
    use crate::given::Given;
    use clap::{CommandFactory as _, FromArgMatches as _};
    use glam::DVec2;
    use surfelshop_api::params::Value;
    let mut screen = Screen::sample();
    let folder = tempfile::tempdir().unwrap();
    let (scene, png) = (folder.path().join("a.scene.toml"), folder.path().join("a.png"));
    let window = screen.window();
    let mut camera = window.camera;
    super::navigation::orbit(&mut camera, DVec2::new(0.7, 0.2));
    window.set_camera(0, camera);
    window.settings.scene.surface.two_sided = false;
    window.settings.scene.exposure_stops = 0.5;
    let values = window.settings.panes[0].values.entry("ewa-phong".into()).or_default();
    values.insert("specular".to_owned(), Value::Float(0.7));
    screen.settle();
    screen.window().save_scene(&scene);
    assert!(scene.exists(), "{:?}", screen.window().message);
    let shot = screen.window().panes[&0].sides[0].shown.as_ref().unwrap().shot.clone();
    let [width, height] = shot.size;
    let plugins = plugins().plugin;
    let mut line = vec!["surfelshop".to_owned(), "render".to_owned()];
    for plugin in &plugins {
        line.extend(["--plugin".to_owned(), plugin.display().to_string()]);
    }
    line.extend([scene.display().to_string(), "-o".to_owned(), png.display().to_string()]);
    line.extend(["--size".to_owned(), format!("{width}x{height}")]);
    let matches = Cli::command().try_get_matches_from(line).unwrap();
    let Some(Command::Render(arguments)) = Cli::from_arg_matches(&matches).unwrap().command else {
        panic!("another command");
    };
    crate::render::run(&arguments, &Given::of(&matches)).unwrap();
    let rendered = image::open(&png).unwrap().into_rgba8().into_raw();
    let differ = rendered.chunks(4).zip(shot.levels.chunks(4)).filter(|(a, b)| a != b).count();
    assert_eq!(differ, 0, "pixels differ");
}

#[test]
fn a_scene_comes_back_as_it_was_saved() {
    use surfelshop_api::params::Value;
    use surfelshop_engine::picture::Background;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("b.scene.toml");
    let mut screen = Screen::sample();
    screen.harness.get_all_by_label("split").next().unwrap().click();
    screen.until("another view", |window| window.settings.panes.len() == 2);
    let window = screen.window();
    let pane = &mut window.settings.panes[1];
    (pane.mode, pane.wipe, pane.linked) = (Mode::Wipe, 0.25, false);
    pane.values.entry("flat".into()).or_default().insert("ambient".to_owned(), Value::Float(0.5));
    let mut own = window.camera;
    own.eye *= 1.5;
    window.own_cameras.insert(1, own);
    window.settings.scene.surface.low_pass = 2.0;
    window.save_scene(&path);
    let (settings, camera) = (window.settings.clone(), window.camera);
    // Unknown keys stay.
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, format!("mood = \"calm\"\n{text}")).unwrap();
    let mut other = Screen::open(&[path.to_str().unwrap()]);
    other.settle();
    // Files hold linear colours, of which the last bit depends on the way there.
    let Background::Color(background) = other.window().settings.background else {
        panic!("no background");
    };
    let Background::Color(saved) = settings.background else { panic!("none saved") };
    for (a, b) in background.iter().zip(saved) {
        assert!((a - b).abs() < 1e-6);
    }
    other.window().settings.background = settings.background;
    assert_eq!(other.window().settings, settings);
    assert_eq!((other.window().camera, other.window().own_cameras[&1]), (camera, own));
    other.window().save_scene(&path);
    let again = std::fs::read_to_string(&path).unwrap();
    assert!(again.contains("mood = \"calm\""), "{again}");
}

#[test]
fn rebuilt_plugins_take_over_and_broken_ones_do_not() {
    let folder = tempfile::tempdir().unwrap();
    let file_of = |path: &PathBuf| folder.path().join(path.file_name().unwrap());
    let built = plugins().plugin;
    for path in &built {
        std::fs::copy(path, file_of(path)).unwrap();
    }
    let arguments = ViewerArguments {
        files: vec![SAMPLE.into()],
        up: UpAxis::Y,
        plugins: PluginFiles { plugin: built.iter().map(file_of).collect(), patience: None },
        device: DeviceArguments::default(),
    };
    let mut screen = Screen::with(&arguments);
    screen.settle();
    let phong = file_of(&built[1]);
    let serial = |screen: &mut Screen| {
        screen.window().panes[&0].sides[0].shown.as_ref().unwrap().shot.milliseconds
    };
    let before = serial(&mut screen);
    // Another build: the same code in a file of other contents, written as a linker does.
    let mut bytes = std::fs::read(&built[1]).unwrap();
    bytes.extend([0; 16]);
    std::fs::write(&phong, &bytes[..bytes.len() / 2]).unwrap();
    std::fs::write(&phong, &bytes).unwrap();
    screen.until("the new build", |window| {
        window.message.as_ref().is_some_and(|message| message.contains("was rebuilt"))
    });
    assert_ne!(serial(&mut screen), before, "the new build has drawn");
    // Half a file, for good.
    screen.window().message = None;
    std::fs::write(&phong, &bytes[..bytes.len() / 2]).unwrap();
    screen.until("the refusal", |window| {
        window.message.as_ref().is_some_and(|message| message.contains("the old one is"))
    });
    // The old one draws on.
    screen.window().settings.scene.surface.low_pass = 0.0;
    screen.settle();
    assert_eq!(screen.window().panes[&0].sides[0].shown.as_ref().unwrap().renderer, "ewa-phong");
}

#[test]
fn pictures_are_written_at_any_size_and_all_around() {
    let folder = tempfile::tempdir().unwrap();
    let mut screen = Screen::sample();
    screen.window().export_window.open = true;
    let path = |name: &str| folder.path().join(name);
    for (choice, file, expected) in [
        ("this view", "one.png", vec!["one.png"]),
        ("this view", "one.exr", vec!["one.exr"]),
        ("a turn around", "turn.png", vec!["turn-0001.png", "turn-0002.png", "turn-0003.png"]),
    ] {
        screen.frames();
        screen.harness.get_by_label(choice).click();
        screen.window().export_window.aim(path(file).to_str().unwrap(), [123, 77], 3);
        screen.frames();
        screen.harness.get_by_label("save").click();
        screen.until("the files", |window| {
            window.message.as_ref().is_some_and(|message| message.starts_with("wrote"))
        });
        screen.window().message = None;
        for name in expected {
            assert!(path(name).is_file(), "{name}");
        }
    }
    assert_eq!(image::image_dimensions(path("turn-0002.png")).unwrap(), (123, 77));
    assert_ne!(
        std::fs::read(path("turn-0001.png")).unwrap(),
        std::fs::read(path("turn-0002.png")).unwrap()
    );
    screen.window().export_window.aim("picture.jpg", [8, 8], 2);
    screen.frames();
    screen.harness.get_by_label("save").click();
    screen.until("the refusal", |window| window.message.is_some());
    assert!(screen.window().message.as_ref().unwrap().contains(".png or .exr"));
}

#[test]
fn help_and_plugins_have_their_windows() {
    for (window, content) in [("Plugins", "org.surfelshop.flat"), ("Mouse and keys", "orbit")] {
        let mut screen = Screen::sample();
        screen.harness.get_by_label("Help").click();
        screen.frames();
        screen.harness.get_by_label(window).click();
        screen.frames();
        assert!(screen.harness.query_all_by_label(content).count() > 0, "{window}: {content}");
    }
}

#[test]
fn presets_are_kept_for_the_next_start() {
    use surfelshop_api::params::Value;
    let folder = tempfile::tempdir().unwrap();
    let mut screen = Screen::sample();
    let memory = || Some(super::memory::Memory::in_folder(folder.path().to_owned()));
    screen.window().memory = memory();
    let values = screen.window().settings.panes[0].values.entry("ewa-phong".into()).or_default();
    values.insert("specular".to_owned(), Value::Float(0.9));
    screen.window().preset = "shiny".to_owned();
    screen.settle();
    screen.harness.get_by_label("presets of ewa-phong").click();
    screen.frames();
    screen.harness.get_by_label("save").click();
    screen.until("the file", |_| memory().unwrap().preset_names("ewa-phong") == ["shiny"]);
    screen.window().settings.panes[0].values.clear();
    screen.settle();
    screen.harness.get_by_label("presets of ewa-phong").click();
    screen.frames();
    screen.harness.get_by_label("shiny").click();
    screen.until("the values", |window| {
        window.settings.panes[0].values_of(0).get("specular") == Some(&Value::Float(0.9))
    });
}

#[test]
fn another_cloud_does_not_overwrite_the_scene_before() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("c.scene.toml");
    let text = format!(
        "format = 1\nbackground = \"transparent\"\n[[clouds]]\npath = '{SAMPLE}'\n\
         [[views]]\nrenderer = \"flat\"\noutput = \"depth\"\n"
    );
    std::fs::write(&scene, text).unwrap();
    let mut screen = Screen::open(&[scene.to_str().unwrap()]);
    screen.settle();
    // What the window cannot show stays as it was.
    let copy = folder.path().join("d.scene.toml");
    screen.window().save_scene(&copy);
    let saved = std::fs::read_to_string(&copy).unwrap();
    assert!(saved.contains("\"transparent\"") && saved.contains("\"depth\""), "{saved}");
    let context = screen.harness.ctx.clone();
    screen.window().open(&context, vec![SAMPLE.into()]);
    screen.until("the cloud", |window| window.loading.is_none() && window.scene_file.is_none());
    assert_eq!(screen.window().scene_path, None);
}

#[test]
fn views_that_are_let_go_stay_where_they_are() {
    let mut screen = Screen::sample();
    screen.harness.get_all_by_label("split").next().unwrap().click();
    screen.until("another view", |window| window.settings.panes.len() == 2);
    screen.window().settings.panes[1].linked = false;
    screen.frames();
    let before = screen.window().camera_of(1);
    let mut moved = screen.window().camera;
    moved.eye *= 2.0;
    screen.window().set_camera(0, moved);
    screen.frames();
    assert_eq!(screen.window().camera_of(1), before);
    assert_eq!(screen.window().camera_of(0), moved);
}

#[test]
fn a_late_picture_of_a_cancelled_export_goes_nowhere() {
    let folder = tempfile::tempdir().unwrap();
    let mut screen = Screen::sample();
    screen.window().export_window.open = true;
    screen.frames();
    let file = folder.path().join("large.png");
    screen.window().export_window.aim(file.to_str().unwrap(), [2000, 2000], 2);
    screen.frames();
    screen.harness.get_by_label("save").click();
    screen.frames();
    screen.harness.get_by_label("cancel").click();
    screen.frames();
    let file = folder.path().join("small.png");
    screen.window().message = None;
    screen.window().export_window.aim(file.to_str().unwrap(), [64, 48], 2);
    screen.frames();
    screen.harness.get_by_label("save").click();
    screen.until("the file", |window| window.message.is_some());
    assert_eq!(image::image_dimensions(file).unwrap(), (64, 48));
}
