//! Limits of discs whose cells span empty space: at borders, at strays, and where the spacing changes.

use super::covering::{Bench, CELL_NEIGHBOURS, COMPARED, Cover, Kind, Surface};
use super::median;
use crate::neighbours::{Found, Scratch, Shared};
use crate::progress::{Cancelled, Progress, map_with, part, take_runs};
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// A disc on a surface that is larger than this many times the median of those around it covers a
/// cell which spans a gap rather than a piece of surface.
const OUTLIER: f64 = 3.0;

/// The same at a border, where the corners of a cell may lie far outside.
const BORDER: f64 = 1.5;

/// The most points of a group that counts as floating. The cells of up to this many points are cut
/// from all others of their group and still reach for points across the gap around it; a larger
/// group fills the lists that cells are cut from, so that no cell of it knows of the gap.
const FLOATING: usize = CELL_NEIGHBOURS;

/// Distance up to which points are gathered for the group of one, over that of its first ring.
const GROUP_REACH: f32 = 2.0;

/// Share of a distance that counts as rounding.
const ROUNDING: f64 = 1e-6;

/// Limits the discs of points that are not surrounded evenly.
pub(super) fn limit(
    surface: &Surface<'_>,
    cells: &mut [Cover],
    progress: Progress<'_>,
) -> Result<(), Cancelled> {
    let gaps = Gaps::between(surface, cells);
    let (odd, on_surface) = gaps.sort_out(&part(progress, 0.0..0.35))?;
    let wider = Widened::of(&gaps, &odd, &on_surface, &part(progress, 0.35..0.7))?;
    for (&place, cell) in odd.iter().zip(&wider.cells) {
        cells[place as usize] = *cell;
    }
    let of_surfaces = (0..cells.len()).filter(|&place| on_surface[place]);
    let usual = middle(&of_surfaces.map(|place| cells[place].radius())).map(f64::from);
    let cells_now = &*cells;
    let limits = map_with(odd.len(), &part(progress, 0.7..1.0), Scratch::default, |scratch, i| {
        let place = odd[i] as usize;
        let radius = |place: usize| f64::from(cells_now[place].radius());
        let near = surface.neighbours.around(place, COMPARED, scratch).iter();
        let near = near.map(|found| found.place as usize).filter(|&other| on_surface[other]);
        let near = median(near.map(radius)).or(usual);
        let further = median(wider.further(i).iter().map(|&other| radius(other as usize)));
        let factor = match cells_now[place].kind() {
            _ if !on_surface[place] => 1.0,
            Kind::Open => BORDER,
            _ => OUTLIER,
        };
        let typical = near.into_iter().chain(further).reduce(f64::max);
        typical.map_or(f32::INFINITY, |typical| (factor * typical) as f32)
    })?;
    for (&place, limit) in odd.iter().zip(limits) {
        let cell = &mut cells[place as usize];
        cell.set_radius(cell.radius().min(limit));
    }
    Ok(())
}

/// The median of many numbers of at least 0; of an even number the upper one of the two in the middle. They are
/// counted twice, by the halves of their bits, which is in their order, instead of being copied.
fn middle(values: &(impl Iterator<Item = f32> + Clone)) -> Option<f32> {
    let bits = || values.clone().map(f32::to_bits);
    let find = |counts: &[u32], mut rank: usize| {
        let found = counts.iter().position(|&count| {
            let is_here = rank < count as usize;
            rank -= if is_here { 0 } else { count as usize };
            is_here
        });
        found.map(|found| (found as u32, rank))
    };
    let mut counts = vec![0; 1 << 16];
    bits().for_each(|bits| counts[bits as usize >> 16] += 1);
    let (upper, rank) =
        find(&counts, counts.iter().map(|&count| count as usize).sum::<usize>() / 2)?;
    counts.fill(0);
    let low = bits().filter(|bits| bits >> 16 == upper);
    low.for_each(|bits| counts[bits as usize & 0xffff] += 1);
    find(&counts, rank).map(|(lower, _)| f32::from_bits(upper << 16 | lower))
}

/// Planarity below which a disc has to be like those around it: there are plates among leaves, whose plane is chance.
const ROUGH: f32 = 0.75;

/// Limits the splats of what is no surface, or hardly one, to a few times the median of those around.
pub(super) fn limit_rough(
    surface: &Surface<'_>,
    cells: &mut [Cover],
    progress: Progress<'_>,
) -> Result<(), Cancelled> {
    let is_rough = |place: &usize| surface.planarity(*place) < ROUGH;
    let rough: Vec<usize> = (0..cells.len()).filter(is_rough).collect();
    let cells_now = &*cells;
    let limits = map_with(rough.len(), progress, Scratch::default, |scratch, i| {
        let near = surface.neighbours.around(rough[i], COMPARED, scratch).iter();
        median(near.map(|found| f64::from(cells_now[found.place as usize].radius())))
    })?;
    for (&place, typical) in rough.iter().zip(limits) {
        let cell = &mut cells[place];
        let most = typical.map_or(f32::INFINITY, |typical| (OUTLIER * typical) as f32);
        cell.set_radius(cell.radius().min(most));
    }
    Ok(())
}

/// A bit for each place, which any thread may set.
struct LargeGroups(Vec<AtomicU32>);

impl LargeGroups {
    fn new(count: usize) -> Self {
        Self((0..count.div_ceil(32)).map(|_| AtomicU32::new(0)).collect())
    }

    fn has(&self, place: u32) -> bool {
        self.0[place as usize / 32].load(Relaxed) >> (place % 32) & 1 == 1
    }

    fn mark(&self, place: u32) {
        self.0[place as usize / 32].fetch_or(1 << (place % 32), Relaxed);
    }
}

/// Points around gaps.
pub(super) struct Gaps<'a> {
    surface: &'a Surface<'a>,
    cells: &'a [Cover],
    /// For each node of the search the distance of the farthest of the nearest of any point in it.
    reach: Vec<f32>,
    /// Points of which it is known that their group is larger than [`FLOATING`]. What is known changes no answer.
    large: LargeGroups,
}

impl<'a> Gaps<'a> {
    pub(super) fn between(surface: &'a Surface<'a>, cells: &'a [Cover]) -> Self {
        let reach = surface.neighbours.tree().largest(|place| cells[place].farthest());
        Self { surface, cells, reach, large: LargeGroups::new(cells.len()) }
    }

    /// The points that are not surrounded evenly or float, sorted, and for each point whether it belongs to a
    /// surface.
    pub(super) fn sort_out(
        &self,
        progress: Progress<'_>,
    ) -> Result<(Vec<u32>, Vec<bool>), Cancelled> {
        let is_odd = |cell: &Cover| matches!(cell.kind(), Kind::Open | Kind::Wide);
        let cells = (0u32..).zip(self.cells).filter(|(_, cell)| is_odd(cell));
        let mut odd: Vec<u32> = cells.map(|(place, _)| place).collect();
        let groups = map_with(odd.len(), progress, Shared::default, |search, i| {
            self.floating(odd[i], search)
        })?;
        let mut on_surface = vec![true; self.cells.len()];
        for &member in groups.iter().flatten().flatten() {
            if std::mem::replace(&mut on_surface[member as usize], false) {
                odd.push(member);
            }
        }
        odd.sort_unstable();
        odd.dedup();
        if on_surface.iter().all(|on_surface| !on_surface) {
            // Where no group is large the question has no answer.
            on_surface.fill(true);
        }
        Ok((odd, on_surface))
    }

    /// The group of a point, where it floats by itself.
    ///
    /// Points that are among each other's first few are linked. A group of linked points that is no
    /// larger than [`FLOATING`] floats by itself, unless a point of a surface counts one of its points
    /// among its own nearest: the surface goes on there, only with other spacing.
    fn floating(&self, place: u32, search: &mut Shared) -> Option<Vec<u32>> {
        let group = self.group(place, search)?;
        let is_borne = group.iter().any(|&member| {
            self.counted_by(member as usize, 0.0).iter().any(|found| {
                !group.contains(&found.place) && self.group(found.place, search).is_none()
            })
        });
        (!is_borne).then_some(group)
    }

    /// The group of a point, sorted; `None` where it is larger than [`FLOATING`].
    fn group(&self, place: u32, search: &mut Shared) -> Option<Vec<u32>> {
        let tree = self.surface.neighbours.tree();
        let reach = GROUP_REACH * self.cells[place as usize].ring();
        let from = (place as usize, reach * reach);
        let mut group = vec![place];
        // Points that lead back here.
        let mut back = vec![true];
        let mut is_large = self.large.has(place);
        let mut next = 0;
        while let Some(&member) = group.get(next).filter(|_| !is_large) {
            let ring = self.cells[member as usize].ring();
            let near = (member as usize, ring * ring);
            for close in search.nearest_beside(tree, from, near, COMPARED) {
                let distance = close.distance() as f32;
                let their_ring = self.cells[close.place()].ring();
                let other = close.place() as u32;
                if distance <= their_ring && !group.contains(&other) {
                    group.push(other);
                    // Of several that are equally far not all need count each other.
                    back.push(back[next] && distance < their_ring.min(ring));
                    // What leads to a large group is of one.
                    is_large |= group.len() > FLOATING || self.large.has(other);
                }
            }
            next += 1;
        }
        if is_large {
            let known = group.iter().zip(back).filter(|&(_, back)| back);
            known.for_each(|(&member, _)| self.large.mark(member));
            return None;
        }
        group.sort_unstable();
        Some(group)
    }

    /// The points farther than `least` that count a point among their nearest, by place.
    fn counted_by(&self, place: usize, least: f64) -> Vec<Found> {
        let neighbours = self.surface.neighbours;
        let (tree, here) = (neighbours.tree(), neighbours.point(place));
        let mut found = Vec::new();
        let mut pending = vec![1];
        while let Some(node) = pending.pop() {
            // A share of rounding on top, since squares in f32 decided what was nearest.
            let reach = self.reach[node] * (1.0 + ROUNDING as f32);
            if f64::from(reach) <= least {
                continue;
            }
            if tree.squared_to(node, here.as_vec3().to_array()) > reach * reach {
                continue;
            }
            if node < tree.n_leaves() {
                pending.extend([2 * node + 1, 2 * node]);
                continue;
            }
            for other in tree.leaf(node - tree.n_leaves()).filter(|&other| other != place) {
                let distance = neighbours.point(other).distance(here);
                if distance > least && distance <= f64::from(self.cells[other].farthest()) {
                    found.push(Found { place: other as u32, distance });
                }
            }
        }
        found
    }

    /// The cover of a point whose cell is bounded also by points of surfaces that count it among their nearest, and
    /// those, which are added to `all`.
    ///
    /// Where a coarse surface borders on a fine one, the nearest of its last points are all fine ones.
    /// These lead back to the coarse side.
    fn widened(
        &self,
        place: usize,
        on_surface: &[bool],
        bench: &mut Bench,
        all: &mut Vec<u32>,
    ) -> Cover {
        let cell = self.cells[place];
        if !on_surface[place] {
            return cell;
        }
        let least = self.surface.farthest(place, bench) * (1.0 + ROUNDING);
        let mut further = self.counted_by(place, least);
        further.retain(|found| on_surface[found.place as usize]);
        if further.is_empty() {
            return cell;
        }
        all.extend(further.iter().map(|found| found.place));
        self.surface.cover(place, CELL_NEIGHBOURS, &further, bench)
    }
}

/// Points whose covers are widened by one thread, one after the other.
const RUN: usize = 1024;

/// Covers that points farther away bound, too, one after the other.
#[derive(Default)]
struct Widened {
    cells: Vec<Cover>,
    /// Where in `further` the points of each end.
    ends: Vec<u32>,
    further: Vec<u32>,
}

impl Widened {
    /// The covers of points.
    fn of(
        gaps: &Gaps<'_>,
        points: &[u32],
        on_surface: &[bool],
        progress: Progress<'_>,
    ) -> Result<Self, Cancelled> {
        let runs: Vec<&[u32]> = points.chunks(RUN).collect();
        let of_run = |bench: &mut Bench, run: usize| {
            let mut widened = Self::default();
            for &place in runs[run] {
                let further = &mut widened.further;
                widened.cells.push(gaps.widened(place as usize, on_surface, bench, further));
                widened.ends.push(widened.further.len() as u32);
            }
            widened
        };
        let mut all = Self::default();
        all.cells.reserve_exact(points.len());
        all.ends.reserve_exact(points.len());
        take_runs(runs.len(), progress, Bench::default, of_run, |run| all.append(&run))?;
        Ok(all)
    }

    fn append(&mut self, run: &Self) {
        let before = self.further.len() as u32;
        self.cells.extend(&run.cells);
        self.ends.extend(run.ends.iter().map(|end| before + end));
        self.further.extend(&run.further);
    }

    /// The points farther away that bound the cell of a point.
    fn further(&self, i: usize) -> &[u32] {
        let start = i.checked_sub(1).map_or(0, |before| self.ends[before] as usize);
        &self.further[start..self.ends[i] as usize]
    }
}
