//! Discs as the pixels of a tile meet them.

use crate::block_splats::{NO_PIXELS, Pixels, around};
use crate::cloud::CloudInView;
use crate::disc::{Discs, MAX_PULL, load_discs};
use crate::lanes::{F, I, V, WIDTH, larger, smaller};
use crate::local::{DrawnSurfel, Local};
use crate::tile::layout::N_NORMAL_SUMS;
use crate::view::Eye;
use fearless_simd::prelude::*;
use glam::Vec3;

/// Highest bit of a surfel's number: it is seen from behind.
pub(crate) const BACK: u32 = 1 << 31;

/// A disc on the screen: numbers that are linear in a pixel's place, relative to its first pixel.
#[derive(Clone, Copy, Default)]
pub(crate) struct Splat {
    /// Coordinates in the disc times `w`, and `w`: at the first pixel, a step right, a step down.
    pub(crate) u: [f32; 3],
    pub(crate) v: [f32; 3],
    pub(crate) w: [f32; 3],
    /// Distance of the centre, and of the ends of the half axes relative to it.
    pub(crate) depth: [f32; 3],
    /// Factor that the depth tolerance puts on distances.
    pub(crate) drawn_near: f32,
    /// Taken off distances, where orthographic.
    pub(crate) nearer: f32,
    pub(crate) share: f32,
    /// Number of its place among all clouds', and the side it is seen from.
    pub(crate) number: u32,
    pub(crate) cloud: u32,
    /// Its place, from 1, among what varies over splats; 0 where nothing does.
    pub(crate) local: u32,
    /// First and behind-last pixels in the picture.
    pub(crate) pixels: [i32; 4],
}

impl Splat {
    /// Normal turned to the eye and one; with more than these also albedo and accessibility.
    #[inline(always)]
    pub(crate) fn attributes<const N: usize>(
        &self,
        in_view: &CloudInView<'_>,
        linear_of_srgb: &[f32; 256],
    ) -> [f32; N] {
        let place = in_view.place(self.number);
        let sign = if self.number & BACK == 0 { 1.0 } else { -1.0 };
        let [x, y, z] = in_view.columns.normal_of(place);
        let mut own = [sign * x, sign * y, sign * z, 1.0, 0.0, 0.0, 0.0, 0.0];
        if N > N_NORMAL_SUMS {
            let [r, g, b] = in_view.seen_albedo(self.number, linear_of_srgb);
            (own[4], own[5], own[6]) = (r, g, b);
            own[7] = in_view.columns.ao_of(place);
        }
        std::array::from_fn(|i| own[i])
    }
}

impl CloudInView<'_> {
    /// A place in the columns.
    #[inline(always)]
    pub(crate) fn place(&self, number: u32) -> usize {
        ((number & !BACK) - self.first) as usize
    }

    /// The albedo of a surfel as it is seen: that of backs where these have one.
    #[inline(always)]
    pub(crate) fn seen_albedo(&self, number: u32, linear_of_srgb: &[f32; 256]) -> [f32; 3] {
        match self.eye.back_albedo {
            Some(albedo) if number & BACK != 0 => albedo,
            _ => self.columns.albedo_of(self.place(number), linear_of_srgb),
        }
    }
}

/// What varies over a surfel of a group, where anything does.
fn local<S: Simd>(
    in_view: &CloudInView<'_>,
    discs: &Discs<S>,
    group: usize,
    lane: usize,
    with_fields: bool,
) -> Option<Local> {
    let vector = |of: V<S>| Vec3::new(of.x[lane], of.y[lane], of.z[lane]);
    let place = group * WIDTH + lane;
    let widened = DrawnSurfel {
        place,
        center: vector(discs.center),
        axis_u: vector(discs.axis_u),
        axis_v: vector(discs.axis_v),
        kept: [discs.kept[0][lane], discs.kept[1][lane]],
        back: discs.back.to_bitmask() >> lane & 1 == 1,
        own_center: in_view.eye.one(in_view.columns.position_of(place)),
        offset: &|v| in_view.eye.one_offset(v.to_array()),
        tangent_scale: in_view.eye.tangent_scale,
    };
    Local::of(in_view.columns, &widened, with_fields)
}

/// What the depth tolerance puts on distances of discs as a factor, and takes off them.
#[inline(always)]
fn brought_nearer<S: Simd>(discs: &Discs<S>, eye: &Eye) -> (F<S>, F<S>) {
    let splat = |value: f32| F::splat(discs.reach.token(), value);
    let slack = discs.reach * eye.tolerance;
    if eye.orthographic {
        return (splat(1.0), slack);
    }
    let distance = larger(discs.center.dot(discs.center).sqrt(), slack);
    let left = larger(distance - slack, distance / splat(MAX_PULL));
    let pull = smaller(distance / left, splat(MAX_PULL));
    (splat(1.0) / pull, splat(0.0))
}

/// Appends the surfels of a group that cover a part of the picture, and what varies over them. Returns what they cover
/// together; `None` where that is nothing.
#[inline(always)]
pub(crate) fn splats<S: Simd>(
    simd: S,
    in_view: &CloudInView<'_>,
    cloud: u32,
    group: usize,
    with_fields: bool,
    all: &mut Vec<Splat>,
    locals: &mut Vec<Local>,
) -> Option<Pixels> {
    let eye = &in_view.eye;
    let splat = |value: f32| F::splat(simd, value);
    let zero = splat(0.0);
    let discs = load_discs(simd, in_view.columns, eye, group)?;
    let [left, top, right, bottom] = discs.pixel_boxes(eye);
    // A pixel counts where its middle lies within.
    let (w, h) = (eye.size_px[0] as f32, eye.size_px[1] as f32);
    let within = |at: F<S>, size: f32| smaller(larger(at, zero), splat(size));
    let (x0, y0) = (within((left - 0.5).ceil(), w), within((top - 0.5).ceil(), h));
    let (x1, y1) = (within((right + 0.5).floor(), w), within((bottom + 0.5).floor(), h));
    let inside = x1.simd_gt(x0) & y1.simd_gt(y0);
    let mut drawn = (discs.visible & inside).to_bitmask();
    if drawn == 0 {
        return None;
    }
    let plane = discs.axis_u.cross(discs.axis_v);
    let across = eye.across(x0, y0);
    let [step_x, step_y] = [2.0 * eye.half_extent[0] / w, -2.0 * eye.half_extent[1] / h];
    // Where rays meet the plane, by Cramer's rule, as `accumulate` of the shaders.
    let (u, v, w_of) = if eye.orthographic {
        let c = discs.center;
        // cross(to, ray) with `to` the centre from where the ray (0, 0, -1) starts.
        let (cx, cy) = (-(c.y - across[1]), c.x - across[0]);
        let u = cx * discs.axis_v.x + cy * discs.axis_v.y;
        let v = -(cx * discs.axis_u.x + cy * discs.axis_u.y);
        (
            [u, -(discs.axis_v.y * step_x), discs.axis_v.x * step_y],
            [v, discs.axis_u.y * step_x, -(discs.axis_u.x * step_y)],
            [-plane.z, zero, zero],
        )
    } else {
        let ray = V { x: across[0], y: across[1], z: splat(-1.0) };
        let of_u = discs.axis_v.cross(discs.center);
        let of_v = discs.center.cross(discs.axis_u);
        let across_ray = discs.center.cross(ray);
        (
            [across_ray.dot(discs.axis_v), of_u.x * step_x, of_u.y * step_y],
            [-across_ray.dot(discs.axis_u), of_v.x * step_x, of_v.y * step_y],
            [plane.dot(ray), plane.x * step_x, plane.y * step_y],
        )
    };
    let (drawn_near, nearer) = brought_nearer(&discs, eye);
    let back = discs.back.to_bitmask();
    let depth = [-discs.center.z, -discs.axis_u.z, -discs.axis_v.z];
    // To memory at once: lanes of registers are read through it one by one.
    let three = |of: [F<S>; 3]| of.map(|of| of.to_array());
    let [u, v, w_of, depth] = [three(u), three(v), three(w_of), three(depth)];
    let others = [drawn_near, nearer, discs.share].map(|of| of.to_array());
    let boxes = [x0, y0, x1, y1].map(|of| of.to_int::<I<S>>().to_array());
    let first = in_view.first + (group * WIDTH) as u32;
    let varies = in_view.columns.varies(with_fields);
    let mut covered = NO_PIXELS;
    while drawn != 0 {
        let lane = drawn.trailing_zeros() as usize;
        drawn &= drawn - 1;
        let own = if varies { local(in_view, &discs, group, lane, with_fields) } else { None };
        let place = own.map_or(0, |own| {
            locals.push(own);
            locals.len() as u32
        });
        // `map` would copy all lanes.
        let of_lane = |of: &[[f32; WIDTH]; 3]| [of[0][lane], of[1][lane], of[2][lane]];
        let [drawn_near, nearer, share] = of_lane(&others);
        let pixels = [boxes[0][lane], boxes[1][lane], boxes[2][lane], boxes[3][lane]];
        // Read from the splats again, they would wait for the memory that they are written to.
        covered = around(covered, pixels);
        all.push(Splat {
            u: of_lane(&u),
            v: of_lane(&v),
            w: of_lane(&w_of),
            depth: of_lane(&depth),
            drawn_near,
            nearer,
            share,
            number: (first + lane as u32) | ((back >> lane & 1) as u32) << 31,
            cloud,
            local: place,
            pixels,
        });
    }
    Some(covered)
}
