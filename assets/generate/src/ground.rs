//! What the mushrooms stand on: a cushion of moss, pebbles, and blades of grass.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use crate::field::{Frame, Part, ellipsoid, smooth_max, step};
use crate::noise::{Random, pebbled, rough, smooth};
use crate::portable::sin_cos;

/// A flat-bottomed mound of moss over y = 0.
#[derive(Clone, Copy, Debug)]
pub struct Mound {
    /// Radius of its outline.
    pub radius: f64,
    /// Height at the middle.
    pub height: f64,
}

impl Mound {
    fn bumps(point: DVec3) -> f64 {
        let flat = DVec3::new(point.x, point.y * 0.6, point.z);
        let cushions = pebbled(flat * 6.5 + 0.35 * rough(flat * 9.0));
        0.055 * (cushions - 0.6) + 0.016 * (pebbled(flat * 27.0) - 0.5)
    }
}

impl Part for Mound {
    fn distance(&self, point: DVec3) -> f64 {
        let outline = DVec2::new(point.x, point.z).length();
        let wobble = 1.0 + 0.05 * smooth(DVec3::new(point.x * 2.2, 0.0, point.z * 2.2));
        let above = point.y.max(0.0);
        let flat = DVec3::new(point.x / wobble, above, point.z / wobble);
        let mound = ellipsoid(flat, DVec3::new(self.radius, self.height, self.radius));
        let near = step(0.25, 0.12, mound.abs()) * step(1.15, 1.0, outline / self.radius);
        let surface = if near > 0.0 { mound - near * Self::bumps(point) } else { mound };
        smooth_max(surface * 0.8, -point.y, 0.02)
    }

    fn ball(&self) -> (DVec3, f64) {
        (DVec3::ZERO, self.radius * 1.12)
    }

    fn paint(&self, point: DVec3, normal: DVec3) -> DVec3 {
        let flat = DVec3::new(point.x, point.y * 0.6, point.z);
        let tuft = pebbled(flat * 27.0);
        let patch = rough(point * 3.3 + DVec3::splat(5.0));
        let deep = DVec3::new(0.16, 0.25, 0.07);
        let fresh = DVec3::new(0.52, 0.62, 0.17);
        let olive = DVec3::new(0.47, 0.44, 0.16);
        let moss = fresh.lerp(olive, step(-0.1, 0.5, patch));
        let moss = deep.lerp(moss, step(0.1, 0.95, tuft));
        let soil = DVec3::new(0.27, 0.19, 0.12).lerp(DVec3::new(0.36, 0.27, 0.18), tuft);
        let bare = step(0.045, 0.012, point.y).max(step(-0.2, -0.6, normal.y));
        moss.lerp(soil, bare)
    }

    fn spacing(&self, point: DVec3) -> f64 {
        // Nobody looks at the underside for its detail.
        if point.y < 0.002 { 0.0195 } else { 0.0126 }
    }
}

/// One rounded stone.
#[derive(Clone, Copy, Debug)]
pub struct Pebble {
    placed: Frame,
    radii: DVec3,
    tint: f64,
}

impl Pebble {
    /// Half sunk at a place, turned at random.
    pub fn new(centre: DVec3, size: f64, random: &mut Random) -> Self {
        let up = DVec3::new(random.between(-0.3, 0.3), 1.0, random.between(-0.3, 0.3));
        let placed = Frame::new(centre, up, random.in_cube() + DVec3::X * 1.5);
        let radii = size * DVec3::new(random.between(1.0, 1.35), 0.62, random.between(0.75, 1.0));
        Self { placed, radii, tint: random.unit() }
    }
}

impl Part for Pebble {
    fn distance(&self, point: DVec3) -> f64 {
        let local = self.placed.local(point);
        let dents = 0.16 * smooth(local / self.radii.x * 1.3 + DVec3::splat(self.tint * 40.0));
        ellipsoid(local, self.radii) + dents * self.radii.y * 0.8
    }

    fn ball(&self) -> (DVec3, f64) {
        (self.placed.world(DVec3::ZERO), self.radii.max_element() * 1.35)
    }

    fn paint(&self, point: DVec3, _normal: DVec3) -> DVec3 {
        let grey = DVec3::new(0.50, 0.51, 0.53).lerp(DVec3::new(0.63, 0.56, 0.48), self.tint);
        let vein = rough(point * 17.0 + DVec3::splat(self.tint * 9.0));
        let speck = step(0.35, 0.6, smooth(point * 120.0));
        let stone = grey.lerp(DVec3::new(0.80, 0.78, 0.73), step(0.1, 0.35, vein) * 0.7);
        stone.lerp(DVec3::new(0.22, 0.22, 0.24), speck * 0.6)
    }

    fn spacing(&self, _point: DVec3) -> f64 {
        0.0085
    }
}

/// One blade of grass: a bent, tapering strip, a little folded along its middle.
#[derive(Clone, Debug)]
pub struct Blade {
    /// Points along the middle, from the root to the tip.
    middle: Vec<DVec3>,
    /// The direction of the strip's width.
    across: DVec3,
    width: f64,
    tint: f64,
}

impl Blade {
    const SEGMENTS: u32 = 20;
    const HALF_THICKNESS: f64 = 0.0036;

    /// Grows from a root in a direction (an angle around y) and bows down under its own weight.
    pub fn new(root: DVec3, heading: f64, length: f64, random: &mut Random) -> Self {
        let (sin, cos) = sin_cos(heading);
        let out = DVec3::new(cos, 0.0, sin);
        let bow = random.between(0.35, 0.75);
        let lean = random.between(0.10, 0.25);
        let point = |index: u32| {
            let t = f64::from(index) / f64::from(Self::SEGMENTS);
            root + out * length * (lean * t + bow * t * t)
                + DVec3::Y * length * t * (1.0 - 0.45 * bow * t)
        };
        let across = DVec3::new(-sin, 0.0, cos);
        let middle = (0..=Self::SEGMENTS).map(point).collect();
        Self { middle, across, width: random.between(0.014, 0.020), tint: random.unit() }
    }

    /// The nearest point of the middle line: its offset to the point, its share of the length,
    /// and the line's direction there.
    fn nearest(&self, point: DVec3) -> (DVec3, f64, DVec3) {
        let mut best = (DVec3::MAX, f64::MAX, 0.0, DVec3::Y);
        for (index, pair) in self.middle.windows(2).enumerate() {
            let axis = pair[1] - pair[0];
            let along = ((point - pair[0]).dot(axis) / axis.length_squared()).clamp(0.0, 1.0);
            let offset = point - pair[0] - axis * along;
            let distance = offset.length_squared();
            if distance < best.1 {
                best = (offset, distance, index as f64 + along, axis);
            }
        }
        let (offset, _, along, axis) = best;
        (offset, along / f64::from(Self::SEGMENTS), axis / axis.length())
    }
}

impl Part for Blade {
    fn distance(&self, point: DVec3) -> f64 {
        let (offset, t, direction) = self.nearest(point);
        let half_width = self.width * (1.0 - t * t * t) * (0.65 + 0.7 * t * (1.0 - t));
        let sideways = offset.dot(self.across);
        let outwards = self.across.cross(direction);
        let fold = 0.30 * (sideways * sideways + 0.000_02).sqrt();
        let lift = offset.dot(outwards) - fold;
        let lengthwise = offset.dot(direction);
        let beyond = (sideways.abs() - half_width).max(0.0);
        DVec3::new(beyond, lift, lengthwise).length() - Self::HALF_THICKNESS
    }

    fn ball(&self) -> (DVec3, f64) {
        let (first, last) = (self.middle[0], self.middle[self.middle.len() - 1]);
        let centre = (first + last) / 2.0;
        let reach = self.middle.iter().map(|point| point.distance(centre)).fold(0.0, f64::max);
        (centre, reach + self.width * 1.5)
    }

    fn paint(&self, point: DVec3, _normal: DVec3) -> DVec3 {
        let (offset, t, _) = self.nearest(point);
        let sideways = offset.dot(self.across) / self.width;
        let green = DVec3::new(0.30, 0.52, 0.13).lerp(DVec3::new(0.50, 0.62, 0.20), self.tint);
        let tip = DVec3::new(0.80, 0.72, 0.32);
        let rib = step(0.22, 0.05, sideways.abs());
        let leaf = green.lerp(tip, step(0.72, 1.0, t + 0.1 * self.tint));
        leaf.lerp(DVec3::new(0.70, 0.80, 0.40), rib * 0.5) * (0.72 + 0.28 * step(0.0, 0.3, t))
    }

    fn spacing(&self, _point: DVec3) -> f64 {
        0.0050
    }
}

/// Spreads pebbles and blades over a mound, leaving the given places (centre, radius) free.
#[must_use]
pub fn scatter(mound: &Mound, free: &[(DVec3, f64)], seed: u64) -> (Vec<Pebble>, Vec<Blade>) {
    let mut random = Random::new(seed);
    let mut taken = free.to_vec();
    let mut pebbles = Vec::new();
    let mut blades = Vec::new();
    for attempt in 0..400 {
        let size = random.between(0.03, 0.075);
        let (sin, cos) = sin_cos(random.between(0.0, TAU));
        let reach = random.between(0.35, 0.90);
        let flat = DVec3::new(cos, 0.0, sin) * reach * mound.radius;
        let height = mound.height * (1.0 - reach * reach).sqrt();
        let clear = taken.iter().all(|(centre, radius)| {
            DVec2::new(centre.x - flat.x, centre.z - flat.z).length() > radius + size
        });
        if !clear {
            continue;
        }
        if pebbles.len() < 11 {
            taken.push((flat, size * 1.2));
            let sunk = flat + DVec3::Y * (height + size * 0.1);
            pebbles.push(Pebble::new(sunk, size, &mut random));
        } else if blades.len() < 17 {
            taken.push((flat, 0.02));
            let root = flat + DVec3::Y * (height - 0.03);
            let length = random.between(0.32, 0.62);
            blades.push(Blade::new(root, f64::from(attempt) * 2.4, length, &mut random));
        }
    }
    (pebbles, blades)
}
