//! What frames of `global-illumination` take, up to how far they are made.
//!
//! Software devices do not tell what single passes take: their clock stands where a pass's commands are
//! read and not where they have been done. What a stage takes is therefore the difference of two
//! frames, of which one asks for that stage's result and the other does not, in CPU time of all
//! threads: other work on the machine is not in it.

use super::{Bench, Set, values};
use crate::measure::cpu_seconds;
use crate::stage;
use anyhow::Result;
use std::time::Instant;
use surfelshop_api::graph::Output;
use surfelshop_api::params::Values;
use surfelshop_render::{RenderRequest, RendererView};

/// What a frame took, milliseconds.
#[derive(Clone, Copy, Debug, Default)]
pub struct Times {
    /// By the clock, with the picture read back.
    pub clock: f64,
    /// Of all threads.
    pub cpu: f64,
}

/// The quartiles of some numbers, the second of which is the median; NaN of none.
#[must_use]
pub fn quartiles(mut all: Vec<f64>) -> [f64; 3] {
    all.sort_by(f64::total_cmp);
    [1, 2, 3].map(|quarter| {
        let at = (all.len() * quarter / 4).min(all.len().saturating_sub(1));
        all.get(at).copied().unwrap_or(f64::NAN)
    })
}

/// Frames that are timed in turns.
pub struct Timing {
    jobs: Vec<(RendererView, Values, Output)>,
}

impl Timing {
    /// Frames of `ewa-phong`, and of the renderer with these settings up to these pictures, for each of
    /// which it has an instance of its own.
    #[must_use]
    pub fn of(bench: &Bench, jobs: &[(Vec<Set<'_>>, Output)]) -> Self {
        let (library, unit) = ("surfelshop-global-illumination", "global-illumination");
        let baseline = stage::built_renderer(&bench.engine, "surfelshop-ewa-phong", "ewa-phong");
        let mut all = vec![(baseline, Values::new(), Output::Color)];
        for (sets, output) in jobs {
            let renderer = stage::built_renderer(&bench.engine, library, unit);
            all.push((renderer, values(sets), output.clone()));
        }
        Self { jobs: all }
    }

    /// Draws `repeats` frames of each in turns, after one that is not timed; the baseline first.
    ///
    /// # Errors
    /// Those of drawing.
    pub fn run(&mut self, bench: &mut Bench, repeats: usize) -> Result<Vec<Vec<Times>>> {
        let mut times = vec![Vec::new(); self.jobs.len()];
        for repeat in 0..=repeats {
            for ((renderer, values, output), times) in self.jobs.iter_mut().zip(&mut times) {
                let took = timed(bench, renderer, values, output)?;
                // The first brings columns along and compiles.
                if repeat > 0 {
                    times.push(took);
                }
            }
        }
        Ok(times)
    }
}

/// Draws a frame for which nothing was kept.
fn timed(
    bench: &mut Bench,
    renderer: &mut RendererView,
    values: &Values,
    output: &Output,
) -> Result<Times> {
    bench.engine.forget_surfaces();
    let request = RenderRequest {
        clouds: &[bench.cloud.view()],
        facts: bench.cloud.facts(),
        scene: &bench.scene,
        view: bench.view,
        values,
        outputs: std::slice::from_ref(output),
        frame_index: 0,
        environment: None,
        stride: bench.stride,
        detail_px: 0.0,
        parts: None,
        eye_dome: None,
    };
    let (started, cpu) = (Instant::now(), cpu_seconds());
    bench.engine.render(renderer, &request)?;
    let clock = started.elapsed().as_secs_f64() * 1e3;
    Ok(Times { clock, cpu: (cpu_seconds() - cpu) * 1e3 })
}
