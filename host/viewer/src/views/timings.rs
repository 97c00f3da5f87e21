//! Median times of a side's passes over its last frames.

use crate::render_thread::Detail;
use crate::render_thread::RenderedView;
use std::collections::VecDeque;
use surfelshop_session::timing;

/// The number of frames: enough that a few slow ones do not change the median.
const N_FRAMES: usize = 31;

/// What the frames of a median have in common.
#[derive(Clone, Debug, PartialEq)]
struct Kind {
    renderer: String,
    detail: Detail,
    size: [u32; 2],
}

/// Times of the last frames of one renderer, level of detail and size.
#[derive(Debug, Default)]
pub(crate) struct Timings {
    kind: Option<Kind>,
    whole: VecDeque<f64>,
    /// By name, without frames in which the pass did not run.
    passes: Vec<(String, VecDeque<f64>)>,
}

impl Timings {
    /// Adds a frame; one of another kind clears the others.
    pub(crate) fn add(&mut self, renderer: &str, rendered: &RenderedView) {
        let kind =
            Kind { renderer: renderer.to_owned(), detail: rendered.detail, size: rendered.size };
        if self.kind.as_ref() != Some(&kind) {
            *self = Self { kind: Some(kind), ..Self::default() };
        }
        push(&mut self.whole, rendered.milliseconds);
        for pass in &rendered.passes {
            let Some(ms) = pass.gpu_ms else { continue };
            match self.passes.iter_mut().find(|(name, _)| *name == pass.name) {
                Some((_, times)) => push(times, ms),
                None => self.passes.push((pass.name.clone(), VecDeque::from([ms]))),
            }
        }
    }

    /// Median time from request to picture, milliseconds, and the number of frames.
    pub(crate) fn whole(&self) -> Option<(f64, usize)> {
        Some((median(&self.whole)?, self.whole.len()))
    }

    /// Median time of a pass over the frames in which it ran, milliseconds.
    pub(crate) fn pass(&self, name: &str) -> Option<f64> {
        self.passes.iter().find(|(other, _)| other == name).and_then(|(_, times)| median(times))
    }
}

fn push(times: &mut VecDeque<f64>, ms: f64) {
    times.push_back(ms);
    if times.len() > N_FRAMES {
        times.pop_front();
    }
}

fn median(times: &VecDeque<f64>) -> Option<f64> {
    timing::median(&Vec::from(times.clone()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_median_is_the_middle_of_the_last_frames() {
        let mut times = VecDeque::new();
        assert_eq!(median(&times), None);
        for ms in [9.0, 1.0, 3.0] {
            push(&mut times, ms);
        }
        assert_eq!(median(&times), Some(3.0));
        for _ in 0..N_FRAMES {
            push(&mut times, 5.0);
        }
        assert_eq!((median(&times), times.len()), (Some(5.0), N_FRAMES));
    }
}
