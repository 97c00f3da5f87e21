//! Which side normals of a part of a cloud face, by a sample of the whole: a part alone does not show what can be seen.

use super::map;
use super::position::{self, Positions};
use super::sides::{self, GUESS_LINE};
use crate::cloud::source::Source;
use crate::error::ReadFault;
use crate::memory;
use crate::options::ReadOptions;
use crate::summary::Summary;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use surfelshop_geometry::{Bounds, Neighbours, normals, part};

/// Sides that can be seen, at a sample of a cloud's points.
#[derive(Clone, Debug, PartialEq)]
pub struct SideGuide {
    /// What positions are relative to.
    origin: DVec3,
    positions: Vec<Vec3>,
    /// Unit length, each facing its side; zero where there is no direction.
    normals: Vec<Vec3>,
    /// How sure each side is, in [0, 1].
    confidence: Vec<f32>,
    /// Whether it is a guess which way round the whole is.
    is_guess: bool,
}

/// Numbers of a sample point, 4 bytes each.
const NUMBERS: usize = 7;
/// Bytes before them: the origin, and whether all is a guess.
const HEAD: usize = 25;

/// Sample points that a cell holds, about, where they lie on a plane.
const PER_CELL: f64 = 4.0;
/// Sample points of a cell that are asked at most.
const MOST_PER_CELL: usize = 32;
/// Fewer sample points around do not decide where coarser cells hold more.
const FEW: usize = 4;
/// Cells of the next coarser grid have edges so many times as long.
const COARSER: f64 = 4.0;
/// Grids; the coarsest has cells of 256 times the finest edge, which span a part of 16,000 sample points.
const GRIDS: usize = 5;
/// How much farther away, squared, what lies beside the tangent plane counts: the other face of a wall is nearer than the
/// next sample point of this one where the sample is coarse.
const BESIDE: f64 = 16.0;
/// Squared share of an edge below which distances make no difference.
const NEAR: f64 = 0.0025;

impl SideGuide {
    /// Whether sides of a cloud without normals depend on what can be seen: not where each scan's device is known.
    #[must_use]
    pub fn is_needed(source: &Source) -> bool {
        source.scanners().is_none_or(|scanners| scanners.iter().any(Option::is_none))
    }

    /// Finds the sides of a sample, finite places spread over the cloud as its points are; `None` where they are too few
    /// to hide each other, or there is too little memory.
    ///
    /// # Errors
    /// Where the options ask to stop.
    pub fn of(
        points: &[DVec3],
        source: &Source,
        options: &ReadOptions<'_>,
    ) -> Result<Option<Self>, ReadFault> {
        let progress = options.progress;
        let room = sides::look_around_bytes(points.len());
        if points.len() < sides::FEWEST || memory::ask_for_threads(room).is_err() {
            return Ok(None);
        }
        let Some(middle) = position::middle(points) else { return Ok(None) };
        let placed = position::placed(middle, points.iter().copied());
        let is_on_map = map::is_on_map(placed.origin, &placed.positions, source);
        let source = &Source { is_on_map, ..source.clone() };
        let neighbours = Neighbours::build(&placed.positions, &part(progress, 0.0..0.05))?;
        let found =
            normals::estimate_with(&neighbours, options.n_neighbours, &part(progress, 0.05..0.5))?;
        drop(neighbours);
        let (mut normals, mut summary) = (found.normals, Summary::default());
        let seeing = part(progress, 0.5..1.0);
        let confidence =
            sides::face_what_is_seen(&placed, source, &mut normals, &seeing, &mut summary)?;
        let is_guess = summary.warnings.iter().any(|line| line == GUESS_LINE);
        let Positions { origin, positions, .. } = placed;
        Ok(Some(Self { origin, positions, normals, confidence, is_guess }))
    }

    /// Turns normals of a part to the sides of the sample around them. For each normal, how sure its side is, in [0, 1].
    pub(super) fn face(
        &self,
        placed: &Positions,
        normals: &mut [Vec3],
        summary: &mut Summary,
    ) -> Vec<f32> {
        let offset = placed.origin - self.origin;
        let place = |at: Vec3| at.as_dvec3() + offset;
        let grids = self.grids(placed.bounds, offset);
        let finest = grids.first();
        let cell = |i: usize| finest.map_or([0; 3], |grid| grid.cell(place(placed.positions[i])));
        let mut order: Vec<([i32; 3], u32)> =
            (0..normals.len()).into_par_iter().map(|i| (cell(i), i as u32)).collect();
        order.par_sort_unstable();
        let groups: Vec<&[([i32; 3], u32)]> = order.chunk_by(|a, b| a.0 == b.0).collect();
        let given: &[Vec3] = normals;
        let votes: Vec<Vec<(u32, f64)>> = groups
            .into_par_iter()
            .map(|group| {
                let middle = finest.map_or(DVec3::ZERO, |grid| grid.middle(group[0].0));
                let (edge, around) = asked(&grids, middle);
                let vote = |&(_, i): &([i32; 3], u32)| {
                    let at = place(placed.positions[i as usize]);
                    (i, self.vote(&around, edge, at, given[i as usize].as_dvec3()))
                };
                group.iter().map(vote).collect()
            })
            .collect();
        let mut confidence = vec![0.0; normals.len()];
        let counts = &mut summary.normals;
        for (i, vote) in votes.into_iter().flatten() {
            let i = i as usize;
            confidence[i] = vote.abs() as f32;
            match confidence[i] >= sides::DECIDED {
                true => counts.towards_free_space += 1,
                false => counts.of_unsure_side += 1,
            }
            if vote < 0.0 {
                normals[i] = -normals[i];
                counts.turned += 1;
            }
        }
        if self.is_guess {
            summary.warnings.push(GUESS_LINE.to_owned());
        }
        confidence
    }

    /// How much of what is near says that a normal has its side already, in [-1, 1]; 0 where nothing is near.
    fn vote(&self, around: &[u32], edge: f64, at: DVec3, normal: DVec3) -> f64 {
        let (mut sum, mut all) = (0.0, 0.0);
        for &i in around {
            let i = i as usize;
            let away = (at - self.positions[i].as_dvec3()) / edge;
            let beside = away.dot(normal);
            let weight = 1.0 / (away.length_squared() + BESIDE * beside * beside + NEAR).powi(2);
            let along = weight * normal.dot(self.normals[i].as_dvec3());
            if along.is_finite() {
                sum += along * f64::from(self.confidence[i]);
                all += along.abs();
            }
        }
        if all > 0.0 { sum / all } else { 0.0 }
    }

    /// The sample in and around a part, in cells from fine to coarse; none where there is no such point.
    fn grids(&self, bounds: Option<Bounds>, offset: DVec3) -> Vec<Grid> {
        let Some(Bounds { min, max }) = bounds else { return Vec::new() };
        let slack = DVec3::splat(0.1 * (max - min).max_element());
        let [low, high] = [min + offset - slack, max + offset + slack];
        let is_near = |at: &Vec3| {
            let at = at.as_dvec3();
            at.cmpge(low).all() && at.cmple(high).all()
        };
        let near: Vec<u32> = (0..self.positions.len() as u32)
            .filter(|&i| is_near(&self.positions[i as usize]))
            .collect();
        let mut extents = (high - low).to_array();
        extents.sort_unstable_by(f64::total_cmp);
        let edge = (PER_CELL * extents[1] * extents[2] / near.len() as f64).sqrt();
        // What is a line or a point has cells along its extent.
        let edge = edge.max(extents[2] / 1e6);
        if near.is_empty() || !(edge.is_finite() && edge > 0.0) {
            return Vec::new();
        }
        let grid = |level: usize| {
            let edge = edge * COARSER.powi(level as i32);
            let mut grid = Grid { low, edge, cells: Vec::new() };
            let cells = near.iter().map(|&i| (grid.cell(self.positions[i as usize].as_dvec3()), i));
            grid.cells = cells.collect();
            grid.cells.sort_unstable();
            grid
        };
        (0..GRIDS).map(grid).collect()
    }

    /// As bytes that [`Self::from_bytes`] reads, little-endian.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(HEAD + 4 * NUMBERS * self.positions.len());
        bytes.extend(self.origin.to_array().iter().flat_map(|number| number.to_le_bytes()));
        bytes.push(u8::from(self.is_guess));
        let points = self.positions.iter().zip(&self.normals).zip(&self.confidence);
        for ((position, normal), confidence) in points {
            let numbers = position.to_array().into_iter().chain(normal.to_array());
            let numbers = numbers.chain([*confidence]);
            bytes.extend(numbers.flat_map(f32::to_le_bytes));
        }
        bytes
    }

    /// What [`Self::to_bytes`] made; `None` for other bytes.
    #[must_use]
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (head, points) = bytes.split_at_checked(HEAD)?;
        let (origin, is_guess) = head.split_at(HEAD - 1);
        let origin: Vec<f64> =
            origin.as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
        let (points, rest) = points.as_chunks::<{ 4 * NUMBERS }>();
        if !rest.is_empty() {
            return None;
        }
        let mut guide = Self {
            origin: DVec3::from_slice(&origin),
            positions: Vec::with_capacity(points.len()),
            normals: Vec::with_capacity(points.len()),
            confidence: Vec::with_capacity(points.len()),
            is_guess: is_guess == [1],
        };
        for point in points {
            let [x, y, z, u, v, w, confidence] = std::array::from_fn(|i| {
                f32::from_le_bytes(std::array::from_fn(|j| point[4 * i + j]))
            });
            guide.positions.push(Vec3::new(x, y, z));
            guide.normals.push(Vec3::new(u, v, w));
            guide.confidence.push(confidence);
        }
        Some(guide)
    }
}

/// Sample points by cells of one size, relative to the origin of the sample.
struct Grid {
    low: DVec3,
    edge: f64,
    /// In order.
    cells: Vec<([i32; 3], u32)>,
}

impl Grid {
    fn cell(&self, at: DVec3) -> [i32; 3] {
        ((at - self.low) / self.edge).floor().as_ivec3().to_array()
    }

    fn middle(&self, cell: [i32; 3]) -> DVec3 {
        let [x, y, z] = cell.map(|number| f64::from(number) + 0.5);
        self.low + DVec3::new(x, y, z) * self.edge
    }

    /// Sample points in the cell of a place and in those that touch it.
    fn around(&self, at: DVec3) -> Vec<u32> {
        let [x, y, z] = self.cell(at);
        let mut found = Vec::new();
        for (i, j) in (-1..=1).flat_map(|i| (-1..=1).map(move |j| (i, j))) {
            for k in -1..=1 {
                let cell = [x.saturating_add(i), y.saturating_add(j), z.saturating_add(k)];
                let start = self.cells.partition_point(|(known, _)| *known < cell);
                let rest = &self.cells[start..];
                let inside = &rest[..rest.partition_point(|(known, _)| *known <= cell)];
                let every = inside.len().div_ceil(MOST_PER_CELL).max(1);
                found.extend(inside.iter().step_by(every).map(|(_, i)| *i));
            }
        }
        found
    }
}

/// The sample points that decide in a cell around a place, from the finest grid with enough of them, and its edge.
fn asked(grids: &[Grid], middle: DVec3) -> (f64, Vec<u32>) {
    let mut best = (1.0, Vec::new());
    for grid in grids {
        let found = grid.around(middle);
        if found.len() > best.1.len() {
            best = (grid.edge, found);
        }
        if best.1.len() >= FEW {
            break;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_api::format::UpAxis;

    /// Points of the six faces of a room, and the middle of it.
    fn room(low: DVec3, size: DVec3, n: usize) -> (Vec<DVec3>, DVec3) {
        // Fractions of multiples of irrational numbers lie evenly.
        let fraction = |i: usize, step: f64| (i as f64 * step).fract();
        let point = |i: usize| {
            let axis = i % 3;
            let mut at = DVec3::new(
                fraction(i, 0.754_877_666),
                fraction(i, 0.569_840_291),
                fraction(i, 0.414_213_562),
            );
            at[axis] = f64::from(u8::from((i / 3).is_multiple_of(2)));
            low + at * size
        };
        ((0..n).map(point).collect(), low + 0.5 * size)
    }

    #[test]
    fn a_part_of_rooms_faces_the_room_that_it_is_of() {
        // 0.3 s. The wall between the rooms is as thick as the sample is coarse.
        let size = DVec3::new(4.0, 3.0, 2.5);
        let (mut points, middle) = room(DVec3::ZERO, size, 20_000);
        let (others, other) = room(DVec3::new(4.1, 0.0, 0.0), size, 20_000);
        points.extend(&others);
        let up = Source { up: UpAxis::Z, ..Source::default() };
        let sample: Vec<DVec3> = points.iter().copied().step_by(7).collect();
        let guide = SideGuide::of(&sample, &up, &ReadOptions::default()).unwrap().unwrap();
        assert_eq!(SideGuide::from_bytes(&guide.to_bytes()).as_ref(), Some(&guide));
        assert_eq!(SideGuide::from_bytes(&guide.to_bytes()[1..]), None);
        // A part around the wall, with another origin, whose normals have any sign.
        let is_near = |at: &DVec3| (at.x - 4.05).abs() < 0.5;
        let part: Vec<DVec3> = points.into_iter().filter(is_near).collect();
        let placed = position::placed(DVec3::new(4.0, 1.0, 1.0), part.iter().copied());
        let neighbours =
            Neighbours::build(&placed.positions, &surfelshop_geometry::silent).unwrap();
        let found = normals::estimate_with(&neighbours, 16, &surfelshop_geometry::silent).unwrap();
        let mut normals = found.normals;
        normals.iter_mut().step_by(3).for_each(|normal| *normal = -*normal);
        let mut summary = Summary::default();
        let confidence = guide.face(&placed, &mut normals, &mut summary);
        let inside = |at: &DVec3| if at.x < 4.05 { middle } else { other };
        let is_right =
            |(at, normal): (&DVec3, &Vec3)| normal.as_dvec3().dot(inside(at) - *at) > 0.0;
        // At edges a plane through neighbours on both faces may be one that both sides of look into the room. 16
        // neighbours are within 0.12.
        let is_at_edge = |at: &DVec3| {
            let to_faces = (0.5 * size - (*at - inside(at)).abs()).to_array();
            to_faces.into_iter().filter(|distance| *distance < 0.12).count() > 1
        };
        let pairs = || part.iter().zip(&normals);
        let n_wrong = pairs().filter(|pair| !is_at_edge(pair.0) && !is_right(*pair)).count();
        assert_eq!(n_wrong, 0, "of {}", part.len());
        let n_wrong = pairs().filter(|pair| !is_right(*pair)).count();
        assert!(n_wrong * 100 < part.len(), "{n_wrong} of {}", part.len());
        let n_sure = confidence.iter().filter(|sure| **sure >= sides::DECIDED).count() as u64;
        let counts = summary.normals;
        assert_eq!(counts.towards_free_space, n_sure);
        assert_eq!(counts.towards_free_space + counts.of_unsure_side, part.len() as u64);
        // As sure as the sample around the wall, about.
        let x = |at: &Vec3| f64::from(at.x) + guide.origin.x;
        let sample = guide.positions.iter().zip(&guide.confidence);
        let sample: Vec<f32> =
            sample.filter(|(at, _)| (x(at) - 4.05).abs() < 0.5).map(|(_, sure)| *sure).collect();
        let n_sample_sure = sample.iter().filter(|sure| **sure >= sides::DECIDED).count();
        let [share, of_sample] =
            [n_sure as f64 / part.len() as f64, n_sample_sure as f64 / sample.len() as f64];
        assert!((share - of_sample).abs() < 0.1 && share > 0.5, "{share} {of_sample}");
    }
}
