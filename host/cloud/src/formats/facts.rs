//! What a header says beside columns, as comments of files that have no other place for it:
//!
//! ```text
//! comment surfelshop name scan 1
//! comment surfelshop up z
//! comment surfelshop unit 0.3048
//! comment surfelshop system EPSG:2992
//! comment surfelshop scanner 1.5 2 -0.25
//! comment surfelshop time 2018-03-05
//! ```

use crate::cloud::Cloud;
use glam::DVec3;
use surfelshop_api::format::{CloudHeader, HeaderSupport, UpAxis};

/// What these comments keep.
pub(super) const KEPT: HeaderSupport = HeaderSupport {
    up: surfelshop_api::format::UpSupport::Said,
    name: true,
    unit: true,
    coordinate_system: true,
    scanner: true,
    time: true,
    grid: false,
    faces: true,
    comments: true,
};

/// The axes by their names.
const AXES: [(UpAxis, &str); 3] = [(UpAxis::X, "x"), (UpAxis::Y, "y"), (UpAxis::Z, "z")];

/// The comments, in one line each; those that there is nothing to say in are left out.
pub(super) fn comments(header: &CloudHeader) -> Vec<String> {
    let axis = AXES.iter().find(|(axis, _)| *axis == header.up).map(|(_, name)| *name);
    let line = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let unit = Some(header.metres_per_unit).filter(|metres| metres.is_finite() && *metres > 0.0);
    let scanner = header.scanner.filter(|place| place.is_finite());
    let texts = [
        ("name", Some(line(&header.name))),
        ("up", axis.map(str::to_owned)),
        ("unit", unit.map(|metres| metres.to_string())),
        ("system", Some(line(&header.coordinate_system))),
        ("scanner", scanner.map(|DVec3 { x, y, z }| format!("{x} {y} {z}"))),
        ("time", Some(line(&header.time))),
    ];
    let said = texts.into_iter().filter_map(|(what, text)| Some((what, text?)));
    let said = said.filter(|(_, text)| !text.is_empty());
    said.map(|(what, text)| format!("surfelshop {what} {text}")).collect()
}

/// The comments of a cloud that is written as one.
pub(super) fn of_cloud(cloud: &Cloud) -> Vec<String> {
    let source = cloud.source();
    let only = match source.scans.as_slice() {
        [only] => Some(only),
        _ => None,
    };
    comments(&CloudHeader {
        name: only.map(|scan| scan.name.clone()).unwrap_or_default(),
        scanner: only.and_then(|scan| scan.scanner),
        up: source.up_to_write(),
        metres_per_unit: source.metres_per_unit,
        coordinate_system: source.coordinate_system.clone(),
        time: source.time.clone(),
        ..CloudHeader::default()
    })
}

/// The header with what its comments say, and without these. What cannot be read stays a comment.
pub(crate) fn said(mut header: CloudHeader) -> CloudHeader {
    let comments = std::mem::take(&mut header.comments);
    for comment in comments {
        if take(&mut header, &comment).is_none() {
            header.comments.push(comment);
        }
    }
    header
}

/// Takes what a comment says; `None` where it is none of these.
fn take(header: &mut CloudHeader, comment: &str) -> Option<()> {
    let (what, text) = comment.strip_prefix("surfelshop ")?.split_once(' ')?;
    let number = |text: &str| text.parse::<f64>().ok().filter(|number| number.is_finite());
    match what {
        "name" => text.clone_into(&mut header.name),
        "up" => header.up = AXES.iter().find(|(_, name)| *name == text)?.0,
        "unit" => header.metres_per_unit = number(text).filter(|metres| *metres > 0.0)?,
        "system" => text.clone_into(&mut header.coordinate_system),
        "scanner" => {
            let place: Vec<f64> = text.split(' ').map(number).collect::<Option<_>>()?;
            header.scanner = Some(DVec3::from_array(place.try_into().ok()?));
        }
        "time" => text.clone_into(&mut header.time),
        _ => return None,
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_comes_back_and_other_comments_stay() {
        let header = CloudHeader {
            name: "hall, north".to_owned(),
            up: UpAxis::Z,
            metres_per_unit: 0.3048,
            coordinate_system: "PROJCS[\"a\",\n  UNIT[\"foot\",0.3048]]".to_owned(),
            scanner: Some(DVec3::new(0.1, -2.0, 1e-30)),
            time: "2018-03-05".to_owned(),
            ..CloudHeader::default()
        };
        let mut texts = comments(&header);
        assert_eq!(texts.len(), 6);
        let others = [
            "made by hand",
            "surfelshop column rgb 3",
            "surfelshop up w",
            "surfelshop unit -1",
            "surfelshop scanner 1 2",
            "surfelshop scanner 1 2 nan",
        ];
        texts.extend(others.map(str::to_owned));
        let read = said(CloudHeader { comments: texts, ..CloudHeader::default() });
        let coordinate_system = "PROJCS[\"a\", UNIT[\"foot\",0.3048]]".to_owned();
        let comments_left = others.map(str::to_owned).to_vec();
        assert_eq!(read, CloudHeader { coordinate_system, comments: comments_left, ..header });
        assert!(comments(&CloudHeader::default()).is_empty());
    }
}
