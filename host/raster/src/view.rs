//! The view that surfels are drawn in.

use crate::lanes::{F, V};
use fearless_simd::prelude::*;
use glam::{Mat4, Vec3};

/// A view and the settings of a surface, in units of drawing.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Width and height in pixels.
    pub size_px: [u32; 2],
    /// Half the picture's width and height: tangents, or units of drawing where orthographic.
    pub half_extent: [f32; 2],
    /// Where the picture is seen in each pixel, from its centre, pixels, y downwards.
    pub shift_px: [f32; 2],
    /// Nearest distance along the viewing axis that is drawn.
    pub near: f32,
    /// Whether the projection is parallel.
    pub orthographic: bool,
    /// Rotation from view space to the world.
    pub world_from_view: [[f32; 3]; 3],
    /// Whether surfels seen from behind are drawn.
    pub two_sided: bool,
    /// The albedo of surfels that are seen from behind, linear Rec. 709; their own where there is none.
    pub back_albedo: Option<[f32; 3]>,
    /// Radius of the screen-space low-pass in pixels; 0 is none.
    pub low_pass: f32,
    /// Depth tolerance in radii.
    pub tolerance: f32,
    /// The factor that the scene puts on every radius.
    pub tangent_scale: f32,
    /// Scene units per unit of drawing.
    pub unit: f32,
    /// Surfels are merged where what stands for them has at most this radius, in pixels; 0 is never.
    pub detail_px: f32,
}

/// The same for one cloud.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Eye {
    /// Rows of the linear part, and the translation: from the cloud's positions to view space.
    rows: [[f32; 3]; 3],
    translation: [f32; 3],
    /// Scene units per unit of drawing.
    pub(crate) unit: f32,
    pub(crate) size_px: [u32; 2],
    pub(crate) half_extent: [f32; 2],
    /// Where the picture is seen in each pixel, from its first corner.
    pub(crate) seen_px: [f32; 2],
    /// Where the viewing axis is seen, pixels from the first corner of the picture.
    pub(crate) middle_px: [f32; 2],
    /// Pixels per unit at distance 1, or anywhere where orthographic.
    pub(crate) px_per_unit: [f32; 2],
    pub(crate) near: f32,
    pub(crate) orthographic: bool,
    pub(crate) two_sided: bool,
    pub(crate) back_albedo: Option<[f32; 3]>,
    pub(crate) low_pass: f32,
    pub(crate) tolerance: f32,
    pub(crate) radius_scale: f32,
    pub(crate) tangent_scale: f32,
    /// The largest radius of round splats that are not merged ones, in shares of their distance.
    pub(crate) round_reach: f32,
    pub(crate) detail_px: f32,
}

impl Eye {
    pub(crate) fn new(view: &View, view_from_cloud: Mat4, round_reach: f32) -> Self {
        let transposed = view_from_cloud.transpose();
        let row = |row: glam::Vec4| [row.x, row.y, row.z];
        let px = |i: usize| 0.5 * view.size_px[i] as f32 / view.half_extent[i];
        Self {
            rows: [transposed.x_axis, transposed.y_axis, transposed.z_axis].map(row),
            translation: view_from_cloud.w_axis.truncate().into(),
            unit: view.unit,
            size_px: view.size_px,
            half_extent: view.half_extent,
            seen_px: view.shift_px.map(|shift| 0.5 + shift),
            middle_px: [0, 1].map(|i| 0.5 * view.size_px[i] as f32 - view.shift_px[i]),
            px_per_unit: [px(0), px(1)],
            near: view.near,
            orthographic: view.orthographic,
            two_sided: view.two_sided,
            back_albedo: view.back_albedo,
            low_pass: view.low_pass,
            tolerance: view.tolerance,
            radius_scale: view.tangent_scale / view.unit,
            tangent_scale: view.tangent_scale,
            round_reach: if view.orthographic {
                f32::INFINITY
            } else {
                round_reach * view.tangent_scale
            },
            detail_px: view.detail_px,
        }
    }

    /// Differences of positions in view space, units of drawing.
    #[inline(always)]
    pub(crate) fn offset<S: Simd>(&self, v: V<S>) -> V<S> {
        V { x: v.along(self.rows[0]), y: v.along(self.rows[1]), z: v.along(self.rows[2]) }
    }

    /// Positions in view space.
    #[inline(always)]
    pub(crate) fn point<S: Simd>(&self, v: V<S>) -> V<S> {
        let V { x, y, z } = self.offset(v);
        let [a, b, c] = self.translation;
        V { x: x + a, y: y + b, z: z + c }
    }

    /// Unit vectors in view space.
    #[inline(always)]
    pub(crate) fn direction<S: Simd>(&self, v: V<S>) -> V<S> {
        let unit = F::splat(v.x.token(), self.unit);
        self.offset(v).times(unit)
    }

    /// A difference of positions in view space.
    pub(crate) fn one_offset(&self, [x, y, z]: [f32; 3]) -> Vec3 {
        let row = |i: usize| {
            let [a, b, c] = self.rows[i];
            a * x + b * y + c * z
        };
        Vec3::new(row(0), row(1), row(2))
    }

    /// A position in view space.
    pub(crate) fn one(&self, [x, y, z]: [f32; 3]) -> Vec3 {
        let row = |i: usize| {
            let [a, b, c] = self.rows[i];
            a * x + b * y + c * z + self.translation[i]
        };
        Vec3::new(row(0), row(1), row(2))
    }

    /// A direction in view space, as long as it was.
    pub(crate) fn turned(&self, direction: [f32; 3]) -> Vec3 {
        self.one_offset(direction) * self.unit
    }

    /// The ray through where a pixel is seen: across and up, at distance 1 or where it starts.
    pub(crate) fn across_one(&self, x: f32, y: f32) -> [f32; 2] {
        let [w, h] = self.size_px.map(|side| side as f32);
        [
            ((x + self.seen_px[0]) * (2.0 / w) - 1.0) * self.half_extent[0],
            -(((y + self.seen_px[1]) * (2.0 / h) - 1.0) * self.half_extent[1]),
        ]
    }

    /// The same for several.
    #[inline(always)]
    pub(crate) fn across<S: Simd>(&self, x: F<S>, y: F<S>) -> [F<S>; 2] {
        let [w, h] = self.size_px.map(|side| side as f32);
        [
            ((x + self.seen_px[0]) * (2.0 / w) - 1.0) * self.half_extent[0],
            -(((y + self.seen_px[1]) * (2.0 / h) - 1.0) * self.half_extent[1]),
        ]
    }
}
