//! Angles in degrees with the fewest digits.

/// The shortest number of degrees that is read as this angle, so that what a person wrote stays
/// what it was.
///
/// Some angles are no number of degrees in f64; they become the nearest that is, which is less than
/// two roundings away and stays itself from then on.
pub(super) fn degrees(radians: f64) -> f64 {
    let nearest = radians.to_degrees();
    shortest(radians).or_else(|| shortest(nearest.to_radians())).unwrap_or(nearest)
}

fn shortest(radians: f64) -> Option<f64> {
    let about = radians.to_degrees();
    let fits = |degrees: &f64| degrees.to_radians().to_bits() == radians.to_bits();
    let rounded = |digits: usize| format!("{about:.digits$e}").parse().ok();
    // 17 digits tell every f64 from its neighbours.
    let mut candidates = (0..17).filter_map(rounded);
    candidates.find(fits).or_else(|| [about.next_up(), about.next_down()].into_iter().find(fits))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn what_people_write_stays() {
        for typed in [35.0, 24.0, 0.1, 179.0, -90.0, 45.3, 1e-3, 0.0, 12.345_678_9] {
            assert_eq!(degrees(f64::to_radians(typed)), typed);
        }
    }

    proptest! {
        #[test]
        fn angles_stay_themselves_once_they_were_written(radians in -1e5..1e5f64) {
            let written = degrees(radians);
            let read = written.to_radians();
            prop_assert!((read - radians).abs() <= 2.0 * f64::EPSILON * radians.abs());
            prop_assert_eq!(degrees(read).to_bits(), written.to_bits());
        }

        #[test]
        fn degrees_are_found_again(typed in -720.0..720.0f64) {
            let read = typed.to_radians();
            prop_assert_eq!(degrees(read).to_radians().to_bits(), read.to_bits());
        }
    }
}
