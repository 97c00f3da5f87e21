//! Measurements: numbers of a view, and error against time.

use super::plugins::faulty;
use super::{SAMPLE, Screen, built_plugins, request_of};
use crate::ViewerArguments;
use crate::document::Mode;
use crate::measure::Kind;
use crate::measure::Measurement;
use crate::measure::ReferenceChoice;
use crate::measure::Status;
use crate::render_thread::{CommandQueue, RenderCommand, ViewRequest, ViewSlot};
use crate::window::Window;
use eframe::egui::{Key, Modifiers, Vec2};
use egui_kittest::kittest::Queryable as _;
use std::sync::Arc;
use std::time::Duration;
use surfelshop_api::graph::Output;
use surfelshop_api::params::Value;
use surfelshop_image::Image;
use surfelshop_image::exr;
use surfelshop_image::metrics::{self, Settings};
use surfelshop_image::outputs::four_components;
use surfelshop_session::options::DeviceArguments;
use surfelshop_session::options::PluginFiles;
use surfelshop_session::options::UpAxis;

/// A window with the sample, the faulty plugins, the tracers, and the panel open.
fn with_panel(renderer: &str) -> Screen {
    let mut plugin = built_plugins().plugin;
    let reference = plugin[0].to_str().unwrap().replace("surfelshop_flat", "surfelshop_reference");
    plugin.extend([reference.into(), faulty()]);
    let mut screen = Screen::with(&ViewerArguments {
        memory: None,
        in_place: false,
        colors: Default::default(),
        files: vec![SAMPLE.into()],
        up: UpAxis::Y,
        // For a tracer that never stops; the others stop at once.
        plugins: PluginFiles {
            plugin,
            trust: true,
            patience: Some(Duration::from_secs(5)),
            ..PluginFiles::default()
        },
        device: DeviceArguments::default(),
    });
    // High enough for the whole panel.
    screen.harness.set_size(Vec2::new(1100.0, 1500.0));
    screen.window().settings.panes[0].renderers[0] = renderer.to_owned();
    screen.settle();
    screen.harness.key_press(Key::M);
    screen.until("the panel", |window| window.measure.form.open);
    // Small pictures are enough.
    let form = &mut screen.window().measure.form;
    (form.as_view, form.size, form.repeats) = (false, [160, 120], 2);
    screen.frames();
    screen.settle();
    screen
}

fn present(window: &Window) -> &Measurement {
    window.measure.current_view.as_ref().unwrap()
}

fn series(window: &Window) -> &Measurement {
    window.measure.series.as_ref().unwrap()
}

/// Clicks a button and waits for the end of the measurement.
#[track_caller]
fn run(screen: &mut Screen, label: &str) {
    // It may end within a frame.
    match label {
        "measure" => screen.window().measure.current_view = None,
        _ => screen.window().measure.series = None,
    }
    screen.frames();
    screen.harness.get_by_label(label).click();
    screen.until("the end", |window| {
        let measure = &window.measure;
        let begun = if label == "measure" { &measure.current_view } else { &measure.series };
        begun.is_some() && !measure.is_busy()
    });
    screen.frames();
}

/// The picture of the first side, which equals that of `render` by another test.
fn shown(screen: &mut Screen) -> Image {
    let rendered = &screen.window().views.panes[&0].sides[0].shown.as_ref().unwrap().rendered;
    four_components(&Output::Color, &rendered.color)
}

/// Measures a series of the factor of `fine`, to which its picture is proportional.
fn run_gain_series(screen: &mut Screen, values: &str) {
    screen.window().measure.form.knob = Some("gain".to_owned());
    screen.frames();
    let form = &mut screen.window().measure.form;
    (form.typed, form.best) = (values.to_owned(), "1".to_owned());
    run(screen, "sweep");
}

/// Invariant: numbers of the panel are those of the metrics over what the views show, and say
/// when they no longer are
#[test]
fn numbers_of_a_view_are_those_of_what_it_shows() {
    let mut screen = with_panel("ewa-phong");
    screen.window().measure.form.as_view = true;
    screen.window().measure.form.against = Some(ReferenceChoice::Renderer("flat".to_owned()));
    run(&mut screen, "measure");
    let measured = shown(&mut screen);
    screen.window().settings.panes[0].renderers[0] = "flat".to_owned();
    screen.settle();
    let truth = shown(&mut screen);
    let development = screen.window().settings.display_transform();
    let settings = Settings { development, ..Settings::default() };
    let expected = metrics::compare(&measured, &truth, &settings).unwrap().errors.unwrap();
    let found = present(screen.window());
    assert_eq!(found.status, Status::Done);
    let [Some(cell)] = &found.cells[..] else { panic!("{:?}", found.cells) };
    let expected: Vec<(String, f64)> =
        expected.named().into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
    assert_eq!(cell.errors, expected);
    assert!(cell.error("rmse").unwrap() > 0.005);
    assert_eq!(cell.runs.len(), 2);
    assert!(cell.runs.iter().all(|run| run.wall_ms > 0.0));
    assert!(screen.harness.query_all_by_label_contains("ewa-phong against flat").count() > 0);
}

#[test]
fn both_sides_are_measured_and_one_that_is_no_number_says_so() {
    let mut screen = with_panel("not-finite");
    screen.window().settings.panes[0].mode = Mode::SideBySide;
    screen.window().settings.panes[0].renderers[1] = "fine".to_owned();
    screen.window().measure.form.against = Some(ReferenceChoice::Renderer("flat".to_owned()));
    screen.settle();
    run(&mut screen, "measure");
    let found = present(screen.window());
    let [Some(bad), Some(good)] = &found.cells[..] else { panic!("{:?}", found.cells) };
    assert_eq!((bad.value.as_str(), good.value.as_str()), ("not-finite", "fine"));
    assert!(bad.fault.as_ref().unwrap().contains("pixels are not finite"), "{bad:?}");
    assert!(bad.errors.is_empty() && bad.runs.is_empty(), "{bad:?}");
    assert!(good.fault.is_none() && good.error("rmse").is_some() && good.runs.len() == 2);
    assert_eq!(screen.harness.query_all_by_label_contains("pixels are not finite").count(), 1);
    // A failure is reported as well.
    screen.window().settings.panes[0].renderers[0] = "fine".to_owned();
    screen.window().measure.form.against =
        Some(ReferenceChoice::Renderer("returns-error".to_owned()));
    run(&mut screen, "measure");
    let Status::Failed(line) = &present(screen.window()).status else { panic!("it did not fail") };
    assert!(
        line.contains("returns-error") && line.contains("nothing to measure against"),
        "{line}"
    );
    let line = line.clone();
    assert!(screen.harness.query_all_by_label(&line).count() > 0);
}

#[test]
fn a_sweep_has_a_point_for_each_value_and_a_click_on_it_sets_the_parameter() {
    let mut screen = with_panel("fine");
    run_gain_series(&mut screen, "0.5, 1, 2, 2, 3");
    let ctx = screen.harness.ctx.clone();
    let found = series(screen.window());
    assert_eq!(found.status, Status::Done);
    let cells: Vec<_> = found.cells.iter().map(|cell| cell.as_ref().unwrap()).collect();
    let values: Vec<&str> = cells.iter().map(|cell| cell.value.as_str()).collect();
    assert_eq!(values, ["0.5", "1", "2", "3"]);
    assert!(cells.iter().all(|cell| cell.fault.is_none() && cell.runs.len() == 2), "{cells:?}");
    // Each card has a picture.
    let pictures: Vec<_> = (0..4).map(|i| found.picture(&ctx, i)).collect();
    assert!(pictures.iter().all(Option::is_some), "{pictures:?}");
    // The errors are those of the factor times one and the same picture.
    let rmse: Vec<f64> = cells.iter().map(|cell| cell.error("rmse").unwrap()).collect();
    assert!(rmse[0] > 0.01 && rmse[1] == 0.0, "{rmse:?}");
    for (error, factor) in rmse[2..].iter().zip([2.0, 4.0]) {
        assert!((error / rmse[0] - factor).abs() < 1e-4 * factor, "{rmse:?}");
    }
    let gain = |window: &Window| window.settings.panes[0].values_of(0).get("gain").cloned();
    assert_eq!(gain(screen.window()), None);
    for value in ["0.5", "2", "3"] {
        let label = format!("gain {value}: RMSE ");
        assert_eq!(screen.harness.query_all_by_label_contains(&label).count(), 1, "{label}");
    }
    assert_eq!(screen.harness.query_all_by_label_contains("gain 1: RMSE ").count(), 0);
    screen.harness.get_by_label_contains("gain 2: RMSE ").click();
    screen.until("the value", |window| gain(window) == Some(Value::Float(2.0)));
    screen.settle();
    // A series does not depend on the present value of the knob.
    let window = &*screen.window();
    assert_eq!(series(window).stale(window, Kind::Series), None);
    screen.harness.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    screen.until("the value before", |window| gain(window).is_none());
    screen.harness.key_press_modifiers(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    screen.until("the value again", |window| gain(window) == Some(Value::Float(2.0)));
}

#[test]
fn the_values_of_a_sweep_are_those_that_report_takes_and_can_be_typed() {
    let mut screen = with_panel("environment");
    screen.frames();
    let form = &screen.window().measure.form;
    assert_eq!((form.typed.as_str(), form.best.as_str()), ("1, 2, 3, 4, 5", "5"));
    screen.window().measure.form.typed = "1, many".to_owned();
    screen.frames();
    screen.harness.get_by_label("sweep").click();
    screen.until("the refusal", |window| window.messages.contains("many"));
    assert!(screen.window().measure.series.is_none());
    screen.window().measure.form.knob = Some("ior".to_owned());
    screen.frames();
    screen.window().measure.form.typed =
        (10..50).map(|i| format!("1.{i}")).collect::<Vec<_>>().join(",");
    screen.frames();
    screen.harness.get_by_label("sweep").click();
    screen.until("the refusal", |window| window.messages.contains("expected at most 16 values"));
}

#[test]
fn what_has_changed_since_a_measurement_is_said() {
    let mut screen = with_panel("fine");
    screen.window().measure.form.against = Some(ReferenceChoice::Renderer("flat".to_owned()));
    run(&mut screen, "measure");
    let stale = |window: &Window| present(window).stale(window, Kind::CurrentView);
    assert_eq!(stale(screen.window()), None);
    let settings = screen.window().settings.clone();
    let camera = screen.window().views.camera;
    type Change = fn(&mut Window);
    let changes: [(&str, Change); 7] = [
        ("the camera has moved", |window| window.views.camera.eye *= 1.1),
        ("another renderer is shown", |window| {
            window.settings.panes[0].renderers[0] = "flat".to_owned();
        }),
        ("a parameter has changed", |window| {
            let values = window.settings.panes[0].values.entry("fine".into()).or_default();
            values.insert("gain".to_owned(), Value::Float(2.0));
        }),
        ("the reference has changed", |window| {
            let values = window.settings.panes[0].values.entry("flat".into()).or_default();
            values.insert("ao-strength".to_owned(), Value::Float(0.5));
        }),
        ("light or surface have changed", |window| {
            window.settings.scene.surface.two_sided = false;
        }),
        ("highlights or background have changed", |window| {
            window.settings.background =
                surfelshop_image::display_transform::Background::Transparent;
        }),
        ("the environment has changed", |window| {
            let studio = surfelshop_cloud::scene::ProbeSource::Studio;
            window.settings.environment =
                Some(surfelshop_cloud::scene::SceneEnvironment::new(studio));
        }),
    ];
    for (expected, change) in changes {
        change(screen.window());
        assert_eq!(stale(screen.window()), Some(expected));
        screen.frames();
        let label = format!("stale: {expected}");
        assert_eq!(screen.harness.query_all_by_label(&label).count(), 1, "{label}");
        screen.window().settings = settings.clone();
        screen.window().views.camera = camera;
        assert_eq!(stale(screen.window()), None);
        screen.frames();
    }
    screen.window().measure.form.size = [40, 30];
    assert_eq!(stale(screen.window()), Some("the size has changed"));
    screen.window().measure.form.size = [160, 120];
    screen.window().measure.form.against = Some(ReferenceChoice::Tracer("gradient".to_owned()));
    assert_eq!(stale(screen.window()), Some("another reference is chosen"));
    screen.window().measure.form.against = Some(ReferenceChoice::Renderer("flat".to_owned()));
    screen.window().document.clouds.as_mut().unwrap().revision += 1;
    assert_eq!(stale(screen.window()), Some("the clouds have changed"));
}

#[test]
fn a_tracer_is_measured_against_and_cancelled_while_pictures_go_on() {
    let mut screen = with_panel("fine");
    screen.window().measure.form.against = Some(ReferenceChoice::Tracer("reference".to_owned()));
    let traced = |window: &mut Window, samples: i64| {
        let values = window.measure.form.tracer_values.entry("reference".to_owned()).or_default();
        values.insert("samples".to_owned(), Value::Int(samples));
    };
    traced(screen.window(), 65_536);
    screen.frames();
    screen.harness.get_by_label("measure").click();
    screen.until("the tracer", |window| {
        window.measure.is_busy() && present(window).progress().1.contains("tracing with reference")
    });
    let serial = |screen: &mut Screen| {
        screen.window().views.panes[&0].sides[0].shown.as_ref().unwrap().serial
    };
    let before = serial(&mut screen);
    screen.window().settings.scene.exposure_stops = 1.0;
    screen.settle();
    assert_ne!(serial(&mut screen), before);
    assert!(screen.window().measure.is_busy());
    screen.harness.get_by_label("cancel").click();
    screen.until("the end", |window| !window.measure.is_busy());
    assert_eq!(present(screen.window()).status, Status::Cancelled);
    assert!(screen.window().measure.units.failures().is_empty());
    // Few samples end in time, and their noise is known.
    traced(screen.window(), 4);
    run(&mut screen, "measure");
    let [Some(cell)] = &present(screen.window()).cells[..] else { panic!("one picture") };
    assert!(cell.noise > 0.0 && cell.error("rmse").unwrap() > 0.0, "{cell:?}");
    // It is not traced again for the next measurement.
    screen.window().measure.form.knob = Some("gain".to_owned());
    screen.frames();
    screen.window().measure.form.typed = "1, 2".to_owned();
    screen.frames();
    screen.harness.get_by_label("sweep").click();
    screen.until("the sweep", |window| window.measure.is_busy());
    assert!(!series(screen.window()).progress().1.contains("trac"));
    screen.until("the end", |window| !window.measure.is_busy());
    let noise = series(screen.window()).cells[0].as_ref().unwrap().noise;
    assert!(noise > 0.0);
}

/// Invariant: a measurement that is cancelled, fails or hangs harms nothing in the window, and
/// holds no cloud when it is over
#[test]
fn a_tracer_that_does_not_stop_is_left_behind_and_one_that_fails_says_why() {
    let mut screen = with_panel("fine");
    screen.window().measure.form.against =
        Some(ReferenceChoice::Tracer("panics-in-tile".to_owned()));
    run(&mut screen, "measure");
    let Status::Failed(line) = &present(screen.window()).status else { panic!("it did not fail") };
    assert!(line.contains("tile goes wrong"), "{line}");
    screen.window().measure.form.against =
        Some(ReferenceChoice::Tracer("hangs-in-tile".to_owned()));
    screen.frames();
    screen.harness.get_by_label("measure").click();
    screen.until("the tracer", |window| {
        window.measure.is_busy() && present(window).progress().1.contains("tracing with")
    });
    screen.harness.get_by_label("cancel").click();
    screen.until("its end", |window| {
        window.messages.contains("did not stop within 5 s; it was left behind and is switched off")
    });
    assert!(!screen.window().measure.is_busy());
    assert!(screen.window().measure.units.failures().iter().any(|unit| unit.off));
    // It is not used again, and others are.
    screen.window().settings.scene.exposure_stops = 1.0;
    screen.settle();
    run(&mut screen, "measure");
    let Status::Failed(line) = &present(screen.window()).status else { panic!("it did not fail") };
    assert!(line.contains("hangs-in-tile") && line.contains("off"), "{line}");
    screen.window().measure.form.against = Some(ReferenceChoice::Tracer("gradient".to_owned()));
    run(&mut screen, "measure");
    assert_eq!(present(screen.window()).status, Status::Done);
}

#[test]
fn a_cancelled_sweep_keeps_what_it_has_and_holds_nothing_else() {
    let mut screen = with_panel("fine");
    let holders =
        |window: &Window| Arc::strong_count(&window.document.clouds.as_ref().unwrap().clouds);
    let before = holders(screen.window());
    screen.window().measure.form.knob = Some("gain".to_owned());
    screen.frames();
    let form = &mut screen.window().measure.form;
    (form.typed, form.best, form.repeats) = ("0.5, 2, 3, 4".to_owned(), "1".to_owned(), 100);
    screen.frames();
    screen.harness.get_by_label("sweep").click();
    screen.until("some numbers", |window| {
        window
            .measure
            .series
            .as_ref()
            .is_some_and(|series| series.cells.iter().flatten().count() > 1)
    });
    assert!(holders(screen.window()) > before);
    screen.harness.get_by_label("cancel").click();
    screen.until("the end", |window| !window.measure.is_busy());
    let found = series(screen.window());
    assert_eq!(found.status, Status::Cancelled);
    let n_known = found.cells.iter().flatten().count();
    assert!(n_known > 1 && found.cells.iter().flatten().all(|cell| cell.runs.len() < 100));
    screen.until("nothing else", |window| holders(window) == before);
    assert_eq!(series(screen.window()).cells.iter().flatten().count(), n_known);
    screen.window().measure.form.repeats = 1;
    run(&mut screen, "sweep");
    assert_eq!(series(screen.window()).status, Status::Done);
}

#[test]
fn a_file_is_measured_against_at_its_own_size() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("truth.exr");
    let write = |value: f32| {
        let (width, height) = (48, 36);
        let pixel = [value, value, value, 1.0];
        let data = pixel.repeat((width * height) as usize);
        let layer = (Output::Color, Image { width, height, components: 4, data });
        std::fs::write(&path, exr::encode(&[&layer]).unwrap()).unwrap();
    };
    let mut screen = with_panel("fine");
    let form = &mut screen.window().measure.form;
    form.against = Some(ReferenceChoice::Picture);
    form.path = folder.path().join("no.exr").display().to_string();
    let failure = |screen: &mut Screen| match &present(screen.window()).status {
        Status::Failed(line) => line.clone(),
        state => panic!("{state:?}"),
    };
    run(&mut screen, "measure");
    assert!(failure(&mut screen).contains("no.exr"));
    screen.window().measure.form.path = path.display().to_string();
    write(f32::NAN);
    run(&mut screen, "measure");
    assert!(failure(&mut screen).contains("not finite"));
    write(0.0);
    run(&mut screen, "measure");
    assert_eq!(present(screen.window()).status, Status::Done);
    let rmse = |screen: &mut Screen| {
        let cell = present(screen.window()).cells[0].clone().unwrap();
        assert!(cell.fault.is_none(), "{cell:?}");
        cell.error("rmse").unwrap()
    };
    let dark = rmse(&mut screen);
    // The file is read again.
    write(100.0);
    run(&mut screen, "measure");
    assert!(dark > 0.01 && rmse(&mut screen) > 90.0);
}

#[test]
fn pictures_of_views_go_before_those_that_are_measured() {
    let mut screen = Screen::sample();
    let of = request_of(screen.window(), "flat");
    let order =
        |serial: u64, for_measurement: bool| ViewRequest { serial, for_measurement, ..of.clone() };
    let queue = CommandQueue::default();
    for (serial, for_measurement) in [(1, true), (3, false), (2, false)] {
        queue.request(ViewSlot { pane: serial as u32, side: 0 }, order(serial, for_measurement));
    }
    let next = || match queue.next(None, None) {
        Some(RenderCommand::Draw(_, order)) => order.serial,
        _ => panic!("expected a picture"),
    };
    assert_eq!([next(), next(), next()], [2, 3, 1]);
}
