//! Colours by attributes and filters, in the window.

use super::scenes::n_pixels_unlike_rendered;
use super::{SAMPLE, Screen, built_plugins};
use crate::ViewerArguments;
use crate::document::{generations, undo};
use egui_kittest::kittest::Queryable as _;
use surfelshop_cloud::display::{
    Attribute, ColorBy, ColorMap, ColorSource, Filter, FilterAction, FilterTest, MapChoice,
    RangeEnd,
};
use surfelshop_cloud::scene::Axis;
use surfelshop_session::options::colors::ColorArguments;
use surfelshop_session::options::{DeviceArguments, UpAxis};

fn above(height: f64) -> Filter {
    let test = FilterTest::Range([height, f64::INFINITY]);
    Filter { attribute: Attribute::Height, action: FilterAction::Keep, test }
}

fn by_height() -> ColorSource {
    ColorSource::new(ColorBy::Attribute(Attribute::Height))
}

fn n_shown(screen: &mut Screen) -> u64 {
    screen.window().document.clouds.as_ref().unwrap().clouds.facts.n_surfels
}

/// Invariant: a scene with colours and filters looks in the window as `render` draws it, pixel by pixel
#[test]
fn colours_and_filters_are_what_render_makes_of_the_saved_scene() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("a.scene.toml");
    let mut screen = Screen::sample();
    let settings = &mut screen.window().settings;
    settings.color = by_height();
    settings.color.map = MapChoice::Map(ColorMap::Turbo);
    settings.color.range = [RangeEnd::Percent(10.0), RangeEnd::Value(1.75)];
    settings.filters = vec![above(0.75)];
    // What is open below shows its backs.
    settings.splats.tint_backs = true;
    screen.settle();
    let shown = n_shown(&mut screen);
    assert!((1000..119_051).contains(&shown), "{shown}");
    screen.window().save_scene(&scene);
    assert_eq!(n_pixels_unlike_rendered(&mut screen, &scene, built_plugins()), 0);
    // And in a window that opens it.
    let settings = screen.window().settings.clone();
    let mut other = Screen::open(&[scene.to_str().unwrap()]);
    other.settle();
    let opened = &other.window().settings;
    assert_eq!((&opened.color, &opened.filters), (&settings.color, &settings.filters));
    assert_eq!(opened.splats, settings.splats);
    assert_eq!(n_pixels_unlike_rendered(&mut other, &scene, built_plugins()), 0);
}

#[test]
fn the_upward_axis_of_a_scene_is_read_and_written() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("z.scene.toml");
    let text = format!(
        "format = 1\nup = 'z'\ncolor = {{ by = 'height' }}\n[[clouds]]\npath = '{SAMPLE}'\n\
         [[views]]\nrenderer = 'flat'\n"
    );
    std::fs::write(&scene, text).unwrap();
    let mut screen = Screen::open(&[scene.to_str().unwrap()]);
    screen.settle();
    assert_eq!(screen.window().display_settings().up, Axis::PlusZ);
    screen.window().save_scene(&scene);
    let saved = std::fs::read_to_string(&scene).unwrap();
    assert!(saved.contains("up = \"z\"\n") && saved.contains("by = \"height\""), "{saved}");
    assert_eq!(n_pixels_unlike_rendered(&mut screen, &scene, built_plugins()), 0);
}

/// 1,600 points of a hill on a square of 40; where `colored`, with colours.
fn hill(colored: bool) -> String {
    let kind = if colored {
        "property uchar red\nproperty uchar green\nproperty uchar blue\n"
    } else {
        ""
    };
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex 1600\nproperty float x\nproperty float y\nproperty float z\n{kind}end_header\n"
    );
    for i in 0..1600 {
        let (x, y) = (f64::from(i % 40), f64::from(i / 40));
        let z = 4.0 * (-((x - 20.0).powi(2) + (y - 20.0).powi(2)) / 100.0).exp();
        let color = if colored { " 9 99 199" } else { "" };
        text += &format!("{x} {y} {z}{color}\n");
    }
    text
}

/// Invariant: land without colours is coloured by height when it is opened, unless something else was asked for
#[test]
fn bare_land_is_coloured_by_height() {
    let folder = tempfile::tempdir().unwrap();
    let [bare, colored] = [false, true].map(|colored| {
        let file = folder.path().join(format!("{colored}.ply"));
        std::fs::write(&file, hill(colored)).unwrap();
        file
    });
    let opened = |file: &std::path::Path, up: UpAxis, colors: ColorArguments| {
        let files = vec![file.to_owned()];
        let arguments = ViewerArguments {
            memory: None,
            in_place: false,
            colors,
            files,
            up,
            plugins: built_plugins(),
            device: DeviceArguments::default(),
        };
        let mut screen = Screen::with(&arguments);
        screen.settle();
        screen.window().settings.color.by.clone()
    };
    let height = by_height().by;
    let usual = ColorArguments::default;
    assert_eq!(opened(&bare, UpAxis::Z, usual()), height);
    assert_eq!(opened(&bare, UpAxis::Y, usual()), ColorBy::File, "a model");
    assert_eq!(opened(&colored, UpAxis::Z, usual()), ColorBy::File);
    let normal = ColorArguments { color_by: Some(ColorBy::Normal), ..usual() };
    assert_eq!(opened(&bare, UpAxis::Z, normal), ColorBy::Normal);
}

#[test]
fn tools_and_files_have_the_whole_cloud_and_undo_covers_colours() {
    let mut screen = Screen::sample();
    let before = |screen: &mut Screen| {
        let shown = screen.window().document.clouds.as_ref().unwrap();
        generations(&shown.open_clouds.all()[0].loaded.cloud)
    };
    let columns = before(&mut screen);
    screen.window().settings.color = by_height();
    screen.window().settings.filters = vec![above(0.75)];
    screen.settle();
    let shown = screen.window().document.clouds.as_ref().unwrap();
    assert!(!shown.open_clouds.all()[0].is_unsaved(), "nothing was edited");
    let drawn = generations(&shown.clouds.loaded[0].cloud);
    assert!(drawn.iter().all(|generation| !columns.contains(generation)));
    assert_eq!(before(&mut screen), columns);
    undo::undo(screen.window());
    screen.settle();
    assert_eq!(
        (n_shown(&mut screen), &screen.window().settings.color),
        (119_051, &ColorSource::default())
    );
    let shown = screen.window().document.clouds.as_ref().unwrap();
    assert_eq!(generations(&shown.clouds.loaded[0].cloud), columns, "the very same columns");
}

#[test]
fn the_surfel_under_the_pointer_is_that_of_the_whole_cloud() {
    let mut screen = Screen::sample();
    let settings = &mut screen.window().settings;
    (settings.color, settings.filters) = (by_height(), vec![above(0.75)]);
    screen.settle();
    let camera = screen.window().views.camera;
    let shown = screen.window().document.clouds.as_ref().unwrap();
    let displayed = &shown.displayed;
    let whole = &shown.open_clouds.clouds;
    let cloud = &displayed.clouds.loaded[0].cloud;
    for index in [0, cloud.len() / 2, cloud.len() - 1] {
        let point = cloud.world_position(index).unwrap();
        let nearest = crate::views::nearest_surfel(displayed, &camera, point).unwrap();
        let line = crate::views::describe_surfel(displayed, whole, point, nearest);
        let source = displayed.source_index(0, index);
        assert!(source > index || index == 0, "earlier ones are hidden");
        assert!(line.contains(&format!("surfel {source} ")), "{line}");
        assert_eq!(whole.loaded[0].cloud.world_position(source), Some(point));
        let height = line.split("height ").nth(1).unwrap().parse::<f64>().unwrap();
        assert!((height - point.y).abs() < 1e-6, "{line}");
        assert!(line.contains("colour "), "the file's own: {line}");
    }
}

#[test]
fn what_a_cloud_lacks_is_said_and_shown_without() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("b.scene.toml");
    let text = format!(
        "format = 1\ncolor = {{ by = 'warmth' }}\n[[clouds]]\npath = '{SAMPLE}'\n[[filter]]\n\
         column = 'height'\naction = 'keep'\nrange = [0.75, inf]\n"
    );
    std::fs::write(&scene, text).unwrap();
    let mut screen = Screen::open(&[scene.to_str().unwrap()]);
    screen.settle();
    assert!(screen.window().messages.contains("no cloud has a column `warmth`"));
    assert!(n_shown(&mut screen) < 119_051, "filters are held all the same");
    // The scene keeps what it says.
    screen.window().save_scene(&scene);
    assert!(std::fs::read_to_string(&scene).unwrap().contains("by = \"warmth\""));
    // Another file is shown as it is.
    let context = screen.harness.ctx.clone();
    screen.window().open(&context, vec![SAMPLE.into()]);
    screen.until("the cloud", |window| {
        window.document.loader.is_none() && window.document.scene_file.is_none()
    });
    screen.settle();
    let settings = &screen.window().settings;
    assert_eq!((&settings.color, settings.filters.len()), (&ColorSource::default(), 0));
    assert_eq!(n_shown(&mut screen), 119_051);
}

#[test]
fn the_panel_has_sources_maps_and_filters() {
    let mut screen = Screen::sample();
    screen.window().select(crate::panels::Selection::Cloud(0));
    // High enough for all of it.
    screen.harness.set_size(eframe::egui::Vec2::new(1000.0, 1600.0));
    screen.window().settings.color = by_height();
    screen.settle();
    screen.frames();
    // Once in the panel; views show it without a name of its own.
    screen.harness.get_by_label("range of height");
    screen.harness.get_by_label("legend");
    screen.window().settings.color.range = [RangeEnd::Value(0.5), RangeEnd::Value(1.5)];
    screen.settle();
    screen.frames();
    screen.harness.get_by_label("hide the rest").click();
    screen.until("the filter", |window| window.settings.filters.len() == 1);
    let filter = screen.window().settings.filters[0].clone();
    assert_eq!(filter.test, FilterTest::Range([0.5, 1.5]));
    screen.settle();
    assert!(n_shown(&mut screen) < 119_051);
    screen.harness.get_by_label("usual range").click();
    screen
        .until("the usual range", |window| window.settings.color.range == ColorSource::USUAL_RANGE);
}
