//! Tables as programs and people write them.

use super::*;

#[test]
fn line_ends_marks_and_comments_of_all_kinds_are_taken() {
    let plain = "# made by hand\n1 2 3\n\n// a comment\n4 5 6 # the last\n% another\n7 8 9\n";
    let expected = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0];
    for ends in ["\n", "\r\n", "\r"] {
        for (mark, last) in [("", ends), ("\u{FEFF}", ""), ("", "")] {
            let text = format!("{mark}{}{last}", plain.trim_end().replace('\n', ends));
            let found = cloud(&text);
            assert_eq!(found.columns[0], expected, "{text:?}");
            assert_eq!(found.header.comments, ["made by hand"]);
        }
    }
    assert_eq!(cloud(" 1   2\t 3 \n\t4 5 6\n").columns[0], [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
}

#[test]
fn numbers_are_read_as_they_are_written() {
    let found = cloud("+1 -2e3 .5\n5. 1E-3 -0\n1e400 0x 3\n".replace("0x", "-1e-400").as_str());
    let expected = [1.0, -2000.0, 0.5, 5.0, 0.001, -0.0, f64::INFINITY, -0.0, 3.0];
    assert_eq!(found.columns[0], expected);
    let words = "nan NaN -inf\nInfinity -nan(ind) 1.#QNAN\n1.#INF -1.#INF 1\n";
    let found = cloud(&format!("1 2 3\n4 5 6\n7 8 9\n{words}"));
    let kind = |v: &f64| if v.is_nan() { "nan".to_owned() } else { v.to_string() };
    let kinds: Vec<String> = found.columns[0][9..].iter().map(kind).collect();
    assert_eq!(kinds, ["nan", "nan", "-inf", "inf", "nan", "nan", "inf", "-inf", "1"]);
}

#[test]
fn decimal_commas_are_told_from_separators() {
    let found = cloud("x;y;z;t\n1,5;2,5;3;0,1\n-4,25;5;6;1e-3\n");
    let note =
        "columns x,y,z,t by their names; separated by semicolons; decimal commas; one header line";
    assert_eq!(found.header.format, format!("text, {note}"));
    assert_eq!(found.columns[0], [1.5, 2.5, 3.0, -4.25, 5.0, 6.0]);
    assert_eq!(found.columns[1], [f64::from(0.1f32), f64::from(0.001f32)]);
    assert_eq!(cloud("1,5 2,5 3,5\n1 2 3\n").columns[0], [1.5, 2.5, 3.5, 1.0, 2.0, 3.0]);
    // A point in a file of decimal commas separates thousands: nobody knows what is meant.
    let mut text = "1,5;2,5;3,5\n".repeat(300);
    text += "1.000;2,5;3,5\n";
    let found = read(&text).unwrap();
    assert_eq!(found.clouds[0].columns[0].len(), 900);
    assert_eq!(
        found.warnings,
        ["a line cannot be read and is left out: line 301: `1.000;2,5;3,5`"]
    );
}

#[test]
fn quoted_and_missing_words_are_read() {
    let text = "\"x\",\"y\",\"z\",\"name, of it\",\"w\"\n\"1\",2,3,\"a, b\",\n4,5,\"6\",c,7\n";
    let found = cloud(text);
    assert_eq!(shape(&found), "position 3 f64, w 1 f32");
    assert_eq!(found.columns[0], [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    assert!(found.columns[1][0].is_nan() && found.columns[1][1] == 7.0);
    // A delimiter at the end of lines is no column.
    let found = cloud("1,2,3,\n4,5,6,\n");
    assert_eq!(shape(&found), "position 3 f64");
    assert_eq!(cloud("1,NA,3\n4,5,6\n").columns[0].len(), 6);
}

#[test]
fn floats_are_rounded_once() {
    // Half way between two numbers of 32 bits but for the last digit: rounding to 64 bits first goes astray.
    let text = "1.00000017881393432617187499";
    let once: f32 = text.parse().unwrap();
    assert_ne!(once, text.parse::<f64>().unwrap() as f32);
    let found = cloud(&format!("x,y,z,i\n0,0,0,{text}\n0,0,0,\"{text}\"\n"));
    assert_eq!(found.columns[1], [f64::from(once); 2]);
}

#[test]
fn colours_that_are_means_are_rounded_and_missing_ones_are_black() {
    let found = cloud("x,y,z,r,g,b\n0,0,0,127.5,30.2,200\n0,0,0,1,2,\n");
    assert_eq!(column(&found, "color"), (Element::U8, &[128.0, 30.0, 200.0, 1.0, 2.0, 0.0][..]));
}

#[test]
fn only_what_is_wanted_is_read() {
    let columns = ["intensity".to_owned()];
    let text = b"x,y,z,intensity,r,g,b\n1,2,3,4,5,6,7\n1,2,3,x,5,6,\"7\"\n";
    let mut host = Collected::default();
    let text = [&text[..], b"1,2,3,4,,y,7\n"].concat();
    read_into::<Xyz>(&text, "a.csv", &Settings::default(), &mut host, Some(&columns)).unwrap();
    assert_eq!(shape(&host.clouds[0]), "position 3 f64, intensity 1 f32");
    assert_eq!(host.clouds[0].columns[1], [4.0, 4.0]);
    assert_eq!(host.warnings.len(), 1);
}

/// Takes headers and refuses points.
#[derive(Default)]
struct Heads(Vec<CloudHeader>);

impl CloudSinkHost for Heads {
    fn begin(&mut self, header: &CloudHeader) -> Result<bool> {
        self.0.push(header.clone());
        Ok(false)
    }

    fn batch(&mut self, _values: &[Values<'_>]) -> Result<()> {
        Err(Error::new("no points are wanted"))
    }

    fn faces(&mut self, _triangles: &[[u32; 3]]) -> Result<()> {
        Err(Error::new("no triangles are wanted"))
    }

    fn warn(&mut self, line: &str) {
        panic!("{line}");
    }
}

/// The headers of a file's clouds.
pub(super) fn heads<F: Format>(bytes: &[u8], params: &F::Params) -> Vec<CloudHeader> {
    let mut heads = Heads::default();
    read_into::<F>(bytes, "a", params, &mut heads, None).unwrap();
    heads.0
}

#[test]
fn headers_alone_are_found_without_reading_points() {
    let text = "x,y,z\n1,2,3\n".to_owned() + &"no point\n".repeat(200_000);
    let heads = heads::<Xyz>(text.as_bytes(), &Settings::default());
    assert_eq!(heads.len(), 1);
    assert_eq!((heads[0].rows, heads[0].bounds), (None, None));
}

#[test]
fn blocks_and_windows_join_without_a_seam() {
    // Lines of many lengths over several windows; each says its own number.
    let mut seeded = Seeded(3);
    let mut text = String::from("x y z\n");
    let n = 40_000;
    for i in 0..n {
        let blanks = " ".repeat(seeded.below(20));
        text +=
            &format!("{i}{blanks} {}.25 -{i}e-1{}\n", i * 2, if i % 1000 == 7 { "\r" } else { "" });
    }
    assert!(text.len() > 1 << 20);
    let found = cloud(&text);
    for (i, point) in found.columns[0].chunks_exact(3).enumerate() {
        let i = i as f64;
        assert_eq!(point[..2], [i, i * 2.0 + 0.25]);
        assert!((point[2] + i * 0.1).abs() < 1e-9 * (1.0 + i));
    }
    assert_eq!(found.columns[0].len(), 3 * n);
    // Line ends of two bytes fall on every place of a block's end.
    for shift in 0..4 {
        let text = format!("{}\r\n1 2 3\r\n", "#".repeat(shift)) + &"10 20 30\r\n".repeat(30_000);
        assert_eq!(cloud(&text).columns[0].len(), 90_003, "{shift}");
    }
}
