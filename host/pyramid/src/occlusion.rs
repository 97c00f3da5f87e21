//! Which nodes of a cut are visible: what others hide need not be as fine.
//!
//! All surfels of the cut are drawn into a grid of depths, a cell a pixel; then those of a node are looked up in it. Both
//! err to one side: what hides is drawn where a disc covers a pixel's centre, as deep as what it stands for may lie, and
//! what is looked up reaches as far as it may be drawn, with all that it stands for. Only gaps that lie between the centres
//! of pixels are overlooked, which antialiased pictures may show.

use glam::{DMat4, Mat4, Vec3};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering};
use surfelshop_api::columns::{CLIP, OPACITY, ROUND, SPLAT_SCALE, TANGENT_U};
use surfelshop_api::{Projection, SurfaceSettings, View};
use surfelshop_cloud::{Buffer, Cloud, Column};

/// Most pixels along a side: of larger pictures, which a cell for each pixel would take too long for, nothing is known.
const MAX_SIDE: u32 = 4096;
/// What is looked up covers at most so many cells across, of the finest level where it does.
const LOOKED_AT: u32 = 3;
/// A disc that the low-pass widens follows its plane out of its own outline, by at most so many times the width of that.
const SLOPE: f32 = 2.0;
/// What is brought nearer is so by the tolerance times the longer half axis of the widened disc, at most so many times.
const BROUGHT: f32 = 4.0;
/// Surfels that a thread looks at.
const AT_ONCE: usize = 4096;

/// A node of a cut as it is shown.
#[derive(Clone, Copy, Debug)]
pub struct ShownNode<'a> {
    /// Its surfels in the scene.
    pub cloud: &'a Cloud,
    /// How far from its merged surfels those that they stand for may lie, scene units; 0 of a leaf.
    pub apart: f32,
}

/// What a view shows, cell by cell: depths of surfels that hide what lies behind them.
pub struct DepthGrid {
    view: View,
    lens: Lens,
    /// Bits of the depths of nodes that were added for good; infinite where nothing is drawn.
    depths: Vec<AtomicU32>,
}

impl DepthGrid {
    /// A grid of a view in which nothing hides anything; nothing for a view without pixels or with more than 4096 along a
    /// side.
    #[must_use]
    pub fn new(view: &View, surface: &SurfaceSettings) -> Option<Self> {
        if !view.size_px.iter().all(|side| (1..=MAX_SIDE).contains(side)) {
            return None;
        }
        let lens = Lens::new(view, surface);
        let n_cells = lens.size[0] as usize * lens.size[1] as usize;
        let none = || AtomicU32::new(f32::INFINITY.to_bits());
        Some(Self {
            view: *view,
            lens,
            depths: std::iter::repeat_with(none).take(n_cells).collect(),
        })
    }

    /// Adds nodes for good: those that no finer ones will take the place of.
    ///
    /// Only discs hide anything: round splats, transparent, cut and elliptic ones do not.
    pub fn add(&mut self, nodes: &[ShownNode<'_>]) {
        self.draw(nodes, &self.depths);
    }

    /// Of each node whether it is visible among those that were added and all of these.
    #[must_use]
    pub fn visible(&self, nodes: &[ShownNode<'_>]) -> Vec<bool> {
        let added = self.depths.iter().map(|depth| depth.load(Ordering::Relaxed));
        let depths: Vec<AtomicU32> = added.map(AtomicU32::new).collect();
        self.draw(nodes, &depths);
        let depths = depths.into_iter().map(|bits| f32::from_bits(bits.into_inner())).collect();
        let mut levels = vec![Level { size: self.lens.size, depths }];
        while let Some(above) = levels.last().and_then(Level::above) {
            levels.push(above);
        }
        let shows = |node: &ShownNode<'_>| {
            let motion = self.view.view_from_offset(node.cloud.origin());
            self.lens.shows_any(motion, node, &levels)
        };
        nodes.par_iter().map(shows).collect()
    }

    fn draw(&self, nodes: &[ShownNode<'_>], depths: &[AtomicU32]) {
        let hiding = nodes.iter().filter(|node| hides(node.cloud));
        let mut hiding: Vec<(f64, DMat4, &ShownNode<'_>)> = hiding
            .map(|node| {
                let motion = self.view.view_from_offset(node.cloud.origin());
                let first = node.cloud.positions().first().copied().unwrap_or_default();
                (-motion.transform_point3(first.as_dvec3()).z, motion, node)
            })
            .collect();
        // What lies behind others is passed over sooner where these are there.
        hiding.sort_by(|a, b| a.0.total_cmp(&b.0));
        hiding.par_iter().with_max_len(1).for_each(|(_, motion, node)| {
            self.lens.draw_all(*motion, node, depths);
        });
    }
}

/// Whether surfels of a cloud may hide others.
fn hides(cloud: &Cloud) -> bool {
    [OPACITY, CLIP, TANGENT_U, SPLAT_SCALE].iter().all(|name| cloud.column(name).is_none())
}

/// Cells, or the farthest of four each; infinite where nothing is drawn.
struct Level {
    size: [u32; 2],
    depths: Vec<f32>,
}

impl Level {
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

/// A disc in view space.
#[derive(Clone, Copy)]
struct Disc {
    center: Vec3,
    normal: Vec3,
    /// Scene units.
    radius: f32,
}

/// Where cells look, and how surfels are drawn.
struct Lens {
    size: [u32; 2],
    /// Half the picture: tangents, or scene units where parallel.
    half: [f32; 2],
    /// A cell: tangents, or scene units where parallel.
    step: [f32; 2],
    orthographic: bool,
    two_sided: bool,
    near: f32,
    radius_scale: f32,
    tolerance: f32,
    /// Radius of the low-pass in pixels.
    low_pass: f32,
}

impl Lens {
    fn new(view: &View, surface: &SurfaceSettings) -> Self {
        let size = view.size_px;
        let half = view.half_extent().map(|half| half as f32);
        Self {
            size,
            half,
            step: [0, 1].map(|axis| 2.0 * half[axis] / size[axis] as f32),
            orthographic: matches!(view.camera.projection, Projection::Orthographic { .. }),
            two_sided: surface.two_sided,
            near: view.near as f32,
            radius_scale: surface.radius_scale,
            tolerance: surface.depth_tolerance,
            low_pass: surface.low_pass,
        }
    }

    /// Draws what may hide others.
    fn draw_all(&self, view_from_cloud: DMat4, node: &ShownNode<'_>, depths: &[AtomicU32]) {
        let cloud = node.cloud;
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
                let disc = Disc {
                    center: motion.transform_point3(positions[i]),
                    normal: motion.transform_vector3(normals[i]),
                    radius: radii[i] * self.radius_scale,
                };
                self.draw(disc, node.apart, depths);
            }
        });
    }

    /// Draws a disc: into the cells whose centre it covers, and into the one that it is centred in, which the low-pass
    /// covers; as deep as it may be and what it stands for.
    fn draw(&self, disc: Disc, apart: f32, depths: &[AtomicU32]) {
        let Disc { center, normal, radius } = disc;
        let distance = -center.z;
        let before = if self.orthographic { 1.0 } else { distance - radius };
        // Also of what is not a number.
        if !(radius > 0.0 && distance - radius > self.near && before > 0.0 && center.is_finite()) {
            return;
        }
        let towards = if self.orthographic { normal.z } else { -normal.dot(center) };
        // Neither of what is not a number.
        if !(towards > 0.0 || (self.two_sided && towards < 0.0)) {
            return;
        }
        // Bits of floats above 0 are in the order of these.
        let deeper = apart + self.tolerance * radius + self.led_out(distance);
        let middle = self.cell(center);
        let at = middle.map(f32::floor);
        let offset2: f32 = [0, 1].map(|axis| (middle[axis] - at[axis] - 0.5).powi(2)).iter().sum();
        let is_inside = |axis: usize| at[axis] >= 0.0 && at[axis] < self.size[axis] as f32;
        if is_inside(0) && is_inside(1) && offset2 <= self.low_pass.powi(2) {
            let bits = (distance + radius + deeper).to_bits();
            let cell = &depths[(at[1] as u32 * self.size[0] + at[0] as u32) as usize];
            // Looking costs less than storing.
            if bits < cell.load(Ordering::Relaxed) {
                cell.fetch_min(bits, Ordering::Relaxed);
            }
        }
        // The edge of a box around it is seen at most so far from its middle.
        let reach = [0, 1].map(|axis| {
            let along = if self.orthographic { 0.0 } else { center[axis].abs() / distance };
            radius / before * (1.0 + along) / self.step[axis]
        });
        if reach[0].max(reach[1]) < 0.5 {
            return;
        }
        let range = |axis: usize| {
            let first = (middle[axis] - reach[axis] - 0.5).ceil().max(0.0);
            let last = (middle[axis] + reach[axis] - 0.5).floor().min(self.size[axis] as f32 - 1.0);
            (first <= last).then_some((first as u32, last as u32))
        };
        let (Some(columns), Some(rows)) = (range(0), range(1)) else { return };
        for y in rows.0..=rows.1 {
            for x in columns.0..=columns.1 {
                let cell = &depths[(y * self.size[0] + x) as usize];
                let there = cell.load(Ordering::Relaxed);
                if let Some(depth) =
                    self.depth([x, y], disc, |depth| (depth + deeper).to_bits() < there)
                {
                    cell.fetch_min((depth + deeper).to_bits(), Ordering::Relaxed);
                }
            }
        }
    }

    /// Where a place is seen, in cells from the picture's upper left corner.
    fn cell(&self, place: Vec3) -> [f32; 2] {
        let scale = if self.orthographic { 1.0 } else { -place.z };
        let seen = [place.x / scale, -place.y / scale];
        [0, 1].map(|axis| (seen[axis] + self.half[axis]) / self.step[axis])
    }

    /// How far along the viewing axis a disc may be drawn out of its own depths, where the low-pass widens it.
    fn led_out(&self, distance: f32) -> f32 {
        let scale = if self.orthographic { 1.0 } else { distance };
        SLOPE * self.low_pass * self.step[0].max(self.step[1]) * scale
    }

    /// Where the ray through a cell's centre begins, and its direction.
    fn ray(&self, cell: [u32; 2]) -> (Vec3, Vec3) {
        let [x, y] =
            [0, 1].map(|axis| (cell[axis] as f32 + 0.5) * self.step[axis] - self.half[axis]);
        match self.orthographic {
            true => (Vec3::new(x, -y, 0.0), Vec3::NEG_Z),
            false => (Vec3::ZERO, Vec3::new(x, -y, -1.0)),
        }
    }

    /// Distance along the viewing axis at which the ray through a cell's centre meets a disc; nothing where it does not,
    /// or that distance does not matter.
    fn depth(
        &self,
        cell: [u32; 2],
        Disc { center, normal, radius }: Disc,
        matters: impl Fn(f32) -> bool,
    ) -> Option<f32> {
        let (start, direction) = self.ray(cell);
        let depth = normal.dot(center - start) / normal.dot(direction);
        if !(depth > 0.0 && matters(depth)) {
            return None;
        }
        let off = start + direction * depth - center;
        (off.length_squared() <= radius * radius).then_some(depth)
    }

    /// Whether a surfel of a node, or one that it stands for, may be before what is drawn. A merged node of which
    /// nothing is shown may have something to show beneath.
    fn shows_any(&self, view_from_cloud: DMat4, node: &ShownNode<'_>, levels: &[Level]) -> bool {
        let (positions, radii) = (node.cloud.positions(), node.cloud.radii());
        if positions.is_empty() || radii.len() != positions.len() {
            return true;
        }
        let motion = view_from_cloud.as_mat4();
        let surfels = positions.par_iter().zip(radii).with_min_len(AT_ONCE);
        surfels
            .any(|(&position, &radius)| self.shows((motion, position), radius, node.apart, levels))
    }

    fn shows(
        &self,
        (motion, position): (Mat4, Vec3),
        radius: f32,
        apart: f32,
        levels: &[Level],
    ) -> bool {
        let center = motion.transform_point3(position);
        let (radius, distance) = (radius.abs() * self.radius_scale, -center.z);
        let reach = radius + apart;
        if !(center.is_finite() && reach.is_finite()) {
            return true;
        }
        let before = if self.orthographic { 1.0 } else { distance - reach };
        if distance - reach <= self.near || before <= 0.0 {
            return distance + reach > self.near;
        }
        let widened = radius + self.low_pass * self.step[1] * before;
        let nearest =
            distance - reach - BROUGHT * self.tolerance * widened - self.led_out(distance);
        let middle = self.cell(center);
        let range = |axis: usize| {
            let along = if self.orthographic { 0.0 } else { center[axis].abs() / distance };
            let across = reach / before * (1.0 + along) / self.step[axis] + self.low_pass;
            let last = self.size[axis] as f32 - 1.0;
            let (first, end) =
                ((middle[axis] - across - 1.0).floor(), (middle[axis] + across).ceil());
            (end >= 0.0 && first <= last).then(|| [first.max(0.0) as u32, end.min(last) as u32])
        };
        let (Some(x), Some(y)) = (range(0), range(1)) else { return false };
        let widest = |shift: usize| {
            ((x[1] >> shift) - (x[0] >> shift)).max((y[1] >> shift) - (y[0] >> shift)) < LOOKED_AT
        };
        let shift = (0..levels.len()).find(|&shift| widest(shift)).unwrap_or(levels.len() - 1);
        let level = &levels[shift];
        (y[0] >> shift..=y[1] >> shift).any(|row| {
            let row = (row * level.size[0]) as usize;
            let cells = row + (x[0] >> shift) as usize..=row + (x[1] >> shift) as usize;
            level.depths[cells].iter().any(|&depth| depth >= nearest)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use surfelshop_api::Camera;

    /// A wall across the view, so far before the eye, of discs 0.1 apart, with what `more` says of each.
    fn wall(distance: f32, keep: impl Fn(f32, f32) -> bool, more: &[Column]) -> Cloud {
        let places =
            (-60..=60).flat_map(|i| (-60..=60).map(move |j| [0.1 * i as f32, 0.1 * j as f32]));
        let places: Vec<_> = places.filter(|&[x, y]| keep(x, y)).collect();
        let position = places.iter().flat_map(|&[x, y]| [x, y, -distance]).collect();
        let normal = [0.0, 0.0, 1.0].repeat(places.len());
        let mut columns = vec![
            Column::new("position", 3, Buffer::F32(position)),
            Column::new("normal", 3, Buffer::F32(normal)),
            Column::new("radius", 1, Buffer::F32(vec![0.15; places.len()])),
        ];
        columns.extend(more.iter().cloned());
        // Far from the origin.
        Cloud::new(DVec3::X * 1e6, columns).unwrap()
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

    /// Whether a cloud is visible behind another, where merged surfels of either stand for those so far apart.
    fn is_visible(
        view: &View,
        surface: &SurfaceSettings,
        (before, far_before): (&Cloud, f32),
        (behind, apart): (&Cloud, f32),
    ) -> bool {
        let mut grid = DepthGrid::new(view, surface).unwrap();
        let nodes = [(before, far_before), (behind, apart)]
            .map(|(cloud, apart)| ShownNode { cloud, apart });
        let together = grid.visible(&nodes)[1];
        grid.add(&nodes[..1]);
        assert_eq!(grid.visible(&nodes[1..]), [together]);
        together
    }

    #[test]
    fn what_lies_behind_a_wall_is_hidden_and_nothing_else() {
        let surface = SurfaceSettings::default();
        let spot = |x: f32, y: f32| move |u: f32, v: f32| (u - x).hypot(v - y) < 0.3;
        for view in views() {
            let whole = wall(5.0, |_, _| true, &[]);
            let seen = |before: &Cloud, distance: f32, (x, y): (f32, f32)| {
                let behind = wall(distance, spot(x, y), &[]);
                is_visible(&view, &surface, (before, 0.0), (&behind, 0.0))
            };
            assert!(!seen(&whole, 8.0, (0.0, 0.0)) && !seen(&whole, 20.0, (1.0, -0.5)));
            // Where it may be blended with the wall, in it, before it, but not behind the eye.
            for distance in [5.1, 5.0, 3.0, 0.2] {
                assert!(seen(&whole, distance, (0.0, 0.0)), "{distance}");
            }
            assert!(!seen(&whole, -1.0, (0.0, 0.0)));
            // A gap shows what is behind it and nothing beside it.
            let gap = wall(5.0, |x, y| x.hypot(y) > 0.5, &[]);
            assert!(seen(&gap, 8.0, (0.0, 0.0)) && !seen(&gap, 8.0, (1.9, 0.0)));
            let half = wall(5.0, |x, _| x < 0.0, &[]);
            assert!(!seen(&half, 8.0, (-1.5, 0.0)) && seen(&half, 8.0, (0.0, 0.0)));
            // Outside of the picture nothing is visible.
            assert!(!seen(&half, 5.0, (5.5, 0.0)));
            // What stands for others reaches as far as these.
            let beside = wall(8.0, spot(-1.5, 0.0), &[]);
            assert!(is_visible(&view, &surface, (&half, 0.0), (&beside, 1.6)));
            assert!(is_visible(&view, &surface, (&whole, 0.0), (&beside, 3.0)));
            // What hides may lie as far behind the discs that stand for it.
            assert!(is_visible(&view, &surface, (&whole, 3.5), (&beside, 0.0)));
        }
    }

    #[test]
    fn only_opaque_discs_hide() {
        let [view, _] = views();
        let (one_sided, n) =
            (SurfaceSettings { two_sided: false, ..SurfaceSettings::default() }, 121 * 121);
        let behind = wall(8.0, |x, y| x.hypot(y) < 0.3, &[]);
        let seen = |surface: &SurfaceSettings, before: &Cloud| {
            is_visible(&view, surface, (before, 0.0), (&behind, 0.0))
        };
        let with = |column: Column| wall(5.0, |_, _| true, &[column]);
        let usual = SurfaceSettings::default();
        assert!(!seen(&one_sided, &wall(5.0, |_, _| true, &[])));
        let round = |value: u8| with(Column::new(ROUND, 1, Buffer::U8(vec![value; n])));
        assert!(!seen(&usual, &round(0)) && seen(&usual, &round(1)));
        assert!(seen(&usual, &with(Column::new(OPACITY, 1, Buffer::F32(vec![1.0; n])))));
        // Backs of one-sided ones are not drawn.
        let normal = Column::new("normal", 3, Buffer::F32([0.0, 0.0, -1.0].repeat(n)));
        let away = wall(5.0, |_, _| true, &[]).with_columns(vec![normal]).unwrap();
        assert!(seen(&one_sided, &away) && !seen(&usual, &away));
        assert!(seen(&usual, &wall(5.0, |_, _| false, &[])));
        // Nothing is known of what is not shown, nor in a picture without pixels.
        let nothing = wall(8.0, |_, _| false, &[]);
        let whole = wall(5.0, |_, _| true, &[]);
        assert!(is_visible(&view, &usual, (&whole, 0.0), (&nothing, 0.1)));
        assert!(DepthGrid::new(&View { size_px: [0, 10], ..view }, &usual).is_none());
    }
}
