//! The sample: a snail on a fly agaric, with two smaller mushrooms on a cushion of moss.
//!
//! It was chosen for what it asks of a renderer: a smooth dome for highlights, a shell and gills
//! with cavities for occlusion, thin skirts, stalks and grass, curvature at many scales, and
//! strong colours beside each other.

use glam::{DVec2, DVec3};

use crate::field::Part;
use crate::ground::{Mound, scatter};
use crate::mushroom::{Form, Mushroom};
use crate::snail::Snail;

/// Parts side by side; their union is the figure.
pub struct Figure {
    parts: Vec<Box<dyn Part>>,
    balls: Vec<(DVec3, f64)>,
}

impl Figure {
    /// A figure of these parts.
    #[must_use]
    pub fn new(parts: Vec<Box<dyn Part>>) -> Self {
        let balls = parts.iter().map(|part| part.ball()).collect();
        Self { parts, balls }
    }

    /// Distance to the nearest part, and that part. Parts whose ball is farther away than a part
    /// already found are not asked.
    fn nearest(&self, point: DVec3) -> (f64, usize) {
        let mut best = (f64::MAX, 0);
        for (index, (centre, radius)) in self.balls.iter().enumerate() {
            if point.distance(*centre) - radius < best.0 {
                let distance = self.parts[index].distance(point);
                if distance < best.0 {
                    best = (distance, index);
                }
            }
        }
        best
    }

    /// The field of the union.
    #[must_use]
    pub fn distance(&self, point: DVec3) -> f64 {
        self.nearest(point).0
    }

    /// The part that a surface point belongs to.
    #[must_use]
    pub fn part_at(&self, point: DVec3) -> &dyn Part {
        &*self.parts[self.nearest(point).1]
    }

    /// Two corners of a box that holds everything.
    #[must_use]
    pub fn bounds(&self) -> (DVec3, DVec3) {
        let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        self.balls.iter().fold(start, |(low, high), (centre, radius)| {
            (low.min(*centre - DVec3::splat(*radius)), high.max(*centre + DVec3::splat(*radius)))
        })
    }
}

/// The sample's figure: about two units tall, y up, resting on y = 0.
#[must_use]
pub fn snail_on_mushroom() -> Figure {
    let mound = Mound { radius: 0.86, height: 0.17 };
    let forms = [tall(), open(), young()];
    let free: Vec<_> = forms.iter().map(|form| (form.foot, form.stem_radius * 2.2)).collect();
    let (pebbles, blades) = scatter(&mound, &free, 11);
    let mut mushrooms = forms.map(Mushroom::new);
    let seat = mushrooms[0].on_cap(0.05, 0.13, DVec2::new(1.0, 0.35));
    mushrooms[0].clear_strip(&seat, Snail::HALF_LENGTH, Snail::HALF_WIDTH);
    let mut parts: Vec<Box<dyn Part>> = vec![Box::new(Snail::new(seat))];
    for mushroom in mushrooms {
        parts.push(Box::new(mushroom));
    }
    parts.push(Box::new(mound));
    parts.extend(pebbles.into_iter().map(|pebble| Box::new(pebble) as Box<dyn Part>));
    parts.extend(blades.into_iter().map(|blade| Box::new(blade) as Box<dyn Part>));
    Figure::new(parts)
}

/// The one that carries the snail.
fn tall() -> Form {
    Form {
        foot: DVec3::new(-0.16, 0.02, -0.06),
        top: DVec3::new(-0.09, 1.12, -0.04),
        cap_up: DVec3::new(0.10, 1.0, 0.20),
        cap_radius: 0.62,
        cap_height: 0.41,
        stem_radius: 0.105,
        skirt: Some((0.70, 0.13)),
        gills: 27,
        warts: 64,
        seed: 3,
    }
}

/// A flat, open one that turns its gills to the viewer.
fn open() -> Form {
    Form {
        foot: DVec3::new(0.36, 0.02, 0.10),
        top: DVec3::new(0.50, 0.62, 0.20),
        cap_up: DVec3::new(0.42, 1.0, -0.42),
        cap_radius: 0.30,
        cap_height: 0.15,
        stem_radius: 0.048,
        skirt: Some((0.68, 0.062)),
        gills: 17,
        warts: 38,
        seed: 5,
    }
}

/// A button just out of the moss.
fn young() -> Form {
    Form {
        foot: DVec3::new(-0.40, 0.02, 0.42),
        top: DVec3::new(-0.43, 0.30, 0.46),
        cap_up: DVec3::new(-0.15, 1.0, 0.22),
        cap_radius: 0.145,
        cap_height: 0.15,
        stem_radius: 0.058,
        skirt: None,
        gills: 13,
        warts: 34,
        seed: 8,
    }
}
