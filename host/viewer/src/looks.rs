//! Looks: renderer, light and environment in one step, which undo takes back.

use crate::document::{USUAL_RENDERER, set_environment_map};
use crate::window::Window;
use surfelshop_api::params::Value;
use surfelshop_api::{Scene, SurfaceSettings};
use surfelshop_cloud::display::{ColorBy, ColorSource, Look as Shape};
use surfelshop_cloud::scene::{EyeDomeLighting, ProbeSource};
use surfelshop_image::display_transform::ToneMap;
use surfelshop_session::options::lights;

/// A way to look at clouds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Look {
    Headlight,
    Studio,
    Sunlight,
    Clay,
    AmbientOcclusion,
    Points,
}

/// The renderer of natural light.
const NATURAL: &str = "environment";

/// The colour of clay, and the white of ambient occlusion, sRGB-encoded.
const CLAY: [u8; 3] = [186, 158, 134];
const WHITE: [u8; 3] = [235, 235, 235];

/// The width of points, pixels.
const POINT_WIDTH: f32 = 3.0;

impl Window {
    /// Shows the focused view in a look. What belongs to the scene changes in all views.
    pub(crate) fn apply_look(&mut self, look: Look) {
        let settings = &mut self.settings;
        settings.scene.lights = Scene::default().lights;
        settings.scene.exposure_stops = 0.0;
        settings.tone_map = ToneMap::Clamp;
        settings.environment = None;
        settings.eye_dome = EyeDomeLighting::default();
        // One colour for all is that of another look; what shows numbers stays.
        if matches!(settings.color.by, ColorBy::Uniform(_)) {
            settings.color = ColorSource::default();
        }
        if look != Look::Points && settings.splats.look != Shape::Surface {
            settings.splats.look = Shape::Surface;
            settings.scene.surface.low_pass = SurfaceSettings::default().low_pass;
        }
        match look {
            Look::Headlight => self.draw_by(USUAL_RENDERER, &[]),
            Look::Studio => self.natural(ProbeSource::Studio),
            Look::Sunlight => self.natural(ProbeSource::Sky),
            Look::Clay => {
                settings.color = ColorSource::new(ColorBy::Uniform(CLAY));
                self.draw_by(USUAL_RENDERER, &[("specular", Value::Float(0.0))]);
            }
            Look::AmbientOcclusion => {
                settings.color = ColorSource::new(ColorBy::Uniform(WHITE));
                settings.scene.lights.clear();
                let values = [("ambient", Value::Float(1.0)), ("specular", Value::Float(0.0))];
                self.draw_by(USUAL_RENDERER, &values);
            }
            Look::Points => {
                if settings.splats.look == Shape::Surface {
                    settings.splats.look = Shape::Points { radius: 0.0 };
                    settings.scene.surface.low_pass = 0.5 * POINT_WIDTH;
                }
                settings.scene.lights = lights::even();
                self.draw_by(USUAL_RENDERER, &[("specular", Value::Float(0.0))]);
            }
        }
    }

    /// Whether the focused view is shown in a look, by what sets it apart from the others.
    pub(crate) fn has_look(&self, look: Look) -> bool {
        let settings = &self.settings;
        let renderer = settings.pane(self.views.focused).map(|pane| pane.renderers[0].as_str());
        let around = settings.environment.as_ref().map(|around| &around.source);
        let is_colored = |color: [u8; 3]| settings.color.by == ColorBy::Uniform(color);
        let is_usual = renderer == Some(USUAL_RENDERER) && around.is_none();
        let is_natural = |source| renderer == Some(NATURAL) && around == Some(&source);
        let lights = &settings.scene.lights;
        let is_lit_as_usual = *lights == Scene::default().lights;
        if settings.splats.look != Shape::Surface {
            return look == Look::Points && is_usual && *lights == lights::even();
        }
        match look {
            Look::Headlight => {
                let is_other = is_colored(CLAY) || is_colored(WHITE);
                is_usual && is_lit_as_usual && !is_other
            }
            Look::Studio => is_natural(ProbeSource::Studio),
            Look::Sunlight => is_natural(ProbeSource::Sky),
            Look::Clay => is_usual && is_lit_as_usual && is_colored(CLAY),
            Look::AmbientOcclusion => is_usual && lights.is_empty() && is_colored(WHITE),
            Look::Points => false,
        }
    }

    fn natural(&mut self, source: ProbeSource) {
        set_environment_map(self, source);
        self.settings.tone_map = ToneMap::Neutral;
        self.draw_by(NATURAL, &[]);
    }

    /// Draws the focused view by a renderer whose values are the usual ones but for some.
    fn draw_by(&mut self, renderer: &str, values: &[(&str, Value)]) {
        let Some(pane) = self.settings.pane_mut(self.views.focused) else { return };
        pane.renderers[0] = renderer.to_owned();
        pane.values.remove(renderer);
        let named = |(id, value): &(&str, Value)| ((*id).to_owned(), value.clone());
        if !values.is_empty() {
            pane.values.insert(renderer.to_owned(), values.iter().map(named).collect());
        }
        // Values that are the usual ones are none.
        self.fit_values(renderer);
    }
}
