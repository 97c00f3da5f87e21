//! Damaged files end in a line, or are read: they never panic, and never take long.

use super::*;
use std::time::{Duration, Instant};

/// A scene with a little of everything.
fn scene() -> Builder {
    let mut b = Builder::default();
    let position = b.floats(&(0..30).map(|i| i as f32).collect::<Vec<_>>(), "VEC3");
    let normal = b.floats(&[0.0, 0.6, 0.8].repeat(10), "VEC3");
    let color = b.accessor(&[7; 40], UNSIGNED_BYTE, "VEC4", 10, r#","normalized":true"#);
    let own = b.floats(&[0.5; 10], "SCALAR");
    let indices = b.shorts(&[0, 1, 2, 3, 4, 5, 6, 7, 8, 9]);
    let places = b.view(&[1, 0, 4, 0], "");
    let others = b.view(&[0; 24], "");
    let sparse = format!(
        r#","sparse":{{"count":2,"indices":{{"bufferView":{places},"componentType":{UNSIGNED_SHORT}}},"values":{{"bufferView":{others}}}}}"#
    );
    let sparse = b.accessor_of(r#""bufferView":0,"#, FLOAT, "VEC3", 10, &sparse);
    b.root(&format!(
        r#""meshes":[{{"primitives":[
            {{"attributes":{{"POSITION":{position},"NORMAL":{normal},"COLOR_0":{color},"_OWN":{own}}},"indices":{indices},"mode":5,"material":0}},
            {{"attributes":{{"POSITION":{sparse}}},"mode":0}}]}}],
        "materials":[{{"pbrMetallicRoughness":{{"baseColorFactor":[1,0.5,0,1]}}}}],
        "nodes":[{{"children":[1],"scale":[1,2,3]}},{{"mesh":0,"translation":[1,2,3]}},{{"mesh":0}}],
        "scenes":[{{"nodes":[0,2]}}]"#
    ));
    b
}

fn try_read(bytes: &[u8]) -> Result<Collected> {
    let start = Instant::now();
    let result = read(bytes);
    assert!(start.elapsed() < Duration::from_secs(10), "a damaged file takes long");
    result
}

#[test]
fn files_that_are_cut_short_are_refused() {
    let glb = scene().glb();
    assert!(read(&glb).is_ok());
    for len in (0..glb.len()).step_by(7) {
        assert!(try_read(&glb[..len]).is_err(), "{len} of {}", glb.len());
    }
    let b = scene();
    // Also where the length in the header is that of what is left.
    for len in (0..b.bytes.len() - 4).step_by(7) {
        assert!(try_read(&super::glb(&b.json(""), &b.bytes[..len])).is_err(), "{len}");
    }
    let text = b.json("");
    for len in (0..text.len()).step_by(7) {
        assert!(try_read(&super::glb(&text[..len], &b.bytes)).is_err(), "{len}");
    }
}

#[test]
fn flipped_bytes_do_no_harm() {
    let mut state = 0x1234_5678_9abc_def1u64;
    let mut random = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state
    };
    let glb = scene().glb();
    let mut n_read = 0;
    for _ in 0..20_000 {
        let mut damaged = glb.clone();
        for _ in 0..1 + random() % 3 {
            let place = random() as usize % glb.len();
            // Digits become others, so that numbers of the JSON stay numbers.
            let digit = damaged[place].is_ascii_digit() && random().is_multiple_of(2);
            damaged[place] = if digit { b'0' + (random() % 10) as u8 } else { random() as u8 };
        }
        match try_read(&damaged) {
            Ok(_) => n_read += 1,
            Err(error) => {
                assert!(!error.to_string().contains('\n') && !error.to_string().is_empty())
            }
        }
    }
    assert!(n_read > 1000, "{n_read}");
}
