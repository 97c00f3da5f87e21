//! Which side normals face that were estimated: that of the device which took the scan, where the file says
//! where it stood, and else the one that can be seen.

use super::position::Positions;
use super::trajectory::Trajectory;
use crate::cloud::source::Source;
use crate::memory;
use crate::summary::Summary;
use crate::table::Table;
use glam::{DVec3, Vec3};
use surfelshop_api::format::SCAN;
use surfelshop_geometry::radii::PLANAR;
use surfelshop_geometry::sides::{self, Hints};
use surfelshop_geometry::{Cancelled, Progress};

/// Certainty below which it is a guess which way round a whole scan is.
const GUESS: f32 = 0.2;

/// What is said of such a scan.
pub(super) const GUESS_LINE: &str = "it is a guess which side of the surface was scanned, and all normals may face the other one; \
     the tool `normals` with `orientation=flip` turns them";

/// Confidence from which on a side counts as decided, as [`sides::by_visibility`] counts.
pub(super) const DECIDED: f32 = 0.25;

/// Fewest points of which it is asked what can be seen: fewer make no surface that hides another.
pub(super) const FEWEST: usize = 1000;

/// How many times as many addresses a look around reserves for each byte as other work on several threads: measured
/// 890 MB in all, of which it touched 50 MB.
const ADDRESSES: u64 = 4;

/// Where the devices stood that took a table's points.
pub(super) enum Scanners {
    /// One for each scan, relative to the cloud's origin.
    Still(Vec<Option<DVec3>>),
    /// They moved.
    Moving(Trajectory),
}

impl Scanners {
    /// As the file says, or else as pulses tell that came back several times; `None` where nothing does.
    pub(super) fn of(table: &Table, placed: &Positions, source: &Source) -> Option<Self> {
        if let Some(scanners) = source.scanners() {
            let offset = |place: Option<DVec3>| place.map(|place| place - placed.origin);
            return Some(Self::Still(scanners.into_iter().map(offset).collect()));
        }
        Trajectory::of(table, placed).map(Self::Moving)
    }

    /// For each point where its device was, relative to the cloud's origin.
    fn places<'a>(&'a self, table: &'a Table) -> Box<dyn Iterator<Item = Option<DVec3>> + 'a> {
        match self {
            Self::Still(scanners) => {
                let numbers = table.woven(&[SCAN]).map(|numbers| numbers.iter_f64());
                // Without a column of numbers there is one scan.
                let numbers = numbers.into_iter().flatten().chain(std::iter::repeat(0.0));
                let place = |number: f64| scanners.get(number.max(0.0) as usize).copied().flatten();
                Box::new(numbers.take(table.n_rows).map(place))
            }
            Self::Moving(trajectory) => Box::new(trajectory.places(table)),
        }
    }

    /// Whether they say the side of every normal. Of what moved they say that of surfaces: leaves are no surface, and
    /// face free space, which is around them and not where an aeroplane is.
    fn know_all(&self) -> bool {
        match self {
            Self::Still(scanners) => scanners.iter().all(Option::is_some),
            Self::Moving(_) => false,
        }
    }
}

/// Bytes of addresses that a look around reserves.
pub(super) fn look_around_bytes(n: usize) -> u64 {
    sides::memory(n).saturating_mul(ADDRESSES)
}

/// Whether the side of a table's normals takes a look around, and there is the memory for it.
pub(super) fn looks_around(
    table: &Table,
    scanners: Option<&Scanners>,
    summary: &mut Summary,
) -> bool {
    let n = table.n_rows;
    if n < FEWEST || scanners.is_some_and(Scanners::know_all) {
        return false;
    }
    let has_room = memory::ask_for_threads(look_around_bytes(n)).is_ok();
    if !has_room {
        summary.warnings.push(
            "there is too little memory to find which sides can be seen; normals keep the sides that they were \
             estimated with"
                .to_owned(),
        );
    }
    has_room
}

/// Turns normals towards the device that saw their point; points without one stay as they are, and so do those of no
/// surface where the device moved. `seen` is the confidence that there was before in each side, where there was any.
pub(super) fn face_scanners(
    table: &Table,
    placed: &Positions,
    scanners: &Scanners,
    planarity: &[f32],
    seen: &[f32],
    normals: &mut [Vec3],
    summary: &mut Summary,
) {
    let counts = &mut summary.normals;
    let points = placed.positions.iter().zip(normals).zip(scanners.places(table));
    for (i, ((position, normal), scanner)) in points.enumerate() {
        let is_surface = planarity.get(i).is_none_or(|planarity| *planarity >= PLANAR);
        let counts_here = is_surface || matches!(scanners, Scanners::Still(_));
        let Some(scanner) = scanner.filter(|_| counts_here) else { continue };
        let to_scanner = scanner - position.as_dvec3();
        counts.towards_scanner += 1;
        if let Some(&confidence) = seen.get(i) {
            let before = match confidence >= DECIDED {
                true => &mut counts.towards_free_space,
                false => &mut counts.of_unsure_side,
            };
            *before = before.saturating_sub(1);
        }
        if normal.as_dvec3().dot(to_scanner) < 0.0 {
            *normal = -*normal;
            counts.turned += 1;
        }
    }
    if let Scanners::Moving(trajectory) = scanners {
        summary.trajectory = Some(trajectory.facts);
    }
}

/// Turns normals to the side that can be seen. Where nothing tells which way round the whole is, most normals
/// stay as they were estimated. For each normal, how sure its side is.
///
/// # Errors
/// Where `progress` asks to stop.
pub(super) fn face_what_is_seen(
    placed: &Positions,
    source: &Source,
    normals: &mut [Vec3],
    progress: Progress<'_>,
    summary: &mut Summary,
) -> Result<Vec<f32>, Cancelled> {
    let metres = source.metres().map(|metres| metres as f32);
    let hints = Hints { up: up(source), metres, ..Hints::default() };
    let found = sides::by_visibility(&placed.positions, normals, &hints, progress)?;
    let is_guess = found.certainty < GUESS;
    let mut turned = found.turned;
    if is_guess && 2 * turned > normals.len() {
        // What was estimated has a position and a direction, and so every normal has its side.
        normals.iter_mut().for_each(|normal| *normal = -*normal);
        turned = normals.len() - turned;
    }
    let counts = &mut summary.normals;
    counts.towards_free_space += found.decided as u64;
    counts.of_unsure_side += found.uncertain as u64;
    counts.turned += turned as u64;
    if is_guess {
        summary.warnings.push(GUESS_LINE.to_owned());
    }
    Ok(found.confidence)
}

/// The direction that is up, where the file or how the points lie says so.
fn up(source: &Source) -> Option<Vec3> {
    let said = source.said_up().map(|axis| axis.direction());
    let of_map = || source.is_on_map.then_some(DVec3::Z);
    said.or(source.grid_up).or_else(of_map).map(|up| up.as_vec3())
}
