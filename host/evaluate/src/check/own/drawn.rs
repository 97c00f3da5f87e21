//! Draws the scenes of own cases.

use super::declared::{OwnCase, is_exr};
use crate::check::CheckArguments;
use crate::compare::Stage;
use crate::compare::candidate::Candidate;
use crate::compare::requests::{self, Named};
use anyhow::{Context as _, bail, ensure};
use std::path::Path;
use surfelshop_api::UnitKind;
use surfelshop_image::display_transform::DisplayTransform;
use surfelshop_image::{Image, exr, png};
use surfelshop_runtime::plugins::UnitRef;
use surfelshop_session::input::formats::SessionFormats;
use surfelshop_session::input::scenes::Inputs;
use surfelshop_session::options::PictureArguments;
use surfelshop_session::options::explicit;
use surfelshop_session::render;
use surfelshop_session::session::{self, RenderSession};
use surfelshop_session::setup::{self, RenderSetup};

/// Width and height where neither the case nor a picture says them.
const SIZE: [u32; 2] = [512, 512];

/// What cases are drawn with: a device is opened for the first that needs one.
#[derive(Default)]
pub(super) struct Bench {
    session: Option<RenderSession>,
}

/// A picture, and what was expected.
pub(super) struct Drawn {
    /// Linear radiance with straight coverage, four values a pixel.
    pub(super) color: Image,
    /// How the scene is developed.
    pub(super) how: DisplayTransform,
    /// The picture that is there: as it is in its file.
    pub(super) expected: Option<Image>,
}

impl Bench {
    /// The picture of a case.
    pub(super) fn draw(
        &mut self,
        arguments: &CheckArguments,
        case: &OwnCase,
        unit: &UnitRef,
    ) -> anyhow::Result<Drawn> {
        let expected = expected(case, arguments.accept)?;
        let size = case.size.or_else(|| {
            let picture = expected.as_ref()?;
            Some([picture.width, picture.height])
        });
        let [width, height] = size.unwrap_or(SIZE);
        let line = ["surfelshop", "check", "--size", &format!("{width}x{height}")];
        let (picture, given) = explicit::parse::<PictureArguments>(&line)?;

        let inputs = Inputs::open(std::slice::from_ref(&case.scene))?;
        let opened = inputs.opened.as_ref();
        let seen = setup::view_of(opened, unit).or_else(|| setup::first_view(opened));
        let mut staging = RenderSetup::new(&picture, &given, opened, seen.as_ref())?;
        if let Some(output) = &staging.output {
            let (scene, output) = (case.scene.display(), output.name());
            bail!(
                "{scene}: its view shows `{output}`; cases judge `color`, so leave `output` out of it"
            );
        }
        let named = Named { name: unit.id.clone(), reference: unit.clone() };
        let patience = arguments.plugins.patience();
        let wanted = requests::with_settings(vec![named], &[], opened, &patience)?;
        let mut wanted = wanted.into_iter().next().context("there is nothing to draw with")?;
        let formats = SessionFormats::new(&arguments.plugins);
        let (surroundings, displayed) = staging.read(&inputs.sources, &formats)?;
        let view = render::view(&picture, &staging, &displayed.clouds);
        if inputs.sources.iter().any(|source| source.renderer.is_some()) {
            let registry = session::registry(&arguments.plugins)?;
            let infos = &displayed.clouds.facts.clouds;
            let of_case = std::slice::from_mut(&mut wanted);
            requests::draw_beside(of_case, &registry, &inputs.sources, infos)?;
        }
        let stage = Stage {
            plugins: &arguments.plugins,
            staging: &staging,
            clouds: &displayed.clouds,
            surroundings: surroundings.as_ref(),
            view,
        };
        if unit.kind == UnitKind::Renderer && self.session.is_none() {
            self.session = Some(RenderSession::open(&arguments.device, &arguments.plugins)?);
        }
        if let Some(session) = &mut self.session {
            session.engine.tint_backs(staging.display.splats.tint_backs);
        }
        let mut candidate = Candidate::new(self.session.as_ref(), wanted);
        let drawn = candidate.first(&stage, self.session.as_mut())?;
        Ok(Drawn { color: drawn.color, how: staging.how, expected })
    }
}

/// The picture that is expected; none may be there where what is drawn is accepted.
fn expected(case: &OwnCase, accepts: bool) -> anyhow::Result<Option<Image>> {
    let path: &Path = &case.expect;
    if !path.exists() {
        ensure!(accepts, "{}: there is no such picture; --accept writes it", path.display());
        return Ok(None);
    }
    let read = match is_exr(path) {
        true => exr::read_color(path, exr::MOST_PIXELS),
        false => png::read(path, exr::MOST_PIXELS),
    };
    match read {
        Ok(picture) => Ok(Some(picture)),
        Err(_) if accepts => Ok(None),
        Err(error) => Err(error.into()),
    }
}
