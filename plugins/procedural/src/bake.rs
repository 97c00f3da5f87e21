//! # `procedural`, the tool: a pattern in the column `color`
//!
//! Takes the renderer's parameters up to `own-color`, and
//!
//! | parameter | type | default | meaning                                                       |
//! |-----------|------|---------|---------------------------------------------------------------|
//! | `filter`  | bool | true    | the pattern over what each surfel stands for, not at its centre |
//!
//! Method. The same shaders as the renderer's, run for every surfel: over a square in its plane as
//! wide as its radius, which is about the distance to its neighbours. Colours are stored as linear
//! floats, since marble may be brighter than white.
//!
//! Limits: it needs a graphics device, though software will do. Highlights are not baked. A pattern
//! finer than the surfels is averaged, as it must.

use crate::placement::PatternTransform;
use crate::settings::pattern_params;
use crate::{patterns, with_pattern};
use surfelshop_api::columns::{COLOR, NORMAL, POSITION, RADIUS, Values};
use surfelshop_api::glam::{DVec3, Vec3};
use surfelshop_api::params::srgb_to_linear;
use surfelshop_api::prelude::*;
use surfelshop_api::tool::NewColumn;

use crate::settings::Pattern;

/// Surfels of one run of the device: 64 bytes each are far below what any device binds.
const AT_ONCE: usize = 1 << 18;

pattern_params! {
    /// Settings of the tool.
    Settings {
        /// Average the pattern over what each surfel stands for, not at its centre.
        filter: bool { default: true },
    }
}

/// The tool.
pub(crate) struct Bake;

impl Tool for Bake {
    const INFO: UnitInfo = UnitInfo::new(
        "procedural",
        "Bake a procedural texture",
        "Computes a pattern at every surfel and stores it as the cloud's colours.",
    );
    type Params = Settings;
    const SCOPE: Scope = Scope::Surfel;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn run(&mut self, cloud: &CloudView<'_>, p: &Settings, job: &Job<'_>) -> Result<()> {
        let chosen = p.pattern_settings();
        let pattern = patterns::text(&chosen)?;
        let transform = chosen.placement.transform(&cloud.object, cloud.origin);
        let width = if p.filter { 1.0 } else { 0.0 };
        let surfels = Surfels::new(cloud, &transform, width, p.own_color);
        job.progress(0.0, "computing the pattern");
        let mut colors: Vec<f32> = Vec::with_capacity(3 * cloud.len);
        for start in (0..cloud.len).step_by(AT_ONCE) {
            job.check()?;
            let end = (start + AT_ONCE).min(cloud.len);
            let mut graph = Graph::new();
            let out = graph.buffer("colors", Buffer::new(16 * (end - start) as u64));
            let surfels: Vec<u8> = (start..end).flat_map(|i| surfels.bytes(i)).collect();
            let surfels = graph.upload("surfels", &surfels);
            let [a, b, c] = transform.parts();
            let count = u32::try_from(end - start).unwrap_or(u32::MAX);
            let anchor = graph.uniform(Uniform::new().vec3(a).vec3(b).vec3(c).u32(count));
            let groups = Groups::Fixed([count.div_ceil(64), 1, 1]);
            let pass = Pass::compute("bake", include_str!("bake.wgsl"), "bake", groups)
                .bind("anchor", anchor)
                .bind("surfels", surfels)
                .bind("colors", out);
            let pass = with_pattern(&mut graph, pass, &chosen, None, &pattern);
            graph.pass(pass);
            let found = job.compute(&graph, &[out])?;
            let bytes = found.first().map_or(&[][..], Vec::as_slice);
            let floats =
                bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
            let floats: Vec<f32> = floats.collect();
            colors.extend(floats.chunks_exact(4).flat_map(|color| &color[..3]));
            job.progress(end as f64 / cloud.len as f64, "");
        }
        let values = Values::F32(&colors);
        job.edit(&Edit::Columns(vec![NewColumn { name: COLOR, components: 3, values }]))
    }
}

/// The surfels of a cloud as the shader takes them.
struct Surfels<'a> {
    transform: &'a PatternTransform,
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    radii: &'a [f32],
    colors: Option<&'a ColumnView<'a>>,
    /// Side of the square that a surfel stands for, radii.
    width: f64,
    own_color: f32,
}

impl<'a> Surfels<'a> {
    fn new(
        cloud: &'a CloudView<'a>,
        transform: &'a PatternTransform,
        width: f64,
        own_color: f32,
    ) -> Self {
        Self {
            transform,
            positions: cloud.vectors(POSITION).collect(),
            normals: cloud.vectors(NORMAL).collect(),
            radii: cloud.floats(RADIUS, 1).unwrap_or_default(),
            colors: cloud.column(COLOR).filter(|column| column.components >= 3),
            width,
            own_color,
        }
    }

    /// The bytes of the shader's `Surfel`.
    fn bytes(&self, i: usize) -> Vec<u8> {
        let to_pattern = |v: DVec3| (self.transform.pattern_from_world * v).as_vec3();
        let normal = self.normals.get(i).map_or(DVec3::Y, |normal| normal.as_dvec3());
        let normal = normal.try_normalize().unwrap_or(DVec3::Y);
        let (across, along) = normal.any_orthonormal_pair();
        let width = self.width * f64::from(self.radii.get(i).copied().unwrap_or(0.0));
        let own = self.colors.map_or(Vec3::ONE, |column| linear(column, i));
        Uniform::new()
            .vec3(to_pattern(self.positions[i].as_dvec3()))
            .vec3(to_pattern(width * across))
            .vec3(to_pattern(width * along))
            .vec3(Vec3::ONE.lerp(own, self.own_color))
            .into_bytes()
    }
}

/// A surfel's colour, linear Rec. 709; white where the column has another type than colours have.
fn linear(column: &ColumnView<'_>, i: usize) -> Vec3 {
    let first = column.components as usize * i;
    let channel = |c: usize| match column.values {
        Values::U8(values) => srgb_to_linear(f32::from(values[first + c]) / 255.0),
        Values::U16(values) => srgb_to_linear(f32::from(values[first + c]) / 65535.0),
        Values::F32(values) => values[first + c],
        _ => 1.0,
    };
    Vec3::from([0, 1, 2].map(channel))
}
