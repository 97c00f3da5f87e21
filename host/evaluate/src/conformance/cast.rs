//! A ray caster over the same discs as the renderers draw, in f64: the reference for coverage and
//! depth.
//!
//! It shares no code with the renderers: discs are met by solving the ray and the plane, once for
//! every pixel whose ray comes within a disc's reach.

use glam::{DMat4, DVec2, DVec3};
use rayon::prelude::*;
use std::sync::OnceLock;
use surfelshop_api::{Projection, View, columns};
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
    let picture = Picture::of(view);
    for (i, disc) in discs(cloud, view).enumerate() {
        let [x0, y0, x1, y1] = disc.pixels(&picture);
        for y in y0..y1 {
            for x in x0..x1 {
                let (start, direction) = picture.ray([x as f64 + 0.5, y as f64 + 0.5]);
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

/// Those of the given positions in pixels that are further than `reach` pixels from every disc on
/// the screen.
#[must_use]
pub fn beyond_reach(
    cloud: &Cloud,
    view: &View,
    positions: &[[f64; 2]],
    reach: f64,
) -> Vec<[f64; 2]> {
    let picture = Picture::of(view);
    let discs: Vec<ProjectedDisc> =
        discs(cloud, view).map(|disc| ProjectedDisc::new(disc, &picture)).collect();
    let beyond = |position: &&[f64; 2]| {
        let [x, y] = **position;
        !discs.iter().any(|disc| {
            let [x0, y0, x1, y1] = disc.box_px;
            let near = x > x0 - reach && x < x1 + reach && y > y0 - reach && y < y1 + reach;
            near && disc.distance_px(&picture, **position) <= reach
        })
    };
    positions.par_iter().filter(beyond).copied().collect()
}

/// How far inside a disc a position in pixels lies: pixels to the rim of the disc, among those
/// that a ray there surely meets, whose rim is farthest; 0 where it meets none.
#[must_use]
pub fn depth_inside_px(cloud: &Cloud, view: &View, position: [f64; 2]) -> f64 {
    let picture = Picture::of(view);
    let (start, direction) = picture.ray(position);
    let met = discs(cloud, view).filter(|disc| {
        let surely = disc.meet_within(1.0 - disc.rim(direction), start, direction);
        surely.is_some_and(|depth| depth >= view.near)
    });
    met.map(|disc| ProjectedDisc::new(disc, &picture).rim_distance_px(&picture, position))
        .fold(0.0, f64::max)
}

/// What of a view says where its rays go, computed once for all of them.
struct Picture {
    size_px: [f64; 2],
    /// Half the picture's sides: at distance 1 in central projection, else in scene units.
    half: [f64; 2],
    projection: Projection,
    near: f64,
}

impl Picture {
    fn of(view: &View) -> Self {
        Self {
            size_px: view.size_px.map(f64::from),
            half: view.half_extent(),
            projection: view.camera.projection,
            near: view.near,
        }
    }

    /// The ray through a position in pixels: start and unit direction in view space.
    fn ray(&self, [x_px, y_px]: [f64; 2]) -> (DVec3, DVec3) {
        let x = (2.0 * x_px / self.size_px[0] - 1.0) * self.half[0];
        let y = (1.0 - 2.0 * y_px / self.size_px[1]) * self.half[1];
        match self.projection {
            Projection::Perspective { .. } => {
                (DVec3::ZERO, DVec3::new(x, y, -1.0).normalize_or(DVec3::NEG_Z))
            }
            Projection::Orthographic { .. } => (DVec3::new(x, y, 0.0), DVec3::NEG_Z),
        }
    }

    /// Where a point of view space before the eye lies on the screen, in pixels.
    fn project(&self, point: DVec3) -> DVec2 {
        let per_distance = match self.projection {
            Projection::Orthographic { .. } => 1.0,
            Projection::Perspective { .. } => -point.z,
        };
        let x = point.x / (self.half[0] * per_distance);
        let y = point.y / (self.half[1] * per_distance);
        DVec2::new((0.5 + 0.5 * x) * self.size_px[0], (0.5 - 0.5 * y) * self.size_px[1])
    }
}

/// The discs of a cloud in view space, one after the other.
fn discs<'a>(cloud: &'a Cloud, view: &View) -> impl Iterator<Item = Disc> + 'a {
    let view_from_offset = view.view_from_offset(cloud.origin());
    (0..cloud.len()).map(move |i| Disc::new(cloud, i, &view_from_offset))
}

/// Relative error of a position in view space in f32: half a unit in the last place of each of a few
/// products and sums.
const POSITION_ERROR: f64 = 1.0 / (1u32 << 22) as f64;

struct Disc {
    center: DVec3,
    axis_u: DVec3,
    axis_v: DVec3,
    /// Normal to the plane, of any length.
    plane: DVec3,
    /// No point of the disc is further from the centre.
    radius: f64,
}

impl Disc {
    fn new(cloud: &Cloud, i: usize, view_from_offset: &DMat4) -> Self {
        let turned = |v: glam::Vec3| view_from_offset.transform_vector3(v.as_dvec3());
        let tangents = [columns::TANGENT_U, columns::TANGENT_V].map(|name| cloud.vectors(name));
        let [axis_u, axis_v] = if tangents[0].is_empty() {
            let (u, v) = turned(cloud.normals()[i]).normalize_or(DVec3::Z).any_orthonormal_pair();
            [u, v].map(|axis| axis * f64::from(cloud.radii()[i]))
        } else {
            tangents.map(|axes| turned(axes[i]))
        };
        Self {
            center: view_from_offset.transform_point3(cloud.positions()[i].as_dvec3()),
            axis_u,
            axis_v,
            plane: axis_u.cross(axis_v),
            radius: (axis_u.length_squared() + axis_v.length_squared()).sqrt(),
        }
    }

    /// Distance along the viewing axis at which a ray meets the disc.
    fn meet(&self, start: DVec3, direction: DVec3) -> Option<f64> {
        self.meet_within(1.0, start, direction)
    }

    /// The same for the disc that is as much larger as the root of its first argument.
    fn meet_within(&self, most: f64, start: DVec3, direction: DVec3) -> Option<f64> {
        let plane = self.plane;
        let t = plane.dot(self.center - start) / plane.dot(direction);
        let point = start + direction * t;
        let offset = point - self.center;
        if t <= 0.0 || offset.length_squared() > 2.0 * most * self.radius.powi(2) {
            // What the following says, too, but for rounding that doubling covers.
            return None;
        }
        let u = offset.dot(self.axis_v.cross(plane)) / plane.length_squared();
        let v = offset.dot(plane.cross(self.axis_u)) / plane.length_squared();
        (t > 0.0 && u * u + v * v <= most).then_some(-point.z)
    }

    /// Squared distances from the centre, in radii, that f32 does not tell from 1.
    ///
    /// An error of the centre moves where a ray meets the plane by that over the cosine. On the screen
    /// it is far less than a pixel, but for a disc that the eye nearly touches.
    fn rim(&self, direction: DVec3) -> f64 {
        let cosine = (self.plane.dot(direction) / self.plane.length()).abs();
        2.0 * POSITION_ERROR * self.center.length() / (cosine * self.radius)
    }

    /// A rectangle that holds every pixel whose ray can meet the disc: first and behind-last.
    fn pixels(&self, picture: &Picture) -> [usize; 4] {
        let [width, height] = picture.size_px;
        let [x0, y0, x1, y1] = self.box_px(picture);
        [
            x0.floor().clamp(0.0, width) as usize,
            y0.floor().clamp(0.0, height) as usize,
            x1.ceil().clamp(0.0, width) as usize,
            y1.ceil().clamp(0.0, height) as usize,
        ]
    }

    /// The same in pixels, not limited to the picture.
    fn box_px(&self, picture: &Picture) -> [f64; 4] {
        let [width, height] = picture.size_px;
        let [half_x, half_y] = picture.half;
        let (c, r) = (self.center, self.radius);
        let mut low = [-1.0, -1.0];
        let mut high = [1.0, 1.0];
        match picture.projection {
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
            Projection::Perspective { .. } if c.z > r => return [0.0; 4],
            Projection::Perspective { .. } => {}
        }
        let x = |ndc: f64| (ndc * 0.5 + 0.5) * width;
        let y = |ndc: f64| (0.5 - ndc * 0.5) * height;
        [x(low[0]), y(high[1]), x(high[0]), y(low[1])]
    }
}

/// A disc and where it lies on the screen.
struct ProjectedDisc {
    disc: Disc,
    /// See [`Disc::box_px`].
    box_px: [f64; 4],
    /// The rim as a polygon in pixels, where it lies before the near plane; made when it is asked for.
    rim: OnceLock<Vec<Option<DVec2>>>,
}

impl ProjectedDisc {
    fn new(disc: Disc, picture: &Picture) -> Self {
        let box_px = disc.box_px(picture);
        Self { disc, box_px, rim: OnceLock::new() }
    }

    /// Distance on the screen from a position to the part of the disc before the near plane.
    fn distance_px(&self, picture: &Picture, position: [f64; 2]) -> f64 {
        let (start, direction) = picture.ray(position);
        let met = self.disc.meet_within(1.0 + self.disc.rim(direction), start, direction);
        if met.is_some_and(|depth| depth >= picture.near) {
            return 0.0;
        }
        self.rim_distance_px(picture, position)
    }

    /// Distance on the screen from a position to the rim, where that lies before the near plane.
    fn rim_distance_px(&self, picture: &Picture, position: [f64; 2]) -> f64 {
        let at = DVec2::from_array(position);
        let rim = self.rim.get_or_init(|| self.rim_px(picture));
        let sides = rim.windows(2).filter_map(|side| Some((side[0]?, side[1]?)));
        let distance = |(a, b): (DVec2, DVec2)| {
            let along = b - a;
            let share = ((at - a).dot(along) / along.length_squared().max(f64::MIN_POSITIVE))
                .clamp(0.0, 1.0);
            (a + along * share).distance_squared(at)
        };
        sides.map(distance).fold(f64::INFINITY, f64::min).sqrt()
    }

    /// The rim as a closed polygon: n sides of a circle of radius r stay within 5 r / n^2, which is 0.0006 pixels
    /// here, and for one that perspective distorts fourfold within 0.003.
    fn rim_px(&self, picture: &Picture) -> Vec<Option<DVec2>> {
        let [x0, y0, x1, y1] = self.box_px;
        let n = (64.0 * (1.0 + (x1 - x0).max(y1 - y0).max(0.0).sqrt())).min(1e4) as usize;
        let rim = |i: usize| {
            let (sin, cos) = (std::f64::consts::TAU * i as f64 / n as f64).sin_cos();
            let point = self.disc.center + self.disc.axis_u * cos + self.disc.axis_v * sin;
            (-point.z >= picture.near).then(|| picture.project(point))
        };
        (0..=n).map(rim).collect()
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
