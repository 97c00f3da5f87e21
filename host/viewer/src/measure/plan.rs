//! The plan of a measurement: pictures, reference, and everything that the numbers depend on.

use std::path::PathBuf;
use std::sync::Arc;
use surfelshop_api::params::{ParamDecl, Values};
use surfelshop_api::{Camera, Scene};
use surfelshop_cloud::scene::SceneEnvironment;
use surfelshop_evaluate::report::knobs::typed;
use surfelshop_image::EyeDome;
use surfelshop_image::display_transform::DisplayTransform;
use surfelshop_session::input::clouds::Clouds;
use surfelshop_session::input::scenes::NamedRenderer;
use surfelshop_session::options::camera::Extent;

/// Most pixels of a measured picture, a screen of 7680 x 4320: a comparison takes some 200 bytes per
/// pixel.
pub(crate) const MOST_PIXELS: u64 = 7680 * 4320;

/// The kind of a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// The present picture of each side of the view.
    CurrentView,
    /// One renderer for several values of its knob.
    Series,
}

/// The source of the reference.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum ReferenceSource {
    Renderer { name: String, values: Values },
    Tracer { name: String, values: Values },
    Picture(PathBuf),
}

impl ReferenceSource {
    /// Its name, with the values that are not at their default.
    pub(crate) fn name(&self) -> String {
        match self {
            Self::Picture(path) => path.display().to_string(),
            Self::Renderer { name, values } | Self::Tracer { name, values } => {
                let set = values.iter().map(|(id, value)| format!("{id}={}", typed(value)));
                let set = set.collect::<Vec<_>>().join(" ");
                if set.is_empty() { name.clone() } else { format!("{name} {set}") }
            }
        }
    }
}

/// Everything that the numbers depend on; a result is stale once it has changed.
#[derive(Clone, PartialEq)]
pub(crate) struct Basis {
    /// The view, by its number.
    pub(crate) pane: u32,
    /// Renderers with their values, without the knob's.
    pub(crate) renderers: Vec<(String, Values)>,
    /// What each of the clouds names to draw it.
    pub(crate) named: Vec<Option<NamedRenderer>>,
    pub(crate) knob: Option<String>,
    pub(crate) source: ReferenceSource,
    /// Width and height in pixels; none where the reference is a file, whose size counts.
    pub(crate) size: Option<[u32; 2]>,
    pub(crate) camera: Camera,
    pub(crate) scene: Scene,
    pub(crate) environment: Option<SceneEnvironment>,
    pub(crate) display: DisplayTransform,
    /// Settled pictures that each picture is the mean of.
    pub(crate) antialias: u32,
    pub(crate) tint_backs: bool,
    /// How each is darkened by what is nearer, if it is.
    pub(crate) eye_dome: Option<EyeDome>,
    /// The revision of the clouds.
    pub(crate) revision: u64,
    /// How often a changed plugin or file had pictures redrawn.
    pub(crate) n_redrawn: u64,
}

impl Basis {
    /// The part that the reference depends on.
    pub(crate) fn reference_inputs(&self) -> Self {
        let (renderers, knob, display) = Default::default();
        Self { pane: 0, renderers, knob, display, ..self.clone() }
    }

    /// The first change, in a few words.
    pub(crate) fn changed(&self, now: &Self) -> Option<&'static str> {
        let names = |basis: &Self| basis.renderers.iter().map(|r| r.0.clone()).collect::<Vec<_>>();
        let is_of = |basis: &Self| std::mem::discriminant(&basis.source);
        let differs = [
            (self.pane != now.pane, "another view is chosen"),
            (self.revision != now.revision, "the clouds have changed"),
            (self.named != now.named, "the renderer of a cloud has changed"),
            (names(self) != names(now), "another renderer is shown"),
            (self.knob != now.knob, "another parameter is chosen"),
            (self.camera != now.camera, "the camera has moved"),
            (self.environment != now.environment, "the environment has changed"),
            (self.scene != now.scene, "light or surface have changed"),
            (self.renderers != now.renderers, "a parameter has changed"),
            (is_of(self) != is_of(now), "another reference is chosen"),
            (self.source != now.source, "the reference has changed"),
            (self.size != now.size, "the size has changed"),
            (self.display != now.display, "highlights or background have changed"),
            (self.antialias != now.antialias, "antialiasing has changed"),
            (self.eye_dome != now.eye_dome, "eye-dome lighting has changed"),
            (self.n_redrawn != now.n_redrawn, "a plugin or a file has changed"),
        ];
        differs.into_iter().find_map(|(differs, what)| differs.then_some(what))
    }
}

/// A picture to be measured.
#[derive(Clone, Debug)]
pub(crate) struct Subject {
    /// The parameter that distinguishes it from the others, and its value as typed.
    pub(crate) knob: String,
    pub(crate) value: String,
    pub(crate) renderer: String,
    pub(crate) values: Values,
}

/// The plan of a measurement.
pub(crate) struct Plan {
    pub(crate) basis: Basis,
    pub(crate) subjects: Vec<Subject>,
    pub(crate) clouds: Arc<Clouds>,
    pub(crate) extent: Extent,
    /// Timed frames of each subject.
    pub(crate) repeats: u32,
}

/// Values with one of them set, or removed where it is the default.
pub(crate) fn with(mut values: Values, declared: &ParamDecl, text: &str) -> Result<Values, String> {
    let value = declared.parse(text)?;
    if value == declared.default {
        values.remove(&declared.id);
    } else {
        values.insert(declared.id.clone(), value);
    }
    Ok(values)
}
