//! When commands apply.

use crate::panels::Selection;
use crate::window::Window;
use surfelshop_api::Scene;
use surfelshop_cloud::scene::MeasureKind;

pub(super) type Applies = Result<(), &'static str>;

fn require(holds: bool, otherwise: &'static str) -> Applies {
    if holds { Ok(()) } else { Err(otherwise) }
}

/// Something is shown.
pub(super) fn has_clouds(window: &Window) -> Applies {
    require(window.document.clouds.is_some(), "no cloud is open")
}

/// Something is open as a whole.
pub(super) fn has_document(window: &Window) -> Applies {
    has_clouds(window)?;
    require(window.document.preview.is_none(), "files are still being read")
}

pub(super) fn has_last_session(window: &Window) -> Applies {
    let state_folder = window.document.state_folder.as_ref();
    let has = state_folder.is_some_and(|folder| folder.previous_session().is_some());
    require(has, "no earlier session was saved")
}

pub(super) fn has_undo(window: &Window) -> Applies {
    require(window.document.history.has_undo(&window.snapshot()), "nothing was changed")
}

pub(super) fn has_redo(window: &Window) -> Applies {
    require(window.document.history.has_redo(&window.snapshot()), "nothing was undone")
}

pub(super) fn has_inside(window: &Window) -> Applies {
    has_clouds(window)?;
    require(
        window.can_stand_inside(),
        "the file does not say where its scanner stood, and no room was found in it",
    )
}

pub(super) fn has_two_views(window: &Window) -> Applies {
    require(window.settings.panes.len() > 1, "there is only one view")
}

pub(super) fn has_room_for_views(window: &Window) -> Applies {
    let full = window.settings.panes.len() >= crate::views::layout::MOST_PANES;
    require(!full, "there are four views, as many as there can be")
}

pub(super) fn has_legend(window: &Window) -> Applies {
    require(window.legend().is_some(), "the colours are those of the file and mean no numbers")
}

pub(super) fn has_placed_lights(window: &Window) -> Applies {
    use surfelshop_api::Light;
    let is_placed = |light: &Light| !matches!(light, Light::Directional { .. });
    let has = window.settings.scene.lights.iter().any(is_placed);
    require(has, "no light of the scene has a place")
}

pub(super) fn flickers(window: &Window) -> Applies {
    let pane = window.settings.pane(window.views.focused);
    let is_flicker = pane.is_some_and(|pane| pane.mode == crate::document::Mode::Flicker);
    require(is_flicker, "the view does not show two renderers in turn")
}

pub(super) fn has_environment_renderer(window: &Window) -> Applies {
    has_clouds(window)?;
    let has = window.renderers().iter().any(|name| name == "environment");
    require(has, "the renderer `environment` is not installed, or cannot draw these clouds")
}

pub(super) fn has_phong(window: &Window) -> Applies {
    has_clouds(window)?;
    let has = window.renderers().iter().any(|name| name == "ewa-phong");
    require(has, "the renderer `ewa-phong` is not installed, or cannot draw these clouds")
}

pub(super) fn has_occlusion(window: &Window) -> Applies {
    has_phong(window)?;
    let columns = window
        .document
        .clouds
        .iter()
        .flat_map(|shown| shown.open_clouds.clouds.facts.columns.iter().map(String::as_str));
    require(
        columns.into_iter().any(|name| name == surfelshop_api::columns::AO),
        "the cloud has no ambient occlusion yet: Tools > Ambient occlusion makes it",
    )
}

pub(super) fn can_hide(window: &Window) -> Applies {
    if has_surfels(window).is_ok() {
        return Ok(());
    }
    let can = matches!(
        window.selection(),
        Selection::Cloud(_) | Selection::Light(_) | Selection::LightOff(_) | Selection::Measure(_)
    );
    require(can, "select a cloud, a light or a measure in the list at the left first")
}

pub(super) fn can_rename(window: &Window) -> Applies {
    let can = matches!(
        window.selection(),
        Selection::Cloud(_) | Selection::View | Selection::Bookmark(_) | Selection::Measure(_)
    );
    require(can, "lights and the environment have no names of their own")
}

/// Surfels are selected.
pub(super) fn has_surfels(window: &Window) -> Applies {
    require(window.n_selected().0 > 0, "no surfel is selected")
}

/// Something is measured.
pub(super) fn has_measures(window: &Window) -> Applies {
    has_document(window)?;
    require(!window.settings.measures.is_empty(), "nothing is measured")
}

/// A measure is selected.
pub(super) fn is_measure(window: &Window) -> Applies {
    let is = matches!(window.selection(), Selection::Measure(_));
    require(is, "select a measure in the list at the left first")
}

/// A profile is selected.
pub(super) fn is_profile(window: &Window) -> Applies {
    let Selection::Measure(i) = window.selection() else { return is_measure(window) };
    let kind = window.settings.measures.get(i).map(|measure| measure.kind);
    require(kind == Some(MeasureKind::Profile), "what is selected is no profile")
}

/// There is a tool that is led by hand.
pub(super) fn has_hand_tools(window: &Window) -> Applies {
    has_document(window)?;
    require(!window.hand_tools().is_empty(), "no interactive tool is installed")
}

pub(super) fn can_remove(window: &Window) -> Applies {
    if has_surfels(window).is_ok() {
        return Ok(());
    }
    // The list's selection is not what somebody means who has just drawn around surfels.
    if window.views.hands.mode.selects() {
        return Err("no surfels are selected: draw around some first");
    }
    match window.selection() {
        Selection::Cloud(_) => {
            has_document(window)?;
            has_two_clouds(window)
                .map_err(|_one| "it is the only cloud: open another file in its place")
        }
        Selection::Light(_)
        | Selection::LightOff(_)
        | Selection::Bookmark(_)
        | Selection::Measure(_) => Ok(()),
        Selection::Environment => {
            require(window.settings.environment.is_some(), "there is no environment")
        }
        Selection::View => has_two_views(window),
        Selection::Camera => Err("the view always has a camera"),
    }
}

pub(super) fn has_duplicate(window: &Window) -> Applies {
    match window.selection() {
        Selection::Light(_) | Selection::LightOff(_) => has_light_room(window),
        Selection::View => has_room_for_views(window),
        Selection::Camera => has_clouds(window),
        Selection::Cloud(_)
        | Selection::Environment
        | Selection::Bookmark(_)
        | Selection::Measure(_) => Err("lights, views and the camera can be duplicated"),
    }
}

pub(super) fn has_light_room(window: &Window) -> Applies {
    let n = window.settings.scene.lights.len();
    require(n < Scene::MAX_LIGHTS, "there are eight lights, as many as there can be")
}

fn n_clouds(window: &Window) -> usize {
    window.document.clouds.as_ref().map_or(0, |shown| shown.open_clouds.all().len())
}

pub(super) fn has_two_clouds(window: &Window) -> Applies {
    require(n_clouds(window) > 1, "fewer than two clouds are open")
}

pub(super) fn has_hidden_clouds(window: &Window) -> Applies {
    has_clouds(window)?;
    let mut all = window.document.clouds.iter().flat_map(|shown| shown.open_clouds.all());
    let hides = all.any(|cloud| !cloud.visible) || window.has_hidden_surfels();
    require(hides, "nothing is hidden")
}

pub(super) fn has_bookmarks(window: &Window) -> Applies {
    require(!window.settings.bookmarks.is_empty(), "no camera is remembered yet")
}

pub(super) fn has_numbers(window: &Window) -> Applies {
    let measure = &window.measure;
    require(measure.current_view.is_some() || measure.series.is_some(), "nothing was measured yet")
}
