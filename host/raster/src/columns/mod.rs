//! A cloud's columns as they are drawn: in drawing order, in groups of lanes.

pub(crate) mod geometry;
mod groups;

pub use geometry::{Geometry, radius_drawn};

use crate::fields::Splats;
use crate::lanes::WIDTH;
use crate::level_of_detail::block::Block;
use crate::level_of_detail::merge::Sample;
use crate::level_of_detail::{self, Above, PART};
use geometry::{OrderedGeometry, Shape};
use groups::Singles;
use half::f16;
use rayon::prelude::*;
use std::sync::{Arc, OnceLock};

/// Albedos in drawing order.
pub enum Albedo {
    /// Linear Rec. 709, one for all.
    Same([f32; 3]),
    /// sRGB codes of red, green and blue in the lower three bytes.
    Codes(Vec<u32>),
    /// Linear red, green, blue and one.
    Halves(Vec<[f16; 4]>),
}

/// Whether surfels are made that stand for several where these are small.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Merging {
    /// None are.
    No,
    /// They are.
    Once,
    /// They are, and what they follow from is kept, as far as it takes little: [`Columns::repaint`] changes them.
    Repaintable,
}

/// A cloud's columns, as they are drawn.
///
/// A surfel's place is its number in drawing order; behind those of the cloud stand merged ones, which
/// stand for several where these are small (`level_of_detail`).
pub struct Columns {
    len: usize,
    /// Places, those of merged surfels and of groups that are not full among them.
    pub(crate) n_places: usize,
    /// The cloud's own surfels, in parts of [`PART`]. A part that merged surfels stand for takes no memory: it is put in
    /// order when it is first drawn, and stays then.
    parts: Vec<OnceLock<OrderedGeometry>>,
    /// Places in the file, where parts may still be made.
    order: Option<Arc<Vec<u32>>>,
    merged: OrderedGeometry,
    pub(crate) albedo: Albedo,
    /// Whether some are round splats, which face the eye: their radii are negative.
    pub(crate) has_round: bool,
    pub(crate) ao: Option<Singles>,
    material: Option<Vec<u32>>,
    pub(crate) splats: Splats,
    /// Of each merged surfel, one that it stands for.
    stands_for: Vec<u32>,
    pub(crate) blocks: Vec<Block>,
    /// Those that are not parts of others.
    pub(crate) roots: std::ops::Range<usize>,
    /// What painting needs; without it nothing is painted.
    pub(crate) above: Option<Above>,
    /// The longest half axis of any surfel, scene units.
    pub(crate) max_reach: f32,
}

/// What columns are made of, in the order of the file.
pub struct Sources<'a> {
    /// Where surfels are, how they stand and how large they are.
    pub geometry: Geometry<'a>,
    /// Ambient accessibility.
    pub ao: Option<&'a [f32]>,
    /// Indices of materials.
    pub materials: Option<&'a [u32]>,
    /// Whether all places are read, and not only those that are drawn.
    pub all_read: bool,
}

impl Columns {
    /// Puts columns into drawing order: `order` holds the surfels' places in the file, all below the
    /// columns' length. Albedos and what varies over splats are in drawing order already. `report` hears how far it
    /// is, in [0, 1].
    #[must_use]
    pub fn new(
        sources: &Sources<'_>,
        order: Arc<Vec<u32>>,
        albedo: Albedo,
        splats: Splats,
        merging: Merging,
        linear_of_srgb: &[f32; 256],
        report: &(dyn Fn(f32) + Sync),
    ) -> Self {
        let geometry = &sources.geometry;
        let may_wait = merging != Merging::No && geometry.tangents.is_none() && !sources.all_read;
        let part = |order: &[u32]| match may_wait {
            true => OnceLock::new(),
            false => OnceLock::from(OrderedGeometry::ordered(geometry, order)),
        };
        let parts = order.par_chunks(PART).map(part).collect();
        let ao = sources.ao.map(|values| Singles::ordered_by_all(&order, |i| values[i]));
        let material = sources.materials;
        let mut columns = Self {
            len: order.len(),
            n_places: order.len().next_multiple_of(WIDTH),
            parts,
            merged: OrderedGeometry::ordered(geometry, &[]),
            has_round: geometry.tangents.is_none()
                && geometry.round.is_some_and(|round| round.iter().any(|&is_round| is_round != 0)),
            albedo,
            ao,
            material: material.map(|all| order.par_iter().map(|&i| all[i as usize]).collect()),
            splats,
            stands_for: Vec::new(),
            blocks: Vec::new(),
            roots: 0..0,
            above: None,
            max_reach: 0.0,
            order: may_wait.then_some(order),
        };
        let before = if may_wait { 0.0 } else { 0.4 };
        report(before);
        let told = |done: f32| report(before + (1.0 - before) * done);
        columns.merge(geometry, merging, linear_of_srgb, &told);
        columns
    }

    /// Hands over a part of the cloud's own surfels, which is dropped again where it had to be made.
    pub(crate) fn with_part<T>(
        &self,
        number: usize,
        geometry: &Geometry<'_>,
        work: impl FnOnce(&OrderedGeometry) -> T,
    ) -> T {
        match self.parts[number].get() {
            Some(part) => work(part),
            None => work(&self.made(number, geometry)),
        }
    }

    fn made(&self, number: usize, geometry: &Geometry<'_>) -> OrderedGeometry {
        let order = self.order.as_ref().and_then(|order| order.chunks(PART).nth(number));
        OrderedGeometry::ordered(geometry, order.unwrap_or_else(|| never_made()))
    }

    /// The part of the cloud's own surfels that a group is of, where it is still to be made.
    pub(crate) fn missing_part(&self, group: usize) -> Option<usize> {
        let number = group * WIDTH / PART;
        (!self.is_merged(group) && self.parts[number].get().is_none()).then_some(number)
    }

    /// Makes a part, unless it is there, of what is given for that.
    pub(crate) fn make_part(&self, number: usize, geometry: Option<&Geometry<'_>>) {
        if self.parts[number].get().is_none() {
            let made = self.made(number, geometry.unwrap_or_else(|| never_made()));
            self.parts[number].get_or_init(|| made);
        }
    }

    /// Makes all parts of the cloud's own surfels, for whoever reads all places.
    pub fn make_all_parts(&self, geometry: &Geometry<'_>) {
        if self.order.is_some() {
            let all = (0..self.parts.len()).into_par_iter();
            all.for_each(|number| self.make_part(number, Some(geometry)));
        }
    }

    /// Places in the file, where they are held to put parts in order.
    #[must_use]
    pub fn order(&self) -> Option<&Arc<Vec<u32>>> {
        self.order.as_ref()
    }

    /// The part that a group is in, and its number there.
    #[inline(always)]
    pub(crate) fn geometry(&self, group: usize) -> (&OrderedGeometry, usize) {
        const GROUPS: usize = PART / WIDTH;
        match group.checked_sub(padded(self.len) / WIDTH) {
            Some(at) => (&self.merged, at),
            None => match self.parts[group / GROUPS].get() {
                Some(part) => (part, group % GROUPS),
                None => never_made(),
            },
        }
    }

    /// The part that a place is in, and its number there.
    #[inline(always)]
    pub(crate) fn geometry_at(&self, place: usize) -> (&OrderedGeometry, usize) {
        let (part, group) = self.geometry(place / WIDTH);
        (part, group * WIDTH + place % WIDTH)
    }

    #[inline(always)]
    pub(crate) fn position_of(&self, place: usize) -> [f32; 3] {
        let (part, at) = self.geometry_at(place);
        part.positions.one(at)
    }

    #[inline(always)]
    pub(crate) fn normal_of(&self, place: usize) -> [f32; 3] {
        let (part, at) = self.geometry_at(place);
        part.normals.one(at)
    }

    /// Whether a group is of merged surfels.
    pub(crate) fn is_merged(&self, group: usize) -> bool {
        group * WIDTH >= self.len
    }

    /// Makes the tree of blocks and the merged surfels.
    fn merge(
        &mut self,
        geometry: &Geometry<'_>,
        merging: Merging,
        linear_of_srgb: &[f32; 256],
        report: &(dyn Fn(f32) + Sync),
    ) {
        self.pad_albedo(self.n_places);
        let merges = merging != Merging::No && matches!(self.merged.shape, Shape::Radius(_));
        let how = (merges, merging == Merging::Repaintable);
        let tree = level_of_detail::tree(self, geometry, how, linear_of_srgb, report);
        self.above = match merging {
            _ if !merges => Some(Above::default()),
            Merging::Repaintable => tree.above.if_whole(),
            Merging::No | Merging::Once => None,
        };
        self.max_reach = tree.blocks.iter().map(|block| block.reach).fold(0.0, f32::max);
        self.blocks = tree.blocks;
        self.roots = tree.roots;
        report(1.0);
    }

    /// Appends merged surfels, filled up to whole groups; the number of the first of these.
    pub(crate) fn push(&mut self, samples: &[Sample]) -> usize {
        let first = self.n_places / WIDTH;
        self.merged.push(samples);
        if let Some(ao) = &mut self.ao {
            ao.push(samples.iter().map(|sample| sample.ao));
        }
        match &mut self.albedo {
            Albedo::Same(_) => {}
            Albedo::Codes(codes) => codes.extend(samples.iter().map(Sample::code)),
            Albedo::Halves(halves) => halves.extend(samples.iter().map(Sample::halves)),
        }
        self.stands_for.extend(samples.iter().map(|sample| sample.stands_for));
        self.n_places += padded(samples.len());
        self.stands_for.resize(self.n_places - padded(self.len), 0);
        self.pad_albedo(self.n_places);
        first
    }

    /// Gives a merged surfel an albedo and an accessibility.
    pub(crate) fn put_sample(&mut self, place: usize, sample: &Sample) {
        match &mut self.albedo {
            Albedo::Same(_) => {}
            Albedo::Codes(codes) => codes[place] = sample.code(),
            Albedo::Halves(halves) => halves[place] = sample.halves(),
        }
        if let Some(ao) = &mut self.ao {
            ao.put(place, sample.ao);
        }
    }

    fn pad_albedo(&mut self, n: usize) {
        match &mut self.albedo {
            Albedo::Same(_) => {}
            Albedo::Codes(codes) => codes.resize(n, 0),
            Albedo::Halves(halves) => halves.resize(n, [f16::ZERO; 4]),
        }
    }

    /// Draws all with one albedo from now on, linear Rec. 709.
    pub fn forget_albedo(&mut self, same: [f32; 3]) {
        self.albedo = Albedo::Same(same);
    }

    /// Draws all with an accessibility of 1 from now on.
    pub fn forget_ao(&mut self) {
        self.ao = None;
    }

    /// Draws all with material 0 from now on.
    pub fn forget_material(&mut self) {
        self.material = None;
    }

    /// Draws all without normal fields from now on.
    pub fn forget_fields(&mut self) {
        self.splats.fields = None;
    }

    /// Whether something varies over surfels that is drawn.
    pub(crate) fn varies(&self, with_fields: bool) -> bool {
        !self.splats.clips.is_empty() || with_fields && self.splats.fields.is_some()
    }

    /// Number of surfels.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Bytes in memory, but for the order.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let parts = self.parts.iter().filter_map(OnceLock::get).map(OrderedGeometry::bytes);
        let albedo = match &self.albedo {
            Albedo::Same(_) => 0,
            Albedo::Codes(codes) => 4 * codes.len(),
            Albedo::Halves(halves) => 8 * halves.len(),
        };
        let ao = self.ao.as_ref().map_or(0, |_| 4 * self.n_places);
        let material = self.material.as_ref().map_or(0, |all| 4 * all.len());
        parts.sum::<usize>()
            + self.merged.bytes()
            + ao
            + albedo
            + material
            + self.splats.bytes()
            + 4 * self.stands_for.len()
            + self.blocks.len() * size_of::<Block>()
            + self.above.as_ref().map_or(0, Above::bytes)
    }

    /// The surfel that a place is, or one of those that it stands for.
    #[inline(always)]
    pub(crate) fn surfel_at(&self, place: usize) -> u32 {
        match place.checked_sub(padded(self.len)) {
            Some(merged) => self.stands_for[merged],
            None => place as u32,
        }
    }

    #[inline(always)]
    pub(crate) fn ao_of(&self, place: usize) -> f32 {
        self.ao.as_ref().map_or(1.0, |ao| ao.one(place))
    }

    /// The material of a surfel, by its number in drawing order.
    pub(crate) fn material_of(&self, surfel: u32) -> u32 {
        self.material.as_ref().map_or(0, |all| all[surfel as usize])
    }

    #[inline(always)]
    pub(crate) fn albedo_of(&self, place: usize, linear_of_srgb: &[f32; 256]) -> [f32; 3] {
        match &self.albedo {
            Albedo::Same(albedo) => *albedo,
            Albedo::Codes(codes) => {
                let code = codes[place];
                [0, 8, 16].map(|shift| linear_of_srgb[(code >> shift & 255) as usize])
            }
            Albedo::Halves(halves) => {
                let [r, g, b, _] = halves[place];
                [r.to_f32(), g.to_f32(), b.to_f32()]
            }
        }
    }
}

/// Whoever draws or reads places makes their parts before.
#[cold]
fn never_made() -> ! {
    panic!("a part of a cloud is read that was never put in order")
}

fn padded(n: usize) -> usize {
    n.next_multiple_of(WIDTH)
}
