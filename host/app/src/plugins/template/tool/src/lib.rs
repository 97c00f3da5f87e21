//! # `{{id}}`: colours by height
//!
//! Gives each surfel a colour between two, by where it lies between the cloud's lowest and highest
//! surfel. The result is a column of the cloud: every renderer shows it, `bake` writes it, undo takes it
//! back.
//!
//! | parameter | type   | default       | meaning                                     |
//! |-----------|--------|---------------|---------------------------------------------|
//! | `axis`    | choice | `y`           | which way is up: `x`, `y` or `z`            |
//! | `low`     | colour | 0.05,0.15,0.4 | colour of the lowest surfel, linear         |
//! | `high`    | colour | 1,0.8,0.3     | colour of the highest surfel, linear        |
//! | `own`     | float  | 0             | how much of the surfel's own colour is kept |

use surfelshop_api::glam::Vec3;
use surfelshop_api::prelude::*;

choices! {
    /// Which way is up.
    pub enum Axis {
        /// Along x.
        X = "x",
        /// Along y.
        Y = "y",
        /// Along z.
        Z = "z",
    }
}

params! {
    /// Settings of `{{id}}`: the panel and `--set` are made from these lines.
    pub struct Settings {
        /// Which way is up.
        axis: Axis { default: Axis::Y },
        /// Colour of the lowest surfel.
        low: [f32; 3] { default: [0.05, 0.15, 0.4] },
        /// Colour of the highest surfel.
        high: [f32; 3] { default: [1.0, 0.8, 0.3] },
        /// How much of the surfel's own colour is kept.
        own: f32 { default: 0.0, range: 0.0..=1.0 },
    }
}

struct {{Name}};

impl Tool for {{Name}} {
    const INFO: UnitInfo = UnitInfo::new(
        "{{id}}",
        "{{title}}",
        "Gives surfels colours by their height: begin here with a tool of your own.",
    );
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn run(&mut self, cloud: &CloudView<'_>, params: &Settings, job: &Job<'_>) -> Result<()> {
        job.progress(0.0, "measuring heights");
        let axis = params.axis as usize;
        // In f64, where no two f32 differ by more than there are numbers.
        let heights: Vec<f64> = cloud
            .vectors(columns::POSITION)
            .map(|at| f64::from(at[axis]))
            .collect();
        if heights.len() != cloud.len {
            return Err(Error::new(
                "expected a column `position` of three f32, found none",
            ));
        }
        let finite = || heights.iter().copied().filter(|height| height.is_finite());
        let low = finite().fold(f64::INFINITY, f64::min);
        let high = finite().fold(f64::NEG_INFINITY, f64::max);
        let albedos = cloud.albedos();

        job.progress(0.2, "colouring");
        let (from, to) = (Vec3::from(params.low), Vec3::from(params.high));
        // On all of the host's threads; it stops by itself when the user asks to. What is computed of a
        // surfel depends on that surfel alone, so the result is the same on any number of threads.
        let colors: Vec<Vec3> = job.map(cloud.len, 0.2..0.9, |i| {
            let share = if high > low {
                (heights[i] - low) / (high - low)
            } else {
                0.5
            };
            let share = if share.is_finite() {
                share.clamp(0.0, 1.0)
            } else {
                0.5
            };
            from.lerp(to, share as f32).lerp(albedos[i], params.own)
        })?;

        // Staged now, committed when this function returns `Ok`: a failure or a stop changes nothing.
        let values: Vec<f32> = colors.iter().flat_map(|color| color.to_array()).collect();
        let column = NewColumn {
            name: columns::COLOR,
            components: 3,
            values: Values::F32(&values),
        };
        job.edit(&Edit::Columns(vec![column]))?;
        let range = if high >= low {
            format!(" from {low:.4} to {high:.4}")
        } else {
            String::new()
        };
        job.progress(1.0, &format!("{} surfels coloured{range}", cloud.len));
        Ok(())
    }
}

export_plugin! { id: "{{package}}",{{minor}} tools: [{{Name}}] }
