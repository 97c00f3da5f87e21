//! Which nodes lie behind others: what is drawn coarsely first hides what need not be finer.
//!
//! The nodes of a coarser cut are drawn into a buffer of depths, one of each cell of some pixels, at whose centre a disc
//! counts as it does in a picture. A node of which every cell has something nearer is hidden. Where the coarser surfels
//! cover gaps that finer ones leave, what is seen through these is drawn as coarse as the nodes that were hidden, and
//! never left out.

use crate::cut::CutView;
use crate::layout::NodeRecord;
use glam::{DMat4, Mat4, Vec3};
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use surfelshop_api::columns::{CLIP, OPACITY, ROUND, SPLAT_SCALE, TANGENT_U};
use surfelshop_api::{SurfaceSettings, View};
use surfelshop_cloud::{Buffer, Cloud, Column};

/// Pixels of a cell for each pixel of detail: half the radius of the largest merged surfels that are drawn into cells.
const CELL: f64 = 4.0;
/// Most cells along a side: posters need no finer ones.
const MAX_CELLS: f64 = 2048.0;
/// Most cells along a side that are looked at for a node; of larger ones they are taken together.
const LOOKED_AT: u32 = 16;
/// Surfels that a thread draws at once.
const AT_ONCE: usize = 16_384;

/// Depths of what is drawn coarsely in a view.
#[derive(Clone, Debug)]
pub struct Occlusion {
    view: CutView,
    /// Surfels are blended with what lies so many radii before them.
    tolerance: f64,
    cell_px: f64,
    /// The cells, and the farthest of four each in those above; infinite where nothing is drawn.
    levels: Vec<Level>,
}

#[derive(Clone, Debug)]
struct Level {
    size: [u32; 2],
    depths: Vec<f32>,
}

/// Where cells look, and what is drawn of discs.
struct Lens {
    size: [u32; 2],
    /// A cell's centre is seen at `first + cell * step`: tangents, or scene units where parallel; y downwards.
    first: [f32; 2],
    step: [f32; 2],
    orthographic: bool,
    two_sided: bool,
    near: f32,
    radius_scale: f32,
    tolerance: f32,
}

impl Occlusion {
    /// Depths of clouds that are drawn in a view, as a scene places and displays them. Only discs hide anything: round
    /// splats, transparent, cut and elliptic ones do not. Of views without pixels, and of none, nothing hides anything.
    #[must_use]
    pub fn new(
        cut: &CutView,
        view: &View,
        surface: &SurfaceSettings,
        clouds: &[Arc<Cloud>],
    ) -> Self {
        let longest = f64::from(view.size_px[0].max(view.size_px[1]));
        let cell_px = (CELL * cut.detail_px).max(longest / MAX_CELLS).max(1.0);
        let size = view.size_px.map(|side| ((f64::from(side) / cell_px).floor() as u32).max(1));
        let half = view.half_extent();
        let across = [0, 1].map(|i| 2.0 * half[i] * cell_px / f64::from(view.size_px[i].max(1)));
        let lens = Lens {
            size,
            first: [0, 1].map(|i| (0.5 * across[i] - half[i]) as f32),
            step: across.map(|step| step as f32),
            orthographic: cut.orthographic,
            two_sided: surface.two_sided,
            near: view.near as f32,
            radius_scale: surface.radius_scale,
            tolerance: surface.depth_tolerance,
        };
        let n = size[0] as usize * size[1] as usize;
        let depths: Vec<AtomicU32> =
            std::iter::repeat_with(|| AtomicU32::new(f32::INFINITY.to_bits())).take(n).collect();
        let hides = |cloud: &&Arc<Cloud>| {
            [OPACITY, CLIP, TANGENT_U, SPLAT_SCALE].iter().all(|name| cloud.column(name).is_none())
        };
        clouds.par_iter().filter(hides).for_each(|cloud| {
            let view_from_cloud = view.view_from_offset(cloud.origin());
            lens.draw_cloud(view_from_cloud, cloud, &depths);
        });
        let depths = depths.into_iter().map(|bits| f32::from_bits(bits.into_inner())).collect();
        let mut levels = vec![Level { size, depths }.closed()];
        while let Some(above) = levels.last().and_then(Level::above) {
            levels.push(above);
        }
        Self { view: *cut, tolerance: f64::from(surface.depth_tolerance), cell_px, levels }
    }

    /// Whether all of a node lies behind something in every cell that it reaches.
    pub(crate) fn hides(&self, node: &NodeRecord) -> bool {
        let (middle, reach) = self.view.sphere(node);
        let depth = -middle.z;
        // Its surfels may be blended with what lies before them.
        let blended =
            f64::from(node.reach) * self.view.radius_scale * self.view.scale * self.tolerance;
        let nearest = depth - reach - blended;
        if !middle.is_finite() || nearest.is_nan() || depth - reach <= self.view.near {
            return false;
        }
        let margin = (self.view.low_pass + 1.0) / self.cell_px + 1.0;
        let range = |axis: usize, along: f64| {
            let half = self.view.half_extent[axis];
            let cells = f64::from(self.view.size_px[axis]) / self.cell_px;
            let ends = match self.view.orthographic {
                true => [along - reach, along + reach],
                // A box around it, whose corners are seen farthest out on its front or its back.
                false => [
                    ((along - reach) / (depth - reach)).min((along - reach) / (depth + reach)),
                    ((along + reach) / (depth - reach)).max((along + reach) / (depth + reach)),
                ],
            };
            let last = f64::from(self.levels[0].size[axis] - 1);
            let cell = |end: f64| 0.5 * (end / half + 1.0) * cells;
            // Outside of the picture nothing has to be hidden.
            let first = (cell(ends[0]) - margin).floor().clamp(0.0, last) as u32;
            [first, (cell(ends[1]) + margin).ceil().clamp(f64::from(first), last) as u32]
        };
        let (x, y) = (range(0, middle.x), range(1, -middle.y));
        let mut shift = 0;
        while (x[1] >> shift).max(y[1] >> shift) > 0
            && ((x[1] >> shift) - (x[0] >> shift)).max((y[1] >> shift) - (y[0] >> shift))
                >= LOOKED_AT
        {
            shift += 1;
        }
        let Some(level) = self.levels.get(shift) else { return false };
        (y[0] >> shift..=y[1] >> shift).all(|row| {
            let row = (row * level.size[0]) as usize;
            let cells = row + (x[0] >> shift) as usize..=row + (x[1] >> shift) as usize;
            level.depths[cells].iter().all(|&depth| f64::from(depth) < nearest)
        })
    }
}

impl Level {
    /// The same without gaps of up to two cells, which coarse discs leave where they are seen from the side: what is
    /// around them is widened by a cell and narrowed again.
    fn closed(self) -> Self {
        let nearer = |a: f32, b: f32| a.min(b);
        let farther = |a: f32, b: f32| a.max(b);
        self.filtered(nearer).filtered(farther)
    }

    /// What a function leaves of each cell and its eight neighbours, beyond the borders of which there are none.
    fn filtered(self, of: impl Fn(f32, f32) -> f32 + Sync) -> Self {
        let width = self.size[0] as usize;
        let mut across = self.depths.clone();
        across.par_chunks_mut(width).zip(self.depths.par_chunks(width)).for_each(|(to, row)| {
            for x in 0..width {
                let beside = of(row[x.saturating_sub(1)], row[(x + 1).min(width - 1)]);
                to[x] = of(row[x], beside);
            }
        });
        let mut depths = self.depths;
        let last = self.size[1] as usize - 1;
        depths.par_chunks_mut(width).enumerate().for_each(|(y, to)| {
            let row = |y: usize| &across[y * width..(y + 1) * width];
            let (above, here, below) = (row(y.saturating_sub(1)), row(y), row((y + 1).min(last)));
            for x in 0..width {
                to[x] = of(here[x], of(above[x], below[x]));
            }
        });
        Self { size: self.size, depths }
    }

    /// The level above, with a quarter of the cells; none of a single cell.
    fn above(&self) -> Option<Self> {
        let [width, height] = self.size;
        if width * height == 1 {
            return None;
        }
        let size = self.size.map(|side| side.div_ceil(2));
        let at =
            |x: u32, y: u32| self.depths[(y.min(height - 1) * width + x.min(width - 1)) as usize];
        let farthest =
            |x: u32, y: u32| at(x, y).max(at(x + 1, y)).max(at(x, y + 1)).max(at(x + 1, y + 1));
        let rows = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (2 * x, 2 * y)));
        Some(Self { size, depths: rows.map(|(x, y)| farthest(x, y)).collect() })
    }
}

impl Lens {
    fn draw_cloud(&self, view_from_cloud: DMat4, cloud: &Cloud, depths: &[AtomicU32]) {
        let (positions, normals, radii) = (cloud.positions(), cloud.normals(), cloud.radii());
        if normals.len() != positions.len() || radii.len() != positions.len() {
            return;
        }
        let round: &[u8] = match cloud.column(ROUND).map(Column::values) {
            Some(Buffer::U8(round)) => round,
            _ => &[],
        };
        let motion = view_from_cloud.as_mat4();
        (0..positions.len()).into_par_iter().with_min_len(AT_ONCE).for_each(|i| {
            if round.get(i).is_none_or(|&round| round == 0) {
                let radius = radii[i] * self.radius_scale;
                self.draw(motion, (positions[i], normals[i], radius), depths);
            }
        });
    }

    /// Draws a disc: its depth in each cell whose centre it covers, and as much more as it may be blended with.
    fn draw(
        &self,
        motion: Mat4,
        (position, normal, radius): (Vec3, Vec3, f32),
        depths: &[AtomicU32],
    ) {
        let center = motion.transform_point3(position);
        let distance = -center.z;
        let before = if self.orthographic { 1.0 } else { distance - radius };
        // Also of what is not a number.
        if !(radius > 0.0 && distance - radius > self.near && before > 0.0 && center.is_finite()) {
            return;
        }
        let normal = motion.transform_vector3(normal);
        let towards = if self.orthographic { normal.z } else { -normal.dot(center) };
        if towards == 0.0 || (!self.two_sided && towards < 0.0) {
            return;
        }
        let cells = |axis: usize, along: f32| {
            // The edge of a box around it is seen at most so far from its middle.
            let (middle, half) = match self.orthographic {
                true => (along, radius),
                false => (along / distance, radius / before * (1.0 + (along / distance).abs())),
            };
            let cell = |end: f32| (end - self.first[axis]) / self.step[axis];
            let last = (self.size[axis] - 1) as f32;
            let (first, end) = (cell(middle - half).ceil(), cell(middle + half).floor());
            (first.max(0.0) <= end.min(last)).then(|| (first.max(0.0) as u32, end.min(last) as u32))
        };
        let (Some((left, right)), Some((top, bottom))) = (cells(0, center.x), cells(1, -center.y))
        else {
            return;
        };
        let blended = self.tolerance * radius;
        for row in top..=bottom {
            let y = -(self.first[1] + row as f32 * self.step[1]);
            for column in left..=right {
                let x = self.first[0] + column as f32 * self.step[0];
                let Some(depth) = self.depth([x, y], center, normal, radius) else { continue };
                let bits = (depth + blended).to_bits();
                let cell = &depths[(row * self.size[0] + column) as usize];
                // Bits of floats above 0 are in the order of these. Looking costs less than storing.
                if bits < cell.load(Ordering::Relaxed) {
                    cell.fetch_min(bits, Ordering::Relaxed);
                }
            }
        }
    }

    /// Distance along the viewing axis at which a ray meets a disc.
    fn depth(&self, [x, y]: [f32; 2], center: Vec3, normal: Vec3, radius: f32) -> Option<f32> {
        let (start, direction) = match self.orthographic {
            true => (Vec3::new(x, y, 0.0), Vec3::NEG_Z),
            false => (Vec3::ZERO, Vec3::new(x, y, -1.0)),
        };
        let depth = normal.dot(center - start) / normal.dot(direction);
        let off = start + direction * depth - center;
        (depth > 0.0 && off.length_squared() <= radius * radius).then_some(depth)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cut::Cut;
    use glam::DVec3;
    use surfelshop_api::{Camera, Projection};
    use surfelshop_cloud::Column;

    /// A wall across the view, 5 units before the eye, of discs 0.1 apart, with what `more` says of each.
    fn wall(keep: impl Fn(f32, f32) -> bool, more: &[Column]) -> Arc<Cloud> {
        let places =
            (-60..=60).flat_map(|i| (-60..=60).map(move |j| [0.1 * i as f32, 0.1 * j as f32]));
        let places: Vec<_> = places.filter(|&[x, y]| keep(x, y)).collect();
        let position = places.iter().flat_map(|&[x, y]| [x, y, -5.0]).collect();
        let normal = places.iter().flat_map(|_| [0.0, 0.0, 1.0]).collect();
        let mut columns = vec![
            Column::new("position", 3, Buffer::F32(position)),
            Column::new("normal", 3, Buffer::F32(normal)),
            Column::new("radius", 1, Buffer::F32(vec![0.15; places.len()])),
        ];
        columns.extend(more.iter().cloned());
        // Far from the origin, where the pyramid is, too.
        Arc::new(Cloud::new(DVec3::X * 1e6, columns).unwrap())
    }

    fn views() -> [View; 2] {
        [Projection::Perspective { fov_y: 1.0 }, Projection::Orthographic { height: 6.0 }].map(
            |projection| {
                let (eye, target) = (DVec3::X * 1e6, DVec3::new(1e6, 0.0, -1.0));
                let camera = Camera { eye, target, up: DVec3::Y, projection };
                View { camera, size_px: [200, 150], near: 0.1, far: 100.0 }
            },
        )
    }

    fn occlusion(view: &View, surface: &SurfaceSettings, wall: Arc<Cloud>) -> Occlusion {
        let cut = CutView::new(view, surface, &Default::default(), 1.0);
        Occlusion::new(&cut, view, surface, &[wall])
    }

    /// A node about a place, from the eye.
    fn node(x: f64, y: f64, z: f64) -> NodeRecord {
        let middle = DVec3::new(1e6 + x, y, z);
        NodeRecord { middle, spread: 0.4, reach: 0.1, cosine: -1.0, ..NodeRecord::default() }
    }

    #[test]
    fn what_lies_behind_a_wall_is_hidden_and_nothing_else() {
        let surface = SurfaceSettings::default();
        for view in views() {
            let whole = occlusion(&view, &surface, wall(|_, _| true, &[]));
            assert!(whole.hides(&node(0.0, 0.0, -8.0)) && whole.hides(&node(1.5, -1.0, -20.0)));
            for seen in [-5.0, -5.4, -3.0, 1.0] {
                assert!(!whole.hides(&node(0.0, 0.0, seen)), "{seen}");
            }
            // A gap of some cells shows what is behind it and nothing beside it.
            let gap = occlusion(&view, &surface, wall(|x, y| x.hypot(y) > 0.6, &[]));
            assert!(!gap.hides(&node(0.0, 0.0, -8.0)) && gap.hides(&node(2.0, 0.0, -8.0)));
            // Half a wall hides what is behind it, as far as its end.
            let half = occlusion(&view, &surface, wall(|x, _| x < 0.0, &[]));
            assert!(half.hides(&node(-1.5, 0.0, -8.0)) && !half.hides(&node(0.0, 0.0, -8.0)));
            assert!(!half.hides(&node(1.5, 0.0, -8.0)));
            // What lies outside of the picture need not be covered.
            assert!(whole.hides(&node(if half.view.orthographic { 4.0 } else { 5.5 }, 0.0, -8.0)));
        }
    }

    #[test]
    fn only_opaque_discs_hide() {
        let [view, _] = views();
        let (one_sided, n) =
            (SurfaceSettings { two_sided: false, ..SurfaceSettings::default() }, 121 * 121);
        let behind = node(0.0, 0.0, -8.0);
        let with = |column: Column| wall(|_, _| true, &[column]);
        let usual = SurfaceSettings::default();
        assert!(occlusion(&view, &one_sided, wall(|_, _| true, &[])).hides(&behind));
        let round = |value: u8| with(Column::new(ROUND, 1, Buffer::U8(vec![value; n])));
        assert!(occlusion(&view, &usual, round(0)).hides(&behind));
        assert!(!occlusion(&view, &usual, round(1)).hides(&behind));
        let opacity = with(Column::new(OPACITY, 1, Buffer::F32(vec![1.0; n])));
        assert!(!occlusion(&view, &usual, opacity).hides(&behind));
        // Backs of one-sided ones are not drawn.
        let normal = Column::new("normal", 3, Buffer::F32([0.0, 0.0, -1.0].repeat(n)));
        let away = Arc::new(wall(|_, _| true, &[]).with_columns(vec![normal]).unwrap());
        assert!(!occlusion(&view, &one_sided, Arc::clone(&away)).hides(&behind));
        assert!(occlusion(&view, &usual, away).hides(&behind));
        assert!(!occlusion(&view, &usual, wall(|_, _| false, &[])).hides(&behind));
    }

    #[test]
    fn hidden_nodes_are_drawn_coarser_and_never_left_out() {
        let [view, _] = views();
        let surface = SurfaceSettings::default();
        let of_wall = occlusion(&view, &surface, wall(|x, _| x < 0.0, &[]));
        let parent = |first: u32, x: f64| NodeRecord {
            children: [first, 2],
            n_surfels: 100,
            grain: 0.1,
            apart: 0.1,
            ..node(x, 0.0, -8.0)
        };
        let leaf = |x: f64| NodeRecord { n_surfels: 100, ..node(x, 0.0, -8.0) };
        let root = NodeRecord { spread: 3.0, grain: 2.0, reach: 2.0, ..parent(1, 0.0) };
        let nodes =
            [root, parent(3, -1.5), parent(5, 1.5), leaf(-1.6), leaf(-1.4), leaf(1.4), leaf(1.6)];
        let cut = CutView::new(&view, &surface, &Default::default(), 1.0);
        let plain = Cut::of(&nodes, &cut, u64::MAX, |_| true, None);
        assert_eq!((plain.nodes, plain.n_hidden), (vec![3, 4, 5, 6], 0));
        let seen = Cut::of(&nodes, &cut, u64::MAX, |_| true, Some(&of_wall));
        assert_eq!((seen.nodes, seen.n_hidden, seen.coarsest_px), (vec![1, 5, 6], 1, 0.0));
        // Too coarse is too coarse.
        let fine = CutView { detail_px: 0.1, ..cut };
        let all = Cut::of(&nodes, &fine, u64::MAX, |_| true, Some(&of_wall));
        assert_eq!((all.nodes, all.n_hidden), (vec![3, 4, 5, 6], 0));
    }
}
