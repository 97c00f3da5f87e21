//! # `value`: a number along a stroke
//!
//! | parameter | type  | default    | meaning                                                   |
//! |-----------|-------|------------|-----------------------------------------------------------|
//! | `column`  | text  | `material` | the column, of one component: `material`, `ao`, a class … |
//! | `value`   | float | 1          | the number                                                |
//! | `opacity` | float | 1          | of floats: how much of it where the stroke is strongest   |
//!
//! Method. Columns of whole numbers have the number where the weight is at least a half, columns of floats are mixed by
//! weight and opacity. A column that is not there is made: `material` of u32, others of f32.
//!
//! Limits: whole numbers go to what their type holds; another one is refused.

use surfelshop_api::columns::MATERIAL;
use surfelshop_api::prelude::*;

params! {
    /// Settings of `value`.
    pub struct Settings {
        /// The column that the number is painted into: of one component.
        column: String { default: "material".to_owned() },
        /// The number.
        value: f64 { default: 1.0, range: -1e30..=1e30 },
        /// Of a column of floats: how much of the number where the stroke is strongest.
        opacity: f32 { default: 1.0, range: 0.0..=1.0 },
    }
}

/// The tool.
pub(crate) struct Value;

impl Tool for Value {
    const INFO: UnitInfo =
        UnitInfo::new("value", "Paint a value", "Paints a number into a column along a stroke.");
    const HANDLING: Handling = Handling::STROKE;
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn run(&mut self, cloud: &CloudView<'_>, params: &Settings, job: &Job<'_>) -> Result<()> {
        let name = params.column.trim();
        let (weights, value, share) = (cloud.weights(), params.value, f64::from(params.opacity));
        let column = cloud.column(name);
        if let Some(column) = column.filter(|column| column.components != 1) {
            return Err(Error::new(format!(
                "column `{name}`: expected one component, found {}",
                column.components
            )));
        }
        if name.is_empty() {
            return Err(Error::new("expected the name of a column, found none"));
        }
        let stage = |values: Values<'_>| {
            job.edit(&Edit::Columns(vec![NewColumn { name, components: 1, values }]))
        };
        macro_rules! whole {
            ($variant:ident, $type:ty, $old:expr) => {{
                if value.fract() != 0.0
                    || value < f64::from(<$type>::MIN)
                    || value > f64::from(<$type>::MAX)
                {
                    let kind = stringify!($type);
                    return Err(Error::new(format!(
                        "column `{name}`: expected a number of type {kind}, found {value}"
                    )));
                }
                let chosen = |(old, weight): (&$type, &f32)| {
                    if *weight >= 0.5 { value as $type } else { *old }
                };
                let values: Vec<$type> = $old.iter().zip(&weights).map(chosen).collect();
                stage(Values::$variant(&values))
            }};
        }
        let mixed = |old: f64, weight: f32| old + f64::from(weight) * share * (value - old);
        match column.map(|column| column.values) {
            Some(Values::U8(old)) => whole!(U8, u8, old),
            Some(Values::I8(old)) => whole!(I8, i8, old),
            Some(Values::U16(old)) => whole!(U16, u16, old),
            Some(Values::I16(old)) => whole!(I16, i16, old),
            Some(Values::U32(old)) => whole!(U32, u32, old),
            Some(Values::I32(old)) => whole!(I32, i32, old),
            Some(Values::F64(old)) => {
                let values: Vec<f64> =
                    old.iter().zip(&weights).map(|(old, w)| mixed(*old, *w)).collect();
                stage(Values::F64(&values))
            }
            Some(Values::F32(old)) => {
                let new = |(old, w): (&f32, &f32)| mixed(f64::from(*old), *w) as f32;
                stage(Values::F32(&old.iter().zip(&weights).map(new).collect::<Vec<_>>()))
            }
            None if name == MATERIAL => whole!(U32, u32, vec![0u32; cloud.len]),
            None => {
                let before = if name == columns::AO { 1.0 } else { 0.0 };
                let values: Vec<f32> = weights.iter().map(|w| mixed(before, *w) as f32).collect();
                stage(Values::F32(&values))
            }
        }
    }
}
