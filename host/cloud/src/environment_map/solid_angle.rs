//! Solid angles of the texels of a picture.

use super::mapping::{Mapping, on_octahedron};
use glam::{DVec2, DVec3, Vec2Swizzles as _};
use rayon::prelude::*;
use std::f64::consts::PI;

/// The solid angle of every texel, steradians, row by row; 0 where a texel shows nothing.
///
/// Exact for latitude and longitude, crosses and octahedra; by quadrature, to a millionth of the
/// sphere, for discs, where texels on the rim count with the part within it. The sum is 4 pi.
///
/// The shape must suit the mapping: 3 to 4 or 4 to 3 for crosses, square for discs and octahedra.
/// Texels beyond whole faces show nothing otherwise, and pictures that are not square are read as
/// a square of their width.
#[must_use]
pub fn solid_angles(mapping: Mapping, width: u32, height: u32) -> Vec<f64> {
    let table = SolidAngles::new(mapping, width, height);
    (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| table.at(x, y)).collect()
}

/// Solid angles with what is equal by symmetry kept once.
#[derive(Debug)]
pub(super) struct SolidAngles {
    mapping: Mapping,
    /// Texels along the side that `values` is symmetric over.
    side: u32,
    /// One value for a row of latitude, or a quarter of a face, disc or octahedron.
    values: Vec<f64>,
}

impl SolidAngles {
    pub(super) fn new(mapping: Mapping, width: u32, height: u32) -> Self {
        let (side, values) = match mapping {
            Mapping::LatLong => (height, rows_of_latitude(width, height)),
            Mapping::VerticalCross | Mapping::HorizontalCross => {
                let side = width / mapping.cells().map_or(1, |[columns, _]| columns);
                (side, quarter(side, on_face))
            }
            Mapping::Angular => (width, quarter(width, |cell| on_disc(cell, angular_density))),
            // Equal areas of the disc are equal solid angles.
            Mapping::MirroredBall => (width, quarter(width, |cell| on_disc(cell, |_, _| 4.0))),
            Mapping::Octahedral => (width, quarter(width, on_octahedral_square)),
        };
        Self { mapping, side, values }
    }

    /// The solid angle of a texel within the picture.
    pub(super) fn at(&self, x: u32, y: u32) -> f64 {
        let (x, y) = match self.mapping {
            Mapping::LatLong => return self.values.get(y as usize).copied().unwrap_or(0.0),
            Mapping::VerticalCross | Mapping::HorizontalCross => {
                let Some((x, y)) = self.within_face(x, y) else { return 0.0 };
                (x, y)
            }
            _ => (x, y),
        };
        if x >= self.side || y >= self.side {
            return 0.0;
        }
        let half = self.side.div_ceil(2);
        let (x, y) = (x.min(self.side - 1 - x), y.min(self.side - 1 - y));
        self.values[y as usize * half as usize + x as usize]
    }

    /// Where a texel lies within its face of a cross.
    fn within_face(&self, x: u32, y: u32) -> Option<(u32, u32)> {
        let cell = [x.checked_div(self.side)?, y.checked_div(self.side)?];
        let shown = match self.mapping {
            Mapping::VerticalCross => cell[0] == 1 || cell[1] == 1,
            _ => cell[1] == 1 || cell[0] == 1,
        };
        let [columns, rows] = self.mapping.cells()?;
        let within = cell[0] < columns && cell[1] < rows;
        (shown && within).then(|| (x % self.side, y % self.side))
    }
}

/// Solid angle of one texel in each row.
fn rows_of_latitude(width: u32, height: u32) -> Vec<f64> {
    let half = 0.5 * PI / f64::from(height);
    let row = |y| {
        // The difference of two cosines, without their cancellation.
        let middle = PI * (f64::from(y) + 0.5) / f64::from(height);
        2.0 * PI / f64::from(width) * 2.0 * middle.sin() * half.sin()
    };
    (0..height).map(row).collect()
}

/// A texel of the square [-1, 1]^2: its corners of smallest and largest coordinates.
type Cell = [DVec2; 2];

/// A function of the texels of the first quarter of a square, middle row and column included.
fn quarter(side: u32, of: impl Fn(Cell) -> f64 + Sync) -> Vec<f64> {
    let half = side.div_ceil(2);
    let edge = |i: u32| 2.0 * f64::from(i) / f64::from(side) - 1.0;
    let row = |y: u32| {
        let of = &of;
        (0..half)
            .map(move |x| of([DVec2::new(edge(x), edge(y)), DVec2::new(edge(x + 1), edge(y + 1))]))
    };
    (0..half).into_par_iter().flat_map_iter(row).collect()
}

/// The parts of an interval below and above 0, as distances from it.
fn folded(low: f64, high: f64) -> impl Iterator<Item = [f64; 2]> + Clone {
    let parts = if low < 0.0 && high > 0.0 {
        [[0.0, -low], [0.0, high]]
    } else {
        [[low.abs().min(high.abs()), low.abs().max(high.abs())], [0.0, 0.0]]
    };
    parts.into_iter().filter(|[from, to]| from < to)
}

/// The parts of a cell in the four quadrants, each mirrored into the first.
fn quadrants([low, high]: Cell) -> impl Iterator<Item = Cell> {
    let ys = folded(low.y, high.y);
    folded(low.x, high.x).flat_map(move |[x0, x1]| {
        ys.clone().map(move |[y0, y1]| [DVec2::new(x0, y0), DVec2::new(x1, y1)])
    })
}

/// Solid angle of a rectangle on the face of a cube.
fn on_face([low, high]: Cell) -> f64 {
    // Of the rectangle between the face's centre and a point.
    let from_centre = |x: f64, y: f64| (x * y).atan2((x * x + y * y + 1.0).sqrt());
    from_centre(high.x, high.y) + from_centre(low.x, low.y)
        - from_centre(low.x, high.y)
        - from_centre(high.x, low.y)
}

/// Solid angle of a rectangle of octahedral coordinates, which folds along both axes and along
/// `|x| + |y| = 1`.
fn on_octahedral_square(cell: Cell) -> f64 {
    quadrants(cell)
        .map(|[low, high]| {
            let corners = [low, DVec2::new(high.x, low.y), high, DVec2::new(low.x, high.y)];
            polygon(&clipped(&corners, 1.0)) + polygon(&clipped(&corners, -1.0))
        })
        .sum()
}

/// The part of a polygon where `side (1 - x - y)` is not negative.
fn clipped(corners: &[DVec2], side: f64) -> Vec<DVec2> {
    let mut kept = Vec::with_capacity(6);
    for (i, &a) in corners.iter().enumerate() {
        let b = corners[(i + 1) % corners.len()];
        let (da, db) = (side * (1.0 - a.x - a.y), side * (1.0 - b.x - b.y));
        if da >= 0.0 {
            kept.push(a);
        }
        if (da > 0.0 && db < 0.0) || (da < 0.0 && db > 0.0) {
            kept.push(a + (b - a) * (da / (da - db)));
        }
    }
    kept
}

/// Solid angle of a polygon within one face of the octahedron.
fn polygon(corners: &[DVec2]) -> f64 {
    // On the fold itself the sign of z does not matter, as z is 0.
    let points: Vec<DVec3> = corners.iter().map(|p| on_octahedron(p.x, p.y)).collect();
    points.windows(2).skip(1).map(|pair| triangle(points[0], pair[0], pair[1])).sum()
}

/// Solid angle of the triangle between three directions.
///
/// Source: Van Oosterom & Strackee 1983, "The Solid Angle of a Plane Triangle", equation 8.
fn triangle(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    // From differences, so that small triangles keep their digits.
    let volume = a.dot((b - a).cross(c - a)).abs();
    2.0 * volume.atan2(la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb)
}

/// Solid angle over area of the unit disc of an angular map.
fn angular_density(x: f64, y: f64) -> f64 {
    let r = DVec2::new(x, y).length();
    // Beyond the rim only by rounding.
    if r > 0.0 { (PI * (PI * r).sin() / r).max(0.0) } else { PI * PI }
}

/// Nodes and weights of Gauss-Legendre quadrature over [-1, 1].
///
/// Source: Abramowitz & Stegun 1964, table 25.4.
type Nodes<const N: usize> = [[f64; 2]; N];
const THREE: Nodes<3> =
    [[-0.774_596_669_241_483, 5.0 / 9.0], [0.0, 8.0 / 9.0], [0.774_596_669_241_483, 5.0 / 9.0]];
const FIVE: Nodes<5> = [
    [-0.906_179_845_938_664, 0.236_926_885_056_189],
    [-0.538_469_310_105_683, 0.478_628_670_499_366],
    [0.0, 0.568_888_888_888_889],
    [0.538_469_310_105_683, 0.478_628_670_499_366],
    [0.906_179_845_938_664, 0.236_926_885_056_189],
];

/// The integral of a density over the part of a cell that lies within the unit disc.
fn on_disc(cell: Cell, density: impl Fn(f64, f64) -> f64 + Copy) -> f64 {
    let nearest = cell[0].max(-cell[1]).max(DVec2::ZERO);
    if nearest.length_squared() >= 1.0 {
        return 0.0;
    }
    let farthest = cell[0].abs().max(cell[1].abs());
    if farthest.length_squared() <= 1.0 {
        return integral([cell[0].y, cell[1].y], THREE, |y| {
            integral([cell[0].x, cell[1].x], THREE, |x| density(x, y))
        });
    }
    quadrants(cell)
        .map(|[low, high]| {
            // Cut along the axis that the rim is steeper to, where it is a smooth function.
            let swapped = low.y + high.y > low.x + high.x;
            let (low, high) = if swapped { (low.yx(), high.yx()) } else { (low, high) };
            let rim = |y: f64| (1.0 - y * y).max(0.0).sqrt();
            // Below `full` the whole width lies within, from `none` on nothing does.
            let full = rim(high.x.min(1.0)).clamp(low.y, high.y);
            let none = rim(low.x.min(1.0)).clamp(low.y, high.y);
            let inside = |y| integral([low.x, high.x], FIVE, |x| density(x, y));
            let cut = |y| integral([low.x, rim(y).clamp(low.x, high.x)], FIVE, |x| density(x, y));
            integral([low.y, full], FIVE, inside) + integral([full, none], FIVE, cut)
        })
        .sum()
}

fn integral<const N: usize>([from, to]: [f64; 2], nodes: Nodes<N>, of: impl Fn(f64) -> f64) -> f64 {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    half * nodes.iter().map(|[at, weight]| weight * of(middle + half * at)).sum::<f64>()
}
