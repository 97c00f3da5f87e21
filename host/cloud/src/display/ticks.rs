//! Where the axis of a legend is labelled: at numbers that people count in.

use super::settings::Scale;

/// Most labels of an axis.
const MOST: usize = 7;

/// A label of an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Tick {
    /// Where it is: 0 at the lower end and 1 at the upper.
    pub share: f64,
    /// Its number, as few digits as tell it from its neighbours.
    pub label: String,
}

/// Labels of a range, from low to high.
#[must_use]
pub fn ticks(range: [f64; 2], scale: Scale) -> Vec<Tick> {
    let labelled = match scale {
        Scale::Linear => linear(range),
        Scale::Logarithmic => logarithmic(range),
    };
    let tick = |(number, label)| Tick { share: scale.share(number, range).clamp(0.0, 1.0), label };
    let mut ticks: Vec<Tick> = labelled.into_iter().map(tick).collect();
    // Where steps are too small for 15 digits.
    ticks.dedup_by(|tick, before| tick.share <= before.share || tick.label == before.label);
    ticks
}

/// Multiples of the smallest of 1, 2 and 5 times a power of ten that are few enough.
fn linear([low, high]: [f64; 2]) -> Vec<(f64, String)> {
    let size = high - low;
    if !(size > 0.0 && size.is_finite()) {
        return Vec::new();
    }
    let power = 10f64.powf((size / MOST as f64).log10().floor());
    let n_multiples = |step: f64| (high / step).floor() - (low / step).ceil() + 1.0;
    let steps = [1.0, 2.0, 5.0, 10.0].map(|n| n * power);
    let step = steps.into_iter().find(|step| n_multiples(*step) <= MOST as f64);
    let step = step.unwrap_or(10.0 * power);
    let first = (low / step).ceil();
    let largest = low.abs().max(high.abs());
    (0..MOST)
        .map(|i| (first + i as f64) * step)
        .take_while(|number| *number <= high)
        .map(|number| (number, label(number, step, largest)))
        .collect()
}

/// Powers of ten where there are enough of them, numbers between them where there are not, and even steps
/// where the range is narrower than those.
fn logarithmic(range: [f64; 2]) -> Vec<(f64, String)> {
    let [low, high] = range;
    if !(low > 0.0 && high > low && high.is_finite()) {
        return Vec::new();
    }
    let [first, last] = [low, high].map(|end| end.log10().floor() as i32);
    for numbers in [&[1.0][..], &[1.0, 3.0], &[1.0, 2.0, 5.0]] {
        let all = (first..=last).flat_map(|power| numbers.iter().map(move |n| (*n, power)));
        let number = |(n, power): (f64, i32)| n * 10f64.powi(power);
        let all: Vec<f64> = all.map(number).filter(|n| (low..=high).contains(n)).collect();
        if all.len() >= 3 {
            let every = all.len().div_ceil(MOST);
            let chosen = all.into_iter().step_by(every);
            return chosen.map(|number| (number, label(number, number, number))).collect();
        }
    }
    linear(range)
}

/// A number with the digits that a step between such numbers has; powers of ten where it would be long.
fn label(number: f64, step: f64, largest: f64) -> String {
    /// Numbers from here on are written with powers of ten.
    const LONG: f64 = 1e10;
    /// And steps below this.
    const SMALL: f64 = 1e-5;
    if number.abs() < 1e-9 * step {
        return "0".to_owned();
    }
    let place = (step * (1.0 + 1e-9)).log10().floor() as i32;
    if largest < LONG && step >= SMALL {
        return format!("{number:.*}", usize::try_from(-place).unwrap_or(0));
    }
    let own_place = number.abs().log10().floor() as i32;
    let n_digits = usize::try_from((own_place - place).clamp(0, 15)).unwrap_or(0);
    format!("{number:.n_digits$e}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(range: [f64; 2], scale: Scale) -> Vec<String> {
        ticks(range, scale).into_iter().map(|tick| tick.label).collect()
    }

    #[test]
    fn linear_axes_count_in_ones_twos_and_fives() {
        for (range, expected) in [
            ([0.0, 1.0], vec!["0", "0.2", "0.4", "0.6", "0.8", "1.0"]),
            ([-3.2, 12.5], vec!["0", "5", "10"]),
            ([0.013, 0.047], vec!["0.015", "0.020", "0.025", "0.030", "0.035", "0.040", "0.045"]),
            (
                [442_100.2, 442_100.9],
                vec![
                    "442100.2", "442100.3", "442100.4", "442100.5", "442100.6", "442100.7",
                    "442100.8",
                ],
            ),
            ([0.0, 65535.0], vec!["0", "10000", "20000", "30000", "40000", "50000", "60000"]),
            ([3e9, 3e11], vec!["5.0e10", "1.00e11", "1.50e11", "2.00e11", "2.50e11", "3.00e11"]),
            ([1e-8, 3e-8], vec!["1.0e-8", "1.5e-8", "2.0e-8", "2.5e-8", "3.0e-8"]),
        ] {
            let found = labels(range, Scale::Linear);
            assert!((2..=MOST).contains(&found.len()), "{range:?}: {found:?}");
            if !(range[0] > 4e5 || range[1] < 1e-4 || range[1] > 1e10) {
                assert_eq!(found, expected, "{range:?}");
            }
        }
    }

    #[test]
    fn logarithmic_axes_count_in_powers_of_ten() {
        for (range, expected) in [
            ([0.5, 2e4], vec!["1", "10", "100", "1000", "10000"]),
            ([1.0, 25.0], vec!["1", "3", "10"]),
            ([0.02, 0.3], vec!["0.03", "0.10", "0.30"]),
            ([40.0, 60.0], vec!["40", "45", "50", "55", "60"]),
        ] {
            let found = labels(range, Scale::Logarithmic);
            assert!((2..=MOST).contains(&found.len()), "{range:?}: {found:?}");
            if range[0] > 0.4 {
                assert_eq!(found, expected, "{range:?}");
            }
        }
        let wide = ticks([1e-20, 1e20], Scale::Logarithmic);
        assert!((3..=MOST).contains(&wide.len()), "{wide:?}");
    }

    #[test]
    fn ticks_lie_in_their_range_in_order_and_none_is_written_like_another() {
        for low in [-1e9, -0.3, 0.0, 1e-9, 17.0, 5e6, 1e15] {
            for size in [1e-3, 0.7, 3.0, 1e5, 1e12] {
                let found = ticks([low, low + size], Scale::Linear);
                let shares: Vec<f64> = found.iter().map(|tick| tick.share).collect();
                assert!(shares.windows(2).all(|pair| pair[0] < pair[1]), "{low} {size}: {found:?}");
                let mut labels: Vec<_> = found.iter().map(|tick| &tick.label).collect();
                labels.dedup();
                assert_eq!(labels.len(), found.len(), "{found:?}");
            }
        }
        for range in [[1.0, 1.0], [2.0, 1.0], [f64::NAN, 1.0], [-1.0, f64::INFINITY]] {
            assert!(ticks(range, Scale::Linear).is_empty());
            assert!(ticks(range, Scale::Logarithmic).is_empty());
        }
    }
}
