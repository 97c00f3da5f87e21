//! Albedos and accessibilities of merged surfels, made anew where those of the cloud's surfels changed.
//!
//! Which surfels are merged does not depend on what they are painted with, so that merged ones keep their places. Parts
//! of the tree in which something changed are merged again, and the blocks above them; what comes out is compared with
//! what is there, since numbers that end are not merged.

use super::block::Block;
use super::merge::Sample;
use super::{Above, BLOCK, BRANCH, Level, Node, joined, part, places};
use crate::columns::{Albedo, Columns, Geometry};
use crate::lanes::WIDTH;
use rayon::prelude::*;

/// One sample of so many surfels is kept at most, for painting: a cloud whose surfels lie apart is merged of all of them.
const KEPT: usize = 8;

/// What surfels are painted with from now on.
pub struct Paint {
    /// Their places, ascending.
    pub places: Vec<u32>,
    /// Albedos of these, stored as those that are there; the same one where they stay as they are.
    pub albedo: Albedo,
    /// Accessibilities of these; none where they stay as they are.
    pub ao: Option<Vec<f32>>,
}

/// A part of the tree or a block above, made again: the number of the block, and what it is made of.
type Remade = (usize, Node);

impl Above {
    /// Bytes in memory.
    pub(crate) fn bytes(&self) -> usize {
        let nodes = self.levels.iter().map(|(_, nodes)| nodes.len()).sum::<usize>();
        self.n_samples() * size_of::<Sample>() + nodes * size_of::<Node>()
    }

    fn n_samples(&self) -> usize {
        self.levels.iter().flat_map(|(_, nodes)| nodes).map(|node| node.samples.len()).sum()
    }

    /// Keeps a level of a cloud of so many surfels; none is once they take much beside it.
    pub(super) fn keep(&mut self, level: Level, n_surfels: usize) {
        let own: usize = level.1.iter().map(|node| node.samples.len()).sum();
        self.is_left_out |= self.n_samples() + own > n_surfels / KEPT;
        match self.is_left_out {
            true => self.levels.clear(),
            false => self.levels.push(level),
        }
    }

    /// Itself, unless levels were left out.
    pub(crate) fn if_whole(self) -> Option<Self> {
        (!self.is_left_out).then_some(self)
    }
}

/// Makes merged surfels anew that stand for surfels at these places, in ascending order. `None` where others would be
/// merged than are: then all columns are to be made anew.
fn remerge(
    (columns, geometry): (&mut Columns, &Geometry<'_>),
    above: &mut Above,
    changed: &[u32],
    linear_of_srgb: &[f32; 256],
) -> Option<()> {
    let n_leaves = columns.len().div_ceil(BLOCK);
    let mut level: Vec<usize> = changed.iter().map(|place| *place as usize / BLOCK).collect();
    level.iter_mut().for_each(|leaf| *leaf /= above.per_part.max(1));
    level.dedup();
    if above.levels.is_empty() {
        return Some(());
    }
    // As many at a time as threads take: what parts are merged of needs memory.
    for numbers in level.chunks(rayon::current_num_threads()) {
        let made = |&number: &usize| {
            let first = number * above.per_part;
            let leaves = first..(first + above.per_part).min(n_leaves);
            (number, part((columns, geometry), leaves, above.n_levels, true, linear_of_srgb))
        };
        let made: Vec<_> = numbers.par_iter().map(made).collect();
        for (number, part) in made {
            let base = *above.parts.get(number)?;
            let known = columns.blocks.get(base..base + part.blocks.len())?;
            let is_same = |(known, made): (&Block, &Block)| known.count == made.count;
            if !known.iter().zip(&part.blocks).all(is_same) {
                return None;
            }
            for (block, samples) in part.merged {
                columns.repaint_merged(base + block, &samples)?;
            }
            above.put(columns, 0, (number, part.top))?;
        }
    }
    for k in 1..above.levels.len() {
        level.iter_mut().for_each(|number| *number /= BRANCH);
        level.dedup();
        let (first, parts) = &above.levels[k - 1];
        let join = |&number: &usize| {
            let own = BRANCH * number..(BRANCH * (number + 1)).min(parts.len());
            Some((number, joined(parts.get(own)?, places(*first, number, parts.len()))))
        };
        let made: Option<Vec<Remade>> = level.par_iter().map(join).collect();
        made?.into_iter().try_for_each(|made| above.put(columns, k, made))?;
    }
    Some(())
}

impl Above {
    /// Puts a node into a level in the place of one that has the same merged surfels.
    fn put(&mut self, columns: &mut Columns, level: usize, (number, node): Remade) -> Option<()> {
        let (first, nodes) = self.levels.get_mut(level)?;
        let known = nodes.get_mut(number)?;
        if known.block.count != node.block.count || known.samples.len() != node.samples.len() {
            return None;
        }
        if node.block.count > 0 {
            columns.repaint_merged(*first + number, &node.samples)?;
        }
        known.samples = node.samples;
        Some(())
    }
}

impl Columns {
    /// Gives surfels other albedos and accessibilities, and what they are merged to those that follow. Returns whether
    /// that could be: else the columns are no longer right, and to be made anew. The geometry is that of the cloud, which
    /// has not changed.
    pub fn repaint(
        &mut self,
        paint: &Paint,
        geometry: &Geometry<'_>,
        linear_of_srgb: &[f32; 256],
    ) -> bool {
        if paint.places.last().is_some_and(|last| *last as usize >= self.len()) {
            return false;
        }
        let places = || paint.places.iter().map(|place| *place as usize);
        match (&mut self.albedo, &paint.albedo) {
            (_, Albedo::Same(_)) => {}
            (Albedo::Codes(all), Albedo::Codes(new)) => {
                places().zip(new).for_each(|(place, code)| all[place] = *code);
            }
            (Albedo::Halves(all), Albedo::Halves(new)) => {
                places().zip(new).for_each(|(place, halves)| all[place] = *halves);
            }
            _ => return false,
        }
        match (&mut self.ao, &paint.ao) {
            (_, None) => {}
            (Some(all), Some(new)) => {
                places().zip(new).for_each(|(place, value)| all.put(place, *value));
            }
            (None, Some(_)) => return false,
        }
        let Some(mut above) = self.above.take() else { return false };
        let merged = remerge((self, geometry), &mut above, &paint.places, linear_of_srgb);
        self.above = merged.map(|()| above);
        self.above.is_some()
    }

    /// Whether [`Self::repaint`] can change what is there.
    #[must_use]
    pub fn can_be_repainted(&self) -> bool {
        self.above.is_some()
    }

    /// Gives the merged surfels of a block the albedos and accessibilities of these samples; `None` where they are
    /// others.
    fn repaint_merged(&mut self, block: usize, samples: &[Sample]) -> Option<()> {
        let block = self.blocks.get(block)?;
        if block.count != samples.len().div_ceil(WIDTH) {
            return None;
        }
        let first = block.first * WIDTH;
        for (place, sample) in (first..).zip(samples) {
            let bits = |v: [f32; 3]| v.map(f32::to_bits);
            let is_same = self.surfel_at(place) == sample.stands_for
                && bits(self.position_of(place)) == bits(sample.position);
            if !is_same {
                return None;
            }
            self.put_sample(place, sample);
        }
        Some(())
    }
}
