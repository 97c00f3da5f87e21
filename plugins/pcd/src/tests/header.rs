use super::*;
use surfelshop_api::glam::{DQuat, DVec3};

const XYZ: &str = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n";

#[test]
fn old_versions_are_read() {
    let old = b"# .PCD v.5 - made by hand\n# a comment\nVERSION .5\nCOLUMNS x y z\nPOINTS 2\nDATA ascii\n1 2 3\n4 5 6\n";
    let found = read(old).unwrap();
    assert_eq!(values(&found, "position"), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    let header = &found.clouds[0].header;
    assert_eq!((header.format.as_str(), header.scanner), ("PCD 0.5, ascii", None));
    assert_eq!(header.comments, ["a comment"]);
    assert!(found.warnings.is_empty());
    let new = format!("VERSION 0.8\n{XYZ}WIDTH 1\nDATA ascii\n1 2 3");
    let found = read(new.as_bytes()).unwrap();
    assert!(found.warnings[0].contains("found 0.8"), "{:?}", found.warnings);
    let crlf = format!("VERSION 0.7\n{XYZ}WIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA ascii\n1 2 3\n")
        .replace('\n', "\r\n");
    assert_eq!(values(&read(crlf.as_bytes()).unwrap(), "position"), [1.0, 2.0, 3.0]);
}

#[test]
fn contradictions_are_refused() {
    for (text, expected) in [
        ("VERSION .7\nFIELDS x y z\n", "ends with a line DATA"),
        ("VERSION .7\nPOINTS 1\nDATA ascii\n", "FIELDS"),
        ("FIELDS x y z\nSIZE 4 4\nPOINTS 1\nDATA ascii\n", "SIZE: expected 3 values"),
        ("FIELDS x y z\nSIZE 4 4 400\nPOINTS 1\nDATA ascii\n", "found 400"),
        ("FIELDS x y z\nSIZE 4 4 -4\nPOINTS 1\nDATA ascii\n", "found `-4`"),
        ("FIELDS x y z\nCOUNT 1 1 4000000000\nPOINTS 1\nDATA ascii\n", "4000000000 elements"),
        ("FIELDS x y z\nDATA ascii\n", "POINTS or WIDTH"),
        (
            "FIELDS x y z\nWIDTH 3\nHEIGHT 2\nPOINTS 7\nDATA ascii\n",
            "expected POINTS to be WIDTH times HEIGHT, 6, found 7",
        ),
        ("FIELDS x y z\nWIDTH 18446744073709551615\nHEIGHT 2\nDATA ascii\n", "too many"),
        (
            "FIELDS x y z\nPOINTS many\nDATA ascii\n",
            "POINTS: expected a whole number, found `many`",
        ),
        ("FIELDS x y z\nPOINTS 1\nDATA zipped\n", "found `zipped`"),
        ("FIELDS x y\nPOINTS 1\nDATA ascii\n1 2\n", "expected fields x, y and z, found x y"),
        (
            "FIELDS x y z\nCOUNT 1 1 2\nPOINTS 1\nDATA ascii\n1 2 3 4\n",
            "expected fields x, y and z",
        ),
        ("", "found none in the first 0 bytes"),
    ] {
        let line = refusal(text.as_bytes());
        assert!(line.contains(expected), "{line}");
    }
    let fields = "f ".repeat(4097);
    assert!(refusal(format!("FIELDS {fields}\nDATA ascii\n").as_bytes()).contains("4096"));
}

/// A file of a point, or a grid of two by two.
fn with_viewpoint(viewpoint: &str, grid: bool) -> Vec<u8> {
    let (width, height) = if grid { (2, 2) } else { (4, 1) };
    let body = "1 0 0\n".repeat(4);
    format!("VERSION .7\n{XYZ}WIDTH {width}\nHEIGHT {height}\n{viewpoint}\nDATA ascii\n{body}")
        .into_bytes()
}

#[test]
fn viewpoints_are_where_the_sensor_stood() {
    let found = |text: &str, grid: bool, meaning: ViewpointMeaning| {
        let found = read_columns(&with_viewpoint(text, grid), None, meaning).unwrap();
        let header = found.clouds[0].header.clone();
        (header.pose, header.scanner, found.warnings.len())
    };
    let moved = "VIEWPOINT 1 2 3 0 2 0 0";
    let (pose, scanner, _) = found(moved, false, ViewpointMeaning::Scanner);
    assert_eq!((pose, scanner), (Default::default(), Some(DVec3::new(1.0, 2.0, 3.0))));
    let (pose, scanner, _) = found(moved, false, ViewpointMeaning::Pose);
    assert_eq!((pose.translation, scanner), (DVec3::new(1.0, 2.0, 3.0), Some(DVec3::ZERO)));
    assert_eq!(pose.rotation, DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0));
    // The default is what everybody writes: a sensor made the grid, but who knows what the others are.
    let unknown = "VIEWPOINT 0 0 0 1 0 0 0";
    assert_eq!(found(unknown, false, ViewpointMeaning::Scanner).1, None);
    assert_eq!(found(unknown, true, ViewpointMeaning::Scanner).1, Some(DVec3::ZERO));
    let turned = "VIEWPOINT 0 0 0 0 1 0 0";
    assert_eq!(found(turned, false, ViewpointMeaning::Scanner).1, Some(DVec3::ZERO));
    assert_eq!(found("", true, ViewpointMeaning::Scanner).1, None);
    assert_eq!(
        found("VIEWPOINT 0 0 nan 1 0 0 0", true, ViewpointMeaning::Scanner),
        (Default::default(), None, 1)
    );
    assert_eq!(
        found("VIEWPOINT 1 0 0 0 0 0 0", false, ViewpointMeaning::Pose).0.rotation,
        DQuat::IDENTITY
    );
}

#[test]
fn grids_keep_their_rows() {
    let header = &read(&with_viewpoint("", true)).unwrap().clouds[0].header;
    assert_eq!((header.grid, header.rows), (Some([2, 2]), Some(4)));
    assert_eq!(read(&with_viewpoint("", false)).unwrap().clouds[0].header.grid, None);
}
