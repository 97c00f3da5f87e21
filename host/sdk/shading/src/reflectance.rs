//! The environment BRDF of GGX as a table: how much a surface reflects of light from everywhere.
//!
//! With Schlick's Fresnel term the share is `f0 * scale + bias`; both depend on the cosine to the
//! eye and the roughness alone.
//!
//! Source: Karis 2013, "Real Shading in Unreal Engine 4"; masking by Heitz 2014, equation 99.

use surfelshop_api::glam::DVec3;

/// Entries along each side of the table. Between them the interpolation is off by less than a
/// hundredth of the value (`the_table_is_within_a_hundredth_of_the_integral`).
pub(crate) const TABLE_SIDE: usize = 32;

/// Samples of the lobe for each entry.
const N_SAMPLES: u32 = 512;

/// Scale and bias by the root of the cosine (fastest) and the roughness, both from 0 to 1.
pub(crate) fn table() -> Vec<[f32; 2]> {
    let at = |k: usize| k as f64 / (TABLE_SIDE - 1) as f64;
    // The same for each entry: angles take most of the time where there are no instructions for them.
    let disc = even_on_disc(N_SAMPLES);
    let entry = |i: usize| {
        // Grazing eyes, where it is steepest, get the most entries.
        let cosine = at(i % TABLE_SIDE).powi(2);
        let [scale, bias] = scale_and_bias(cosine, at(i / TABLE_SIDE), &disc);
        [scale as f32, bias as f32]
    };
    (0..TABLE_SIDE * TABLE_SIDE).map(entry).collect()
}

/// The table, to be asked on the CPU.
#[derive(Clone, Debug)]
pub struct Reflectance {
    table: Vec<[f32; 2]>,
}

impl Default for Reflectance {
    fn default() -> Self {
        Self { table: table() }
    }
}

impl Reflectance {
    /// Scale and bias of the reflectance at a right angle, for the cosine to the eye and a roughness,
    /// both in [0, 1]: what `scale_and_bias` of the shader gives.
    #[must_use]
    pub fn at(&self, cosine: f32, roughness: f32) -> [f32; 2] {
        let last = (TABLE_SIDE - 1) as f32;
        let place = |v: f32| {
            let p = v.clamp(0.0, 1.0) * last;
            let low = (p as usize).min(TABLE_SIDE - 2);
            (low, p - low as f32)
        };
        let ((x, across), (y, along)) = (place(cosine.max(0.0).sqrt()), place(roughness));
        let entry = |x: usize, y: usize| self.table[y * TABLE_SIDE + x];
        [0, 1].map(|k| {
            let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
            let row = |y: usize| mix(entry(x, y)[k], entry(x + 1, y)[k], across);
            mix(row(y), row(y + 1), along)
        })
    }
}

/// Points spread evenly over the unit disc.
///
/// Source: van der Corput 1935, "Verteilungsfunktionen", for the angles.
fn even_on_disc(n: u32) -> Vec<[f64; 2]> {
    let point = |i: u32| {
        let radius = ((f64::from(i) + 0.5) / f64::from(n)).sqrt();
        let phi = std::f64::consts::TAU * f64::from(i.reverse_bits()) / 2f64.powi(32);
        [radius * phi.cos(), radius * phi.sin()]
    };
    (0..n).map(point).collect()
}

/// The two integrals, sampled by the normals of microfacets that the eye sees at these points of
/// the unit disc; a mirror at roughness 0.
///
/// Source: Heitz 2018, "Sampling the GGX Distribution of Visible Normals".
pub(crate) fn scale_and_bias(cosine: f64, roughness: f64, disc: &[[f64; 2]]) -> [f64; 2] {
    // At exactly grazing eyes the integrand is 0 / 0; its limit is that of a little more.
    let v = cosine.max(1e-4);
    let a = (roughness * roughness).max(1e-5);
    let eye = DVec3::new((1.0 - v * v).sqrt(), 0.0, v);
    let stretched = DVec3::new(a * eye.x, 0.0, eye.z).normalize_or(DVec3::Z);
    let across = DVec3::Y;
    let along = stretched.cross(across);
    let smith = |cosine: f64| (a * a + (1.0 - a * a) * cosine * cosine).sqrt();
    let (mut scale, mut bias) = (0.0, 0.0);
    let s = 0.5 * (1.0 + stretched.z);
    for &[t1, t2] in disc {
        let t2 = (1.0 - s) * (1.0 - t1 * t1).sqrt() + s * t2;
        let up = (1.0 - t1 * t1 - t2 * t2).max(0.0).sqrt();
        let facet = t1 * across + t2 * along + up * stretched;
        let half = DVec3::new(a * facet.x, a * facet.y, facet.z.max(0.0)).normalize_or(DVec3::Z);
        let eye_half = eye.dot(half).max(0.0);
        let light = 2.0 * eye_half * half.z - v;
        if light <= 0.0 {
            continue;
        }
        // What remains of D G F over the density: masking of light and eye over that of the eye.
        let weight = light * (v + smith(v)) / (light * smith(v) + v * smith(light));
        let schlick = (1.0 - eye_half).powi(5);
        scale += weight * (1.0 - schlick);
        bias += weight * schlick;
    }
    [scale, bias].map(|sum| (sum / disc.len() as f64).min(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mirror_reflects_everything_and_roughness_loses_some() {
        let (disc, many) = (even_on_disc(N_SAMPLES), even_on_disc(16_384));
        let [scale, bias] = scale_and_bias(1.0, 0.0, &disc);
        assert!((scale - 1.0).abs() < 1e-6 && bias.abs() < 1e-6);
        // Schlick's own value at 60 degrees.
        let [scale, bias] = scale_and_bias(0.5, 0.0, &disc);
        assert!((bias - 0.5f64.powi(5)).abs() < 1e-4 && (scale + bias - 1.0).abs() < 1e-4);
        let share = |r: f64| scale_and_bias(0.5, r, &many).iter().sum::<f64>();
        assert!(share(0.2) > share(0.6) && share(0.6) > share(1.0) && share(1.0) > 0.4);
    }

    #[test]
    fn the_table_is_within_a_hundredth_of_the_integral() {
        let (table, many) = (table(), even_on_disc(1 << 18));
        let at = |x: f64, y: f64| {
            let (i, j) = ((x.min(30.99)) as usize, (y.min(30.99)) as usize);
            let (fx, fy) = (x - i as f64, y - j as f64);
            let t = |i: usize, j: usize| {
                let [scale, bias] = table[j * TABLE_SIDE + i];
                f64::from(scale + bias)
            };
            (t(i, j) * (1.0 - fx) + t(i + 1, j) * fx) * (1.0 - fy)
                + (t(i, j + 1) * (1.0 - fx) + t(i + 1, j + 1) * fx) * fy
        };
        for (x, y) in [(3.5, 6.5), (10.5, 3.5), (15.5, 15.5), (30.5, 30.5), (5.5, 25.5), (1.5, 9.5)]
        {
            let exact: f64 = scale_and_bias((x / 31.0f64).powi(2), y / 31.0, &many).iter().sum();
            let found = at(x, y);
            assert!((found - exact).abs() < 0.01 * exact, "{x} {y}: {found} for {exact}");
        }
    }
}
