//! Even samples of exact shapes: every surface is cut into tiles of about one size and each tile has
//! one sample near its middle, whose disc reaches the tile's corners. So discs cover each shape up to
//! its edges, whatever lies beside it.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use crate::field::Frame;
use crate::noise::Random;
use crate::portable::{sin, sin_cos};

/// How far a sample lies from its tile's middle at most, in sides. Without that the rows would show
/// as stripes in whatever takes every so many samples.
const JITTER: f64 = 0.06;

/// Radius of a disc in sides of a square tile. A sample reaches its tile's far corner with
/// `(0.5 + JITTER) * sqrt(2) = 0.792`; the rest is for tiles on bent surfaces and for rounding. More
/// would stand out farther beyond edges.
pub const REACH: f64 = 0.84;

/// A sample: what stands for one tile.
#[derive(Clone, Copy, Debug)]
pub struct Tile {
    /// On the surface, scene units.
    pub position: DVec3,
    /// Unit length.
    pub normal: DVec3,
    /// Of the disc, scene units.
    pub radius: f64,
    /// Of the tile, scene units squared; all tiles of a shape add up to its area.
    pub area: f64,
}

impl Tile {
    /// The same, seen from the other side.
    #[must_use]
    pub fn turned(self) -> Self {
        Self { normal: -self.normal, ..self }
    }
}

/// A surface whose area is known.
#[derive(Clone, Copy, Debug)]
pub enum Shape {
    /// A rectangle.
    Rectangle {
        /// One of its corners.
        corner: DVec3,
        /// The edge from there, scene units.
        u: DVec3,
        /// The other edge, at a right angle; the normal has the direction of `u x v`.
        v: DVec3,
    },
    /// A sphere, its normals outwards.
    Ball {
        /// Middle.
        center: DVec3,
        /// Greater than zero, scene units.
        radius: f64,
    },
    /// A torus, its normals outwards.
    Torus {
        /// Its middle; the axis is the local y.
        placed: Frame,
        /// Of the circle that the tube runs along, scene units.
        around: f64,
        /// Of the tube, less than `around`, scene units.
        tube: f64,
    },
    /// What a straight line sweeps around the local y axis: a cylinder, a cone or a flat ring. The
    /// normal lies to the right of the way, so that a counterclockwise outline has it outside.
    Swept {
        /// Where the axis is.
        placed: Frame,
        /// Where the line begins: distance from the axis, greater than zero, and height.
        from: DVec2,
        /// Where it ends, alike.
        to: DVec2,
    },
}

/// A point of an outline that is swept around an axis: distance from it and height, and the normal
/// in the same plane.
struct Outline {
    place: DVec2,
    normal: DVec2,
}

impl Shape {
    /// Scene units squared.
    #[must_use]
    pub fn area(&self) -> f64 {
        match *self {
            Self::Rectangle { u, v, .. } => u.cross(v).length(),
            Self::Ball { radius, .. } => 2.0 * TAU * radius * radius,
            Self::Torus { around, tube, .. } => TAU * TAU * around * tube,
            Self::Swept { from, to, .. } => PI * (from.x + to.x) * from.distance(to),
        }
    }

    /// The samples, one a tile; a tile is about as wide and as high as `side`, scene units, and less
    /// where the shape is narrower.
    #[must_use]
    pub fn tiles(&self, side: f64, random: &mut Random) -> Vec<Tile> {
        match *self {
            Self::Rectangle { corner, u, v } => rectangle(corner, u, v, side, random),
            Self::Ball { center, radius } => ball(center, radius, side, random),
            Self::Torus { placed, around, tube } => {
                let arc = Arc { around, tube, from: -PI, to: PI };
                arc.swept(&placed, side, random)
            }
            Self::Swept { placed, from, to } => {
                let along = to - from;
                let ahead = along / along.length();
                let normal = DVec2::new(ahead.y, -ahead.x);
                let at = |t: f64| Outline { place: from + along * t, normal };
                let area = |low: f64, high: f64| {
                    let (low, high) = (from + along * low, from + along * high);
                    PI * (low.x + high.x) * low.distance(high)
                };
                swept(&placed, along.length(), at, area, side, random)
            }
        }
    }
}

/// How often a side fits into a length, at least once.
fn parts(length: f64, side: f64) -> u32 {
    (length / side).round().max(1.0) as u32
}

/// The radius of a disc that covers a tile of this width and height.
fn reach(width: f64, height: f64) -> f64 {
    REACH * ((width * width + height * height) / 2.0).sqrt()
}

/// Where in its tile a sample lies along one direction: share of the tile, around a half.
fn share(random: &mut Random) -> f64 {
    0.5 + random.between(-JITTER, JITTER)
}

fn rectangle(corner: DVec3, u: DVec3, v: DVec3, side: f64, random: &mut Random) -> Vec<Tile> {
    let (columns, rows) = (parts(u.length(), side), parts(v.length(), side));
    let (width, height) = (u.length() / f64::from(columns), v.length() / f64::from(rows));
    let normal = u.cross(v).normalize_or(DVec3::Y);
    let (radius, area) = (reach(width, height), width * height);
    let mut tiles = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            let across = (f64::from(column) + share(random)) / f64::from(columns);
            let along = (f64::from(row) + share(random)) / f64::from(rows);
            tiles.push(Tile { position: corner + u * across + v * along, normal, radius, area });
        }
    }
    tiles
}

/// Rings of tiles around the y axis between two round ones at the poles.
fn ball(center: DVec3, radius: f64, side: f64, random: &mut Random) -> Vec<Tile> {
    let placed = Frame::new(center, DVec3::Y, DVec3::X);
    // As large as the other tiles, on a ball that is large against them.
    let pole = (side / radius / PI.sqrt()).min(PI / 4.0);
    let half = sin(pole / 2.0);
    let cap = |normal: DVec3| {
        let position = center + normal * radius;
        let area = 2.0 * TAU * radius * radius * half * half;
        // From the pole to the cap's edge straight through the ball.
        Tile { position, normal, radius: (REACH * side).max(2.0 * radius * half), area }
    };
    let mut tiles = vec![cap(DVec3::NEG_Y), cap(DVec3::Y)];
    let arc = Arc { around: 0.0, tube: radius, from: pole - PI / 2.0, to: PI / 2.0 - pole };
    tiles.extend(arc.swept(&placed, side, random));
    tiles
}

/// A part of a circle beside the axis.
struct Arc {
    /// Distance of its middle from the axis.
    around: f64,
    /// Its radius.
    tube: f64,
    /// Angle at which it begins, from straight away from the axis, counterclockwise: radians.
    from: f64,
    /// Angle at which it ends.
    to: f64,
}

impl Arc {
    fn swept(&self, placed: &Frame, side: f64, random: &mut Random) -> Vec<Tile> {
        let angle = |t: f64| self.from + (self.to - self.from) * t;
        let at = |t: f64| {
            let (sin, cos) = sin_cos(angle(t));
            let normal = DVec2::new(cos, sin);
            Outline { place: DVec2::new(self.around, 0.0) + normal * self.tube, normal }
        };
        let area = |low: f64, high: f64| {
            let (low, high) = (angle(low), angle(high));
            let bent = self.tube * (sin(high) - sin(low));
            TAU * self.tube * (self.around * (high - low) + bent)
        };
        let length = self.tube * (self.to - self.from);
        swept(placed, length, at, area, side, random)
    }
}

/// Tiles of what an outline sweeps: `at` gives its points and `area` what lies between two of them,
/// both by the share of the outline's `length`.
fn swept(
    placed: &Frame,
    length: f64,
    at: impl Fn(f64) -> Outline,
    area: impl Fn(f64, f64) -> f64,
    side: f64,
    random: &mut Random,
) -> Vec<Tile> {
    let rows = parts(length, side);
    let height = length / f64::from(rows);
    let mut tiles = Vec::new();
    for row in 0..rows {
        let share_of = |offset: f64| (f64::from(row) + offset) / f64::from(rows);
        let ring = area(share_of(0.0), share_of(1.0));
        // Three at least, or discs would not bend around the axis.
        let columns = parts(ring / height, side).max(3);
        let widest = at(share_of(0.0)).place.x.max(at(share_of(1.0)).place.x);
        let radius = reach(TAU * widest / f64::from(columns), height);
        let first = random.unit();
        for column in 0..columns {
            let Outline { place, normal } = at(share_of(share(random)));
            let turn = (f64::from(column) + first + share(random)) / f64::from(columns);
            let (sin, cos) = sin_cos(turn * TAU);
            let world = |point: DVec2| DVec3::new(point.x * cos, point.y, point.x * sin);
            tiles.push(Tile {
                position: placed.world(world(place)),
                normal: placed.turned(world(normal)),
                radius,
                area: ring / f64::from(columns),
            });
        }
    }
    tiles
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::Grid;

    /// One of each, none of them aligned with the axes.
    fn shapes() -> [Shape; 5] {
        let at = DVec3::new(0.3, -0.2, 0.1);
        let placed = Frame::new(at, DVec3::new(0.2, 1.0, -0.4), DVec3::X);
        let [u, v] = [DVec3::X * 1.1, DVec3::Z * 0.83].map(|edge| placed.turned(edge));
        let (from, to) = (DVec2::new(0.5, -0.2), DVec2::new(0.3, 0.4));
        [
            Shape::Rectangle { corner: at, u, v },
            Shape::Ball { center: at, radius: 0.7 },
            Shape::Torus { placed, around: 0.5, tube: 0.2 },
            Shape::Swept { placed, from, to },
            Shape::Swept { placed, from: DVec2::new(0.5, 0.1), to: DVec2::new(0.53, 0.1) },
        ]
    }

    #[test]
    fn tiles_share_the_area_evenly() {
        for shape in shapes() {
            let side = 0.02;
            let tiles = shape.tiles(side, &mut Random::new(1));
            let sum: f64 = tiles.iter().map(|tile| tile.area).sum();
            assert!((sum / shape.area() - 1.0).abs() < 1e-9, "{shape:?}: {sum}");
            for tile in tiles {
                let size = tile.area / (side * side);
                // The narrow ring is one and a half sides wide.
                assert!((0.7..1.4).contains(&size), "{shape:?}: {size} of a square");
                assert!((tile.normal.length() - 1.0).abs() < 1e-11);
            }
        }
    }

    #[test]
    fn normals_are_those_of_the_surface() {
        let shape = Shape::Ball { center: DVec3::Y, radius: 0.7 };
        for tile in shape.tiles(0.05, &mut Random::new(2)) {
            assert!((DVec3::Y + tile.normal * 0.7 - tile.position).length() < 1e-11);
        }
        let placed = Frame::new(DVec3::ZERO, DVec3::Y, DVec3::X);
        for tile in
            (Shape::Torus { placed, around: 0.5, tube: 0.2 }).tiles(0.05, &mut Random::new(2))
        {
            let back = tile.position - tile.normal * 0.2;
            let around = DVec2::new(back.x, back.z).length();
            assert!(back.y.abs() < 1e-11 && (around - 0.5).abs() < 1e-11, "{back}");
        }
        // Up the outside, in over the rim.
        let swept = |from: [f64; 2], to: [f64; 2]| {
            let [from, to] = [from, to].map(DVec2::from_array);
            (Shape::Swept { placed, from, to }).tiles(0.05, &mut Random::new(2))
        };
        for tile in swept([0.5, 0.0], [0.5, 0.3]) {
            let outwards = DVec3::new(tile.position.x, 0.0, tile.position.z) / 0.5;
            assert!((tile.normal - outwards).length() < 1e-11);
        }
        for tile in swept([0.5, 0.3], [0.4, 0.3]) {
            assert_eq!(tile.normal, DVec3::Y);
        }
    }

    /// Whether some disc lies over or under a point, seen along the disc's normal.
    fn is_covered(tiles: &[Tile], grid: &Grid, widest: f64, point: DVec3) -> bool {
        grid.near(point, 2.0 * widest).any(|index| {
            let tile = tiles[index];
            let offset = point - tile.position;
            let off = tile.normal.dot(offset);
            off.abs() < 0.5 * tile.radius
                && (offset - tile.normal * off).length_squared() <= tile.radius * tile.radius
        })
    }

    #[test]
    fn discs_cover_shapes_up_to_their_edges() {
        for shape in shapes() {
            // The places of a finer tiling, which come as near to the edges as a sixtieth of a side.
            let places = shape.tiles(0.002, &mut Random::new(3));
            for side in [0.05, 0.02] {
                let tiles = shape.tiles(side, &mut Random::new(4));
                let widest = tiles.iter().map(|tile| tile.radius).fold(0.0, f64::max);
                let mut grid = Grid::new(side);
                for (index, tile) in tiles.iter().enumerate() {
                    grid.insert(tile.position, index);
                }
                for place in &places {
                    let point = place.position;
                    let covered = is_covered(&tiles, &grid, widest, point);
                    assert!(covered, "hole at {point} of {shape:?} in tiles of {side}");
                }
            }
        }
    }
}
