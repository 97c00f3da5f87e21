//! Plugins that the user has not trusted yet: asked about, trusted, and refused.

use super::plugins::faulty;
use super::{SAMPLE, Screen, built_plugins};
use crate::ViewerArguments;
use crate::window::Window;
use egui_kittest::kittest::Queryable as _;
use std::path::Path;
use surfelshop_runtime::plugins::{Entry, inspect};
use surfelshop_session::options::DeviceArguments;
use surfelshop_session::options::PluginFiles;
use surfelshop_session::options::UpAxis;
use surfelshop_session::trust_file::TrustFile;

/// A window with the library `faulty` as an untrusted plugin.
fn with_untrusted_plugin(folder: &Path) -> Screen {
    let mut plugin = built_plugins().plugin;
    let list = folder.join("trust.toml");
    for path in &plugin {
        let (manifest, contents) = inspect(path).unwrap();
        let add = |list: &mut TrustFile| list.add(path, &manifest, contents, false);
        TrustFile::change(&list, add).unwrap();
    }
    let path = folder.join("unlisted.so");
    std::fs::copy(faulty(), &path).unwrap();
    plugin.push(path);
    let arguments = ViewerArguments {
        memory: None,
        in_place: false,
        colors: Default::default(),
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
    let mut screen = with_untrusted_plugin(folder.path());
    screen.settle();
    let untrusted = |screen: &mut Screen| {
        let entries = screen.window().plugins.registry.entries().to_vec();
        entries.into_iter().find(|entry| entry.path.ends_with("unlisted.so")).unwrap()
    };
    assert!(untrusted(&mut screen).asks_for_trust());
    // Other renderers draw behind the question.
    screen.harness.get_by_label("Use this plugin?");
    screen.harness.get_by_label("not now").click();
    screen.until("the answer", |window| window.messages.contains("stays unused"));
    screen.window().settings.panes[0].renderers[0] = "fine".to_owned();
    screen.until("the refusal", |window| window.messages.contains("a place that is new here"));
    assert_eq!(screen.window().settings.panes[0].renderers[0], "ewa-phong");

    // Trusted once, it is used until the window is closed.
    screen.window().plugins.undecided.clear();
    screen.harness.step();
    screen.harness.get_by_label("use it this once").click();
    screen.until("trust", |window| {
        !window.plugins.registry.entries().iter().any(Entry::asks_for_trust)
    });
    screen.window().settings.panes[0].renderers[0] = "fine".to_owned();
    screen.settle();
    assert_eq!(screen.window().views.panes[&0].sides[0].shown.as_ref().unwrap().renderer, "fine");
    let list = std::fs::read_to_string(folder.path().join("trust.toml")).unwrap();
    assert!(!list.contains("unlisted"), "{list}");
}

#[test]
fn a_yes_in_the_window_is_written_down() {
    for (button, table) in
        [("trust this build", "[[builds]]"), ("trust what is built there", "[[places]]")]
    {
        let folder = tempfile::tempdir().unwrap();
        let mut screen = with_untrusted_plugin(folder.path());
        screen.settle();
        screen.harness.get_by_label(button).click();
        screen.until("trust", |window| {
            !window.plugins.registry.entries().iter().any(Entry::asks_for_trust)
        });
        let list = std::fs::read_to_string(folder.path().join("trust.toml")).unwrap();
        let last = list.rsplit("[[").next().unwrap();
        assert!(list.contains(table) && last.contains("unlisted.so"), "{list}");
    }
}

/// A window whose plugin `link.so` is a link to a copy of `flat` in a trusted place.
#[cfg(unix)]
fn with_a_link(folder: &Path) -> Screen {
    let built = built_plugins().plugin;
    let list = folder.join("trust.toml");
    let trusted = folder.join("trusted.so");
    std::fs::copy(&built[0], &trusted).unwrap();
    for (path, place) in [(&built[1], false), (&trusted, true)] {
        let (manifest, contents) = inspect(path).unwrap();
        let add = |list: &mut TrustFile| list.add(path, &manifest, contents, place);
        TrustFile::change(&list, add).unwrap();
    }
    std::os::unix::fs::symlink(&trusted, folder.join("link.so")).unwrap();
    let plugin = vec![built[1].clone(), folder.join("link.so")];
    Screen::with(&ViewerArguments {
        memory: None,
        in_place: false,
        colors: Default::default(),
        files: vec![SAMPLE.into()],
        up: UpAxis::Y,
        plugins: PluginFiles { plugin, trust_file: Some(list), ..PluginFiles::default() },
        device: DeviceArguments::default(),
    })
}

/// Turns the link to another build, which is not trusted.
#[cfg(unix)]
fn turn_the_link(folder: &Path) {
    let mut bytes = std::fs::read(&built_plugins().plugin[0]).unwrap();
    bytes.extend([0; 16]);
    std::fs::write(folder.join("unlisted.so"), bytes).unwrap();
    std::os::unix::fs::symlink(folder.join("unlisted.so"), folder.join("new.so")).unwrap();
    std::fs::rename(folder.join("new.so"), folder.join("link.so")).unwrap();
}

#[cfg(unix)]
#[test]
fn a_link_that_is_turned_under_the_window_runs_nothing_until_somebody_says_yes() {
    let asks = |window: &mut Window| {
        let entries = window.plugins.registry.entries();
        entries.iter().any(|entry| entry.path.ends_with("link.so") && entry.asks_for_trust())
    };
    // Its renderer is shown: the rebuilt file is refused, and the question comes.
    let folder = tempfile::tempdir().unwrap();
    let mut screen = with_a_link(folder.path());
    screen.window().settings.panes[0].renderers[0] = "flat".to_owned();
    screen.settle();
    turn_the_link(folder.path());
    screen.until("the question", asks);
    screen.until("the refusal", |window| window.messages.contains("a place that is new here"));
    assert!(!screen.window().messages.contains("was rebuilt"));
    screen.frames();
    screen.harness.get_by_label("Use this plugin?");
    screen.harness.get_by_label("leads to");

    // It is checked and not yet loaded: the untrusted build never runs.
    let folder = tempfile::tempdir().unwrap();
    let mut screen = with_a_link(folder.path());
    screen.settle();
    turn_the_link(folder.path());
    screen.window().settings.panes[0].renderers[0] = "flat".to_owned();
    screen.until("the question", asks);
    let shown = |window: &mut Window| {
        window.views.panes[&0].sides[0].shown.as_ref().map(|shown| shown.renderer.clone())
    };
    // Either the checked file was loaded, or nothing was.
    screen.until("an answer", |window| {
        window.messages.contains("a place that is new here")
            || shown(window).as_deref() == Some("flat")
    });
    assert!(!screen.window().messages.contains("was rebuilt"));
}

/// The list of plugins has a check mark for a process of its own, which is written down, and taken back.
#[cfg(unix)]
#[test]
fn a_check_mark_isolates_a_package_and_is_remembered() {
    let folder = tempfile::tempdir().unwrap();
    let mut screen = with_untrusted_plugin(folder.path());
    screen.settle();
    screen.harness.get_by_label("not now").click();
    screen.until("the answer", |window| window.messages.contains("stays unused"));
    screen.window().panels.plugin_list = true;
    for is_isolated in [true, false] {
        // A window that opens takes a frame to find its size; its list may reach beyond the screen.
        screen.frames();
        screen.harness.get_all_by_label("own process").next().unwrap().click_accesskit();
        screen.frames();
        screen.until("the list", |window| {
            let mut entries = window.plugins.registry.entries().iter();
            entries.any(Entry::is_isolated) == is_isolated
        });
        let list = std::fs::read_to_string(folder.path().join("trust.toml")).unwrap();
        assert_eq!(list.contains("[[isolated]]"), is_isolated, "{list}");
    }
}
