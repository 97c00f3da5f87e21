//! The Voronoi cell of each point in its tangent plane, and the disc that covers it.

use crate::cell::{self, Near};
use crate::neighbours::Neighbours;
use crate::progress::{Cancelled, Progress, flat_map, part, sort};
use glam::Vec3;

/// Neighbours that bound a point's cell. In a random sampling a corner of a cell lies farther away
/// than the 20th neighbour with probability e^-20, so that practically every corner is found.
pub(super) const CELL_NEIGHBOURS: usize = 20;

/// Factor on the radius of a cell. On a sphere the disc at angle p has to reach to the tangent of
/// p / 2 where half the chord to the neighbour is its sine; the ratio is 1.14 for neighbours one
/// radian apart and less for all finer samplings.
pub(crate) const COVER: f64 = 1.15;

/// Nearest points that a point is grouped and compared with: the first ring of a square grid.
const COMPARED: usize = 8;

const NOBODY: u32 = u32::MAX;

/// A point's covering radius and what it was found from; lengths in the unit box.
pub(super) struct Covering {
    /// 0 where the point is alone.
    pub(super) radius: f64,
    /// Distance of the farthest of the nearest.
    farthest: f64,
    /// Points farther away than this cannot cut the cell; infinite at a border.
    open_to: f64,
    nearest: [u32; CELL_NEIGHBOURS],
}

impl Covering {
    /// The nearest points, nearest first.
    pub(super) fn nearest(&self) -> impl Iterator<Item = u32> {
        self.nearest.iter().copied().filter(|&other| other != NOBODY)
    }

    /// Those of the nearest that a point is grouped and compared with.
    pub(super) fn compared(&self) -> impl Iterator<Item = u32> {
        self.nearest().take(COMPARED)
    }
}

/// A point that counts another one among its nearest.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Link {
    pub(super) to: u32,
    pub(super) from: u32,
}

/// Links from points of surfaces that lie farther away than the nearest and may bound a cell, sorted.
///
/// Where a coarse surface borders on a fine one, the nearest of its last points are all fine ones.
/// These links lead back to the coarse side.
pub(super) struct Further(Vec<Link>);

impl Further {
    pub(super) fn new(
        neighbours: &Neighbours,
        cells: &[Covering],
        on_surface: &[bool],
        progress: Progress<'_>,
    ) -> Result<Self, Cancelled> {
        let points = neighbours.distinct();
        let links = flat_map(cells.len(), &part(progress, 0.0..0.8), |from| {
            let nearest = on_surface[from].then(|| cells[from].nearest());
            nearest.into_iter().flatten().filter_map(move |to| {
                let cell = &cells[to as usize];
                let distance = points[from].distance(points[to as usize]);
                let leads_back = distance > cell.farthest && distance < cell.open_to;
                leads_back.then_some(Link { to, from: from as u32 })
            })
        })?;
        Ok(Self(sort(links, &part(progress, 0.8..1.0))?.concat()))
    }

    /// The links to one point.
    pub(super) fn of(&self, place: usize) -> &[Link] {
        let first = self.0.partition_point(|link| (link.to as usize) < place);
        let count = self.0[first..].partition_point(|link| link.to as usize == place);
        &self.0[first..first + count]
    }
}

/// Covers a point's cell, which its nearest points bound, and those that `further` leads to.
pub(super) fn cover(
    neighbours: &Neighbours,
    normals: &[Vec3],
    place: usize,
    further: &[Link],
) -> Covering {
    let points = neighbours.distinct();
    let mut near = neighbours.around(place, CELL_NEIGHBOURS);
    let mut nearest = [NOBODY; CELL_NEIGHBOURS];
    for (slot, &(other, _)) in nearest.iter_mut().zip(&near) {
        *slot = other;
    }
    let distance = |link: &Link| points[link.from as usize].distance(points[place]);
    near.extend(further.iter().map(|link| (link.from, distance(link))));
    near.sort_unstable_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
    let (Some(&(_, closest)), Some(&(_, farthest))) = (near.first(), near.last()) else {
        return Covering { radius: 0.0, farthest: 0.0, open_to: 0.0, nearest };
    };
    let normal_of =
        |place: usize| normals.get(neighbours.first()[place] as usize).copied().unwrap_or(Vec3::Z);
    let near = near.iter().map(|&(other, distance)| Near {
        offset: points[other as usize] - points[place],
        distance,
        normal: normal_of(other as usize),
    });
    let cell = cell::of(normal_of(place), near);
    let radius = COVER * cell.radius().unwrap_or(closest).min(farthest);
    let open_to = if cell.is_closed() { 2.0 * cell.reach() } else { f64::INFINITY };
    Covering { radius, farthest, open_to, nearest }
}
