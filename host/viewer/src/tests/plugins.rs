//! Renderers that are rebuilt, fail, hang or were in use when the program crashed.

use super::{SAMPLE, Screen, built_plugins};
use crate::ViewerArguments;
use crate::render_thread::RenderCommand;
use egui_kittest::kittest::Queryable as _;
use std::path::{Path, PathBuf};
use std::time::Duration;
use surfelshop_session::options::DeviceArguments;
use surfelshop_session::options::PluginFiles;
use surfelshop_session::options::UpAxis;

#[test]
fn rebuilt_plugins_take_over_and_broken_ones_do_not() {
    let folder = tempfile::tempdir().unwrap();
    let file_of = |path: &PathBuf| folder.path().join(path.file_name().unwrap());
    let built = built_plugins().plugin;
    for path in &built {
        std::fs::copy(path, file_of(path)).unwrap();
    }
    let arguments = ViewerArguments {
        memory: None,
        in_place: false,
        colors: Default::default(),
        files: vec![SAMPLE.into()],
        up: UpAxis::Y,
        plugins: PluginFiles {
            plugin: built.iter().map(file_of).collect(),
            trust: true,
            ..PluginFiles::default()
        },
        device: DeviceArguments::default(),
    };
    let mut screen = Screen::with(&arguments);
    screen.settle();
    let phong = file_of(&built[1]);
    let serial = |screen: &mut Screen| {
        screen.window().views.panes[&0].sides[0].shown.as_ref().unwrap().rendered.milliseconds
    };
    let before = serial(&mut screen);
    // Another build: the same code in a file of other contents, written as a linker does.
    let mut bytes = std::fs::read(&built[1]).unwrap();
    bytes.extend([0; 16]);
    std::fs::write(&phong, &bytes[..bytes.len() / 2]).unwrap();
    std::fs::write(&phong, &bytes).unwrap();
    screen.until("the new build", |window| window.messages.contains("was rebuilt"));
    assert_ne!(serial(&mut screen), before, "the new build has drawn");
    // Half a file stays refused.
    screen.window().messages.dismiss_all();
    std::fs::write(&phong, &bytes[..bytes.len() / 2]).unwrap();
    screen.until("the refusal", |window| window.messages.contains("the old one is"));
    // The old build still draws.
    screen.window().settings.scene.surface.low_pass = 0.0;
    screen.settle();
    assert_eq!(
        screen.window().views.panes[&0].sides[0].shown.as_ref().unwrap().renderer,
        "ewa-phong"
    );
}

#[test]
fn after_a_crash_nothing_runs_until_the_user_has_decided() {
    let mut screen = Screen::open(&[SAMPLE]);
    screen.window().plugins.crash = Some(surfelshop_runtime::plugins::Crash {
        unit: "renderer org.surfelshop.ewa-phong/ewa-phong".to_owned(),
        file: "libsurfelshop_ewa_phong.so".to_owned(),
        process: 1,
    });
    screen.until("the cloud", |window| window.document.clouds.is_some());
    for _ in 0..20 {
        screen.harness.step();
    }
    assert!(screen.window().views.panes[&0].sides[0].shown.is_none());
    screen.harness.get_by_label("start without it").click();
    screen.until("the answer", |window| window.plugins.crash.is_none());
    screen.settle();
    assert_eq!(screen.window().settings.panes[0].renderers[0], "flat");
    screen.window().settings.panes[0].renderers[0] = "ewa-phong".to_owned();
    screen.until("the refusal", |window| window.messages.last().is_some());
    assert!(screen.window().messages.last().unwrap().contains("when the program crashed"));
    assert!(screen.window().plugins.unit_health.iter().all(|unit| unit.off));
}

#[test]
fn a_renderer_that_cannot_be_had_leaves_the_old_one() {
    let mut screen = Screen::sample();
    screen.window().settings.panes[0].renderers[0] = "no-such-renderer".to_owned();
    screen.until("the message", |window| window.messages.last().is_some());
    let window = screen.window();
    let message = window.messages.last().unwrap().to_owned();
    assert!(message.contains("no-such-renderer"), "{message}");
    assert_eq!(window.settings.panes[0].renderers[0], "ewa-phong");
    screen.settle();
}

/// The built fixture library with all misbehaving renderers.
pub(super) fn faulty() -> PathBuf {
    let (prefix, suffix) = (std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let test = std::env::current_exe().unwrap();
    let path = test.ancestors().nth(2).unwrap().join(format!("examples/{prefix}faulty{suffix}"));
    assert!(path.is_file(), "{} is missing: `cargo verify` builds it", path.display());
    path
}

/// Invariant: a third party's format opens in the window, and one that panics is a message and nothing more
#[test]
fn formats_of_third_parties_open_and_faulty_ones_are_messages() {
    let folder = tempfile::tempdir().unwrap();
    let (good, bad) = (folder.path().join("a.triplets"), folder.path().join("b.panics-in-read"));
    let places = [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    std::fs::write(&good, places.map(f32::to_le_bytes).concat()).unwrap();
    std::fs::write(&bad, [0]).unwrap();
    let name = format!("{}formats{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let mut plugin = built_plugins().plugin;
    plugin.push(faulty().with_file_name(name));
    let mut screen = Screen::with(&ViewerArguments {
        memory: None,
        in_place: false,
        colors: Default::default(),
        files: vec![good],
        up: UpAxis::Y,
        plugins: PluginFiles { plugin, trust: true, ..PluginFiles::default() },
        device: DeviceArguments::default(),
    });
    screen.settle();
    let n_shown = |screen: &mut Screen| {
        screen.window().document.clouds.as_ref().unwrap().clouds.facts.n_surfels
    };
    assert_eq!(n_shown(&mut screen), 3);
    let context = screen.harness.ctx.clone();
    screen.window().open(&context, vec![bad]);
    screen.until("the message", |window| window.messages.last().is_some());
    let line = screen.window().messages.last().unwrap().to_owned();
    assert!(line.contains("b.panics-in-read") && !line.contains('\n'), "{line}");
    screen.settle();
    assert_eq!(n_shown(&mut screen), 3);
}

/// The library with another renderer's code under the name `fine`: lines of the manifest are exchanged
/// for others of the same length.
fn faulty_with_fine_being(id: &str, title: &str) -> Vec<u8> {
    let mut bytes = std::fs::read(faulty()).unwrap();
    let title_len = title.len() + id.len() - "fine".len();
    let mut replace = |from: &str, to: &str| {
        assert_eq!(from.len(), to.len());
        let found: Vec<usize> = bytes
            .windows(from.len())
            .enumerate()
            .filter(|(_, window)| *window == from.as_bytes())
            .map(|(at, _)| at)
            .collect();
        assert!(!found.is_empty(), "{from:?} is not in the library");
        for at in found {
            bytes[at..at + to.len()].copy_from_slice(to.as_bytes());
        }
    };
    replace("\tfine\tFine\t", "\tgood\tFine\t");
    replace(&format!("\t{id}\t{title}\t"), &format!("\tfine\t{title:title_len$}\t"));
    bytes
}

/// A window that shows the renderer `fine`, and its file.
fn showing_fine(folder: &Path) -> (Screen, PathBuf) {
    let file = folder.join(faulty().file_name().unwrap());
    std::fs::copy(faulty(), &file).unwrap();
    let mut plugin = built_plugins().plugin;
    plugin.push(file.clone());
    let mut screen = Screen::with(&ViewerArguments {
        memory: None,
        in_place: false,
        colors: Default::default(),
        files: vec![SAMPLE.into()],
        up: UpAxis::Y,
        // Long enough for a correct renderer while other tests run.
        plugins: PluginFiles {
            plugin,
            trust: true,
            patience: Some(Duration::from_secs(3)),
            ..PluginFiles::default()
        },
        device: DeviceArguments::default(),
    });
    screen.window().settings.panes[0].renderers[0] = "fine".to_owned();
    screen.settle();
    (screen, file)
}

/// Invariant: in the window a rebuild that panics, hangs or does not compile leaves the old
/// picture and says why
#[test]
fn rebuilds_that_panic_hang_or_do_not_compile_leave_the_old_picture_and_say_why() {
    let folder = tempfile::tempdir().unwrap();
    let (mut screen, file) = showing_fine(folder.path());
    let levels = |screen: &mut Screen| {
        let shown = screen.window().views.panes[&0].sides[0].shown.as_ref().unwrap();
        assert_eq!(shown.renderer, "fine");
        shown.rendered.levels.clone()
    };
    let before = levels(&mut screen);
    for (id, title, reason) in [
        ("panics-in-frame", "PanicsInFrame", "frame goes wrong"),
        ("hangs-in-frame", "HangsInFrame", "did not answer within 3 s"),
        ("hangs-in-new", "HangsInNew", "did not answer within 3 s"),
        ("invalid-wgsl", "InvalidWgsl", "pass `broken`"),
    ] {
        screen.window().messages.dismiss_all();
        std::fs::write(&file, faulty_with_fine_being(id, title)).unwrap();
        screen.until(reason, |window| {
            window.messages.contains("the old one is") && window.messages.contains(reason)
        });
        assert_eq!(levels(&mut screen), before, "{id}");
        // The old build still draws.
        screen.window().settings.scene.exposure_stops = 1.0;
        screen.settle();
        assert_ne!(levels(&mut screen), before, "{id}");
        screen.window().settings.scene.exposure_stops = 0.0;
        screen.settle();
        assert_eq!(levels(&mut screen), before, "{id}");
    }
    // The next good build is used.
    screen.window().messages.dismiss_all();
    let mut bytes = std::fs::read(faulty()).unwrap();
    bytes.extend([0; 16]);
    std::fs::write(&file, bytes).unwrap();
    screen.until("the good build", |window| window.messages.contains("was rebuilt"));
    assert_eq!(levels(&mut screen), before);
}

#[test]
fn renderers_that_fail_three_times_are_switched_off_until_the_user_wants_them() {
    let folder = tempfile::tempdir().unwrap();
    let (mut screen, _) = showing_fine(folder.path());
    for _ in 0..3 {
        screen.window().messages.dismiss_all();
        screen.window().settings.panes[0].renderers[0] = "panics-in-frame".to_owned();
        screen.until("the refusal", |window| window.messages.contains("frame goes wrong"));
        assert_eq!(screen.window().settings.panes[0].renderers[0], "fine");
    }
    screen.until("the verdict", |window| window.plugins.unit_health.iter().any(|unit| unit.off));
    screen.window().settings.panes[0].renderers[0] = "panics-in-frame".to_owned();
    screen.until("the bar", |window| window.messages.contains("off"));
    screen.harness.get_by_label("Help").click();
    screen.frames();
    screen.harness.get_by_label("Plugins").click();
    screen.frames();
    screen.harness.get_by_label("switch on").click();
    screen
        .until("another chance", |window| window.plugins.unit_health.iter().all(|unit| !unit.off));
}

/// Invariant: a lost device is opened again under the window
#[test]
fn a_lost_device_is_opened_again() {
    let mut screen = Screen::sample();
    let levels = |screen: &mut Screen| {
        screen.window().views.panes[&0].sides[0].shown.as_ref().unwrap().rendered.levels.clone()
    };
    let before = levels(&mut screen);
    screen.window().render.thread.add(RenderCommand::LoseDevice);
    screen.window().settings.scene.exposure_stops = 1.0;
    screen.until("the message", |window| window.messages.contains("was lost and opened again"));
    // A renderer that loses the device is switched off; another one can draw.
    screen.window().settings.scene.exposure_stops = 0.0;
    screen.window().settings.panes[0].renderers[0] = "flat".to_owned();
    screen.settle();
    assert_ne!(levels(&mut screen), before);
}

#[test]
fn a_rebuild_leaves_each_view_its_own_values() {
    use surfelshop_api::params::Value;
    let folder = tempfile::tempdir().unwrap();
    let (mut screen, file) = showing_fine(folder.path());
    screen.harness.get_all_by_label("split").next().unwrap().click();
    screen.until("another view", |window| window.settings.panes.len() == 2);
    for (pane, gain) in [(0, 0.5), (1, 2.0)] {
        let values = screen.window().settings.panes[pane].values.entry("fine".into()).or_default();
        values.insert("gain".to_owned(), Value::Float(gain));
    }
    screen.settle();
    // Closed views are not redrawn.
    for n_panes in [3, 2, 3, 2] {
        let label = if n_panes == 3 { "split" } else { "close" };
        screen.harness.get_all_by_label(label).last().unwrap().click();
        screen.until(label, |window| window.settings.panes.len() == n_panes);
        screen.settle();
    }
    let mut bytes = std::fs::read(faulty()).unwrap();
    bytes.extend([0; 16]);
    std::fs::write(&file, bytes).unwrap();
    screen.until("both builds", |window| window.messages.count("was rebuilt") >= 2);
    screen.settle();
    assert_eq!(screen.window().messages.count("was rebuilt"), 2);
    for (pane, gain) in [(0, 0.5), (1, 2.0)] {
        let values = screen.window().settings.panes[pane].values_of(0);
        assert_eq!(values["gain"], Value::Float(gain), "view {pane}");
    }
}

#[test]
fn a_renderer_that_was_switched_off_comes_back_with_a_good_build() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join(faulty().file_name().unwrap());
    std::fs::write(&file, faulty_with_fine_being("panics-in-frame", "PanicsInFrame")).unwrap();
    let mut plugin = built_plugins().plugin;
    plugin.push(file.clone());
    let mut screen = Screen::with(&ViewerArguments {
        memory: None,
        in_place: false,
        colors: Default::default(),
        files: vec![SAMPLE.into()],
        up: UpAxis::Y,
        plugins: PluginFiles { plugin, trust: true, ..PluginFiles::default() },
        device: DeviceArguments::default(),
    });
    screen.window().settings.panes[0].renderers[0] = "fine".to_owned();
    let mut stops = 0.0;
    screen.until("the verdict", |window| {
        stops += 0.01;
        window.settings.scene.exposure_stops = stops;
        window.plugins.unit_health.iter().any(|unit| unit.off)
    });
    assert!(screen.window().views.panes[&0].sides[0].shown.is_none());
    std::fs::copy(faulty(), &file).unwrap();
    screen.settle();
}

#[test]
fn what_was_said_before_a_cloud_came_stays() {
    let mut screen = Screen::open(&[SAMPLE]);
    screen.window().messages.warn("something is missing");
    screen.settle();
    assert!(screen.window().messages.contains("something is missing"));
}

/// Invariant: in the window an isolated plugin that aborts is a message, the old picture stays, and other units of the same
/// library draw
#[cfg(unix)]
#[test]
fn an_isolated_plugin_that_aborts_is_a_message() {
    // This test is not the program.
    let program = faulty().with_file_name("..").join("surfelshop");
    assert!(program.is_file(), "{} is missing: `cargo verify` builds it", program.display());
    surfelshop_runtime::isolate::use_program(program);
    let mut plugin = built_plugins().plugin;
    plugin.push(faulty());
    let mut screen = Screen::with(&ViewerArguments {
        memory: None,
        in_place: false,
        colors: Default::default(),
        files: vec![SAMPLE.into()],
        up: UpAxis::Y,
        plugins: PluginFiles {
            plugin,
            trust: true,
            isolate: vec!["org.surfelshop.test.faulty".to_owned()],
            ..PluginFiles::default()
        },
        device: DeviceArguments::default(),
    });
    screen.settle();
    let shown = |screen: &mut Screen| {
        screen.window().views.panes[&0].sides[0].shown.as_ref().unwrap().renderer.clone()
    };
    assert_eq!(shown(&mut screen), "ewa-phong");
    screen.window().settings.panes[0].renderers[0] = "aborts-in-frame".to_owned();
    screen.until("the message", |window| window.messages.contains("its process ended: signal 6"));
    screen.settle();
    assert_eq!(shown(&mut screen), "ewa-phong");
    screen.window().settings.panes[0].renderers[0] = "fine".to_owned();
    screen.settle();
    assert_eq!(shown(&mut screen), "fine");
}
