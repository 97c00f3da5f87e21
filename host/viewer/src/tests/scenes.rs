//! Scenes: saved, opened, and drawn by `render`.

use super::{SAMPLE, Screen, built_plugins};
use crate::document::{Mode, USUAL_BACKGROUND, USUAL_RENDERER, undo};
use egui_kittest::kittest::Queryable as _;
use std::path::Path;
use surfelshop_cloud::display::{ColorBy, ColorSource};
use surfelshop_session::options::PluginFiles;

/// Invariant: what the window shows of a still view is what `render` makes of the saved scene,
/// pixel by pixel
#[test]
fn the_settled_view_is_what_render_makes_of_the_saved_scene() {
    use glam::DVec2;
    use surfelshop_api::params::Value;
    let mut screen = Screen::sample();
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("a.scene.toml");
    let window = screen.window();
    let mut camera = window.views.camera;
    crate::views::navigation::orbit(&mut camera, DVec2::new(0.7, 0.2));
    window.set_camera(0, camera);
    window.settings.scene.surface.two_sided = false;
    window.settings.scene.exposure_stops = 0.5;
    let values = window.settings.panes[0].values.entry("ewa-phong".into()).or_default();
    values.insert("specular".to_owned(), Value::Float(0.7));
    screen.settle();
    screen.window().save_scene(&scene);
    assert!(scene.exists(), "{:?}", screen.window().messages.last());
    assert_eq!(n_pixels_unlike_rendered(&mut screen, &scene, built_plugins()), 0);
}

#[test]
fn large_radii_and_natural_light_are_what_render_makes_of_them() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("wide.scene.toml");
    let text = format!(
        "format = 1\n[surface]\nradius_scale = 4.0\n[environment]\nprobe = \"sky\"\n\
         [[clouds]]\npath = '{SAMPLE}'\n[[views]]\nrenderer = \"environment\"\n"
    );
    std::fs::write(&scene, text).unwrap();
    let mut screen = Screen::open(&[scene.to_str().unwrap()]);
    screen.settle();
    let saved = folder.path().join("saved.scene.toml");
    screen.window().save_scene(&saved);
    assert_eq!(n_pixels_unlike_rendered(&mut screen, &saved, built_plugins()), 0);
    // Also with radii that were changed in the window.
    screen.window().settings.scene.surface.radius_scale = 9.0;
    screen.settle();
    screen.window().save_scene(&saved);
    assert_eq!(n_pixels_unlike_rendered(&mut screen, &saved, built_plugins()), 0);
}

/// Pixels of the first view that differ from what `render` makes of a scene.
pub(super) fn n_pixels_unlike_rendered(
    screen: &mut Screen,
    scene: &Path,
    plugins: PluginFiles,
) -> usize {
    use surfelshop_session::options::explicit::parse;
    use surfelshop_session::render::{self, RenderArguments};
    let png = scene.with_extension("png");
    let rendered =
        screen.window().views.panes[&0].sides[0].shown.as_ref().unwrap().rendered.clone();
    let [width, height] = rendered.size;
    let mut line = ["surfelshop", "render", "--trust"].map(str::to_owned).to_vec();
    for plugin in &plugins.plugin {
        line.extend(["--plugin".to_owned(), plugin.display().to_string()]);
    }
    line.extend([scene.display().to_string(), "-o".to_owned(), png.display().to_string()]);
    line.extend(["--size".to_owned(), format!("{width}x{height}")]);
    let line: Vec<&str> = line.iter().map(String::as_str).collect();
    let (arguments, explicit) = parse::<RenderArguments>(&line).unwrap();
    render::run(&arguments, &explicit).unwrap();
    let expected = image::open(&png).unwrap().into_rgba8().into_raw();
    expected.chunks(4).zip(rendered.levels.chunks(4)).filter(|(a, b)| a != b).count()
}

/// Invariant: a cloud's own renderer is chosen, undone, saved and drawn as `render` draws it
#[test]
fn a_cloud_has_a_renderer_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.ply", "b.ply"] {
        std::fs::copy(SAMPLE, folder.path().join(name)).unwrap();
    }
    let scene = folder.path().join("two.scene.toml");
    let text = "format = 1\n[[clouds]]\npath = 'a.ply'\n[[clouds]]\npath = 'b.ply'\n\
                transform = { scale = 0.5, translation = [1.2, 0, 0.3] }\n\
                [[views]]\nrenderer = 'ewa-phong'\n";
    std::fs::write(&scene, text).unwrap();
    let mut screen = Screen::open(&[scene.to_str().unwrap()]);
    screen.settle();
    let levels = |screen: &mut Screen| {
        let side = &screen.window().views.panes[&0].sides[0];
        side.shown.as_ref().unwrap().rendered.levels.clone()
    };
    let before = levels(&mut screen);
    screen.window().select(crate::panels::Selection::Cloud(1));
    screen.frames();
    screen.harness.get_by_label("renderer of b.ply").click();
    screen.frames();
    screen.harness.get_all_by_label("flat").last().unwrap().click();
    screen.until("the choice", |window| {
        let shown = window.document.clouds.as_ref().unwrap();
        shown.named().iter().map(Option::is_some).eq([false, true])
    });
    screen.settle();
    let own = levels(&mut screen);
    assert!(own != before);
    let saved = folder.path().join("saved.scene.toml");
    screen.window().save_scene(&saved);
    let text = std::fs::read_to_string(&saved).unwrap();
    assert!(text.contains("renderer = \"flat\""), "{text}");
    assert_eq!(n_pixels_unlike_rendered(&mut screen, &saved, built_plugins()), 0);
    screen.until("a step to undo", |window| window.document.history.has_undo(&window.snapshot()));
    undo::undo(screen.window());
    screen.settle();
    assert!(levels(&mut screen) == before, "undone");
    undo::redo(screen.window());
    screen.settle();
    assert!(levels(&mut screen) == own, "done again");
    let mut again = Screen::open(&[saved.to_str().unwrap()]);
    again.settle();
    assert!(levels(&mut again) == own, "as it was saved");
}

#[test]
fn a_scene_comes_back_as_it_was_saved() {
    use surfelshop_api::params::Value;
    use surfelshop_cloud::display::{
        ColorBy, ColorSource, Filter, FilterAction, FilterTest, Scale,
    };
    use surfelshop_image::display_transform::Background;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("b.scene.toml");
    let mut screen = Screen::sample();
    screen.harness.get_all_by_label("split").next().unwrap().click();
    screen.until("another view", |window| window.settings.panes.len() == 2);
    let window = screen.window();
    let pane = &mut window.settings.panes[1];
    (pane.mode, pane.wipe, pane.linked) = (Mode::Wipe, 0.25, false);
    pane.values.entry("flat".into()).or_default().insert("ambient".to_owned(), Value::Float(0.5));
    let mut own = window.views.camera;
    own.eye *= 1.5;
    window.views.own_cameras.insert(1, own);
    window.settings.scene.surface.low_pass = 2.0;
    window.settings.shows_legend = false;
    let radius = surfelshop_cloud::display::Attribute::column("radius");
    window.settings.color = ColorSource::new(ColorBy::Attribute(radius.clone()));
    window.settings.color.scale = Scale::Logarithmic;
    let test = FilterTest::Range([0.0, 1.0]);
    window.settings.filters = vec![Filter { attribute: radius, action: FilterAction::Keep, test }];
    window.save_scene(&path);
    let (settings, camera) = (window.settings.clone(), window.views.camera);
    // Unknown keys stay.
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, format!("mood = \"calm\"\n{text}")).unwrap();
    let mut other = Screen::open(&[path.to_str().unwrap()]);
    other.settle();
    // Files hold linear colours, whose last bit depends on the conversion.
    let ends = |background: Background| match background {
        Background::Gradient { top, bottom } => [top, bottom].concat(),
        other => panic!("{other:?}"),
    };
    let found = ends(other.window().settings.background);
    for (a, b) in found.into_iter().zip(ends(settings.background)) {
        assert!((a - b).abs() < 1e-6, "{a} and {b}");
    }
    other.window().settings.background = settings.background;
    assert_eq!(other.window().settings, settings);
    assert_eq!((other.window().views.camera, other.window().views.own_cameras[&1]), (camera, own));
    other.window().save_scene(&path);
    let again = std::fs::read_to_string(&path).unwrap();
    assert!(again.contains("mood = \"calm\""), "{again}");
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
    // Outputs that the window cannot show stay.
    let copy = folder.path().join("d.scene.toml");
    screen.window().save_scene(&copy);
    let saved = std::fs::read_to_string(&copy).unwrap();
    assert!(saved.contains("\"transparent\"") && saved.contains("\"depth\""), "{saved}");
    let context = screen.harness.ctx.clone();
    screen.window().open(&context, vec![SAMPLE.into()]);
    screen.until("the cloud", |window| {
        window.document.loader.is_none() && window.document.scene_file.is_none()
    });
    let settings = screen.window().settings.clone();
    assert_eq!(screen.window().document.scene_path, None);
    assert_eq!(settings.background, USUAL_BACKGROUND, "that of the scene went with it");
    assert_eq!((settings.panes.len(), &*settings.panes[0].renderers[0]), (1, USUAL_RENDERER));
    // Other files leave what was chosen for those before, but not how they are drawn.
    screen.window().settings.panes[0].renderers[0] = "flat".to_owned();
    screen.window().settings.color = ColorSource::new(ColorBy::Normal);
    screen.settle();
    let n_opened = screen.window().document.n_opened;
    screen.window().open(&context, vec![SAMPLE.into()]);
    screen.until("the cloud again", |window| window.document.n_opened > n_opened);
    let settings = &screen.window().settings;
    assert_eq!((&settings.color, &*settings.panes[0].renderers[0]), (&Default::default(), "flat"));
}

#[test]
fn what_the_window_cannot_show_stays_with_its_view() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("e.scene.toml");
    let text = format!(
        "format = 1\n[[clouds]]\npath = '{SAMPLE}'\n[[views]]\nrenderer = \"flat\"\n\
         output = \"depth\"\nnote = \"of flat\"\n[[views]]\nrenderer = \"ewa-phong\"\n\
         note = \"of phong\"\n[layout]\npanes = [{{ wipe = nan, mode = \"wipe\" }}]\n"
    );
    std::fs::write(&scene, text).unwrap();
    let mut screen = Screen::open(&[scene.to_str().unwrap()]);
    screen.settle();
    assert_eq!(screen.window().settings.panes[0].wipe, 0.5);
    screen.harness.get_all_by_label("close").next().unwrap().click();
    screen.until("one view", |window| window.settings.panes.len() == 1);
    screen.window().save_scene(&scene);
    let saved = std::fs::read_to_string(&scene).unwrap();
    assert!(saved.contains("of phong") && !saved.contains("of flat"), "{saved}");
    assert!(!saved.contains("depth\""), "{saved}");
}

#[test]
fn values_of_a_scene_that_do_not_fit_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("c.scene.toml");
    let text = format!(
        "format = 1\n[[clouds]]\npath = '{SAMPLE}'\n[[views]]\nrenderer = \"ewa-phong\"\n\
         [views.values]\nspecular = 7.0\nmood = \"calm\"\n"
    );
    std::fs::write(&scene, text).unwrap();
    let mut screen = Screen::open(&[scene.to_str().unwrap()]);
    screen.settle();
    for words in ["`specular` takes", "no parameter `mood`"] {
        assert!(screen.window().messages.contains(words), "nothing said of {words}");
    }
}
