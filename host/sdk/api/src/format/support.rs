//! What of a cloud's header a format has no place for.

use super::header::{CloudHeader, UpAxis};

/// What files of a format have places for, of a [`CloudHeader`], beside columns: whoever writes says so, and
/// [`CloudHeader::left_out`] makes lines of the rest. SDK 3.11.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HeaderSupport {
    /// The axis that points up.
    pub up: UpSupport,
    /// What the file calls the cloud.
    pub name: bool,
    /// Metres of a unit of coordinates.
    pub unit: bool,
    /// The coordinate reference system.
    pub coordinate_system: bool,
    /// Where the device stood.
    pub scanner: bool,
    /// When it was taken.
    pub time: bool,
    /// Columns and rows of an organised cloud.
    pub grid: bool,
    /// Triangles.
    pub faces: bool,
    /// Comments.
    pub comments: bool,
}

/// What becomes of the axis that points up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum UpSupport {
    /// Files say it.
    Said,
    /// Files do not say it, and are taken to have y up, as clouds of which nobody knows.
    #[default]
    TakenAsY,
    /// Files do not say it, and are read with z up.
    TakenAsZ,
}

impl CloudHeader {
    /// Lines that say what of the header, beside columns, is left out by a format of this name that has places for so
    /// much; none where nothing is. A unit of one metre counts as none.
    #[must_use]
    pub fn left_out(&self, format: &str, held: HeaderSupport) -> Vec<String> {
        let mut lines: Vec<String> = self.axis_left_out(format, held.up).into_iter().collect();
        let metres = self.metres_per_unit;
        let n_comments = self.comments.len();
        let known = [
            (!held.name && !self.name.is_empty(), "the name of the cloud".to_owned()),
            (
                !held.unit && metres > 0.0 && metres.to_bits() != 1f64.to_bits(),
                format!("the unit of {metres} m"),
            ),
            (
                !held.coordinate_system && !self.coordinate_system.is_empty(),
                "the coordinate reference system".to_owned(),
            ),
            (!held.scanner && self.scanner.is_some(), "the place of the scanner".to_owned()),
            (!held.time && !self.time.is_empty(), format!("the time {}", self.time)),
            (!held.grid && self.grid.is_some(), "the rows and columns of the grid".to_owned()),
            (!held.faces && self.has_faces, "the triangles".to_owned()),
            (!held.comments && n_comments == 1, "a comment".to_owned()),
            (!held.comments && n_comments > 1, format!("{n_comments} comments")),
        ];
        let lost: Vec<String> =
            known.into_iter().filter(|(is_lost, _)| *is_lost).map(|(_, what)| what).collect();
        let list = match lost.as_slice() {
            [] => return lines,
            [one] => one.clone(),
            [first @ .., last] => format!("{} and {last}", first.join(", ")),
        };
        lines.push(format!("{format} has no place for {list}"));
        lines
    }

    fn axis_left_out(&self, format: &str, held: UpSupport) -> Option<String> {
        let taken = match held {
            UpSupport::Said => return None,
            UpSupport::TakenAsY => "y",
            UpSupport::TakenAsZ => "z",
        };
        let (which, option) = match (self.up, held) {
            (UpAxis::Y | UpAxis::Unknown, UpSupport::TakenAsY)
            | (UpAxis::Z, UpSupport::TakenAsZ) => {
                return None;
            }
            (UpAxis::Unknown, _) => {
                ("this cloud does not say which axis points up", "y`, if it is y")
            }
            (UpAxis::X, _) => ("x points up in this cloud", "x`"),
            (UpAxis::Y, _) => ("y points up in this cloud", "y`"),
            (UpAxis::Z, _) => ("z points up in this cloud", "z`"),
        };
        Some(format!("{which}, and {format} is read with {taken} up: say `--up {option}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn only_what_there_is_and_the_format_has_no_place_for_is_named() {
        let header = CloudHeader {
            up: UpAxis::Z,
            metres_per_unit: 0.3048,
            coordinate_system: "EPSG:2992".to_owned(),
            scanner: Some(DVec3::ZERO),
            time: "2015-09-10".to_owned(),
            comments: vec!["a".to_owned(), "b".to_owned()],
            ..CloudHeader::default()
        };
        assert_eq!(
            header.left_out("PCD", HeaderSupport { scanner: true, ..HeaderSupport::default() }),
            [
                "z points up in this cloud, and PCD is read with y up: say `--up z`",
                "PCD has no place for the unit of 0.3048 m, the coordinate reference system, the time 2015-09-10 and 2 comments",
            ]
        );
        let all = HeaderSupport {
            unit: true,
            coordinate_system: true,
            scanner: true,
            time: true,
            ..HeaderSupport::default()
        };
        let all = HeaderSupport { comments: true, up: UpSupport::TakenAsZ, ..all };
        assert_eq!(header.left_out("LAS", all), [""; 0]);
        let bare = CloudHeader { metres_per_unit: 1.0, ..CloudHeader::default() };
        assert_eq!(bare.left_out("PCD", HeaderSupport::default()), [""; 0]);
        assert_eq!(
            bare.left_out(
                "text",
                HeaderSupport { up: UpSupport::TakenAsZ, ..HeaderSupport::default() }
            ),
            [
                "this cloud does not say which axis points up, and text is read with z up: say `--up y`, if it is y"
            ]
        );
    }
}
