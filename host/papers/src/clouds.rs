//! Clouds of known shape that entries need and no paper has.
//!
//! Lengths are scene units; normals are of unit length and radii cover what lies between neighbours. All are
//! the same on every run.

use anyhow::{Context as _, anyhow};
use glam::{DVec3, Vec3};
use std::f64::consts::{PI, TAU};
use std::path::{Path, PathBuf};
use surfelshop_cloud::{Buffer, Cloud, Column, WriteOptions, write};

/// Surfels while they are made.
#[derive(Default)]
struct Surfels {
    positions: Vec<f32>,
    normals: Vec<f32>,
    radii: Vec<f32>,
}

/// The angle that spreads points on a spiral evenly, radians: pi (3 - sqrt 5).
pub(crate) const GOLDEN: f64 = 2.399_963_229_728_653;

/// Directions spread evenly, from +y to -y.
pub(crate) fn spiral(n: usize) -> impl Iterator<Item = DVec3> {
    (0..n).map(move |i| {
        let y = 1.0 - (2 * i + 1) as f64 / n as f64;
        let (sin, cos) = (GOLDEN * i as f64).sin_cos();
        let ring = (1.0 - y * y).sqrt();
        DVec3::new(ring * cos, y, ring * sin)
    })
}

impl Surfels {
    fn push(&mut self, position: DVec3, normal: DVec3, radius: f64) {
        let normal = normal.normalize_or(DVec3::Y);
        self.positions.extend(position.as_vec3().to_array());
        self.normals.extend(normal.as_vec3().to_array());
        self.radii.push(radius as f32);
    }

    /// A rectangle of n x m surfels from its middle, along two half axes.
    fn rectangle(&mut self, middle: DVec3, a: DVec3, b: DVec3, [n, m]: [usize; 2]) {
        let normal = a.cross(b);
        let [da, db] = [a * (2.0 / n as f64), b * (2.0 / m as f64)];
        // A disc that reaches the corners of its cell, and a tenth more.
        let radius = 0.55 * da.length().hypot(db.length());
        for i in 0..n {
            for j in 0..m {
                let (i, j) = (i as f64 + 0.5, j as f64 + 0.5);
                self.push(middle - a - b + da * i + db * j, normal, radius);
            }
        }
    }

    /// The six faces of a box, seen from outside.
    fn block(&mut self, middle: DVec3, half: DVec3, per_unit: f64) {
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                let mut towards = DVec3::ZERO;
                towards[axis] = side;
                let (mut a, mut b) = (DVec3::ZERO, DVec3::ZERO);
                a[(axis + 1) % 3] = half[(axis + 1) % 3];
                b[(axis + 2) % 3] = half[(axis + 2) % 3] * side;
                let n =
                    [a.length(), b.length()].map(|h| (2.0 * h * per_unit).ceil().max(2.0) as usize);
                self.rectangle(middle + towards * half[axis], a, b, n);
            }
        }
    }

    /// Points spread evenly over a sphere.
    fn sphere(&mut self, n: usize, normal_sign: f64) {
        let radius = 1.7 * (1.0 / n as f64).sqrt() * 2.0 * 0.9;
        spiral(n).for_each(|place| self.push(place, place * normal_sign, radius));
    }

    /// Leaves out what the place and normal of a surfel say.
    fn retain(&mut self, keeps: impl Fn(Vec3, Vec3) -> bool) {
        let mut kept = Self::default();
        let of = |values: &[f32]| Vec3::from_slice(values);
        let all = self.positions.chunks_exact(3).zip(self.normals.chunks_exact(3));
        for ((place, normal), radius) in all.zip(&self.radii) {
            if keeps(of(place), of(normal)) {
                kept.positions.extend_from_slice(place);
                kept.normals.extend_from_slice(normal);
                kept.radii.push(*radius);
            }
        }
        *self = kept;
    }

    fn cloud(self) -> anyhow::Result<Cloud> {
        let columns = vec![
            Column::new("position", 3, Buffer::F32(self.positions)),
            Column::new("normal", 3, Buffer::F32(self.normals)),
            Column::new("radius", 1, Buffer::F32(self.radii)),
        ];
        Cloud::new(DVec3::ZERO, columns).map_err(|error| anyhow!("a made cloud: {error}"))
    }
}

/// The tube around a (2, 3) torus knot; `n` surfels, about.
fn knot(n: usize) -> Surfels {
    let curve = |t: f64| {
        let r = 1.0 + 0.42 * (3.0 * t).cos();
        DVec3::new(r * (2.0 * t).cos(), r * (2.0 * t).sin(), 0.42 * (3.0 * t).sin())
    };
    // A tube of this radius is 2 pi times as wide around, and the curve about 14.4 long.
    let (tube, length) = (0.24, 14.4);
    let around = ((n as f64 * TAU * tube / length).sqrt().round() as usize).max(8);
    let along = n / around;
    let spacing = (length / along as f64).max(TAU * tube / around as f64);
    let mut surfels = Surfels::default();
    for i in 0..along {
        let t = TAU * (i as f64 + 0.5) / along as f64;
        let h = 1e-4;
        let tangent = (curve(t + h) - curve(t - h)).normalize_or(DVec3::X);
        let bend = curve(t + h) - 2.0 * curve(t) + curve(t - h);
        let normal = (bend - tangent * bend.dot(tangent)).normalize_or(DVec3::Z);
        let binormal = tangent.cross(normal);
        for j in 0..around {
            let angle = TAU * (j as f64 + 0.5 * (i % 2) as f64) / around as f64;
            let towards = normal * angle.cos() + binormal * angle.sin();
            surfels.push(curve(t) + towards * tube, towards, 0.95 * spacing);
        }
    }
    surfels
}

/// Discs above each other that face up, the lowest the largest: what each hides the others hide, too.
fn sheets() -> Surfels {
    let mut surfels = Surfels::default();
    for (height, half) in [(0.0, 1.0), (0.35, 0.5), (0.7, 0.5)] {
        let n = 2 * (half * 32.0) as usize;
        let (a, b) = (DVec3::Z * half, DVec3::X * half);
        surfels.rectangle(DVec3::Y * height, a, b, [n, n]);
        // The other side of each, so that all are closed bodies.
        surfels.rectangle(DVec3::Y * (height - 0.02), b, a, [n, n]);
    }
    surfels
}

fn steps() -> Surfels {
    let mut surfels = Surfels::default();
    for (i, height) in [0.25, 0.5, 0.75].into_iter().enumerate() {
        let x = (i as f64 - 1.0) * 0.5;
        surfels.block(DVec3::new(x, height, 0.0), DVec3::new(0.25, height, 0.6), 40.0);
    }
    // Where a block touches the next there is no surface.
    surfels.retain(|place, normal| {
        let touches = |x: f32, height: f32| (place.x - x).abs() < 1e-6 && place.y < height;
        normal.x.abs() < 0.5 || !(touches(-0.25, 0.5) || touches(0.25, 1.0))
    });
    surfels
}

/// Half a tube that stands on a floor, as in the paper's figure of a caustic.
fn ring() -> Surfels {
    let mut surfels = Surfels::default();
    surfels.rectangle(DVec3::ZERO, DVec3::Z * 1.5, DVec3::X * 1.5, [160, 160]);
    let (n, m) = (420, 80);
    for i in 0..n {
        let angle = PI * (i as f64 + 0.5) / n as f64;
        let (sin, cos) = angle.sin_cos();
        for j in 0..m {
            let place = DVec3::new(cos, 0.5 * (j as f64 + 0.5) / m as f64, -sin);
            surfels.push(place, DVec3::new(-cos, 0.0, sin), 0.007);
        }
    }
    surfels
}

/// A parabolic mirror, and a wall where it gathers the light of a lamp that stands below the wall.
fn dish() -> Surfels {
    let mut surfels = Surfels::default();
    // The lamp stands at (0, -1, -2). Of the focal length 0.8 the mirror has its image 1.25 before the middle, as
    // far above the axis as the lamp is below it.
    surfels.rectangle(DVec3::new(0.0, 0.9, -1.1), DVec3::X * 1.0, DVec3::Y * 0.75, [140, 105]);
    let n = 200;
    for i in 0..n {
        for j in 0..n {
            let [x, y] = [i, j].map(|k| 1.6 * ((k as f64 + 0.5) / n as f64 - 0.5));
            // It opens towards -z: z = -r^2 / (4 f).
            let z = -(x * x + y * y) / 3.2;
            let normal = DVec3::new(-x / 1.6, -y / 1.6, -1.0);
            if x * x + y * y < 0.64 {
                surfels.push(DVec3::new(x, y, z), normal, 0.0065);
            }
        }
    }
    surfels
}

/// A cloud by its name.
fn made(name: &str) -> anyhow::Result<Cloud> {
    let surfels = match name {
        "knot" => knot(12_000),
        "knot-dense" => knot(100_000),
        "cavity" => {
            let mut surfels = Surfels::default();
            surfels.sphere(8_000, -1.0);
            surfels
        }
        "sheets" => sheets(),
        "steps" => steps(),
        "plate" => {
            let mut surfels = Surfels::default();
            surfels.rectangle(DVec3::ZERO, DVec3::X, DVec3::Y, [100, 100]);
            surfels
        }
        "ring" => ring(),
        "dish" => dish(),
        other => return Err(anyhow!("no cloud is called `{other}`")),
    };
    surfels.cloud()
}

/// The file of a cloud, written where it is not there.
pub(crate) fn file(name: &str, folder: &Path) -> anyhow::Result<PathBuf> {
    let path = folder.join(format!("{name}.ply"));
    if !path.is_file() {
        std::fs::create_dir_all(folder)
            .with_context(|| format!("{}: the folder cannot be made", folder.display()))?;
        write(&path, &made(name)?, &WriteOptions::default())?;
    }
    Ok(path)
}

/// Positions, normals and radii of a cloud in world space.
pub(crate) fn surfels(cloud: &Cloud) -> (Vec<DVec3>, Vec<DVec3>, Vec<f64>) {
    let place = |place: &Vec3| cloud.origin() + place.as_dvec3();
    let positions = cloud.positions().iter().map(place).collect();
    let normals = cloud.normals().iter().map(|normal| normal.as_dvec3()).collect();
    let radii = cloud.radii().iter().map(|&radius| f64::from(radius)).collect();
    (positions, normals, radii)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn made_clouds_are_finite_and_face_where_they_say() {
        for name in ["knot", "cavity", "sheets", "steps", "plate", "ring", "dish"] {
            let cloud = made(name).unwrap();
            let (positions, normals, radii) = surfels(&cloud);
            assert!(positions.len() >= 6_000, "{name}: {}", positions.len());
            assert!(normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-5), "{name}");
            assert!(radii.iter().all(|r| *r > 0.0 && r.is_finite()), "{name}");
        }
        let (positions, normals, _) = surfels(&made("cavity").unwrap());
        assert!(positions.iter().zip(&normals).all(|(p, n)| p.dot(*n) < -0.99));
        // A block faces outwards: the steps' highest corner is above the middle of all.
        let (positions, normals, _) = surfels(&made("steps").unwrap());
        let top = positions.iter().zip(&normals).filter(|(p, _)| p.y > 1.49);
        assert!(top.map(|(_, n)| n.y).all(|y| y > 0.99));
    }
}
