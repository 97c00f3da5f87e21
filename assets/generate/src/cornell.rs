//! A Cornell box of points, to see light that bounces between surfaces, and closed rooms in which
//! the answer is known.
//!
//! The room is a cube of two units around the origin, y up, open towards +z, with the red wall at the
//! left and the green one at the right. In it stand two blocks on each other with a ball on top, a
//! torus, and a ring that lies on the floor like a lost wedding ring and gathers light inside.
//!
//! Source of what is shown: Preiner, "Real-Time Global Illumination in Point Clouds", figures 6, 9 and
//! 13; the places and sizes are our own.

use std::path::Path;

use anyhow::Context;
use glam::{DVec2, DVec3, Vec3};
use surfelshop_api::columns::{COLOR, NORMAL, POSITION, RADIUS};
use surfelshop_api::{Camera, Light, Projection};
use surfelshop_cloud::scene::{Backdrop, SceneCloud, SceneFile, SceneView, ToneMap};
use surfelshop_cloud::{Buffer, Cloud, CloudError, Column, WriteOptions};

use crate::field::Frame;
use crate::noise::Random;
use crate::tiles::{Shape, Tile};

/// About how many points the committed box has: what 3.5 MB hold.
pub const N_POINTS: usize = 110_000;

/// The name of the committed cloud, which the scene beside it refers to.
pub const CLOUD_FILE: &str = "cornell-box.ply";

/// Albedo, sRGB-encoded: linear 0.73 on each channel; 0.63, 0.065, 0.05; 0.14, 0.45, 0.09.
const WHITE: [u8; 3] = [222; 3];
const RED: [u8; 3] = [208, 72, 63];
const GREEN: [u8; 3] = [105, 179, 85];

/// How deep things stand in what they stand on, scene units. Their undersides would otherwise lie in
/// the very plane of the floor and show beyond their own edges.
const SUNK: f64 = 0.02;
/// Where the floor is.
const FLOOR: f64 = -1.0;

/// A shape and its paint.
type PaintedShape = (Shape, [u8; 3]);

/// The box with everything in it, of about so many points: positions, exact normals (inwards on the
/// walls, outwards on things), radii and colours of 8 bits.
///
/// # Errors
/// Where a value is not finite, which would be a fault of the shapes.
pub fn cornell_box(n_points: usize) -> Result<Cloud, CloudError> {
    let mut shapes = walls();
    shapes.extend(things().into_iter().map(|shape| (shape, WHITE)));
    painted(&shapes, n_points)
}

/// The same box with nothing in it, of about so many points.
///
/// # Errors
/// As [`cornell_box`].
pub fn empty_box(n_points: usize) -> Result<Cloud, CloudError> {
    painted(&walls(), n_points)
}

/// The sphere of radius 1 around the origin seen from inside, of about so many points: its normals
/// point inwards, and its linear albedo is exactly this grey everywhere.
///
/// # Errors
/// As [`cornell_box`].
pub fn furnace_sphere(n_points: usize, albedo: f32) -> Result<Cloud, CloudError> {
    let shape = Shape::Ball { center: DVec3::ZERO, radius: 1.0 };
    let tiles = tiles_of(&[shape], n_points).into_iter().flatten();
    grey(&tiles.map(Tile::turned).collect::<Vec<_>>(), albedo)
}

/// The cube of two units around the origin with all its six walls, of about so many points: normals
/// point inwards, and the linear albedo is exactly this grey everywhere.
///
/// # Errors
/// As [`cornell_box`].
pub fn furnace_box(n_points: usize, albedo: f32) -> Result<Cloud, CloudError> {
    let shapes = OUTWARDS.map(wall);
    grey(&tiles_of(&shapes, n_points).concat(), albedo)
}

/// The committed box as a scene: a warm spot below the ceiling that shines down aslant, seen from
/// outside through the open side.
#[must_use]
pub fn cornell_scene() -> SceneFile {
    let camera = Camera {
        eye: DVec3::new(0.0, 0.3, 4.4),
        target: DVec3::new(0.0, -0.05, 0.0),
        up: DVec3::Y,
        projection: Projection::Perspective { fov_y: 35.0_f64.to_radians() },
    };
    let spot = Light::Spot {
        position: DVec3::new(-0.7, 0.9, 0.85),
        target: DVec3::new(0.25, -0.9, -0.1),
        intensity: Vec3::new(5.0, 4.6, 4.0),
        angle: 38.0_f64.to_radians(),
        softness: 0.35,
    };
    SceneFile {
        clouds: vec![SceneCloud::new(CLOUD_FILE).into()],
        camera: Some(camera.into()),
        lights: vec![spot.into()],
        tone_map: ToneMap::Neutral,
        background: Backdrop::Color([0.0; 3]),
        views: vec![SceneView::new("global-illumination").into()],
        ..SceneFile::default()
    }
}

/// Makes the box of [`N_POINTS`] and writes it as binary PLY.
///
/// # Errors
/// Where the file cannot be written.
pub fn write_cornell_box(path: &Path) -> anyhow::Result<()> {
    let cloud = cornell_box(N_POINTS).context("the box is no valid cloud")?;
    let comments = vec!["A Cornell box, made by surfelshop-assets".to_owned()];
    let options = WriteOptions { comments, ..WriteOptions::default() };
    surfelshop_cloud::write(path, &cloud, &options)?;
    Ok(())
}

/// Writes the scene, which names the cloud beside it.
///
/// # Errors
/// Where the file cannot be written.
pub fn write_cornell_scene(path: &Path) -> anyhow::Result<()> {
    let folder = path.parent().unwrap_or(Path::new("")).to_owned();
    SceneFile { folder, ..cornell_scene() }.write(path)?;
    Ok(())
}

/// Where the walls of the cube are.
const OUTWARDS: [DVec3; 6] =
    [DVec3::NEG_X, DVec3::X, DVec3::NEG_Y, DVec3::Y, DVec3::NEG_Z, DVec3::Z];

/// The wall of the cube in this direction, which is along an axis; seen from inside.
fn wall(outwards: DVec3) -> Shape {
    let u = DVec3::new(outwards.z, outwards.x, outwards.y).abs() * 2.0;
    // A right angle on, so that u x v points back into the room.
    let v = u.cross(outwards);
    Shape::Rectangle { corner: outwards - u / 2.0 - v / 2.0, u, v }
}

/// Five walls; the sixth is where one looks in.
fn walls() -> Vec<PaintedShape> {
    let paint = |outwards: DVec3| match outwards {
        DVec3::NEG_X => RED,
        DVec3::X => GREEN,
        _ => WHITE,
    };
    OUTWARDS[..5].iter().map(|outwards| (wall(*outwards), paint(*outwards))).collect()
}

/// What stands in the room.
fn things() -> Vec<Shape> {
    let floor = |x: f64, z: f64| DVec3::new(x, FLOOR, z);
    let lower = DVec3::new(0.92, 0.42, 0.66);
    let upper = DVec3::new(0.48, 0.36, 0.42);
    let on_lower = floor(-0.24, -0.36) + DVec3::Y * lower.y;
    let mut shapes = block(on_lower + DVec3::new(0.06, -lower.y, 0.04), 0.31, lower);
    shapes.extend(block(on_lower, -0.58, upper));
    let radius = 0.19;
    // A little lower than it could lie, so that there is no slit below it.
    let center = on_lower + DVec3::Y * (upper.y + radius - 0.004);
    shapes.push(Shape::Ball { center, radius });
    let (around, tube) = (0.19, 0.075);
    let middle = floor(0.62, -0.3) + DVec3::Y * (around + tube - 0.006);
    let upright = Frame::new(middle, DVec3::new(-0.45, 0.0, 1.0), DVec3::X);
    shapes.push(Shape::Torus { placed: upright, around, tube });
    shapes.extend(ring(floor(0.3, 0.52), 0.26, 0.29, 0.12));
    shapes
}

/// A block of this size whose foot is here, turned about y by the tangent `turn`.
fn block(foot: DVec3, turn: f64, size: DVec3) -> Vec<Shape> {
    let size = size + DVec3::Y * SUNK;
    let placed = Frame::new(foot - DVec3::Y * SUNK, DVec3::Y, DVec3::new(1.0, 0.0, turn));
    let low = DVec3::new(-size.x / 2.0, 0.0, -size.z / 2.0);
    let [x, y, z] = [DVec3::X * size.x, DVec3::Y * size.y, DVec3::Z * size.z];
    // Each of two opposite corners has three sides; the products of the edges point outwards.
    let sides = [
        (low, x, z),
        (low, z, y),
        (low, y, x),
        (low + size, -z, -x),
        (low + size, -y, -z),
        (low + size, -x, -y),
    ];
    let side = |(corner, u, v): (DVec3, DVec3, DVec3)| {
        let [u, v] = [u, v].map(|edge| placed.turned(edge));
        Shape::Rectangle { corner: placed.world(corner), u, v }
    };
    sides.into_iter().map(side).collect()
}

/// A band around the upright axis through a point of the floor, between two radii.
fn ring(foot: DVec3, inner: f64, outer: f64, height: f64) -> Vec<Shape> {
    let placed = Frame::new(foot, DVec3::Y, DVec3::X);
    // Around its section against the clock: up the outside, in over the rim, down, and back below.
    let corners = [(outer, -SUNK), (outer, height), (inner, height), (inner, -SUNK)];
    let corners = corners.map(|(radius, y)| DVec2::new(radius, y));
    let edges = (0..4).map(|index| (corners[index], corners[(index + 1) % 4]));
    edges.map(|(from, to)| Shape::Swept { placed, from, to }).collect()
}

/// About so many tiles on shapes, all of about the same size, shape by shape.
fn tiles_of(shapes: &[Shape], n_points: usize) -> Vec<Vec<Tile>> {
    let area: f64 = shapes.iter().map(Shape::area).sum();
    let side = (area / n_points.max(1) as f64).sqrt();
    let mut random = Random::new(9);
    shapes.iter().map(|shape| shape.tiles(side, &mut random)).collect()
}

/// Tiles with paint as a cloud.
fn painted(shapes: &[PaintedShape], n_points: usize) -> Result<Cloud, CloudError> {
    let (shapes, paints): (Vec<_>, Vec<_>) = shapes.iter().copied().unzip();
    let tiles = tiles_of(&shapes, n_points);
    let color = |(tiles, paint): (&Vec<Tile>, [u8; 3])| vec![paint; tiles.len()];
    let colors: Vec<_> = tiles.iter().zip(paints).flat_map(color).collect();
    cloud(&tiles.concat(), Buffer::U8(colors.into_flattened()))
}

/// Tiles of one linear grey as a cloud.
fn grey(tiles: &[Tile], albedo: f32) -> Result<Cloud, CloudError> {
    cloud(tiles, Buffer::F32(vec![albedo; 3 * tiles.len()]))
}

fn cloud(tiles: &[Tile], colors: Buffer) -> Result<Cloud, CloudError> {
    let vectors = |vector: fn(&Tile) -> DVec3| {
        Buffer::F32(tiles.iter().flat_map(|tile| vector(tile).as_vec3().to_array()).collect())
    };
    let radii = tiles.iter().map(|tile| tile.radius as f32).collect();
    let columns = vec![
        Column::new(POSITION, 3, vectors(|tile| tile.position)),
        Column::new(NORMAL, 3, vectors(|tile| tile.normal)),
        Column::new(RADIUS, 1, Buffer::F32(radii)),
        Column::new(COLOR, 3, colors),
    ];
    Cloud::new(DVec3::ZERO, columns)
}

#[cfg(test)]
mod tests;
