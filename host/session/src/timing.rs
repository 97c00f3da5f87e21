//! What runs take, and the middle of several.

use serde::{Deserialize, Serialize};

/// A frame or a run of a tool that was timed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Milliseconds from start to end.
    pub wall_ms: f64,
    /// Milliseconds of a renderer's own passes on the device, where it tells.
    pub own_passes_ms: Option<f64>,
    /// Milliseconds of CPU time of the program, where the system tells.
    pub cpu_ms: Option<f64>,
}

/// What was timed of some runs; nothing where it is not known of all.
pub fn all_of(runs: &[Run], of: impl Fn(&Run) -> Option<f64>) -> Vec<f64> {
    runs.iter().map(of).collect::<Option<Vec<_>>>().unwrap_or_default()
}

fn sorted(values: &[f64]) -> Vec<f64> {
    let mut all = values.to_vec();
    all.sort_by(f64::total_cmp);
    all
}

/// The middle one of some values.
pub fn median(values: &[f64]) -> Option<f64> {
    sorted(values).get(values.len() / 2).copied()
}

/// The distance between the quartiles of some values.
pub fn spread(values: &[f64]) -> Option<f64> {
    let all = sorted(values);
    Some(all.get(3 * all.len() / 4)? - all.get(all.len() / 4)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_middle_and_the_quartiles_of_some_times() {
        assert_eq!((median(&[]), spread(&[])), (None, None));
        assert_eq!((median(&[3.0]), spread(&[3.0])), (Some(3.0), Some(0.0)));
        let times = [9.0, 1.0, 5.0, 3.0, 100.0];
        assert_eq!((median(&times), spread(&times)), (Some(5.0), Some(6.0)));
    }

    #[test]
    fn what_is_not_known_of_all_is_not_known() {
        let run = |own_passes_ms| Run { wall_ms: 1.0, own_passes_ms, cpu_ms: None };
        let runs = [run(Some(2.0)), run(None)];
        assert_eq!(all_of(&runs, |run| run.own_passes_ms), [0.0; 0]);
        assert_eq!(all_of(&runs, |run| Some(run.wall_ms)), [1.0, 1.0]);
    }
}
