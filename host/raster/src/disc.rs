//! Discs on the screen: twins of the functions of the same names in `disc.wgsl` of `host/render`, for
//! several surfels at once.
//!
//! What they compute and why stands there.

use crate::columns::Columns;
use crate::columns::geometry::Shape;
use crate::lanes::{F, M, V, larger, length2, smaller};
use crate::view::Eye;
use fearless_simd::prelude::*;

/// Smallest `kappa` of a disc that is widened.
const MIN_KAPPA: f32 = 0.05;
/// Discs whose shorter half axis is at least this many times the low-pass stay as they are.
const WIDENED_BELOW: f32 = 8.0;
/// Slope up to which a widened disc stays in its plane.
const MAX_SLOPE: f32 = 2.0;
/// Smallest factor that the low-pass puts on a weight.
const MIN_SHARE: f32 = 1e-6;
/// Largest factor by which blending brings a surfel nearer.
pub(crate) const MAX_PULL: f32 = 2.0;

/// Surfels in view space.
#[derive(Clone, Copy)]
pub(crate) struct Discs<S: Simd> {
    pub(crate) center: V<S>,
    pub(crate) axis_u: V<S>,
    pub(crate) axis_v: V<S>,
    /// Length of the longer half axis.
    pub(crate) reach: F<S>,
    pub(crate) visible: M<S>,
    /// Seen from behind.
    pub(crate) back: M<S>,
    pub(crate) share: F<S>,
    /// What the low-pass left of the two half axes, as shares.
    pub(crate) kept: [F<S>; 2],
    /// Whether `outline` holds what of the screen they cover.
    outlined: M<S>,
    /// First and last of the pixels that they may cover, in pixels: left, top, right, bottom.
    outline: [F<S>; 4],
}

/// Numbers with the signs of others; 0 where those are.
#[inline(always)]
fn with_sign<S: Simd>(magnitude: F<S>, sign: F<S>) -> F<S> {
    let zero = F::splat(sign.token(), 0.0);
    let positive = sign.simd_gt(zero).select(magnitude, zero);
    sign.simd_lt(zero).select(-magnitude, positive)
}

#[inline(always)]
fn longer_half_axis<S: Simd>(u: V<S>, v: V<S>) -> F<S> {
    let (uu, vv) = (u.dot(u), v.dot(v));
    ((uu + vv) * 0.5 + length2((uu - vv) * 0.5, u.dot(v))).sqrt()
}

/// Unit vectors towards the eye; zero at the eye itself.
#[inline(always)]
fn towards_eye<S: Simd>(center: V<S>, eye: &Eye) -> V<S> {
    let simd = center.x.token();
    let zero = F::splat(simd, 0.0);
    if eye.orthographic {
        return V { x: zero, y: zero, z: F::splat(simd, 1.0) };
    }
    let length = larger(center.dot(center).sqrt(), F::splat(simd, 1e-30));
    V { x: -center.x / length, y: -center.y / length, z: -center.z / length }
}

/// Reads the surfels of a group; lanes that hold none are not visible, and there is none where all of them are not.
#[inline(always)]
pub(crate) fn load_discs<S: Simd>(
    simd: S,
    columns: &Columns,
    eye: &Eye,
    group: usize,
) -> Option<Discs<S>> {
    let splat = |value: f32| F::splat(simd, value);
    let zero = splat(0.0);
    let (part, at) = columns.geometry(group);
    let center = eye.point(part.positions.at(simd, at));
    let n_view = eye.direction(part.normals.at(simd, at));
    let facing = if eye.orthographic { n_view.z } else { -n_view.dot(center) };
    let back = !facing.simd_ge(zero);
    let mut seen = !back | M::splat(simd, eye.two_sided);
    // Neighbours mostly face the same way.
    if !(columns.has_round || seen.any_true()) {
        return None;
    }
    let (axis_u, axis_v, reach) = match &part.shape {
        Shape::Radius(radii) => {
            let size = radii.at(simd, at);
            let mut reach = size.abs() * eye.radius_scale;
            let mut axis = n_view;
            if columns.has_round {
                let is_round = zero.simd_gt(size);
                axis = V::pick(is_round, towards_eye(center, eye), n_view);
                seen |= is_round;
                if !columns.is_merged(group) {
                    let most = center.dot(center).sqrt() * eye.round_reach;
                    reach = (is_round & reach.simd_gt(most)).select(most, reach);
                }
            }
            let s = axis.z.simd_ge(zero).select(splat(1.0), splat(-1.0));
            let a = splat(-1.0) / (s + axis.z);
            let b = axis.x * axis.y * a;
            let u = V { x: s * axis.x * axis.x * a + 1.0, y: s * b, z: -(s * axis.x) };
            let v = V { x: b, y: s + axis.y * axis.y * a, z: -axis.y };
            (u.times(reach), v.times(reach), reach)
        }
        Shape::Tangents(u, v) => {
            let scale = splat(eye.tangent_scale);
            let axis = |lanes: V<S>| eye.offset(lanes).times(scale);
            let (u, v) = (axis(u.at(simd, at)), axis(v.at(simd, at)));
            (u, v, longer_half_axis(u, v))
        }
    };
    let visible = reach.simd_gt(zero) & seen;
    if !visible.any_true() {
        return None;
    }
    let (share, kept) = (splat(1.0), [splat(1.0); 2]);
    let (outlined, outline) = (M::splat(simd, false), [zero; 4]);
    let discs =
        Discs { center, axis_u, axis_v, reach, visible, back, share, kept, outlined, outline };
    Some(filtered(discs, eye))
}

struct Outline<S: Simd> {
    center_px: [F<S>; 2],
    along: [F<S>; 2],
    half_axes: [F<S>; 2],
    depth_range: [F<S>; 2],
    kappa: F<S>,
    valid: M<S>,
}

#[inline(always)]
fn outline_of<S: Simd>(disc: &Discs<S>, px: [F<S>; 2], ray: [F<S>; 2], eye: &Eye) -> Outline<S> {
    let simd = disc.reach.token();
    let splat = |value: f32| F::splat(simd, value);
    let zero = splat(0.0);
    let distance = if eye.orthographic { splat(1.0) } else { -disc.center.z };
    let tilt = [-disc.axis_u.z / distance, -disc.axis_v.z / distance];
    let zeta = if eye.orthographic { [zero; 2] } else { tilt };
    let kappa = splat(1.0) - (zeta[0] * zeta[0] + zeta[1] * zeta[1]);
    let jacobian =
        |axis: V<S>| [px[0] * (axis.x + ray[0] * axis.z), px[1] * (axis.y + ray[1] * axis.z)];
    let (mut ju, mut jv) = (jacobian(disc.axis_u), jacobian(disc.axis_v));
    let size = larger(larger(ju[0].abs(), ju[1].abs()), larger(jv[0].abs(), jv[1].abs()));
    let valid = kappa.simd_ge(splat(MIN_KAPPA)) & size.simd_gt(zero);
    ju = [ju[0] / size, ju[1] / size];
    jv = [jv[0] / size, jv[1] / size];
    let shift =
        [(ju[0] * zeta[0] + jv[0] * zeta[1]) / kappa, (ju[1] * zeta[0] + jv[1] * zeta[1]) / kappa];
    let xx = (ju[0] * ju[0] + jv[0] * jv[0]) / kappa + shift[0] * shift[0];
    let xy = (ju[0] * ju[1] + jv[0] * jv[1]) / kappa + shift[0] * shift[1];
    let yy = (ju[1] * ju[1] + jv[1] * jv[1]) / kappa + shift[1] * shift[1];
    let determinant = ju[0] * jv[1] - ju[1] * jv[0];
    let half_difference = (xx - yy) * 0.5;
    let root = length2(half_difference, xy);
    let major = ((xx + yy) * 0.5 + root).sqrt();
    let minor = determinant.abs() / (kappa * kappa.sqrt() * major);
    let (long, short) = (root + half_difference.abs(), xy.abs());
    let upright = zero.simd_gt(half_difference);
    let (x, y) = (upright.select(short, long), upright.select(long, short));
    let y = zero.simd_gt(xy).select(-y, y);
    // A circle has no direction.
    let turned = root.simd_gt(major * major * 1e-6);
    let (x, y) = (turned.select(x, splat(1.0)), turned.select(y, zero));
    let norm = length2(x, y);
    let along = [x / norm, y / norm];
    let p = [
        (along[0] * ju[0] + along[1] * ju[1]) / major,
        (along[0] * jv[0] + along[1] * jv[1]) / major,
    ];
    let handed = determinant.simd_gt(zero).select(splat(-1.0), splat(1.0));
    let sideways = handed * (tilt[0] * p[1] - tilt[1] * p[0]);
    let depth_range = [(p[0] * tilt[0] + p[1] * tilt[1]) / kappa, sideways / kappa.sqrt()];
    Outline {
        center_px: [-(shift[0] * size), -(shift[1] * size)],
        along,
        half_axes: [major * size, minor * size],
        depth_range,
        kappa,
        valid,
    }
}

impl<S: Simd> Outline<S> {
    /// What ellipses with these half axes reach on the screen: left, top, right, bottom. `center_px` are
    /// the pixels of the discs' centres, from the middle of the picture to the right and up.
    #[inline(always)]
    fn pixels(&self, half: [F<S>; 2], center_px: [F<S>; 2], eye: &Eye) -> [F<S>; 4] {
        let across = length2(self.along[0] * half[0], self.along[1] * half[1]);
        let down = length2(self.along[1] * half[0], self.along[0] * half[1]);
        let x = center_px[0] + self.center_px[0] + eye.middle_px[0];
        let y = -(center_px[1] + self.center_px[1]) + eye.middle_px[1];
        [x - across, y - down, x + across, y + down]
    }
}

/// How much farther widened discs are at the ends of their half axes than at their centres.
#[inline(always)]
fn widened_range<S: Simd>(
    own: &Outline<S>,
    widened: [F<S>; 2],
    kept: [F<S>; 2],
    distance: F<S>,
    eye: &Eye,
) -> [F<S>; 2] {
    let simd = distance.token();
    let splat = |value: f32| F::splat(simd, value);
    let per_unit = splat(eye.px_per_unit[1]);
    let mut range = [distance; 2];
    for i in 0..2 {
        let magnitude = own.depth_range[i].abs();
        let slope = magnitude * per_unit / larger(own.half_axes[i], splat(1e-6));
        let steep = splat(MAX_SLOPE) / larger(slope, splat(MAX_SLOPE));
        let followed = slope * steep * steep * widened[i] / per_unit;
        range[i] = with_sign(larger(magnitude * kept[i], followed), own.depth_range[i]);
    }
    let reach = length2(range[0], range[1]);
    let nearest = match eye.orthographic {
        true => distance - reach,
        false => distance * own.kappa / (reach + 1.0),
    };
    let left = splat(1.0) - (range[0] * range[0] + range[1] * range[1]);
    let bent = M::splat(simd, !eye.orthographic) & (own.kappa * 0.5).simd_gt(left);
    let out_of_depth = bent | !nearest.simd_gt(splat(eye.near));
    for i in 0..2 {
        range[i] = out_of_depth.select(own.depth_range[i] * kept[i], range[i]);
    }
    range
}

/// The discs widened by the screen-space low-pass, and what of the screen they cover.
#[inline(always)]
fn filtered<S: Simd>(disc: Discs<S>, eye: &Eye) -> Discs<S> {
    let simd = disc.reach.token();
    let splat = |value: f32| F::splat(simd, value);
    let zero = splat(0.0);
    let distance = -disc.center.z;
    let before_near = (distance - length2(disc.axis_u.z, disc.axis_v.z)).simd_gt(splat(eye.near));
    let per_unit = [splat(eye.px_per_unit[0]), splat(eye.px_per_unit[1])];
    let (px, ray) = if eye.orthographic {
        (per_unit, [zero; 2])
    } else {
        let px = [per_unit[0] / distance, per_unit[1] / distance];
        (px, [disc.center.x / distance, disc.center.y / distance])
    };
    let own = outline_of(&disc, px, ray, eye);
    let outlined = before_near & own.valid;
    let low_pass = splat(eye.low_pass);
    let widens =
        outlined & low_pass.simd_gt(zero) & !own.half_axes[1].simd_ge(low_pass * WIDENED_BELOW);
    let widen = |half_axis: F<S>| (half_axis * half_axis + low_pass * low_pass).sqrt();
    let widened = [widen(own.half_axes[0]), widen(own.half_axes[1])];
    let kept = [own.half_axes[0] / widened[0], own.half_axes[1] / widened[1]];

    let range = widened_range(&own, widened, kept, distance, eye);
    let added = |i: usize| (own.depth_range[i].abs() + range[i].abs()) * (splat(1.0) - kept[i]);
    let behind = disc.back.select(added(0) + added(1), zero);

    let zeta = if eye.orthographic { [zero; 2] } else { range };
    let kappa = splat(1.0) - (zeta[0] * zeta[0] + zeta[1] * zeta[1]);
    let in_perspective = distance * own.kappa / kappa * (behind + 1.0);
    let (center_depth, unit) = match eye.orthographic {
        true => (distance + behind, splat(1.0)),
        false => (in_perspective, in_perspective),
    };
    let axis_depths = [range[0] * unit, range[1] * unit];
    let root_kappa = kappa.sqrt();
    let s_px = [own.along[0] * widened[0], own.along[1] * widened[0]];
    let t_px = [-(own.along[1] * widened[1]), own.along[0] * widened[1]];
    let mut center = [disc.center.x, disc.center.y];
    let (mut u, mut v) = ([zero; 2], [zero; 2]);
    for i in 0..2 {
        let to_center_px = s_px[i] * zeta[0] + t_px[i] * zeta[1];
        let stretched_px = to_center_px / (root_kappa + 1.0);
        let u_px = own.center_px[i] * zeta[0] + s_px[i] * root_kappa + stretched_px * zeta[0];
        let v_px = own.center_px[i] * zeta[1] + t_px[i] * root_kappa + stretched_px * zeta[1];
        let units = unit / per_unit[i];
        center[i] = center[i]
            + ray[i] * (center_depth - distance)
            + (own.center_px[i] + to_center_px) * units;
        u[i] = ray[i] * axis_depths[0] + u_px * units;
        v[i] = ray[i] * axis_depths[1] + v_px * units;
    }
    let wide_u = V { x: u[0], y: u[1], z: -axis_depths[0] };
    let wide_v = V { x: v[0], y: v[1], z: -axis_depths[1] };
    let wide_center = V { x: center[0], y: center[1], z: -center_depth };
    let axis_u = V::pick(widens, wide_u, disc.axis_u);
    let axis_v = V::pick(widens, wide_v, disc.axis_v);
    let half =
        [widens.select(widened[0], own.half_axes[0]), widens.select(widened[1], own.half_axes[1])];
    let outline = own.pixels(half, [px[0] * disc.center.x, px[1] * disc.center.y], eye);
    Discs {
        center: V::pick(widens, wide_center, disc.center),
        axis_u,
        axis_v,
        reach: widens.select(longer_half_axis(wide_u, wide_v), disc.reach),
        share: widens.select(larger(kept[0] * kept[1], splat(MIN_SHARE)), disc.share),
        kept: kept.map(|kept| widens.select(kept, splat(1.0))),
        outlined,
        outline,
        ..disc
    }
}

impl<S: Simd> Discs<S> {
    /// First and behind-last pixels that a sphere around each may cover, where the outline is not
    /// known: those that are large, or near the eye.
    #[inline(always)]
    pub(crate) fn pixel_boxes(&self, eye: &Eye) -> [F<S>; 4] {
        let simd = self.reach.token();
        let splat = |value: f32| F::splat(simd, value);
        let zero = splat(0.0);
        let size = [eye.size_px[0] as f32, eye.size_px[1] as f32];
        let distance = -self.center.z;
        let mut boxes = [zero, zero, splat(size[0]), splat(size[1])];
        let near = splat(eye.near);
        let beyond = (distance - self.reach).simd_gt(near);
        let gone = near.simd_gt(distance + self.reach);
        for i in 0..2 {
            let across = if i == 0 { self.center.x } else { -self.center.y };
            let (low, high) = (across - self.reach, across + self.reach);
            let [low, high] = if eye.orthographic {
                [low, high]
            } else {
                let (near, far) = (distance - self.reach, distance + self.reach);
                [smaller(low / near, low / far), larger(high / near, high / far)]
            };
            let px = eye.px_per_unit[i];
            let known = if eye.orthographic { M::splat(simd, true) } else { beyond };
            boxes[i] = known.select(low * px + eye.middle_px[i], boxes[i]);
            boxes[i + 2] = known.select(high * px + eye.middle_px[i], boxes[i + 2]);
        }
        if !eye.orthographic {
            boxes[2] = gone.select(zero, boxes[2]);
        }
        let mut chosen = boxes;
        for i in 0..4 {
            chosen[i] = self.outlined.select(self.outline[i], boxes[i]);
        }
        chosen
    }
}
