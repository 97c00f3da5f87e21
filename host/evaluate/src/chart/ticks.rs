//! Where an axis in ratios is labelled.

/// Fewest labels of an axis.
const FEWEST: usize = 4;

/// Numbers of one decade, coarse to fine.
const DECADES: [&[f64]; 3] =
    [&[1.0], &[1.0, 2.0, 5.0], &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]];

/// Round numbers from `low` to `high`, both above 0: powers of ten where there are enough of them,
/// numbers between them where the range is narrow, even steps where it is narrower than those.
pub fn ticks(low: f64, high: f64) -> Vec<f64> {
    if !(low > 0.0 && high > low && high.is_finite()) {
        return Vec::new();
    }
    let decades = low.log10().floor() as i32..=high.log10().ceil() as i32;
    let within = |value: &f64| (low..=high).contains(value);
    for numbers in DECADES {
        let all = decades.clone().flat_map(|d| numbers.iter().map(move |n| n * 10f64.powi(d)));
        let all: Vec<f64> = all.filter(within).collect();
        if all.len() >= FEWEST {
            return all;
        }
    }
    let step = 10f64.powf(((high - low) / FEWEST as f64).log10().floor());
    let step = [5.0, 2.0, 1.0].map(|n| n * step).into_iter();
    let step = step.min_by_key(|step| ((high - low) / step - FEWEST as f64).abs() as u64);
    let step = step.unwrap_or(high - low);
    let first = (low / step).ceil() as i64;
    (first..=(high / step).floor() as i64).map(|i| i as f64 * step).collect()
}

/// A number as a label: three digits, and powers of ten where it would be long.
pub fn label(value: f64) -> String {
    if value != 0.0 && !(1e-4..1e6).contains(&value.abs()) {
        let text = format!("{value:.2e}");
        let (digits, power) = text.split_once('e').unwrap_or((&text, "0"));
        let digits = digits.trim_end_matches('0').trim_end_matches('.');
        return format!("{digits}e{power}");
    }
    let rounded: f64 = format!("{value:.2e}").parse().unwrap_or(value);
    rounded.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_range_has_some_and_not_too_many() {
        for low in [1e-9, 0.013, 1.0, 29.0, 9.9e5] {
            for ratio in [1.05, 1.3, 2.0, 9.0, 50.0, 1e4, 1e9] {
                let found = ticks(low, low * ratio);
                let all = (2..=25).contains(&found.len());
                assert!(all, "{low} {ratio}: {found:?}");
                assert!(found.iter().all(|tick| (low..=low * ratio).contains(tick)));
                assert!(found.windows(2).all(|pair| pair[0] < pair[1]));
            }
        }
        assert_eq!(ticks(21.0, 82.0), [30.0, 40.0, 50.0, 60.0, 70.0, 80.0]);
        for [low, high] in [[0.0, 1.0], [1.0, 1.0], [2.0, 1.0], [1.0, f64::INFINITY]] {
            assert_eq!(ticks(low, high), [0.0; 0]);
        }
    }

    #[test]
    fn labels_are_short() {
        let labels = [0.0, 0.02, 30.0, 123_456.0, 1e6, 1.5e-7, 0.1 + 0.2].map(label);
        assert_eq!(labels, ["0", "0.02", "30", "123000", "1e6", "1.5e-7", "0.3"]);
    }
}
