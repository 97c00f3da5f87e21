//! Variables of the host's shader modules, and who gives them: the frame graph knows no surfels.

use crate::graph::RenderError;
use crate::graph::pipeline_desc::Pipeline;
use crate::graph::pipelines::Pipelines;
use crate::graph::recorder::Recorder;
use crate::shader_compiler::SPENT;
use std::sync::Arc;
use surfelshop_api::graph::SurfaceMode;
use surfelshop_api::{Light, View};
use surfelshop_raster::Coverage;

/// A variable that the host binds; authors bind all others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum HostBinding {
    /// The view's uniform.
    View,
    /// The lights' uniform.
    Lights,
    /// The environment's uniform.
    Environment,
    /// The prefiltered environment map.
    EnvironmentMap,
    /// Its sampler.
    EnvironmentSampler,
    /// The packed surface.
    Surface,
    /// Materials of the nearest surfels.
    Material,
    /// Clouds of the nearest surfels.
    Object,
    /// Units of work that loops of a sandboxed plugin's graph have spent.
    Spent,
}

impl HostBinding {
    const ALL: [Self; 9] = [
        Self::View,
        Self::Lights,
        Self::Environment,
        Self::EnvironmentMap,
        Self::EnvironmentSampler,
        Self::Surface,
        Self::Material,
        Self::Object,
        Self::Spent,
    ];

    /// The variable, with the module that declares it.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::View => "surfelshop::view::view",
            Self::Lights => "surfelshop::light::lights",
            Self::Environment => "surfelshop::environment::environment",
            Self::EnvironmentMap => "surfelshop::environment::environment_map",
            Self::EnvironmentSampler => "surfelshop::environment::environment_sampler",
            Self::Surface => "surfelshop::surface::surface_packed",
            Self::Material => "surfelshop::surface::surface_material",
            Self::Object => "surfelshop::surface::surface_object",
            Self::Spent => SPENT,
        }
    }

    /// The binding of a variable; `None` where authors bind it.
    pub(crate) fn of(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|binding| binding.name() == name)
    }
}

/// What a scene has of lights: what shaders of passes have code for, and no more.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct SceneLights {
    several: bool,
    placed: bool,
}

impl SceneLights {
    /// Those of a scene.
    pub(crate) fn of(lights: &[Light]) -> Self {
        let has_place = |light: &Light| !matches!(light, Light::Directional { .. });
        Self { several: lights.len() > 1, placed: lights.iter().any(has_place) }
    }

    /// The constants of `surfelshop::light` that say so.
    pub(crate) fn features(self) -> [(&'static str, bool); 2] {
        [("surfelshop::light::SEVERAL", self.several), ("surfelshop::light::PLACED", self.placed)]
    }
}

/// What the host gives to passes that look from one camera.
pub(crate) trait HostResources {
    /// The resource of a binding, with the packed surface in this mode; `None` where there is none.
    fn resource(
        &self,
        binding: HostBinding,
        surface: Option<SurfaceMode>,
    ) -> Option<wgpu::BindingResource<'_>>;

    /// The packed surface of all clouds in a mode, where a graph may be given that of some.
    fn whole_surface(&self, mode: Option<SurfaceMode>) -> Option<wgpu::BindingResource<'_>>;

    /// Which parts of the surface hold surfels, where that is known.
    fn covered(&self) -> Option<&Arc<Coverage>>;

    /// The view of the camera.
    fn view(&self) -> &View;

    /// Scene units of a unit of drawing.
    fn unit(&self) -> f64;

    /// Calls a shading function for each surfel and blends the results into a packed surface.
    ///
    /// # Errors
    /// Where a pipeline cannot be made or bound.
    fn shade_surfels(
        &self,
        shading: &SurfelShading<'_>,
        recorder: &mut Recorder<'_>,
        pipelines: &mut Pipelines,
    ) -> Result<wgpu::TextureView, RenderError>;
}

/// A shading function that is called for each surfel.
pub(crate) struct SurfelShading<'a> {
    /// The pass.
    pub(crate) name: &'a str,
    pub(crate) pipeline: &'a Pipeline,
    /// Binds it to the records of a chunk and to where their radiance goes.
    pub(crate) bind: &'a dyn Fn(&wgpu::Buffer, &wgpu::Buffer) -> Result<wgpu::BindGroup, String>,
}
