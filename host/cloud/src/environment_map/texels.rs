//! Sampling a picture by direction, and the directions of its texels.

use super::mapping::Mapping;
use super::picture::Picture;
use super::solid_angle::SolidAngles;
use glam::{DVec2, DVec3};
use surfelshop_geometry::harmonics::{self, Coefficients};

/// How the texels of a picture of one shape lie on the sphere.
#[derive(Debug)]
pub(super) struct TexelMap {
    pub(super) mapping: Mapping,
    pub(super) width: u32,
    pub(super) height: u32,
    angles: SolidAngles,
}

/// What one texel shows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Texel {
    /// Column and row.
    at: [u32; 2],
    /// Unit direction of its centre.
    pub(super) towards: DVec3,
    /// Steradians.
    pub(super) angle: f64,
    /// Linear Rec. 709.
    pub(super) radiance: [f64; 3],
}

impl TexelMap {
    /// For a shape that suits the mapping.
    pub(super) fn new(mapping: Mapping, width: u32, height: u32) -> Self {
        Self { mapping, width, height, angles: SolidAngles::new(mapping, width, height) }
    }

    /// Whether any part of a texel shows something.
    pub(super) fn shows(&self, x: u32, y: u32) -> bool {
        self.angles.at(x, y) > 0.0
    }

    /// About how many texels show something.
    pub(super) fn n_shown(&self) -> f64 {
        let all = f64::from(self.width) * f64::from(self.height);
        match self.mapping {
            Mapping::Angular | Mapping::MirroredBall => all * std::f64::consts::FRAC_PI_4,
            Mapping::VerticalCross | Mapping::HorizontalCross => all * 0.5,
            Mapping::LatLong | Mapping::Octahedral => all,
        }
    }

    /// What a texel shows, if anything.
    pub(super) fn texel(&self, picture: &Picture, x: u32, y: u32) -> Option<Texel> {
        let angle = self.angles.at(x, y);
        if angle <= 0.0 {
            return None;
        }
        // A texel on the rim whose centre lies beyond it was blended with the black around the
        // disc or left black: its sliver is lit as its inner neighbour is.
        let (inner_x, inner_y) = self.inside(x, y);
        let towards = self.centre(inner_x, inner_y)?;
        let radiance = self.radiance_of(picture, inner_x, inner_y);
        Some(Texel { at: [x, y], towards, angle, radiance })
    }

    /// The texel itself, or of one whose centre lies beyond a disc a neighbour towards the middle.
    fn inside(&self, x: u32, y: u32) -> (u32, u32) {
        if self.is_within(x, y) {
            return (x, y);
        }
        let inwards = |i: u32| if 2 * i + 1 > self.width { i - 1 } else { i + 1 };
        let from_middle = |i: u32| (2 * i + 1).abs_diff(self.width);
        let step = if from_middle(x) >= from_middle(y) { (inwards(x), y) } else { (x, inwards(y)) };
        if self.is_within(step.0, step.1) { step } else { (inwards(x), inwards(y)) }
    }

    /// Whether a texel's centre lies within the disc, where there is one.
    fn is_within(&self, x: u32, y: u32) -> bool {
        // In half texels from the middle; one of a single texel is its middle.
        let square = |i: u32| u64::from((2 * i + 1).abs_diff(self.width)).pow(2);
        !self.is_disc() || square(x) + square(y) < u64::from(self.width).pow(2)
    }

    /// Adds a texel's light, radiance times solid angle, to spherical harmonics.
    ///
    /// It all counts at the texel's centre, but on a ball, whose texels are stretched towards the
    /// rim, in parts evenly over the texel.
    pub(super) fn project(&self, harmonics: &mut Coefficients, texel: &Texel, light: [f64; 3]) {
        const ALONG: u32 = 4;
        if self.mapping != Mapping::MirroredBall {
            return harmonics::add(harmonics, texel.towards, light);
        }
        let place = |i: u32, k: u32| {
            (f64::from(i) + (f64::from(k) + 0.5) / f64::from(ALONG)) / f64::from(self.width)
        };
        let [x, y] = texel.at;
        let steps = (0..ALONG).flat_map(|b| (0..ALONG).map(move |a| (a, b)));
        let parts = steps.filter_map(|(a, b)| self.mapping.direction(place(x, a), place(y, b)));
        let n = parts.clone().count();
        if n == 0 {
            return harmonics::add(harmonics, texel.towards, light);
        }
        for towards in parts {
            harmonics::add(harmonics, towards, light.map(|c| c / n as f64));
        }
    }

    fn is_disc(&self) -> bool {
        matches!(self.mapping, Mapping::Angular | Mapping::MirroredBall)
    }

    fn centre(&self, x: u32, y: u32) -> Option<DVec3> {
        let u = (f64::from(x) + 0.5) / f64::from(self.width);
        let v = (f64::from(y) + 0.5) / f64::from(self.height);
        self.mapping.direction(u, v)
    }

    fn radiance_of(&self, picture: &Picture, x: u32, y: u32) -> [f64; 3] {
        picture.rgb[y as usize * self.width as usize + x as usize].map(f64::from)
    }

    /// Radiance from a direction, interpolated between the four texels around it that are
    /// neighbours on the sphere too; what shows nothing has no part in it.
    pub(super) fn radiance(&self, picture: &Picture, direction: DVec3) -> [f64; 3] {
        let (x, y) = self.place(direction);
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = (x - x0, y - y0);
        let (x0, y0) = (x0 as i64, y0 as i64);
        let (mut sum, mut weights) = ([0.0; 3], 0.0);
        let cell = self.mapping.cells().map(|_| self.cell(direction));
        for (dx, dy, weight) in [
            (0, 0, (1.0 - fx) * (1.0 - fy)),
            (1, 0, fx * (1.0 - fy)),
            (0, 1, (1.0 - fx) * fy),
            (1, 1, fx * fy),
        ] {
            let (x, y) = self.neighbour(x0 + dx, y0 + dy, cell);
            if weight <= 0.0 || !self.is_within(x, y) {
                continue;
            }
            weights += weight;
            let radiance = self.radiance_of(picture, x, y);
            sum.iter_mut().zip(radiance).for_each(|(sum, c)| *sum += weight * c);
        }
        if weights > 0.0 {
            return sum.map(|c| c / weights);
        }
        // Only discs of a few texels have a place without any texel around it.
        let (x, y) = self.neighbour(x.round() as i64, y.round() as i64, cell);
        let (x, y) = self.inside(x, y);
        self.radiance_of(picture, x, y)
    }

    /// Where a direction lies, in texels from the first one's centre.
    fn place(&self, direction: DVec3) -> (f64, f64) {
        let [mut u, mut v] = self.mapping.place(direction);
        if self.is_disc() {
            // Half a texel within the rim there is a texel within it towards the centre.
            let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
            let r = DVec2::new(a, b).length();
            let most = 1.0 - 1.0 / f64::from(self.width);
            if r > most {
                (u, v) = (0.5 + (u - 0.5) * most / r, 0.5 + (v - 0.5) * most / r);
            }
        }
        (u * f64::from(self.width) - 0.5, v * f64::from(self.height) - 0.5)
    }

    /// First and last texel of the face of a cross that shows a direction, in x and y.
    fn cell(&self, direction: DVec3) -> [(i64, i64); 2] {
        let [columns, _] = self.mapping.cells().unwrap_or([1, 1]);
        let side = i64::from(self.width / columns);
        let (face, _, _) = self.mapping.place_on_cube(direction);
        face.cell.map(|i| (i64::from(i) * side, (i64::from(i) + 1) * side - 1))
    }

    /// The texel at a place that may lie beyond the picture or the face it belongs to.
    fn neighbour(&self, x: i64, y: i64, cell: Option<[(i64, i64); 2]>) -> (u32, u32) {
        let (width, height) = (i64::from(self.width), i64::from(self.height));
        let (x, y) = match (self.mapping, cell) {
            (_, Some([(left, right), (top, bottom)])) => {
                (x.clamp(left, right), y.clamp(top, bottom))
            }
            (Mapping::LatLong, None) => (x.rem_euclid(width), y),
            (Mapping::Octahedral, None) => {
                // Beyond a side the map goes on at the same side, mirrored about its middle.
                let (x, y) = match x {
                    -1 => (0, height - 1 - y),
                    x if x == width => (width - 1, height - 1 - y),
                    x => (x, y),
                };
                match y {
                    -1 => (width - 1 - x, 0),
                    y if y == height => (width - 1 - x, height - 1),
                    y => (x, y),
                }
            }
            _ => (x, y),
        };
        (x.clamp(0, width - 1) as u32, y.clamp(0, height - 1) as u32)
    }
}
