//! The window's state as a scene file, and back.
//!
//! The first renderer of each pane is a view of the scene, which other programs can draw. Comparison
//! modes and the arrangement, which only the window has, are in `layout`.

pub(crate) mod bookmarks;
mod lights_off;
pub(crate) mod placement;
pub(super) mod values;

use super::open_clouds::OpenCloud;
use super::settings::{Mode, PaneSettings};
use crate::views::arrangement;
use crate::views::layout::{MOST_PANES, follow_settings};
use crate::window::Window;
use std::path::Path;
use surfelshop_api::params::{Values, srgb_to_linear};
use surfelshop_cloud::display::Filter;
use surfelshop_cloud::scene::Axis;
use surfelshop_cloud::scene::{
    Backdrop, CloudRenderer, Keyed, ProbeSource, SceneCloud, SceneEnvironment, SceneFile,
    SceneView, ToneMap,
};
use surfelshop_image::display_transform::{self, Background};
use surfelshop_session::input::environment_map;
use surfelshop_session::input::scenes::NamedRenderer;
use surfelshop_session::options::UpAxis;
use surfelshop_session::setup::background_of;
use surfelshop_session::setup::tone_map_of;
use toml::{Table, Value as Toml};
use values::{toml_of, value_of};

/// The key of the layout that hides the light handles.
const LIGHT_HANDLES_KEY: &str = "lamps";

/// The key of the layout that hides the legend.
const LEGEND_KEY: &str = "legend";

/// Applies a scene to the window.
pub(crate) fn apply(window: &mut Window, file: &SceneFile) {
    let settings = &mut window.settings;
    settings.scene = file.scene();
    settings.environment = environment_map::of_scene(file);
    settings.tone_map = tone_map_of(file);
    settings.background = background_of(file);
    settings.antialias = file.antialias;
    settings.eye_dome = file.eye_dome;
    let display = file.display();
    (settings.color, settings.filters) = (display.color, display.filters);
    settings.splats = display.splats;
    settings.shows_legend = file.layout.get(LEGEND_KEY).and_then(Toml::as_bool).unwrap_or(true);
    settings.shows_light_handles =
        file.layout.get(LIGHT_HANDLES_KEY).and_then(Toml::as_bool).unwrap_or(true);
    settings.bookmarks = bookmarks::read(&file.layout);
    settings.measures = file.measures.iter().map(|measure| measure.known.clone()).collect();
    settings.lights_off = lights_off::read(&file.layout);
    window.views.own_cameras.clear();
    if let Some(camera) = &file.camera {
        window.views.camera = camera.known;
    }
    let layouts = file.layout.get("panes").and_then(Toml::as_array);
    let panes: Vec<PaneSettings> = file
        .views
        .iter()
        .take(MOST_PANES)
        .enumerate()
        .map(|(i, view)| {
            let layout = layouts.and_then(|layouts| layouts.get(i)).and_then(Toml::as_table);
            let mut pane = pane_of(i as u32, view, layout);
            if let Some(camera) = &view.camera {
                pane.linked = false;
                window.views.own_cameras.insert(pane.id, camera.known);
            }
            pane
        })
        .collect();
    if !panes.is_empty() {
        settings.panes = panes;
    }
    window.document.hidden_views = file.views.iter().skip(MOST_PANES).cloned().collect();
    follow_settings(window);
    let described = file.layout.get("arrangement");
    let panes = window.settings.pane_ids();
    // The default where the scene has no arrangement, or one of other views.
    window.views.tree = described
        .and_then(|described| arrangement::tree(described, &panes))
        .unwrap_or_else(|| arrangement::default_tree(&panes));
}

fn pane_of(id: u32, view: &Keyed<SceneView>, layout: Option<&Table>) -> PaneSettings {
    let mut pane = PaneSettings::new(id, &view.renderer);
    (pane.output, pane.unknown) = (view.output.clone(), view.unknown.clone());
    if !view.values.is_empty() {
        pane.values.insert(view.renderer.clone(), view.values.clone());
    }
    let Some(layout) = layout else { return pane };
    if let Some(name) = layout.get("mode").and_then(Toml::as_str) {
        pane.mode = Mode::ALL.into_iter().find(|mode| mode.name() == name).unwrap_or_default();
    }
    pane.title = layout.get("name").and_then(Toml::as_str).unwrap_or_default().to_owned();
    let shown = layout.get("clouds").and_then(Toml::as_array).map(Vec::as_slice);
    for (side, cloud) in pane.clouds.iter_mut().zip(shown.unwrap_or_default()) {
        *side = cloud.as_str().filter(|name| !name.is_empty()).map(str::to_owned);
    }
    if let Some(second) = layout.get("second").and_then(Toml::as_str) {
        second.clone_into(&mut pane.renderers[1]);
        if let Some(values) = layout.get("second_values").and_then(Toml::as_table)
            && second != view.renderer
        {
            let values: Values = values
                .iter()
                .filter_map(|(id, value)| Some((id.clone(), value_of(value)?)))
                .collect();
            pane.values.insert(second.to_owned(), values);
        }
    }
    let wipe = layout.get("wipe").and_then(Toml::as_float);
    if let Some(wipe) = wipe.filter(|wipe| wipe.is_finite()) {
        pane.wipe = (wipe as f32).clamp(0.0, 1.0);
    }
    pane
}

/// The scene of the window for a file at `path`; unknown keys of the opened scene are kept.
pub(crate) fn scene_of(window: &Window, path: &Path) -> SceneFile {
    let settings = &window.settings;
    let base = window.document.scene_file.clone();
    let mut file = base.clone().unwrap_or_default();
    file.folder = path.parent().map(Path::to_owned).unwrap_or_default();
    file.clouds = opened_clouds(window, &file.folder);
    put_clouds(window, &mut file);
    match &mut file.camera {
        Some(camera) => camera.known = window.views.camera,
        None => file.camera = Some(Keyed::from(window.views.camera)),
    }
    file.lights = with_unknown_keys(&settings.scene.lights, &file.lights);
    file.environment = settings.environment.as_ref().map(|environment| {
        let source = match &environment.source {
            ProbeSource::File(path) => ProbeSource::File(file_path_in(&file.folder, path)),
            built_in => built_in.clone(),
        };
        let unknown = file.environment.take().map(|old| old.unknown).unwrap_or_default();
        Keyed { known: SceneEnvironment { source, ..environment.clone() }, unknown }
    });
    file.exposure_stops = settings.scene.exposure_stops;
    file.tone_map = match settings.tone_map {
        display_transform::ToneMap::Clamp => ToneMap::Clamp,
        display_transform::ToneMap::Neutral => ToneMap::Neutral,
    };
    file.background = match settings.background {
        Background::Transparent => Backdrop::Transparent,
        Background::Color(encoded) => Backdrop::Color(encoded.map(srgb_to_linear)),
        Background::Gradient { top, bottom } => {
            Backdrop::Gradient { top: top.map(srgb_to_linear), bottom: bottom.map(srgb_to_linear) }
        }
    };
    file.antialias = settings.antialias;
    file.eye_dome = settings.eye_dome;
    file.surface.known = settings.scene.surface;
    put_display(window, &mut file);
    file.measures = with_unknown_keys(&settings.measures, &file.measures);
    let views = settings.panes.iter().map(|pane| {
        let own = window.views.own_cameras.get(&pane.id).filter(|_| !pane.linked);
        let known = SceneView {
            values: values_in(window, pane, 0, &file.folder),
            camera: own.map(|camera| Keyed::from(*camera)),
            // The window shows colours only and keeps other outputs.
            output: pane.output.clone(),
            ..SceneView::new(pane.renderers[0].clone())
        };
        Keyed { known, unknown: pane.unknown.clone() }
    });
    let mut views: Vec<Keyed<SceneView>> = views.collect();
    let from = base.as_ref().map(|base| base.folder.clone()).unwrap_or_default();
    views.extend(window.document.hidden_views.iter().cloned().map(|mut view| {
        // Its paths are relative to the folder of the opened scene.
        if let Some(declared) = window.plugins.declared.get(&view.known.renderer) {
            let values = std::mem::take(&mut view.known.values);
            let moved = |path: &Path| file_path_in(&file.folder, &from.join(path));
            view.known.values = surfelshop_session::parameters::with_paths(declared, values, moved);
        }
        view
    }));
    file.views = views;
    let layout = |pane| Toml::Table(layout_of(window, pane, &file.folder));
    let panes = settings.panes.iter().map(layout).collect();
    file.layout.insert("panes".to_owned(), Toml::Array(panes));
    match settings.shows_light_handles {
        true => file.layout.remove(LIGHT_HANDLES_KEY),
        false => file.layout.insert(LIGHT_HANDLES_KEY.to_owned(), Toml::Boolean(false)),
    };
    match settings.shows_legend {
        true => file.layout.remove(LEGEND_KEY),
        false => file.layout.insert(LEGEND_KEY.to_owned(), Toml::Boolean(false)),
    };
    bookmarks::write(&mut file.layout, &settings.bookmarks);
    lights_off::write(&mut file.layout, &settings.lights_off);
    match arrangement::describe(&window.views.tree, &settings.pane_ids()) {
        Some(described) => file.layout.insert("arrangement".to_owned(), described),
        None => file.layout.remove("arrangement"),
    };
    file
}

/// Updates what colours and filters the clouds; unknown keys stay with what is as it was.
fn put_display(window: &Window, file: &mut SceneFile) {
    let display = window.display_settings();
    // The usual axis is left out where it was not said before, and where the clouds do not say another one.
    let shown = window.document.clouds.iter().flat_map(|shown| &shown.clouds.loaded);
    let of_clouds = UpAxis::Auto.or_of(shown.map(|loaded| loaded.cloud.source()));
    let is_usual = [display.up, of_clouds.into()].iter().all(|up| *up == Axis::default());
    if file.up.is_some() || !is_usual {
        file.up = Some(display.up);
    }
    file.color.known = display.color;
    let before = std::mem::take(&mut file.filters);
    let keyed = |known: Filter| {
        let old = before.iter().find(|old| old.known == known);
        Keyed { known, unknown: old.map(|old| old.unknown.clone()).unwrap_or_default() }
    };
    file.filters = display.filters.into_iter().map(keyed).collect();
    file.splats.known = display.splats;
}

/// Lights or measures with the unknown keys of the opened scene: those of the same one at any index, or for a
/// changed one those of the one at its index.
fn with_unknown_keys<T: Clone + PartialEq>(all: &[T], before: &[Keyed<T>]) -> Vec<Keyed<T>> {
    let keyed = |(i, one): (usize, &T)| {
        let same = before.iter().position(|old| old.known == *one);
        let in_row = before.get(i).filter(|old| !all.contains(&old.known));
        let old = same.and_then(|same| before.get(same)).or(in_row);
        Keyed {
            known: one.clone(),
            unknown: old.map(|old| old.unknown.clone()).unwrap_or_default(),
        }
    };
    all.iter().enumerate().map(keyed).collect()
}

/// The values of one side of a pane, with paths relative to the scene's folder.
fn values_in(window: &Window, pane: &PaneSettings, side: usize, folder: &Path) -> Values {
    match window.plugins.declared.get(&pane.renderers[side]) {
        Some(declared) => {
            surfelshop_session::parameters::with_paths(declared, pane.values_of(side), |path| {
                file_path_in(folder, path)
            })
        }
        None => pane.values_of(side),
    }
}

/// All clouds as they were opened, of the scene and of other files, for a scene in this folder.
pub(crate) fn opened_clouds(window: &Window, folder: &Path) -> Vec<Keyed<SceneCloud>> {
    let moved = |cloud: &Keyed<SceneCloud>, path: &Path| {
        let mut cloud = cloud.clone();
        cloud.path = file_path_in(folder, path);
        cloud
    };
    let of_scene = |base: &SceneFile, cloud: &Keyed<SceneCloud>| {
        let layer = base.path_of_layer(cloud).map(|path| file_path_in(folder, &path));
        let mut cloud = moved(cloud, &base.path_of(cloud));
        cloud.layer = layer;
        cloud
    };
    match &window.document.scene_file {
        Some(base) => base.clouds.iter().map(|cloud| of_scene(base, cloud)).collect(),
        None => window
            .document
            .files
            .iter()
            .map(|path| moved(&SceneCloud::new(path).into(), path))
            .collect(),
    }
}

/// Updates the clouds of a scene: their visibility, and the files of clouds that were saved. Clouds
/// without a file are left out.
fn put_clouds(window: &Window, file: &mut SceneFile) {
    let folder = file.folder.clone();
    for open_cloud in window.document.clouds.iter().flat_map(|shown| shown.open_clouds.all()) {
        let saved = open_cloud.saved_as.as_ref().map(|path| file_path_in(&file.folder, path));
        match (open_cloud.entry.and_then(|entry| file.clouds.get_mut(entry)), saved) {
            (Some(cloud), saved) => {
                cloud.visible = open_cloud.visible;
                cloud.renderer = renderer_in(window, open_cloud, &folder);
                cloud.name = open_cloud.title().cloned();
                cloud.hidden = open_cloud.hidden();
                cloud.layer = layer_in(open_cloud, &folder);
                if let Some(path) = saved {
                    (cloud.path, cloud.transform) = (path, None);
                }
                cloud.transform = placement::over(cloud.transform.take(), &open_cloud.placement());
            }
            (None, Some(path)) => {
                let renderer = renderer_in(window, open_cloud, &folder);
                let (visible, name) = (open_cloud.visible, open_cloud.title().cloned());
                let transform = placement::over(None, &open_cloud.placement());
                let new = SceneCloud::new(path);
                let (hidden, layer) = (open_cloud.hidden(), layer_in(open_cloud, &folder));
                let cloud = SceneCloud { visible, renderer, name, transform, hidden, layer, ..new };
                file.clouds.push(cloud.into());
            }
            (None, None) => {}
        }
    }
    let removed = window.document.clouds.iter().flat_map(|shown| shown.open_clouds.removed());
    let removed: Vec<usize> = removed.copied().collect();
    let mut index = 0..;
    file.clouds.retain(|_| !index.next().is_some_and(|index| removed.contains(&index)));
}

/// The file of a pyramid's edits, relative to the scene's folder.
pub(crate) fn layer_in(open_cloud: &OpenCloud, folder: &Path) -> Option<std::path::PathBuf> {
    open_cloud.layer_in_scene().map(|path| file_path_in(folder, &path))
}

/// What draws a cloud, with paths relative to the scene's folder.
fn renderer_in(window: &Window, open_cloud: &OpenCloud, folder: &Path) -> Option<CloudRenderer> {
    let NamedRenderer { renderer, folder: from, .. } = open_cloud.renderer.clone()?;
    let Some(declared) = window.plugins.declared.get(&renderer.name) else { return Some(renderer) };
    let moved = |path: &Path| file_path_in(folder, &from.join(path));
    let values = surfelshop_session::parameters::with_paths(declared, renderer.values, moved);
    Some(CloudRenderer { values, ..renderer })
}

fn file_path_in(folder: &Path, opened: &Path) -> std::path::PathBuf {
    SceneFile { folder: folder.to_owned(), ..SceneFile::default() }.path_in_scene(opened)
}

fn layout_of(window: &Window, pane: &PaneSettings, folder: &Path) -> Table {
    let mut layout = Table::new();
    layout.insert("mode".to_owned(), Toml::String(pane.mode.name().to_owned()));
    layout.insert("second".to_owned(), Toml::String(pane.renderers[1].clone()));
    layout.insert("wipe".to_owned(), Toml::Float(f64::from(pane.wipe)));
    if !pane.title.is_empty() {
        layout.insert("name".to_owned(), Toml::String(pane.title.clone()));
    }
    if pane.clouds.iter().any(Option::is_some) {
        let name = |cloud: &Option<String>| Toml::String(cloud.clone().unwrap_or_default());
        layout.insert("clouds".to_owned(), Toml::Array(pane.clouds.iter().map(name).collect()));
    }
    let values = values_in(window, pane, 1, folder);
    if !values.is_empty() {
        let values = values.iter().map(|(id, value)| (id.clone(), toml_of(value))).collect();
        layout.insert("second_values".to_owned(), Toml::Table(values));
    }
    layout
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec3, Vec3};
    use surfelshop_api::Light;

    #[test]
    fn keys_stay_with_their_light() {
        let light = |x: f64| Light::Point { position: DVec3::X * x, intensity: Vec3::ONE };
        let keyed = |x: f64, key: &str| Keyed {
            known: light(x),
            unknown: Table::from_iter([(key.to_owned(), Toml::Boolean(true))]),
        };
        let before = [keyed(1.0, "a"), keyed(2.0, "b")];
        let keys = |now: &[f64]| {
            let lights: Vec<Light> = now.iter().map(|x| light(*x)).collect();
            let found = with_unknown_keys(&lights, &before);
            assert!(found.iter().zip(&lights).all(|(found, light)| found.known == *light));
            let key = |light: &Keyed<Light>| light.unknown.keys().next().cloned();
            found.iter().map(|light| key(light).unwrap_or_default()).collect::<Vec<_>>()
        };
        assert_eq!(keys(&[1.0, 2.0]), ["a", "b"]);
        assert_eq!(keys(&[2.0]), ["b"], "the first was removed");
        assert_eq!(keys(&[3.0, 2.0]), ["a", "b"], "the first was changed");
        assert_eq!(keys(&[0.0, 1.0, 2.0]), ["", "a", "b"], "one was put before them");
    }
}
