//! Scenes of Gaussians, pictures of them, and how far pictures are apart.

pub mod reference;

use crate::stage;
use glam::{DVec3, Quat, Vec3};
use surfelshop_api::columns::{OPACITY, POSITION, SH, SPLAT_ROTATION, SPLAT_SCALE};
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_api::{CloudFacts, Scene, UnitKind, View};
use surfelshop_cloud::{Buffer, Cloud, Column};
use surfelshop_render::{Engine, RenderError, RenderRequest, Rendered, RendererView};
use surfelshop_runtime::plugins::Timeouts;

/// Numbers that look random.
struct Random(u64);

impl Random {
    /// From 0 to 1.
    fn unit(&mut self) -> f32 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / 16_777_216.0
    }

    /// Between two numbers.
    fn within(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }
}

/// The columns of Gaussians, before they become a cloud.
#[derive(Clone, Debug, Default)]
pub struct Gaussians {
    /// Scene units.
    pub positions: Vec<Vec3>,
    /// Standard deviations along the axes, scene units.
    pub scales: Vec<[f32; 3]>,
    /// Unit quaternions, x y z w.
    pub rotations: Vec<[f32; 4]>,
    /// At the centre, from 0 to 1.
    pub opacities: Vec<f32>,
    /// Spherical harmonics by order, 3 (2 l + 1) numbers of a Gaussian; no column where empty.
    pub harmonics: [Vec<f32>; 4],
}

impl Gaussians {
    /// Long, flat and round ones of all opacities in a ball of radius 1, up to twelve times as long as wide; colours that
    /// change with the direction by about as much as those of trained scenes.
    pub fn generated(n: usize) -> Self {
        let mut random = Random(5);
        let mut all = Self::default();
        while all.positions.len() < n {
            let position = Vec3::from_array([0; 3].map(|_| random.within(-1.0, 1.0)));
            if position.length() > 1.0 {
                continue;
            }
            let scale = [0; 3].map(|_| 0.008 * 12f32.powf(random.unit()));
            let turn = Quat::from_array([0; 4].map(|_| random.within(-1.0, 1.0)));
            let opacity = random.within(0.02, 1.0);
            let first = [0; 3].map(|_| random.within(-1.2, 1.2));
            all.push(position, scale, turn.normalize(), opacity, first);
            for l in 1..4 {
                let most = 0.4 / l as f32;
                all.harmonics[l].extend((0..6 * l + 3).map(|_| random.within(-most, most)));
            }
        }
        all
    }

    /// Adds one of one colour.
    pub fn push(
        &mut self,
        position: Vec3,
        scale: [f32; 3],
        turn: Quat,
        opacity: f32,
        harmonics: [f32; 3],
    ) {
        self.positions.push(position);
        self.scales.push(scale);
        self.rotations.push(turn.to_array());
        self.opacities.push(opacity);
        self.harmonics[0].extend(harmonics);
    }

    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// The same in another order.
    pub fn shuffled(&self) -> Self {
        let mut order: Vec<usize> = (0..self.len()).collect();
        let mut random = Random(99);
        for i in (1..order.len()).rev() {
            order.swap(i, (random.unit() * (i + 1) as f32) as usize);
        }
        let harmonics = |l: usize| {
            let n = 6 * l + 3;
            let of = |i: &usize| self.harmonics[l].iter().skip(i * n).take(n).copied();
            order.iter().flat_map(of).collect()
        };
        Self {
            positions: order.iter().map(|&i| self.positions[i]).collect(),
            scales: order.iter().map(|&i| self.scales[i]).collect(),
            rotations: order.iter().map(|&i| self.rotations[i]).collect(),
            opacities: order.iter().map(|&i| self.opacities[i]).collect(),
            harmonics: [0, 1, 2, 3].map(harmonics),
        }
    }

    /// A cloud of these columns.
    ///
    /// # Panics
    /// Where the columns are not equally long.
    #[must_use]
    pub fn cloud(&self) -> Cloud {
        let floats =
            |name: &str, n: u32, values: Vec<f32>| Column::new(name, n, Buffer::F32(values));
        let position = self.positions.iter().flat_map(Vec3::to_array).collect();
        let mut columns = vec![
            floats(POSITION, 3, position),
            floats(SPLAT_SCALE, 3, self.scales.as_flattened().to_vec()),
            floats(SPLAT_ROTATION, 4, self.rotations.as_flattened().to_vec()),
            floats(OPACITY, 1, self.opacities.clone()),
        ];
        for (l, values) in self.harmonics.iter().enumerate() {
            if !values.is_empty() || l == 0 {
                columns.push(floats(SH[l], 6 * l as u32 + 3, values.clone()));
            }
        }
        Cloud::new(DVec3::ZERO, columns).expect("columns are equally long")
    }
}

/// A renderer of the plugin.
///
/// # Panics
/// Where the plugin is not built.
#[must_use]
pub fn renderer(engine: &Engine, unit: &str) -> RendererView {
    let loaded = stage::built_unit("surfelshop_gaussian_splatting", UnitKind::Renderer, unit);
    let hosted = loaded.start(&engine.gpu().host_info(), &Timeouts::default());
    let hosted = hosted.expect("it starts");
    RendererView::new(hosted, unit).needing(&loaded.description.needs)
}

/// Facts of clouds that are shown together.
fn together(clouds: &[&Cloud]) -> CloudFacts {
    let each = || clouds.iter().map(|cloud| cloud.facts());
    CloudFacts {
        n_surfels: each().map(|facts| facts.n_surfels).sum(),
        bounds_min: each().map(|facts| facts.bounds_min).fold(DVec3::INFINITY, DVec3::min),
        bounds_max: each().map(|facts| facts.bounds_max).fold(DVec3::NEG_INFINITY, DVec3::max),
        columns: each().flat_map(|facts| facts.columns.clone()).collect(),
        objects: each().flat_map(|facts| facts.objects.clone()).collect(),
        colored: each().flat_map(|facts| facts.colored.clone()).collect(),
        clouds: each().flat_map(|facts| facts.clouds.clone()).collect(),
        ..CloudFacts::default()
    }
}

/// A frame of clouds that are shown together.
///
/// # Errors
/// Where the engine cannot draw it.
pub fn frame(
    engine: &mut Engine,
    renderer: &mut RendererView,
    clouds: &[&Cloud],
    view: View,
    values: &Values,
    outputs: &[Output],
) -> Result<Rendered, RenderError> {
    let views: Vec<_> = clouds.iter().map(|cloud| cloud.view()).collect();
    let request = RenderRequest {
        clouds: &views,
        facts: &together(clouds),
        scene: &Scene::default(),
        view,
        values,
        outputs,
        frame_index: 0,
        environment: None,
        stride: 1,
        detail_px: 0.0,
        parts: None,
        eye_dome: None,
    };
    engine.render(renderer, &request)
}

/// Pixels of a picture.
///
/// # Panics
/// Where the frame lacks it.
#[must_use]
pub fn pixels(frame: &Rendered, output: &Output) -> Vec<[f32; 4]> {
    frame.image(output).expect("it was asked for").data.as_chunks::<4>().0.to_vec()
}

/// sRGB-encoded light, as a screen shows it.
#[must_use]
pub fn encoded(light: f64) -> f64 {
    if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 }
}

/// Decibels between two colour pictures as a screen shows them, white being 1, and between their coverages.
///
/// # Panics
/// Where they are not equally large.
#[must_use]
pub fn decibels(found: &[[f32; 4]], expected: &[[f64; 4]]) -> [f64; 2] {
    assert_eq!(found.len(), expected.len());
    let mut squares = [0.0; 2];
    for (found, expected) in found.iter().zip(expected) {
        for channel in 0..3 {
            let (found, expected) = (f64::from(found[channel]), expected[channel]);
            squares[0] += (encoded(found) - encoded(expected)).powi(2) / 3.0;
        }
        squares[1] += (f64::from(found[3]) - expected[3]).powi(2);
    }
    squares.map(|sum| -10.0 * (sum / found.len() as f64).max(1e-20).log10())
}
