//! Clouds of Gaussian splats: how they are read, moved and written.

mod converting;
mod files;
mod motion;
mod reading;

use super::Ply;
use crate::Cloud;
use glam::{DMat3, DQuat, DVec3};
use surfelshop_api::columns::{OPACITY, SH, SPLAT_ROTATION, SPLAT_SCALE};
use surfelshop_geometry::harmonics::basis;

/// Splats as trainers write them: properties and rows.
pub(super) struct Trained {
    pub(super) properties: Vec<String>,
    pub(super) rows: Vec<Vec<f64>>,
}

/// Numbers between -1 and 1 in no order.
fn noise(seed: usize) -> f64 {
    ((seed as f64 * 12.9898).sin() * 43_758.545_3).fract()
}

impl Trained {
    /// So many splats with so many scales and harmonics up to an order.
    pub(super) fn new(n: usize, n_scales: usize, order: usize) -> Self {
        let n_rest = 3 * ((order + 1) * (order + 1) - 1);
        let numbered = |name: &str, n: usize| (0..n).map(|i| format!("{name}_{i}")).collect();
        let own = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect();
        let groups: [Vec<String>; 6] = [
            own(&["x", "y", "z", "nx", "ny", "nz"]),
            numbered("f_dc", 3),
            numbered("f_rest", n_rest),
            own(&["opacity"]),
            numbered("scale", n_scales),
            numbered("rot", 4),
        ];
        let properties = groups.concat();
        let row = |i: usize| -> Vec<f64> {
            let value = |(j, name): (usize, &String)| match name.as_str() {
                "nx" | "ny" | "nz" => 0.0,
                "opacity" => 4.0 * noise(i * 97 + j),
                name if name.starts_with("scale") => noise(i * 97 + j) - 3.0,
                _ => noise(i * 97 + j),
            };
            properties.iter().enumerate().map(value).collect()
        };
        let rows = (0..n).map(row).collect();
        Self { properties, rows }
    }

    /// The place of a property.
    pub(super) fn place(&self, name: &str) -> usize {
        self.properties.iter().position(|own| own == name).unwrap()
    }

    pub(super) fn set(&mut self, splat: usize, name: &str, value: f64) {
        let place = self.place(name);
        self.rows[splat][place] = value;
    }

    pub(super) fn get(&self, splat: usize, name: &str) -> f64 {
        f64::from(self.rows[splat][self.place(name)] as f32)
    }

    /// With another property, the same of all splats.
    pub(super) fn and(mut self, name: &str, value: f64) -> Self {
        self.properties.push(name.to_owned());
        self.rows.iter_mut().for_each(|row| row.push(value));
        self
    }

    pub(super) fn ply(&self, encoding: &'static str, kind: &str) -> Ply {
        let properties = self.properties.iter().map(|name| format!("{kind} {name}"));
        let properties: Vec<String> = properties.collect();
        let properties: Vec<&str> = properties.iter().map(String::as_str).collect();
        Ply::new(encoding).element("vertex", &properties, &self.rows)
    }

    /// What a splat looks like in a direction, with the basis and the order of the file.
    ///
    /// Source: the constants of the trainer's renderer.
    pub(super) fn color(&self, splat: usize, order: usize, d: DVec3) -> DVec3 {
        let DVec3 { x, y, z } = d;
        let [xx, yy, zz] = [x * x, y * y, z * z];
        let basis = [
            -0.488_602_511_902_919_9 * y,
            0.488_602_511_902_919_9 * z,
            -0.488_602_511_902_919_9 * x,
            1.092_548_430_592_079_2 * x * y,
            -1.092_548_430_592_079_2 * y * z,
            0.315_391_565_252_520_05 * (2.0 * zz - xx - yy),
            -1.092_548_430_592_079_2 * x * z,
            0.546_274_215_296_039_6 * (xx - yy),
            -0.590_043_589_926_643_5 * y * (3.0 * xx - yy),
            2.890_611_442_640_554 * x * y * z,
            -0.457_045_799_464_465_8 * y * (4.0 * zz - xx - yy),
            0.373_176_332_590_115_4 * z * (2.0 * zz - 3.0 * xx - 3.0 * yy),
            -0.457_045_799_464_465_8 * x * (4.0 * zz - xx - yy),
            1.445_305_721_320_277 * z * (xx - yy),
            -0.590_043_589_926_643_5 * x * (xx - 3.0 * yy),
        ];
        let n = (order + 1) * (order + 1) - 1;
        let channel = |channel: usize| {
            let dc = 0.282_094_791_773_878_14 * self.get(splat, &format!("f_dc_{channel}"));
            let of = |i: usize| self.get(splat, &format!("f_rest_{}", channel * n + i)) * basis[i];
            0.5 + dc + (0..n).map(of).sum::<f64>()
        };
        DVec3::new(channel(0), channel(1), channel(2))
    }
}

/// What a splat of a cloud looks like in a direction.
pub(super) fn color(cloud: &Cloud, splat: usize, d: DVec3) -> DVec3 {
    let y = basis(d);
    let mut sum = DVec3::splat(0.5);
    for (order, name) in SH.iter().enumerate() {
        let n = 3 * (2 * order + 1);
        let Some(own) = cloud.floats(name, n as u32).get(splat * n..(splat + 1) * n) else { break };
        for (c, y) in own.chunks_exact(3).zip(&y[order * order..]) {
            sum += *y * DVec3::new(c[0].into(), c[1].into(), c[2].into());
        }
    }
    sum
}

/// The covariance of a splat.
pub(super) fn covariance(cloud: &Cloud, splat: usize) -> DMat3 {
    let q = &cloud.floats(SPLAT_ROTATION, 4)[4 * splat..];
    let turn =
        DMat3::from_quat(DQuat::from_xyzw(q[0].into(), q[1].into(), q[2].into(), q[3].into()));
    let n = cloud.column(SPLAT_SCALE).unwrap().components() as usize;
    let scales = &cloud.floats(SPLAT_SCALE, n as u32)[n * splat..];
    let scale = |axis: usize| if axis < n { f64::from(scales[axis]) } else { 0.0 };
    let squares = DVec3::new(scale(0), scale(1), scale(2)).powf(2.0);
    turn * DMat3::from_diagonal(squares) * turn.transpose()
}

/// Names of the columns of splats, without harmonics.
pub(super) const OWN: [&str; 3] = [OPACITY, SPLAT_SCALE, SPLAT_ROTATION];

/// Directions all around.
pub(super) fn directions() -> impl Iterator<Item = DVec3> {
    (0..20).map(|i| DVec3::new(noise(i), noise(i + 100), noise(i + 200)).normalize_or(DVec3::Z))
}
