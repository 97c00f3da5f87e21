//! SOG files that are written come back.

use super::sog_file::Pixels;
use super::*;

/// That positions are as near as 16 bits between their bounds bring them.
#[track_caller]
fn positions_near(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len());
    let logarithm = |number: &f64| number.abs().ln_1p().copysign(*number);
    for axis in 0..3 {
        let along =
            |all: &[f64]| -> Vec<f64> { all.iter().skip(axis).step_by(3).map(logarithm).collect() };
        let (found, expected) = (along(found), along(expected));
        let bound = |all: &[f64], f: fn(f64, f64) -> f64| all.iter().copied().reduce(f).unwrap();
        let step = (bound(&expected, f64::max) - bound(&expected, f64::min)) / 65535.0;
        let off = found.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // Half a step, and what 32-bit floats round.
        assert!(off <= 0.51 * step + 1e-6, "axis {axis}: {off}, a step is {step}");
    }
}

#[test]
fn what_was_read_is_written_as_it_was() {
    for degree in 0..=3 {
        let mut pixels = Pixels::noise(301, degree);
        // Rotations as a writer makes them: the largest is the largest.
        for [a, b, c, _] in &mut pixels.quats {
            [a, b, c].into_iter().for_each(|byte| *byte = 70 + *byte % 115);
        }
        let found = read::<Sog>(&pixels.file()).unwrap();
        let (file, lines) = write::<Sog>(TestCloud::of(&found)).unwrap();
        assert!(lines.is_empty(), "{lines:?}");
        let again = read::<Sog>(&file).unwrap();
        assert!(again.warnings.is_empty(), "{:?}", again.warnings);
        let [header, of_found] = [&again, &found].map(|found| &found.clouds[0].header);
        assert_eq!((&header.format, &header.comments), (&of_found.format, &of_found.comments));
        assert_eq!((header.rows, &header.columns), (of_found.rows, &of_found.columns));
        positions_near(values(&again, "position"), values(&found, "position"));
        near(&again, "splat_scale", values(&found, "splat_scale"));
        near(&again, "splat_rotation", values(&found, "splat_rotation"));
        for column in header.columns.iter().map(|column| column.name.as_str()) {
            if column.starts_with("sh_") || column == "opacity" {
                assert_eq!(values(&again, column), values(&found, column), "{degree}: {column}");
            }
        }
    }
}

#[test]
fn many_sets_of_harmonics_share_entries_and_a_line_says_so() {
    let n = 66_000;
    let number = |i: usize| ((i * 7919 % 66_003) as f32 * 1e-5).sin();
    let rest: Vec<f32> = (0..9 * n).map(|i| number(i + i / 9)).collect();
    let cloud = TestCloud::at((0..3 * n).map(|i| f64::from(number(i))).collect())
        .column("sh_0", 3, Owned::F32(vec![0.5; 3 * n]))
        .column("sh_1", 9, Owned::F32(rest.clone()));
    let (file, lines) = write::<Sog>(cloud).unwrap();
    let said = "66000 Gaussians share 65536 sets of spherical harmonics, as many as SOG holds";
    assert!(lines.iter().any(|line| line == said), "{lines:?}");
    let found = read_columns::<Sog>(&file, &["sh_1"]).unwrap();
    let off = values(&found, "sh_1").iter().zip(&rest).map(|(a, b)| (a - f64::from(*b)).abs());
    let mean = off.sum::<f64>() / rest.len() as f64;
    // A code is off by a quarter of a 255th on average.
    assert!(mean < 2.0 * 0.62 / 255.0 / 4.0, "{mean}");
}

#[test]
fn plain_clouds_become_round_splats_and_none_stay_none() {
    let cloud = TestCloud::at(vec![1.0, -2.0, 3e4, 0.0, 0.5, -7.0])
        .column("radius", 1, Owned::F32(vec![0.5, f32::NAN]))
        .column("color", 3, Owned::U8(vec![255, 0, 128, 1, 2, 3]))
        .column("intensity", 1, Owned::F32(vec![1.0, 2.0]));
    let (file, lines) = write::<Sog>(cloud).unwrap();
    assert!(lines.iter().any(|line| line.contains("no place for `intensity`")), "{lines:?}");
    let found = read::<Sog>(&file).unwrap();
    positions_near(values(&found, "position"), &[1.0, -2.0, 3e4, 0.0, 0.5, -7.0]);
    near(&found, "opacity", &[1.0; 2]);
    let scale = values(&found, "splat_scale");
    assert!((scale[0] - 0.35).abs() < 1e-6 && scale[3] < 1e-30, "{scale:?}");
    for n in [0, 1] {
        let file = write::<Sog>(TestCloud::at(vec![4.0; 3 * n])).unwrap().0;
        let found = read::<Sog>(&file).unwrap();
        assert_eq!(found.clouds[0].header.rows, Some(n as u64));
        near(&found, "position", &vec![4.0; 3 * n]);
    }
}
