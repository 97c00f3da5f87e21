use super::*;

/// A mesh of six points and these indices.
fn faces(mode: u32, indices: Option<&[u16]>, scale: &str) -> (Vec<[u32; 3]>, usize) {
    let mut b = Builder::default();
    let position = b.floats(&[0.0; 18], "VEC3");
    let indices = indices.map(|indices| b.shorts(indices));
    let indices = indices.map_or(String::new(), |indices| format!(r#","indices":{indices}"#));
    b.mesh(&format!(r#"{{"mode":{mode},"attributes":{{"POSITION":{position}}}{indices}}}"#));
    b.rest[1] = b.rest[1].replace(r#"{"mesh":0}"#, &format!(r#"{{"mesh":0,"scale":{scale}}}"#));
    let found = b.found();
    (only(&found).faces.clone(), found.warnings.len())
}

#[test]
fn lists_strips_and_fans_are_triangles() {
    let one = "[1,1,1]";
    assert_eq!(faces(4, None, one).0, [[0, 1, 2], [3, 4, 5]]);
    assert_eq!(faces(4, Some(&[5, 4, 3, 0, 1]), one).0, [[5, 4, 3]]);
    assert_eq!(faces(5, Some(&[0, 1, 2, 3, 4]), one).0, [[0, 1, 2], [1, 3, 2], [2, 3, 4]]);
    // Repeated corners lead a strip elsewhere; they count where triangles are turned round.
    assert_eq!(faces(5, Some(&[0, 1, 2, 2, 3, 3, 4, 5]), one).0, [[0, 1, 2], [3, 5, 4]]);
    assert_eq!(faces(6, None, one).0, [[1, 2, 0], [2, 3, 0], [3, 4, 0], [4, 5, 0]]);
    assert_eq!(faces(0, Some(&[0, 1]), one), (vec![], 1));
    assert_eq!(faces(4, Some(&[]), one).0, Vec::<[u32; 3]>::new());
}

#[test]
fn mirrored_triangles_are_turned_round() {
    assert_eq!(faces(4, Some(&[0, 1, 2]), "[1,-1,1]").0, [[0, 2, 1]]);
    assert_eq!(faces(4, Some(&[0, 1, 2]), "[-1,-1,1]").0, [[0, 1, 2]]);
}

#[test]
fn corners_that_are_no_points_are_left_out() {
    assert_eq!(faces(4, Some(&[0, 1, 6, 3, 4, 5, 65535, 0, 1]), "[1,1,1]"), (vec![[3, 4, 5]], 1));
}

#[test]
fn primitives_that_share_points_share_them_here() {
    let mut b = Builder::default();
    let position = b.floats(&[0.0; 12], "VEC3");
    let (first, second) = (b.shorts(&[0, 1, 2]), b.shorts(&[1, 2, 3]));
    let other = b.floats(&[0.0; 9], "VEC3");
    b.mesh(&format!(
        r#"{{"attributes":{{"POSITION":{position}}},"indices":{first}}},
           {{"attributes":{{"POSITION":{other}}}}},
           {{"attributes":{{"POSITION":{position}}},"indices":{second}}}"#
    ));
    let found = b.found();
    assert_eq!(only(&found).header.rows, Some(7));
    assert_eq!(only(&found).faces, [[0, 1, 2], [4, 5, 6], [1, 2, 3]]);
    let bad =
        b.json("").replace(&format!(r#""indices":{first}"#), &format!(r#""indices":{position}"#));
    assert!(refusal(&glb(&bad, &b.bytes)).contains("indices of one number"));
}

#[test]
fn long_strips_are_whole() {
    let mut b = Builder::default();
    let n = 150_000u32;
    let position = b.floats(&vec![0.0; 3 * n as usize], "VEC3");
    let indices: Vec<u8> = (0..n).flat_map(|i| i.to_le_bytes()).collect();
    let indices = b.accessor(&indices, UNSIGNED_INT, "SCALAR", n as usize, "");
    b.mesh(&format!(r#"{{"mode":5,"attributes":{{"POSITION":{position}}},"indices":{indices}}}"#));
    let found = b.found();
    let expected = |i: u32| if i.is_multiple_of(2) { [i, i + 1, i + 2] } else { [i, i + 2, i + 1] };
    assert_eq!(only(&found).faces, (0..n - 2).map(expected).collect::<Vec<_>>());
}
