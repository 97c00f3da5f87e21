//! Checks of tools.

use crate::conformance::clouds::{self, Surfels};
use crate::conformance::hard::{self, Hard};
use crate::conformance::renderers::driven;
use crate::conformance::verdict::{Failure, Judged, Judges, Said, limits_name, run};
use crate::conformance::{Case, Outcome, Setup};
use glam::DVec3;
use std::collections::HashSet;
use std::time::Duration;
use surfelshop_api::columns::{CONTEXT, Values as Numbers};
use surfelshop_api::params::Values;
use surfelshop_api::{Scope, UnitKind};
use surfelshop_cloud::{Buffer, Cloud, Column};
use surfelshop_runtime::boundary::Fault;
use surfelshop_runtime::plugins::LoadedUnit;
use surfelshop_runtime::tools::{Ended, Running, ToolOptions};

type Criteria = fn(&mut Bench<'_>) -> Judged;

const fn case(name: &'static str, about: &'static str, judge: Criteria) -> (Case, Criteria) {
    (Case { kind: UnitKind::Tool, name, about }, judge)
}

const CASES: &[(Case, Criteria)] = &[
    case("limits", "limits that it declares are those of cases that there are", limits),
    case("outputs", "what it makes of a ball is finite, and the ball stays as it was", outputs),
    case("threads", "one thread and three make the same, bit by bit", threads),
    case("again", "a second run makes the same, bit by bit", again),
    case(
        "reordered",
        "each surfel gets what it got in another order of the file, within a thousandth",
        reordered,
    ),
    case(
        "parts",
        "of a tool with a scope: halves of a ball, with the other half around, get what the whole gets, within a thousandth",
        parts,
    ),
    case(
        "degenerate",
        "no, one, two, collinear, coplanar and coincident surfels: done with finite values, or refused in a line",
        degenerate,
    ),
    case(
        "damaged",
        "normals, radii, positions and colours from nothing to the largest number: no hang, no panic",
        damaged,
    ),
    case("moved", "a ball 7 million units away is no other: finite values", moved),
    case(
        "scaled",
        "balls from 1e-30 to 1e30 times the size: finite values, or refused in a line",
        scaled,
    ),
    case(
        "parameters",
        "every parameter at both ends and beyond: finite values, or refused in a line",
        parameters,
    ),
    case("cancel", "it stops when it is asked to, and nothing has changed", cancel),
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
) -> Vec<Outcome> {
    let mut bench = Bench { unit, setup };
    let cases: Vec<(Case, Judges<Bench<'_>>)> = CASES.to_vec();
    run(unit, &cases, wanted, tell, &mut bench)
}

struct Bench<'a> {
    unit: &'a LoadedUnit,
    setup: &'a Setup<'a>,
}

/// How long a tool may work on a few hundred surfels.
const LONGEST: Duration = Duration::from_secs(60);
/// How long it is waited for with a parameter at its end, which may ask for any amount of work: what
/// takes longer must stop when it is asked to.
const LONG_ENOUGH: Duration = Duration::from_secs(2);

/// What came of a run.
enum Ran {
    /// The cloud with its edits; itself where there were none.
    Made(Box<Cloud>),
    Refused(String),
    /// It stopped when it was asked to, after it had worked long enough.
    Stopped,
}

impl Bench<'_> {
    fn start(&self, cloud: &Cloud, values: &Values, threads: usize) -> Result<Running, Failure> {
        let (patience, device) = (self.setup.patience, self.setup.device.clone());
        let options = ToolOptions { patience, threads, device: device.into() };
        Running::start(self.unit, values, cloud, &options).map_err(|fault| failed(&fault))
    }

    /// Runs to the end. Fails where it hangs, panics or misbehaves; an error of its own is a refusal.
    fn run(&self, cloud: &Cloud, values: &Values, threads: usize) -> Result<Ran, Failure> {
        match self.run_for(LONGEST, cloud, values, threads)? {
            Ran::Stopped => {
                let line = format!("it works longer than {} s", LONGEST.as_secs());
                Err(Failure::fault(line))
            }
            ran => Ok(ran),
        }
    }

    /// The same, asked to stop after some time.
    fn run_for(
        &self,
        time: Duration,
        cloud: &Cloud,
        values: &Values,
        threads: usize,
    ) -> Result<Ran, Failure> {
        let mut running = self.start(cloud, values, threads)?;
        let (ended, stops) = match running.wait(time) {
            Some(ended) => (ended, false),
            None => {
                running.cancel();
                let longest = self.setup.patience.cancel + Duration::from_secs(1);
                let ended = running.wait(longest);
                (ended.unwrap_or(Ended::LeftBehind(self.setup.patience.cancel)), true)
            }
        };
        match ended {
            Ended::Cancelled if stops => Ok(Ran::Stopped),
            Ended::Done(done) => {
                let made = done.edited.map_or_else(|| cloud.clone(), |edited| edited.cloud);
                Ok(Ran::Made(Box::new(made)))
            }
            Ended::Failed(Fault::Error(line)) => Ok(Ran::Refused(line)),
            Ended::Failed(fault) => Err(failed(&fault)),
            Ended::Cancelled => Err(Failure::new("it stopped without being asked to")),
            Ended::LeftBehind(_) => Err(Failure::silence("it does not stop")),
        }
    }

    /// The same for a cloud that no tool refuses.
    fn made(&self, cloud: &Cloud, threads: usize) -> Result<Cloud, Failure> {
        match self.run(cloud, &Values::new(), threads)? {
            Ran::Made(cloud) => Ok(*cloud),
            Ran::Refused(line) => Err(Failure::new(format!("it refused a ball: {line}"))),
            Ran::Stopped => Err(Failure::new("it stopped")),
        }
    }
}

fn failed(fault: &Fault) -> Failure {
    let is_silent = matches!(fault, Fault::TimedOut(_));
    Failure { is_silent, ..Failure::fault(fault.to_string()) }
}

/// A ball with colours and accessibility, and with triangles: some tools read them.
fn ball_of(change: impl Fn(Surfels) -> Surfels) -> Cloud {
    let (mut surfels, faces) = clouds::globe(20, 30);
    surfels.ao = vec![0.5; surfels.positions.len()];
    let cloud = change(surfels).cloud();
    with_faces(cloud, faces)
}

/// # Panics
/// Where a triangle names a surfel that is not there.
fn with_faces(cloud: Cloud, faces: Vec<[u32; 3]>) -> Cloud {
    cloud.with_faces(faces).expect("generated triangles fit")
}

fn ball() -> Cloud {
    ball_of(|surfels| surfels)
}

/// The same with its surfels in another order.
fn shuffled_ball() -> Cloud {
    let (mut surfels, mut faces) = clouds::globe(20, 30);
    surfels.ao = vec![0.5; surfels.positions.len()];
    let to = hard::shuffled_to(surfels.positions.len());
    faces.iter_mut().for_each(|face| *face = face.map(|corner| to[corner as usize]));
    let cloud = hard::shuffled(&surfels).cloud();
    with_faces(cloud, faces)
}

/// Columns of floats with values that are no numbers.
fn odd(cloud: &Cloud) -> Vec<String> {
    let is_odd = |values: Numbers<'_>| match values {
        Numbers::F32(values) => values.iter().any(|value| !value.is_finite()),
        _ => false,
    };
    let columns = cloud.columns().iter();
    let odd = columns.filter(|column| is_odd(column.values().as_values()));
    odd.map(|column| column.name().to_owned()).collect()
}

fn finite(ran: Ran) -> Result<(), Failure> {
    let Ran::Made(cloud) = ran else { return Ok(()) };
    match odd(&cloud).as_slice() {
        [] => Ok(()),
        names => Err(Failure::new(format!("values of {} are no numbers", names.join(", ")))),
    }
}

/// The bytes of all columns with their names.
fn contents(cloud: &Cloud) -> Vec<(String, String)> {
    let columns = cloud.columns().iter();
    columns.map(|c| (c.name().to_owned(), format!("{:?}", c.values()))).collect()
}

fn outputs(bench: &mut Bench<'_>) -> Judged {
    let cloud = ball();
    let before = contents(&cloud);
    let made = bench.made(&cloud, 0)?;
    finite(Ran::Made(Box::new(made.clone())))?;
    if contents(&cloud) != before {
        return Err(Failure::new("the cloud it worked on has changed"));
    }
    let names: Vec<&str> = made.columns().iter().map(|column| column.name()).collect();
    Ok(Said::Measured(format!("{} surfels with {}", made.len(), names.join(", "))))
}

fn equal(bench: &Bench<'_>, threads: [usize; 2]) -> Judged {
    let cloud = ball();
    let [a, b] = threads.map(|threads| bench.made(&cloud, threads));
    match contents(&a?) == contents(&b?) {
        true => Ok(Said::Measured("the same".to_owned())),
        false => Err(Failure::new("the results differ")),
    }
}

fn threads(bench: &mut Bench<'_>) -> Judged {
    equal(bench, [1, 3])
}

fn again(bench: &mut Bench<'_>) -> Judged {
    equal(bench, [2, 2])
}

/// Numbers of a column, with what is one step between two of them: nothing for floats, whose steps are
/// shares of them.
fn numbers(column: &Column) -> (Vec<f64>, f64) {
    fn floats<T: Copy + Into<f64>>(values: &[T]) -> Vec<f64> {
        values.iter().map(|value| (*value).into()).collect()
    }
    match column.values().as_values() {
        Numbers::I8(values) => (floats(values), 1.0),
        Numbers::U8(values) => (floats(values), 1.0),
        Numbers::I16(values) => (floats(values), 1.0),
        Numbers::U16(values) => (floats(values), 1.0),
        Numbers::I32(values) => (floats(values), 1.0),
        Numbers::U32(values) => (floats(values), 1.0),
        Numbers::F32(values) => (floats(values), 0.0),
        Numbers::F64(values) => (values.to_vec(), 0.0),
    }
}

/// Places of surfels, by their bits, with values.
type ByPlace = Vec<([u32; 3], Vec<f64>)>;

/// A column's values by the surfels' places, and what is one step of them.
fn by_place(cloud: &Cloud, column: &Column) -> (ByPlace, f64) {
    let (values, step) = numbers(column);
    let n = column.components().max(1) as usize;
    let places = cloud.positions().iter().map(|place| place.to_array().map(f32::to_bits));
    let mut all: Vec<_> = places.zip(values.chunks_exact(n).map(<[f64]>::to_vec)).collect();
    all.sort_by_key(|(place, _)| *place);
    (all, step)
}

/// Surfels of one cloud at places where another has none.
fn strangers(of: &Cloud, among: &Cloud) -> usize {
    let places = |cloud: &Cloud| -> Vec<[u32; 3]> {
        cloud.positions().iter().map(|place| place.to_array().map(f32::to_bits)).collect()
    };
    let known: HashSet<[u32; 3]> = places(among).into_iter().collect();
    places(of).iter().filter(|place| !known.contains(*place)).count()
}

fn reordered(bench: &mut Bench<'_>) -> Judged {
    let here = bench.made(&ball(), 2)?;
    let there = bench.made(&shuffled_ball(), 2)?;
    let others = strangers(&here, &there).max(strangers(&there, &here));
    if others > 0 || here.len() != there.len() {
        let most = here.len().max(there.len());
        let line = format!("{others} of {most} surfels that are left are others");
        return Err(Failure::new(line).counting(others, most));
    }
    alike(&here, &there, "in another order")
}

/// Whether two clouds of the same surfels have the same values, within a thousandth.
fn alike(here: &Cloud, there: &Cloud, how: &str) -> Judged {
    let mut worst = 0.0f64;
    for column in here.columns() {
        let name = column.name();
        let Some(other) = there.column(name) else {
            return Err(Failure::new(format!("there is no column `{name}` {how}")));
        };
        let ((a, step), (b, _)) = (by_place(here, column), by_place(there, other));
        let mut wrong = 0;
        for ((_, a), (_, b)) in a.iter().zip(&b) {
            let off = |(a, b): (&f64, &f64)| {
                let scale = a.abs().max(b.abs()).max(1e-3);
                // What is rounded to whole steps may fall to either side.
                if (a - b).abs() <= step { 0.0 } else { (a - b).abs() / scale }
            };
            let most = a.iter().zip(b).map(off).fold(0.0, f64::max);
            worst = worst.max(most);
            // Sums in another order: sqrt(n) units in the last place, and what is decided by a hair.
            wrong += usize::from(most > 1e-3);
        }
        if wrong > 0 {
            let line =
                format!("`{name}` differs by up to {worst:.3} of its values at {wrong} surfels");
            return Err(Failure::new(line).counting(wrong, a.len()));
        }
    }
    Ok(Said::Measured(format!("values differ by at most {worst:.1e} of themselves")))
}

/// One half of the ball, by x, with the other half behind it as what is around; of the surfels that the tool leaves
/// those of the half itself.
fn half(bench: &Bench<'_>, ball: &Cloud, right: bool) -> Result<Option<Cloud>, Failure> {
    let own: Vec<bool> = ball.positions().iter().map(|at| (at.x >= 0.0) == right).collect();
    let is_around = bench.unit.description.scope != Scope::Surfel;
    let rows = |wanted: bool| (0u32..).zip(&own).filter(move |(_, own)| **own == wanted);
    let n_own = rows(true).count();
    let order: Vec<u32> =
        rows(true).chain(rows(false).filter(|_| is_around)).map(|(row, _)| row).collect();
    let fault = |line: String| Failure::fault(line);
    let mut columns = Vec::new();
    for column in ball.columns() {
        let values = column.values().gather(column.components() as usize, &order);
        let values = values.map_err(|error| fault(error.to_string()))?;
        columns.push(Column::new(column.name(), column.components(), values));
    }
    let mut is_context = vec![0; n_own];
    is_context.resize(order.len(), 1);
    columns.push(Column::new(CONTEXT, 1, Buffer::U8(is_context)));
    let cloud = Cloud::new(ball.origin(), columns).map_err(|error| fault(error.to_string()))?;
    let made = bench.made(&cloud.with_object(ball.object()), 2)?;
    let Some(Buffer::U8(context)) = made.column(CONTEXT).map(Column::values) else {
        return Ok(None);
    };
    let mask: Vec<bool> = context.iter().map(|&context| context == 0).collect();
    let kept = made.without_column(CONTEXT).keep(&mask);
    kept.map(Some).map_err(|error| fault(error.to_string()))
}

fn parts(bench: &mut Bench<'_>) -> Judged {
    if bench.unit.description.scope == Scope::Cloud {
        return Ok(Said::LeftOut("it sees a cloud as a whole".to_owned()));
    }
    let (mut surfels, _) = clouds::globe(20, 30);
    surfels.ao = vec![0.5; surfels.positions.len()];
    let ball = surfels.cloud();
    let whole = bench.made(&ball, 2)?;
    let mut said = None;
    for right in [false, true] {
        let Some(made) = half(bench, &ball, right)? else {
            return Ok(Said::LeftOut("it makes a cloud of its own".to_owned()));
        };
        let mask: Vec<bool> = whole.positions().iter().map(|at| (at.x >= 0.0) == right).collect();
        let expected = whole.keep(&mask).map_err(|error| Failure::fault(error.to_string()))?;
        let others = strangers(&made, &expected).max(strangers(&expected, &made));
        if others > 0 || made.len() != expected.len() {
            let most = made.len().max(expected.len());
            let line = format!("{others} of {most} surfels that are left are others");
            return Err(Failure::new(line).counting(others, most));
        }
        said = Some(alike(&expected, &made, "where there are parts")?);
    }
    Ok(said.unwrap_or_else(|| Said::LeftOut("there are no parts".to_owned())))
}

/// Runs over clouds; values must be finite where those of the cloud are.
fn over(bench: &Bench<'_>, clouds: Vec<Hard>) -> Judged {
    let (n, mut refused) = (clouds.len(), Vec::new());
    for (what, cloud) in clouds {
        let ran = bench.run(&cloud, &Values::new(), 2).map_err(|failure| failure.of(what))?;
        match &ran {
            Ran::Refused(line) => refused.push(format!("{what}: {line}")),
            Ran::Made(_) if odd(&cloud).is_empty() => {
                finite(ran).map_err(|failure| failure.of(what))?;
            }
            Ran::Made(_) | Ran::Stopped => {}
        }
    }
    Ok(Said::Measured(match refused.len() {
        0 => format!("{n} clouds"),
        _ => {
            let first = refused.first().cloned().unwrap_or_default();
            format!("{n} clouds, refused {}, such as {first}", refused.len())
        }
    }))
}

fn degenerate(bench: &mut Bench<'_>) -> Judged {
    over(bench, hard::degenerate())
}

fn damaged(bench: &mut Bench<'_>) -> Judged {
    over(bench, hard::damaged())
}

fn moved(bench: &mut Bench<'_>) -> Judged {
    let at = |origin| ball_of(|surfels| Surfels { origin, ..surfels });
    let clouds = [("7 million away", hard::FAR), ("1e12 away", DVec3::splat(1e12))];
    over(bench, clouds.map(|(what, origin)| (what, at(origin))).to_vec())
}

fn scaled(bench: &mut Bench<'_>) -> Judged {
    let names = ["1e-6", "1e6", "1e-15", "1e15", "1e-30", "1e30"];
    let sized = hard::SIZES.map(|factor| ball_of(|surfels| hard::sized(&surfels, factor)));
    over(bench, names.into_iter().zip(sized).collect())
}

fn parameters(bench: &mut Bench<'_>) -> Judged {
    let cloud = ball();
    let declared = bench.unit.description.params.clone();
    let (mut n, mut n_refused, mut n_stopped) = (0, 0, 0);
    for declared in &declared {
        for value in driven(declared) {
            let what = format!("{}={value:?}", declared.id);
            let values = Values::from([(declared.id.clone(), value)]);
            n += 1;
            let ran = bench.run_for(LONG_ENOUGH, &cloud, &values, 2);
            match ran {
                // A refusal is none of these.
                Err(failure) => return Err(failure.of(&what)),
                Ok(ran) => {
                    n_refused += u32::from(matches!(ran, Ran::Refused(_)));
                    n_stopped += u32::from(matches!(ran, Ran::Stopped));
                    finite(ran).map_err(|failure| failure.of(&what))?;
                }
            }
        }
    }
    match declared.len() {
        0 => Ok(Said::LeftOut("it has no parameters".to_owned())),
        _ => Ok(Said::Measured(format!(
            "{n} values, {n_refused} refused in a line, {n_stopped} stopped when asked"
        ))),
    }
}

/// How long it works before it is asked to stop.
const WORKED: Duration = Duration::from_millis(5);

fn cancel(bench: &mut Bench<'_>) -> Judged {
    let (surfels, faces) = clouds::globe(200, 300);
    let cloud = surfels.cloud();
    let cloud = with_faces(cloud, faces);
    let before = contents(&cloud);
    let mut running = bench.start(&cloud, &Values::new(), 0)?;
    let ended = running.wait(WORKED);
    let was_early = ended.is_some();
    running.cancel();
    let longest = bench.setup.patience.cancel + Duration::from_secs(1);
    let ended = ended.or_else(|| running.wait(longest));
    if contents(&cloud) != before {
        return Err(Failure::fault("the cloud it worked on has changed"));
    }
    match ended {
        None | Some(Ended::LeftBehind(_)) => Err(Failure::silence("it does not stop")),
        Some(Ended::Failed(Fault::Error(line))) => Ok(Said::LeftOut(format!("it refused: {line}"))),
        Some(Ended::Failed(fault)) => Err(failed(&fault)),
        Some(Ended::Cancelled) => Ok(Said::Measured("it stopped".to_owned())),
        Some(Ended::Done(_)) if was_early => {
            Ok(Said::LeftOut("it ended before it was asked to stop".to_owned()))
        }
        Some(Ended::Done(_)) => Ok(Said::Measured("it ended soon after it was asked".to_owned())),
    }
}
