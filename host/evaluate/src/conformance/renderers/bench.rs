//! A renderer at work: pictures of shots, each checked to be whole.

use super::fitted::Fitting;
use crate::conformance::Setup;
use crate::conformance::verdict::Failure;
use glam::DVec3;
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_api::{
    Camera, CloudFacts, CloudView, Environment, EnvironmentView, Projection, Scene, View,
};
use surfelshop_cloud::Cloud;
use surfelshop_cloud::environment_map::Probe;
use surfelshop_image::Image;
use surfelshop_image::display_transform::{DisplayTransform, develop, to_8_bit};
use surfelshop_render::{
    Engine, EngineOptions, RenderError, RenderRequest, Rendered, RendererView, Restored,
};
use surfelshop_runtime::boundary::Fault;
use surfelshop_runtime::plugins::LoadedUnit;

/// Frames that a renderer may take until its picture stays.
const MAX_FRAMES: u32 = 256;

/// Frames of a picture that is refined: the first, and one that goes on from it. More of them would show
/// nothing else and take long.
const FRAMES: u32 = 2;

/// What is drawn.
#[derive(Clone)]
pub(super) struct DrawRequest<'a> {
    pub(super) cloud: Cloud,
    pub(super) scene: Scene,
    pub(super) view: View,
    pub(super) values: Values,
    pub(super) outputs: Vec<Output>,
    pub(super) probe: Option<(&'a Probe, Environment)>,
}

impl DrawRequest<'_> {
    /// A cloud's colour, with usual settings.
    pub(super) fn new(cloud: Cloud, view: View) -> Self {
        Self {
            cloud,
            scene: Scene::default(),
            view,
            values: Values::new(),
            outputs: vec![Output::Color],
            probe: None,
        }
    }

    /// Other outputs.
    pub(super) fn of(self, outputs: &[Output]) -> Self {
        Self { outputs: outputs.to_vec(), ..self }
    }

    /// Discs as they are: rays know nothing of the low-pass, which would widen them by a pixel.
    pub(super) fn without_low_pass(mut self) -> Self {
        self.scene.surface.low_pass = 0.0;
        self
    }

    fn request<'a>(
        &'a self,
        clouds: &'a [CloudView<'a>],
        facts: &'a CloudFacts,
        frame_index: u32,
    ) -> RenderRequest<'a> {
        let probe = self.probe.as_ref();
        RenderRequest {
            clouds,
            facts,
            scene: &self.scene,
            view: self.view,
            environment: probe
                .map(|(probe, environment)| EnvironmentView { environment, texels: &probe.texels }),
            values: &self.values,
            outputs: &self.outputs,
            frame_index,
            stride: 1,
            detail_px: 0.0,
            parts: None,
            eye_dome: None,
        }
    }
}

/// A view from `eye` towards `target`, 46 degrees high.
pub(super) fn view(eye: DVec3, target: DVec3, size: u32) -> View {
    let projection = Projection::Perspective { fov_y: 0.8 };
    let camera = Camera { eye, target, up: DVec3::Y, projection };
    View { camera, size_px: [size, size], near: 1e-5, far: 1e3 }
}

/// A view of a ball of radius 1 around the origin.
pub(super) fn front(size: u32) -> View {
    view(DVec3::new(0.5, 1.0, 3.0), DVec3::ZERO, size)
}

/// The same in parallel projection.
pub(super) fn parallel(size: u32) -> View {
    let mut view = front(size);
    view.camera.projection = Projection::Orthographic { height: 2.5 };
    view.far = 10.0;
    view
}

/// A renderer with its engine.
pub(super) struct Bench<'a> {
    pub(super) unit: &'a LoadedUnit,
    setup: &'a Setup<'a>,
    engine: Engine,
    fitting: Fitting,
}

/// An instance of the renderer.
pub(super) struct Instance(RendererView);

impl<'a> Bench<'a> {
    pub(super) fn new(unit: &'a LoadedUnit, setup: &'a Setup<'a>) -> Result<Self, String> {
        let engine = (setup.engine)(&EngineOptions::default())?;
        let fitting = Fitting::new(&unit.description.needs);
        Ok(Self { unit, setup, engine, fitting })
    }

    /// The same with an engine of its own.
    pub(super) fn with(&self, options: &EngineOptions) -> Result<Self, Failure> {
        let engine = (self.setup.engine)(options).map_err(Failure::new)?;
        let fitting = Fitting::new(self.fitting.needs());
        Ok(Self { unit: self.unit, setup: self.setup, engine, fitting })
    }

    /// How clouds are made to fit the renderer.
    pub(super) fn fitting(&self) -> &Fitting {
        &self.fitting
    }

    pub(super) fn engine(&self) -> &Engine {
        &self.engine
    }

    /// What a shot that this instance drew last did without, but for pictures that nobody asked for.
    pub(super) fn left_out(
        &self,
        Instance(view): &Instance,
        shot: &DrawRequest<'_>,
    ) -> Result<Vec<Restored>, Failure> {
        let cloud = self.fitting.fitted(&shot.cloud)?;
        let left_out = self.engine.left_out(view, &shot.request(&[cloud.view()], cloud.facts(), 0));
        Ok(left_out.into_iter().filter(|kept| !matches!(kept, Restored::Output(_))).collect())
    }

    /// Who makes a picture, for lines: nothing where the renderer itself does.
    pub(super) fn whose(&self, Instance(view): &Instance, output: &Output) -> &'static str {
        if self.engine.makes(view, output) { "" } else { " (made by the host)" }
    }

    /// Draws with what need not be there.
    pub(super) fn keep(&mut self, kept: Vec<Restored>) {
        self.engine.keep(kept);
    }

    /// A new instance.
    pub(super) fn start(&self) -> Result<Instance, Failure> {
        let host = self.engine.gpu().host_info();
        let hosted = self.unit.start(&host, &self.setup.patience).map_err(|fault| {
            let is_silent = matches!(fault, Fault::TimedOut(_));
            Failure { is_silent, ..Failure::fault(format!("it could not start: {fault}")) }
        })?;
        Ok(Instance(
            RendererView::new(hosted, self.unit.scope()).needing(&self.unit.description.needs),
        ))
    }

    /// The pictures of a shot by a new instance.
    pub(super) fn draw(&mut self, shot: &DrawRequest<'_>) -> Result<Rendered, Failure> {
        let mut instance = self.start()?;
        self.draw_by(&mut instance, shot)
    }

    /// The pictures of a shot, of the second frame where they are refined; all values are finite.
    pub(super) fn draw_by(
        &mut self,
        instance: &mut Instance,
        shot: &DrawRequest<'_>,
    ) -> Result<Rendered, Failure> {
        let mut rendered = self.frame(instance, shot, 0)?;
        for frame_index in 1..FRAMES {
            if rendered.wants_another_frame {
                rendered = self.frame(instance, shot, frame_index)?;
            }
        }
        Ok(rendered)
    }

    /// How many frames a shot takes until its pictures stay.
    pub(super) fn n_frames(&mut self, shot: &DrawRequest<'_>) -> Result<u32, Failure> {
        let mut instance = self.start()?;
        for frame_index in 0..MAX_FRAMES {
            if !self.frame(&mut instance, shot, frame_index)?.wants_another_frame {
                return Ok(frame_index + 1);
            }
        }
        Err(Failure::fault(format!("after {MAX_FRAMES} frames it wants another one")))
    }

    /// One frame of a shot.
    pub(super) fn frame(
        &mut self,
        Instance(view): &mut Instance,
        shot: &DrawRequest<'_>,
        frame_index: u32,
    ) -> Result<Rendered, Failure> {
        let cloud = self.fitting.fitted(&shot.cloud)?;
        let clouds = [cloud.view()];
        let request = shot.request(&clouds, cloud.facts(), frame_index);
        let rendered = self.engine.render(view, &request).map_err(|error| refused(&error))?;
        for (output, image) in &rendered.images {
            whole(output, image, shot.view.size_px)?;
        }
        Ok(rendered)
    }

    /// The colour of a shot by a new instance.
    pub(super) fn color(&mut self, shot: &DrawRequest<'_>) -> Result<Image, Failure> {
        picture(&self.draw(shot)?, &Output::Color)
    }
}

fn refused(error: &RenderError) -> Failure {
    let is_silent = matches!(
        error,
        RenderError::Plugin(Fault::TimedOut(_))
            | RenderError::DeviceLost(_)
            | RenderError::Overran { .. }
    );
    // What it says in words of its own, or of a file that it was given.
    let is_refusal = matches!(
        error,
        RenderError::Plugin(Fault::Error(_)) | RenderError::Pass { .. } | RenderError::Graph(_)
    );
    Failure { is_silent, is_fault: !is_refusal, ..Failure::new(error.to_string()) }
}

/// One of the pictures.
pub(super) fn picture(rendered: &Rendered, output: &Output) -> Result<Image, Failure> {
    let found = rendered.image(output).cloned();
    found.ok_or_else(|| Failure::new(format!("there is no output `{}`", output.name())))
}

/// Fails where a picture has another size, or values that are no numbers.
fn whole(output: &Output, image: &Image, [width, height]: [u32; 2]) -> Result<(), Failure> {
    let name = output.name();
    if [image.width, image.height] != [width, height] {
        let found = format!("{} x {}", image.width, image.height);
        return Err(Failure::fault(format!(
            "output `{name}` has {found} pixels, expected {width} x {height}"
        )));
    }
    let pixels = image.data.chunks_exact(image.components.max(1) as usize);
    let is_odd = |pixel: &[f32]| pixel.iter().any(|value| !value.is_finite());
    let mut odd = pixels.enumerate().filter(|(_, pixel)| is_odd(pixel));
    let Some((first, values)) = odd.next() else { return Ok(()) };
    let (n, at) = (1 + odd.count(), [first % width as usize, first / width as usize]);
    let line = format!("output `{name}` is not finite at {n} pixels, first at {at:?}: {values:?}");
    Err(Failure { is_fault: true, ..Failure::showing(line, [(name.as_str(), image)]) })
}

/// Bits of all values.
pub(super) fn bits(image: &Image) -> impl Iterator<Item = u32> {
    image.data.iter().map(|value| value.to_bits())
}

/// Fails unless two pictures are the same bit by bit.
pub(super) fn same(what: &str, expected: &Image, found: &Image) -> Result<(), Failure> {
    let differ = bits(expected).zip(bits(found)).filter(|(a, b)| a != b).count();
    let sizes = (expected.data.len(), found.data.len());
    if differ == 0 && sizes.0 == sizes.1 {
        return Ok(());
    }
    let line = format!("{what}: {differ} of {} values differ", sizes.0);
    let pictures = [("expected", expected), ("found", found)];
    Err(Failure::showing(line, pictures).counting(differ, sizes.0))
}

/// 8-bit levels as a screen shows them.
fn levels(image: &Image) -> Vec<u8> {
    to_8_bit(&develop(image, &DisplayTransform::default()))
}

/// Pixels of two pictures that differ by more than a level, and those covered in either. Fails where
/// nothing is covered, or more than a share differs.
pub(super) fn alike(
    what: &str,
    expected: &Image,
    found: &Image,
    most: f64,
) -> Result<String, Failure> {
    let (a, b) = (levels(expected), levels(found));
    let pairs = || a.chunks_exact(4).zip(b.chunks_exact(4));
    let covered = pairs().filter(|(a, b)| a[3] > 0 || b[3] > 0).count();
    let is_far = |a: &[u8], b: &[u8]| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > 1);
    let n = pairs().filter(|(a, b)| is_far(a, b)).count();
    let line = format!("{what}: {n} of {covered} covered pixels differ by more than a level");
    if covered == 0 {
        return Err(Failure::new(format!("{what}: the picture is empty")).counting(1, 1));
    }
    if n as f64 > most * covered as f64 {
        let pictures = [("expected", expected), ("found", found)];
        return Err(Failure::showing(line, pictures).counting(n, covered));
    }
    Ok(line)
}
