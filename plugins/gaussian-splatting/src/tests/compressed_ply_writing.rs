//! Packed PLY files that are written come back within their steps.

use super::*;

/// The numbers of 0 to `n`, shuffled.
fn shuffled(n: usize) -> Vec<usize> {
    let bytes = noise(8 * n, 5);
    let (words, _) = bytes.as_chunks::<8>();
    let mut keyed: Vec<(u64, usize)> =
        words.iter().map(|word| u64::from_le_bytes(*word)).zip(0..).collect();
    keyed.sort_unstable();
    keyed.into_iter().map(|(_, number)| number).collect()
}

/// Numbers of this range that look random.
fn numbers(n: usize, seed: u64, low: f32, high: f32) -> Vec<f32> {
    noise(n, seed).iter().map(|byte| low + f32::from(*byte) / 255.0 * (high - low)).collect()
}

/// Gaussians on a lattice of 10 x 10 x 10, in no order, and the corner where each stands.
fn lattice(degree: usize) -> (TestCloud, Vec<usize>) {
    let places = shuffled(1000);
    let at = |i: usize| [i % 10, i / 10 % 10, i / 100].map(|number| number as f64);
    let mut cloud = TestCloud::at(places.iter().flat_map(|i| at(*i)).collect())
        .column("opacity", 1, Owned::F32(numbers(1000, 1, 0.0, 1.0)))
        .column("splat_scale", 3, Owned::F32(numbers(3000, 2, 0.01, 2.0)))
        .column("splat_rotation", 4, Owned::F32(numbers(4000, 3, -1.0, 1.0)))
        .column("sh_0", 3, Owned::F32(numbers(3000, 4, -2.0, 3.0)));
    for order in 1..=degree {
        let n = 3 * (2 * order + 1);
        let values = Owned::F32(numbers(n * 1000, 7, -4.0, 4.0));
        cloud = cloud.column(&format!("sh_{order}"), n as u32, values);
    }
    (cloud, places)
}

/// A column, its components, the most that it may be off by, and what of its values that is of.
type Check<'a> = (&'a str, usize, f64, &'a dyn Fn(f64) -> f64);

#[test]
fn what_is_written_comes_back_within_its_steps() {
    for degree in 0..=3 {
        let (cloud, places) = lattice(degree);
        let (file, lines) = write::<CompressedPly>(cloud.clone()).unwrap();
        assert!(lines.is_empty(), "{lines:?}");
        let found = read::<CompressedPly>(&file).unwrap();
        assert_eq!(found.clouds[0].header.rows, Some(1000));
        assert_eq!(found.clouds[0].header.columns.len(), 5 + degree);
        let mut of_corner = vec![usize::MAX; 1000];
        for (i, corner) in places.iter().enumerate() {
            of_corner[*corner] = i;
        }
        // The largest steps that bounds over all of a column can leave; halves of them, as all is rounded.
        let log = |value: f64| value.max(1e-9).ln();
        let whole = |value: f64| value;
        let color_step = 0.5 * 5.0 / 255.0;
        let checks: [Check<'_>; 3] = [
            ("opacity", 1, 0.5 / 255.0, &whole),
            ("splat_scale", 3, 0.5 * (200f64).ln() / 1023.0, &log),
            ("sh_0", 3, color_step, &whole),
        ];
        let sources: Vec<(&str, &Owned)> =
            cloud.header.columns.iter().map(|c| c.name.as_str()).zip(&cloud.columns).collect();
        let source = |wanted: &str| {
            let (_, column) = sources.iter().find(|(name, _)| *name == wanted).unwrap();
            let Owned::F32(column) = column else { panic!("{wanted}") };
            column
        };
        let (positions, _) = values(&found, "position").as_chunks::<3>();
        let mut met = [false; 1000];
        for (k, position) in positions.iter().enumerate() {
            let [x, y, z] = position.map(|number| number.round() as usize);
            let off = position.iter().map(|number| (number - number.round()).abs());
            assert!(off.fold(0.0, f64::max) <= 0.5 * 9.0 / 1023.0 + 1e-6, "{position:?}");
            let i = of_corner[x + 10 * y + 100 * z];
            assert!(!std::mem::replace(&mut met[i], true), "{position:?} twice");
            for (name, n, step, map) in &checks {
                for c in 0..*n {
                    let expected = map(f64::from(source(name)[n * i + c]));
                    let off = (map(values(&found, name)[n * k + c]) - expected).abs();
                    assert!(off <= step + 1e-5, "{name}: off by {off}, {step} is a step");
                }
            }
            let q: [f64; 4] = std::array::from_fn(|c| source("splat_rotation")[4 * i + c].into());
            let length = q.iter().map(|c| c * c).sum::<f64>().sqrt();
            let again = &values(&found, "splat_rotation")[4 * k..4 * k + 4];
            let turn: f64 = q.iter().zip(again).map(|(a, b)| a * b / length).sum();
            // Three components off by half a step of √2/1023, and the largest with them.
            assert!(turn.abs() > 1.0 - 2e-6, "{q:?} {again:?}");
            for order in 1..=degree {
                let (name, n) = (format!("sh_{order}"), 3 * (2 * order + 1));
                for c in 0..n {
                    let expected = f64::from(source(&name)[n * i + c]);
                    let off = (values(&found, &name)[n * k + c] - expected).abs();
                    assert!(off <= 1.0 / 64.0 + 1e-6, "{name}: {off}");
                }
            }
        }
        assert!(met.iter().all(|met| *met));
    }
}

/// Along a Z-curve a chunk of 256 on a lattice of 16 has 8 x 8 x 4 of it: steps are half of those across all.
#[test]
fn steps_are_those_of_neighbours_whatever_the_order() {
    let place = |i: &usize| [i % 16, i / 16 % 16, i / 256].map(|number| 100.0 * number as f64);
    let cloud = TestCloud::at(shuffled(4096).iter().flat_map(place).collect());
    let (file, _) = write::<CompressedPly>(cloud).unwrap();
    let found = read::<CompressedPly>(&file).unwrap();
    let off = values(&found, "position").iter().map(|number| {
        let lattice = (number / 100.0).round() * 100.0;
        (number - lattice).abs()
    });
    let off = off.fold(0.0, f64::max);
    assert!(off < 0.5 * 700.0 / 1023.0 + 1e-3, "{off}");
}

#[test]
fn files_have_the_header_that_other_programs_read() {
    let mut cloud = TestCloud::at(vec![1.0, 2.0, 3.0])
        .column("splat_scale", 3, Owned::F32(vec![1.0; 3]))
        .column("sh_0", 3, Owned::F32(vec![0.0; 3]))
        .column("sh_1", 9, Owned::F32(vec![0.0; 9]));
    cloud.header.comments = vec!["trained with antialiasing".to_owned(), "of somebody".to_owned()];
    let file = write::<CompressedPly>(cloud).unwrap().0;
    let header = "ply\nformat binary_little_endian 1.0\ncomment trained with antialiasing\n\
        element chunk 1\nproperty float min_x\nproperty float min_y\nproperty float min_z\n\
        property float max_x\nproperty float max_y\nproperty float max_z\n\
        property float min_scale_x\nproperty float min_scale_y\nproperty float min_scale_z\n\
        property float max_scale_x\nproperty float max_scale_y\nproperty float max_scale_z\n\
        property float min_r\nproperty float min_g\nproperty float min_b\n\
        property float max_r\nproperty float max_g\nproperty float max_b\n\
        element vertex 1\nproperty uint packed_position\nproperty uint packed_rotation\n\
        property uint packed_scale\nproperty uint packed_color\n\
        element sh 1\nproperty uchar f_rest_0\nproperty uchar f_rest_1\nproperty uchar f_rest_2\n\
        property uchar f_rest_3\nproperty uchar f_rest_4\nproperty uchar f_rest_5\n\
        property uchar f_rest_6\nproperty uchar f_rest_7\nproperty uchar f_rest_8\nend_header\n";
    assert_eq!(String::from_utf8_lossy(&file[..header.len()]), header);
    let floats = [1.0f32, 2.0, 3.0, 1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0].into_iter();
    let body = floats.chain([0.5; 6]).flat_map(f32::to_le_bytes);
    // No rotation: w is the largest, of place 0, and the others are 0, half of 1023.
    let words = [0u32, 512 << 20 | 512 << 10 | 512, 0, 255].map(u32::to_le_bytes);
    let body: Vec<u8> = body.chain(words.concat()).chain([128; 9]).collect();
    assert_eq!(file[header.len()..], body);
}

#[test]
fn what_cannot_be_held_is_said() {
    let far = [0.0, 1.0, 2.0, f64::NAN, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0];
    let mut cloud = TestCloud::at(far.to_vec())
        .column(
            "splat_scale",
            3,
            Owned::F32([[1.0, 0.0, 1.0], [1.0; 3], [1e12; 3], [1.0; 3]].concat()),
        )
        .column("sh_0", 3, Owned::F32(vec![f32::NAN; 12]))
        .column("sh_1", 9, Owned::F32([[0.0; 27].as_slice(), &[5.0; 8], &[f32::NAN]].concat()))
        .column("label", 1, Owned::U8(vec![1, 2, 3, 4]));
    cloud.header.has_faces = true;
    let (file, lines) = write::<CompressedPly>(cloud).unwrap();
    for part in [
        "`label`",
        "triangles",
        "1 Gaussians whose places",
        "3 Gaussians have sizes or colours beyond what compressed PLY holds",
    ] {
        assert!(lines.iter().any(|line| line.contains(part)), "{part}: {lines:?}");
    }
    assert_eq!(lines.len(), 4, "{lines:?}");
    let found = read::<CompressedPly>(&file).unwrap();
    assert!(found.warnings.is_empty(), "{:?}", found.warnings);
    let off =
        values(&found, "position").iter().zip([0.0, 1.0, 2.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0]);
    let off = off.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(values(&found, "position").len() == 9 && off <= 0.5 * 9.0 / 1023.0 + 1e-6, "{off}");
    assert!(values(&found, "sh_0").iter().all(|value| value.abs() < 0.01));
    assert_eq!(values(&found, "sh_1")[18..20], [4.0, 4.0]);
    let sizes = values(&found, "splat_scale");
    assert!((sizes[1].ln() + 20.0).abs() < 0.1 && (sizes[3].ln() - 20.0).abs() < 0.1, "{sizes:?}");
}

#[test]
fn clouds_of_no_point_and_of_one_come_back() {
    let (file, _) = write::<CompressedPly>(TestCloud::at(Vec::new())).unwrap();
    assert_eq!(read::<CompressedPly>(&file).unwrap().clouds[0].header.rows, Some(0));
    let place = vec![7e6, 5e5, -1e-3];
    let (file, lines) = write::<CompressedPly>(TestCloud::at(place)).unwrap();
    assert!(lines[0].contains("0.01"), "{lines:?}");
    near(&read::<CompressedPly>(&file).unwrap(), "position", &[7e6, 5e5, -1e-3]);
}
