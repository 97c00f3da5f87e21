//! Meshes to measure with.

use anyhow::Context;
use glam::{DVec3, Vec3};
use std::collections::HashMap;
use std::path::Path;

/// Triangles and a name.
pub(super) struct Mesh {
    pub(super) name: String,
    pub(super) positions: Vec<Vec3>,
    pub(super) faces: Vec<[u32; 3]>,
}

/// Those of files, or made ones where there are no files.
pub(super) fn all(files: &[String]) -> anyhow::Result<Vec<Mesh>> {
    if files.is_empty() {
        return Ok(vec![torus(), blocks(), plate()]);
    }
    files.iter().map(|file| read(Path::new(file))).collect()
}

fn read(file: &Path) -> anyhow::Result<Mesh> {
    let text = std::fs::read_to_string(file).with_context(|| file.display().to_string())?;
    let name = file.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into());
    let (positions, faces) = match file.extension().and_then(|ending| ending.to_str()) {
        Some("obj") => obj(&text),
        Some("off") => listed(&text, 1, |line| line.first().and_then(|n| n.parse().ok())),
        _ => ply(&text),
    };
    anyhow::ensure!(!faces.is_empty(), "{}: expected triangles, found none", file.display());
    Ok(Mesh { name, positions, faces })
}

type Triangles = (Vec<Vec3>, Vec<[u32; 3]>);

fn obj(text: &str) -> Triangles {
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.split_first() {
            Some((&"v", rest)) => positions.extend(position(rest)),
            Some((&"f", rest)) => {
                let corner =
                    |word: &&str| word.split('/').next()?.parse::<u32>().ok()?.checked_sub(1);
                let corners: Vec<u32> = rest.iter().filter_map(corner).collect();
                faces.extend(fan(&corners));
            }
            _ => {}
        }
    }
    (positions, faces)
}

fn position(words: &[&str]) -> Option<Vec3> {
    let number = |i: usize| words.get(i)?.parse::<f32>().ok();
    Some(Vec3::new(number(0)?, number(1)?, number(2)?))
}

fn fan(corners: &[u32]) -> impl Iterator<Item = [u32; 3]> + '_ {
    corners.windows(2).skip(1).map(|pair| [corners[0], pair[0], pair[1]])
}

fn ply(text: &str) -> Triangles {
    let end = text.lines().position(|line| line.trim() == "end_header").map_or(0, |line| line + 1);
    let count = |name: &str| {
        let line = text.lines().find_map(|line| line.strip_prefix(&format!("element {name} ")));
        line.and_then(|count| count.trim().parse().ok())
    };
    listed(text, end, |_| count("vertex"))
}

/// Positions and faces as OFF has them, and PLY after its header of so many lines; what it begins with says how many
/// positions there are.
fn listed(text: &str, header: usize, count: impl Fn(&[&str]) -> Option<usize>) -> Triangles {
    let mut lines =
        text.lines().skip(header).map(|line| line.split_whitespace().collect::<Vec<_>>());
    let is_off = text.starts_with("OFF");
    let first = if is_off { lines.next().unwrap_or_default() } else { Vec::new() };
    let n = count(&first).unwrap_or(0);
    let positions = lines.by_ref().take(n).filter_map(|line| position(&line)).collect();
    let faces = lines.flat_map(|line| {
        let corners: Vec<u32> = line.iter().skip(1).filter_map(|word| word.parse().ok()).collect();
        fan(&corners).collect::<Vec<_>>()
    });
    let faces = faces.collect();
    (positions, faces)
}

/// Triangles of a grid over the unit square.
fn grid(name: &str, [nu, nv]: [u32; 2], at: impl Fn(f64, f64) -> DVec3) -> Mesh {
    let corner = |i: u32| {
        at(f64::from(i % (nu + 1)) / f64::from(nu), f64::from(i / (nu + 1)) / f64::from(nv))
    };
    let positions = (0..(nu + 1) * (nv + 1)).map(|i| corner(i).as_vec3()).collect();
    let faces = (0..nu * nv).flat_map(|i| {
        let a = i / nu * (nu + 1) + i % nu;
        let (b, c, d) = (a + 1, a + nu + 1, a + nu + 2);
        [[a, b, d], [a, d, c]]
    });
    Mesh { name: name.into(), positions, faces: faces.collect() }
}

fn torus() -> Mesh {
    grid("torus", [400, 200], |u, v| {
        let (around, across) = (u * std::f64::consts::TAU, v * std::f64::consts::TAU);
        let r = 1.0 + 0.4 * across.cos();
        DVec3::new(r * around.cos(), r * around.sin(), 0.4 * across.sin())
    })
}

/// A box, corner and size.
fn cuboid(mesh: &mut Mesh, min: DVec3, size: DVec3) {
    let first = mesh.positions.len() as u32;
    let corner = |i: u32| {
        min + size * DVec3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2))
    };
    mesh.positions.extend((0..8).map(|i| corner(i).as_vec3()));
    let sides: [[u32; 4]; 6] =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    for [a, b, c, d] in sides {
        mesh.faces.extend([[a, b, c], [a, c, d]].map(|face| face.map(|i| first + i)));
    }
}

fn blocks() -> Mesh {
    let mut mesh = Mesh { name: "blocks".into(), positions: Vec::new(), faces: Vec::new() };
    cuboid(&mut mesh, DVec3::ZERO, DVec3::new(1.0, 1.0, 1.0));
    cuboid(&mut mesh, DVec3::new(1.5, 0.0, 0.0), DVec3::new(0.4, 1.2, 0.1));
    cuboid(&mut mesh, DVec3::new(0.0, 1.6, 0.2), DVec3::new(1.3, 0.3, 0.3));
    mesh
}

fn plate() -> Mesh {
    grid("plate", [1, 1], |u, v| DVec3::new(2.0 * u, v, 0.3 * u))
}

impl Mesh {
    /// The diagonal of its box.
    pub(super) fn diagonal(&self) -> f64 {
        surfelshop_geometry::Bounds::of_positions(&self.positions).map_or(0.0, |b| b.diagonal())
    }

    /// Ends of its sharp edges: those of one face alone, and those where it folds by more than 30 degrees.
    pub(super) fn edges(&self) -> Vec<[DVec3; 2]> {
        let normals = surfelshop_geometry::mesh::face_normals(&self.positions, &self.faces);
        // Corners at one place are one.
        let key = |i: u32| (self.positions[i as usize] + Vec3::ZERO).to_array().map(f32::to_bits);
        let mut sides: HashMap<[[u32; 3]; 2], Vec<Vec3>> = HashMap::new();
        for (face, normal) in self.faces.iter().zip(&normals) {
            for i in 0..3 {
                let (a, b) = (key(face[i]), key(face[(i + 1) % 3]));
                sides.entry([a.min(b), a.max(b)]).or_default().push(*normal);
            }
        }
        let is_sharp = |normals: &[Vec3]| match normals {
            [a, b] => a.dot(*b) < 0.866,
            _ => true,
        };
        let point = |key: [u32; 3]| Vec3::from_array(key.map(f32::from_bits)).as_dvec3();
        let sharp = sides.iter().filter(|(_, normals)| is_sharp(normals));
        let mut edges: Vec<[DVec3; 2]> = sharp.map(|(ends, _)| ends.map(point)).collect();
        edges.sort_by(|a, b| a[0].to_array().partial_cmp(&b[0].to_array()).unwrap());
        edges
    }
}
