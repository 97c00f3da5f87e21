//! A picture's surface: normals and colours of each pixel, drawn by the program in a parallel projection.

use super::{Bench, drawn};
use glam::DVec3;
use surfelshop_api::params::srgb_to_linear;
use surfelshop_image::{Image, png};

/// Most pixels of a picture that is read.
const MOST_PIXELS: u64 = 1 << 24;

/// From where surfaces are seen: the preset three-quarter of the program.
const TOWARDS_CAMERA: DVec3 = DVec3::new(0.47, 0.342, 0.814);

/// What a picture shows.
pub(super) struct Surface {
    pub(super) size: u32,
    normals: Vec<Option<DVec3>>,
    albedo: Vec<DVec3>,
    /// The direction to the eye, the same everywhere.
    pub(super) to_eye: DVec3,
}

impl Surface {
    /// Draws a model of the entry.
    pub(super) fn of(bench: &Bench<'_, '_>, key: &str) -> anyhow::Result<Self> {
        for output in ["normal", "albedo"] {
            bench.run(&format!(
                "render {{{key}}} -r ewa-phong --orthographic --output {output} --bits 16 -o {{out}}/{output}.png"
            ))?;
        }
        let read = |name: &str| png::read(&bench.folder.join(name), MOST_PIXELS);
        let (normals, albedo) = (read("normal.png")?, read("albedo.png")?);
        let normal = |pixel: &[f32; 4]| {
            let n = DVec3::new(f64::from(pixel[0]), f64::from(pixel[1]), f64::from(pixel[2]));
            (pixel[3] > 0.5).then(|| (2.0 * n - 1.0).normalize_or(TOWARDS_CAMERA))
        };
        let color = |pixel: &[f32; 4]| {
            let linear = |c: f32| f64::from(srgb_to_linear(c));
            DVec3::new(linear(pixel[0]), linear(pixel[1]), linear(pixel[2]))
        };
        Ok(Self {
            size: bench.size(),
            normals: normals.data.as_chunks::<4>().0.iter().map(normal).collect(),
            albedo: albedo.data.as_chunks::<4>().0.iter().map(color).collect(),
            to_eye: TOWARDS_CAMERA.normalize_or_zero(),
        })
    }

    /// A ball that is seen from +z, with an odd number of pixels, so that a column of them has x = 0.
    pub(super) fn ball(size: u32) -> Self {
        let size = size | 1;
        let at = |i: u32| {
            let place = |k: u32| (f64::from(k) + 0.5) / f64::from(size) * 2.1 - 1.05;
            // The middle pixel has 0 itself, not what rounding leaves of it.
            let x = if i % size == size / 2 { 0.0 } else { place(i % size) };
            let y = -place(i / size);
            let square = 1.0 - x * x - y * y;
            (square > 0.0).then(|| DVec3::new(x, y, square.sqrt()))
        };
        let normals: Vec<_> = (0..size * size).map(at).collect();
        let albedo = vec![DVec3::ONE; normals.len()];
        Self { size, normals, albedo, to_eye: DVec3::Z }
    }

    /// The picture of a function of normal and albedo.
    pub(super) fn shaded(&self, light: impl Fn(DVec3, DVec3) -> DVec3 + Sync) -> Image {
        drawn(self.size, |x, y| {
            let at = (y * self.size + x) as usize;
            let normal = self.normals.get(at).copied().flatten()?;
            Some(light(normal, self.albedo[at]).to_array())
        })
    }

    /// The direction that a mirror shows at a normal.
    pub(super) fn mirrored(&self, normal: DVec3) -> DVec3 {
        2.0 * normal.dot(self.to_eye) * normal - self.to_eye
    }
}
