//! Isolated points: which belong to a surface, and which float by themselves.

use super::covering::{CELL_NEIGHBOURS, Covering};
use crate::progress::{Cancelled, Progress, each, part};

/// The most points of a group that counts as floating. The cells of up to this many points are cut
/// from all others of their group and still reach for points across the gap around it; a larger
/// group fills the lists that cells are cut from, so that no cell of it knows of the gap.
const FLOATING: u32 = CELL_NEIGHBOURS as u32;

/// For each point whether it belongs to a surface.
///
/// Points that are among each other's first few are linked. A group of linked points that is no
/// larger than [`FLOATING`] floats by itself, unless a point of a surface counts one of its points
/// among its own nearest: the surface goes on there, only with other spacing. Where no group is
/// large the question has no answer, and every point belongs to a surface.
pub(super) fn on_surface(
    cells: &[Covering],
    progress: Progress<'_>,
) -> Result<Vec<bool>, Cancelled> {
    let mut groups = Groups::new(cells.len());
    each(cells.len(), &part(progress, 0.0..0.6), |i| {
        let place = i as u32;
        for other in cells[i].compared() {
            if other < place && cells[other as usize].compared().any(|back| back == place) {
                groups.join(place, other);
            }
        }
    })?;
    let mut found = vec![false; cells.len()];
    let mut pending = Vec::new();
    each(cells.len(), &part(progress, 0.6..0.7), |i| {
        if groups.size(i as u32) > FLOATING {
            found[i] = true;
            pending.push(i as u32);
        }
    })?;
    if pending.is_empty() {
        return Ok(vec![true; cells.len()]);
    }
    // Every point is pending at most once.
    each(cells.len(), &part(progress, 0.7..1.0), |_| {
        let Some(place) = pending.pop() else { return };
        for other in cells[place as usize].nearest() {
            if !std::mem::replace(&mut found[other as usize], true) {
                pending.push(other);
            }
        }
    })?;
    Ok(found)
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
