//! What leaving out saves, measured: each thing that a frame does without is put back in, in turns with
//! the frame as it is.

use anyhow::Context as _;
use serde::Serialize;
use std::time::Instant;
use surfelshop_render::{Counters, PassState, RenderRequest, Restored};
use surfelshop_session::output::terminal;
use surfelshop_session::session::{ConvergedFrame, LoadedRenderer, RenderSession};
use surfelshop_session::timing::{median, spread};

/// What a thing that is left out would cost.
#[derive(Debug, Serialize)]
pub(super) struct Saving {
    what: Restored,
    /// Milliseconds of a frame without it, and with it: medians of frames in turns.
    without_ms: f64,
    with_ms: f64,
    /// The median of the differences between frames of one turn, and the distance of their quartiles.
    saved_ms: f64,
    spread_ms: f64,
    /// Bytes of columns, and of textures and buffers of the graph.
    saved_bytes: i64,
    saved_pipelines: i64,
    saved_passes: i64,
    /// Numbers in the pictures that differ between both, bit by bit.
    differing: usize,
}

/// A device with a renderer, and its picture.
pub(super) struct Side {
    studio: RenderSession,
    chosen: LoadedRenderer,
}

impl Side {
    pub(super) fn new(studio: RenderSession, chosen: LoadedRenderer) -> Self {
        Self { studio, chosen }
    }

    /// Its pictures, for which surfels are drawn anew.
    fn settled(
        &mut self,
        request: &RenderRequest<'_>,
    ) -> anyhow::Result<(ConvergedFrame, Counters)> {
        self.studio.engine.forget_surfaces();
        let settled = self.studio.settle(&mut self.chosen, request)?;
        Ok((settled, self.studio.engine.counters()))
    }

    /// Milliseconds of a frame for which surfels are drawn anew.
    fn timed(&mut self, request: &RenderRequest<'_>) -> anyhow::Result<f64> {
        self.studio.engine.forget_surfaces();
        let started = Instant::now();
        let frame = self.studio.engine.render(&mut self.chosen.view, request);
        frame.with_context(|| self.chosen.reference.to_string())?;
        Ok(started.elapsed().as_secs_f64() * 1e3)
    }
}

/// Measures all that a frame does without, with so many frames each; `side` makes a device with the
/// renderer. What is kept for the next start is there already.
pub(super) fn savings(
    mut side: impl FnMut() -> anyhow::Result<Side>,
    request: &RenderRequest<'_>,
    n_frames: usize,
) -> anyhow::Result<Vec<Saving>> {
    let mut usual = side()?;
    let without = usual.settled(request)?;
    let left_out = usual.studio.engine.left_out(&usual.chosen.view, request);
    let mut savings = Vec::with_capacity(left_out.len());
    for kept in left_out {
        let mut other = side()?;
        other.studio.engine.keep(vec![kept.clone()]);
        match compared(kept.clone(), &mut usual, &mut other, &without, request, n_frames) {
            Ok(saving) => savings.push(saving),
            // A renderer may refuse what is asked of it then, as an output may have to be made at a cost.
            Err(error) => terminal::note(format!("{kept} was not measured: {error:#}")),
        }
    }
    Ok(savings)
}

fn compared(
    what: Restored,
    usual: &mut Side,
    other: &mut Side,
    (without, counted): &(ConvergedFrame, Counters),
    request: &RenderRequest<'_>,
    n_frames: usize,
) -> anyhow::Result<Saving> {
    let (with, counted_with) = other.settled(request)?;
    let mut times = Vec::with_capacity(n_frames);
    for turn in 0..n_frames {
        // Whoever comes second finds the CPU's caches warm.
        let pair = match turn % 2 {
            0 => (usual.timed(request)?, other.timed(request)?),
            _ => {
                let with = other.timed(request)?;
                (usual.timed(request)?, with)
            }
        };
        times.push(pair);
    }
    let differences: Vec<f64> = times.iter().map(|(without, with)| with - without).collect();
    let middle = |of: &[f64]| median(of).unwrap_or(f64::NAN);
    let ran = |settled: &ConvergedFrame| {
        let passes = settled.rendered.passes.iter();
        passes.filter(|pass| pass.state != PassState::Culled).count() as i64
    };
    let bytes = |settled: &ConvergedFrame, counters: &Counters| {
        let columns = counters.column_bytes + counters.host_column_bytes;
        (columns + counters.environment_bytes + settled.rendered.graph_bytes) as i64
    };
    let pipelines = |counters: &Counters| i64::from(counters.compiled.pipelines);
    Ok(Saving {
        what,
        without_ms: middle(&times.iter().map(|(without, _)| *without).collect::<Vec<_>>()),
        with_ms: middle(&times.iter().map(|(_, with)| *with).collect::<Vec<_>>()),
        saved_ms: middle(&differences),
        spread_ms: spread(&differences).unwrap_or(f64::NAN),
        saved_bytes: bytes(&with, &counted_with) - bytes(without, counted),
        saved_pipelines: pipelines(&counted_with) - pipelines(counted),
        saved_passes: ran(&with) - ran(without),
        differing: differing(without, &with),
    })
}

/// Numbers of the pictures that were asked for that are not the same, bit by bit.
fn differing(without: &ConvergedFrame, with: &ConvergedFrame) -> usize {
    let pairs = without.rendered.images.iter().zip(&with.rendered.images);
    let bits = |value: &f32| value.to_bits();
    pairs
        .map(|((_, a), (_, b))| {
            a.data.iter().map(bits).zip(b.data.iter().map(bits)).filter(|(a, b)| a != b).count()
                + a.data.len().abs_diff(b.data.len())
        })
        .sum()
}

/// The savings as lines.
pub(super) fn lines(savings: &[Saving], n_frames: usize) -> Vec<String> {
    let mut lines = vec![format!("what leaving out saves, frames with each in turns: {n_frames}")];
    for saving in savings {
        let Saving { what, without_ms, with_ms, saved_ms, spread_ms, .. } = saving;
        let picture = match saving.differing {
            0 => "the same picture, bit by bit".to_owned(),
            1 => "1 number of the picture differs".to_owned(),
            n => format!("{n} numbers of the picture differ"),
        };
        // What repeats differ by anyway is no saving.
        let time = match saved_ms.abs() > *spread_ms {
            true => format!("{saved_ms:.2} ms"),
            false => "no difference in time".to_owned(),
        };
        lines.push(format!(
            "  {what}: {time} (quartiles {spread_ms:.2} ms apart; {without_ms:.2} instead of \
             {with_ms:.2}), {:.2} MB, pipelines: {}, passes: {}; {picture}",
            saving.saved_bytes as f64 / 1e6,
            saving.saved_pipelines,
            saving.saved_passes,
        ));
    }
    lines
}
