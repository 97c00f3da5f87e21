//! # `{{id}}`: less light along a stroke
//!
//! A tool that is led by hand: the host draws the cursor, follows the pointer, finds the surfels along the
//! stroke and how much each is concerned, shows what the tool makes of them, and undoes it as one step.
//!
//! | parameter  | type  | default | meaning                                          |
//! |------------|-------|---------|--------------------------------------------------|
//! | `strength` | float | 0.5     | how dark it gets where the stroke is strongest   |
//! | `lightens` | bool  | false   | whether it lets more light reach surfels instead |

use surfelshop_api::prelude::*;

params! {
    /// Settings of `{{id}}`: the panel and `--set` are made from these lines.
    pub struct Settings {
        /// How dark it gets where the stroke is strongest.
        strength: f32 { default: 0.5, range: 0.0..=1.0 },
        /// Whether it lets more light reach surfels instead.
        lightens: bool { default: false },
    }
}

struct {{Name}};

impl Tool for {{Name}} {
    const INFO: UnitInfo = UnitInfo::new(
        "{{id}}",
        "{{title}}",
        "Lets less light reach surfels along a stroke: begin here with a brush of your own.",
    );
    // By a stroke with the usual dabs; `Handling::CLICK` is for what happens at one place.
    const HANDLING: Handling = Handling::STROKE;
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    /// `cloud` has the surfels of the stroke alone. While the stroke goes on this is run again and again, each
    /// time from the beginning of the stroke and on the cloud as it was before.
    fn run(&mut self, cloud: &CloudView<'_>, params: &Settings, job: &Job<'_>) -> Result<()> {
        let before = cloud.floats(columns::AO, 1);
        // Above 0 and at most 1: by the distance from the middle of a dab, and the pressure.
        let weights = cloud.weights();
        let goal = if params.lightens { 1.0 } else { 0.0 };
        let ao: Vec<f32> = (0..cloud.len)
            .map(|i| {
                let ao = before.map_or(1.0, |ao| ao[i]);
                ao + (goal - ao) * weights[i] * params.strength
            })
            .collect();
        // One value for each surfel of the stroke. `Edit::Values` is for some of them, `Edit::Keep` takes
        // surfels away, and `Edit::Add` makes new ones.
        let column = NewColumn {
            name: columns::AO,
            components: 1,
            values: Values::F32(&ao),
        };
        job.edit(&Edit::Columns(vec![column]))
    }
}

export_plugin! { id: "{{package}}",{{minor}} tools: [{{Name}}] }
