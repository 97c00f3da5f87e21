//! A cloud's columns as they are drawn: in drawing order, in groups of lanes.

use crate::fields::Splats;
use crate::lanes::{F, V, WIDTH};
use crate::level_of_detail::block::Block;
use crate::level_of_detail::merge::Sample;
use crate::level_of_detail::{self, Above};
use fearless_simd::prelude::*;
use half::f16;
use rayon::prelude::*;
use std::sync::Arc;

/// Three numbers of each surfel, by groups.
#[derive(Default)]
pub(crate) struct Triples(Vec<[[f32; WIDTH]; 3]>);

/// Groups that a thread fills at a time.
const GROUPS: usize = 1 << 10;

/// A value of each surfel in this order, by groups, made by all threads.
fn ordered<T: Copy + Default + Send + Sync>(
    order: &[u32],
    put: impl Fn(&mut T, usize, usize) + Sync,
) -> Vec<T> {
    let mut groups = vec![T::default(); order.len().div_ceil(WIDTH)];
    let each = groups.par_chunks_mut(GROUPS).zip(order.par_chunks(GROUPS * WIDTH));
    each.for_each(|(groups, order)| {
        for (group, order) in groups.iter_mut().zip(order.chunks(WIDTH)) {
            for (lane, &i) in order.iter().enumerate() {
                put(group, lane, i as usize);
            }
        }
    });
    groups
}

impl Triples {
    fn ordered(order: &[u32], value: impl Fn(usize) -> [f32; 3] + Sync) -> Self {
        let put = |group: &mut [[f32; WIDTH]; 3], lane: usize, i: usize| {
            for (axis, x) in value(i).into_iter().enumerate() {
                group[axis][lane] = x;
            }
        };
        Self(ordered(order, put))
    }

    fn push(&mut self, values: impl ExactSizeIterator<Item = [f32; 3]>) {
        let first = self.0.len();
        self.0.resize(first + values.len().div_ceil(WIDTH), [[0.0; WIDTH]; 3]);
        for (i, value) in values.enumerate() {
            for (axis, x) in value.into_iter().enumerate() {
                self.0[first + i / WIDTH][axis][i % WIDTH] = x;
            }
        }
    }

    #[inline(always)]
    pub(crate) fn at<S: Simd>(&self, simd: S, group: usize) -> V<S> {
        V::load(simd, &self.0[group])
    }

    #[inline(always)]
    pub(crate) fn one(&self, place: usize) -> [f32; 3] {
        let group = &self.0[place / WIDTH];
        [0, 1, 2].map(|axis| group[axis][place % WIDTH])
    }
}

/// A number of each surfel, by groups; zeros where a group is not full.
#[derive(Default)]
pub(crate) struct Singles(Vec<[f32; WIDTH]>);

impl Singles {
    fn ordered(order: &[u32], value: impl Fn(usize) -> f32 + Sync) -> Self {
        Self(ordered(order, |group: &mut [f32; WIDTH], lane, i| group[lane] = value(i)))
    }

    fn push(&mut self, values: impl ExactSizeIterator<Item = f32>) {
        let first = self.0.len();
        self.0.resize(first + values.len().div_ceil(WIDTH), [0.0; WIDTH]);
        for (i, value) in values.enumerate() {
            self.0[first + i / WIDTH][i % WIDTH] = value;
        }
    }

    #[inline(always)]
    pub(crate) fn at<S: Simd>(&self, simd: S, group: usize) -> F<S> {
        F::load_array_ref(simd, &self.0[group])
    }

    #[inline(always)]
    pub(crate) fn one(&self, place: usize) -> f32 {
        self.0[place / WIDTH][place % WIDTH]
    }

    pub(crate) fn put(&mut self, place: usize, value: f32) {
        self.0[place / WIDTH][place % WIDTH] = value;
    }
}

/// Discs, or ellipses.
pub(crate) enum Shape {
    /// Radii in scene units.
    Radius(Singles),
    /// Half axes in scene units.
    Tangents(Triples, Triples),
}

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
    pub(crate) positions: Triples,
    pub(crate) normals: Triples,
    pub(crate) shape: Shape,
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

/// Columns in the order of the file; vectors are three numbers a surfel.
pub struct Sources<'a> {
    /// Relative to the cloud's origin, scene units.
    pub positions: &'a [f32],
    /// Unit.
    pub normals: &'a [f32],
    /// Scene units; not read where there are tangents.
    pub radii: &'a [f32],
    /// Not 0 where a surfel is a round splat that faces the eye; none is where there are tangents.
    pub round: Option<&'a [u8]>,
    /// Half axes of ellipses, scene units.
    pub tangents: Option<[&'a [f32]; 2]>,
    /// Ambient accessibility.
    pub ao: Option<&'a [f32]>,
    /// Indices of materials.
    pub materials: Option<&'a [u32]>,
}

/// The radius that a surfel is drawn with: negative where it is a round splat that faces the eye. Radii that are not
/// positive are of no surfel.
#[inline]
#[must_use]
pub fn radius_drawn(radius: f32, is_round: bool) -> f32 {
    let radius = radius.max(0.0);
    if is_round { -radius } else { radius }
}

fn three(values: &[f32], i: usize) -> [f32; 3] {
    [values[3 * i], values[3 * i + 1], values[3 * i + 2]]
}

impl Columns {
    /// Puts columns into drawing order: `order` holds the surfels' places in the file, all below the
    /// columns' length; it is let go of before what needs most memory. Albedos and what varies over splats
    /// are in drawing order already. `report` hears how far it is, in [0, 1].
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
        let positions = Triples::ordered(&order, |i| three(sources.positions, i));
        report(0.15);
        let normals = Triples::ordered(&order, |i| three(sources.normals, i));
        report(0.3);
        let shape = match sources.tangents {
            Some(axes) => {
                let [u, v] = axes.map(|axis| Triples::ordered(&order, |i| three(axis, i)));
                Shape::Tangents(u, v)
            }
            None => Shape::Radius(Singles::ordered(&order, |i| {
                radius_drawn(sources.radii[i], sources.round.is_some_and(|round| round[i] != 0))
            })),
        };
        let ao = sources.ao.map(|values| Singles::ordered(&order, |i| values[i]));
        let material = sources.materials;
        let mut columns = Self {
            len: order.len(),
            n_places: order.len().next_multiple_of(WIDTH),
            positions,
            normals,
            has_round: sources.tangents.is_none()
                && sources.round.is_some_and(|round| round.iter().any(|&is_round| is_round != 0)),
            shape,
            albedo,
            ao,
            material: material.map(|all| order.par_iter().map(|&i| all[i as usize]).collect()),
            splats,
            stands_for: Vec::new(),
            blocks: Vec::new(),
            roots: 0..0,
            above: None,
            max_reach: 0.0,
        };
        drop(order);
        report(0.4);
        columns.merge(merging, linear_of_srgb, &|done| report(0.4 + 0.6 * done));
        columns
    }

    /// Whether a group is of merged surfels.
    pub(crate) fn is_merged(&self, group: usize) -> bool {
        group * WIDTH >= self.len
    }

    /// Makes the tree of blocks and the merged surfels.
    fn merge(
        &mut self,
        merging: Merging,
        linear_of_srgb: &[f32; 256],
        report: &(dyn Fn(f32) + Sync),
    ) {
        self.pad_albedo(self.n_places);
        let merges = merging != Merging::No && matches!(self.shape, Shape::Radius(_));
        let how = (merges, merging == Merging::Repaintable);
        let tree = level_of_detail::tree(self, how, linear_of_srgb, report);
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
        self.positions.push(samples.iter().map(|sample| sample.position));
        self.normals.push(samples.iter().map(|sample| sample.normal));
        if let Shape::Radius(radii) = &mut self.shape {
            radii.push(samples.iter().map(|one| radius_drawn(one.radius, one.is_round)));
        }
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

    /// Bytes in memory.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let shape = match self.shape {
            Shape::Radius(_) => 1,
            Shape::Tangents(..) => 6,
        };
        let albedo = match &self.albedo {
            Albedo::Same(_) => 0,
            Albedo::Codes(codes) => 4 * codes.len(),
            Albedo::Halves(halves) => 8 * halves.len(),
        };
        let words = 6 + shape + usize::from(self.ao.is_some());
        let material = self.material.as_ref().map_or(0, |all| 4 * all.len());
        self.n_places * words * 4
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

fn padded(n: usize) -> usize {
    n.next_multiple_of(WIDTH)
}
