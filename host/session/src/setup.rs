//! What is rendered: what was typed, else what the scene says, else the usual.

use crate::input::clouds::Clouds;
use crate::input::displayed::DisplayedClouds;
use crate::input::drawn::{self, Drawn, Wait};
use crate::input::environment_map::{self, LoadedEnvironment};
use crate::input::formats::SessionFormats;
use crate::input::pyramids;
use crate::input::scenes::Source;
use crate::options::camera::CameraSpec;
use crate::options::colors::PointSpec;
use crate::options::explicit::ExplicitOptions;
use crate::options::lights;
use crate::options::{LensArguments, PictureArguments, ToneMapChoice, UpAxis};
use crate::parameters;
use crate::render::RenderArguments;
use anyhow::Context as _;
use std::path::PathBuf;
use surfelshop_api::graph::Output;
use surfelshop_api::params::linear_to_srgb;
use surfelshop_api::{Camera, Scene, UnitKind, View};
use surfelshop_cloud::display::DisplaySettings;
use surfelshop_cloud::scene::{
    Backdrop, EyeDomeLighting, OpenedScene, SceneEnvironment, SceneFile, SceneView, ToneMap,
};
use surfelshop_image::display_transform::{self, Background, DisplayTransform};
use surfelshop_runtime::plugins::{Registry, UnitRef};

/// A view of a scene and where the file says so.
pub struct SelectedView<'a> {
    /// The view.
    pub view: &'a SceneView,
    /// File and line of its renderer.
    pub place: String,
    /// The scene's folder.
    pub folder: PathBuf,
}

/// The renderer, and the view of the scene whose parameters, camera and output count: the first of
/// that renderer.
pub fn renderer<'a>(
    arguments: &RenderArguments,
    given: &ExplicitOptions,
    opened: Option<&'a OpenedScene>,
    registry: &Registry,
) -> anyhow::Result<(UnitRef, Option<SelectedView<'a>>)> {
    let reference = match first_view(opened) {
        Some(SelectedView { view, place, .. }) if !given.has("renderer") => {
            drawer(registry, &view.renderer).with_context(|| place)?
        }
        _ => drawer(registry, &arguments.renderer)?,
    };
    let view = view_of(opened, &reference);
    Ok((reference, view))
}

/// The first view of a scene that shows a renderer.
pub fn view_of<'a>(
    opened: Option<&'a OpenedScene>,
    reference: &UnitRef,
) -> Option<SelectedView<'a>> {
    views_of(opened).into_iter().find(|chosen| parameters::names(reference, &chosen.view.renderer))
}

/// All views of a scene.
fn views_of(opened: Option<&OpenedScene>) -> Vec<SelectedView<'_>> {
    let views = opened.into_iter().flat_map(|opened| {
        let place = |line: &usize| format!("{}:{line}", opened.path.display());
        let places = opened.view_lines.iter().map(place);
        let folder = || opened.scene.folder.clone();
        let views = opened.scene.views.iter().zip(places);
        views.map(move |(view, place)| SelectedView { view, place, folder: folder() })
    });
    views.collect()
}

/// The first view of a scene, whose camera counts where no view's renderer does.
pub fn first_view(opened: Option<&OpenedScene>) -> Option<SelectedView<'_>> {
    views_of(opened).into_iter().next()
}

/// What draws under a name: a renderer, or else a tracer.
pub fn drawer(registry: &Registry, name: &str) -> anyhow::Result<UnitRef> {
    match registry.find(UnitKind::Renderer, name) {
        Ok(renderer) => Ok(renderer),
        // Where there is no tracer of that name either, a renderer is what was meant.
        Err(unknown) => Ok(registry.find(UnitKind::Tracer, name).map_err(|_other| unknown)?),
    }
}

/// Everything about the picture but clouds, renderer and size.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderSetup {
    /// Lights, exposure and surface settings.
    pub scene: Scene,
    /// The light around the scene.
    pub environment: Option<SceneEnvironment>,
    /// What colours surfels, and which are shown.
    pub display: DisplaySettings,
    /// How the picture is developed.
    pub how: DisplayTransform,
    /// Frames that a picture is the mean of, at least 1.
    pub antialias: u32,
    /// What is darkened for lying behind something.
    pub eye_dome: EyeDomeLighting,
    /// What the picture shows, where the scene says it.
    pub output: Option<Output>,
    /// The scene's camera, where it counts.
    pub camera: Option<Camera>,
    /// Whether the projection is parallel, where that was typed.
    pub parallel: Option<bool>,
    /// Radius of merged surfels in pixels; 0 where none are.
    pub detail_px: f32,
    /// The same of pyramids, which are merged where nobody says anything.
    pub pyramid_detail_px: f32,
    /// What the clouds decide, where nobody has said which axis points up.
    pub open: Option<OpenUp>,
}

/// What turns with the axis that clouds have upwards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OpenUp {
    /// The light, too.
    pub environment: bool,
}

impl RenderSetup {
    /// Puts together what was typed and what the scene says.
    pub fn new(
        arguments: &PictureArguments,
        given: &ExplicitOptions,
        opened: Option<&OpenedScene>,
        chosen: Option<&SelectedView<'_>>,
    ) -> anyhow::Result<Self> {
        let file = opened.map(|opened| &opened.scene);
        let view = chosen.map(|chosen| chosen.view);
        let up = up(arguments, given, file);
        let follows = environment_map::follows_up(&arguments.environment);
        let open = (up == UpAxis::Auto).then_some(OpenUp { environment: follows });
        let environment = environment_map::wanted(
            &arguments.environment,
            up,
            file.and_then(environment_map::of_scene),
        )?;
        let scene = scene(arguments, given, file)?;
        let seen = view.map(|view| view.output.clone()).filter(|output| *output != Output::Color);
        let camera = file.and_then(|file| match view {
            Some(view) => file.camera_of(view),
            None => file.camera.as_ref().map(|camera| camera.known),
        });
        let display = file.map(SceneFile::display).unwrap_or_default();
        Ok(Self {
            display: arguments.colors.over(DisplaySettings { up: up.into(), ..display })?,
            how: development(arguments, given, file, scene.exposure_stops),
            antialias: match file.filter(|_| !given.has("antialias")) {
                Some(file) => file.antialias,
                None => arguments.antialias,
            },
            eye_dome: match file.filter(|_| !given.has("eye_dome_lighting")) {
                Some(file) => file.eye_dome,
                None => arguments.eye_dome_lighting,
            },
            scene,
            environment,
            output: seen,
            camera: camera.filter(|_| !given.has("camera")),
            parallel: given.has("orthographic").then_some(arguments.lens.orthographic),
            detail_px: arguments.detail,
            pyramid_detail_px: match given.has("detail") {
                true => arguments.detail,
                false => pyramids::DETAIL_PX,
            },
            open,
        })
    }
}

impl RenderSetup {
    /// Reads the light, then the clouds, and displays them. Where nobody said which axis points up, the clouds decide:
    /// for heights, for the cameras of presets, and for a light that is named by its probe alone.
    ///
    /// # Errors
    /// Where a file cannot be read, or the clouds cannot be displayed as asked.
    pub fn read(
        &mut self,
        sources: &[Source],
        formats: &SessionFormats,
    ) -> anyhow::Result<(Option<LoadedEnvironment>, DisplayedClouds)> {
        let mut light = environment_map::read_wanted(self.environment.as_ref())?;
        let clouds = DisplayedClouds::read_whole(sources, formats)?;
        if let Some(open) = self.open.take() {
            let sources = clouds.loaded.iter().map(|loaded| loaded.cloud.source());
            let up = UpAxis::Auto.or_of(sources);
            self.display.up = up.axis();
            if let Some(environment) = self.environment.as_mut().filter(|_| open.environment) {
                let standing = environment_map::standing(environment.source.clone(), up);
                (environment.forward, environment.up) = (standing.forward, standing.up);
                light = light.map(|light| light.standing_as(environment));
            }
        }
        Ok((light, DisplayedClouds::shown(clouds, &self.display)?))
    }

    /// The same with nothing merged, as references are.
    pub fn unmerged(self) -> Self {
        Self { detail_px: 0.0, pyramid_detail_px: 0.0, ..self }
    }

    /// What a view is drawn from, all of it; says where there is no memory for as much as was asked for.
    pub fn drawn<'a>(&self, clouds: &'a Clouds, view: &View) -> anyhow::Result<Drawn<'a>> {
        let detail_px = self.pyramid_detail_px;
        let drawn = clouds.drawn(view, &self.scene.surface, detail_px, Wait::ForAll)?;
        drawn::note(&drawn, detail_px);
        Ok(drawn)
    }

    /// A lens with the scene's upward axis.
    pub fn lens(&self, typed: &LensArguments) -> LensArguments {
        LensArguments { up: self.display.up.into(), ..typed.clone() }
    }

    /// The same with an output that was typed, where one was.
    pub fn showing(self, typed: Option<Output>) -> Self {
        Self { output: typed.or(self.output), ..self }
    }
}

/// The axis that points upwards: as typed, else as the scene says, else as usual.
fn up(arguments: &PictureArguments, given: &ExplicitOptions, file: Option<&SceneFile>) -> UpAxis {
    let of_scene = file.and_then(|file| file.up).filter(|_| !given.has("up"));
    of_scene.map_or(arguments.lens.up, UpAxis::from)
}

fn scene(
    arguments: &PictureArguments,
    given: &ExplicitOptions,
    file: Option<&SceneFile>,
) -> anyhow::Result<Scene> {
    let mut scene = file.map_or_else(Scene::default, SceneFile::scene);
    if given.has("exposure") {
        scene.exposure_stops = arguments.exposure;
    }
    if !arguments.light.is_empty() {
        scene.lights = arguments.light.iter().map(|light| light.0).collect();
    }
    if arguments.light.is_empty() && arguments.lens.camera == CameraSpec::Inside {
        lights::suit(&mut scene.lights, true);
    }
    let (n_lights, most) = (scene.lights.len(), Scene::MAX_LIGHTS);
    anyhow::ensure!(n_lights <= most, "expected at most {most} lights, found {n_lights} --light");
    if let Some(scale) = arguments.radius_scale {
        scene.surface.radius_scale = scale;
    }
    if let Some(tolerance) = arguments.depth_tolerance {
        scene.surface.depth_tolerance = tolerance;
    }
    let splats = file.map(|file| file.splats.known).unwrap_or_default();
    arguments.colors.over_surface(&splats, &mut scene.surface);
    if let Some(low_pass) = arguments.low_pass {
        let is_width = matches!(arguments.colors.points, Some(PointSpec::Pixels(_)));
        anyhow::ensure!(
            !is_width,
            "--low-pass: expected either it or a width for --points, found both"
        );
        scene.surface.low_pass = low_pass;
    }
    if given.has("one_sided") {
        scene.surface.two_sided = !arguments.one_sided;
    }
    Ok(scene)
}

fn development(
    arguments: &PictureArguments,
    given: &ExplicitOptions,
    file: Option<&SceneFile>,
    exposure_stops: f32,
) -> DisplayTransform {
    let typed = match arguments.tone_map {
        ToneMapChoice::Clamp => display_transform::ToneMap::Clamp,
        ToneMapChoice::Neutral => display_transform::ToneMap::Neutral,
    };
    let tone_map = match file.filter(|_| !given.has("tone_map")) {
        Some(file) => tone_map_of(file),
        None => typed,
    };
    let background = match file.filter(|_| !given.has("background")) {
        Some(file) => background_of(file),
        None => arguments.background.0,
    };
    DisplayTransform { exposure_stops, tone_map, background }
}

/// How a scene brings highlights down.
pub fn tone_map_of(file: &SceneFile) -> display_transform::ToneMap {
    match file.tone_map {
        ToneMap::Clamp => display_transform::ToneMap::Clamp,
        ToneMap::Neutral => display_transform::ToneMap::Neutral,
    }
}

/// What stands in a scene where no surfel is.
pub fn background_of(file: &SceneFile) -> Background {
    match file.background {
        Backdrop::Transparent => Background::Transparent,
        Backdrop::Color(linear) => Background::Color(encoded(linear)),
        Backdrop::Gradient { top, bottom } => {
            Background::Gradient { top: encoded(top), bottom: encoded(bottom) }
        }
    }
}

fn encoded(linear: [f32; 3]) -> [f32; 3] {
    linear.map(|channel| linear_to_srgb(channel.clamp(0.0, 1.0)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::explicit::parse;
    use glam::DVec3;
    use surfelshop_api::Projection;
    use surfelshop_cloud::display::{ColorBy, ColorSource};
    use surfelshop_cloud::scene::Axis;

    /// A scene in which nothing is as usual.
    fn file() -> SceneFile {
        let projection = Projection::Orthographic { height: 3.0 };
        let camera = Camera { eye: DVec3::X, target: DVec3::ZERO, up: DVec3::Y, projection };
        let mut file = SceneFile { camera: Some(camera.into()), ..SceneFile::default() };
        file.lights.clear();
        file.exposure_stops = -2.0;
        file.tone_map = ToneMap::Neutral;
        file.antialias = 16;
        file.eye_dome.strength = 0.5;
        file.background = Backdrop::Color([0.25, 0.0, 0.5]);
        file.surface.two_sided = false;
        file.surface.radius_scale = 2.0;
        file.surface.depth_tolerance = 0.5;
        file.surface.low_pass = 0.25;
        file.up = Some(Axis::PlusZ);
        file.color.known = ColorSource::new(ColorBy::Normal);
        file
    }

    fn staged(options: &str, view: Option<&SceneView>) -> RenderSetup {
        let line = format!("surfelshop render a.scene.toml -o a.png {options}");
        let line: Vec<&str> = line.split_whitespace().collect();
        let (arguments, given) = parse::<RenderArguments>(&line).unwrap();
        let opened = OpenedScene {
            path: "a.scene.toml".into(),
            scene: file(),
            warnings: Vec::new(),
            cloud_lines: Vec::new(),
            view_lines: Vec::new(),
        };
        let chosen =
            view.map(|view| SelectedView { view, place: String::new(), folder: PathBuf::new() });
        let staging = RenderSetup::new(&arguments.picture, &given, Some(&opened), chosen.as_ref());
        staging.unwrap().showing(arguments.output.clone())
    }

    #[test]
    fn what_is_not_typed_is_the_scene_s() {
        let staged = staged("", None);
        assert_eq!(staged.scene, file().scene());
        assert_eq!(staged.camera, file().camera.map(|camera| camera.known));
        assert_eq!((staged.output, staged.parallel), (None, None));
        assert_eq!(staged.antialias, 16);
        assert_eq!(staged.eye_dome, file().eye_dome);
        assert_eq!(staged.display, file().display());
        let expected = DisplayTransform {
            exposure_stops: -2.0,
            tone_map: display_transform::ToneMap::Neutral,
            background: Background::Color([0.25, 0.0, 0.5].map(linear_to_srgb)),
        };
        assert_eq!(staged.how, expected);
    }

    #[test]
    fn what_is_typed_counts_even_where_it_is_the_usual() {
        let options = "--exposure 0 --tone-map clamp --background transparent --one-sided=false \
                       --radius-scale 1 --depth-tolerance 1 --low-pass 1 --light camera \
                       --camera three-quarter --orthographic=false --output color --up y --antialias 1 --color-by \
                       file --eye-dome-lighting=automatic";
        let staged = staged(options, None);
        let mut usual = Scene::default();
        // Brightness 1 of the light beside the camera, as typed.
        assert_eq!(staged.scene.lights.len(), 1);
        usual.lights.clone_from(&staged.scene.lights);
        assert_eq!(staged.scene, usual);
        assert_eq!(staged.how, DisplayTransform::default());
        assert_eq!(staged.display, DisplaySettings::default());
        assert_eq!((staged.camera, staged.parallel), (None, Some(false)));
        assert_eq!(staged.antialias, 1);
        assert_eq!(staged.eye_dome, EyeDomeLighting::default());
        assert_eq!(staged.output, Some(Output::Color));
    }

    #[test]
    fn every_name_that_is_asked_for_is_an_option() {
        let render = <RenderArguments as clap::Args>::augment_args(clap::Command::new("render"));
        for name in [
            "renderer",
            "camera",
            "exposure",
            "tone_map",
            "background",
            "one_sided",
            "orthographic",
            "up",
            "antialias",
            "eye_dome_lighting",
        ] {
            assert!(render.get_arguments().any(|argument| argument.get_id() == name), "{name}");
        }
    }

    #[test]
    fn views_have_their_own_camera_and_output() {
        let projection = Projection::Perspective { fov_y: 1.0 };
        let camera = Camera { eye: DVec3::Z, target: DVec3::ZERO, up: DVec3::Y, projection };
        let mut view = SceneView::new("flat");
        assert_eq!(staged("", Some(&view)).camera, file().camera.map(|camera| camera.known));
        view.camera = Some(camera.into());
        view.output = Output::Depth;
        let found = staged("", Some(&view));
        assert_eq!((found.camera, found.output), (Some(camera), Some(Output::Depth)));
        assert_eq!(staged("--output ao", Some(&view)).output, Some(Output::Ao));
    }
}
