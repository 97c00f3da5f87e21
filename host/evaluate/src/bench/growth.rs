//! How time grows: with surfels, with pixels, and with how close the camera is.

use super::body::body;
use super::cells::cells;
use super::grown::Grown;
use super::memory::memory;
use super::series::{Point, Series, USUAL_SIDE, points};
use super::timing::{What, timed};
use super::variant::{Contestant, LeftOut, Variant, base, open};
use super::{STILL, renderers, report};
use crate::bench::BenchArguments;
use crate::compare::candidate::CandidateRequest;
use crate::compare::{Stage, requests};
use anyhow::ensure;
use std::time::Duration;
use surfelshop_session::input::clouds::Clouds;
use surfelshop_session::input::environment_map::{self, LoadedEnvironment};
use surfelshop_session::options::explicit::ExplicitOptions;
use surfelshop_session::options::values::Size;
use surfelshop_session::output::json;
use surfelshop_session::output::terminal::Progress;
use surfelshop_session::session;
use surfelshop_session::setup::RenderSetup;

/// A place that takes longer than this in all is not drawn again, beyond a few times.
const LONGEST: Duration = Duration::from_secs(30);

/// What all places have in common.
struct Session<'a> {
    arguments: &'a BenchArguments,
    staging: &'a RenderSetup,
    surroundings: Option<&'a LoadedEnvironment>,
    renderers: &'a [CandidateRequest],
    base: String,
}

/// A cloud and those that draw it.
struct Drawn {
    surfels: u32,
    clouds: Clouds,
    contestants: Vec<Contestant>,
}

/// Measures growth.
pub(super) fn run(arguments: &BenchArguments, given: &ExplicitOptions) -> anyhow::Result<()> {
    ensure!(
        arguments.colors.is_empty(),
        "--growth makes clouds of its own, without colours and columns; leave --color-by, --hide and --only out"
    );
    let registry = session::registry(&arguments.plugins)?;
    let variants = Variant::all(&arguments.strategies(given), &arguments.details());
    let picture = arguments.picture(Size([USUAL_SIDE; 2]))?;
    let staging = RenderSetup::new(&picture, given, None, None)?;
    let named = renderers(arguments, &registry)?;
    let patience = arguments.plugins.patience();
    let renderers = requests::with_settings(named, &arguments.set, None, &patience)?;
    let surroundings = environment_map::read_wanted(staging.environment.as_ref())?;
    let session = Session {
        arguments,
        staging: &staging,
        surroundings: surroundings.as_ref(),
        renderers: &renderers,
        base: base(&variants),
    };
    let mut left_out = LeftOut::default();
    let mut grown = Grown::default();
    let mut now: Option<Drawn> = None;
    let mut adapter = None;
    let points = points(arguments.most, arguments.largest);
    let progress = Progress::new("measuring growth");
    for (i, point) in points.iter().enumerate() {
        let drawn = match now.take().filter(|drawn| drawn.surfels == point.surfels) {
            Some(drawn) => now.insert(drawn),
            None => {
                let clouds = body(point.surfels)?;
                let contestants = open(arguments, &variants, &mut left_out)?;
                now.insert(Drawn { surfels: point.surfels, clouds, contestants })
            }
        };
        match session.point(point, drawn, &mut grown, &mut left_out) {
            Ok(()) => adapter = drawn.contestants.first().map(|one| json::adapter(&one.studio)),
            Err(error) if grown.is_empty() => return Err(error),
            // What was measured is worth telling, and the next cloud may be smaller.
            Err(_said) => now = None,
        }
        // Ctrl-C ends the program.
        let _goes_on = progress.tell((i + 1) as f64 / points.len() as f64);
    }
    drop(progress);
    let object = report::object("growth", adapter, &session.base, &left_out);
    grown.tell(arguments, &variants, object)
}

impl Session<'_> {
    /// Measures a place.
    fn point(
        &self,
        point: &Point,
        drawn: &mut Drawn,
        grown: &mut Grown,
        left_out: &mut LeftOut,
    ) -> anyhow::Result<()> {
        let view = point.view(&self.arguments.lens);
        let n = self.arguments.frames.unwrap_or(STILL) as usize;
        let stage = Stage {
            plugins: &self.arguments.plugins,
            staging: self.staging,
            clouds: &drawn.clouds,
            surroundings: self.surroundings,
            view,
        };
        for what in self.renderers.iter().map(What::Frame).chain([What::Surfels]) {
            let views = vec![view; n];
            let all = timed(&mut drawn.contestants, what, &stage, &views, LONGEST, left_out)?;
            grown.add(point, cells(&point.of(), what, all, &self.base));
        }
        if point.series == Series::Surfels {
            grown.measured.memory.extend(memory("growth", &drawn.clouds, &drawn.contestants));
        }
        Ok(())
    }
}
