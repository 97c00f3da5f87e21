//! A scene of Gaussians as trainers write it, of any number: `surface gaussians COUNT OUT.ply`.
//!
//! A ball over a floor amid a ring of cubes, covered by flat anisotropic Gaussians of varying size and opacity, with
//! spherical harmonics of order 3, in no order: what times and errors of splatting are measured on.

use anyhow::Context as _;
use glam::{DVec3, Quat, Vec3};
use std::f64::consts::TAU;
use std::fs::File;
use std::io::{BufWriter, Write as _};

/// Area of all surfaces, scene units squared, about.
const AREA: f64 = 60.0;

/// Numbers that look random.
struct Random(u64);

impl Random {
    /// From 0 to below 1.
    fn next(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    /// Normally distributed.
    fn normal(&mut self) -> f64 {
        (-2.0 * (1.0 - self.next()).ln()).sqrt() * (TAU * self.next()).cos()
    }
}

pub(super) fn run(arguments: &[String]) -> anyhow::Result<()> {
    let [count, out] = arguments else {
        anyhow::bail!("expected how many and a file to write, found {arguments:?}");
    };
    let n: usize = count.parse().context(count.clone())?;
    let mut file = BufWriter::with_capacity(1 << 20, File::create(out)?);
    write!(file, "ply\nformat binary_little_endian 1.0\nelement vertex {n}\n")?;
    let fixed = |names: &str| names.split(' ').map(str::to_owned).collect::<Vec<_>>();
    let rest = (0..45).map(|i| format!("f_rest_{i}"));
    let names = fixed("x y z nx ny nz f_dc_0 f_dc_1 f_dc_2").into_iter().chain(rest);
    let last = fixed("opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3");
    for name in names.chain(last) {
        writeln!(file, "property float {name}")?;
    }
    writeln!(file, "end_header")?;
    let mut random = Random(1);
    let spacing = (AREA / n as f64).sqrt();
    for _ in 0..n {
        for value in gaussian(&mut random, spacing) {
            file.write_all(&value.to_le_bytes())?;
        }
    }
    file.flush()?;
    println!("{out}: {n} Gaussians");
    Ok(())
}

/// A place on a surface and its normal.
fn place(random: &mut Random) -> (DVec3, DVec3) {
    match (random.next() * 3.0) as u32 {
        0 => {
            let n = DVec3::new(random.normal(), random.normal(), random.normal())
                .normalize_or(DVec3::Z);
            (n, n)
        }
        1 => (DVec3::new(random.within(-3.0, 3.0), -1.0, random.within(-3.0, 3.0)), DVec3::Y),
        _ => {
            let angle = (random.next() * 12.0).floor() / 12.0 * TAU;
            let (axis, side) =
                ((random.next() * 3.0) as usize, [-1.0, 1.0][(random.next() * 2.0) as usize]);
            let mut on_cube = DVec3::new(
                random.within(-0.3, 0.3),
                random.within(-0.3, 0.3),
                random.within(-0.3, 0.3),
            );
            let mut normal = DVec3::ZERO;
            on_cube[axis] = 0.3 * side;
            normal[axis] = side;
            (DVec3::new(2.0 * angle.cos(), -0.7, 2.0 * angle.sin()) + on_cube, normal)
        }
    }
}

/// The properties of a Gaussian.
fn gaussian(random: &mut Random, spacing: f64) -> Vec<f32> {
    let (at, normal) = place(random);
    let off = 0.1 * spacing * random.normal();
    let at = at + normal * off;
    let spin = Quat::from_axis_angle(Vec3::Z, (random.next() * TAU) as f32);
    let rotation = Quat::from_rotation_arc(Vec3::Z, normal.as_vec3()) * spin;
    let color = (at * 3.0).to_array();
    let shade = |i: usize| 0.4 * (color[i] + 2.0 * i as f64).sin() / 0.282_094_8;
    let across = |random: &mut Random| (spacing * 0.8 * (0.45 * random.normal()).exp()).ln();
    let mut values: Vec<f64> = at.to_array().to_vec();
    values.extend([0.0; 3]);
    values.extend([0, 1, 2].map(shade));
    values.extend((0..45).map(|_| 0.08 * random.normal()));
    values.push(2.0 + 1.5 * random.normal());
    values.extend([across(random), across(random), (spacing * 0.12).ln()]);
    let [x, y, z, w] = rotation.to_array().map(f64::from);
    values.extend([w, x, y, z]);
    values.into_iter().map(|value| value as f32).collect()
}
