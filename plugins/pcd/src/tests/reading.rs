use super::*;
use crate::lzf;

/// Field by field and compressed, from the bytes of a point's fields.
fn compressed(header: &str, columns: &[u8]) -> Vec<u8> {
    let packed = lzf::compress(columns);
    let sizes =
        [(packed.len() as u32).to_le_bytes(), (columns.len() as u32).to_le_bytes()].concat();
    file(header, &[sizes, packed].concat())
}

const PADDED: &str = "VERSION .7\nFIELDS x _ y z _ label\nSIZE 4 1 4 4 2 8\nTYPE F U F F U U\nCOUNT 1 4 1 1 1 1\nWIDTH 2\nHEIGHT 1\n";

fn f(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

#[test]
fn padding_is_left_out_and_long_numbers_become_floats() {
    let point = |x: f32, label: u64| {
        [f(&[x]), vec![9; 4], f(&[x + 1.0, x + 2.0]), vec![9; 2], label.to_le_bytes().to_vec()]
            .concat()
    };
    let body = [point(1.0, 7), point(2.0, 1 << 53)].concat();
    let binary = file(&format!("{PADDED}DATA binary\n"), &body);
    let x = [f(&[1.0, 2.0]), f(&[2.0, 3.0]), f(&[3.0, 4.0])];
    let labels = [7u64.to_le_bytes(), (1u64 << 53).to_le_bytes()].concat();
    let header = format!("{PADDED}DATA binary_compressed\n");
    let without = compressed(&header, &[&x[0][..], &x[1], &x[2], &labels].concat());
    let whole = [&x[0][..], &[9; 8], &x[1], &x[2], &[9; 4], &labels].concat();
    let whole = compressed(&header, &whole);
    for bytes in [binary, without, whole] {
        let found = read(&bytes).unwrap();
        assert_eq!(values(&found, "position"), [1.0, 2.0, 3.0, 2.0, 3.0, 4.0]);
        assert_eq!(values(&found, "label"), [7.0, 9_007_199_254_740_992.0]);
        assert!(found.warnings[0].contains("8 bytes") && found.warnings.len() == 1);
        assert_eq!(found.clouds[0].header.columns.len(), 2);
    }
}

#[test]
fn fields_become_columns_with_a_meaning() {
    let header = "VERSION 0.7\nFIELDS X Y Z Intensity ReturnNumber ScanAngleRank GpsTime Red Green Blue normal_x normal_y normal_z Label label UserData\n\
        SIZE 8 8 8 2 1 1 8 2 2 2 8 8 8 4 4 2\nTYPE F F F U U I F U U U F F F U I F\nCOUNT 1 1 1 1 1 1 1 1 1 1 1 1 1 1 3 1\nWIDTH 1\nDATA binary\n";
    let doubles = |values: &[f64]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let shorts = |values: &[u16]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let body = [
        doubles(&[1e6, 2e6, 0.1]),
        shorts(&[40_000]),
        vec![3, 0xf6],
        doubles(&[1e9]),
        shorts(&[1, 2, 65_535]),
        doubles(&[0.0, 0.0, 1.0]),
        7u32.to_le_bytes().to_vec(),
        [-1i32, 5, 6].iter().flat_map(|v| v.to_le_bytes()).collect(),
        vec![0, 60],
    ]
    .concat();
    let found = read(&file(header, &body)).unwrap();
    let expected: [(&str, Element, &[f64]); 9] = [
        ("position", Element::F64, &[1e6, 2e6, 0.1]),
        ("normal", Element::F64, &[0.0, 0.0, 1.0]),
        ("color", Element::U16, &[1.0, 2.0, 65_535.0]),
        ("intensity", Element::U16, &[40_000.0]),
        ("return_number", Element::U8, &[3.0]),
        ("scan_angle", Element::F32, &[-10.0]),
        ("gps_time", Element::F64, &[1e9]),
        ("Label", Element::U32, &[7.0]),
        ("label_", Element::I32, &[-1.0, 5.0, 6.0]),
    ];
    let cloud = &found.clouds[0];
    for ((column, read), (name, element, values)) in
        cloud.header.columns.iter().zip(&cloud.columns).zip(expected)
    {
        assert_eq!(
            (column.name.as_str(), column.element, read.as_slice()),
            (name, element, values)
        );
    }
    // Half floats are no type of PCD.
    assert_eq!((cloud.columns.len(), found.warnings.len()), (9, 1));
    assert!(found.warnings[0].contains("`UserData`"), "{:?}", found.warnings);
}

#[test]
fn colors_are_unpacked_from_floats_and_whole_numbers() {
    for (field, letter, components) in
        [("rgb", 'F', 3), ("rgb", 'U', 3), ("rgba", 'F', 4), ("rgba", 'U', 4)]
    {
        let header = format!(
            "VERSION 0.7\nFIELDS x y z {field}\nSIZE 4 4 4 4\nTYPE F F F {letter}\nCOUNT 1 1 1 1\nWIDTH 1\nDATA binary\n"
        );
        // A float that is no number, whose bits count.
        let body = [f(&[1.0, 2.0, 3.0]), 0xff80_4020u32.to_le_bytes().to_vec()].concat();
        let found = read(&file(&header, &body)).unwrap();
        assert_eq!(values(&found, "color"), &[128.0, 64.0, 32.0, 255.0][..components]);
    }
    let text = "VERSION .7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\nPOINTS 1\nDATA ascii\n0 0 0 4.2108e+06\n";
    let [blue, green, red, _] = 4.2108e6f32.to_le_bytes().map(f64::from);
    assert_eq!(values(&read(text.as_bytes()).unwrap(), "color"), [red, green, blue]);
    let one_byte = "VERSION .7\nFIELDS x y z rgb\nSIZE 4 4 4 1\nTYPE F F F U\nCOUNT 1 1 1 1\nPOINTS 1\nDATA ascii\n0 0 0 9\n";
    assert_eq!(values(&read(one_byte.as_bytes()).unwrap(), "rgb"), [9.0]);
}

#[test]
fn only_columns_that_somebody_reads_are_decoded() {
    let (bytes, _) =
        write(round_trips::cloud_of(1000, |i| i as f64), Encoding::BinaryCompressed).unwrap();
    let found =
        read_columns(&bytes, Some(&["feature".to_owned()]), ViewpointMeaning::Scanner).unwrap();
    let names: Vec<&str> =
        found.clouds[0].header.columns.iter().map(|column| column.name.as_str()).collect();
    assert_eq!(names, ["position", "feature"]);
    assert_eq!(values(&found, "feature").len(), 5000);
}

#[test]
fn large_points_are_read_in_small_batches() {
    // More than the bytes of a batch, in points of a hundred thousand bytes.
    let header = "VERSION .7\nFIELDS x y z _\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 25000\nWIDTH 100\nDATA binary\n";
    let body: Vec<u8> =
        (0..100).flat_map(|i| [f(&[i as f32, 0.0, 1.0]), vec![0; 100_000]].concat()).collect();
    let found = read(&file(header, &body)).unwrap();
    let x: Vec<f64> = values(&found, "position").iter().copied().step_by(3).collect();
    assert_eq!(x, (0..100).map(f64::from).collect::<Vec<_>>());
}

/// Invariant: large compressed files are read as small ones, without being held as a whole
#[test]
fn compressed_fields_are_decoded_beside_each_other() {
    let n = 70_000;
    let written = round_trips::cloud_of(n, |i| f64::from((i as f32 * 0.01).sin()));
    let (bytes, _) = write(written, Encoding::BinaryCompressed).unwrap();
    let whole = read(&bytes).unwrap();
    let beside = |bytes: &[u8]| -> Result<Collected> {
        let (mut found, source) =
            (Collected::default(), FileSource::of_bytes(bytes.to_vec(), "a.pcd"));
        let header = crate::header::Header::read(&source)?;
        let mut clouds = CloudSink::new(&mut found, None);
        let layout = crate::layout::Layout::new(&header.fields, &clouds)?;
        clouds.begin(&whole.clouds[0].header)?;
        crate::packed::read(&source, &header, &layout, 0, &mut clouds, &Job::new(&SerialHost))?;
        Ok(found)
    };
    let found = beside(&bytes).unwrap();
    for (one, other) in whole.clouds[0].columns.iter().zip(&found.clouds[0].columns) {
        assert!(bits(one) == bits(other));
    }
    // Damage ends in a line, wherever it is.
    let body = bytes.windows(17).position(|word| word == b"binary_compressed").unwrap() + 26;
    for cut in [body + 10, bytes.len() / 2, bytes.len() - 9] {
        let mut short = bytes[..cut].to_vec();
        assert!(beside(&short).unwrap_err().to_string().contains("cut short"));
        let packed = (cut - body) as u32;
        short[body - 8..body - 4].copy_from_slice(&packed.to_le_bytes());
        assert!(beside(&short).is_err());
    }
}
