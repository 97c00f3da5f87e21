use super::*;

const HEADER: &str = "VERSION .7\nFIELDS x y z k\nSIZE 4 8 4 1\nTYPE F F I U\nCOUNT 1 1 1 2\nWIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA ascii\n";

fn found(body: &str) -> Collected {
    read(format!("{HEADER}{body}").as_bytes()).unwrap()
}

fn line(body: &str) -> String {
    refusal(format!("{HEADER}{body}").as_bytes())
}

#[test]
fn text_of_many_programs_is_understood() {
    let expected = [1.5, -2e300, 3.0, 0.0, 0.5, -7.0];
    for body in [
        "1.5 -2e300 3 1 2\n0 .5 -7 255 0\n",
        "\n# between\n 1.5\t-2E+300 3.0 1e0 2\r\n\r\n+0.0 5e-1 -7 255 nan",
    ] {
        let found = found(body);
        assert_eq!(values(&found, "position"), expected, "{body}");
        assert_eq!(values(&found, "k"), [1.0, 2.0, 255.0, 0.0]);
        assert!(found.warnings.is_empty(), "{:?}", found.warnings);
    }
    let none = found("nan NaN 0 0 0\n-nan 1.#QNAN 0 0 0\n");
    let missing: Vec<bool> = values(&none, "position").iter().map(|v| v.is_nan()).collect();
    assert_eq!(missing, [true, true, false, true, true, false]);
}

#[test]
fn lines_that_are_wrong_are_named() {
    for (body, expected) in [
        ("1 2 3 4 5\n1 2 3 4\n0 0 0 0 0\n", "point 2: expected 5 values, found 4"),
        ("1 2 3 4 5 6 7\n1 2 3 4 5\n", "point 1: expected 5 values, found 7"),
        (
            "1 2 3 4 five\n0 0 0 0 0\n",
            "point 1: field `k`: expected a whole number of 1 bytes, found `five`",
        ),
        ("1 2 3 4 256\n0 0 0 0 0\n", "found `256`"),
        ("1 2 0.5 4 5\n0 0 0 0 0\n", "field `z`"),
        ("one 2 3 4 5\n0 0 0 0 0\n", "expected a number of 4 bytes, found `one`"),
        ("1 2 3 4 5           \n", "expected 2 points, found 1"),
        ("1 2 3 4 5\n", "cannot hold them"),
    ] {
        let line = line(body);
        assert!(line.contains(expected), "{line}");
    }
    let no_text = [HEADER.as_bytes(), b"1 2 3 4 \xff\n1 2 3 4 5\n"].concat();
    assert!(refusal(&no_text).contains("no text"));
}

#[test]
fn points_beyond_those_announced_are_left_out() {
    for more in ["9 9 9 9 9\n", "and other text\n"] {
        let found = found(&format!("1 2 3 4 5\n1 2 3 4 5\n{more}"));
        assert_eq!(values(&found, "position").len(), 6);
        assert!(found.warnings[0].contains("more points"), "{:?}", found.warnings);
    }
}

#[test]
fn text_of_several_blocks_keeps_its_order() {
    let n = 800_000;
    let mut text = format!(
        "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {n}\nHEIGHT 1\nDATA ascii\n"
    );
    (0..n).for_each(|i| text.push_str(&format!("{i} {} 0.5\n", -i)));
    assert!(text.len() > 9 << 20);
    let found = read(text.as_bytes()).unwrap();
    let position = values(&found, "position");
    assert_eq!(position.len(), 3 * n as usize);
    for (i, point) in position.chunks_exact(3).enumerate() {
        assert_eq!(point, [i as f64, -(i as f64), 0.5]);
    }
}
