//! A fly agaric: domed cap with warts, gills beneath, a skirted stem with a ringed bulb.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use crate::field::{Frame, Part, ellipsoid, smooth_max, smooth_min, step};
use crate::noise::{Random, pebbled, rough, smooth};
use crate::portable::{atan2, sin, sin_cos};

/// What makes one mushroom differ from another; lengths in scene units.
#[derive(Clone, Copy, Debug)]
pub struct Form {
    /// Where the stem's axis meets y = 0.
    pub foot: DVec3,
    /// The middle of the cap's rim.
    pub top: DVec3,
    /// The direction the cap faces.
    pub cap_up: DVec3,
    /// Radius of the cap's rim.
    pub cap_radius: f64,
    /// Height of the dome over the rim.
    pub cap_height: f64,
    /// Radius of the stem at half height.
    pub stem_radius: f64,
    /// Where the skirt hangs along the stem, from 0 to 1, and its width.
    pub skirt: Option<(f64, f64)>,
    /// Gills that reach the stem; as many short ones stand between them.
    pub gills: u32,
    /// Warts on the dome.
    pub warts: u32,
    /// Makes warts and undulations differ.
    pub seed: u64,
}

/// A mushroom ready to be sampled.
#[derive(Clone, Debug)]
pub struct Mushroom {
    form: Form,
    cap: Frame,
    /// Centres in the cap's frame, and radii.
    warts: Vec<(DVec3, f64)>,
}

/// Distances to the pieces a mushroom is painted by.
struct Pieces {
    cap: f64,
    warts: f64,
    stem: f64,
    skirt: f64,
}

impl Mushroom {
    /// Places the warts of this form.
    #[must_use]
    pub fn new(form: Form) -> Self {
        let cap = Frame::new(form.top, form.cap_up, DVec3::X);
        Self { warts: place_warts(&form), form, cap }
    }

    /// The place on the dome above a point of the cap's plane, standing upright on the surface,
    /// looking along `forward` (a direction in the cap's plane).
    #[must_use]
    pub fn on_cap(&self, x: f64, z: f64, forward: DVec2) -> Frame {
        let Form { cap_radius, cap_height, .. } = self.form;
        let fraction = (x * x + z * z) / (cap_radius * cap_radius);
        let y = cap_height * (1.0 - fraction).max(0.0).sqrt();
        let slope = (cap_height / cap_radius) * (cap_height / cap_radius);
        let up = DVec3::new(x * slope, y, z * slope);
        let forward = DVec3::new(forward.x, 0.0, forward.y);
        let origin = self.cap.world(DVec3::new(x, y, z));
        Frame::new(origin, self.cap.turned(up), self.cap.turned(forward))
    }

    /// Removes the warts in a strip under something that sits on the cap: half as long and half as
    /// wide as given, along the x and z axes of its place.
    pub fn clear_strip(&mut self, place: &Frame, half_length: f64, half_width: f64) {
        let cap = self.cap;
        self.warts.retain(|(centre, radius)| {
            let offset = place.local(cap.world(*centre));
            offset.x.abs() > half_length + radius || offset.z.abs() > half_width + radius
        });
    }

    fn pieces(&self, point: DVec3) -> Pieces {
        let local = self.cap.local(point);
        let cap = self.cap_distance(local);
        Pieces {
            cap,
            warts: self.wart_distance(local, cap),
            stem: self.stem_distance(point),
            skirt: self.skirt_distance(point),
        }
    }

    /// The dome, hollowed from beneath by a vault that carries the gills.
    fn cap_distance(&self, local: DVec3) -> f64 {
        let Form { cap_radius, cap_height, .. } = self.form;
        let around = atan2(local.z, local.x);
        let wave = 1.0 + 0.012 * sin(around * 3.0 + self.phase()) + 0.008 * sin(around * 7.0);
        let flat = DVec3::new(local.x / wave, local.y, local.z / wave);
        let dome = ellipsoid(flat, DVec3::new(cap_radius, cap_height, cap_radius));
        let reach = DVec2::new(flat.x, flat.z).length() / cap_radius;
        let vault = cap_height * (0.04 + 0.26 * (1.0 - reach * reach));
        let hung = vault - self.gill_depth(around, reach);
        // The vault is a height field; its steep gills call for a gentler slope.
        smooth_max(dome, (hung - local.y) * 0.5, cap_radius * 0.045)
    }

    /// How far the gills hang down here. Short gills stand between the long ones near the rim,
    /// where the gaps would become wide, as they do in nature.
    fn gill_depth(&self, around: f64, reach: f64) -> f64 {
        let bend = 0.12 * reach * sin(around * 5.0 + self.phase());
        let phase = around * f64::from(self.form.gills) + bend;
        let blade = |phase: f64| step(0.45, 0.98, 0.5 + 0.5 * sin(phase));
        let long = blade(phase) * step(0.16, 0.36, reach);
        let short = blade(phase + PI) * step(0.5, 0.62, reach);
        (long + short) * self.form.cap_radius * 0.11 * step(0.98, 0.78, reach)
    }

    fn wart_distance(&self, local: DVec3, cap: f64) -> f64 {
        // Warts rise at most this far above the dome, so farther points need not ask each one.
        let highest = self.form.cap_radius * 0.16;
        if cap > highest || local.y < -highest {
            return cap.max(highest);
        }
        let nearest = self.warts.iter().map(|(centre, radius)| {
            let offset = local - *centre;
            let away = *centre / centre.length();
            let lift = offset.dot(away);
            // A wart is a lump a little flatter than a ball.
            (offset + away * lift * 0.25).length() - radius
        });
        let crumbs = pebbled(local / self.form.cap_radius * 25.0 + DVec3::splat(self.phase()));
        nearest.fold(highest, f64::min) - (crumbs - 0.5) * 0.015 * self.form.cap_radius
    }

    /// How far up the stem a height lies, from 0 to 1, and the stem's axis there.
    fn stem_axis(&self, height: f64) -> (f64, DVec3) {
        let Form { foot, top, .. } = self.form;
        let t = ((height - foot.y) / (top.y - foot.y)).clamp(0.0, 1.0);
        // The stem leaves the ground upright and leans more and more towards its cap.
        let lean = t * t * (1.6 - 0.6 * t);
        (t, DVec3::new(foot.x + (top.x - foot.x) * lean, height, foot.z + (top.z - foot.z) * lean))
    }

    fn stem_distance(&self, point: DVec3) -> f64 {
        let Form { foot, top, stem_radius, .. } = self.form;
        let (t, axis) = self.stem_axis(point.y);
        let offset = DVec2::new(point.x - axis.x, point.z - axis.z);
        let around = atan2(offset.y, offset.x);
        let bulb = step(0.30, 0.0, t);
        let rings = bulb * 0.07 * sin(t * 62.0 + 1.2 * smooth(point * 9.0));
        let fibres = (stem_radius * 135.0).round();
        let fibres = (1.0 - bulb) * 0.018 * sin(around * fibres + 4.0 * smooth(point * 4.0));
        let flare = 0.25 * step(0.8, 1.0, t) + 0.75 * bulb;
        let radius = stem_radius * (0.95 + flare + rings + fibres);
        let side = (offset.length() - radius) * 0.9;
        let ends = (point.y - top.y - 0.42 * self.form.cap_height).max(foot.y - point.y);
        smooth_max(side, ends, 0.02)
    }

    /// A thin pleated cloth that hangs around the stem.
    fn skirt_distance(&self, point: DVec3) -> f64 {
        let Some((along, width)) = self.form.skirt else { return f64::MAX };
        let Form { foot, top, stem_radius, .. } = self.form;
        let height = point.y - (foot.y + (top.y - foot.y) * along);
        let (_, axis) = self.stem_axis(point.y);
        let offset = DVec2::new(point.x - axis.x, point.z - axis.z);
        let out = (offset.length() - stem_radius) / width;
        let around = atan2(offset.y, offset.x);
        let pleats =
            out.clamp(0.0, 1.2) * (0.11 * sin(around * 11.0) + 0.07 * sin(around * 4.0 + 1.0));
        let hang = width * (0.25 - 1.05 * out * out.abs().sqrt().max(0.2) + pleats);
        let sheet = (height - hang).abs() * 0.55 - 0.0055;
        let edge = (out - 1.0 - 0.06 * sin(around * 22.0)) * width;
        smooth_max(smooth_max(sheet, edge, 0.008), -(out + 0.3) * width, 0.008)
    }

    fn phase(&self) -> f64 {
        self.form.seed as f64 * 1.7
    }

    fn cap_paint(&self, local: DVec3, wart: f64) -> DVec3 {
        let Form { cap_radius, cap_height, .. } = self.form;
        let reach = DVec2::new(local.x, local.z).length() / cap_radius;
        let mottled = rough(local / cap_radius * 3.1 + DVec3::splat(self.phase()));
        let red = DVec3::new(0.80, 0.085, 0.055);
        let orange = DVec3::new(0.93, 0.36, 0.10);
        let skin = red.lerp(orange, (step(0.62, 1.02, reach) + 0.22 * mottled).clamp(0.0, 1.0));
        let dark = DVec3::new(0.58, 0.03, 0.05);
        let skin = skin.lerp(dark, step(0.5, 0.0, reach) * (0.55 + 0.3 * mottled));
        let cream = DVec3::new(0.97, 0.93, 0.82);
        let crumb = cream.lerp(DVec3::new(0.88, 0.77, 0.55), step(-0.2, 0.8, mottled) * 0.6);
        let top = skin.lerp(crumb, wart);
        // Seen from beneath: the gills' cream, darker where they meet the flesh.
        let vault = cap_height * (0.04 + 0.26 * (1.0 - reach * reach));
        let depth = step(0.0, 0.10 * cap_radius, vault - local.y);
        let gill = DVec3::new(0.80, 0.66, 0.46).lerp(DVec3::new(0.98, 0.94, 0.83), depth);
        let on_top = (local.x * local.x + local.z * local.z) / (cap_radius * cap_radius)
            + (local.y / cap_height) * (local.y / cap_height);
        top.lerp(gill, step(0.93, 0.86, on_top))
    }

    fn stem_paint(&self, point: DVec3) -> DVec3 {
        let (t, axis) = self.stem_axis(point.y);
        let offset = point - axis;
        let around = atan2(offset.z, offset.x);
        let streak = smooth(DVec3::new(around * 5.0, point.y * 4.0, self.phase()));
        let white = DVec3::new(0.95, 0.92, 0.84);
        let shade = DVec3::new(0.80, 0.71, 0.56);
        let fibres = white.lerp(shade, step(-0.1, 0.9, streak) * 0.75);
        let earth = DVec3::new(0.55, 0.42, 0.28);
        let soil = step(0.20, 0.02, t + 0.06 * rough(point * 12.0));
        fibres.lerp(earth, soil * 0.8)
    }
}

impl Part for Mushroom {
    fn distance(&self, point: DVec3) -> f64 {
        let pieces = self.pieces(point);
        let cap = smooth_min(pieces.cap, pieces.warts, self.form.cap_radius * 0.025);
        let stem = smooth_min(pieces.stem, pieces.skirt, 0.012);
        smooth_min(cap, stem, 0.03)
    }

    fn ball(&self) -> (DVec3, f64) {
        let Form { foot, top, cap_radius, cap_height, .. } = self.form;
        let centre = (foot + top) / 2.0;
        let cap = (top - centre).length() + cap_radius.max(cap_height) * 1.2;
        (centre, cap)
    }

    fn paint(&self, point: DVec3, _normal: DVec3) -> DVec3 {
        let pieces = self.pieces(point);
        let wart = step(0.004, -0.004, pieces.warts - pieces.cap);
        let cap = self.cap_paint(self.cap.local(point), wart);
        let on_stem = step(0.006, -0.006, pieces.stem.min(pieces.skirt) - pieces.cap);
        let on_skirt = step(0.006, -0.006, pieces.skirt - pieces.stem);
        let skirt = DVec3::new(0.97, 0.92, 0.78);
        cap.lerp(self.stem_paint(point).lerp(skirt, on_skirt * 0.85), on_stem)
    }

    fn spacing(&self, point: DVec3) -> f64 {
        let pieces = self.pieces(point);
        let local = self.cap.local(point);
        let base = 0.0100 * (0.6 + 0.4 * (self.form.cap_radius / 0.6).min(1.0));
        if pieces.skirt < 0.01 || (pieces.cap < 0.01 && local.y < 0.2 * self.form.cap_height) {
            base * 0.78
        } else if pieces.warts < 0.01 {
            base * 0.85
        } else {
            base
        }
    }
}

/// Spreads warts over the dome along a spiral of equal areas, each a little out of its place.
fn place_warts(form: &Form) -> Vec<(DVec3, f64)> {
    let mut random = Random::new(form.seed);
    let golden = PI * (3.0 - 5.0_f64.sqrt());
    let mut place = |index: u32| {
        let share = (f64::from(index) + 0.5) / f64::from(form.warts);
        let reach = (share * 0.96).sqrt() * (1.0 + 0.04 * random.between(-1.0, 1.0));
        let (sin, cos) = sin_cos(f64::from(index) * golden + 0.35 * random.between(-1.0, 1.0));
        let reach = reach.min(0.985);
        let y = form.cap_height * (1.0 - reach * reach).sqrt();
        let size = form.cap_radius * random.between(0.028, 0.072) * (1.15 - 0.45 * reach);
        let flat = form.cap_radius * reach;
        (DVec3::new(flat * cos, y * 0.995, flat * sin), size)
    };
    (0..form.warts).map(&mut place).collect()
}
