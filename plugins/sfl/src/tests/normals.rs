//! Codes of normals.

use super::clouds::Numbers;
use crate::surfel::normal_code::Cube;
use surfelshop_api::glam::DVec3;

/// The axis of a face: z, y, x.
fn major(face: u32) -> usize {
    2 - face as usize
}

#[test]
fn every_code_of_16_bits_is_a_unit_vector_of_its_face() {
    for code in 0..1_u32 << 16 {
        let (face, is_negative) = (code >> 14, code >> 13 & 1 == 1);
        let normal = Cube::Cub16.decode(code);
        if face == 3 {
            assert_eq!(normal, (!is_negative).then_some(DVec3::ZERO), "{code:#06x}");
            continue;
        }
        let normal = normal.unwrap();
        assert!((normal.length() - 1.0).abs() < 1e-15, "{code:#06x}: {normal}");
        let largest = normal[major(face)];
        assert_eq!(largest < 0.0, is_negative, "{code:#06x}: {normal}");
        assert!(normal.abs().max_element() <= largest.abs(), "{code:#06x}: {normal}");
    }
}

/// Whether the code of a decoded code is itself, or, on an edge of the cube, one of the same direction.
fn comes_back(cube: Cube, bits: u32, code: u32) {
    let unused = 1 << (2 * bits);
    let code = code & !unused;
    assert_eq!(cube.decode(code | unused), cube.decode(code), "the unused bit says nothing");
    let Some(normal) = cube.decode(code) else { return };
    let again = cube.encode(normal);
    let last = (1 << bits) - 1;
    let is_edge = [code & last, code >> bits & last].iter().any(|&u| u == 0 || u == last);
    if normal == DVec3::ZERO {
        assert_eq!(again >> (2 * bits + 1), 3 << 1, "{code:#x}");
    } else if is_edge {
        assert!((cube.decode(again).unwrap() - normal).length() < 1e-15, "{code:#x}: {again:#x}");
    } else {
        assert_eq!(again, code, "{normal}");
        // Columns have 32-bit floats.
        assert_eq!(cube.encode(normal.as_vec3().as_dvec3()), code, "{normal}");
    }
}

#[test]
fn codes_of_decoded_codes_are_the_same() {
    for code in 0..1 << 16 {
        comes_back(Cube::Cub16, 6, code);
    }
    let mut numbers = Numbers(1);
    for _ in 0..50_000 {
        comes_back(Cube::Cub32, 14, numbers.next() as u32);
    }
    for edge in [0, 1, 0x3ffe, 0x3fff, 0x3fff << 14, 0x0fff_ffff, 0xffff_ffff] {
        comes_back(Cube::Cub32, 14, edge);
    }
}

#[test]
fn vectors_have_the_codes_that_the_formula_gives_by_hand() {
    // u = 32 + 0, v = trunc(31.5 * 0.75 + 32) = 55.
    let slanted = DVec3::new(0.0, 0.6, 0.8);
    assert_eq!(Cube::Cub16.encode(slanted), 55 << 6 | 32);
    // u = 8192, v = trunc(8191.5 * 0.75 + 8192) = 14335.
    assert_eq!(Cube::Cub32.encode(slanted), 14335 << 14 | 8192);
    assert_eq!(Cube::Cub16.encode(DVec3::NEG_Y), 32 << 6 | 32 | 1 << 13 | 1 << 14);
    assert_eq!(Cube::Cub16.encode(DVec3::X * 7.0), 32 << 6 | 32 | 2 << 14);
    // z is not larger than y, and y not than x: x has the face.
    assert_eq!(Cube::Cub16.encode(DVec3::ONE), 63 << 6 | 63 | 2 << 14);
    assert_eq!(Cube::Cub16.encode(DVec3::new(0.0, 1.0, 1.0)), 63 << 6 | 32 | 1 << 14);
    for nothing in [DVec3::ZERO, DVec3::NAN, DVec3::INFINITY] {
        assert_eq!(Cube::Cub32.encode(nothing), 3 << 30, "{nothing}");
    }
}

#[test]
fn codes_are_as_near_to_their_vectors_as_is_said() {
    let mut numbers = Numbers(2);
    let (mut of_16, mut of_32) = (0.0_f64, 0.0_f64);
    for _ in 0..100_000 {
        let vector = DVec3::from([(); 3].map(|()| f64::from(numbers.single())));
        let Some(unit) = vector.try_normalize() else { continue };
        let error =
            |cube: Cube| (cube.decode(cube.encode(vector)).unwrap() - unit).length().to_degrees();
        of_16 = of_16.max(error(Cube::Cub16));
        of_32 = of_32.max(error(Cube::Cub32));
    }
    assert!(of_16 < 1.3 && of_16 > 0.9, "{of_16}");
    assert!(of_32 < 0.005 && of_32 > 0.0035, "{of_32}");
}
