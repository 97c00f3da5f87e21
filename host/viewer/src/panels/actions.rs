//! What commands do with what is selected.

use super::Selection;
use crate::document::{Bookmark, MOST_BOOKMARKS, Thumbnail};
use crate::views::navigation;
use crate::window::Window;
use glam::Vec3;
use surfelshop_api::{Light, Scene};
use surfelshop_cloud::scene::{DEFAULT_SPOT_DEG, DEFAULT_SPOT_SOFTNESS, LONGEST_NOTE, MeasureKind};
use surfelshop_session::options::camera::Extent;

/// How far above the middle of the view a placed light stands, in heights of the picture at what the camera orbits about.
const ABOVE: f64 = 0.125;

impl Window {
    /// Moves the camera of the focused view to what is selected.
    pub(crate) fn zoom_to_selected(&mut self) {
        match self.selection() {
            Selection::Cloud(i) => self.frame_cloud(i),
            Selection::Bookmark(i) => self.go_to_bookmark(i),
            Selection::Measure(i) => self.look_at_measure(i),
            Selection::Light(i) => {
                let light = self.settings.scene.lights.get(i).copied();
                self.look_at_light(light);
            }
            Selection::LightOff(i) => {
                let light = self.settings.lights_off.get(i).copied();
                self.look_at_light(light);
            }
            Selection::View | Selection::Camera | Selection::Environment => self.fly_to_all(),
        }
    }

    /// Turns the camera to a light that has a place, from as far as it is now; otherwise shows all.
    fn look_at_light(&mut self, light: Option<Light>) {
        let place = match light {
            Some(Light::Point { position, .. } | Light::Spot { position, .. }) => position,
            _ => return self.fly_to_all(),
        };
        let camera = self.camera_of(self.views.focused);
        let eye = place + (camera.eye - camera.target);
        let to = surfelshop_api::Camera { eye, target: place, ..camera };
        self.fly_to(self.views.focused, to);
    }

    /// Moves the camera to where it sees a measure, without turning it.
    fn look_at_measure(&mut self, index: usize) {
        let Some(measure) = self.settings.measures.get(index) else { return };
        let Some(first) = measure.places.first() else { return };
        let offsets = measure.places.iter().map(|place| *place - *first);
        let middle = *first + offsets.sum::<glam::DVec3>() / measure.places.len() as f64;
        let reach = measure.places.iter().map(|place| place.distance(middle)).fold(0.0, f64::max);
        let Some(shown) = &self.document.clouds else { return };
        // Of a note what is around it.
        let facts = &shown.clouds.facts;
        let least = 0.05 * (facts.bounds_max - facts.bounds_min).length();
        let extent = Extent::new(middle, (1.3 * reach).max(least));
        let camera = self.camera_of(self.views.focused);
        let framed = self.framing(&extent);
        let distance = framed.eye.distance(framed.target);
        let back = (camera.eye - camera.target).normalize_or(glam::DVec3::Z);
        let eye = middle + back * distance;
        self.views.walking = false;
        let to = surfelshop_api::Camera { eye, target: middle, up: camera.up, ..framed };
        self.fly_to(self.views.focused, to);
    }

    /// Shows or hides a cloud.
    pub(crate) fn toggle_cloud(&mut self, index: usize) {
        let Some(shown) = &self.document.clouds else { return };
        let Some(cloud) = shown.open_clouds.all().get(index) else { return };
        let open_clouds = shown.open_clouds.showing(index, !cloud.visible);
        self.show_clouds(open_clouds);
    }

    /// Switches a light off, or on again.
    pub(crate) fn toggle_light(&mut self, light: Selection) {
        let settings = &mut self.settings;
        let lights = &mut settings.scene.lights;
        match light {
            Selection::Light(i) if i < lights.len() => {
                settings.lights_off.push(lights.remove(i));
                self.select(Selection::LightOff(self.settings.lights_off.len() - 1));
            }
            Selection::LightOff(i) if i < settings.lights_off.len() => {
                if lights.len() >= Scene::MAX_LIGHTS {
                    let most = Scene::MAX_LIGHTS;
                    self.messages.warn(format!("there are at most {most} lights that shine"));
                    return;
                }
                lights.push(settings.lights_off.remove(i));
                self.select(Selection::Light(self.settings.scene.lights.len() - 1));
            }
            _ => {}
        }
    }

    /// Hides or shows what is selected.
    pub(crate) fn toggle_selected(&mut self) {
        match self.selection() {
            Selection::Cloud(i) => self.toggle_cloud(i),
            light @ (Selection::Light(_) | Selection::LightOff(_)) => self.toggle_light(light),
            Selection::Measure(i) => self.toggle_measure(i),
            _ => {}
        }
    }

    /// Shows all clouds.
    pub(crate) fn show_all_clouds(&mut self) {
        let Some(shown) = &self.document.clouds else { return };
        let n = shown.open_clouds.all().len();
        let all = (0..n).fold(shown.open_clouds.clone(), |all, i| all.showing(i, true));
        self.show_clouds(all);
    }

    /// Removes what is selected from the scene; files stay.
    pub(crate) fn remove_selected(&mut self) {
        match self.selection() {
            Selection::Cloud(i) => {
                if let Some(shown) = &self.document.clouds {
                    let mut left = shown.open_clouds.without(i);
                    // Something stays visible.
                    if !left.all().iter().any(|cloud| cloud.visible) {
                        left = left.showing(0, true);
                    }
                    self.show_clouds(left);
                }
            }
            Selection::Light(i) => drop(self.settings.scene.lights.remove(i)),
            Selection::LightOff(i) => drop(self.settings.lights_off.remove(i)),
            Selection::Environment => self.settings.environment = None,
            Selection::Bookmark(i) => drop(self.settings.bookmarks.remove(i)),
            Selection::Measure(i) => drop(self.settings.measures.remove(i)),
            Selection::View => crate::views::layout::close_focused(self),
            Selection::Camera => {}
        }
        self.select(Selection::default());
    }

    /// Adds a light like another one, or the usual one.
    pub(crate) fn add_light(&mut self, like: Option<Light>) {
        let lights = &mut self.settings.scene.lights;
        let usual = Scene::default().lights.first().copied();
        let Some(light) = like.or(usual).filter(|_| lights.len() < Scene::MAX_LIGHTS) else {
            return;
        };
        lights.push(light);
        let index = lights.len() - 1;
        self.select(Selection::Light(index));
    }

    /// Adds a point light, or a spot that is turned to what the camera orbits about, and selects it. It stands within the
    /// focused view: halfway to what the camera orbits about and somewhat above, where it is as bright as a direct light.
    pub(crate) fn add_placed_light(&mut self, is_spot: bool) {
        let camera = self.camera_of(self.views.focused);
        let up = camera.view_from_world().transpose().y_axis;
        // A quarter of a picture's height at this distance is its half at the target's: within by half of it.
        let raised = ABOVE * navigation::height_at_target(&camera);
        let position = camera.target.midpoint(camera.eye) + raised * up;
        let distance = position.distance(camera.target);
        let intensity = Vec3::splat((distance * distance) as f32);
        let light = match is_spot {
            false => Light::Point { position, intensity },
            true => Light::Spot {
                position,
                target: camera.target,
                intensity,
                angle: DEFAULT_SPOT_DEG.to_radians(),
                softness: DEFAULT_SPOT_SOFTNESS,
            },
        };
        self.add_light(Some(light));
    }

    /// Duplicates what is selected: a light, a view, a remembered camera.
    pub(crate) fn duplicate_selected(&mut self) {
        match self.selection() {
            Selection::Light(i) => {
                let light = self.settings.scene.lights.get(i).copied();
                self.add_light(light);
            }
            Selection::LightOff(i) => {
                let light = self.settings.lights_off.get(i).copied();
                self.add_light(light);
            }
            Selection::View => crate::views::layout::split_focused(self, false),
            Selection::Camera => self.remember_camera(),
            Selection::Cloud(_)
            | Selection::Environment
            | Selection::Bookmark(_)
            | Selection::Measure(_) => {}
        }
    }

    /// Begins to rename what is selected.
    pub(crate) fn rename_selected(&mut self) {
        let selection = self.selection();
        self.preferences.panels = true;
        self.panels.renaming = Some((selection, self.name_of(selection)));
    }

    /// Gives a part another name.
    pub(crate) fn rename(&mut self, selection: Selection, name: &str) {
        let name = name.trim();
        match selection {
            Selection::Cloud(i) => {
                let titled =
                    self.document.clouds.as_ref().map(|shown| shown.open_clouds.titled(i, name));
                let before = self.name_of(selection);
                if let Some(titled) = titled {
                    self.show_clouds(titled);
                }
                let now = self.name_of(selection);
                let shown = self.settings.panes.iter_mut().flat_map(|pane| &mut pane.clouds);
                let of_it = shown.flatten().filter(|name| **name == before);
                of_it.for_each(|name| name.clone_from(&now));
            }
            Selection::Bookmark(i) if !name.is_empty() => {
                if let Some(bookmark) = self.settings.bookmarks.get_mut(i) {
                    name.clone_into(&mut bookmark.name);
                }
            }
            Selection::Measure(i) => {
                if let Some(measure) = self.settings.measures.get_mut(i) {
                    let name: String = name.chars().take(LONGEST_NOTE).collect();
                    match measure.kind {
                        MeasureKind::Note => measure.text = name,
                        _ => measure.name = name,
                    }
                }
            }
            Selection::View => {
                let focused = self.views.focused;
                if let Some(pane) = self.settings.pane_mut(focused) {
                    name.clone_into(&mut pane.title);
                }
            }
            _ => {}
        }
    }

    /// Remembers the camera of the focused view, with a small picture.
    pub(crate) fn remember_camera(&mut self) {
        if self.settings.bookmarks.len() >= MOST_BOOKMARKS {
            let line = format!("there are {MOST_BOOKMARKS} cameras, as many as there can be");
            self.messages.warn(line);
            return;
        }
        let focused = self.views.focused;
        let camera = self.camera_of(focused);
        let shown = self.views.panes.get(&focused).and_then(|pane| pane.sides[0].shown.as_ref());
        let picture =
            shown.and_then(|shown| Thumbnail::of(shown.rendered.size, &shown.rendered.levels));
        let names: Vec<&str> = self.settings.bookmarks.iter().map(|b| b.name.as_str()).collect();
        let free = (1..).map(|i| format!("camera {i}")).find(|n| !names.contains(&n.as_str()));
        let name = free.unwrap_or_else(|| "camera".to_owned());
        self.settings.bookmarks.push(Bookmark { name, camera, picture });
        self.select(Selection::Bookmark(self.settings.bookmarks.len() - 1));
    }

    /// Moves the focused view to a remembered camera.
    pub(crate) fn go_to_bookmark(&mut self, index: usize) {
        let Some(bookmark) = self.settings.bookmarks.get(index) else { return };
        let camera = bookmark.camera;
        self.fly_to(self.views.focused, camera);
        self.select(Selection::Bookmark(index));
    }

    /// Moves the focused view to the next remembered camera, or to the one before.
    pub(crate) fn step_bookmark(&mut self, forward: bool) {
        let n = self.settings.bookmarks.len();
        if n == 0 {
            return;
        }
        let next = match (self.selection(), forward) {
            (Selection::Bookmark(i), true) => (i + 1) % n,
            (Selection::Bookmark(i), false) => (i + n - 1) % n,
            (_, true) => 0,
            (_, false) => n - 1,
        };
        self.go_to_bookmark(next);
    }

    /// Shows two clouds in the focused view, left and right of a line, by the same renderer.
    pub(crate) fn compare_clouds(&mut self) {
        let Some(shown) = &self.document.clouds else { return };
        let all = shown.open_clouds.all();
        let selected = match self.selection() {
            Selection::Cloud(i) => Some(i),
            _ => None,
        };
        let first = selected.unwrap_or(0);
        let other = (0..all.len()).find(|i| *i != first);
        let Some((first, second)) = all.get(first).zip(other.and_then(|i| all.get(i))) else {
            return;
        };
        let names = [Some(first.name()), Some(second.name())];
        let shown_all = (0..all.len()).fold(shown.open_clouds.clone(), |all, i| {
            let name = all.all().get(i).map(|cloud| cloud.name());
            if names.contains(&name) { all.showing(i, true) } else { all }
        });
        self.show_clouds(shown_all);
        let focused = self.views.focused;
        if let Some(pane) = self.settings.pane_mut(focused) {
            pane.renderers[1] = pane.renderers[0].clone();
            pane.mode = crate::document::Mode::Wipe;
            pane.clouds = names;
        }
        self.select(Selection::View);
    }
}
