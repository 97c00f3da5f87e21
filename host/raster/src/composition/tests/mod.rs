//! Pictures against a slow reference: every splat at every pixel, sorted, in f64.

mod means;

use super::*;
use fearless_simd::Level;

/// Numbers that look random, from 0 to 1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / 16_777_216.0
    }

    fn within(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.next()
    }
}

const ALL_DEPTHS: Depths = Depths { expected: true, median: true, distortion: true };

const VIEW: View = View { size_px: [75, 50], near: 0.1, unit: 1.0, orthographic: false };

fn conics(n: usize) -> (Vec<Words>, Vec<[f32; 4]>) {
    let mut random = Random(7);
    let mut footprints = Vec::new();
    let mut payloads = Vec::new();
    for _ in 0..n {
        let (wide, narrow) = (random.within(0.6, 12.0), random.within(0.55, 3.0));
        let (sin, cos) = random.within(0.0, 3.2).sin_cos();
        let [p, q] = [wide, narrow].map(|s| 1.0 / (s * s));
        let [a, b, c] =
            [p * cos * cos + q * sin * sin, (p - q) * sin * cos, p * sin * sin + q * cos * cos];
        let footprint = Footprint {
            shape: [a, b, c, 0.0],
            distance: [0.0, 0.0, random.within(0.5, 9.0)],
            opacity: random.next(),
            center: [random.within(-5.0, 80.0), random.within(-5.0, 55.0)],
        };
        footprints.push(footprint.words());
        payloads.push([random.next(), random.next(), random.next(), 1.0]);
    }
    (footprints, payloads)
}

fn planars(n: usize) -> (Vec<Words>, Vec<[f32; 4]>) {
    let mut random = Random(11);
    let mut footprints = Vec::new();
    let mut payloads = Vec::new();
    for _ in 0..n {
        let depth = random.within(0.5, 9.0);
        let mut axis = || [0; 3].map(|_| random.within(-0.25, 0.25));
        let (u, v) = (axis(), axis());
        let (slant, step) = ([random.within(-1.2, 1.2), random.within(-1.2, 1.2)], 40.0);
        let row = |i: usize| [u, v].map(|axis| step * (axis[i] + slant[i] * axis[2]));
        let ([a, b], [c, d]) = (row(0), row(1));
        let footprint = Footprint {
            shape: [a, b, c, d],
            distance: [-u[2], -v[2], depth],
            opacity: random.next(),
            center: [37.5 + step * slant[0], 25.0 + step * slant[1]],
        };
        footprints.push(footprint.words());
        payloads.push([random.next(), random.next(), random.next(), 1.0]);
    }
    (footprints, payloads)
}

fn compose(splats: &Splats<'_>, composition: Composition, depths: Depths, view: &View) -> Pictures {
    let mut composer = Composer::default();
    let first = composer.compose(splats, composition, depths, view, &|_| ()).clone();
    // Nothing of a picture stays for the next.
    assert_eq!(*composer.compose(splats, composition, depths, view, &|_| ()), first);
    first
}

/// Opacity and distance of a splat at a pixel.
fn met(kind: Kind, words: &Words, x: f64, y: f64) -> Option<(f64, f64)> {
    let w = words.map(f64::from);
    let (dx, dy) = (x - w[8], y - w[9]);
    let (r2, distance) = match kind {
        Kind::Conic => (w[0] * dx * dx + 2.0 * w[1] * dx * dy + w[2] * dy * dy, w[6]),
        Kind::Planar => {
            // (row - pixel times distance) of (s, t) is pixel times the centre's distance: two equations.
            let (a, b) = (w[0] - dx * w[4], w[1] - dx * w[5]);
            let (c, d) = (w[2] - dy * w[4], w[3] - dy * w[5]);
            let determinant = a * d - b * c;
            let (s, t) = (
                (dx * w[6] * d - b * dy * w[6]) / determinant,
                (a * dy * w[6] - c * dx * w[6]) / determinant,
            );
            let (plane, screen) = (s * s + t * t, 2.0 * (dx * dx + dy * dy));
            match plane <= screen {
                true => (plane, w[4] * s + w[5] * t + w[6]),
                false => (screen, w[6]),
            }
        }
    };
    let opacity = (w[7] * (-0.5 * r2).exp()).min(0.99);
    let is_seen = w[7] * (-0.5 * r2).exp() >= 1.0 / 255.0;
    (is_seen && distance >= f64::from(VIEW.near)).then_some((opacity, distance))
}

/// Colour, expected and median depth of a pixel.
fn reference(
    kind: Kind,
    footprints: &[Words],
    payloads: &[[f32; 4]],
    over: bool,
    [x, y]: [usize; 2],
    end: f64,
) -> ([f64; 4], f64, f64) {
    let mut order: Vec<usize> = (0..footprints.len()).collect();
    order.sort_by(|&i, &j| footprints[i][6].total_cmp(&footprints[j][6]));
    let (mut sums, mut left, mut depth, mut weights, mut median) = ([0.0; 4], 1.0, 0.0, 0.0, 0.0);
    for i in order {
        let (x, y) = (x as f64 + 0.5, y as f64 + 0.5);
        let Some((opacity, distance)) = met(kind, &footprints[i], x, y) else { continue };
        if distance >= end {
            continue;
        }
        let weight = if over { opacity * left } else { opacity };
        if left > 0.5 && left - weight <= 0.5 && over {
            median = distance;
        }
        if over {
            left -= weight;
        }
        for (sum, value) in sums.iter_mut().zip(payloads[i]) {
            *sum += weight * f64::from(value);
        }
        depth += weight * distance;
        weights += weight;
    }
    (sums, if weights > 0.0 { depth / weights } else { 0.0 }, median)
}

/// Largest differences of sums, and share of pixels whose difference is larger than `bound`.
fn differences(
    kind: Kind,
    composition: Composition,
    surface: &[f32],
    bound: f64,
    level: Level,
) -> (f64, f64, Pictures) {
    let (footprints, payloads) = match kind {
        Kind::Conic => conics(300),
        Kind::Planar => planars(300),
    };
    let splats =
        Splats { kind, footprints: &footprints, payloads: &payloads, n_payloads: 1, surface };
    let depths = ALL_DEPTHS;
    let found = Composer::default()
        .compose_with(level, &splats, composition, depths, &VIEW, &|_| ())
        .clone();
    let (mut most, mut wrong) = (0.0f64, 0);
    let [width, height] = VIEW.size_px.map(|side| side as usize);
    for y in 0..height {
        for x in 0..width {
            let at = y * width + x;
            let end = surface.get(at).filter(|end| **end > 0.0);
            let end = end.map_or(f64::INFINITY, |&end| f64::from(end));
            let over = composition == Composition::Over;
            let (sums, depth, _) = reference(kind, &footprints, &payloads, over, [x, y], end);
            let pairs = sums.into_iter().zip(found.sums[0][at]);
            let off = pairs.map(|(a, b)| (a - f64::from(b)).abs()).fold(0.0, f64::max);
            wrong += usize::from(off > bound);
            most = most.max(off);
            // What is left out behind 0.9999 moves the mean of distances up to 9 by as much.
            if over && sums[3] > 0.1 && off <= bound {
                let off = (depth - f64::from(found.expected[at])).abs();
                assert!(off < 0.02, "{x} {y}: {depth} {}", found.expected[at]);
            }
        }
    }
    (most, wrong as f64 / (width * height) as f64, found)
}

/// Where at most 1e-4 of the light is left nothing more is added; rounding of opacities is less.
const OVER_BOUND: f64 = 1.5e-4;

#[test]
fn splats_over_one_another_are_as_in_f64() {
    let [width, height] = VIEW.size_px.map(|side| side as usize);
    let surface: Vec<f32> = (0..width * height).map(|i| [0.0, 4.0][i / 7 % 2]).collect();
    for kind in [Kind::Conic, Kind::Planar] {
        for surface in [&[][..], &surface] {
            let found = differences(kind, Composition::Over, surface, OVER_BOUND, Level::new());
            // A splat of 1/255 may be just seen or just not: of such steps there are few.
            let (most, share, pictures) = found;
            assert!(most < 1.0 / 254.0 && share < 0.004, "{kind:?}: {most} {share}");
            assert!(pictures.counts.visible > 100, "{:?}", pictures.counts);
            assert!(pictures.median.iter().any(|&depth| depth > 0.0));
        }
    }
}

#[test]
fn sums_are_as_in_f64() {
    for kind in [Kind::Conic, Kind::Planar] {
        let (most, share, _) = differences(kind, Composition::Additive, &[], 1e-4, Level::new());
        assert!(most < 1.0 / 254.0 && share < 0.004, "{kind:?}: {most} {share}");
    }
}

#[test]
fn instructions_and_the_order_of_input_show_in_no_bit() {
    let (mut footprints, mut payloads) = conics(300);
    let compose = |footprints: &[Words], payloads: &[[f32; 4]], level| {
        let kind = Kind::Conic;
        let splats = Splats { kind, footprints, payloads, n_payloads: 1, surface: &[] };
        Composer::default()
            .compose_with(level, &splats, Composition::Over, Depths::default(), &VIEW, &|_| ())
            .clone()
    };
    let first = compose(&footprints, &payloads, Level::new());
    assert_eq!(compose(&footprints, &payloads, Level::baseline()), first);
    footprints.reverse();
    payloads.reverse();
    assert_eq!(compose(&footprints, &payloads, Level::new()), first);
}

#[test]
fn chance_tends_to_what_sorting_shows() {
    let sorted = differences(Kind::Conic, Composition::Over, &[], 1.0, Level::new()).2;
    let mean = |samples: u32| -> f64 {
        let composition = Composition::Stochastic(samples);
        let found = differences(Kind::Conic, composition, &[], 1e9, Level::new()).2;
        let pairs = sorted.sums[0].as_flattened().iter().zip(found.sums[0].as_flattened());
        let squares = pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>();
        (squares / sorted.sums[0].as_flattened().len() as f64).sqrt()
    };
    let (few, many) = (mean(4), mean(64));
    // Errors of means fall with the root of their number: a quarter, and less than a fifth of noise on top.
    assert!(few > 0.02 && many < 0.3 * few, "{few} {many}");
}

#[test]
fn opacities_compose_as_theory_says() {
    let covers = |opacity: f32, distance: f32| {
        let shape = [1e-8, 0.0, 1e-8, 0.0];
        Footprint { shape, distance: [0.0, 0.0, distance], opacity, center: [10.0, 10.0] }.words()
    };
    let footprints = [covers(0.5, 3.0), covers(0.25, 1.0), covers(0.8, 2.0)];
    let payloads = [[1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0]];
    let kind = Kind::Conic;
    let splats =
        Splats { kind, footprints: &footprints, payloads: &payloads, n_payloads: 1, surface: &[] };
    let depths = ALL_DEPTHS;
    let found = compose(&splats, Composition::Over, depths, &VIEW);
    let expected = [0.75 * 0.2 * 0.5, 0.25, 0.75 * 0.8, 1.0 - 0.75 * 0.2 * 0.5];
    for (found, expected) in found.sums[0][75 * 10 + 10].iter().zip(expected) {
        assert!((found - expected).abs() < 1e-5, "{found} {expected}");
    }
    assert_eq!(found.median[75 * 10 + 10], 2.0);
    let nearest = compose(&splats, Composition::Nearest, depths, &VIEW);
    assert_eq!(nearest.sums[0][75 * 10 + 10], [0.0, 0.0, 1.0, 1.0]);
}

#[test]
fn what_is_no_footprint_draws_nothing() {
    let good = conics(1).0[0];
    let with = |at: usize, value: f32| {
        let mut words = good;
        words[at] = value;
        words
    };
    let mut bad = Vec::new();
    for at in 0..10 {
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1e30, 1e30] {
            bad.push(with(at, value));
        }
    }
    // Negative definite, a line, all of nothing, of no opacity, behind the eye.
    bad.extend([with(0, -1.0), [1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 5.0, 5.0, 0.0, 0.0]]);
    bad.extend([[0.0; 12], with(7, 0.0), with(7, -1.0), with(6, -1.0), with(6, 0.0)]);
    for kind in [Kind::Conic, Kind::Planar] {
        for composition in [
            Composition::Over,
            Composition::Additive,
            Composition::Nearest,
            Composition::Stochastic(2),
            Composition::Normalized(0.1),
        ] {
            let payloads = vec![[1.0; 4]; bad.len()];
            let splats =
                Splats { kind, footprints: &bad, payloads: &payloads, n_payloads: 1, surface: &[] };
            let depths = ALL_DEPTHS;
            let found = compose(&splats, composition, depths, &VIEW);
            let all = found.sums[0].as_flattened().iter().chain(&found.expected);
            let all = all.chain(&found.median).chain(&found.distortion);
            assert!(all.into_iter().all(|value| value.is_finite()));
        }
    }
    let none =
        Splats { kind: Kind::Conic, footprints: &[], payloads: &[], n_payloads: 1, surface: &[] };
    let found = compose(&none, Composition::Over, Depths::default(), &VIEW);
    assert!(found.sums[0].as_flattened().iter().all(|value| *value == 0.0));
}

/// A number that stands for all bits of pictures but that of distortion.
#[cfg(all(target_os = "linux", target_arch = "x86_64"))]
fn bits(pictures: &Pictures) -> u64 {
    let sums = pictures.sums.iter().flat_map(|sums| sums.as_flattened());
    let all = sums.chain(&pictures.expected).chain(&pictures.median);
    // FNV-1a.
    all.fold(0xcbf2_9ce4_8422_2325, |hash: u64, value| {
        (hash ^ u64::from(value.to_bits())).wrapping_mul(0x0100_0000_01b3)
    })
}

/// What these splats looked like before there were other compositions than these, in each bit. Only where the
/// platform's sine and logarithm, of which the splats are made, are those of then.
#[cfg(all(target_os = "linux", target_arch = "x86_64"))]
#[test]
fn pictures_are_in_each_bit_what_they_were() {
    for (kind, composition, expected) in [
        (Kind::Conic, Composition::Over, 0x4c72_02be_274d_ce0f),
        (Kind::Conic, Composition::Additive, 0x17d1_603f_1ff1_26e4),
        (Kind::Conic, Composition::Nearest, 0x1bb1_f2a2_936a_eb6b),
        (Kind::Conic, Composition::Stochastic(5), 0x2ce1_1d4c_693b_d3e8),
        (Kind::Planar, Composition::Over, 0x797c_cedd_8d30_4823),
        (Kind::Planar, Composition::Additive, 0x8741_0da8_8786_1a91),
        (Kind::Planar, Composition::Nearest, 0xda73_f0f0_e9af_8502),
        (Kind::Planar, Composition::Stochastic(5), 0x3b10_f7a0_f28c_b4d6),
    ] {
        let found = differences(kind, composition, &[], 1.0, Level::new()).2;
        assert_eq!(bits(&found), expected, "{kind:?} {composition:?}");
    }
}
