//! The surfels of a cloud, made ready: scaled to a box of unit size, sorted along a curve, with
//! their effective areas.

use crate::settings::Settings;
use std::ops::ControlFlow;
use surfelshop_api::columns::{CONTEXT, NORMAL, POSITION};
use surfelshop_api::glam::{DVec3, Vec3};
use surfelshop_api::prelude::*;
use surfelshop_geometry::octree::Octree;
use surfelshop_geometry::{Bounds, Cancelled, areas, normals, part};

/// Most surfels in a leaf of the tree: fewer are summed one by one at less cost than a node.
const LEAF: usize = 8;

/// Surfels in the order of the tree; lengths in units of the box.
pub(crate) struct Surfels {
    /// For each surfel its index in the cloud.
    pub(crate) order: Vec<u32>,
    pub(crate) positions: Vec<Vec3>,
    /// Unit vectors that point outwards.
    pub(crate) normals: Vec<Vec3>,
    /// Effective areas; what has none casts no shadow.
    pub(crate) areas: Vec<f32>,
    /// Which are only around the part of a cloud that is looked at: they cast shadows, and nobody asks for theirs.
    /// Empty where the cloud is whole.
    pub(crate) context: Vec<bool>,
    /// Its ranges are of the places here.
    pub(crate) tree: Octree,
    /// Scene units per unit of the box.
    pub(crate) unit: f64,
    /// Surfels left out, since their position or normal is not finite or the normal is zero.
    pub(crate) n_refused: usize,
    /// Surfels left out, since they lie far away from the bulk of the cloud.
    pub(crate) n_strays: usize,
}

/// Occlusion of each surfel, by place, and what is to be said of how it was found.
pub(crate) type Occlusion = (Vec<f32>, String);

/// How much of the preparation is which part, by measured time.
const AREAS: f64 = 0.8;

impl Surfels {
    /// The distance beyond which nothing counts, units of the box.
    pub(crate) fn max_distance(&self, settings: &Settings) -> f32 {
        match settings.max_distance {
            0.0 => f32::INFINITY,
            distance => (f64::from(distance) / self.unit) as f32,
        }
    }

    /// Reads a cloud; progress goes from 0 to `share`.
    pub(crate) fn of(cloud: &CloudView<'_>, share: f64, job: &Job<'_>) -> Result<Self> {
        job.progress(0.0, "measuring the area of each surfel");
        let missing = |name: &str, what: &str| {
            Error::new(format!("expected a column `{name}` ({what}), found none"))
        };
        let floats = cloud.floats(POSITION, 3);
        floats.ok_or_else(|| missing(POSITION, "3 x f32"))?;
        let floats = cloud.floats(NORMAL, 3);
        floats.ok_or_else(|| missing(NORMAL, "3 x f32; the tool `normals` makes one"))?;
        let positions: Vec<Vec3> = cloud.vectors(POSITION).collect();
        let given: Vec<Vec3> = cloud.vectors(NORMAL).collect();
        let sound = |i: usize| positions[i].is_finite() && normals::is_valid(given[i]);
        let kept: Vec<u32> = (0..positions.len()).filter(|&i| sound(i)).map(|i| i as u32).collect();

        // The bulk of the cloud gets about unit size, so that neither squares nor products of areas
        // leave the range of f32, whatever strays there are.
        let at = |i: u32| positions[i as usize];
        let (middle, unit) = bulk(kept.iter().map(|&i| at(i)).collect());
        let in_box = |i: u32| ((at(i).as_dvec3() - middle) / unit).as_vec3();
        let n_sound = kept.len();
        let kept: Vec<u32> =
            kept.into_iter().filter(|&i| in_box(i).abs().max_element() <= FARTHEST).collect();
        let n_strays = n_sound - kept.len();
        let boxed: Vec<Vec3> = kept.iter().map(|&i| in_box(i)).collect();
        let given: Vec<Vec3> =
            kept.iter().map(|&i| normals::normalised(given[i as usize])).collect();

        let progress = |fraction: f64| {
            job.progress(share * fraction, "");
            if job.cancelled() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let stopped = |Cancelled| Error::new(surfelshop_api::job::CANCELLED);
        let areas =
            areas::effective(&boxed, &given, &part(&progress, 0.0..AREAS)).map_err(stopped)?;
        let tree = Octree::build(&boxed, LEAF, &part(&progress, AREAS..1.0)).map_err(stopped)?;
        let places = || tree.order().iter().map(|&place| place as usize);
        let is_context = |place: usize| cloud.is_context(kept[place] as usize);
        let context = match cloud.column(CONTEXT) {
            Some(_) => places().map(is_context).collect(),
            None => Vec::new(),
        };
        Ok(Self {
            context,
            order: places().map(|place| kept[place]).collect(),
            positions: places().map(|place| boxed[place]).collect(),
            normals: places().map(|place| given[place]).collect(),
            areas: places().map(|place| areas[place]).collect(),
            n_refused: positions.len() - n_sound,
            n_strays,
            tree,
            unit,
        })
    }

    /// Whether a surfel is only around those that are looked at.
    pub(crate) fn is_context(&self, place: usize) -> bool {
        self.context.get(place).copied().unwrap_or_default()
    }

    /// Number of surfels.
    pub(crate) fn len(&self) -> usize {
        self.positions.len()
    }
}

/// Coordinates in the box beyond which surfels stray: at a thousand times the size of the bulk, f32
/// and the hierarchies' grids still resolve a thousandth of it.
const FARTHEST: f32 = 1000.0;

/// The middle of most positions, and the size of what holds all but a hundredth on either side. Strays
/// move the bounds far away from everything else, where f32 would lose its digits.
fn bulk(mut positions: Vec<Vec3>) -> (DVec3, f64) {
    let last = positions.len().saturating_sub(1);
    if positions.is_empty() {
        return (DVec3::ZERO, 1.0);
    }
    let bounds = Bounds::of_positions(&positions);
    let mut at = |axis: usize, rank: usize| {
        let order = |a: &Vec3, b: &Vec3| a[axis].total_cmp(&b[axis]);
        f64::from(positions.select_nth_unstable_by(rank, order).1[axis])
    };
    let hundredth = last / 100;
    let (mut middle, mut size) = (DVec3::ZERO, 0.0f64);
    for axis in 0..3 {
        middle[axis] = at(axis, last / 2);
        size = size.max(at(axis, last - hundredth) - at(axis, hundredth));
    }
    // Nearly all in one place: then all that is beside it is the bulk.
    if size <= 0.0 {
        size = bounds.map_or(0.0, |bounds| bounds.extent());
    }
    (middle, if size > 0.0 { size } else { 1.0 })
}
