//! Renderers that are rebuilt, fail, hang or were at work when the program crashed.

use super::{SAMPLE, Screen, built_plugins};
use crate::arguments::{DeviceArguments, PluginFiles, UpAxis, ViewerArguments};
use crate::viewer::darkroom::Task;
use egui_kittest::kittest::Queryable as _;
use std::path::{Path, PathBuf};
use std::time::Duration;

#[test]
fn rebuilt_plugins_take_over_and_broken_ones_do_not() {
    let folder = tempfile::tempdir().unwrap();
    let file_of = |path: &PathBuf| folder.path().join(path.file_name().unwrap());
    let built = built_plugins().plugin;
    for path in &built {
        std::fs::copy(path, file_of(path)).unwrap();
    }
    let arguments = ViewerArguments {
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
        screen.window().panes[&0].sides[0].shown.as_ref().unwrap().shot.milliseconds
    };
    let before = serial(&mut screen);
    // Another build: the same code in a file of other contents, written as a linker does.
    let mut bytes = std::fs::read(&built[1]).unwrap();
    bytes.extend([0; 16]);
    std::fs::write(&phong, &bytes[..bytes.len() / 2]).unwrap();
    std::fs::write(&phong, &bytes).unwrap();
    screen.until("the new build", |window| window.messages.say("was rebuilt"));
    assert_ne!(serial(&mut screen), before, "the new build has drawn");
    // Half a file, for good.
    screen.window().messages.dismiss_all();
    std::fs::write(&phong, &bytes[..bytes.len() / 2]).unwrap();
    screen.until("the refusal", |window| window.messages.say("the old one is"));
    // The old one draws on.
    screen.window().settings.scene.surface.low_pass = 0.0;
    screen.settle();
    assert_eq!(screen.window().panes[&0].sides[0].shown.as_ref().unwrap().renderer, "ewa-phong");
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
    screen.until("the refusal", |window| window.messages.last().is_some());
    assert!(screen.window().messages.last().unwrap().contains("when the program crashed"));
    assert!(screen.window().conduct.iter().all(|unit| unit.off));
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

/// The fixture library with all misbehaving renderers, as a file of the build.
pub(super) fn faulty() -> PathBuf {
    let (prefix, suffix) = (std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let test = std::env::current_exe().unwrap();
    let path = test.ancestors().nth(2).unwrap().join(format!("examples/{prefix}faulty{suffix}"));
    assert!(path.is_file(), "{} is missing: `cargo verify` builds it", path.display());
    path
}

/// The library with the code of another renderer behind the name `fine`: what stands in the
/// manifest is exchanged, in lines of the same length.
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

/// A window with the renderer `fine` on the screen, and the file it came from.
fn showing_fine(folder: &Path) -> (Screen, PathBuf) {
    let file = folder.join(faulty().file_name().unwrap());
    std::fs::copy(faulty(), &file).unwrap();
    let mut plugin = built_plugins().plugin;
    plugin.push(file.clone());
    let mut screen = Screen::with(&ViewerArguments {
        files: vec![SAMPLE.into()],
        up: UpAxis::Y,
        // Long enough for what is in order, also where tests run beside each other.
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

#[test]
fn rebuilds_that_panic_hang_or_do_not_compile_leave_the_old_picture_and_say_why() {
    let folder = tempfile::tempdir().unwrap();
    let (mut screen, file) = showing_fine(folder.path());
    let levels = |screen: &mut Screen| {
        let shown = screen.window().panes[&0].sides[0].shown.as_ref().unwrap();
        assert_eq!(shown.renderer, "fine");
        shown.shot.levels.clone()
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
            window.messages.say("the old one is") && window.messages.say(reason)
        });
        assert_eq!(levels(&mut screen), before, "{id}");
        // The old one still draws.
        screen.window().settings.scene.exposure_stops = 1.0;
        screen.settle();
        assert_ne!(levels(&mut screen), before, "{id}");
        screen.window().settings.scene.exposure_stops = 0.0;
        screen.settle();
        assert_eq!(levels(&mut screen), before, "{id}");
    }
    // The next good build is taken.
    screen.window().messages.dismiss_all();
    let mut bytes = std::fs::read(faulty()).unwrap();
    bytes.extend([0; 16]);
    std::fs::write(&file, bytes).unwrap();
    screen.until("the good build", |window| window.messages.say("was rebuilt"));
    assert_eq!(levels(&mut screen), before);
}

#[test]
fn renderers_that_fail_three_times_are_switched_off_until_the_user_wants_them() {
    let folder = tempfile::tempdir().unwrap();
    let (mut screen, _) = showing_fine(folder.path());
    for _ in 0..3 {
        screen.window().messages.dismiss_all();
        screen.window().settings.panes[0].renderers[0] = "panics-in-frame".to_owned();
        screen.until("the refusal", |window| window.messages.say("frame goes wrong"));
        assert_eq!(screen.window().settings.panes[0].renderers[0], "fine");
    }
    screen.until("the verdict", |window| window.conduct.iter().any(|unit| unit.off));
    screen.window().settings.panes[0].renderers[0] = "panics-in-frame".to_owned();
    screen.until("the bar", |window| window.messages.say("off"));
    screen.harness.get_by_label("Help").click();
    screen.frames();
    screen.harness.get_by_label("Plugins").click();
    screen.frames();
    screen.harness.get_by_label("switch on").click();
    screen.until("another chance", |window| window.conduct.iter().all(|unit| !unit.off));
}

#[test]
fn a_lost_device_is_opened_again() {
    let mut screen = Screen::sample();
    let levels = |screen: &mut Screen| {
        screen.window().panes[&0].sides[0].shown.as_ref().unwrap().shot.levels.clone()
    };
    let before = levels(&mut screen);
    screen.window().darkroom.add(Task::LoseDevice);
    screen.window().settings.scene.exposure_stops = 1.0;
    screen.until("the message", |window| window.messages.say("was lost and opened again"));
    // A renderer that loses the device is off; the picture stays, and another one can draw.
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
    // Views that were closed have no part in it.
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
        window.conduct.iter().any(|unit| unit.off)
    });
    assert!(screen.window().panes[&0].sides[0].shown.is_none());
    std::fs::copy(faulty(), &file).unwrap();
    screen.settle();
}

#[test]
fn what_was_said_before_a_cloud_came_stays() {
    let mut screen = Screen::open(&[SAMPLE]);
    screen.window().messages.warn("something is missing");
    screen.settle();
    assert!(screen.window().messages.say("something is missing"));
}

/// A window with the library `faulty` as a plugin that nobody has said yes to.
fn with_a_stranger(folder: &Path) -> Screen {
    let mut plugin = built_plugins().plugin;
    let list = folder.join("trust.toml");
    for path in &plugin {
        let (manifest, contents) = surfelshop_engine::plugins::inspect(path).unwrap();
        let add = |list: &mut crate::plugins::TrustFile| list.add(path, &manifest, contents, false);
        crate::plugins::TrustFile::change(&list, add).unwrap();
    }
    let path = folder.join("stranger.so");
    std::fs::copy(faulty(), &path).unwrap();
    plugin.push(path);
    let arguments = ViewerArguments {
        files: vec![SAMPLE.into()],
        up: UpAxis::Y,
        plugins: PluginFiles { plugin, trust_file: Some(list), ..PluginFiles::default() },
        device: DeviceArguments::default(),
    };
    Screen::with(&arguments)
}

#[test]
fn a_plugin_of_a_new_place_is_asked_about_and_runs_after_a_yes_alone() {
    let folder = tempfile::tempdir().unwrap();
    let mut screen = with_a_stranger(folder.path());
    screen.settle();
    let stranger = |screen: &mut Screen| {
        let entries = screen.window().registry.entries().to_vec();
        entries.into_iter().find(|entry| entry.path.ends_with("stranger.so")).unwrap()
    };
    assert!(stranger(&mut screen).asks_for_trust());
    // Pictures of others go on behind the question.
    screen.harness.get_by_label("Use this plugin?");
    screen.harness.get_by_label("not now").click();
    screen.until("the answer", |window| window.messages.say("stays unused"));
    screen.window().settings.panes[0].renderers[0] = "fine".to_owned();
    screen.until("the refusal", |window| window.messages.say("a place that is new here"));
    assert_eq!(screen.window().settings.panes[0].renderers[0], "ewa-phong");

    // Asked again, it is used for as long as the window is open.
    screen.window().undecided.clear();
    screen.harness.step();
    screen.harness.get_by_label("use it this once").click();
    screen.until("trust", |window| {
        !window.registry.entries().iter().any(surfelshop_engine::plugins::Entry::asks_for_trust)
    });
    screen.window().settings.panes[0].renderers[0] = "fine".to_owned();
    screen.settle();
    assert_eq!(screen.window().panes[&0].sides[0].shown.as_ref().unwrap().renderer, "fine");
    let list = std::fs::read_to_string(folder.path().join("trust.toml")).unwrap();
    assert!(!list.contains("stranger"), "{list}");
}

#[test]
fn a_yes_in_the_window_is_written_down() {
    for (button, table) in
        [("trust this build", "[[builds]]"), ("trust what is built there", "[[places]]")]
    {
        let folder = tempfile::tempdir().unwrap();
        let mut screen = with_a_stranger(folder.path());
        screen.settle();
        screen.harness.get_by_label(button).click();
        screen.until("trust", |window| {
            !window.registry.entries().iter().any(surfelshop_engine::plugins::Entry::asks_for_trust)
        });
        let list = std::fs::read_to_string(folder.path().join("trust.toml")).unwrap();
        let last = list.rsplit("[[").next().unwrap();
        assert!(list.contains(table) && last.contains("stranger.so"), "{list}");
    }
}

/// A window whose plugin `link.so` is a link to a copy of `flat` that is trusted by its place.
#[cfg(unix)]
fn with_a_link(folder: &Path) -> Screen {
    let built = built_plugins().plugin;
    let list = folder.join("trust.toml");
    let trusted = folder.join("trusted.so");
    std::fs::copy(&built[0], &trusted).unwrap();
    for (path, place) in [(&built[1], false), (&trusted, true)] {
        let (manifest, contents) = surfelshop_engine::plugins::inspect(path).unwrap();
        let add = |list: &mut crate::plugins::TrustFile| list.add(path, &manifest, contents, place);
        crate::plugins::TrustFile::change(&list, add).unwrap();
    }
    std::os::unix::fs::symlink(&trusted, folder.join("link.so")).unwrap();
    let plugin = vec![built[1].clone(), folder.join("link.so")];
    Screen::with(&ViewerArguments {
        files: vec![SAMPLE.into()],
        up: UpAxis::Y,
        plugins: PluginFiles { plugin, trust_file: Some(list), ..PluginFiles::default() },
        device: DeviceArguments::default(),
    })
}

/// Turns the link to another build, which nobody has said yes to.
#[cfg(unix)]
fn turn_the_link(folder: &Path) {
    let mut bytes = std::fs::read(&built_plugins().plugin[0]).unwrap();
    bytes.extend([0; 16]);
    std::fs::write(folder.join("stranger.so"), bytes).unwrap();
    std::os::unix::fs::symlink(folder.join("stranger.so"), folder.join("new.so")).unwrap();
    std::fs::rename(folder.join("new.so"), folder.join("link.so")).unwrap();
}

#[cfg(unix)]
#[test]
fn a_link_that_is_turned_under_the_window_runs_nothing_until_somebody_says_yes() {
    let asks = |window: &mut crate::viewer::window::Window| {
        let entries = window.registry.entries();
        entries.iter().any(|entry| entry.path.ends_with("link.so") && entry.asks_for_trust())
    };
    // Its renderer is on the screen: the rebuilt file is refused, and the question comes.
    let folder = tempfile::tempdir().unwrap();
    let mut screen = with_a_link(folder.path());
    screen.window().settings.panes[0].renderers[0] = "flat".to_owned();
    screen.settle();
    turn_the_link(folder.path());
    screen.until("the question", asks);
    screen.until("the refusal", |window| window.messages.say("a place that is new here"));
    assert!(!screen.window().messages.say("was rebuilt"));
    screen.frames();
    screen.harness.get_by_label("Use this plugin?");
    screen.harness.get_by_label("leads to");

    // Judged and not yet loaded: whenever the window notices, the stranger does not run.
    let folder = tempfile::tempdir().unwrap();
    let mut screen = with_a_link(folder.path());
    screen.settle();
    turn_the_link(folder.path());
    screen.window().settings.panes[0].renderers[0] = "flat".to_owned();
    screen.until("the question", asks);
    let shown = |window: &mut crate::viewer::window::Window| {
        window.panes[&0].sides[0].shown.as_ref().map(|shown| shown.renderer.clone())
    };
    // Either the file that was judged was loaded, or nothing was.
    screen.until("an answer", |window| {
        window.messages.say("a place that is new here") || shown(window).as_deref() == Some("flat")
    });
    assert!(!screen.window().messages.say("was rebuilt"));
}
