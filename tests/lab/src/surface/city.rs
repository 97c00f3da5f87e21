//! A city as scans would have it, of any number of points: `surface city FOLDER MILLIONS [FILES]`.
//!
//! Streets with uneven ground, houses whose façades have windows set back, trees of leaves, statues on pedestals, all
//! with colours, as binary PLY files without normals and radii, a strip of the city each. Of more than 60 million points
//! the city grows and not its density, about 750 points a square metre.

use anyhow::Context as _;
use glam::{DVec3, Vec3};
use std::f64::consts::TAU;
use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::Path;
use surfelshop_geometry::hashing;

/// Side of a block with its half of the streets, metres.
const BLOCK: f64 = 40.0;
/// Points of a block, about.
const BLOCK_POINTS: usize = 3_000_000;
/// Width of the streets around it.
const STREET: f64 = 12.0;

pub(super) fn run(arguments: &[String]) -> anyhow::Result<()> {
    let [folder, millions, rest @ ..] = arguments else {
        anyhow::bail!("expected a folder and how many million points, found {arguments:?}");
    };
    let n = (millions.parse::<f64>().context(millions.clone())? * 1e6) as usize;
    let n_files = rest.first().map_or(Ok(20), |files| files.parse())?;
    std::fs::create_dir_all(folder)?;
    let n_blocks = n.div_ceil(BLOCK_POINTS).max(n_files);
    let across = (n_blocks as f64).sqrt().ceil() as usize;
    for file in 0..n_files {
        let path = Path::new(folder).join(format!("strip-{file:02}.ply"));
        let share = |file: usize| file * n_blocks / n_files;
        let points = |file: usize| (file as u128 * n as u128 / n_files as u128) as usize;
        let of_file = points(file + 1) - points(file);
        let blocks: Vec<[usize; 2]> =
            (share(file)..share(file + 1)).map(|i| [i % across, i / across]).collect();
        write(&path, &blocks, of_file)?;
        println!("{}: {of_file} points", path.display());
    }
    Ok(())
}

fn write(path: &Path, blocks: &[[usize; 2]], n: usize) -> anyhow::Result<()> {
    let mut out = BufWriter::with_capacity(1 << 20, File::create(path)?);
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\nelement vertex {n}\nproperty float x\nproperty \
         float y\nproperty float z\nproperty uchar red\nproperty uchar green\nproperty uchar \
         blue\nend_header\n"
    )?;
    for (i, block) in blocks.iter().enumerate() {
        let of_block = (i + 1) * n / blocks.len() - i * n / blocks.len();
        let block = Block::new(*block);
        for _ in 0..of_block {
            let mut draw = block.random();
            let (at, color) = block.point(&mut draw);
            block.next.set(draw.0);
            for x in at.as_vec3().to_array() {
                out.write_all(&x.to_le_bytes())?;
            }
            out.write_all(&color)?;
        }
    }
    Ok(out.flush()?)
}

/// Numbers in [0, 1) that follow from the number before.
struct Draw(u64);

impl Draw {
    fn next(&mut self) -> f64 {
        self.0 = hashing::scattered(self.0.wrapping_add(0x9E37_79B9_7F4A_7C15));
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    fn on_ball(&mut self) -> DVec3 {
        let (y, angle) = (self.between(-1.0, 1.0), TAU * self.next());
        let radius = (1.0 - y * y).sqrt();
        DVec3::new(radius * angle.cos(), y, radius * angle.sin())
    }
}

/// A house: its corner, its size, and the colour of its walls.
struct House {
    low: DVec3,
    size: DVec3,
    wall: Vec3,
}

struct Tree {
    foot: DVec3,
    height: f64,
}

struct Block {
    corner: DVec3,
    houses: Vec<House>,
    trees: Vec<Tree>,
    statue: DVec3,
    next: std::cell::Cell<u64>,
}

fn code(color: Vec3) -> [u8; 3] {
    color.to_array().map(|c| (255.0 * c.clamp(0.0, 1.0)) as u8)
}

impl Block {
    fn new([x, z]: [usize; 2]) -> Self {
        let mut draw = Draw(hashing::scattered((x as u64) << 32 | z as u64));
        let corner = DVec3::new(x as f64, 0.0, z as f64) * BLOCK;
        let inner = BLOCK - STREET;
        let half = 0.5 * inner;
        let mut houses = Vec::new();
        for i in 0..3 {
            let place = DVec3::new(half * f64::from(i & 1), 0.0, half * f64::from(i >> 1));
            let size = DVec3::new(half - 1.0, draw.between(8.0, 24.0), half - 1.0);
            let low = corner + DVec3::new(0.5 * STREET, 0.0, 0.5 * STREET) + place;
            let shade = draw.between(0.5, 0.9) as f32;
            let wall = Vec3::new(shade, shade * draw.between(0.75, 1.0) as f32, 0.6 * shade);
            houses.push(House { low, size, wall });
        }
        let tree = |i: usize, draw: &mut Draw| Tree {
            foot: corner + DVec3::new(BLOCK * (i as f64 + 0.5) / 6.0, 0.0, draw.between(1.5, 3.5)),
            height: draw.between(5.0, 9.0),
        };
        let trees = (0..6).map(|i| tree(i, &mut draw)).collect();
        // In the yard, the fourth place.
        let statue = corner + DVec3::new(0.5 * STREET + 1.5 * half, 0.0, 0.5 * STREET + 1.5 * half);
        Self { corner, houses, trees, statue, next: std::cell::Cell::new(draw.0) }
    }

    fn random(&self) -> Draw {
        Draw(self.next.get())
    }

    fn point(&self, draw: &mut Draw) -> (DVec3, [u8; 3]) {
        match draw.next() {
            x if x < 0.27 => self.ground(draw),
            x if x < 0.80 => {
                let house = ((draw.next() * 3.0) as usize).min(2);
                self.houses[house].point(draw)
            }
            x if x < 0.95 => {
                let tree = ((draw.next() * 6.0) as usize).min(5);
                self.trees[tree].point(draw)
            }
            _ => self.statue(draw),
        }
    }

    fn ground(&self, draw: &mut Draw) -> (DVec3, [u8; 3]) {
        let at = self.corner + DVec3::new(draw.next() * BLOCK, 0.0, draw.next() * BLOCK);
        let bump = 0.02 * (1.7 * at.x).sin() * (2.3 * at.z).cos() + 0.004 * draw.next();
        let stone = 0.35 + 0.1 * ((at.x * 2.0).floor() + (at.z * 2.0).floor()).rem_euclid(2.0);
        (at + DVec3::Y * bump, code(Vec3::splat(stone as f32)))
    }

    /// Bumpy spheres on top of each other on a pedestal.
    fn statue(&self, draw: &mut Draw) -> (DVec3, [u8; 3]) {
        let direction = draw.on_ball();
        let (middle, radius) = match draw.next() {
            x if x < 0.3 => {
                let side = direction / direction.abs().max_element();
                let at = self.statue + DVec3::new(0.8 * side.x, 0.6 + 0.6 * side.y, 0.8 * side.z);
                return (at, code(Vec3::new(0.6, 0.58, 0.55)));
            }
            x if x < 0.7 => (DVec3::new(0.0, 2.0, 0.0), 0.9),
            _ => (DVec3::new(0.0, 3.1, 0.1), 0.45),
        };
        let bump =
            (9.0 * direction.x).sin() * (8.0 * direction.y).sin() * (7.0 * direction.z).sin();
        let at = self.statue + middle + direction * radius * (1.0 + 0.08 * bump);
        (at, code(Vec3::new(0.35, 0.5 + 0.1 * bump as f32, 0.42)))
    }
}

impl House {
    fn point(&self, draw: &mut Draw) -> (DVec3, [u8; 3]) {
        let Self { low, size, wall } = self;
        let roof = size.x * size.z;
        let walls = 2.0 * (size.x + size.z) * size.y;
        if draw.next() < roof / (roof + walls) {
            let at = DVec3::new(draw.next() * size.x, size.y, draw.next() * size.z);
            return (*low + at, code(Vec3::new(0.5, 0.25, 0.2)));
        }
        let along = draw.next() * 2.0 * (size.x + size.z);
        let up = draw.next() * size.y;
        // Windows of 1.2 m by 1.6 m, every 3 m, are set back.
        let is_window = along.rem_euclid(3.0) < 1.2 && (up - 0.8).rem_euclid(3.2) < 1.6;
        let back = if is_window { 0.15 } else { 0.003 * draw.next() };
        let at = match along {
            a if a < size.x => DVec3::new(a, up, back),
            a if a < size.x + size.z => DVec3::new(size.x - back, up, a - size.x),
            a if a < 2.0 * size.x + size.z => DVec3::new(a - size.x - size.z, up, size.z - back),
            a => DVec3::new(back, up, a - 2.0 * size.x - size.z),
        };
        let color = if is_window { Vec3::new(0.2, 0.25, 0.32) } else { *wall };
        (*low + at, code(color))
    }
}

impl Tree {
    fn point(&self, draw: &mut Draw) -> (DVec3, [u8; 3]) {
        let Self { foot, height } = self;
        if draw.next() < 0.12 {
            let (angle, up) = (TAU * draw.next(), draw.next() * 0.5 * height);
            let at = DVec3::new(0.18 * angle.cos(), up, 0.18 * angle.sin());
            return (*foot + at, code(Vec3::new(0.3, 0.22, 0.15)));
        }
        let reach = 0.28 * height;
        // More leaves outside than within.
        let at = draw.on_ball() * reach * draw.next().cbrt().sqrt();
        let green = draw.between(0.3, 0.6) as f32;
        let at = *foot + DVec3::new(at.x, 0.68 * height + 1.2 * at.y, at.z);
        (at, code(Vec3::new(0.5 * green, green, 0.25 * green)))
    }
}
