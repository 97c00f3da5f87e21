//! Which points belong to a surface, and which float by themselves.

use super::Covering;
use glam::DVec3;

/// The most points of a group that counts as floating. The cells of up to this many points are cut
/// from all others of their group and still reach for points across the gap around it; a larger
/// group fills the lists that cells are cut from, so that no cell of it knows of the gap.
const FLOATING: u32 = super::CELL_NEIGHBOURS as u32;

/// For each point whether it belongs to a surface.
///
/// Points that are among each other's nearest are linked. A group of linked points that is no larger
/// than 20 floats by itself, unless a point of a surface counts one of its points among its own
/// nearest: the surface goes on there, only with other spacing. Only ranks of distances count, so
/// that a coarse surface beside a fine one is as good as that. Where no group is large the question
/// has no answer, and every point belongs to the surface.
pub(super) fn on_surface(cells: &[Covering]) -> Vec<bool> {
    let nearest = |place: u32| cells[place as usize].nearest();
    let mut groups = Groups::new(cells.len());
    for place in 0..cells.len() as u32 {
        for other in nearest(place) {
            if other < place && nearest(other).any(|back| back == place) {
                groups.join(place, other);
            }
        }
    }
    let mut found: Vec<bool> =
        (0..cells.len() as u32).map(|place| groups.size(place) > FLOATING).collect();
    let mut pending: Vec<u32> =
        (0..cells.len() as u32).filter(|&place| found[place as usize]).collect();
    if pending.is_empty() {
        return vec![true; cells.len()];
    }
    while let Some(place) = pending.pop() {
        for other in nearest(place) {
            if !std::mem::replace(&mut found[other as usize], true) {
                pending.push(other);
            }
        }
    }
    found
}

/// Pairs of a point and one of a surface that counts it among its nearest although it lies beyond
/// the neighbours that the point's own cell was cut from; sorted.
///
/// Where a coarse surface borders on a fine one, the nearest of its last points are all fine ones.
/// These links lead back to the coarse side.
pub(super) fn coarser_sides(
    points: &[DVec3],
    cells: &[Covering],
    on_surface: &[bool],
) -> Vec<(u32, u32)> {
    let mut links = Vec::new();
    for from in (0..cells.len() as u32).filter(|&place| on_surface[place as usize]) {
        for to in cells[from as usize].nearest() {
            let distance = points[from as usize].distance(points[to as usize]);
            if distance > cells[to as usize].known {
                links.push((to, from));
            }
        }
    }
    links.sort_unstable();
    links
}

/// Disjoint groups that can be joined, as trees whose roots stand for them.
struct Groups {
    parent: Vec<u32>,
    /// Members, where the point is a root.
    size: Vec<u32>,
}

impl Groups {
    fn new(count: usize) -> Self {
        Self { parent: (0..count as u32).collect(), size: vec![1; count] }
    }

    fn root(&mut self, mut place: u32) -> u32 {
        while self.parent[place as usize] != place {
            // Every second step is cut short, which keeps the trees flat.
            let above = self.parent[self.parent[place as usize] as usize];
            self.parent[place as usize] = above;
            place = above;
        }
        place
    }

    fn join(&mut self, one: u32, other: u32) {
        let (one, other) = (self.root(one), self.root(other));
        if one != other {
            let size = self.size[one as usize] + self.size[other as usize];
            let larger = self.size[one as usize] >= self.size[other as usize];
            let (top, below) = if larger { (one, other) } else { (other, one) };
            self.parent[below as usize] = top;
            self.size[top as usize] = size;
        }
    }

    fn size(&mut self, place: u32) -> u32 {
        let root = self.root(place);
        self.size[root as usize]
    }
}
