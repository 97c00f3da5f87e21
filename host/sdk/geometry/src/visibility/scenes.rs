//! Surfaces with known normals that the tests of this folder share, sampled at random: a Poisson
//! process, the worst case for holes. Lengths are in metres, up is +z.

use crate::discs::{Disc, Discs};
use crate::progress::silent;
use crate::samples::Random;
use glam::{DVec3, Vec3};
use std::f64::consts::TAU;

/// Points and the normals they should have.
#[derive(Clone, Default)]
pub(crate) struct Scene {
    pub(crate) positions: Vec<Vec3>,
    pub(crate) normals: Vec<Vec3>,
}

impl Scene {
    pub(crate) fn len(&self) -> usize {
        self.positions.len()
    }

    fn push(&mut self, position: DVec3, normal: DVec3) {
        self.positions.push(position.as_vec3());
        self.normals.push(normal.normalize_or(DVec3::Z).as_vec3());
    }

    pub(crate) fn add(&mut self, other: &Self) {
        self.positions.extend(&other.positions);
        self.normals.extend(&other.normals);
    }

    /// The parallelogram of `u` and `v` at a corner, whose normal is `u` x `v`, with so many points
    /// a square metre; without those that `is_open`.
    pub(crate) fn wall(
        &mut self,
        (corner, u, v): (DVec3, DVec3, DVec3),
        density: f64,
        random: &mut Random,
        is_open: impl Fn(DVec3) -> bool,
    ) {
        let normal = u.cross(v);
        for _ in 0..(normal.length() * density).round() as usize {
            let point = corner + u * random.unit() + v * random.unit();
            if !is_open(point) {
                self.push(point, normal);
            }
        }
    }

    /// The faces of an axis-aligned box that `wanted` says, by their outward normals; `inwards` for
    /// a room.
    pub(crate) fn cuboid(
        &mut self,
        (min, max): (DVec3, DVec3),
        density: f64,
        inwards: bool,
        random: &mut Random,
        is_open: impl Fn(DVec3, DVec3) -> bool,
    ) {
        let size = max - min;
        for axis in 0..3 {
            let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
            for far in [false, true] {
                let mut corner = min;
                let mut normal = DVec3::ZERO;
                normal[axis] = if far { 1.0 } else { -1.0 };
                if far {
                    corner[axis] = max[axis];
                }
                let (mut u, mut v) = (DVec3::ZERO, DVec3::ZERO);
                (u[a], v[b]) = (size[a], size[b]);
                // u x v is along +axis.
                let (u, v) = if far != inwards { (u, v) } else { (v, u) };
                self.wall((corner, u, v), density, random, |point| is_open(point, normal));
            }
        }
    }

    pub(crate) fn sphere(
        &mut self,
        centre: DVec3,
        radii: DVec3,
        count: usize,
        random: &mut Random,
    ) {
        for _ in 0..count {
            let d = random.on_sphere();
            self.push(centre + d * radii, d / radii);
        }
    }

    /// Moves every point along a random direction by up to `distance`.
    pub(crate) fn noisy(mut self, distance: f64, seed: u64) -> Self {
        let mut random = Random::new(seed);
        for position in &mut self.positions {
            *position += (random.in_ball() * distance).as_vec3();
        }
        self
    }

    /// Keeps points with a probability.
    pub(crate) fn thinned(&self, seed: u64, probability: impl Fn(Vec3) -> f64) -> Self {
        let mut random = Random::new(seed);
        let mut kept = Self::default();
        for (&position, &normal) in self.positions.iter().zip(&self.normals) {
            if random.unit() < probability(position) {
                kept.positions.push(position);
                kept.normals.push(normal);
            }
        }
        kept
    }

    /// What devices at these places see.
    pub(crate) fn seen_from(&self, devices: &[Vec3]) -> Self {
        let disc = |(&centre, &normal)| Disc { centre, normal, radius: 0.1 };
        let discs: Vec<Disc> = self.positions.iter().zip(&self.normals).map(disc).collect();
        let discs = Discs::build(&discs, &silent).unwrap();
        let mut visible = Self::default();
        for (&position, &normal) in self.positions.iter().zip(&self.normals) {
            let is_seen = |device: &Vec3| {
                let towards = *device - position;
                let length = towards.length();
                let reach = 0.15..length;
                towards.dot(normal) > 0.0
                    && !discs.is_hit(position, towards / length, reach, |meeting| meeting.front)
            };
            if devices.iter().any(is_seen) {
                visible.positions.push(position);
                visible.normals.push(normal);
            }
        }
        visible
    }

    /// The normals with random signs.
    pub(crate) fn scrambled(&self, seed: u64) -> Vec<Vec3> {
        let mut random = Random::new(seed);
        self.normals.iter().map(|&n| if random.unit() < 0.5 { n } else { -n }).collect()
    }

    /// Share of normals on the right side.
    pub(crate) fn right(&self, normals: &[Vec3]) -> f64 {
        let right = self.normals.iter().zip(normals).filter(|(a, b)| a.dot(**b) > 0.0).count();
        right as f64 / self.len().max(1) as f64
    }
}

pub(crate) fn sphere(count: usize) -> Scene {
    let mut scene = Scene::default();
    scene.sphere(DVec3::new(3.0, -1.0, 0.5), DVec3::ONE, count, &mut Random::new(1));
    scene
}

pub(crate) fn cube(count: usize) -> Scene {
    let mut scene = Scene::default();
    let half = DVec3::splat(0.5);
    let density = count as f64 / 6.0;
    scene.cuboid((-half, half), density, false, &mut Random::new(2), |_, _| false);
    scene
}

pub(crate) fn torus(count: usize) -> Scene {
    let mut random = Random::new(3);
    let mut scene = Scene::default();
    while scene.len() < count {
        let (a, b) = (random.unit() * TAU, random.unit() * TAU);
        // Area is larger outside.
        if random.unit() * 1.4 < 1.0 + 0.4 * b.cos() {
            let out = DVec3::new(a.cos(), a.sin(), 0.0);
            let normal = out * b.cos() + DVec3::Z * b.sin();
            scene.push(out + 0.4 * normal, normal);
        }
    }
    scene
}

/// The upper half of a sphere, a sheet that is open below.
pub(crate) fn hemisphere(count: usize) -> Scene {
    sphere(2 * count).thinned(1, |p| if p.z > 0.5 { 1.0 } else { 0.0 })
}

/// Hills, a sheet over 20 m x 20 m.
pub(crate) fn terrain(count: usize) -> Scene {
    let mut random = Random::new(4);
    let mut scene = Scene::default();
    for _ in 0..count {
        let (x, y) = (20.0 * random.unit(), 20.0 * random.unit());
        let z = 1.5 * (0.7 * x).sin() * (0.5 * y).cos() + 0.3 * (2.1 * x + y).sin();
        let dx = 1.05 * (0.7 * x).cos() * (0.5 * y).cos() + 0.63 * (2.1 * x + y).cos();
        let dy = -0.75 * (0.7 * x).sin() * (0.5 * y).sin() + 0.3 * (2.1 * x + y).cos();
        scene.push(DVec3::new(x, y, z), DVec3::new(-dx, -dy, 1.0));
    }
    scene
}

/// A figure of bodies that touch: a trunk, a head, two arms, two legs and a hat.
pub(crate) fn figure(count: usize) -> Scene {
    let mut random = Random::new(5);
    let mut scene = Scene::default();
    let bodies = [
        (DVec3::ZERO, DVec3::new(0.5, 0.35, 0.7), 0.35),
        (DVec3::new(0.0, 0.0, 1.0), DVec3::splat(0.3), 0.15),
        (DVec3::new(0.75, 0.0, 0.0), DVec3::new(0.25, 0.2, 0.6), 0.13),
        (DVec3::new(-0.75, 0.0, 0.0), DVec3::new(0.25, 0.2, 0.6), 0.13),
        (DVec3::new(0.25, 0.0, -1.3), DVec3::new(0.2, 0.2, 0.68), 0.12),
        (DVec3::new(-0.25, 0.0, -1.3), DVec3::new(0.2, 0.2, 0.68), 0.12),
    ];
    for (centre, radii, share) in bodies {
        scene.sphere(centre, radii, (share * count as f64) as usize, &mut random);
    }
    scene
}

/// What stands in a room: boxes on the floor with what is below them unseen, and a table on legs.
fn furnish(scene: &mut Scene, at: DVec3, density: f64, random: &mut Random) {
    let boxes = [
        (DVec3::new(0.3, 0.3, 0.0), DVec3::new(1.1, 0.8, 1.9)),
        (DVec3::new(3.0, 0.2, 0.0), DVec3::new(4.6, 1.1, 0.5)),
        (DVec3::new(0.4, 3.0, 0.0), DVec3::new(1.0, 3.8, 0.9)),
    ];
    for (min, max) in boxes {
        let bottom = |_: DVec3, normal: DVec3| normal.z < 0.0;
        scene.cuboid((at + min, at + max), density, false, random, bottom);
    }
    let solid = |_: DVec3, _: DVec3| false;
    let top = (DVec3::new(2.2, 2.2, 0.72), DVec3::new(3.6, 3.0, 0.76));
    scene.cuboid((at + top.0, at + top.1), density, false, random, solid);
    for (x, y) in [(2.25, 2.25), (3.5, 2.25), (2.25, 2.9), (3.5, 2.9)] {
        let min = at + DVec3::new(x, y, 0.0);
        scene.cuboid((min, min + DVec3::new(0.05, 0.05, 0.72)), density, false, random, solid);
    }
}

/// Whether a point of the floor lies below a box of `furnish`.
fn is_below(point: DVec3) -> bool {
    let inside = |x: [f64; 2], y: [f64; 2]| {
        (x[0]..x[1]).contains(&point.x) && (y[0]..y[1]).contains(&point.y)
    };
    let boxes = inside([0.3, 1.1], [0.3, 0.8]) || inside([3.0, 4.6], [0.2, 1.1]);
    point.z < 0.01 && (boxes || inside([0.4, 1.0], [3.0, 3.8]))
}

/// A room of 5 m x 4 m x 2.6 m with furniture and an open door of 0.9 m x 2 m.
pub(crate) fn room(density: f64) -> Scene {
    let mut random = Random::new(6);
    let mut scene = Scene::default();
    let size = DVec3::new(5.0, 4.0, 2.6);
    let is_open = |p: DVec3, normal: DVec3| {
        is_below(p) || normal.x > 0.0 && (2.0..2.9).contains(&p.y) && p.z < 2.0
    };
    scene.cuboid((DVec3::ZERO, size), density, true, &mut random, is_open);
    furnish(&mut scene, DVec3::ZERO, density, &mut random);
    scene
}

/// Two rooms beside each other, a wall of 0.2 m between them with a door in it.
pub(crate) fn two_rooms(density: f64) -> Scene {
    let mut random = Random::new(7);
    let mut scene = Scene::default();
    let size = DVec3::new(5.0, 4.0, 2.6);
    let is_door = |p: DVec3| (2.0..2.9).contains(&p.y) && p.z < 2.0;
    let first = |p: DVec3, normal: DVec3| is_below(p) || normal.x > 0.0 && is_door(p);
    scene.cuboid((DVec3::ZERO, size), density, true, &mut random, first);
    furnish(&mut scene, DVec3::ZERO, density, &mut random);
    let min = DVec3::new(5.2, 0.0, 0.0);
    let second = |_: DVec3, normal: DVec3| normal.x < 0.0;
    scene.cuboid((min, min + size), density, true, &mut random, |p, n| second(p, n) && is_door(p));
    // The frame of the door.
    let frame = (DVec3::new(5.0, 2.0, 0.0), DVec3::new(5.2, 2.9, 2.0));
    scene.cuboid(frame, density, true, &mut random, |_, n| n.x.abs() > 0.5);
    scene
}

/// A corridor of 14 m x 1.8 m x 2.5 m, open at one end.
pub(crate) fn corridor(density: f64) -> Scene {
    let mut scene = Scene::default();
    let size = DVec3::new(14.0, 1.8, 2.5);
    let open = |_: DVec3, n: DVec3| n.x > 0.5;
    scene.cuboid((DVec3::ZERO, size), density, true, &mut Random::new(8), open);
    scene
}

/// A street of 30 m between two rows of houses with recessed doors.
pub(crate) fn street(density: f64) -> Scene {
    let mut random = Random::new(9);
    let mut scene = Scene::default();
    let none = |_: DVec3| false;
    let (x, y, z) = (DVec3::X * 30.0, DVec3::Y * 8.0, DVec3::Z * 7.0);
    scene.wall((DVec3::ZERO, x, y), density, &mut random, none);
    let is_recess = |p: DVec3| p.z < 2.2 && p.x % 6.0 < 1.2;
    scene.wall((DVec3::ZERO, z, x), density, &mut random, is_recess);
    scene.wall((DVec3::Y * 8.0, x, z), density, &mut random, is_recess);
    for house in 0..5 {
        let min = DVec3::new(6.0 * f64::from(house), 0.0, 0.0);
        for (near, far, out) in [(-0.5, 0.0, 1.0), (8.0, 8.5, -1.0)] {
            let niche = (min + DVec3::Y * near, min + DVec3::new(1.2, far, 2.2));
            let front = |_: DVec3, n: DVec3| n.y * out > 0.5;
            scene.cuboid(niche, density, true, &mut random, front);
        }
    }
    scene
}

/// A wood around a clearing: ground, trunks and leaves.
pub(crate) fn wood(density: f64) -> Scene {
    let mut random = Random::new(10);
    let mut scene = Scene::default();
    let (x, y) = (DVec3::X * 30.0, DVec3::Y * 30.0);
    scene.wall((DVec3::new(-15.0, -15.0, 0.0), x, y), density, &mut random, |_| false);
    for tree in 0..70 {
        let angle = f64::from(tree) * 2.399_963;
        let distance = 3.0 + 12.0 * (f64::from(tree) / 70.0).sqrt();
        let foot = DVec3::new(angle.cos(), angle.sin(), 0.0) * distance;
        for _ in 0..(density * TAU * 0.2 * 6.0) as usize {
            let around = random.unit() * TAU;
            let out = DVec3::new(around.cos(), around.sin(), 0.0);
            scene.push(foot + 0.2 * out + DVec3::Z * 6.0 * random.unit(), out);
        }
        for _ in 0..(density * 8.0) as usize {
            let leaf = foot + DVec3::Z * 7.0 + random.in_ball() * DVec3::new(1.8, 1.8, 2.0);
            scene.push(leaf, random.on_sphere());
        }
    }
    scene
}
