//! The Voronoi cell of each point in its tangent plane, and the disc that covers it.

use super::PLANAR;
use crate::cell::{Cell, Near};
use crate::neighbours::{Found, Neighbours, Shared};
use crate::normals::is_valid;
use crate::progress::{Cancelled, Progress, map, map_with};
use glam::Vec3;

/// Neighbours that bound a point's cell. In a random sampling a corner of a cell lies farther away
/// than the 20th neighbour with probability e^-20, so that practically every corner is found.
pub(super) const CELL_NEIGHBOURS: usize = 20;

/// Those that bound it where a side is open after that: at a border, or where rows of points are far apart.
const FURTHER_NEIGHBOURS: usize = 60;

/// Factor on the radius of a cell. On a sphere the disc at angle p has to reach to the tangent of
/// p / 2 where half the chord to the neighbour is its sine; the ratio is 1.14 for neighbours one
/// radian apart and less for all finer samplings.
pub(crate) const COVER: f64 = 1.15;

/// Nearest points that a point is grouped and compared with: the first ring of a square grid.
pub(super) const COMPARED: usize = 8;

/// Points whose distances say how far apart those of no surface are.
const SCATTERED: usize = 4;

/// Shares of that distance that splats of no surface have as radius: they just touch where there is no plane at all,
const TOUCHING: f64 = 0.5;
/// and cover what may be a rough surface just below the least planarity of one.
const COVERING: f64 = 1.5;
/// Planarity over which it goes from one to the other.
const FADE: f64 = 0.1;

/// A point's covering radius and how it was found; lengths in units of the search. There is one for each point, so
/// that it is packed.
#[derive(Clone, Copy, Debug)]
#[repr(C, packed(2))]
pub(super) struct Cover {
    /// The bits of the radius, of which the last two tell the kind.
    radius: u32,
    /// Distance of the last of the first ring of points around.
    ring: f32,
    /// The upper half of the bits of the distance of the farthest of the nearest, rounded up.
    farthest: u16,
}

impl Cover {
    fn new(radius: f32, farthest: f32, ring: f32, kind: Kind) -> Self {
        let farthest = (farthest.to_bits().saturating_add(0xffff) >> 16) as u16;
        let mut cover = Self { radius: kind as u32, ring, farthest };
        cover.set_radius(radius);
        cover
    }

    /// Distance of the last of the first ring of points around.
    pub(super) fn ring(self) -> f32 {
        self.ring
    }

    /// Distance of the farthest of the nearest, or up to a hundredth more.
    pub(super) fn farthest(self) -> f32 {
        f32::from_bits(u32::from(self.farthest) << 16)
    }

    /// 0 where the point is alone; exact to a millionth.
    pub(super) fn radius(self) -> f32 {
        f32::from_bits(self.radius & !3)
    }

    pub(super) fn set_radius(&mut self, radius: f32) {
        self.radius = radius.to_bits() & !3 | self.radius & 3;
    }

    pub(super) fn kind(self) -> Kind {
        [Kind::Closed, Kind::Wide, Kind::Open, Kind::Scattered][(self.radius & 3) as usize]
    }
}

/// What bounds a point's cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Evenly spaced points on all sides.
    Closed,
    /// Points on all sides, but the disc is larger than the first ring, or there is a gap to most of them.
    Wide,
    /// There is a side without points: a border.
    Open,
    /// There is no surface.
    Scattered,
}

/// Points and what is known of their surface.
pub(super) struct Surface<'a> {
    pub(super) neighbours: &'a Neighbours,
    /// By index, as it is given.
    planarity: &'a [f32],
    /// Normals by place, so that those of the points around one lie together, in shares of the largest number: exact to 0.4
    /// degrees, which turns a cell but hardly changes its size.
    facing: Vec<[i8; 3]>,
}

/// Scratch for the work on a point.
#[derive(Default)]
pub(super) struct Bench {
    close: Shared,
    farther: Shared,
    near: Vec<Near>,
    cell: Option<Cell>,
}

impl<'a> Surface<'a> {
    pub(super) fn of(
        neighbours: &'a Neighbours,
        normals: &[Vec3],
        planarity: &'a [f32],
        progress: Progress<'_>,
    ) -> Result<Self, Cancelled> {
        // Casts cut off; to round is a call on machines that have no instruction for it.
        let rounded = |part: f32| part + 0.5f32.copysign(part);
        let facing = map(neighbours.n_distinct(), progress, |place| {
            let normal = normals.get(neighbours.index(place)).copied();
            let normal = normal.filter(|&normal| is_valid(normal)).unwrap_or(Vec3::Z);
            normal.to_array().map(|part| rounded(part * f32::from(i8::MAX)) as i8)
        })?;
        Ok(Self { neighbours, planarity, facing })
    }

    fn normal(&self, place: usize) -> Vec3 {
        Vec3::from_array(self.facing[place].map(f32::from)) * (1.0 / f32::from(i8::MAX))
    }

    pub(super) fn planarity(&self, place: usize) -> f32 {
        self.planarity.get(self.neighbours.index(place)).copied().unwrap_or(1.0)
    }

    /// Covers the cell of each point.
    pub(super) fn cover_all(&self, progress: Progress<'_>) -> Result<Vec<Cover>, Cancelled> {
        let n = self.neighbours.n_distinct();
        map_with(n, progress, Bench::default, |bench, place| {
            if self.planarity(place) >= PLANAR {
                match self.cover(place, CELL_NEIGHBOURS, &[], bench) {
                    open if open.kind() == Kind::Open => {
                        let wider = self.cover(place, FURTHER_NEIGHBOURS, &[], bench);
                        Cover { farthest: open.farthest, ring: open.ring, ..wider }
                    }
                    cover => cover,
                }
            } else {
                self.scattered(place, bench)
            }
        })
    }

    /// The disc of a point that is of no surface.
    fn scattered(&self, place: usize, bench: &mut Bench) -> Cover {
        let near = bench.close.nearest(self.neighbours.tree(), place, CELL_NEIGHBOURS);
        let near = &near[..near.len().min(SCATTERED)];
        let sum: f64 = near.iter().map(|close| close.distance()).sum();
        let mean = sum / near.len().max(1) as f64;
        let flat = 1.0 - (f64::from(PLANAR - self.planarity(place)) / FADE).min(1.0);
        let radius = (mean * (TOUCHING + flat * (COVERING - TOUCHING))) as f32;
        Cover::new(radius, 0.0, 0.0, Kind::Scattered)
    }

    /// Distance of the farthest of the nearest of a point.
    pub(super) fn farthest(&self, place: usize, bench: &mut Bench) -> f64 {
        let near = bench.close.nearest(self.neighbours.tree(), place, CELL_NEIGHBOURS);
        near.last().map_or(0.0, |close| close.distance())
    }

    /// Covers a point's cell, which the `k` nearest points bound, and some that lie `further`.
    pub(super) fn cover(
        &self,
        place: usize,
        k: usize,
        further: &[Found],
        bench: &mut Bench,
    ) -> Cover {
        let tree = self.neighbours.tree();
        let here = Vec3::from_array(tree.at(place));
        let search = if k == CELL_NEIGHBOURS { &mut bench.close } else { &mut bench.farther };
        let near = search.nearest(tree, place, k);
        let point = |place: usize, distance: f32| Near {
            offset: Vec3::from_array(tree.at(place)) - here,
            distance,
            normal: self.normal(place),
        };
        let (Some(closest), Some(farthest)) = (near.first(), near.last()) else {
            return Cover::new(0.0, 0.0, 0.0, Kind::Closed);
        };
        let (closest, farthest) = (closest.distance(), farthest.distance());
        let ring = near[(COMPARED - 1).min(near.len() - 1)].distance();
        let cell = bench.cell.get_or_insert_with(|| Cell::new(0.0));
        let nearest = near.iter().map(|close| point(close.place(), close.distance() as f32));
        let normal = self.normal(place);
        let most = if further.is_empty() {
            cell.become_of(normal, farthest, nearest);
            farthest
        } else {
            bench.near.clear();
            bench.near.extend(nearest);
            bench.near.extend(further.iter().map(|f| point(f.place as usize, f.distance as f32)));
            bench.near.sort_by(|a, b| a.distance.total_cmp(&b.distance));
            let most = bench.near.last().map_or(farthest, |near| f64::from(near.distance));
            cell.become_of(normal, most, bench.near.iter().copied());
            most
        };
        let radius = COVER * cell.radius().unwrap_or(closest).min(most);
        let has_gap = || match further.is_empty() {
            true => has_gap(near.len(), |at| near[at].distance(), most, radius),
            false => has_gap(bench.near.len(), |at| bench.near[at].distance.into(), most, radius),
        };
        let kind = match cell.is_closed() {
            false => Kind::Open,
            true if radius > ring || has_gap() => Kind::Wide,
            true => Kind::Closed,
        };
        Cover::new(radius as f32, farthest as f32, ring as f32, kind)
    }
}

/// Distance over that of the next nearer from which on there is a gap between. Of points that lie at random on a
/// surface, in one case of a hundred before the sixth.
const GAP: f64 = 1.6;

/// Whether a disc reaches across a gap beyond which all others lie in one shell, up to the farthest: as that of a
/// point which floats with a few others above a surface. The distances of `count` points come nearest first.
fn has_gap(count: usize, distance: impl Fn(usize) -> f64, farthest: f64, radius: f64) -> bool {
    let beyond = (0..count).find(|&at| distance(at) * GAP > farthest).unwrap_or(count);
    let within = if beyond > 0 { distance(beyond - 1) } else { 0.0 };
    radius > within && (beyond == count || distance(beyond) > GAP * within)
}
