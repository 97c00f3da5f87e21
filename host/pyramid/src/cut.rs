//! Which nodes a view is drawn from: those in front of the eye whose merged surfels are as small on the screen as they
//! have to be.

use crate::layout::NodeRecord;
use glam::{DMat4, DVec3};
use std::cmp::Ordering;
use std::collections::BinaryHeap;
use surfelshop_api::{Projection, SurfaceSettings, View};
use surfelshop_cloud::Transform;

/// What is hidden has merged surfels so many times as large as what is visible, at most.
const HIDDEN: f64 = 8.0;

/// A view of a pyramid.
#[derive(Clone, Copy, Debug)]
pub struct CutView {
    /// From the pyramid's coordinates to view space, looking along -z, in scene units.
    pub view_from_pyramid: DMat4,
    /// Scene units per unit of the pyramid.
    pub scale: f64,
    /// Half the picture's width and height: tangents, or scene units where orthographic.
    pub half_extent: [f64; 2],
    /// Whether the projection is parallel.
    pub orthographic: bool,
    /// Width and height in pixels.
    pub size_px: [u32; 2],
    /// Nearest distance along the viewing axis that is drawn.
    pub near: f64,
    /// Whether surfels seen from behind are drawn.
    pub two_sided: bool,
    /// The factor that the scene puts on every radius.
    pub radius_scale: f64,
    /// Radius of the screen-space low-pass in pixels.
    pub low_pass: f64,
    /// Merged surfels have at most this radius in pixels; 0 draws none.
    pub detail_px: f64,
    /// No radius is drawn larger, scene units: what is merged to a larger one would leave holes. Infinite where all are.
    pub largest_radius: f64,
}

/// The nodes that a view is drawn from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cut {
    /// Nodes to be drawn, in ascending order.
    pub nodes: Vec<u32>,
    /// Their surfels.
    pub n_surfels: u64,
    /// The largest radius of a merged surfel of theirs in pixels, of those that are not hidden; infinite where one lies
    /// before the near plane.
    pub coarsest_px: f64,
    /// Those that would be finer if they were visible.
    pub hidden: Vec<u32>,
    /// Nodes that would be drawn if they were in memory, the coarsest parent first.
    pub missing: Vec<u32>,
}

/// A node that may be refined; the coarsest first.
struct Open {
    error: f64,
    node: u32,
}

impl PartialEq for Open {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Open {}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Open {
    fn cmp(&self, other: &Self) -> Ordering {
        self.error.total_cmp(&other.error).then(other.node.cmp(&self.node))
    }
}

impl Cut {
    /// Chooses nodes: from the root down the coarsest on the screen is replaced by its children, until all are fine
    /// enough or there would be more than `at_most` surfels. A node whose children are not all `at_hand` stands for
    /// them, and they are missing. Nodes of which `is_there` says that nothing is left are left out. The outcome follows
    /// from these alone.
    #[must_use]
    pub fn of(
        nodes: &[NodeRecord],
        view: &CutView,
        at_most: u64,
        (at_hand, is_there): (impl Fn(u32) -> bool, impl Fn(u32) -> bool),
    ) -> Self {
        Self::of_visible(nodes, view, at_most, (at_hand, is_there), |_| true)
    }

    /// The same where nodes that are not visible need not be as fine: their merged surfels have at most eight times the
    /// radius that those of others have. They are [`hidden`](Self::hidden).
    #[must_use]
    pub fn of_visible(
        nodes: &[NodeRecord],
        view: &CutView,
        at_most: u64,
        (at_hand, is_there): (impl Fn(u32) -> bool, impl Fn(u32) -> bool),
        is_visible: impl Fn(u32) -> bool,
    ) -> Self {
        let mut cut = Self::default();
        let mut open = BinaryHeap::new();
        if nodes.first().is_some_and(|root| view.sees(root) && is_there(0)) {
            cut.n_surfels = u64::from(nodes[0].n_surfels);
            open.push(Open { error: view.error_px(&nodes[0]), node: 0 });
        }
        while let Some(Open { error, node }) = open.pop() {
            let record = &nodes[node as usize];
            let stands = |cut: &mut Self, error: f64| {
                cut.nodes.push(node);
                cut.coarsest_px = cut.coarsest_px.max(error);
            };
            if record.is_leaf() || error <= view.detail_px {
                stands(&mut cut, error);
                continue;
            }
            if error <= HIDDEN * view.detail_px && !is_visible(node) {
                cut.nodes.push(node);
                cut.hidden.push(node);
                continue;
            }
            let [first, count] = record.children;
            let sees = |&child: &u32| view.sees(&nodes[child as usize]) && is_there(child);
            let visible: Vec<u32> = (first..first + count).filter(sees).collect();
            let more = visible.iter().map(|&child| u64::from(nodes[child as usize].n_surfels));
            let refined = cut.n_surfels - u64::from(record.n_surfels) + more.sum::<u64>();
            if refined > at_most.max(cut.n_surfels) {
                stands(&mut cut, error);
                continue;
            }
            let n_missing = cut.missing.len();
            cut.missing.extend(visible.iter().filter(|&&child| !at_hand(child)));
            if cut.missing.len() > n_missing {
                stands(&mut cut, error);
                continue;
            }
            cut.n_surfels = refined;
            open.extend(visible.into_iter().map(|child| {
                let error = view.error_px(&nodes[child as usize]);
                Open { error, node: child }
            }));
        }
        cut.nodes.sort_unstable();
        cut.hidden.sort_unstable();
        cut
    }
}

impl CutView {
    /// A view of a pyramid that stands where `transform` says; merged surfels have at most `detail_px` as radius.
    #[must_use]
    pub fn new(
        view: &View,
        surface: &SurfaceSettings,
        transform: &Transform,
        detail_px: f32,
    ) -> Self {
        let Transform { translation, scale, rotation } = *transform;
        let rotation = rotation.quaternion().unwrap_or_default();
        let placed =
            DMat4::from_scale_rotation_translation(DVec3::splat(scale), rotation, translation);
        Self {
            view_from_pyramid: view.view_from_offset(DVec3::ZERO) * placed,
            scale,
            half_extent: view.half_extent(),
            orthographic: matches!(view.camera.projection, Projection::Orthographic { .. }),
            size_px: view.size_px,
            near: view.near,
            two_sided: surface.two_sided,
            radius_scale: f64::from(surface.radius_scale),
            low_pass: f64::from(surface.low_pass),
            detail_px: f64::from(detail_px),
            largest_radius: f64::INFINITY,
        }
    }

    /// Middle of a node in view space, and the radius of a sphere around all of it, scene units.
    fn sphere(&self, node: &NodeRecord) -> (DVec3, f64) {
        let middle = self.view_from_pyramid.transform_point3(node.middle);
        let reach = f64::from(node.spread) + f64::from(node.reach) * self.radius_scale;
        (middle, reach * self.scale * (1.0 + 1e-6))
    }

    /// Whether a node may have pixels.
    fn sees(&self, node: &NodeRecord) -> bool {
        let (middle, reach) = self.sphere(node);
        let depth = -middle.z;
        if !middle.is_finite() || !reach.is_finite() {
            return true;
        }
        if depth + reach < self.near || (!self.two_sided && self.is_behind(node, middle, reach)) {
            return false;
        }
        // The low-pass reaches this far beyond an outline, and a pixel counts at its middle.
        let margin_px = self.low_pass + 1.0;
        [middle.x, middle.y].into_iter().enumerate().all(|(axis, across)| {
            let half = self.half_extent[axis];
            let pixel = 2.0 * half / f64::from(self.size_px[axis].max(1));
            match self.orthographic {
                true => across.abs() - half <= reach + margin_px * pixel,
                false => {
                    let outside = (across.abs() - half * depth) / (1.0 + half * half).sqrt();
                    outside <= reach + margin_px * pixel * (depth + reach).max(0.0)
                }
            }
        })
    }

    /// Whether the eye is behind every surfel of a node.
    fn is_behind(&self, node: &NodeRecord, middle: DVec3, reach: f64) -> bool {
        if node.cosine <= -1.0 {
            return false;
        }
        let turned = self.view_from_pyramid.transform_vector3(node.axis.as_dvec3());
        let axis = turned.normalize_or_zero();
        let (towards, seen_angle) = match self.orthographic {
            true => (axis.z, 0.0),
            false => {
                let distance = middle.length();
                if distance <= reach {
                    return false;
                }
                (-axis.dot(middle) / distance, (reach / distance).asin())
            }
        };
        let half_angle = f64::from(node.cosine).clamp(-1.0, 1.0).acos();
        let least = towards.clamp(-1.0, 1.0).acos() - half_angle - seen_angle;
        // What rounding does to these angles is far less than a thousandth.
        least > std::f64::consts::FRAC_PI_2 + 1e-3
    }

    /// Whether a node is as fine as it has to be where it is visible.
    #[must_use]
    pub fn is_fine(&self, node: &NodeRecord) -> bool {
        node.is_leaf() || self.error_px(node) <= self.detail_px
    }

    /// Radius in pixels of a node's largest merged surfel where it is nearest, as the rasteriser has it; 0 of a leaf.
    fn error_px(&self, node: &NodeRecord) -> f64 {
        if node.is_leaf() {
            return 0.0;
        }
        let (middle, _) = self.sphere(node);
        let distance = match self.orthographic {
            true => 1.0,
            false => -middle.z - f64::from(node.spread) * self.scale,
        };
        if !self.orthographic && distance <= self.near {
            return f64::INFINITY;
        }
        let px = [0, 1].map(|i| 0.5 * f64::from(self.size_px[i]) / self.half_extent[i]);
        let (grain, apart) = (f64::from(node.grain), f64::from(node.apart));
        let coarse = match self.radius_scale {
            factor if factor < 1.0 => grain.max(apart) / factor,
            factor => (grain * factor).max(apart),
        };
        if grain * self.scale > self.largest_radius {
            return f64::INFINITY;
        }
        coarse * self.scale * px[0].max(px[1]) / distance
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    /// A root of grain 0.4 with eight leaves at the corners of a unit cube.
    fn tree() -> Vec<NodeRecord> {
        let leaf = |i: u32| NodeRecord {
            n_surfels: 100,
            middle: DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) - 0.5,
            spread: 0.1,
            reach: 0.01,
            axis: Vec3::Z,
            cosine: -1.0,
            ..NodeRecord::default()
        };
        let root = NodeRecord {
            children: [1, 8],
            n_surfels: 100,
            spread: 1.0,
            reach: 0.4,
            grain: 0.4,
            apart: 0.3,
            ..leaf(0)
        };
        let root = NodeRecord { middle: DVec3::ZERO, ..root };
        std::iter::once(root).chain((0..8).map(leaf)).collect()
    }

    fn view(distance: f64) -> CutView {
        CutView {
            view_from_pyramid: DMat4::from_translation(DVec3::new(0.0, 0.0, -distance)),
            scale: 1.0,
            half_extent: [0.5, 0.5],
            orthographic: false,
            size_px: [100, 100],
            near: 0.01,
            two_sided: true,
            radius_scale: 1.0,
            low_pass: 1.0,
            detail_px: 1.0,
            largest_radius: f64::INFINITY,
        }
    }

    #[test]
    fn what_is_fine_enough_is_drawn_and_what_is_not_is_refined() {
        let nodes = tree();
        let cut = |view: &CutView, at_most| Cut::of(&nodes, view, at_most, (|_| true, |_| true));
        // 0.4 units are a pixel, a hundredth of the distance, at 40 from the nearest point of the root.
        assert_eq!(cut(&view(42.0), u64::MAX).nodes, [0]);
        let near = cut(&view(40.0), u64::MAX);
        assert_eq!((near.nodes, near.n_surfels), ((1..9).collect(), 800));
        let few = cut(&view(40.0), 799);
        assert_eq!(few.nodes, [0]);
        assert!(few.coarsest_px > 1.0 && few.coarsest_px < 1.1, "{}", few.coarsest_px);
        let close = CutView { detail_px: 1e9, ..view(0.5) };
        assert!(!cut(&close, u64::MAX).nodes.contains(&0), "the eye is within it");
        let turned =
            CutView { view_from_pyramid: DMat4::from_translation(DVec3::Z * 9.0), ..close };
        assert_eq!(cut(&turned, u64::MAX), Cut::default());
    }

    #[test]
    fn parallel_views_and_shortened_radii_are_refined_by_what_they_show() {
        let nodes = tree();
        let cut = |view: &CutView| Cut::of(&nodes, view, u64::MAX, (|_| true, |_| true)).nodes;
        // 100 pixels over twice 21 units: 0.42 of them are a pixel, however far away the near plane is.
        let wide = CutView { half_extent: [21.0; 2], orthographic: true, near: 30.0, ..view(42.0) };
        assert_eq!(cut(&wide), [0]);
        let narrow = CutView { half_extent: [19.0; 2], ..wide };
        assert_eq!(cut(&narrow).len(), 8);
        let shortened = CutView { largest_radius: 0.3, ..wide };
        assert_eq!(cut(&shortened).len(), 8, "0.4 would be drawn as 0.3");
    }

    #[test]
    fn a_node_stands_for_children_that_are_not_at_hand() {
        let nodes = tree();
        let cut = Cut::of(&nodes, &view(10.0), u64::MAX, (|node| node != 3, |_| true));
        assert_eq!((cut.nodes, cut.missing), (vec![0], vec![3]));
        let without = (|node| node != 3, |node| node != 3);
        let cut = Cut::of(&nodes, &view(10.0), u64::MAX, without);
        assert_eq!((cut.nodes, cut.missing), (vec![1, 2, 4, 5, 6, 7, 8], Vec::new()));
        assert_eq!(cut.n_surfels, 700);
        let nothing = Cut::of(&nodes, &view(10.0), u64::MAX, (|_| true, |_| false));
        assert_eq!(nothing, Cut::default());
    }

    #[test]
    fn what_is_not_visible_may_be_eight_times_as_coarse() {
        let nodes = tree();
        let cut = |view: &CutView, is_visible| {
            Cut::of_visible(&nodes, view, u64::MAX, (|_| true, |_| true), |_| is_visible)
        };
        let hidden = cut(&view(40.0), false);
        assert_eq!((hidden.nodes, hidden.hidden, hidden.coarsest_px), (vec![0], vec![0], 0.0));
        assert_eq!(
            cut(&view(40.0), true),
            Cut::of(&nodes, &view(40.0), u64::MAX, (|_| true, |_| true))
        );
        // 0.4 units are eight pixels at 5 from the nearest point of the root.
        assert_eq!(cut(&view(6.1), false).nodes, [0]);
        let near = cut(&view(5.9), false);
        assert_eq!((near.nodes, near.hidden), ((1..9).collect(), Vec::new()));
        let all = cut(&CutView { detail_px: 0.0, ..view(40.0) }, false);
        assert_eq!(all.nodes.len(), 8);
    }

    #[test]
    fn what_faces_away_is_left_out_where_backs_are() {
        let mut nodes = tree();
        for node in &mut nodes {
            (node.axis, node.cosine) = (Vec3::NEG_Z, 0.9);
        }
        for orthographic in [false, true] {
            let view =
                CutView { two_sided: false, orthographic, half_extent: [2.0; 2], ..view(20.0) };
            let cut =
                |nodes: &[NodeRecord]| Cut::of(nodes, &view, u64::MAX, (|_| true, |_| true)).nodes;
            assert!(cut(&nodes).is_empty(), "all are turned away");
            let mut towards = nodes.clone();
            (towards[0].cosine, towards[3].axis) = (-1.0, Vec3::Z);
            let all = CutView { detail_px: 0.0, ..view };
            assert_eq!(Cut::of(&towards, &all, u64::MAX, (|_| true, |_| true)).nodes, [3]);
        }
    }

    #[test]
    fn what_is_beside_the_picture_is_left_out() {
        let nodes = tree();
        let aside = DMat4::from_translation(DVec3::new(1.1, 0.0, -2.0));
        let view = CutView { view_from_pyramid: aside, ..view(0.0) };
        let cut = Cut::of(&nodes, &view, u64::MAX, (|_| true, |_| true));
        assert_eq!(cut.nodes, [1, 3, 5, 7]);
    }
}
