//! Checks of renderers.

mod bench;
mod columns;
mod fitted;
mod gaussians;
mod growth;
mod left_out;
mod lights;
mod params;
mod pictures;
mod places;
mod silhouettes;

use crate::conformance::verdict::{Judged, Judges, limits_name, run};
use crate::conformance::{Case, Outcome, Setup};
use bench::Bench;
pub(crate) use params::{driven, may_be_refused};
use surfelshop_api::UnitKind;
use surfelshop_runtime::plugins::LoadedUnit;

type Criteria = fn(&mut Bench<'_>) -> Judged;

const fn case(name: &'static str, about: &'static str, judge: Criteria) -> (Case, Criteria) {
    (Case { kind: UnitKind::Renderer, name, about }, judge)
}

/// All cases with what judges them.
const CASES: &[(Case, Criteria)] = &[
    case("limits", "limits that it declares are those of cases that there are", limits),
    case(
        "outputs",
        "each output has the view's size and is finite, and colour is the same whatever else is asked for",
        pictures::outputs,
    ),
    case("again", "another instance makes the same picture, bit by bit", pictures::again),
    case("background", "where nothing is, colour and coverage are 0", pictures::background),
    case(
        "viewport",
        "pictures of one pixel, one row, one column and 2048 x 1024 are whole",
        pictures::viewport,
    ),
    case("resize", "a view that changes its size and back shows what it did", pictures::resize),
    case("silhouette", "a ball covers the pixels that rays meet", silhouettes::front),
    case("grazing", "a plane seen at a slant of 1.4 degrees has no holes", silhouettes::grazing),
    case("inside", "a ball seen from inside fills the picture", silhouettes::inside),
    case(
        "near-plane",
        "discs that reach behind the eye cover what rays meet",
        silhouettes::near_plane,
    ),
    case(
        "off-centre",
        "a ball at the picture's corner is cut where the picture ends",
        silhouettes::off_centre,
    ),
    case(
        "orthographic",
        "parallel projection covers what rays meet, and a camera that moves sideways shifts the picture",
        silhouettes::orthographic,
    ),
    case("sub-pixel", "surfels far below a pixel leave no holes", silhouettes::sub_pixel),
    case("depth", "depth is where rays meet discs, central and parallel", silhouettes::depth),
    case(
        "far-depth",
        "surfaces a hundredth apart at a distance of 1000 are told apart with the near plane at 0.01",
        silhouettes::far_depth,
    ),
    case("normal", "normals of a ball point outwards, in world axes", silhouettes::normal),
    case(
        "chunked",
        "surfels cut into small chunks make the same picture, bit by bit",
        columns::chunked,
    ),
    case(
        "neutral-columns",
        "columns that say what goes without saying change nothing, bit by bit",
        columns::neutral,
    ),
    case(
        "left-out",
        "what frames do without changes nothing where it is there: columns, and features of shaders",
        left_out::left_out,
    ),
    case("unused-columns", "columns that nobody knows change nothing, bit by bit", columns::unused),
    case(
        "reordered",
        "the order of surfels changes no 8-bit value by more than a level",
        columns::reordered,
    ),
    case("moved", "a scene 7 million units away looks as at the origin", places::moved),
    case("scaled", "scenes from 1e-30 to 1e30 times the size look alike", places::scaled),
    case("turned", "a scene that is turned with camera and lights looks as before", places::turned),
    case(
        "degenerate",
        "no, one, two, collinear, coplanar and coincident surfels give finite pictures",
        places::degenerate,
    ),
    case(
        "damaged",
        "normals, radii, positions and colours from nothing to the largest number give finite pictures",
        places::damaged,
    ),
    case(
        "equal-colours",
        "3000 surfels of one colour in one place have that albedo",
        places::equal_colours,
    ),
    case("occluded", "no and full ambient accessibility give finite pictures", places::occluded),
    case(
        "lights",
        "no light, eight, and ones of no and of extreme radiance or place give finite pictures",
        lights::lights,
    ),
    case(
        "surroundings",
        "light from around, also a sun of 1e5, gives finite pictures",
        lights::surroundings,
    ),
    case(
        "settings",
        "the ends of all settings of the surface give finite pictures",
        params::settings,
    ),
    case(
        "parameters",
        "every parameter at both ends and beyond gives finite pictures",
        params::parameters,
    ),
    case(
        "growth",
        "1,000 frames take no more memory than 100, and compile nothing",
        growth::growth,
    ),
];

fn limits(bench: &mut Bench<'_>) -> Judged {
    limits_name(&bench.unit.description.limits, &cases())
}

pub(crate) fn cases() -> Vec<Case> {
    CASES.iter().map(|(case, _)| *case).collect()
}

pub(crate) fn check(
    unit: &LoadedUnit,
    setup: &Setup<'_>,
    wanted: &dyn Fn(&Case) -> bool,
    tell: &mut dyn FnMut(&Outcome) -> bool,
) -> Result<Vec<Outcome>, String> {
    let mut bench = Bench::new(unit, setup)?;
    let cases: Vec<(Case, Judges<Bench<'_>>)> = CASES.to_vec();
    Ok(run(unit, &cases, wanted, tell, &mut bench))
}
