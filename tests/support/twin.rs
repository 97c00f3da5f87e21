//! The surface buffer and the baseline's lighting computed in f64, pixel by pixel, for small
//! scenes: the same rules as the shaders, without a rasteriser.

mod local;
mod outline;
mod rims;

use crate::evaluated_light::arriving;
use glam::{DMat3, DMat4, DVec2, DVec3};
use local::Local;
use outline::Outline;
use surfelshop_api::{Projection, Scene, View, columns};
use surfelshop_cloud::{Buffer, Cloud, Column};

/// One pixel of the surface.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pixel {
    /// Distance along the viewing axis; 0 where nothing is.
    pub depth: f64,
    /// How fast the depth of the nearest splat changes, scene units per pixel.
    pub slope: f64,
    /// Blended unit normal, world-oriented.
    pub normal: DVec3,
    /// Blended linear albedo.
    pub albedo: DVec3,
    /// No splat's edge is so near, and no depth so near the limit of blending, that rounding
    /// decides: [`Doubt`].
    pub sure: bool,
    /// The same for which splat is the nearest, alone.
    pub nearest_sure: bool,
}

/// What rounding may change, so that it may decide whether and in which order splats are seen.
#[derive(Clone, Copy, Debug)]
pub struct Doubt {
    /// A splat's edge on the screen, pixels.
    pub edge_px: f64,
    /// A depth, as a fraction of the splat's reach.
    pub reach: f64,
    /// A depth by a step of so many pixels on the splat.
    pub step_px: f64,
    /// A depth, as a fraction of itself.
    pub relative: f64,
    /// A depth, scene units.
    pub absolute: f64,
}

impl Default for Doubt {
    /// For lighting, which is the harder to tell: twice what vertices snapped to 1/256 pixel and f32
    /// positions in a picture of a few hundred pixels move an edge by, and depths interpolated over
    /// splats whose corners are snapped.
    fn default() -> Self {
        Self { edge_px: 0.01, reach: 0.01, step_px: 0.0, relative: 0.0, absolute: 0.0 }
    }
}

impl Doubt {
    /// What it says of a depth, reach aside.
    fn at(&self, hit: &Hit<'_>) -> f64 {
        self.step_px * hit.slope + self.relative * hit.depth + self.absolute
    }

    /// What it says of the difference of a splat's depth and that of the nearest.
    fn of(&self, hit: &Hit<'_>, nearest: &Hit<'_>) -> f64 {
        self.reach * hit.splat.reach + self.at(hit) + self.at(nearest)
    }
}

/// Settings of the twin's lighting, as the baseline's parameters.
#[derive(Clone, Copy, Debug)]
pub struct Phong {
    /// Factor on the diffuse term.
    pub diffuse: f64,
    /// Radiance of the highlight's peak.
    pub specular: f64,
    /// Exponent of the highlight.
    pub shininess: f64,
    /// Radiance of an unlit white surface.
    pub ambient: f64,
}

/// The splats of a view.
pub struct Twin<'a> {
    splats: Vec<Splat>,
    scene: &'a Scene,
    view: &'a View,
    doubt: Doubt,
    /// Whether normals vary over splats that have fields.
    fields: bool,
}

impl<'a> Twin<'a> {
    /// The splats of clouds as a view of a scene sees them.
    #[must_use]
    pub fn new(clouds: &[Cloud], scene: &'a Scene, view: &'a View) -> Self {
        let of_cloud = |cloud: &Cloud| -> Vec<Splat> {
            let colors = cloud.linear_colors();
            let splat = |i| {
                let color = colors.as_ref().map_or([0.5; 3], |colors| colors[i]);
                Splat::new(cloud, i, DVec3::from_array(color.map(f64::from)), scene, view)
            };
            (0..cloud.len())
                .map(splat)
                .filter(|splat| scene.surface.two_sided || !splat.back || splat.is_round)
                .collect()
        };
        let splats = clouds.iter().flat_map(of_cloud).collect();
        Self { splats, scene, view, doubt: Doubt::default(), fields: false }
    }

    /// The same with normals that vary over splats that have fields.
    #[must_use]
    pub fn with_fields(self, fields: bool) -> Self {
        Self { fields, ..self }
    }

    /// The same with another opinion of what rounding decides.
    #[must_use]
    pub fn doubting(self, doubt: Doubt) -> Self {
        Self { doubt, ..self }
    }

    /// The blended surface at a pixel. Takes time for every splat.
    #[must_use]
    pub fn pixel(&self, x: u32, y: u32) -> Pixel {
        let (pixel, nearest) = self.raw(x, y);
        match nearest.filter(|splat| splat.back && !splat.is_round) {
            Some(splat) => self.of_rim(pixel, splat, [x, y]),
            None => pixel,
        }
    }

    /// The same before rims are looked for, and the nearest splat.
    fn raw(&self, x: u32, y: u32) -> (Pixel, Option<&Splat>) {
        let center = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
        let mut hits: Vec<Hit<'_>> =
            self.splats.iter().filter_map(|splat| splat.meet(center, self)).collect();
        let near = self.view.near;
        let cut = hits.iter().any(|hit| (hit.depth - near).abs() < self.doubt.at(hit));
        hits.retain(|hit| hit.depth >= near);
        let (_, direction) = self.view.ray(center.x, center.y);
        let to_eye = self.view.camera.view_from_world().transpose() * -direction;
        let pixel = blend(&hits, self.scene, self.view, &self.doubt, to_eye);
        let (sure, nearest_sure) = (pixel.sure && !cut, pixel.nearest_sure && !cut);
        let inside = hits.iter().filter(|hit| hit.inside_px >= 0.0);
        let nearest = inside.min_by(|a, b| a.depth.total_cmp(&b.depth)).map(|hit| hit.splat);
        (Pixel { sure, nearest_sure, ..pixel }, nearest)
    }
}

struct Hit<'a> {
    splat: &'a Splat,
    depth: f64,
    slope: f64,
    r2: f64,
    normal: DVec3,
    /// Pixels to the splat's edge or to a line that cuts it, about; negative outside.
    inside_px: f64,
}

fn blend(hits: &[Hit<'_>], scene: &Scene, view: &View, doubt: &Doubt, to_eye: DVec3) -> Pixel {
    let edge_px = doubt.edge_px;
    let inside = |hit: &&Hit<'_>| hit.inside_px >= 0.0;
    let Some(nearest) = hits.iter().filter(inside).min_by(|a, b| a.depth.total_cmp(&b.depth))
    else {
        let sure = hits.iter().all(|hit| hit.inside_px < -edge_px);
        return Pixel { sure, nearest_sure: sure, ..Pixel::default() };
    };
    let tolerance = f64::from(scene.surface.depth_tolerance);
    let (mut normal, mut albedo, mut weight) = (DVec3::ZERO, DVec3::ZERO, 0.0);
    let (mut sure, mut nearest_sure) = (true, true);
    for hit in hits {
        let splat = hit.splat;
        let slack = tolerance * splat.reach;
        let pulled = match view.camera.projection {
            Projection::Orthographic { .. } => hit.depth - slack,
            Projection::Perspective { .. } => {
                let distance = splat.center.length().max(slack);
                hit.depth / (distance / (distance - slack).max(0.5 * distance)).min(2.0)
            }
        };
        let behind = pulled - nearest.depth;
        let by_rounding = doubt.of(hit, nearest);
        if std::ptr::eq(hit, nearest) {
            nearest_sure &= hit.inside_px > edge_px;
        } else if hit.inside_px > -edge_px {
            nearest_sure &= hit.depth - nearest.depth > by_rounding;
        }
        sure &= hit.inside_px.abs() > edge_px || behind > by_rounding;
        if hit.inside_px < 0.0 {
            continue;
        }
        sure &= behind.abs() > by_rounding;
        let same_side = splat.back == nearest.splat.back;
        sure &= same_side || hit.depth - nearest.depth > by_rounding;
        if behind > 0.0 || !same_side {
            continue;
        }
        let w = (-4.0 * hit.r2).exp() * splat.share;
        normal += hit.normal * w;
        albedo += splat.albedo * w;
        weight += w;
    }
    let normal = if normal.length() > 1e-4 * weight { normal.normalize_or_zero() } else { to_eye };
    Pixel {
        depth: nearest.depth,
        slope: nearest.slope,
        normal,
        albedo: albedo / weight,
        sure,
        nearest_sure,
    }
}

/// A disc and the ellipse it is widened to on the screen.
struct Splat {
    center: DVec3,
    axis_u: DVec3,
    axis_v: DVec3,
    normal: DVec3,
    albedo: DVec3,
    back: bool,
    /// It faces the eye, and is drawn whatever sides are.
    is_round: bool,
    /// Longer half axis after widening.
    reach: f64,
    share: f64,
    outline: Option<Outline>,
    local: Option<Local>,
}

/// Definitions of the filter, as the surfel shaders have them.
const WIDENED_BELOW: f64 = 8.0;
const MIN_KAPPA: f64 = 0.05;
const MAX_SLOPE: f64 = 2.0;

/// The largest radius of a round splat in perspective, shares of its distance: as the manual says it.
const ROUND_REACH: f64 = 1.0 / 150.0;

impl Splat {
    fn new(cloud: &Cloud, i: usize, albedo: DVec3, scene: &Scene, view: &View) -> Self {
        let view_from_offset: DMat4 = view.view_from_offset(cloud.origin());
        let turned = |v: glam::Vec3| view_from_offset.transform_vector3(v.as_dvec3());
        let center = view_from_offset.transform_point3(cloud.positions()[i].as_dvec3());
        let n = turned(cloud.normals()[i]);
        let orthographic = matches!(view.camera.projection, Projection::Orthographic { .. });
        let towards = if orthographic { DVec3::Z } else { -center };
        let round = match cloud.column(columns::ROUND).map(Column::values) {
            Some(Buffer::U8(round)) => round[i],
            _ => 0,
        };
        let is_round = round != 0;
        let back = n.dot(towards) < 0.0;
        let scale = f64::from(scene.surface.radius_scale);
        let tangents = [columns::TANGENT_U, columns::TANGENT_V].map(|name| cloud.vectors(name));
        let [axis_u, axis_v] = if tangents[0].is_empty() {
            let (u, v) =
                if is_round { towards.normalize_or(DVec3::Z) } else { n }.any_orthonormal_pair();
            let own = f64::from(cloud.radii()[i]) * scale;
            // Clouds of the tests have round splats of one kind.
            let bounded = is_round && round != columns::ROUND_UNBOUNDED && !orthographic;
            let radius = if bounded { own.min(center.length() * ROUND_REACH * scale) } else { own };
            [u, v].map(|axis| axis * radius)
        } else {
            tangents.map(|axes| turned(axes[i]) * scale)
        };
        let world_normal = cloud.normals()[i].as_dvec3();
        let mut splat = Self {
            center,
            axis_u,
            axis_v,
            normal: if back { -world_normal } else { world_normal },
            albedo,
            back,
            is_round,
            reach: longer_half_axis(axis_u, axis_v),
            share: 1.0,
            outline: None,
            local: Local::new(cloud, i, &turned, back),
        };
        splat.widen(f64::from(scene.surface.low_pass), view);
        splat
    }

    /// The outline of the disc on the screen from its dual conic, and the widened one.
    fn widen(&mut self, low_pass: f64, view: &View) {
        let depth_range = self.axis_u.z.hypot(self.axis_v.z);
        if low_pass <= 0.0 || -self.center.z - depth_range <= view.near {
            return;
        }
        // Tangent lines of the unit circle are those with n n' = c^2. Pixels are counted from the
        // centre's, for a difference of large numbers would not keep a small outline.
        let h = self.screen_from_disc(view);
        let origin = h.z_axis.truncate() / h.z_axis.z;
        let to_origin = DMat3::from_cols(DVec3::X, DVec3::Y, (-origin).extend(1.0));
        let h = to_origin * h;
        let dual = h * DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0)) * h.transpose();
        let scale = -1.0 / dual.z_axis.z;
        let center = -dual.z_axis.truncate() * scale;
        let xx = dual.x_axis.x * scale + center.x * center.x;
        let xy = dual.x_axis.y * scale + center.x * center.y;
        let yy = dual.y_axis.y * scale + center.y * center.y;
        let mean = 0.5 * (xx + yy);
        let root = (0.5 * (xx - yy)).hypot(xy);
        let along = DVec2::from_angle(0.5 * (2.0 * xy).atan2(xx - yy));
        let major = (mean + root).sqrt();
        // The area over the longer half axis, for the same reason.
        let own = [major, (h.determinant().abs() * scale.powf(1.5) / major).max(1e-6)];
        let center = center + origin;
        let widened = own.map(|half_axis| half_axis.hypot(low_pass));
        let orthographic = matches!(view.camera.projection, Projection::Orthographic { .. });
        let kappa = if orthographic { 1.0 } else { 1.0 - (depth_range / self.center.z).powi(2) };
        if kappa < MIN_KAPPA || own[1] >= WIDENED_BELOW * low_pass {
            return;
        }
        let axes = [along, along.perp()];
        // Depths where the outline's own axes end, on the disc's plane.
        let depth_at = |px: DVec2| {
            let depth = self.disc_at(px, view).1;
            if orthographic { depth } else { 1.0 / depth }
        };
        let middle = depth_at(center);
        let relative_to = if orthographic { 1.0 } else { middle };
        let pixel = view.half_extent()[1] * 2.0 / f64::from(view.size_px[1]);
        let (mut ranges, mut inside, mut away) = ([0.0; 2], [0.0; 2], [(0.0, 0.0); 2]);
        for k in 0..2 {
            let end = axes[k] * own[k];
            let range = 0.5 * (depth_at(center + end) - depth_at(center - end)) / relative_to;
            let slope = range.abs() / own[k] / pixel;
            let followed = if slope > MAX_SLOPE { MAX_SLOPE.powi(2) / slope } else { slope };
            let kept = own[k] / widened[k];
            ranges[k] = (range.abs() * kept).max(followed * pixel * widened[k]) * range.signum();
            inside[k] = range * kept;
            away[k] = (range.abs(), 1.0 - kept);
        }
        let reach = ranges[0].hypot(ranges[1]);
        let nearest = if orthographic { middle - reach } else { 1.0 / (middle * (1.0 + reach)) };
        if (!orthographic && 1.0 - reach * reach < 0.5 * kappa) || nearest <= view.near {
            ranges = inside;
        }
        let behind: f64 = (0..2).map(|k| (away[k].0 + ranges[k].abs()) * away[k].1).sum();
        let moved = match (self.back, orthographic) {
            (false, _) => middle,
            (true, true) => middle + behind,
            (true, false) => middle / (1.0 + behind),
        };
        let scale = if orthographic { 1.0 } else { moved };
        let [s, t] = ranges.map(|range| range * scale);
        let outline = Outline { center, axes, widened, own, depth: [moved, s, t], orthographic };
        self.reach = outline.reach(view);
        self.share = (own[0] * own[1] / (widened[0] * widened[1])).max(1e-6);
        self.outline = Some(outline);
    }

    /// Maps (u, v, 1) of the disc to (x d, y d, d): pixels and depth along the viewing axis.
    fn screen_from_disc(&self, view: &View) -> DMat3 {
        let [half_x, half_y] = view.half_extent();
        let [w, h] = view.size_px.map(f64::from);
        let orthographic = matches!(view.camera.projection, Projection::Orthographic { .. });
        let project = |v: DVec3, is_point: f64| {
            let d = if orthographic { is_point } else { -v.z };
            DVec3::new(0.5 * w * (v.x / half_x + d), 0.5 * h * (d - v.y / half_y), d)
        };
        DMat3::from_cols(
            project(self.axis_u, 0.0),
            project(self.axis_v, 0.0),
            project(self.center, 1.0),
        )
    }

    /// Position in the disc that a pixel shows, and its distance along the viewing axis, negative
    /// behind the eye; before widening.
    fn disc_at(&self, px: DVec2, view: &View) -> (DVec2, f64) {
        let w = self.screen_from_disc(view).inverse() * px.extend(1.0);
        let at = w.truncate() / w.z;
        let depth = -(self.center.z + at.x * self.axis_u.z + at.y * self.axis_v.z);
        (at, if w.z > 0.0 { depth } else { -1.0 })
    }

    /// The point that a pixel shows, view space.
    fn point_at(&self, px: DVec2, view: &View) -> DVec3 {
        match &self.outline {
            Some(outline) => outline.point(outline.position(px), view),
            None => {
                let (at, _) = self.disc_at(px, view);
                self.center + at.x * self.axis_u + at.y * self.axis_v
            }
        }
    }

    /// Where of the splat a pixel's filter sees its field, from the splat's centre: for Gaussians the
    /// mean of what blends into a pixel lies nearer to the middle, by the splat's share of the variance.
    fn filtered_at(&self, px: DVec2, view: &View) -> DVec3 {
        let Some(outline) = &self.outline else { return self.point_at(px, view) - self.center };
        // The widened disc's own coordinates, in which it is linear in space.
        let zeta = -outline.tilt();
        let root = (1.0 - zeta.length_squared()).sqrt();
        let boost = |at: DVec2, zeta: DVec2| {
            let across = at * root + zeta * (zeta.dot(at) / (1.0 + root));
            (zeta + across) / (1.0 + zeta.dot(at))
        };
        let on_disc = boost(outline.position(px), -zeta);
        let kept: DVec2 = (0..2)
            .map(|k| {
                let axis = if k == 0 { DVec2::X } else { DVec2::Y };
                axis * (on_disc.dot(axis) * (outline.own[k] / outline.widened[k]).powi(2))
            })
            .sum();
        outline.point(boost(kept, zeta), view) - outline.point(zeta, view)
    }

    /// What a pixel sees of the splat, if it is near enough to its edge to matter.
    fn meet(&self, px: DVec2, twin: &Twin<'_>) -> Option<Hit<'_>> {
        let view = twin.view;
        let at = |px: DVec2| match &self.outline {
            Some(outline) => outline.meet(px),
            None => {
                let (at, depth) = self.disc_at(px, view);
                (at.length_squared(), depth)
            }
        };
        let (r2, depth) = at(px);
        if depth <= 0.0 || r2.is_nan() || r2 >= 16.0 {
            return None;
        }
        // A hundredth of a pixel is small against every splat and large against rounding.
        let step = 0.01;
        let [right, down] = [DVec2::X, DVec2::Y].map(|d| at(px + d * step));
        let slope = (right.1 - depth).hypot(down.1 - depth) / step;
        let r = r2.max(0.0).sqrt();
        let grown = [right, down].map(|(r2, _)| r2.max(0.0).sqrt() - r);
        let mut inside_px = (1.0 - r) / (grown[0].hypot(grown[1]) / step);
        let mut normal = self.normal;
        if let Some(local) = &self.local {
            let side = |px: DVec2| local.stays(self.point_at(px, view) - self.center);
            let here = side(px);
            let [right, down] = [DVec2::X, DVec2::Y].map(|d| side(px + d * step) - here);
            let moved = right.hypot(down) / step;
            let to_line = if here == f64::INFINITY { here } else { here / moved.max(1e-12) };
            inside_px = inside_px.min(to_line);
            if let Some(of_field) = local.normal(self.filtered_at(px, view)).filter(|_| twin.fields)
            {
                normal = of_field;
            }
        }
        Some(Hit { splat: self, depth, slope, r2, normal, inside_px })
    }
}

/// The longer half axis of an ellipse given by any two conjugate ones: the far end of the curve
/// `cos a u + sin a v`, found at the angle where its length stops growing.
fn longer_half_axis(u: DVec3, v: DVec3) -> f64 {
    let angle = 0.5 * (2.0 * u.dot(v)).atan2(u.length_squared() - v.length_squared());
    (u * angle.cos() + v * angle.sin()).length()
}

/// The place in world space that a position of the picture shows at a distance along the viewing axis.
#[must_use]
pub fn place(view: &View, position_px: [f64; 2], depth: f64) -> DVec3 {
    let (start, direction) = view.ray(position_px[0], position_px[1]);
    let in_view = start + direction * (depth / -direction.z);
    view.camera.eye + view.camera.view_from_world().transpose() * in_view
}

/// The baseline's radiance of a pixel, as `ewa-phong` computes it.
#[must_use]
pub fn shade(pixel: &Pixel, scene: &Scene, view: &View, position_px: [f64; 2], p: &Phong) -> DVec3 {
    let world_from_view = view.camera.view_from_world().transpose();
    let (_, direction) = view.ray(position_px[0], position_px[1]);
    let to_eye = world_from_view * -direction;
    let place = place(view, position_px, pixel.depth);
    let mut radiance = pixel.albedo * p.ambient;
    for light in &scene.lights {
        let (towards, light) = arriving(light, view, place);
        let cosine = pixel.normal.dot(towards).max(0.0);
        let half = (towards + to_eye).normalize_or_zero();
        let lit =
            if cosine > 0.0 { pixel.normal.dot(half).max(0.0).powf(p.shininess) } else { 0.0 };
        radiance += light * (pixel.albedo * p.diffuse * cosine + DVec3::splat(p.specular * lit));
    }
    radiance
}
