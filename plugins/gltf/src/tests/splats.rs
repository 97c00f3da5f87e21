//! Points that are Gaussian splats.

use super::*;
use surfelshop_api::glam::{DMat3, DMat4, DQuat, DVec3};
use surfelshop_geometry::harmonics::basis;

const N: usize = 5;

/// Numbers between -1 and 1 in no order.
fn noise(seed: usize) -> f32 {
    ((seed as f32 * 12.9898).sin() * 437.585_45).fract()
}

/// Splats as files have them.
struct Splats {
    degree: usize,
    positions: Vec<f32>,
    rotations: Vec<f32>,
    scales: Vec<f32>,
    opacities: Vec<f32>,
    /// Of each coefficient three numbers of each splat.
    harmonics: Vec<Vec<f32>>,
}

impl Splats {
    fn new(degree: usize) -> Self {
        let numbers = |n: usize, seed: usize| (0..n).map(|i| noise(seed + i)).collect::<Vec<_>>();
        let mut rotations = numbers(4 * N, 1000);
        for q in rotations.as_chunks_mut::<4>().0 {
            let length = q.iter().map(|c| c * c).sum::<f32>().sqrt();
            q.iter_mut().for_each(|c| *c /= length);
        }
        let n = (degree + 1) * (degree + 1);
        Self {
            degree,
            positions: numbers(3 * N, 0),
            rotations,
            scales: numbers(3 * N, 2000).iter().map(|s| s.abs() + 0.01).collect(),
            opacities: numbers(N, 3000).iter().map(|o| o.abs()).collect(),
            harmonics: (0..n).map(|k| numbers(3 * N, 4000 + 100 * k)).collect(),
        }
    }

    /// The attributes of a primitive of them.
    fn attributes(&self, file: &mut Builder) -> String {
        let mut found = format!(
            r#""POSITION":{},"KHR_gaussian_splatting:ROTATION":{},"KHR_gaussian_splatting:SCALE":{},"KHR_gaussian_splatting:OPACITY":{}"#,
            file.floats(&self.positions, "VEC3"),
            file.floats(&self.rotations, "VEC4"),
            file.floats(&self.scales, "VEC3"),
            file.floats(&self.opacities, "SCALAR"),
        );
        for l in 0..=self.degree {
            for k in 0..=2 * l {
                let accessor = file.floats(&self.harmonics[l * l + k], "VEC3");
                found += &format!(r#","KHR_gaussian_splatting:SH_DEGREE_{l}_COEF_{k}":{accessor}"#);
            }
        }
        found
    }

    /// A file in which a node of this JSON shows them.
    fn file(&self, node: &str, extension: &str) -> Builder {
        let mut file = Builder::default();
        let attributes = self.attributes(&mut file);
        file.root(r#""extensionsUsed":["KHR_gaussian_splatting"],"extensionsRequired":["KHR_gaussian_splatting"]"#);
        let primitive = format!(
            r#"{{"mode":0,"attributes":{{{attributes}}},"extensions":{{"KHR_gaussian_splatting":{{{extension}}}}}}}"#
        );
        file.root(&format!(r#""meshes":[{{"primitives":[{primitive}]}}]"#));
        file.root(&format!(r#""nodes":[{{"mesh":0{node}}}],"scenes":[{{"nodes":[0]}}],"scene":0"#));
        file
    }

    fn covariance(&self, splat: usize) -> DMat3 {
        let number = |values: &[f32], i: usize| f64::from(values[i]);
        let q = [0, 1, 2, 3].map(|i| number(&self.rotations, 4 * splat + i));
        let s = [0, 1, 2].map(|i| number(&self.scales, 3 * splat + i));
        spread(q, s)
    }

    /// The colour in a direction, by the words of the extension: with the Condon-Shortley sign.
    fn color(&self, splat: usize, d: DVec3) -> DVec3 {
        let (y, mut sum) = (basis(d), DVec3::splat(0.5));
        for l in 0..=self.degree {
            for k in 0..=2 * l {
                let sign = if (l + k) % 2 == 1 { -1.0 } else { 1.0 };
                let c = &self.harmonics[l * l + k][3 * splat..];
                let c = DVec3::new(c[0].into(), c[1].into(), c[2].into());
                sum += sign * y[l * l + k] * c;
            }
        }
        sum
    }
}

fn spread(q: [f64; 4], s: [f64; 3]) -> DMat3 {
    let c = DMat3::from_quat(DQuat::from_array(q).normalize())
        * DMat3::from_diagonal(DVec3::from_array(s));
    c * c.transpose()
}

fn found_color(found: &Collected, splat: usize, degree: usize, d: DVec3) -> DVec3 {
    let (y, mut sum) = (basis(d), DVec3::splat(0.5));
    for l in 0..=degree {
        let n = 3 * (2 * l + 1);
        let own = &values(found, ["sh_0", "sh_1", "sh_2", "sh_3"][l])[n * splat..n * (splat + 1)];
        for (c, y) in own.as_chunks::<3>().0.iter().zip(&y[l * l..]) {
            sum += *y * DVec3::from_array(*c);
        }
    }
    sum
}

const USUAL: &str = r#""kernel":"ellipse","colorSpace":"srgb_rec709_display""#;

#[test]
fn splats_are_columns_with_the_numbers_of_the_file() {
    for degree in 0..=3 {
        let splats = Splats::new(degree);
        let found = splats.file("", USUAL).found();
        assert!(found.warnings.is_empty(), "{:?}", found.warnings);
        assert_eq!(only(&found).header.columns.len(), 5 + degree);
        for (name, numbers) in [
            ("position", &splats.positions),
            ("splat_rotation", &splats.rotations),
            ("splat_scale", &splats.scales),
            ("opacity", &splats.opacities),
            ("sh_0", &splats.harmonics[0]),
        ] {
            let numbers: Vec<f64> = numbers.iter().map(|number| f64::from(*number)).collect();
            assert_eq!(values(&found, name), numbers, "{name}");
        }
        for i in 0..N {
            let d = DVec3::new(0.3, -0.7, 0.4 + i as f64).normalize_or(DVec3::Z);
            let error = found_color(&found, i, degree, d) - splats.color(i, d);
            assert!(error.length() < 1e-6, "{error}");
        }
    }
}

#[test]
fn nodes_move_turn_and_stretch_splats() {
    let turned = r#","rotation":[0.5,0.5,-0.5,0.5],"translation":[1,2,3]"#;
    for (node, is_round) in [
        (format!(r#"{turned},"scale":[2,2,2]"#), true),
        (turned.to_owned(), true),
        (format!(r#"{turned},"scale":[3,1,0.25]"#), false),
        // A mirror, and one that stretches.
        (format!(r#"{turned},"scale":[-1,1,1]"#), true),
        (format!(r#"{turned},"scale":[1,-2,1]"#), false),
        (r#","matrix":[1,0,0,0,0.5,1,0,0,0,0,2,0,0,0,0,1]"#.to_owned(), false),
    ] {
        let splats = Splats::new(3);
        let file = splats.file(&node, USUAL);
        let found = file.found();
        let json: gltf::json::Node =
            gltf::json::deserialize::from_str(&format!("{{{}}}", &node[1..])).unwrap();
        let matrix = match json.matrix {
            Some(columns) => DMat4::from_cols_array(&columns.map(f64::from)),
            None => {
                let scale = json.scale.map_or(DVec3::ONE, |s| DVec3::from_array(s.map(f64::from)));
                let q = DQuat::from_array(json.rotation.unwrap().0.map(f64::from));
                DMat4::from_scale_rotation_translation(scale, q, DVec3::new(1.0, 2.0, 3.0))
            }
        };
        let linear = DMat3::from_mat4(matrix);
        for i in 0..N {
            let at = DVec3::from_slice(&[0, 1, 2].map(|k| f64::from(splats.positions[3 * i + k])));
            let error = DVec3::from_slice(&values(&found, "position")[3 * i..])
                - matrix.transform_point3(at);
            assert!(error.length() < 1e-12, "{node}: {error}");
            let q = values(&found, "splat_rotation")[4 * i..].first_chunk().unwrap();
            let s = values(&found, "splat_scale")[3 * i..].first_chunk().unwrap();
            assert!(s.iter().all(|s| *s > 0.0), "{node}: {s:?}");
            let expected = linear * splats.covariance(i) * linear.transpose();
            let off = (spread(*q, *s) - expected).to_cols_array();
            let largest = expected.to_cols_array().iter().fold(0.0f64, |most, c| most.max(c.abs()));
            assert!(off.iter().all(|c| c.abs() < 1e-5 * largest), "{node}: {off:?}");
            for k in 0..8 {
                let d = DVec3::new(noise(k).into(), noise(k + 50).into(), noise(k + 90).into());
                let (from, to) = (d.normalize_or(DVec3::Z), (linear * d).normalize_or(DVec3::Z));
                if is_round {
                    let error = found_color(&found, i, 3, to) - splats.color(i, from);
                    assert!(error.length() < 1e-5, "{node}: {error}");
                }
            }
        }
        // Colours turn as much as they can without being stretched: their sums of squares stay.
        let squares = |values: &[f64]| values.iter().map(|c| c * c).sum::<f64>();
        let before: Vec<f64> =
            splats.harmonics[4..9].concat().iter().map(|c| f64::from(*c)).collect();
        let (before, after) = (squares(&before), squares(values(&found, "sh_2")));
        assert!((before - after).abs() < 1e-5 * before, "{node}: {before} {after}");
    }
}

#[test]
fn whole_numbers_stand_for_shares() {
    let splats = Splats::new(0);
    let mut file = splats.file("", USUAL);
    let json = file.json("");
    let opacity = file.accessor(
        &[0, 51, 102, 204, 255, 0, 0, 0][..5],
        UNSIGNED_BYTE,
        "SCALAR",
        N,
        r#","normalized":true"#,
    );
    let q: Vec<u8> = [0i8, 0, 127, 0].repeat(N).iter().map(|c| c.to_le_bytes()[0]).collect();
    let rotation = file.accessor(&q, BYTE, "VEC4", N, r#","normalized":true"#);
    let scale = file.accessor(&[1, 2, 3].repeat(N), UNSIGNED_BYTE, "VEC3", N, "");
    assert!(json.contains(r#"ROTATION":1,"#));
    let rest: String = file.rest.join(",");
    let rest = rest
        .replace(r#"ROTATION":1,"#, &format!(r#"ROTATION":{rotation},"#))
        .replace(r#"SCALE":2,"#, &format!(r#"SCALE":{scale},"#))
        .replace(r#"OPACITY":3,"#, &format!(r#"OPACITY":{opacity},"#));
    file.rest = vec![rest];
    let found = file.found();
    near(values(&found, "opacity"), &[0.0, 0.2, 0.4, 0.8, 1.0]);
    assert_eq!(values(&found, "splat_rotation")[..4], [0.0, 0.0, 1.0, 0.0]);
    assert_eq!(values(&found, "splat_scale")[..3], [1.0, 2.0, 3.0]);
}

#[test]
fn what_is_beside_splats_or_missing_is_told() {
    let splats = Splats::new(1);
    // Kernels and colours of other extensions.
    let found = splats.file("", r#""kernel":"cube","colorSpace":"lin_rec709_display""#).found();
    assert!(
        found.warnings[0].contains("`cube`") && found.warnings[1].contains("`lin_rec709_display`")
    );
    let mut file = splats.file("", USUAL);
    let points = file.floats(&[0.0; 9], "VEC3");
    let rest = file.rest.join(",");
    let triangle = format!(r#""primitives":[{{"attributes":{{"POSITION":{points}}}}},{{"mode":0"#);
    file.rest = vec![rest.replace(r#""primitives":[{"mode":0"#, &triangle)];
    let found = file.found();
    assert_eq!(only(&found).header.rows, Some(N as u64));
    assert!(!only(&found).header.has_faces);
    assert!(found.warnings[0].contains("1 primitives beside Gaussians"), "{:?}", found.warnings);
    for missing in ["ROTATION", "OPACITY", "SCALE"] {
        let mut file = splats.file("", USUAL);
        file.rest = vec![file.rest.join(",").replace(&format!(":{missing}"), ":OTHER")];
        let found = file.found();
        assert_eq!(only(&found).header.columns.len(), 1);
        assert!(found.warnings[0].contains("were read as points"), "{:?}", found.warnings);
    }
    // An order that is not whole ends them.
    let mut file = splats.file("", USUAL);
    file.rest = vec![file.rest.join(",").replace("DEGREE_1_COEF_2", "DEGREE_1_COEF_9")];
    assert!(only(&file.found()).header.column("sh_1").is_none());
}

/// A scene whose numbers an extension packs, in a view of these bytes.
fn packed(name: &str, stream: &[u8], degree: usize) -> Builder {
    let mut file = Splats::new(degree).file("", "");
    for json in &mut file.accessors {
        let (_, rest) = json.split_once(',').unwrap();
        *json = format!("{{{rest}");
    }
    let view = file.view(stream, "");
    let inside = format!(r#"{USUAL},"extensions":{{"{name}":{{"bufferView":{view}}}}}"#);
    let of = format!(r#""KHR_gaussian_splatting":{{{inside}}}"#);
    file.rest = vec![file.rest.join(",").replace(r#""KHR_gaussian_splatting":{}"#, &of)];
    file
}

/// A stream of SPZ of so many Gaussians: byte `k` of the attributes is `k` times a number.
fn spz(version: u32, n: u32, degree: u8, factor: usize) -> Vec<u8> {
    use std::io::Write;
    let rotation = if version < 3 { 3 } else { 4 };
    let rest = 3 * usize::from(degree) * (usize::from(degree) + 2);
    let mut bytes = b"NGSP".to_vec();
    bytes.extend(version.to_le_bytes());
    bytes.extend(n.to_le_bytes());
    bytes.extend([degree, 12, 0, 0]);
    bytes.extend((0..n as usize * (9 + 1 + 3 + 3 + rotation + rest)).map(|k| (k * factor) as u8));
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    packed.write_all(&bytes).unwrap();
    packed.finish().unwrap()
}

const SPZ_2: &str = "KHR_gaussian_splatting_compression_spz_2";

#[test]
fn splats_that_are_packed_as_spz_are_unpacked() {
    for (version, degree) in [(2, 0), (2, 3), (3, 1), (3, 2)] {
        let file = packed(SPZ_2, &spz(version, N as u32, degree, 7), degree.into());
        let found = file.found();
        assert_eq!(only(&found).header.columns.len(), 4 + usize::from(degree) + 1);
        // The bytes of splat 1, by the words of the format.
        let byte = |at: usize| (at * 7) as u8;
        let whole = |axis: usize| {
            let at = 9 + 3 * axis;
            let bytes = [0, byte(at), byte(at + 1), byte(at + 2)];
            f64::from(i32::from_le_bytes(bytes) >> 8) / 4096.0
        };
        let expected = [-whole(0), whole(1), -whole(2)];
        assert_eq!(values(&found, "position")[3..6], expected, "{version}");
        let opacities = 9 * N;
        let opacity = f64::from(byte(opacities + 1)) / 255.0;
        assert!((values(&found, "opacity")[1] - opacity).abs() < 1e-6);
        let color = (f64::from(byte(opacities + N + 3)) / 255.0 - 0.5) / 0.15;
        assert!((values(&found, "sh_0")[3] - color).abs() < 1e-5);
        let scale = (f64::from(byte(opacities + 4 * N + 3)) / 16.0 - 10.0).exp();
        assert!((values(&found, "splat_scale")[3] / scale - 1.0).abs() < 1e-5);
        let q = &values(&found, "splat_rotation")[4..8];
        assert!((q.iter().map(|c| c * c).sum::<f64>() - 1.0).abs() < 1e-5, "{q:?}");
        if degree > 0 {
            let start = opacities + 7 * N + if version < 3 { 3 * N } else { 4 * N };
            let n = usize::from(degree) * (usize::from(degree) + 2);
            let stored = |k: usize| (f64::from(byte(start + 3 * (n + k))) - 128.0) / 128.0;
            // m = -1, 0 and 1 are y, z and x: axes turn two, and the Condon-Shortley sign the first and the last.
            let expected = [-stored(0), -stored(1), stored(2)];
            let own = [0, 3, 6].map(|k| values(&found, "sh_1")[9 + k]);
            assert_eq!(own, expected, "{version}");
        }
    }
}

#[test]
fn turned_axes_turn_rotations_along() {
    // A quarter turn about x, as version 3 has it: w is the largest, x as large.
    let half = 511;
    let bits: u32 = (3 << 30) | (half << 20);
    let mut bytes = b"NGSP".to_vec();
    bytes.extend([3u32.to_le_bytes(), (N as u32).to_le_bytes()].concat());
    bytes.extend([0, 12, 0, 0]);
    bytes.extend(vec![0; 16 * N]);
    (0..N).for_each(|_| bytes.extend(bits.to_le_bytes()));
    let mut stream = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    std::io::Write::write_all(&mut stream, &bytes).unwrap();
    let found = packed(SPZ_2, &stream.finish().unwrap(), 0).found();
    let q = DQuat::from_slice(&values(&found, "splat_rotation")[..4]);
    let flip = DMat3::from_diagonal(DVec3::new(-1.0, 1.0, -1.0));
    let own = DMat3::from_rotation_x(std::f64::consts::FRAC_PI_2);
    let off = (DMat3::from_quat(q) - flip * own * flip).to_cols_array();
    assert!(off.iter().all(|number| number.abs() < 1e-3), "{q:?}");
}

#[test]
fn packed_splats_that_cannot_be_are_refused_with_what_to_do() {
    let stream = spz(2, N as u32, 0, 7);
    let other = "KHR_gaussian_splatting_compression_other";
    let line = packed(other, &stream, 0).refusal();
    assert!(line.contains(other) && line.contains(".spz file"), "{line}");
    // Where the numbers are there, too, they are read.
    let inside = format!(r#"{USUAL},"extensions":{{"{other}":{{"bufferView":0}}}}"#);
    assert_eq!(only(&Splats::new(0).file("", &inside).found()).header.columns.len(), 5);
    for (stream, words) in [
        (spz(2, N as u32 + 1, 0, 7), "expected 5 of them, found 6"),
        (spz(1, N as u32, 0, 7), "version 2 or 3"),
        (spz(2, N as u32, 4, 7), "degree 0 to 3"),
        (stream[..stream.len() - 20].to_vec(), "ends or is damaged"),
        (b"NGSP".to_vec(), "ends or is damaged"),
        (Vec::new(), "ends or is damaged"),
    ] {
        let line = packed(SPZ_2, &stream, 0).refusal();
        assert!(line.contains("packed Gaussians: ") && line.contains(words), "{line}");
        assert!(!line.contains('\n'), "{line}");
    }
}
