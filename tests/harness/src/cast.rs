//! A ray caster over the same discs as the renderers draw, in f64: the reference for coverage and
//! depth.
//!
//! It shares no code with the renderers: discs are met by solving the ray and the plane, once for
//! every pixel whose ray comes within a disc's reach.

use glam::{DMat4, DVec3};
use surfelshop_api::{Projection, View};
use surfelshop_cloud::Cloud;

/// What each pixel's ray meets first.
#[derive(Clone, Debug)]
pub struct Cast {
    /// Distance along the viewing axis; infinite where nothing is met.
    pub depth: Vec<f64>,
    /// Index of the surfel met; `usize::MAX` where there is none.
    pub surfel: Vec<usize>,
}

/// Casts one ray through the centre of each pixel of a view.
#[must_use]
pub fn cast(cloud: &Cloud, view: &View) -> Cast {
    let [width, height] = view.size_px.map(|side| side as usize);
    let mut cast = Cast {
        depth: vec![f64::INFINITY; width * height],
        surfel: vec![usize::MAX; width * height],
    };
    let view_from_offset = view.view_from_offset(cloud.origin());
    for i in 0..cloud.len() {
        let disc = Disc::new(cloud, i, &view_from_offset);
        let [x0, y0, x1, y1] = disc.pixels(view);
        for y in y0..y1 {
            for x in x0..x1 {
                let (start, direction) = view.ray(x as f64 + 0.5, y as f64 + 0.5);
                let Some(depth) = disc.meet(start, direction) else { continue };
                let at = y * width + x;
                if depth >= view.near && depth < cast.depth[at] {
                    cast.depth[at] = depth;
                    cast.surfel[at] = i;
                }
            }
        }
    }
    cast
}

struct Disc {
    center: DVec3,
    normal: DVec3,
    radius: f64,
}

impl Disc {
    fn new(cloud: &Cloud, i: usize, view_from_offset: &DMat4) -> Self {
        let position = cloud.positions()[i].as_dvec3();
        let normal = cloud.normals()[i].as_dvec3();
        Self {
            center: view_from_offset.transform_point3(position),
            normal: view_from_offset.transform_vector3(normal),
            radius: f64::from(cloud.radii()[i]),
        }
    }

    /// Distance along the viewing axis at which a ray meets the disc.
    fn meet(&self, start: DVec3, direction: DVec3) -> Option<f64> {
        let t = self.normal.dot(self.center - start) / self.normal.dot(direction);
        let point = start + direction * t;
        let inside = (point - self.center).length_squared() <= self.radius * self.radius;
        (t > 0.0 && inside).then_some(-point.z)
    }

    /// A rectangle that holds every pixel whose ray can meet the disc: first and behind-last.
    fn pixels(&self, view: &View) -> [usize; 4] {
        let [width, height] = view.size_px.map(f64::from);
        let [half_x, half_y] = view.half_extent();
        let (c, r) = (self.center, self.radius);
        let mut low = [-1.0, -1.0];
        let mut high = [1.0, 1.0];
        match view.camera.projection {
            Projection::Orthographic { .. } => {
                low = [(c.x - r) / half_x, (c.y - r) / half_y];
                high = [(c.x + r) / half_x, (c.y + r) / half_y];
            }
            // The sphere around the disc lies in front of the eye: the extremes of x / d over
            // the box around it bound its projection.
            Projection::Perspective { .. } if -c.z > r => {
                let (near, far) = (-c.z - r, -c.z + r);
                for (axis, (value, half)) in [(c.x, half_x), (c.y, half_y)].into_iter().enumerate()
                {
                    let (a, b) = ((value - r) / half, (value + r) / half);
                    low[axis] = (a / near).min(a / far);
                    high[axis] = (b / near).max(b / far);
                }
            }
            Projection::Perspective { .. } if c.z > r => return [0; 4],
            Projection::Perspective { .. } => {}
        }
        let x = |ndc: f64| ((ndc * 0.5 + 0.5) * width).clamp(0.0, width);
        let y = |ndc: f64| ((0.5 - ndc * 0.5) * height).clamp(0.0, height);
        [
            x(low[0]).floor() as usize,
            y(high[1]).floor() as usize,
            x(high[0]).ceil() as usize,
            y(low[1]).ceil() as usize,
        ]
    }
}

/// How two coverages agree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Agreement {
    /// Pixels covered in the picture.
    pub drawn: usize,
    /// Pixels whose ray meets a disc.
    pub cast: usize,
    /// Pixels covered in both.
    pub both: usize,
    /// Of those, pixels whose depths differ by more than the given fraction.
    pub depth_differs: usize,
}

impl Agreement {
    /// Compares depths of a picture (0 where nothing is) with a cast.
    #[must_use]
    pub fn new(depths: impl Iterator<Item = f32>, cast: &Cast, depth_fraction: f64) -> Self {
        let mut agreement = Self { drawn: 0, cast: 0, both: 0, depth_differs: 0 };
        for (drawn, expected) in depths.zip(&cast.depth) {
            agreement.drawn += usize::from(drawn > 0.0);
            agreement.cast += usize::from(expected.is_finite());
            if drawn > 0.0 && expected.is_finite() {
                agreement.both += 1;
                let differs = (f64::from(drawn) - expected).abs() > depth_fraction * expected;
                agreement.depth_differs += usize::from(differs);
            }
        }
        agreement
    }

    /// The smaller of the two shares of covered pixels that the other covers too, in [0, 1];
    /// 1 where neither covers any.
    #[must_use]
    pub fn coverage(&self) -> f64 {
        match self.drawn.max(self.cast) {
            0 => 1.0,
            most => self.both as f64 / most as f64,
        }
    }
}
