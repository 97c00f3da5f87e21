//! Points on meshes, as scanners and scatterers place them.

use super::meshes::Mesh;
use glam::{DVec3, Vec3};
use std::io::Write;
use std::path::Path;
use surfelshop_geometry::hashing;

/// A fixed sequence of numbers for each seed, which follow each other from `seed << 32` on.
pub(super) struct Random(u64);

impl Random {
    pub(super) fn new(seed: u32) -> Self {
        Self(u64::from(seed) << 32)
    }

    /// In [0, 1).
    pub(super) fn unit(&mut self) -> f64 {
        self.0 += 1;
        hashing::fraction(hashing::scattered(self.0))
    }

    /// Normally distributed, of deviation 1.
    pub(super) fn normal(&mut self) -> f64 {
        (-2.0 * (1.0 - self.unit()).ln()).sqrt() * (std::f64::consts::TAU * self.unit()).cos()
    }

    pub(super) fn in_ball(&mut self) -> DVec3 {
        loop {
            let point = DVec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0;
            if point.length_squared() <= 1.0 {
                return point;
            }
        }
    }
}

/// Points with the normals of the faces that they are of.
pub(super) struct Cloud {
    pub(super) points: Vec<Vec3>,
    pub(super) normals: Vec<Vec3>,
}

/// How points are placed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Pattern {
    /// Evenly at random.
    Random,
    /// At random in stripes: `PCPNet`'s.
    Striped,
    /// At random, ever fewer to one side: `PCPNet`'s.
    Gradient,
    /// In lines, five times as close along as across.
    Lines,
    /// In strips that overlap, with wide steps along the flight: airborne.
    Strips,
}

/// Directions of lines and across them.
const FLIGHT: DVec3 = DVec3::new(0.8, -0.36, 0.48);
const SWEEP: DVec3 = DVec3::new(0.48, 0.8, -0.36);

impl Pattern {
    /// Whether a point of the unit cube is kept, where the surface has this normal.
    fn keeps(self, at: DVec3, normal: DVec3, random: &mut Random, lines: f64) -> bool {
        // No face of a common shape lies between two lines as a whole.
        let (along, across) = (at.dot(FLIGHT), at.dot(SWEEP));
        let share = match self {
            Self::Random => 1.0,
            Self::Striped => 0.05 + 0.95 * f64::from(u8::from((at.y * 6.0).fract() < 0.5)),
            Self::Gradient => 0.02 + 0.98 * (1.0 - at.y).powi(2),
            Self::Lines => on_line(across * lines, SWEEP, normal),
            Self::Strips => {
                let sawtooth = 2.0 * (along * 4.0).rem_euclid(1.0) - 1.0;
                let across_lines = 0.7 * lines * SWEEP + 8.0 * sawtooth.signum() * FLIGHT;
                on_line(
                    across * lines * 0.7 + sawtooth.abs(),
                    across_lines.normalize_or(SWEEP),
                    normal,
                )
            }
        };
        random.unit() < share
    }
}

/// Width of a line, in shares of the distance between two.
const LINE: f64 = 0.01;

/// Share of the points kept that are on a surface and at this height among lines that are 1 apart: as many for each
/// length of a line, also where the surface runs along with the planes that they lie in and a line is wide on it.
fn on_line(height: f64, across: DVec3, normal: DVec3) -> f64 {
    f64::from(u8::from(height.rem_euclid(1.0) < LINE)) * across.reject_from(normal).length()
}

/// `count` points of a mesh, off by noise of this deviation.
pub(super) fn scan(mesh: &Mesh, count: usize, pattern: Pattern, noise: f64, seed: u32) -> Cloud {
    let mut random = Random::new(seed);
    let areas = surfelshop_geometry::mesh::areas(&mesh.positions, &mesh.faces);
    let mut sums = Vec::with_capacity(areas.len());
    let mut total = 0.0;
    for area in areas {
        total += area;
        sums.push(total);
    }
    let face_normals = surfelshop_geometry::mesh::face_normals(&mesh.positions, &mesh.faces);
    let bounds = surfelshop_geometry::Bounds::of_positions(&mesh.positions).unwrap();
    let lines = bounds.extent() / (total / count as f64).sqrt() / 2.2;
    let mut cloud = Cloud { points: Vec::new(), normals: Vec::new() };
    let mut tries = 0u64;
    while cloud.points.len() < count && tries < 1_000 * count as u64 {
        tries += 1;
        let along = random.unit() * total;
        let face = sums.partition_point(|&sum| sum <= along).min(sums.len() - 1);
        let corners = mesh.faces[face].map(|i| mesh.positions[i as usize].as_dvec3());
        let (a, b) = (random.unit().sqrt(), random.unit());
        let at = corners[0] * (1.0 - a) + corners[1] * (a * (1.0 - b)) + corners[2] * (a * b);
        let inside = (at - bounds.min) / bounds.extent();
        if !pattern.keeps(inside, face_normals[face].as_dvec3(), &mut random, lines) {
            continue;
        }
        let off = DVec3::new(random.normal(), random.normal(), random.normal()) * noise;
        cloud.points.push((at + off).as_vec3());
        cloud.normals.push(face_normals[face]);
    }
    cloud
}

/// The rows of the table of normals: a name, a pattern, and noise in shares of the diagonal (`PCPNet`'s levels).
pub(super) const ROWS: [(&str, Pattern, f64); 6] = [
    ("clean", Pattern::Random, 0.0),
    ("low", Pattern::Random, 0.00125),
    ("medium", Pattern::Random, 0.006),
    ("high", Pattern::Random, 0.012),
    ("striped", Pattern::Striped, 0.0),
    ("gradient", Pattern::Gradient, 0.0),
];

/// Points of a cloud of the table of normals.
pub(super) const POINTS: usize = 50_000;

/// Writes the clouds of the table of normals, `x y z nx ny nz` as f32 after each other.
pub(super) fn dump(folder: &str, meshes: &[Mesh]) -> anyhow::Result<()> {
    for mesh in meshes {
        for (name, pattern, noise) in ROWS {
            let cloud = scan(mesh, POINTS, pattern, noise * mesh.diagonal(), 1);
            dumped(folder, &format!("{}_{name}", mesh.name), &cloud.points, &cloud.normals)?;
        }
    }
    Ok(())
}

/// Writes points with their true normals.
pub(super) fn dumped(
    folder: &str,
    name: &str,
    points: &[Vec3],
    normals: &[Vec3],
) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder)?;
    let path = Path::new(folder).join(format!("{name}.bin"));
    let mut out = std::io::BufWriter::new(std::fs::File::create(path)?);
    for (point, normal) in points.iter().zip(normals) {
        for number in point.to_array().into_iter().chain(normal.to_array()) {
            out.write_all(&number.to_le_bytes())?;
        }
    }
    Ok(())
}
