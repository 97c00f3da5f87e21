//! Normals against those of the mesh.

use super::cloud::{POINTS, ROWS, scan};
use super::meshes::Mesh;
use glam::DVec3;
use surfelshop_geometry::{normals, silent};

pub(super) fn run(meshes: &[Mesh]) -> anyhow::Result<()> {
    println!("{POINTS} points; degrees without sides; creases within two spacings of an edge");
    println!(
        "mesh         cloud      rms  <5 deg  <10 deg  crease rms  smooth rms  right side  sharpened"
    );
    for mesh in meshes {
        let edges = mesh.edges();
        for (name, pattern, noise) in ROWS {
            let cloud = scan(mesh, POINTS, pattern, noise * mesh.diagonal(), 1);
            let found = normals::estimate(&cloud.points, normals::DEFAULT_NEIGHBOURS, &silent)?;
            let area: f64 =
                surfelshop_geometry::mesh::areas(&mesh.positions, &mesh.faces).iter().sum();
            let reach = 2.0 * (area / POINTS as f64).sqrt();
            let (mut all, mut crease, mut smooth) =
                (Angles::default(), Angles::default(), Angles::default());
            let mut right = 0;
            for ((point, truth), normal) in
                cloud.points.iter().zip(&cloud.normals).zip(&found.normals)
            {
                let cosine = truth.dot(*normal);
                right += usize::from(cosine > 0.0);
                let degrees = f64::from(cosine.abs().min(1.0)).acos().to_degrees();
                all.add(degrees);
                let is_near = edges.iter().any(|edge| distance(point.as_dvec3(), edge) < reach);
                if is_near { crease.add(degrees) } else { smooth.add(degrees) }
            }
            let of = found.normals.len() as f64;
            println!(
                "{:<12} {name:<9}{:>5.2}{:>8.1}{:>9.1}{:>12.2}{:>12.2}{:>12.1}{:>11.1}",
                mesh.name,
                all.rms(),
                all.within(5),
                all.within(10),
                crease.rms(),
                smooth.rms(),
                100.0 * right as f64 / of,
                100.0 * found.n_sharpened as f64 / of,
            );
        }
    }
    Ok(())
}

fn distance(point: DVec3, [a, b]: &[DVec3; 2]) -> f64 {
    let along = *b - *a;
    let share = (point - *a).dot(along) / along.length_squared().max(f64::MIN_POSITIVE);
    point.distance(*a + along * share.clamp(0.0, 1.0))
}

#[derive(Default)]
struct Angles {
    squares: f64,
    count: usize,
    within: [usize; 11],
}

impl Angles {
    fn add(&mut self, degrees: f64) {
        self.squares += degrees * degrees;
        self.count += 1;
        for (limit, within) in self.within.iter_mut().enumerate() {
            *within += usize::from(degrees < limit as f64);
        }
    }

    fn rms(&self) -> f64 {
        (self.squares / self.count.max(1) as f64).sqrt()
    }

    fn within(&self, limit: usize) -> f64 {
        100.0 * self.within[limit] as f64 / self.count.max(1) as f64
    }
}
