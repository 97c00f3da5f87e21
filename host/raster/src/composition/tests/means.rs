//! Means within a tolerance, and how far splats lie apart, against the formulas in f64.

use super::*;

/// What the formulas say of a pixel.
struct Expected {
    sums: [f64; 4],
    mean: f64,
    nearest: f64,
    distortion: f64,
}

fn expected(
    composition: Composition,
    (kind, footprints, payloads): (Kind, &[Words], &[[f32; 4]]),
    [x, y]: [usize; 2],
    end: f64,
) -> Expected {
    let at = |words: &Words| met(kind, words, x as f64 + 0.5, y as f64 + 0.5);
    let mut hits: Vec<(usize, f64, f64)> = (0..footprints.len())
        .filter_map(|i| at(&footprints[i]).map(|(opacity, distance)| (i, opacity, distance)))
        .filter(|(.., distance)| *distance < end)
        .collect();
    hits.sort_by(|a, b| footprints[a.0][6].total_cmp(&footprints[b.0][6]));
    let opaque = hits.iter().filter(|(_, opacity, _)| *opacity >= 0.5);
    let nearest = opaque.map(|(.., distance)| *distance).fold(f64::INFINITY, f64::min);
    if let Composition::Normalized(tolerance) = composition {
        let reach = nearest * f64::from(tolerance);
        let is_near = |distance: f64| nearest.is_finite() && (distance - nearest).abs() <= reach;
        hits.retain(|(.., distance)| is_near(*distance));
        let sum: f64 = hits.iter().map(|(_, opacity, _)| opacity).sum();
        hits.iter_mut().for_each(|(_, opacity, _)| *opacity /= sum.max(1.0));
    } else if composition == Composition::Over {
        let mut left = 1.0;
        for (_, opacity, _) in &mut hits {
            *opacity *= left;
            left -= *opacity;
        }
    }
    let mut found = Expected { sums: [0.0; 4], mean: 0.0, nearest, distortion: 0.0 };
    for (k, (i, share, distance)) in hits.iter().enumerate() {
        for (sum, value) in found.sums.iter_mut().zip(payloads[*i]) {
            *sum += share * f64::from(value);
        }
        found.mean += share * distance;
        for (_, other, further) in &hits[..k] {
            found.distortion += share * other * (distance - further).powi(2);
        }
    }
    found.mean /= hits.iter().map(|(_, share, _)| share).sum::<f64>();
    found
}

/// Pixels of a picture that differ from the formulas by more than rounding, as a share of all.
fn wrong(composition: Composition, kind: Kind, surface: &[f32]) -> f64 {
    let (footprints, payloads) = match kind {
        Kind::Conic => conics(300),
        Kind::Planar => planars(300),
    };
    let all = (kind, footprints.as_slice(), payloads.as_slice());
    let found = differences(kind, composition, surface, 1e9, Level::new()).2;
    let [width, height] = VIEW.size_px.map(|side| side as usize);
    let (mut n_wrong, mut n_shown) = (0, 0);
    for at in 0..width * height {
        let end = surface.get(at).filter(|end| **end > 0.0);
        let end = end.map_or(f64::INFINITY, |end| f64::from(*end));
        let expected = expected(composition, all, [at % width, at / width], end);
        let pairs = expected.sums.iter().zip(found.sums[0][at]);
        let off = pairs.map(|(a, b)| (a - f64::from(b)).abs()).fold(0.0, f64::max);
        // What `Over` leaves out behind 0.9999 of the light lies at most 9 behind the rest.
        let (bound, left_out) = match composition {
            Composition::Over => (OVER_BOUND, 81.0 * OVER_BOUND),
            _ => (1e-4, 1e-4),
        };
        let distortion = f64::from(found.distortion[at]);
        let apart = (distortion - expected.distortion).abs();
        let mut is_right = off <= bound && apart <= left_out + 1e-4 * expected.distortion;
        if matches!(composition, Composition::Normalized(_)) && expected.nearest.is_finite() {
            is_right &= (f64::from(found.median[at]) - expected.nearest).abs() < 1e-4;
            is_right &= (f64::from(found.expected[at]) - expected.mean).abs() < 1e-3;
        }
        n_wrong += usize::from(!is_right);
        n_shown += usize::from(distortion > 0.0 && found.sums[0][at][3] > 0.0);
    }
    assert!(n_shown * 25 > width * height, "{composition:?} {kind:?}: {n_shown} pixels count");
    n_wrong as f64 / (width * height) as f64
}

#[test]
fn means_and_distortion_are_as_in_f64() {
    let [width, height] = VIEW.size_px.map(|side| side as usize);
    let surface: Vec<f32> = (0..width * height).map(|i| [0.0, 4.0][i / 7 % 2]).collect();
    for kind in [Kind::Conic, Kind::Planar] {
        for surface in [&[][..], &surface] {
            for composition in [
                Composition::Normalized(0.05),
                Composition::Normalized(0.3),
                Composition::Normalized(1e30),
                Composition::Over,
                Composition::Additive,
            ] {
                // A splat of 1/255 or of a half may just count or just not: of such steps there are few.
                let share = wrong(composition, kind, surface);
                assert!(share < 0.004, "{composition:?} {kind:?}: {share}");
            }
        }
    }
}

/// Splats that cover the picture evenly: opacities and distances.
fn sheets(all: &[(f32, f32)]) -> (Vec<Words>, Vec<[f32; 4]>) {
    let of = |(opacity, distance): &(f32, f32)| {
        let (shape, distance) = ([1e-8, 0.0, 1e-8, 0.0], [0.0, 0.0, *distance]);
        Footprint { shape, distance, opacity: *opacity, center: [10.0, 10.0] }.words()
    };
    let payload = |i: usize| std::array::from_fn(|k| f32::from(u8::from(k == i || k == 3)));
    (all.iter().map(of).collect(), (0..all.len()).map(payload).collect())
}

#[track_caller]
fn near(found: &[f32], expected: &[f32]) {
    let is_near = |(a, b): (&f32, &f32)| (a - b).abs() <= 1e-5 * b.abs().max(1.0);
    assert!(found.iter().zip(expected).all(is_near), "{found:?}, expected {expected:?}");
}

#[test]
fn shares_of_few_are_as_counted_by_hand() {
    let at = 75 * 10 + 10;
    let draw = |(footprints, payloads): &(Vec<Words>, Vec<[f32; 4]>), composition, view: &View| {
        let kind = Kind::Conic;
        let splats = Splats { kind, footprints, payloads, n_payloads: 1, surface: &[] };
        compose(&splats, composition, ALL_DEPTHS, view)
    };
    let three = sheets(&[(0.5, 3.0), (0.25, 1.0), (0.8, 2.0)]);
    // Shares of 0.075, 0.25 and 0.6.
    let over = draw(&three, Composition::Over, &VIEW);
    near(&over.distortion[at..=at], &[0.075 * 0.25 * 4.0 + 0.075 * 0.6 + 0.25 * 0.6]);
    // Of a view in other units squares are scaled by their square, even at the ends of numbers.
    for (unit, expected) in [(10.0, 27.0), (1e30, f32::MAX), (1e-30, 0.0)] {
        let scaled = draw(&three, Composition::Over, &View { unit, ..VIEW });
        near(&scaled.distortion[at..=at], &[expected]);
    }
    // The one at 2 is the nearest that hides half; the others are half its distance off.
    let mean = |tolerance: f32| draw(&three, Composition::Normalized(tolerance), &VIEW);
    for tolerance in [0.0, 0.499] {
        let alone = mean(tolerance);
        near(&alone.sums[0][at], &[0.0, 0.0, 0.8, 0.8]);
        near(&[alone.expected[at], alone.median[at], alone.distortion[at]], &[2.0, 2.0, 0.0]);
    }
    let all = mean(0.5);
    near(&all.sums[0][at], &[0.5 / 1.55, 0.25 / 1.55, 0.8 / 1.55, 1.0]);
    let expected = (0.5 * 3.0 + 0.25 + 0.8 * 2.0) / 1.55;
    near(&[all.expected[at], all.median[at]], &[expected, 2.0]);
    let pairs = (0.5 * 0.25 * 4.0 + 0.5 * 0.8 + 0.25 * 0.8) / (1.55 * 1.55);
    near(&all.distortion[at..=at], &[pairs]);
    let faint = sheets(&[(0.4, 3.0), (0.45, 3.0)]);
    let none = draw(&faint, Composition::Normalized(1.0), &VIEW);
    assert_eq!((none.sums[0][at], none.median[at], none.expected[at]), ([0.0; 4], 0.0, 0.0));
}

/// Distances that differ little from each other and much from 0 lose no digits.
#[test]
fn far_away_distortion_is_that_of_near_splats() {
    let far = sheets(&[(0.5, 1000.0), (0.5, 1000.125), (0.5, 1000.25)]);
    let near_by = sheets(&[(0.5, 1.0), (0.5, 1.125), (0.5, 1.25)]);
    let [far, near_by] = [far, near_by].map(|(footprints, payloads)| {
        let kind = Kind::Conic;
        let splats = Splats {
            kind,
            footprints: &footprints,
            payloads: &payloads,
            n_payloads: 1,
            surface: &[],
        };
        compose(&splats, Composition::Over, ALL_DEPTHS, &VIEW).distortion
    });
    assert!(near_by[0] > 1e-3);
    assert_eq!(far, near_by);
}

#[test]
fn neither_instructions_nor_the_order_of_input_show_in_means() {
    for composition in [Composition::Normalized(0.2), Composition::Over] {
        for kind in [Kind::Conic, Kind::Planar] {
            let (mut footprints, mut payloads) = match kind {
                Kind::Conic => conics(300),
                Kind::Planar => planars(300),
            };
            let draw = |footprints: &[Words], payloads: &[[f32; 4]], level| {
                let splats = Splats { kind, footprints, payloads, n_payloads: 1, surface: &[] };
                let mut composer = Composer::default();
                composer
                    .compose_with(level, &splats, composition, ALL_DEPTHS, &VIEW, &|_| ())
                    .clone()
            };
            let first = draw(&footprints, &payloads, Level::new());
            assert!(first.distortion.iter().any(|value| *value > 0.0));
            assert_eq!(draw(&footprints, &payloads, Level::baseline()), first);
            footprints.reverse();
            payloads.reverse();
            assert_eq!(draw(&footprints, &payloads, Level::new()), first, "{composition:?}");
        }
    }
}
