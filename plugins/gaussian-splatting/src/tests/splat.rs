//! Records of 32 bytes.

use super::*;

fn record(numbers: [f32; 6], bytes: [u8; 8]) -> Vec<u8> {
    [numbers.map(f32::to_le_bytes).as_flattened(), &bytes].concat()
}

#[test]
fn every_field_is_what_it_stands_for() {
    let first = record([1.0, -2.0, 3.5, 0.1, 0.2, 0.3], [0, 255, 51, 102, 255, 128, 128, 128]);
    let second = record([0.0, 7e6, -0.0, 1.0, 2.0, -4.0], [1, 2, 3, 255, 128, 64, 192, 0]);
    let third = record([0.0; 6], [0, 0, 0, 0, 128, 128, 128, 128]);
    let found = read::<Splat>(&[first, second, third].concat()).unwrap();
    let header = &found.clouds[0].header;
    assert_eq!((header.rows, header.columns.len()), (Some(3), 5));
    assert_eq!(values(&found, "position")[..6], [1.0, -2.0, 3.5, 0.0, 7e6, 0.0]);
    near(&found, "splat_scale", &[0.1, 0.2, 0.3, 1.0, 2.0, 4.0, 0.0, 0.0, 0.0]);
    near(&found, "opacity", &[0.4, 1.0, 0.0]);
    let color = [0.0, 255.0, 51.0, 1.0, 2.0, 3.0, 0.0, 0.0, 0.0];
    near(&found, "sh_0", &color.map(|c| (c / 255.0 - 0.5) / 0.282_094_791_773_878_14));
    let long = 1.5f64.sqrt();
    let second = [-0.5 / long, 0.5 / long, -1.0 / long, 0.0];
    near(&found, "splat_rotation", &[[0.0, 0.0, 0.0, 1.0], second, [0.0, 0.0, 0.0, 1.0]].concat());
}

#[test]
fn what_is_no_splat_file_is_said_to_be_none() {
    let good = record([1.0; 6], [128; 8]);
    for len in (0..160).filter(|len| len % 32 != 0) {
        let line = refusal::<Splat>(&good.repeat(5)[..len]);
        assert!(line.contains(&format!("found {len} bytes")), "{line}");
    }
    for i in 0..6 {
        let mut numbers = [1.0; 6];
        numbers[i] = [f32::NAN, f32::INFINITY][i % 2];
        let odd = record(numbers, [128; 8]);
        assert!(refusal::<Splat>(&[odd.clone(), good.clone()].concat()).contains("no .splat file"));
        // Behind the first it is told, and stands.
        let found = read::<Splat>(&[good.clone(), odd].concat()).unwrap();
        assert_eq!(found.warnings.len(), usize::from(i >= 3));
    }
    assert_eq!(read::<Splat>(&[]).unwrap().clouds[0].header.rows, Some(0));
    damage::<Splat>(&good.repeat(2));
    for seed in 0..50 {
        survives::<Splat>(&noise(32 * 20, seed));
    }
}

#[test]
fn what_was_read_is_written_as_it_was() {
    let mut file: Vec<u8> = (0..500u32)
        .flat_map(|i| {
            let f = i as f32;
            let numbers = [f, -f, 0.1 * f, 0.01 * f, 2.0, 1e-9];
            let q = [(f * 0.7).sin(), (f * 1.1).cos(), (f * 1.7).sin(), (f * 2.3).cos()];
            let length = q.iter().map(|c| c * c).sum::<f32>().sqrt();
            let [a, b, c, d] = q.map(|c| (128.0 + 128.0 * c / length).round().min(255.0) as u8);
            let color = noise(4, u64::from(i) + 3);
            record(numbers, [color[0], color[1], color[2], color[3], a, b, c, d])
        })
        .collect();
    let found = read::<Splat>(&file).unwrap();
    let (mut written, lines) = write::<Splat>(TestCloud::of(&found)).unwrap();
    assert!(lines.is_empty(), "{lines:?}");
    // Rotations are made to have the length 1, by which they move a step at most.
    for bytes in [&mut file, &mut written] {
        for record in bytes.chunks_exact_mut(32) {
            record[28..].iter_mut().for_each(|byte| *byte = (*byte).saturating_add(1) / 3);
        }
    }
    let off = file.iter().zip(&written).map(|(a, b)| a.abs_diff(*b)).max().unwrap();
    assert!(off <= 1, "{off}");
    let same = file.chunks_exact(32).zip(written.chunks_exact(32));
    assert!(same.into_iter().all(|(a, b)| a[..28] == b[..28]));
}

#[test]
fn spherical_harmonics_are_left_out_with_a_line() {
    let cloud = TestCloud::at(vec![1.0, 2.0, 3.0])
        .column("splat_scale", 2, Owned::F32(vec![3.0, 4.0]))
        .column("splat_rotation", 4, Owned::F32(vec![0.0, 0.0, 3.0, 4.0]))
        .column("opacity", 1, Owned::F32(vec![0.5]))
        .column("sh_0", 3, Owned::F32(vec![0.0, 9.0, -9.0]))
        .column("sh_1", 9, Owned::F32(vec![0.0; 9]));
    let (file, lines) = write::<Splat>(cloud).unwrap();
    assert_eq!(lines, ["SPLAT has no place for `sh_1`: left out"]);
    // A half is between two steps; 0.6 is 77 of 128, 0.8 is 102. Flat splats become thin.
    let expected =
        record([1.0, 2.0, 3.0, 3.0, 4.0, 1e-3 * 3.0], [128, 255, 0, 128, 230, 128, 128, 205]);
    assert_eq!(file, expected);
    let (file, lines) = write::<Splat>(TestCloud::at(vec![1.0, 2.0, 3.0])).unwrap();
    assert_eq!(file[12..24], [0.01f32; 3].map(f32::to_le_bytes).concat());
    assert!(lines[0].contains("0.01"), "{lines:?}");
    assert!(write::<Splat>(TestCloud::at(Vec::new())).unwrap().0.is_empty());
    let odd = TestCloud::at(vec![f64::NAN, 0.0, 0.0, 1.0, 2.0, 3.0, 1e300, 0.0, 0.0]).column(
        "splat_scale",
        3,
        Owned::F32(vec![f32::NAN; 9]),
    );
    let (file, lines) = write::<Splat>(odd).unwrap();
    assert!(lines[0].starts_with("2 Gaussians whose places"), "{lines:?}");
    near(&read::<Splat>(&file).unwrap(), "splat_scale", &[0.0; 3]);
}
