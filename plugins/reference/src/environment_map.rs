//! The environment map, with importance sampling of its directions.

use crate::random::Random;
use surfelshop_api::glam::{DMat3, Mat3, Vec2, Vec3};
use surfelshop_api::{Environment, Traced};

/// An environment with its texels.
pub(crate) struct EnvironmentMap<'a> {
    texels: &'a [[f32; 3]],
    side: usize,
    probe_from_world: Mat3,
    gain: f32,
    cells: &'a CellDistribution,
}

/// How much light comes from each cell between four texels: sums up to each.
pub(crate) struct CellDistribution {
    sums: Vec<f64>,
    side: usize,
}

impl CellDistribution {
    /// The cells of a map of `side` squared texels; none of an empty one.
    pub(crate) fn new(texels: &[[f32; 3]]) -> Self {
        let side = texels.len().isqrt();
        let across = side.saturating_sub(1);
        let mut sums = Vec::with_capacity(across * across);
        let mut sum = 0.0;
        let luminance = |i: usize| {
            let [r, g, b] = texels[i];
            f64::from(0.2126 * r + 0.7152 * g + 0.0722 * b)
        };
        for y in 0..across {
            for x in 0..across {
                let i = y * side + x;
                let light = [i, i + 1, i + side, i + side + 1].map(luminance);
                let middle = (Vec2::new(x as f32, y as f32) + 0.5) * (2.0 / across as f32) - 1.0;
                sum += 0.25 * light.iter().sum::<f64>() * f64::from(solid_angle(middle));
                sums.push(sum);
            }
        }
        Self { sums, side }
    }

    /// Whether any light comes from anywhere.
    pub(crate) fn is_lit(&self) -> bool {
        self.sums.last().is_some_and(|sum| *sum > 0.0)
    }

    /// Probability of a cell.
    fn share(&self, cell: usize) -> f64 {
        let before = if cell == 0 { 0.0 } else { self.sums[cell - 1] };
        (self.sums[cell] - before) / self.sums.last().copied().unwrap_or(1.0)
    }

    fn across(&self) -> usize {
        self.side - 1
    }
}

/// Solid angle of a unit of the map's square [-1, 1]^2 at a place.
///
/// A point q of the octahedron |x| + |y| + |z| = 1 over the place is |q| away; its face, sqrt(3)
/// times as large as what it covers of the square, is seen at a cosine of 1 / (sqrt(3) |q|).
fn solid_angle(place: Vec2) -> f32 {
    let q = on_octahedron(place);
    q.length_recip().powi(3)
}

/// The point of the octahedron at a place of the square.
fn on_octahedron(p: Vec2) -> Vec3 {
    let z = 1.0 - p.x.abs() - p.y.abs();
    let fold = (-z).max(0.0);
    Vec3::new(p.x - fold.copysign(p.x), p.y - fold.copysign(p.y), z)
}

/// The place of a direction in the square.
fn place(direction: Vec3) -> Vec2 {
    let d = direction / (direction.x.abs() + direction.y.abs() + direction.z.abs());
    if d.z >= 0.0 {
        return Vec2::new(d.x, d.y);
    }
    let sign = |v: f32| 1f32.copysign(v);
    Vec2::new((1.0 - d.y.abs()) * sign(d.x), (1.0 - d.x.abs()) * sign(d.y))
}

impl<'a> EnvironmentMap<'a> {
    /// The environment of a frame; `None` where there is none.
    pub(crate) fn new(
        environment: Option<&Environment>,
        scene: &Traced<'a>,
        cells: &'a CellDistribution,
    ) -> Option<Self> {
        let environment = environment?;
        let narrowed = |m: DMat3| m.as_mat3();
        (cells.side > 1 && cells.is_lit()).then(|| Self {
            texels: scene.texels,
            side: cells.side,
            probe_from_world: narrowed(environment.probe_from_world),
            gain: environment.gain as f32,
            cells,
        })
    }

    /// Radiance from a world direction.
    pub(crate) fn radiance(&self, direction: Vec3) -> Vec3 {
        let last = (self.side - 1) as f32;
        let at = (place(self.probe_from_world * direction) * 0.5 + 0.5) * last;
        let low = at.floor().clamp(Vec2::ZERO, Vec2::splat(last - 1.0));
        let (x, y, share) = (low.x as usize, low.y as usize, at - low);
        let texel = |x: usize, y: usize| Vec3::from(self.texels[y * self.side + x]);
        let row = |y: usize| texel(x, y).lerp(texel(x + 1, y), share.x);
        row(y).lerp(row(y + 1), share.y) * self.gain
    }

    /// A world direction that much light comes from, and the density of such directions there.
    pub(crate) fn sample(&self, random: &mut Random) -> (Vec3, f32) {
        let total = self.cells.sums.last().copied().unwrap_or(0.0);
        let target = f64::from(random.unit()) * total;
        let last = self.cells.sums.len() - 1;
        let cell = self.cells.sums.partition_point(|sum| *sum <= target).min(last);
        let across = self.cells.across();
        let corner = Vec2::new((cell % across) as f32, (cell / across) as f32);
        let at = (corner + random.square()) * (2.0 / across as f32) - 1.0;
        let direction = on_octahedron(at).normalize_or(Vec3::Z);
        (self.probe_from_world.transpose() * direction, self.density_at(cell, at))
    }

    /// The density of directions that [`sample`](Self::sample) gives.
    pub(crate) fn density(&self, direction: Vec3) -> f32 {
        let across = self.cells.across();
        let at = place(self.probe_from_world * direction);
        let index = |v: f32| (((v * 0.5 + 0.5) * across as f32) as usize).min(across - 1);
        self.density_at(index(at.y) * across + index(at.x), at)
    }

    fn density_at(&self, cell: usize, at: Vec2) -> f32 {
        let across = self.cells.across() as f32;
        self.cells.share(cell) as f32 * across * across * 0.25 / solid_angle(at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lopsided() -> Vec<[f32; 3]> {
        let side = 17;
        (0..side * side)
            .map(|i| if i == 40 { [300.0; 3] } else { [0.5 + (i % side) as f32 * 0.1; 3] })
            .collect()
    }

    #[test]
    fn places_and_directions_belong_together() {
        let mut random = Random::of(1, [0, 0], 0);
        for _ in 0..1000 {
            let at = random.square() * 2.0 - 1.0;
            let direction = on_octahedron(at).normalize_or(Vec3::Z);
            assert!((place(direction) - at).length() < 1e-5, "{at}");
        }
    }

    /// Sampled in proportion, means are those of directions all over the sphere. 200,000 samples; the
    /// lopsided map's own deviation is below 40 evenly and 2 in proportion.
    #[test]
    fn samples_in_proportion_have_the_same_mean() {
        let texels = lopsided();
        let cells = CellDistribution::new(&texels);
        let scene = Traced { clouds: &[], texels: &texels };
        let environment = Environment {
            probe_from_world: DMat3::from_rotation_y(0.7),
            gain: 2.0,
            ..Environment::default()
        };
        let environment_map = EnvironmentMap::new(Some(&environment), &scene, &cells).unwrap();
        let mut random = Random::of(3, [5, 7], 0);
        let n = 200_000;
        let (mut evenly, mut weighted) = (0.0, 0.0);
        for _ in 0..n {
            let z = 1.0 - 2.0 * random.unit();
            let (sin, cos) = (std::f32::consts::TAU * random.unit()).sin_cos();
            let r = (1.0 - z * z).max(0.0).sqrt();
            evenly += f64::from(environment_map.radiance(Vec3::new(r * cos, r * sin, z)).x)
                * 4.0
                * std::f64::consts::PI;
            let (direction, density) = environment_map.sample(&mut random);
            weighted += f64::from(environment_map.radiance(direction).x / density);
            let again = environment_map.density(direction);
            assert!((again - density).abs() < 0.01 * density, "{again} {density}");
        }
        let (evenly, weighted) = (evenly / f64::from(n), weighted / f64::from(n));
        assert!((evenly - weighted).abs() < 0.03 * weighted, "{evenly} {weighted}");
    }

    #[test]
    fn darkness_and_nothing_have_no_sky() {
        for texels in [vec![], vec![[0.0; 3]; 16], vec![[1.0; 3]]] {
            let cells = CellDistribution::new(&texels);
            let scene = Traced { clouds: &[], texels: &texels };
            assert!(EnvironmentMap::new(Some(&Environment::default()), &scene, &cells).is_none());
        }
    }
}
