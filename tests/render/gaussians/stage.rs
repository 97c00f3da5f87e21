//! Scenes of Gaussians, pictures of them, and how far pictures are apart.

use glam::{DVec3, Quat, Vec3};
use surfelshop_api::columns::{OPACITY, POSITION, SH, SPLAT_ROTATION, SPLAT_SCALE};
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::{CloudFacts, Scene, UnitKind, View};
use surfelshop_cloud::{Buffer, Cloud, Column};
use surfelshop_image::Image;
use surfelshop_render::{Engine, RenderError, RenderRequest, Rendered, RendererView};
use surfelshop_runtime::plugins::Timeouts;
use surfelshop_tests::stage;

/// Both renderers.
pub(crate) const UNITS: [&str; 2] = ["gaussians", "gaussians-2d"];

/// All that they offer.
pub(crate) fn outputs() -> [Output; 4] {
    [Output::Color, Output::Normal, Output::Depth, expected_depth()]
}

pub(crate) fn expected_depth() -> Output {
    Output::Debug("expected-depth".to_owned())
}

/// Of `gaussians-2d` alone.
pub(crate) fn distortion() -> Output {
    Output::Debug("distortion".to_owned())
}

/// Numbers that look random.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    /// From 0 to 1.
    pub(crate) fn next(&mut self) -> f32 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / 16_777_216.0
    }

    pub(crate) fn within(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.next()
    }
}

/// The columns of Gaussians, before they become a cloud.
#[derive(Clone, Debug, Default)]
pub(crate) struct Gaussians {
    pub(crate) positions: Vec<Vec3>,
    pub(crate) scales: Vec<[f32; 3]>,
    pub(crate) rotations: Vec<[f32; 4]>,
    pub(crate) opacities: Vec<f32>,
    /// Spherical harmonics by order, 3 (2 l + 1) numbers of a Gaussian; no column where empty.
    pub(crate) harmonics: [Vec<f32>; 4],
}

impl Gaussians {
    /// Long, flat and round ones of all opacities in a ball of radius 1, up to twelve times as long as wide; colours that
    /// change with the direction by about as much as those of trained scenes.
    pub(crate) fn generated(n: usize) -> Self {
        let mut random = Random(5);
        let mut all = Self::default();
        while all.positions.len() < n {
            let position = Vec3::from_array([0; 3].map(|_| random.within(-1.0, 1.0)));
            if position.length() > 1.0 {
                continue;
            }
            let scale = [0; 3].map(|_| 0.008 * 12f32.powf(random.next()));
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
    pub(crate) fn push(
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

    pub(crate) fn len(&self) -> usize {
        self.positions.len()
    }

    /// The same in another order.
    pub(crate) fn shuffled(&self) -> Self {
        let mut order: Vec<usize> = (0..self.len()).collect();
        let mut random = Random(99);
        for i in (1..order.len()).rev() {
            order.swap(i, (random.next() * (i + 1) as f32) as usize);
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

    pub(crate) fn cloud(&self) -> Cloud {
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
        Cloud::new(DVec3::ZERO, columns).unwrap()
    }
}

/// Parameters of a renderer.
pub(crate) fn values(pairs: &[(&str, Value)]) -> Values {
    pairs.iter().map(|(id, value)| ((*id).to_owned(), value.clone())).collect()
}

pub(crate) fn text(text: &str) -> Value {
    Value::Text(text.to_owned())
}

/// A renderer of the plugin.
pub(crate) fn renderer(engine: &Engine, unit: &str) -> RendererView {
    let loaded = stage::built_unit("surfelshop_gaussian_splatting", UnitKind::Renderer, unit);
    let hosted = loaded.start(&engine.gpu().host_info(), &Timeouts::default()).unwrap();
    RendererView::new(hosted, unit).needing(&loaded.description.needs)
}

/// Facts of clouds that are shown together.
pub(crate) fn together(clouds: &[&Cloud]) -> CloudFacts {
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
pub(crate) fn frame(
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
pub(crate) fn pixels(frame: &Rendered, output: &Output) -> Vec<[f32; 4]> {
    frame.image(output).unwrap().data.as_chunks::<4>().0.to_vec()
}

/// The first number of each pixel.
pub(crate) fn firsts(image: &Image) -> Vec<f32> {
    image.data.iter().step_by(image.components as usize).copied().collect()
}

/// sRGB-encoded light, as a screen shows it.
pub(crate) fn encoded(light: f64) -> f64 {
    if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 }
}

/// Decibels between two colour pictures as a screen shows them, white being 1, and between their coverages.
pub(crate) fn decibels(found: &[[f32; 4]], expected: &[[f64; 4]]) -> [f64; 2] {
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

/// The same picture in f64.
pub(crate) fn wide(pixels: &[[f32; 4]]) -> Vec<[f64; 4]> {
    pixels.iter().map(|pixel| pixel.map(f64::from)).collect()
}

/// Fails where a picture of a frame has a number that is none.
#[track_caller]
pub(crate) fn all_finite(frame: &Rendered, what: &str) {
    for (output, image) in &frame.images {
        assert!(image.data.iter().all(|v| v.is_finite()), "{what}: {output:?}");
    }
}

/// Fails where two frames differ in a bit, and where they show nothing.
#[track_caller]
pub(crate) fn equal_bits(a: &Rendered, b: &Rendered, what: &str) {
    for (output, image) in &a.images {
        assert!(image.data.iter().any(|v| *v != 0.0), "{what}: {output:?} is empty");
        let bits = |image: &Image| image.data.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        let other = b.image(output).unwrap();
        let n = bits(image).iter().zip(bits(other)).filter(|(a, b)| *a != b).count();
        assert_eq!(n, 0, "{what}: numbers of {output:?} that differ");
    }
}

/// Says figures of a test.
pub(crate) fn say(line: &str) {
    println!("gaussians: {line}");
}
