//! Packed PLY files made word by word.

use super::*;

const BOUNDS: [&str; 12] = [
    "min_x",
    "min_y",
    "min_z",
    "max_x",
    "max_y",
    "max_z",
    "min_scale_x",
    "min_scale_y",
    "min_scale_z",
    "max_scale_x",
    "max_scale_y",
    "max_scale_z",
];

const COLORS: [&str; 6] = ["min_r", "min_g", "min_b", "max_r", "max_g", "max_b"];

/// The header of a file of so many chunks and Gaussians, with `rest` spherical harmonics.
fn header(chunks: u64, n: u64, colors: bool, rest: usize) -> String {
    let colors = if colors { &COLORS[..] } else { &[] };
    let bounds = BOUNDS.iter().chain(colors).map(|name| format!("property float {name}\n"));
    let packed = ["position", "rotation", "scale", "color"];
    let packed = packed.map(|name| format!("property uint packed_{name}\n")).concat();
    let harmonics = (0..rest).map(|i| format!("property uchar f_rest_{i}\n"));
    let element = if rest > 0 { format!("element sh {n}\n") } else { String::new() };
    format!(
        "ply\nformat binary_little_endian 1.0\ncomment made by hand\nelement chunk {chunks}\n{}element vertex \
         {n}\n{packed}{element}{}end_header\n",
        bounds.collect::<String>(),
        harmonics.collect::<String>(),
    )
}

fn chunk(offset: f32, colors: bool) -> Vec<u8> {
    let bounds = [-1.0, -2.0, -3.0, 1.0, 2.0, 5.0, -4.0, -3.0, -2.0, 0.0, 1.0, 2.0];
    let colors = if colors { &[0.25f32, 0.0, -0.5, 0.75, 1.0, 1.5][..] } else { &[] };
    let bounds = bounds.map(|bound| bound + offset);
    bounds.iter().chain(colors).flat_map(|bound| bound.to_le_bytes()).collect()
}

/// A file of two Gaussians.
pub(super) fn file(degree: usize, colors: bool) -> Vec<u8> {
    let rest = 3 * degree * (degree + 2);
    let words = [
        [0, 0, 0, 0],
        [
            2047 << 21 | 1023 << 11 | 2047,
            2 << 30 | 1023 << 20 | 511 << 10 | 512,
            1024 << 21 | 512 << 11 | 1,
            255 << 24 | 51 << 16 | 102 << 8 | 204,
        ],
    ];
    let words = words.as_flattened().iter().flat_map(|word: &u32| word.to_le_bytes());
    let harmonics = (0..2 * rest).map(|i| (i * 255 / (2 * rest - 1)) as u8);
    [
        header(1, 2, colors, rest).into_bytes(),
        chunk(0.0, colors),
        words.collect(),
        harmonics.collect(),
    ]
    .concat()
}

#[test]
fn every_field_is_what_it_stands_for() {
    for colors in [false, true] {
        let found = read::<CompressedPly>(&file(1, colors)).unwrap();
        let header = &found.clouds[0].header;
        assert_eq!(
            (header.rows, &header.comments[..]),
            (Some(2), &["made by hand".to_owned()][..])
        );
        near(&found, "position", &[-1.0, -2.0, -3.0, 1.0, 2.0, 5.0]);
        near(&found, "opacity", &[0.0, 0.8]);
        let low = [-4.0f64, -3.0, -2.0].map(f64::exp);
        let [a, b, c] = [1024.0 / 2047.0, 512.0 / 1023.0, 1.0 / 2047.0].map(|share| 4.0 * share);
        near(&found, "splat_scale", &[low, [a - 4.0, b - 3.0, c - 2.0].map(f64::exp)].concat());
        let [low, high] = match colors {
            false => [[0.0; 3], [1.0, 0.2, 0.4]],
            true => [[0.25, 0.0, -0.5], [0.75, 0.2, 0.3]],
        };
        let color = [low, high].concat().into_iter().map(|c| (c - 0.5) / 0.282_094_791_773_878_14);
        near(&found, "sh_0", &color.collect::<Vec<_>>());
        // All of the first are -√½, which leaves nothing for w; of the second y is the largest.
        let root = 0.5f64.sqrt();
        let step = root / 1023.0;
        let y = (0.5 - 2.0 * step * step).sqrt();
        let third = -1.0 / 3.0f64.sqrt();
        // In the order w, x, y, z: √½, about 0, the largest, about 0.
        near(&found, "splat_rotation", &[third, third, third, 0.0, -step, y, step, root]);
        // Red, green, blue: nine bytes of each Gaussian, three of each colour.
        let value = |i: usize| match i * 15 {
            0 => -4.0,
            255 => 4.0,
            byte => 8.0 * ((byte as f64 + 0.5) / 256.0 - 0.5),
        };
        let expected = (0..2).flat_map(|gaussian| {
            let coefficients = [(0, -1.0), (1, 1.0), (2, -1.0)];
            coefficients.into_iter().flat_map(move |(k, sign)| {
                [0, 3, 6].map(|channel| sign * value(9 * gaussian + channel + k))
            })
        });
        near(&found, "sh_1", &expected.collect::<Vec<_>>());
    }
}

#[test]
fn gaussians_have_the_bounds_of_their_chunks() {
    let n = 600u32;
    let words = (0..n).flat_map(|i| [i << 21, i, i << 11, i].map(u32::to_le_bytes)).flatten();
    let chunks = [0.0, 10.0, 20.0].map(|offset| chunk(offset, true)).concat();
    let file = [header(3, n.into(), true, 0).into_bytes(), chunks, words.collect()].concat();
    let found = read::<CompressedPly>(&file).unwrap();
    let positions = values(&found, "position");
    for i in [0, 255, 256, 511, 512, 599] {
        let x = -1.0 + 10.0 * f64::from(i / 256) + 2.0 * f64::from(i) / 2047.0;
        assert!((positions[3 * i as usize] - x).abs() < 1e-5, "{i}");
    }
    assert_eq!(found.clouds[0].header.columns.len(), 5);
    assert!(found.warnings.is_empty());
}

#[test]
fn degrees_are_columns_and_odd_ones_are_refused() {
    for degree in 0..=3 {
        let found = read::<CompressedPly>(&file(degree, true)).unwrap();
        assert_eq!(found.clouds[0].header.columns.len(), 5 + degree);
        let only = read_columns::<CompressedPly>(&file(degree, true), &["opacity"]).unwrap();
        assert_eq!(only.clouds[0].columns[1], values(&found, "opacity"));
    }
    for rest in [1, 8, 10, 44, 46, 72] {
        let body = [chunk(0.0, true), vec![0; 16 + rest]].concat();
        let odd = [header(1, 1, true, rest).into_bytes(), body].concat();
        assert!(refusal::<CompressedPly>(&odd).contains("9, 24 or 45"));
    }
}

#[test]
fn damaged_files_do_no_harm() {
    let file = file(1, true);
    let (cut, _) = damage::<CompressedPly>(&file);
    assert_eq!(cut, 0);
    // Bounds that are no numbers.
    let start = file.len() - 18 - 32 - 72;
    let mut damaged = file;
    damaged[start..start + 72].fill(0xff);
    let found = read::<CompressedPly>(&damaged).unwrap();
    assert!(found.warnings[0].contains("2 Gaussians have sizes or colours that are no numbers"));
    assert!(values(&found, "splat_scale").iter().all(|scale| *scale == 0.0));
}

#[test]
fn announced_numbers_and_odd_headers_are_refused() {
    let with =
        |header: String| refusal::<CompressedPly>(&[header.into_bytes(), vec![0; 200]].concat());
    for n in [300, 1 << 40, u64::MAX] {
        assert!(with(header(n.div_ceil(256), n, true, 9)).contains("cut short"));
    }
    assert!(with(header(2, 1, true, 0)).contains("expected 1 chunks"));
    let good = header(1, 1, true, 9);
    for (from, to, word) in [
        ("ply\n", "plz\n", "`ply`"),
        ("binary_little_endian", "ascii", "binary_little_endian"),
        ("float min_x", "double min_x", "`property float min_x`"),
        ("max_g", "other", "max_g"),
        ("packed_scale", "other", "packed_scale"),
        ("chunk 1", "chonk 1", "`chunk`"),
        ("vertex 1", "vertex -1", "line 23"),
        ("sh 1", "sh 2", "spherical harmonics of 1"),
        ("property uint packed_color", "property list uchar int packed_color", "line 27"),
        ("end_header", "end_of_it", "line"),
    ] {
        assert!(good.contains(from), "{from}");
        let line = with(good.replace(from, to));
        assert!(line.contains(word), "{word}: {line}");
    }
    assert!(
        refusal::<CompressedPly>(&[b"ply\n", &b"\n".repeat(1 << 17)[..]].concat()).contains("end")
    );
    let usual =
        "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nend_header\n";
    assert!(with(usual.to_owned()).contains("no compressed PLY"));
}
