//! The columns of the new cloud.

use super::outline::Splat;
use super::samples::Samples;
use surfelshop_api::columns::{
    AO, CLIP, COLOR, NORMAL, NORMAL_FIELD, POSITION, RADIUS, TANGENT_U, TANGENT_V, Values,
};
use surfelshop_api::params::{linear_to_srgb, srgb_to_linear};
use surfelshop_api::prelude::*;
use surfelshop_api::tool::NewColumn;

/// Columns of splats, as they are written.
#[derive(Default)]
pub(crate) struct Columns {
    positions: Vec<f32>,
    normals: Vec<f32>,
    tangents: [Vec<f32>; 2],
    radii: Vec<f32>,
    fields: Vec<f32>,
    clips: Vec<f32>,
    pub(crate) n_cut: usize,
    /// Largest distance of a sample from the splats that stand for it, units of the box.
    pub(crate) error: f64,
    /// For each sample whether a splat holds its middle, as it is written.
    is_held: Vec<bool>,
}

/// Factor on half axes, so that what is on the edge is inside when coordinates are rounded.
const ROUNDING: f64 = 1.0 + 1e-5;

impl Columns {
    /// Rounds splats to columns, and measures what became of them.
    pub(crate) fn of(samples: &Samples, splats: &[Splat]) -> Self {
        let mut columns = Self { is_held: vec![false; samples.len()], ..Self::default() };
        for splat in splats {
            columns.push(samples, splat);
        }
        columns
    }

    /// Samples that no splat holds: none.
    pub(crate) fn n_uncovered(&self) -> usize {
        self.is_held.iter().filter(|is_held| !**is_held).count()
    }

    fn push(&mut self, samples: &Samples, splat: &Splat) {
        let (outline, unit) = (&splat.outline, samples.unit);
        // Graphics hardware takes numbers below this for zero.
        let length = |half: f64| {
            (half * ROUNDING * unit).clamp(f64::from(f32::MIN_POSITIVE), f64::from(f32::MAX) / 4.0)
        };
        let half = outline.ellipse.half.to_array().map(length);
        let centre = (outline.centre() * unit + samples.centre).as_vec3();
        let at = (centre.as_dvec3() - samples.centre) / unit;
        for &i in &splat.members {
            let offset = samples.point(i) - at;
            self.error = self.error.max(outline.plane.normal.dot(offset).abs());
            let in_plane = outline.axes.of(offset) / outline.ellipse.half;
            self.is_held[i as usize] |= in_plane.length() <= ROUNDING;
        }
        self.positions.extend(centre.to_array());
        self.normals.extend(outline.plane.mean.as_vec3().to_array());
        for (i, axis) in [outline.axes.u, outline.axes.v].into_iter().enumerate() {
            self.tangents[i].extend((axis * half[i]).as_vec3().to_array());
        }
        self.radii.push(half[0].max(half[1]) as f32);
        self.fields.extend(splat.field.0.map(|value| value as f32));
        self.clips.extend(Self::clip(splat));
        self.n_cut += usize::from(self.clips.last().is_some_and(|&kind| kind > 0.0));
    }

    /// The lines in units of the half axes; those that cut nothing off are left out.
    fn clip(splat: &Splat) -> [f32; 7] {
        const WHOLE: [f64; 3] = [0.0, 0.0, 1.0];
        let ellipse = &splat.outline.ellipse;
        let lines: Vec<[f64; 3]> = (splat.cut.lines.iter())
            .map(|met| {
                let line = met.line;
                let [a, b] = (line.inwards * ellipse.half * ROUNDING).to_array();
                [a, b, line.offset + line.inwards.dot(ellipse.centre)]
            })
            .filter(|[a, b, c]| *c < a.hypot(*b))
            .map(|[a, b, c]| [a, b, c].map(|value| value / a.hypot(b)))
            .collect();
        let is_idle = splat.cut.either && lines.len() < splat.cut.lines.len();
        let (first, second, kind) = match lines[..] {
            _ if is_idle => (WHOLE, WHOLE, 0.0),
            [first, second, ..] => (first, second, if splat.cut.either { 2.0 } else { 1.0 }),
            [first] => (first, WHOLE, 1.0),
            [] => (WHOLE, WHOLE, 0.0),
        };
        let [a, b, c] = first;
        let [d, e, f] = second;
        [a, b, c, d, e, f, kind].map(|value| value as f32)
    }

    /// Stages the new cloud, with the means of what other columns say of each splat's samples.
    pub(crate) fn stage(
        &self,
        cloud: &CloudView<'_>,
        samples: &Samples,
        splats: &[Splat],
        job: &Job<'_>,
    ) -> Result<()> {
        let means = Means { samples, splats };
        let (colors, components) = means.colors(cloud);
        let access = cloud.floats(AO, 1).map(|values| means.of(1, |i, _| f64::from(values[i])));
        let floats =
            |name, components, values| NewColumn { name, components, values: Values::F32(values) };
        let mut columns = vec![
            floats(POSITION, 3, &self.positions),
            floats(NORMAL, 3, &self.normals),
            floats(RADIUS, 1, &self.radii),
            floats(TANGENT_U, 3, &self.tangents[0]),
            floats(TANGENT_V, 3, &self.tangents[1]),
            floats(NORMAL_FIELD, 4, &self.fields),
        ];
        if self.n_cut > 0 {
            columns.push(floats(CLIP, 7, &self.clips));
        }
        let values = colors.as_ref().map(|colors| match colors {
            Colors::U8(values) => Values::U8(values),
            Colors::U16(values) => Values::U16(values),
            Colors::F32(values) => Values::F32(values),
        });
        columns.extend(values.map(|values| NewColumn { name: COLOR, components, values }));
        columns.extend(access.as_deref().map(|values| floats(AO, 1, values)));
        job.edit(&Edit::NewCloud { origin: cloud.origin, columns })
    }
}

/// Colours of the type that the cloud has.
enum Colors {
    U8(Vec<u8>),
    U16(Vec<u16>),
    F32(Vec<f32>),
}

/// Means over the samples of each splat.
struct Means<'a> {
    samples: &'a Samples,
    splats: &'a [Splat],
}

impl Means<'_> {
    /// For each splat the means of `value`, of a sample of the cloud and a component; what is not finite
    /// does not count, and the mean of nothing is 0.
    fn of(&self, components: usize, value: impl Fn(usize, usize) -> f64) -> Vec<f32> {
        let mut means = Vec::with_capacity(self.splats.len() * components);
        for splat in self.splats {
            for component in 0..components {
                let values = splat
                    .members
                    .iter()
                    .map(|&i| value(self.samples.index[i as usize] as usize, component));
                let (sum, n) = values
                    .filter(|value| value.is_finite())
                    .fold((0.0, 0.0), |(sum, n), value| (sum + value, n + 1.0));
                means.push((sum / f64::max(n, 1.0)) as f32);
            }
        }
        means
    }

    /// Mean colours, blended in linear light; opacities as they are.
    fn colors(&self, cloud: &CloudView<'_>) -> (Option<Colors>, u32) {
        let Some(column) = cloud.column(COLOR).filter(|column| column.components >= 3) else {
            return (None, 0);
        };
        let n = column.components as usize;
        let blended = |decode: &dyn Fn(usize) -> f64, most: f64| {
            let linear = |i: usize, component: usize| {
                let code = decode(i * n + component) / most;
                if component < 3 { f64::from(srgb_to_linear(code as f32)) } else { code }
            };
            let means = self.of(n, linear);
            means
                .into_iter()
                .enumerate()
                .map(move |(i, mean)| {
                    let encoded = if i % n < 3 { linear_to_srgb(mean) } else { mean };
                    f64::from(encoded.clamp(0.0, 1.0)) * most
                })
                .collect::<Vec<f64>>()
        };
        let found = match column.values {
            Values::U8(values) => {
                let codes = blended(&|i| f64::from(values[i]), 255.0);
                Some(Colors::U8(codes.into_iter().map(|code| code.round() as u8).collect()))
            }
            Values::U16(values) => {
                let codes = blended(&|i| f64::from(values[i]), 65535.0);
                Some(Colors::U16(codes.into_iter().map(|code| code.round() as u16).collect()))
            }
            Values::F32(values) => {
                Some(Colors::F32(self.of(n, |i, c| f64::from(values[i * n + c]))))
            }
            _ => None,
        };
        (found, column.components)
    }
}
