//! Tracers as views: a renderer stands in until enough is traced, and the last picture is the one that `render` makes.

use super::plugins::faulty;
use super::{SAMPLE, Screen, built_plugins};
use crate::ViewerArguments;
use crate::render_thread::TracedState;
use crate::window::Window;
use egui_kittest::kittest::Queryable as _;
use surfelshop_api::UnitKind;
use surfelshop_api::params::{Value, Values};
use surfelshop_runtime::trace::trace;
use surfelshop_session::options::{DeviceArguments, PluginFiles, UpAxis};
use surfelshop_session::render::traced;

fn screen() -> Screen {
    let mut plugin = built_plugins().plugin;
    let name = format!(
        "{}surfelshop_reference{}",
        std::env::consts::DLL_PREFIX,
        std::env::consts::DLL_SUFFIX
    );
    plugin.push(plugin[0].with_file_name(name));
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
            patience: Some(std::time::Duration::from_secs(2)),
            ..PluginFiles::default()
        },
        device: DeviceArguments::default(),
    });
    screen.settle();
    screen
}

fn values(samples: i64) -> Values {
    let mode = ("mode".to_owned(), Value::Text("direct".to_owned()));
    [mode, ("samples".to_owned(), Value::Int(samples))].into()
}

/// Shows the tracer in the view.
fn trace_view(screen: &mut Screen, samples: i64) {
    let pane = screen.window().settings.pane_mut(0).unwrap();
    pane.renderers[0] = "reference".to_owned();
    pane.values.insert("reference".to_owned(), values(samples));
}

/// The number of the tracer's picture, how far it is, and whether more follows.
fn state(window: &Window) -> Option<(u64, TracedState, bool)> {
    let shown = window.views.panes[&0].sides[0].shown.as_ref()?;
    (shown.renderer == "reference").then_some(())?;
    Some((shown.serial, shown.rendered.traced.clone()?, shown.rendered.refines))
}

/// Invariant: a tracer in a view is shown as it gets better, behind it a renderer, and ends at what `render`
/// makes
#[test]
fn a_traced_view_gets_better_until_it_is_the_picture_that_render_makes() {
    let mut screen = screen();
    assert!(screen.window().drawers().iter().any(|name| name == "reference"));
    trace_view(&mut screen, 6);
    let mut states = Vec::new();
    screen.until("the traced picture", |window| {
        let Some((_, state, refines)) = state(window) else { return false };
        if states.last() != Some(&state) {
            states.push(state);
        }
        assert_eq!(refines, window.works(), "the spinner says so");
        !refines
    });
    // At first the renderer that drew before, and more and more samples.
    assert_eq!(states[0].stand_in.as_deref(), Some("ewa-phong"), "{states:?}");
    assert!(states.windows(2).all(|pair| pair[0].fraction <= pair[1].fraction), "{states:?}");
    assert_eq!(states.last().map(|last| (last.samples, last.of)), Some((6, 6)));
    assert!(screen.window().plugins.declared.contains_key("reference"));

    let window = screen.window();
    let shown = window.views.panes[&0].sides[0].shown.as_ref().unwrap();
    let registry = &window.plugins.registry;
    let patience = Default::default();
    let unit = registry.find(UnitKind::Tracer, "reference").unwrap().load(&patience).unwrap();
    let clouds = &window.document.clouds.as_ref().unwrap().clouds;
    let (scene, view) = (&window.settings.scene, shown.rendered.view);
    let order = traced::order(&unit, &values(6), clouds, scene, None, view);
    let expected = trace(&unit, order, &patience, |_| true).unwrap();
    assert_eq!(shown.rendered.color.data, expected.color.data);
    assert!(shown.rendered.depth.is_some(), "the pointer finds surfels");
    assert_eq!(shown.rendered.traced.as_ref().unwrap().describe(), "6 samples");
}

#[test]
fn the_status_line_says_how_far_a_picture_is() {
    let mut screen = screen();
    trace_view(&mut screen, 4096);
    screen.until("some samples", |window| {
        state(window).is_some_and(|(_, state, _)| state.samples > 0)
    });
    screen.frames();
    let said = screen.harness.query_all_by_label_contains("% traced, ").count();
    assert_eq!(said, 1);
}

#[test]
fn while_something_moves_a_renderer_stands_in() {
    let mut screen = screen();
    trace_view(&mut screen, 4096);
    screen.until("some samples", |window| {
        state(window).is_some_and(|(_, state, _)| state.samples > 0)
    });
    let (before, ..) = state(screen.window()).unwrap();
    let mut camera = screen.window().camera_of(0);
    camera.eye *= 1.05;
    screen.window().set_camera(0, camera);
    screen.until("the stand-in", |window| {
        let (serial, state, refines) = state(window).unwrap();
        assert!(refines);
        serial > before && state.of == 0 && state.stand_in.is_some()
    });
    let moved = state(screen.window()).unwrap().0;
    screen.until("samples from there", |window| {
        let (serial, state, _) = state(window).unwrap();
        serial > moved && state.samples > 0
    });
    // Another renderer ends it at once.
    let pane = screen.window().settings.pane_mut(0).unwrap();
    pane.renderers[0] = "flat".to_owned();
    screen.settle();
    screen.frames();
    assert!(!screen.window().works());
}

#[test]
fn a_tracer_that_fails_leaves_a_line_and_the_window() {
    let mut screen = screen();
    for (name, words) in [("panics-in-tile", "panic"), ("hangs-in-tile", "")] {
        let pane = screen.window().settings.pane_mut(0).unwrap();
        pane.renderers[0] = name.to_owned();
        if words.is_empty() {
            // It is left, and what comes after is drawn.
            screen.until("its turn", |window| {
                window.views.panes[&0].sides[0].shown.as_ref().is_some_and(|s| s.renderer == name)
            });
        } else {
            screen.until("a line", |window| {
                window
                    .messages
                    .last()
                    .is_some_and(|line| line.contains(name) && line.contains(words))
            });
        }
        screen.window().settings.pane_mut(0).unwrap().renderers[0] = "flat".to_owned();
        screen.settle();
    }
}
