//! # `brush`: colour along a stroke
//!
//! | parameter | type   | default         | meaning                                             |
//! |-----------|--------|-----------------|-----------------------------------------------------|
//! | `color`   | color  | 0.6, 0.05, 0.03 | the paint                                           |
//! | `opacity` | float  | 1               | how much of it covers where the stroke is strongest |
//! | `blend`   | choice | `normal`        | `normal`, `multiply`, `add` or `screen`             |
//!
//! Method. The albedo a of a surfel becomes a + w o (b(a, p) - a), of its weight w, the opacity o and the paint p, in
//! linear light; b is what the choice says. Colours stay of their type; a cloud without gets some of 8 bits.
//!
//! Limits: what goes over white in 8 and 16 bits is white. Gaussian splats with harmonics keep these.

use surfelshop_api::columns::COLOR;
use surfelshop_api::glam::Vec3;
use surfelshop_api::params::linear_to_srgb;
use surfelshop_api::prelude::*;

choices! {
    /// How paint and colour meet.
    pub enum Blend {
        /// The paint covers.
        Normal = "normal",
        /// The paint is a filter before the colour.
        Multiply = "multiply",
        /// Both lights are added.
        Add = "add",
        /// As two slides on one screen: lighter, and never over white.
        Screen = "screen",
    }
}

params! {
    /// Settings of `brush`.
    pub struct Settings {
        /// The paint.
        color: [f32; 3] { default: [0.6, 0.05, 0.03] },
        /// How much of the colour the paint covers where the stroke is strongest.
        opacity: f32 { default: 1.0, range: 0.0..=1.0 },
        /// How paint and colour meet.
        blend: Blend { default: Blend::Normal },
    }
}

/// The tool.
pub(crate) struct Brush;

impl Tool for Brush {
    const INFO: UnitInfo = UnitInfo::new("brush", "Brush", "Paints a colour along a stroke.");
    const HANDLING: Handling = Handling::STROKE;
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn run(&mut self, cloud: &CloudView<'_>, params: &Settings, job: &Job<'_>) -> Result<()> {
        let paint = Vec3::from(params.color);
        let painted = cloud.albedos().into_iter().zip(cloud.weights()).map(|(albedo, weight)| {
            let full = match params.blend {
                Blend::Normal => paint,
                Blend::Multiply => albedo * paint,
                Blend::Add => albedo + paint,
                Blend::Screen => albedo + paint - albedo * paint,
            };
            albedo.lerp(full, weight * params.opacity)
        });
        stage(cloud, painted.collect(), job)
    }
}

/// Stages colours in the type that the cloud's have; opacities stay.
fn stage(cloud: &CloudView<'_>, colors: Vec<Vec3>, job: &Job<'_>) -> Result<()> {
    let column = cloud.column(COLOR).filter(|column| column.components >= 3);
    let components = column.map_or(3, |column| column.components);
    let n = components as usize;
    let code = |value: f32, most: f32| (linear_to_srgb(value.clamp(0.0, 1.0)) * most).round();
    macro_rules! stage {
        ($variant:ident, $old:expr, $value:expr) => {{
            let mut values = $old;
            for (new, color) in values.chunks_exact_mut(n).zip(&colors) {
                new[..3].copy_from_slice(&color.to_array().map($value));
            }
            let values = Values::$variant(&values);
            job.edit(&Edit::Columns(vec![NewColumn { name: COLOR, components, values }]))
        }};
    }
    match column.map(|column| column.values) {
        Some(Values::F32(old)) => stage!(F32, old.to_vec(), |value| value.max(0.0)),
        Some(Values::U16(old)) => stage!(U16, old.to_vec(), |value| code(value, 65535.0) as u16),
        Some(Values::U8(old)) => stage!(U8, old.to_vec(), |value| code(value, 255.0) as u8),
        _ => stage!(U8, vec![0u8; n * cloud.len], |value| code(value, 255.0) as u8),
    }
}
