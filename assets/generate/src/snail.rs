//! A snail: banded spiral shell, pebbled skin, eyes on stalks.
//!
//! Local frame: x forwards, y up, z to the snail's right; the ground touches the origin and falls
//! away from it as the dome of radius [`Snail::GROUND_RADIUS`] does.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use crate::field::{Frame, Part, smooth_min, step, tapered};
use crate::noise::{pebbled, rough, smooth};
use crate::portable::{atan2, exp, sin, sin_cos};

/// Growth of the shell per radian.
const GROWTH: f64 = 0.112;
/// The angle at which the shell ends, at its mouth. The spiral passes over the snail's back and
/// comes down towards the neck.
const MOUTH: f64 = 0.9;
/// Distance of the last whorl's middle from the axis.
const WHORL: f64 = 0.138;

/// A snail ready to be sampled.
#[derive(Clone, Debug)]
pub struct Snail {
    placed: Frame,
    shell: Frame,
}

/// Where on the shell a point lies.
struct ShellPoint {
    distance: f64,
    /// Angle along the spiral, 0 at the mouth and negative towards the tip.
    along: f64,
    /// Angle around the tube, 0 away from the axis.
    around: f64,
}

impl Snail {
    /// Radius of the dome the snail was modelled on.
    pub const GROUND_RADIUS: f64 = 0.85;
    /// Half the length of its sole.
    pub const HALF_LENGTH: f64 = 0.34;
    /// Half the width of its sole.
    pub const HALF_WIDTH: f64 = 0.09;

    /// Sits at a place whose y axis is the ground's normal.
    #[must_use]
    pub fn new(placed: Frame) -> Self {
        // The axis points to the right, a little up and back, so that the spiral shows.
        let shell =
            Frame::new(DVec3::new(-0.085, 0.272, 0.135), DVec3::new(-0.18, 0.34, 1.0), DVec3::X);
        Self { placed, shell }
    }

    /// A tube along a logarithmic spiral. In the half plane through the axis and the point, every
    /// whorl is a circle, and the nearest one counts.
    fn on_shell(&self, local: DVec3) -> ShellPoint {
        let point = self.shell.local(local);
        let turn = clockwise(point, MOUTH);
        let radial = DVec2::new(point.x, point.z).length();
        let mut nearest = ShellPoint { distance: f64::MAX, along: 0.0, around: 0.0 };
        let mut scale = exp(GROWTH * turn);
        let per_turn = exp(-GROWTH * TAU);
        for whorl in 0..6 {
            let along = turn - f64::from(whorl) * TAU;
            let (middle, radius) = whorl_circle(scale, along);
            let offset = DVec2::new(radial, point.y) - middle;
            let distance = offset.length() - radius;
            if distance < nearest.distance {
                nearest = ShellPoint { distance, along, around: atan2(offset.y, offset.x) };
            }
            scale *= per_turn;
        }
        let lip = self.lip_distance(point);
        if lip < nearest.distance {
            nearest = ShellPoint { distance: lip, along: 0.0, ..nearest };
        }
        nearest
    }

    /// The mouth's thickened rim, a ring around the end of the tube, closed by the body.
    fn lip_distance(&self, point: DVec3) -> f64 {
        let (middle, radius) = whorl_circle(1.0, 0.0);
        let (sin, cos) = sin_cos(MOUTH);
        let centre = DVec3::new(middle.x * cos, middle.y, middle.x * sin);
        // The shell's frame looks from its tip; growth there runs towards larger angles.
        let forward = DVec3::new(-sin, 0.0, cos);
        let offset = point - centre;
        let depth = offset.dot(forward);
        let flat = (offset - forward * depth).length();
        let ring = DVec2::new(flat - radius * 0.97, depth).length() - 0.0115;
        let plug = DVec2::new((flat - radius * 0.85).max(0.0), depth).length() - 0.006;
        smooth_min(ring, plug, 0.01)
    }

    /// Foot, neck and head as tapered limbs, the foot broad and thin at its edge.
    fn flesh(&self, local: DVec3) -> f64 {
        let ground =
            |x: f64, lift: f64| DVec3::new(x, lift - x * x / (2.0 * Self::GROUND_RADIUS), 0.0);
        let broad = DVec3::new(local.x, local.y, local.z * 0.78);
        let foot = [
            (ground(-0.36, 0.006), 0.010),
            (ground(-0.22, 0.018), 0.036),
            (ground(-0.02, 0.030), 0.062),
            (ground(0.16, 0.034), 0.052),
        ];
        let mut flesh = chain(broad, &foot, 0.03);
        let hem = DVec3::new(local.x, local.y * 2.6, local.z * 0.72);
        let edge = [
            (DVec3::new(-0.34, -0.168, 0.0), 0.016),
            (DVec3::new(-0.16, -0.03, 0.0), 0.060),
            (DVec3::new(0.10, 0.0, 0.0), 0.068),
            (DVec3::new(0.20, -0.085, 0.0), 0.032),
        ];
        let ruffled = 0.005 * sin(local.x * 95.0 + 2.0 * smooth(local * 20.0));
        flesh = smooth_min(flesh, (chain(hem, &edge, 0.03) + ruffled) * 0.5, 0.018);
        let neck = [
            (DVec3::new(0.10, 0.035, 0.0), 0.050),
            (DVec3::new(0.22, 0.055, 0.0), 0.043),
            (DVec3::new(0.315, 0.098, 0.0), 0.040),
            (DVec3::new(0.358, 0.101, 0.0), 0.036),
        ];
        flesh = smooth_min(flesh, chain(local, &neck, 0.02), 0.04);
        // The mantle fills the shell's mouth.
        let mantle = (DVec3::new(0.02, 0.075, 0.0), 0.066);
        flesh =
            smooth_min(flesh, tapered(local, mantle, (DVec3::new(0.085, 0.08, 0.0), 0.055)), 0.03);
        let near = step(0.06, 0.02, flesh);
        if near > 0.0 {
            let lengthened = DVec3::new(local.x * 0.75, local.y, local.z);
            flesh -= near * 0.0046 * (pebbled(lengthened * 46.0) - 0.5);
        }
        flesh
    }

    /// Two long stalks with eyes, two short feelers below; both pairs mirrored in z.
    fn stalks(&self, local: DVec3) -> (f64, f64) {
        let point = DVec3::new(local.x, local.y, local.z.abs());
        let root = (DVec3::new(0.345, 0.118, 0.015), 0.0145);
        let bend = (DVec3::new(0.392, 0.192, 0.042), 0.0094);
        let eye = DVec3::new(0.440, 0.285, 0.082);
        let stalk = chain(point, &[root, bend, (eye, 0.0072)], 0.012);
        let feeler = tapered(
            point,
            (DVec3::new(0.375, 0.085, 0.016), 0.010),
            (DVec3::new(0.437, 0.066, 0.036), 0.006),
        );
        (stalk.min(feeler), (point - eye).length() - 0.0152)
    }

    fn shell_paint(&self, on: &ShellPoint, local: DVec3) -> DVec3 {
        let honey = DVec3::new(0.96, 0.78, 0.36);
        let blush = DVec3::new(0.90, 0.55, 0.33);
        let brown = DVec3::new(0.30, 0.13, 0.07);
        let base = honey.lerp(blush, step(-6.0, -16.0, on.along) * 0.8);
        let base = base.lerp(
            DVec3::new(0.99, 0.91, 0.66),
            0.5 + 0.5 * sin(on.along * 9.0 + 3.0 * rough(local * 14.0)) * 0.5,
        );
        // Five bands follow the spiral; they fray a little at their edges.
        let fray = 0.05 * smooth(DVec3::new(on.along * 7.0, on.around * 2.0, 0.5));
        let band = [(-0.25, 0.17), (0.35, 0.13), (0.86, 0.10), (1.32, 0.08), (-0.85, 0.13)]
            .iter()
            .map(|(centre, half)| step(0.045, -0.045, (on.around - centre + fray).abs() - half))
            .fold(0.0, f64::max);
        let painted = base.lerp(brown, band * 0.93 * step(-15.0, -9.0, on.along));
        painted.lerp(DVec3::new(0.93, 0.82, 0.70), step(-0.10, -0.02, on.along))
    }

    fn flesh_paint(&self, local: DVec3) -> DVec3 {
        let lengthened = DVec3::new(local.x * 0.75, local.y, local.z);
        let lumps = pebbled(lengthened * 46.0);
        let seam = DVec3::new(0.42, 0.35, 0.28);
        let lump = DVec3::new(0.82, 0.74, 0.60);
        let skin = seam.lerp(lump, step(0.25, 0.95, lumps));
        let back = step(0.02, 0.12, local.y) * 0.35;
        skin.lerp(DVec3::new(0.46, 0.38, 0.36), back)
    }
}

impl Part for Snail {
    fn distance(&self, point: DVec3) -> f64 {
        let local = self.placed.local(point);
        let (stalks, eyes) = self.stalks(local);
        let body = smooth_min(self.flesh(local), stalks, 0.016);
        let shell = self.on_shell(local);
        let grown = step(-14.0, -5.0, shell.along) * step(0.03, 0.0, shell.distance.abs());
        let ribs = 0.0013 * sin(shell.along * 11.0) * grown;
        smooth_min(body, eyes, 0.006).min((shell.distance + ribs) * 0.9)
    }

    fn ball(&self) -> (DVec3, f64) {
        (self.placed.world(DVec3::new(0.05, 0.12, 0.0)), 0.50)
    }

    fn paint(&self, point: DVec3, _normal: DVec3) -> DVec3 {
        let local = self.placed.local(point);
        let (stalks, eyes) = self.stalks(local);
        let shell = self.on_shell(local);
        let flesh = self.flesh(local).min(stalks);
        let dark = DVec3::new(0.07, 0.06, 0.07);
        let body = self.flesh_paint(local).lerp(dark, step(0.003, -0.003, eyes - flesh));
        body.lerp(
            self.shell_paint(&shell, local),
            step(0.003, -0.003, shell.distance - flesh.min(eyes)),
        )
    }

    fn spacing(&self, point: DVec3) -> f64 {
        let (stalks, eyes) = self.stalks(self.placed.local(point));
        if stalks.min(eyes) < 0.006 { 0.0042 } else { 0.0058 }
    }
}

/// Several tapered limbs end to end with rounded joints.
fn chain(point: DVec3, joints: &[(DVec3, f64)], k: f64) -> f64 {
    let limbs = joints.windows(2).map(|pair| tapered(point, pair[0], pair[1]));
    limbs.fold(f64::MAX, |nearest, limb| smooth_min(nearest, limb, k))
}

/// The angle around the shell's axis, counted back from the mouth: in (-2 pi, 0].
fn clockwise(point: DVec3, mouth: f64) -> f64 {
    let angle = atan2(point.z, point.x) - mouth;
    angle - TAU * (angle / TAU).ceil()
}

/// Middle (distance from the axis, height towards the tip) and radius of the tube where it has
/// grown to this share of its final size.
fn whorl_circle(scale: f64, along: f64) -> (DVec2, f64) {
    // The last quarter turn widens faster and sinks, as the mouth of a grown snail does.
    let flare = 1.0 + 0.06 * step(-1.2, 0.0, along);
    let size = WHORL * scale;
    (DVec2::new(size, -1.25 * size), size * 0.74 * flare)
}
