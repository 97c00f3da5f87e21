//! A scene of Gaussian splats: a trefoil knot of translucent Gaussians over a soft ground, as trainers write it.

use glam::{Mat3, Quat, Vec3};
use std::path::{Path, PathBuf};
use surfelshop_session::output::files;

/// Gaussians along the knot, around it, and on the ground.
const ALONG: u32 = 620;
const AROUND: u32 = 36;
const ON_GROUND: u32 = 5000;

/// The radius of the tube.
const TUBE: f32 = 0.34;

/// The factor of the constant harmonic. Source: Kerbl et al. 2023, the published code.
const HARMONIC: f32 = 0.282_094_79;

/// The properties of a splat, all single precision.
const PROPERTIES: [&str; 14] = [
    "x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2",
    "rot_0", "rot_1", "rot_2", "rot_3",
];

/// A Gaussian.
struct Splat {
    place: Vec3,
    color: Vec3,
    opacity: f32,
    /// Standard deviations along the columns of `axes`.
    sizes: Vec3,
    axes: Mat3,
}

/// A number in [0, 1) that looks random, always the same for the same numbers.
fn noise(i: u32, salt: u32) -> f32 {
    let mut bits = i.wrapping_mul(0x9e37_79b9) ^ salt.wrapping_mul(0x85eb_ca6b);
    bits = (bits ^ (bits >> 16)).wrapping_mul(0x7feb_352d);
    bits = (bits ^ (bits >> 15)).wrapping_mul(0x846c_a68b);
    (bits ^ (bits >> 16)) as f32 * 2f32.powi(-32)
}

/// The middle of the tube, `t` once around is 2 pi.
fn knot(t: f32) -> Vec3 {
    let out = 2.0 + (3.0 * t).cos();
    Vec3::new(out * (2.0 * t).cos(), 1.05 * (3.0 * t).sin() + 1.8, out * (2.0 * t).sin()) * 0.62
}

/// Evenly changing hues, neither black nor glaring.
fn hue(t: f32) -> Vec3 {
    let wave = |shift: f32| 0.55 + 0.38 * (std::f32::consts::TAU * (t + shift)).cos();
    Vec3::new(wave(0.0), wave(0.67), wave(0.33))
}

/// Right-handed axes, the third along `normal`.
fn axes(along: Vec3, normal: Vec3) -> Mat3 {
    let normal = normal.normalize_or(Vec3::Y);
    let along = (along - normal * along.dot(normal)).normalize_or(normal.any_orthonormal_vector());
    Mat3::from_cols(along, normal.cross(along), normal)
}

fn tube(splats: &mut Vec<Splat>) {
    for i in 0..ALONG {
        for j in 0..AROUND {
            let number = i * AROUND + j;
            let t = std::f32::consts::TAU * (i as f32 + noise(number, 1)) / ALONG as f32;
            let turn = std::f32::consts::TAU * (j as f32 + noise(number, 2)) / AROUND as f32;
            let along = (knot(t + 1e-3) - knot(t - 1e-3)).normalize_or(Vec3::X);
            // The knot is nowhere upright.
            let side = along.cross(Vec3::Y).normalize_or(Vec3::X);
            let normal = side * turn.cos() + along.cross(side) * turn.sin();
            let place = knot(t) + normal * TUBE * (0.9 + 0.1 * noise(number, 3));
            // Lighter from above, as a sky would light it; stripes wind around the tube.
            let sky = 0.62 + 0.38 * normal.y;
            let stripe = 0.82 + 0.18 * (3.0 * turn + 14.0 * t).sin();
            let color = hue(t / std::f32::consts::TAU) * sky * stripe;
            let opacity = if noise(number, 4) < 0.2 { 0.45 } else { 0.9 };
            let sizes = Vec3::new(0.045, 0.03, 0.006) * (0.7 + 0.6 * noise(number, 5));
            splats.push(Splat { place, color, opacity, sizes, axes: axes(along, normal) });
        }
    }
}

fn ground(splats: &mut Vec<Splat>) {
    for i in 0..ON_GROUND {
        let out = 3.4 * noise(i, 6).sqrt();
        let turn = std::f32::consts::TAU * noise(i, 7);
        let place = Vec3::new(out * turn.cos(), 0.02 * noise(i, 8), out * turn.sin());
        // The shadow of the knot, and a soft edge.
        let under = 1.0 - 0.35 * (-((out - 1.3) / 0.6).powi(2)).exp();
        let color = Vec3::new(0.78, 0.76, 0.73) * under * (0.92 + 0.08 * noise(i, 9));
        let opacity = 0.75 * (1.0 - (out / 3.4).powi(4)).max(0.02);
        let sizes = Vec3::new(0.11, 0.11, 0.008);
        splats.push(Splat { place, color, opacity, sizes, axes: axes(Vec3::X, Vec3::Y) });
    }
}

/// The numbers of a splat, as trainers write them.
fn record(splat: &Splat) -> [f32; 14] {
    let Splat { place, color, opacity, sizes, axes } = splat;
    let harmonics = (*color - Vec3::splat(0.5)) / HARMONIC;
    let opacity = opacity.clamp(0.01, 0.99);
    let logit = (opacity / (1.0 - opacity)).ln();
    let turn = Quat::from_mat3(axes);
    let [x, y, z] = place.to_array();
    let [red, green, blue] = harmonics.to_array();
    let [a, b, c] = sizes.map(f32::ln).to_array();
    [x, y, z, red, green, blue, logit, a, b, c, turn.w, turn.x, turn.y, turn.z]
}

/// The scene beside the cloud: seen from outside, since the knot has a room within.
const SCENE: &str = "# A Surfelshop scene: angles in degrees, paths from this folder.
format = 1
background = \"#23262b\"
antialias = 16

[camera]
eye = [1.6, 4.1, 8.6]
target = [0.0, 0.85, 0.0]
fov = 35.0

[[clouds]]
path = \"gaussian-knot.ply\"
";

/// Writes the cloud as binary PLY, and the scene beside it; returns the scene.
pub(super) fn make(folder: &Path) -> anyhow::Result<PathBuf> {
    let mut splats = Vec::new();
    tube(&mut splats);
    ground(&mut splats);
    let mut bytes = b"ply\nformat binary_little_endian 1.0\n".to_vec();
    bytes.extend(format!("element vertex {}\n", splats.len()).bytes());
    for name in PROPERTIES {
        bytes.extend(format!("property float {name}\n").bytes());
    }
    bytes.extend(b"end_header\n");
    for splat in &splats {
        bytes.extend(record(splat).into_iter().flat_map(f32::to_le_bytes));
    }
    write(&folder.join("gaussian-knot.ply"), &bytes)?;
    let scene = folder.join("gaussian-knot.scene.toml");
    write(&scene, SCENE.as_bytes())?;
    Ok(scene)
}

/// Writes a file, unless it is there already: it may be open, and what is read is not written.
fn write(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    match std::fs::read(path) {
        Ok(there) if there == bytes => Ok(()),
        _ => files::write_whole(path, bytes),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_cloud::ReadOptions;

    #[test]
    fn the_scene_is_read_as_gaussians() {
        let folder = tempfile::tempdir().unwrap();
        let scene = make(folder.path()).unwrap();
        let path = scene.with_file_name("gaussian-knot.ply");
        let first = std::fs::read(&path).unwrap();
        make(folder.path()).unwrap();
        assert!(first == std::fs::read(&path).unwrap(), "it is the same each time");
        let loaded = surfelshop_cloud::read(&path, &ReadOptions::default()).unwrap();
        assert_eq!(loaded.cloud.len() as u32, ALONG * AROUND + ON_GROUND);
        for column in ["opacity", "splat_scale", "splat_rotation", "sh_0"] {
            assert!(loaded.cloud.column(column).is_some(), "{column}");
        }
        assert!(loaded.summary.warnings.is_empty(), "{:?}", loaded.summary.warnings);
    }
}
