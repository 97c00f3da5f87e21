//! Which side normals face: shapes whose right sides are known.

use super::cloud::{Random, dumped};
use glam::{DVec3, Vec3};
use surfelshop_geometry::sides::{Hints, by_visibility};
use surfelshop_geometry::{Neighbours, normals, silent};

/// Points of each shape.
const POINTS: usize = 60_000;

/// A shape with the normals that face what can be seen.
struct Shape {
    name: &'static str,
    points: Vec<Vec3>,
    normals: Vec<Vec3>,
    /// What its file would say is up.
    up: Option<Vec3>,
}

impl Shape {
    fn new(name: &'static str) -> Self {
        Self { name, points: Vec::new(), normals: Vec::new(), up: None }
    }

    fn push(&mut self, point: DVec3, normal: DVec3) {
        self.points.push(point.as_vec3());
        self.normals.push(normal.as_vec3());
    }

    /// The walls of a box, which face outwards or inwards; `floor` says whether it has one.
    fn cuboid(
        &mut self,
        [low, high]: [DVec3; 2],
        faces: f64,
        floor: bool,
        n: usize,
        random: &mut Random,
    ) {
        let size = high - low;
        let areas = [size.y * size.z, size.x * size.z, size.x * size.y];
        let total: f64 = 2.0 * areas.iter().sum::<f64>();
        for _ in 0..n {
            let mut at = random.unit() * total;
            let mut side = 0;
            while side < 5 && at > areas[side / 2] {
                at -= areas[side / 2];
                side += 1;
            }
            if side == 4 && !floor {
                continue;
            }
            let mut point = low + size * DVec3::new(random.unit(), random.unit(), random.unit());
            let mut normal = DVec3::ZERO;
            let axis = side / 2;
            (point[axis], normal[axis]) =
                if side % 2 == 0 { (low[axis], -faces) } else { (high[axis], faces) };
            self.push(point, normal);
        }
    }

    fn ball(&mut self, radius: f64, faces: f64, n: usize, random: &mut Random) {
        for _ in 0..n {
            let at = random.in_ball().normalize_or(DVec3::Z);
            self.push(at * radius, at * faces);
        }
    }
}

fn shapes() -> Vec<Shape> {
    let mut random = Random::new(11);
    let random = &mut random;
    let mut body = Shape::new("closed body");
    body.cuboid([DVec3::ZERO, DVec3::new(1.0, 0.6, 0.4)], 1.0, true, POINTS, random);
    let mut hollow = Shape::new("two nested shells");
    hollow.ball(1.0, 1.0, POINTS * 5 / 9, random);
    hollow.ball(0.9, -1.0, POINTS * 4 / 9, random);
    let mut plate = Shape::new("thin plate");
    plate.cuboid([DVec3::ZERO, DVec3::new(1.0, 1.0, 0.02)], 1.0, true, POINTS, random);
    let mut room = Shape::new("room from inside");
    room.cuboid([DVec3::ZERO, DVec3::new(6.0, 4.0, 2.6)], -1.0, true, POINTS * 3 / 4, random);
    for corner in [DVec3::new(1.0, 1.0, 0.0), DVec3::new(3.5, 0.4, 0.0), DVec3::new(4.2, 2.6, 0.0)]
    {
        let size = DVec3::new(1.2, 0.8, 0.75);
        room.cuboid([corner, corner + size], 1.0, false, POINTS / 12, random);
    }
    room.up = Some(Vec3::Z);
    let mut land = Shape::new("open land");
    for _ in 0..POINTS {
        let (x, y) = (8.0 * random.unit(), 8.0 * random.unit());
        let (sx, cx) = (1.3 * x).sin_cos();
        let (sy, cy) = (0.9 * y).sin_cos();
        let normal = DVec3::new(-0.5 * 1.3 * cx * cy, 0.5 * 0.9 * sx * sy, 1.0);
        land.push(DVec3::new(x, y, 0.5 * sx * cy), normal.normalize_or(DVec3::Z));
    }
    land.up = Some(Vec3::Z);
    vec![body, hollow, plate, room, land]
}

pub(super) fn run(folder: Option<&String>) -> anyhow::Result<()> {
    println!("share of normals that face the right side, percent");
    println!("shape               propagated  by visibility  certainty");
    for shape in shapes() {
        if let Some(folder) = folder {
            dumped(
                folder,
                &format!("sides_{}", shape.name.replace(' ', "_")),
                &shape.points,
                &shape.normals,
            )?;
        }
        let neighbours = Neighbours::build(&shape.points, &silent)?;
        let mut found =
            normals::estimate_with(&neighbours, normals::DEFAULT_NEIGHBOURS, &silent)?.normals;
        let right = |found: &[Vec3]| {
            let n = found.iter().zip(&shape.normals).filter(|(a, b)| a.dot(**b) > 0.0).count();
            100.0 * n as f64 / found.len().max(1) as f64
        };
        let propagated = right(&found);
        let hints = Hints { up: shape.up, ..Hints::default() };
        let sides = by_visibility(&shape.points, &mut found, &hints, &silent)?;
        println!(
            "{:<19} {propagated:>10.2} {:>14.2} {:>10.2}",
            shape.name,
            right(&found),
            sides.certainty
        );
    }
    Ok(())
}
