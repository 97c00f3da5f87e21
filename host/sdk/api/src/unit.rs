use crate::columns::CloudView;
use crate::error::Result;
use crate::frame::{Frame, HostInfo};
use crate::graph::Graph;
use crate::job::Job;
use crate::need::NeedInfo;
use crate::params::ParamSet;
use crate::stroke::Handling;
use crate::tool::{Tile, Traced};
use crate::unit_info::UnitInfo;
use serde::{Deserialize, Serialize};

/// Something that a unit cannot do, as its type states it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LimitInfo {
    case: &'static str,
    why: &'static str,
    at_most: Option<f32>,
}

impl LimitInfo {
    /// A case of `surfelshop check` that the unit does not pass, and why not, in a sentence.
    #[must_use]
    pub const fn new(case: &'static str, why: &'static str) -> Self {
        Self { case, why, at_most: None }
    }

    /// The largest share of what the case counts (pixels, values, surfels) that is wrong, 0 to 1: beyond
    /// it the case fails all the same, as it does for what is counted in no share, such as an empty picture.
    /// Without it everything is let pass but panics, silence and numbers that are none.
    #[must_use]
    pub const fn at_most(mut self, share: f32) -> Self {
        self.at_most = Some(share);
        self
    }
}

impl From<&LimitInfo> for Limit {
    fn from(info: &LimitInfo) -> Self {
        Self { case: info.case.to_owned(), why: info.why.to_owned(), at_most: info.at_most }
    }
}

/// Something that a unit cannot do, as it says itself. Checks show it and count it as no failure.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Limit {
    /// The case of `surfelshop check` that it does not pass.
    pub case: String,
    /// Why not, in a sentence.
    pub why: String,
    /// The largest share of what the case counts that is wrong, 0 to 1. ABI 3.3.
    #[serde(default)]
    pub at_most: Option<f32>,
}

/// How much of a cloud a tool has to see to tell what becomes of a surfel.
///
/// By it a host runs the tool over a cloud that does not fit into memory, part by part: each part comes with what is
/// around it, which the column [`CONTEXT`](crate::columns::CONTEXT) tells from the part. Came while ABI 3.8 was current.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Scope {
    /// All of it: it runs over clouds in memory alone.
    #[default]
    Cloud,
    /// The surfel alone.
    Surfel,
    /// The surfels around it, to about 18 times their spacing.
    Neighbours,
    /// These, and all others coarsely: merged surfels stand for those farther away.
    Scene,
}

/// A renderer: describes the whole frame as a graph the host runs.
pub trait Renderer: Send + Sized + 'static {
    /// How the renderer is called.
    const INFO: UnitInfo;
    /// Its parameters, declared with [`params!`](crate::params!).
    type Params: ParamSet;
    /// What it cannot do: cases of `surfelshop check`, and why; see [`LimitInfo`].
    const LIMITS: &'static [LimitInfo] = &[];
    /// The columns that it reads of the clouds that it draws itself; see [`NeedInfo`].
    const NEEDS: &'static [NeedInfo] = &[];

    /// Makes an instance; one per view.
    ///
    /// # Errors
    /// Where the host lacks something the renderer cannot do without.
    fn new(host: &HostInfo) -> Result<Self>;

    /// Describes one frame.
    ///
    /// # Errors
    /// Where the frame cannot be described; the line is shown on the view.
    fn frame(&mut self, frame: &Frame<Self::Params>, graph: &mut Graph) -> Result<()>;
}

/// A renderer that writes pixels itself, on the CPU or through any other interface.
pub trait Tracer: Send + Sync + Sized + 'static {
    /// How the tracer is called.
    const INFO: UnitInfo;
    /// Its parameters.
    type Params: ParamSet;
    /// What it cannot do: cases of `surfelshop check`, and why; see [`LimitInfo`].
    const LIMITS: &'static [LimitInfo] = &[];

    /// Makes an instance; one per picture, of all its samples.
    ///
    /// # Errors
    /// Where the host lacks something the tracer cannot do without.
    fn new(host: &HostInfo) -> Result<Self>;

    /// Writes one sample of a tile: linear Rec. 709 radiance, weighted by coverage, and coverage,
    /// four floats a pixel, row by row. Calls run on several threads at once.
    ///
    /// The host takes the mean over as many samples as the parameter `samples` says, where the
    /// tracer declares a whole number of that name, and else over one. What a sample is depends on
    /// the frame, the pixel and the sample's number alone, so that it is the same on any number of
    /// threads.
    ///
    /// # Errors
    /// Where the tile cannot be computed; the line is shown on the view.
    fn tile(
        &self,
        frame: &Frame<Self::Params>,
        scene: &Traced<'_>,
        tile: Tile,
        pixels: &mut [f32],
        job: &Job<'_>,
    ) -> Result<()>;
}

/// A tool: reads a cloud and stages an edit of it.
pub trait Tool: Send + Sized + 'static {
    /// How the tool is called.
    const INFO: UnitInfo;
    /// Its parameters.
    type Params: ParamSet;
    /// What it cannot do: cases of `surfelshop check`, and why; see [`LimitInfo`].
    const LIMITS: &'static [LimitInfo] = &[];

    /// How much of a cloud it has to see to tell what becomes of a surfel.
    const SCOPE: Scope = Scope::Cloud;

    /// How it is handled: `Handling::STROKE` of a brush. ABI 3.11.
    const HANDLING: Handling = Handling::Cloud;

    /// Makes an instance; one per run.
    ///
    /// # Errors
    /// Where the host lacks something the tool cannot do without.
    fn new(host: &HostInfo) -> Result<Self>;

    /// Reads the cloud and stages edits with [`Job::edit`]; they are committed when this returns
    /// `Ok` and dropped otherwise.
    ///
    /// # Errors
    /// Where the tool cannot do its work; the cloud stays as it was.
    fn run(&mut self, cloud: &CloudView<'_>, params: &Self::Params, job: &Job<'_>) -> Result<()>;
}
