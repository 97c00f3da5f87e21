//! Scenes as surfels and as triangles of the same surface.

use crate::clouds::{Surfels, sphere};
use glam::{DVec3, Vec3};
use surfelshop_cloud::Cloud;
use surfelshop_geometry::mesh::{self, MeshPoint};
use surfelshop_geometry::{silent, spread};

/// Surfels on a surface, and the surface's triangles, whose corners need not be surfels.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Centres of the surfels.
    pub positions: Vec<Vec3>,
    /// Unit normals of the surfels.
    pub normals: Vec<Vec3>,
    /// Corners of the triangles.
    pub corners: Vec<Vec3>,
    /// The triangles.
    pub faces: Vec<[u32; 3]>,
}

impl Mesh {
    /// The surfels of a mesh whose vertices they are.
    #[must_use]
    pub fn of(cloud: &Cloud) -> Self {
        let view = cloud.view();
        Self {
            positions: cloud.positions().to_vec(),
            normals: cloud.normals().to_vec(),
            corners: cloud.positions().to_vec(),
            faces: view.faces.to_vec(),
        }
    }

    /// `count` surfels spread evenly over the triangles, with normals blended from the corners,
    /// which must be the surfels.
    ///
    /// # Panics
    /// Never: nobody stops the work.
    #[must_use]
    pub fn resampled(&self, count: usize) -> Self {
        let areas = mesh::areas(&self.corners, &self.faces);
        let places = mesh::scatter(&areas, 5 * count, 1, &silent).expect("nobody stops it");
        let at: Vec<Vec3> =
            places.iter().map(|p| p.mean(&self.corners, &self.faces).as_vec3()).collect();
        let kept = spread::evenly(&at, count, areas.iter().sum(), 1, &silent);
        let kept = kept.expect("nobody stops it");
        let normal = |place: &MeshPoint| place.mean(&self.normals, &self.faces);
        let (mut positions, mut normals) = (Vec::new(), Vec::new());
        for i in (0..at.len()).filter(|&i| kept[i]) {
            positions.push(at[i]);
            normals.push(normal(&places[i]).normalize_or(DVec3::Z).as_vec3());
        }
        Self { positions, normals, corners: self.corners.clone(), faces: self.faces.clone() }
    }

    /// Whether each surfel is a corner of a triangle, where there are as many corners as surfels;
    /// those that are not lie loose in the file and say nothing of an error.
    #[must_use]
    pub fn is_used(&self) -> Vec<bool> {
        let mut used = vec![self.corners.len() != self.positions.len(); self.positions.len()];
        if self.corners.len() == self.positions.len() {
            self.faces.iter().flatten().for_each(|&corner| used[corner as usize] = true);
        }
        used
    }

    /// The surfels as a cloud. The tool does not read radii; they are a spacing of one hundredth.
    #[must_use]
    pub fn cloud(&self) -> Cloud {
        let (positions, normals) = (self.positions.clone(), self.normals.clone());
        let radii = vec![0.01; positions.len()];
        Surfels { positions, normals, radii, ..Surfels::default() }.cloud()
    }

    fn face(&mut self, corners: [Vec3; 3]) {
        let first = self.corners.len() as u32;
        self.corners.extend(corners);
        self.faces.push([first, first + 1, first + 2]);
    }

    /// A parallelogram from a corner along two edges, facing their cross product, with surfels in
    /// the middle of its cells of about this size.
    fn patch(&mut self, corner: Vec3, edges: [Vec3; 2], spacing: f32) {
        let [u, v] = edges;
        let count = edges.map(|edge| (edge.length() / spacing).round().max(1.0));
        let normal = u.cross(v).normalize_or(Vec3::Z);
        for i in 0..count[0] as u32 {
            for j in 0..count[1] as u32 {
                let share = |k: u32, n: f32| (k as f32 + 0.5) / n;
                self.positions.push(corner + share(i, count[0]) * u + share(j, count[1]) * v);
                self.normals.push(normal);
            }
        }
        self.face([corner, corner + u, corner + u + v]);
        self.face([corner, corner + u + v, corner + v]);
    }

    /// The faces of a box but those whose normals are in `without`.
    fn cuboid(&mut self, min: Vec3, max: Vec3, without: &[Vec3], outward: bool, spacing: f32) {
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            let (u, v) = (Vec3::new(axis.z, axis.x, axis.y), Vec3::new(axis.y, axis.z, axis.x));
            let size = max - min;
            for (corner, face) in [(min, -axis), (min + size * axis, axis)] {
                if without.contains(&face) {
                    continue;
                }
                let edges = [size * u, size * v];
                let along = u.cross(v).dot(face) > 0.0;
                let edges = if along == outward { edges } else { [edges[1], edges[0]] };
                self.patch(corner, edges, spacing);
            }
        }
    }

    /// A ball, whose triangles lie just inside its surfels.
    fn ball(&mut self, centre: Vec3, radius: f32, spacing: f32) {
        let count = (4.0 * std::f32::consts::PI * (radius / spacing).powi(2)).round() as usize;
        let surfels = sphere(count.max(12), radius);
        self.positions.extend(surfels.positions.iter().map(|&p| centre + p));
        self.normals.extend(surfels.normals);
        self.globe(|direction| centre + radius * direction, 200);
    }

    /// The triangles of a deformed globe with so many meridians.
    fn globe(&mut self, place: impl Fn(Vec3) -> Vec3, meridians: u32) {
        let rings = meridians / 2;
        let at = |ring: u32, meridian: u32| {
            let theta = std::f64::consts::PI * f64::from(ring) / f64::from(rings);
            let phi = std::f64::consts::TAU * f64::from(meridian) / f64::from(meridians);
            let (sin, cos) = theta.sin_cos();
            place(DVec3::new(sin * phi.cos(), cos, -sin * phi.sin()).as_vec3())
        };
        for ring in 0..rings {
            for meridian in 0..meridians {
                let (below, next) = (ring + 1, meridian + 1);
                if ring > 0 {
                    self.face([at(ring, meridian), at(below, meridian), at(ring, next)]);
                }
                if below < rings {
                    self.face([at(ring, next), at(below, meridian), at(below, next)]);
                }
            }
        }
    }
}

/// An open sheet of 2 by 2 that faces +z, with two balls, a box and a thin upright board on it, of
/// about `count` surfels.
#[must_use]
pub fn sheet(count: usize) -> Mesh {
    // The area of everything below.
    let area = 4.0 + 4.0 * std::f32::consts::PI * (0.09 + 0.04) + 0.16 + 4.0 * 0.2 + 2.0 * 0.4;
    let spacing = (area / count as f32).sqrt();
    let mut mesh = Mesh::default();
    mesh.patch(Vec3::new(-1.0, -1.0, 0.0), [2.0 * Vec3::X, 2.0 * Vec3::Y], spacing);
    mesh.ball(Vec3::new(-0.4, -0.3, 0.32), 0.3, spacing);
    mesh.ball(Vec3::new(0.1, 0.3, 0.2), 0.2, spacing);
    let (min, max) = (Vec3::new(0.3, -0.6, 0.0), Vec3::new(0.7, -0.2, 0.5));
    mesh.cuboid(min, max, &[-Vec3::Z], true, spacing);
    // One sheet of surfels, seen from both sides.
    let board = [Vec3::new(0.0, 0.8, 0.0), Vec3::new(0.0, 0.0, 0.5)];
    mesh.patch(Vec3::new(-0.75, 0.1, 0.0), board, spacing);
    mesh
}

/// A closed room of 2 by 2 by 2 whose walls face inwards, of about `count` surfels.
#[must_use]
pub fn room(count: usize) -> Mesh {
    let mut mesh = Mesh::default();
    let spacing = (24.0 / count as f32).sqrt();
    mesh.cuboid(-Vec3::ONE, Vec3::ONE, &[], false, spacing);
    mesh
}

/// A closed body with hollows that occlude themselves, of `count` surfels: a sphere whose radius
/// waves by 30 %.
#[must_use]
pub fn blob(count: usize) -> Mesh {
    let wave = |d: Vec3| 1.0 + 0.3 * (5.0 * d.x).sin() * (4.0 * d.y).cos() * (5.0 * d.z).sin();
    let mut mesh = Mesh::default();
    for direction in sphere(count, 1.0).positions {
        // The normal of r = w(d): the direction less the wave's slope across it.
        let (u, v) = direction.any_orthonormal_pair();
        let step = 1e-3;
        let slope = |t: Vec3| {
            let ahead = wave((direction + step * t).normalize_or(direction));
            let behind = wave((direction - step * t).normalize_or(direction));
            (ahead - behind) / (2.0 * step * wave(direction))
        };
        mesh.positions.push(direction * wave(direction));
        mesh.normals.push((direction - slope(u) * u - slope(v) * v).normalize_or(direction));
    }
    mesh.globe(|direction| direction * wave(direction), 600);
    mesh
}
