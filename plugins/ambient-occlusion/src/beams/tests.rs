use super::*;
use crate::surfels::Surfels;
use fearless_simd::{Level, dispatch};
use surfelshop_geometry::octree::Octree;
use surfelshop_geometry::silent;

/// Random numbers in [-1, 1).
struct Random(u32);

impl Random {
    fn unit(&mut self) -> f32 {
        self.0 = crate::rays::hash(self.0.wrapping_add(0x9e37_79b9));
        (self.0 >> 8) as f32 / (1 << 23) as f32 - 1.0
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit())
    }
}

fn surfels(n: usize, random: &mut Random) -> (Surfels, Vec<f32>) {
    let scattered: Vec<Vec3> = (0..n).map(|_| random.vector()).collect();
    let tree = Octree::build(&scattered, 8, &silent).unwrap();
    let order: Vec<u32> = tree.order().to_vec();
    let positions = order.iter().map(|&i| scattered[i as usize]).collect();
    let normals = order.iter().map(|_| random.vector().normalize_or(Vec3::Z)).collect();
    let radii = order.iter().map(|_| 0.1 * random.unit().max(0.0)).collect();
    let surfels = Surfels {
        areas: vec![0.0; n],
        context: Vec::new(),
        n_refused: 0,
        n_strays: 0,
        unit: 1.0,
        order,
        positions,
        normals,
        tree,
    };
    (surfels, radii)
}

/// The same question to one disc after the other, as `Discs` answers it.
fn is_hit(surfels: &Surfels, radii: &[f32], origin: Vec3, d: Vec3, reach: f32) -> bool {
    (0..radii.len()).any(|place| {
        let (n, to) = (surfels.normals[place], surfels.positions[place] - origin);
        let (slope, radius) = (n.dot(d), radii[place]);
        let distance = n.dot(to) / slope;
        let least = if slope < 0.0 { 0.0 } else { NEAR * radius };
        radius > 0.0
            && distance > least
            && distance < reach
            && (to - distance * d).length_squared() < radius * radius
    })
}

#[test]
fn beams_meet_what_their_rays_meet() {
    let mut random = Random(7);
    let (surfels, radii) = surfels(700, &mut random);
    let beams = Beams::of(&surfels, &radii);
    let (mut n_hits, mut n_different, mut n) = (0, 0, 0);
    for i in 0..600 {
        let middle = random.vector();
        let size = [0.0, 0.01, 0.3][i % 3];
        let starts: [Vec3; WIDTH] = std::array::from_fn(|_| middle + size * random.vector());
        let origins = std::array::from_fn(|axis| starts.map(|start| start[axis]));
        let along = [random.vector(), Vec3::X, Vec3::NEG_Z][i % 7 % 3].normalize_or(Vec3::Y);
        let reach = [f32::INFINITY, 0.5][i % 2];
        let asked = [0xffff, 0x0f31][i % 5 % 2];
        let found = dispatch!(Level::new(), simd => {
            let rays = Rays::new(simd, &origins);
            beams.hits(simd, &rays, along, asked, reach, &mut Vec::new())
        });
        assert_eq!(found & !asked, 0);
        for (lane, &start) in starts.iter().enumerate().filter(|(i, _)| asked & 1 << i != 0) {
            let hit = found & 1 << lane != 0;
            n += 1;
            n_hits += i32::from(hit);
            n_different += i32::from(hit != is_hit(&surfels, &radii, start, along, reach));
        }
    }
    assert!(n_hits > n / 10 && n_hits < 9 * n / 10, "{n_hits} of {n}");
    // Rays within a rounding error of a disc's edge.
    assert!(n_different <= 2, "{n_different} of {n}");
}
