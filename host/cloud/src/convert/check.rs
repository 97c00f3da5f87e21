//! What is wrong with a conversion, or is to be said of it, before a point is written.

use super::select::Selection;
use crate::error::ReadError;
use crate::formats::plugins::SharedSink;
use crate::inspect::stream;
use crate::options::{ColorBits, ReadOptions};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use surfelshop_api::columns::{COLOR, Element, POSITION, Values};
use surfelshop_api::format::{CloudHeader, CloudSinkHost, Pose, SCAN};
use surfelshop_api::{Error, Result};

/// Refuses columns that no cloud has.
pub(super) fn selection(
    headers: &[CloudHeader],
    selection: &Selection,
) -> std::result::Result<(), String> {
    let mut known: Vec<&str> = headers
        .iter()
        .flat_map(|header| &header.columns)
        .map(|column| column.name.as_str())
        .collect();
    known.sort_unstable();
    known.dedup();
    for column in selection.columns.iter().flatten() {
        let is_made = column == SCAN && headers.len() > 1;
        if !is_made && !known.contains(&column.as_str()) {
            let known: Vec<String> = known.iter().map(|name| format!("`{name}`")).collect();
            return Err(format!(
                "no cloud has a column `{column}`; there are {}",
                known.join(", ")
            ));
        }
    }
    Ok(())
}

/// Refuses to make one cloud of some whose coordinates are not in the same unit.
pub(super) fn one_unit(headers: &[CloudHeader]) -> std::result::Result<(), String> {
    let metres = |header: &CloudHeader| {
        Some(header.metres_per_unit).filter(|metres| metres.is_finite() && *metres > 0.0)
    };
    // Files round a unit to seven digits; feet of the survey are 2e-6 longer than others.
    let differs = |a: f64, b: f64| (a - b).abs() > 5e-7 * a.max(b);
    let mut known = headers.iter().filter_map(metres);
    let Some(first) = known.next() else { return Ok(()) };
    match known.find(|metres| differs(first, *metres)) {
        Some(other) => Err(format!(
            "the clouds are in different units: coordinates of {first} m and of {other} m do not fit into one cloud; \
             convert them one by one"
        )),
        None => Ok(()),
    }
}

/// What of the clouds is lost by the selection, or filled in, in lines.
pub(super) fn remarks(
    (headers, files): (&[CloudHeader], &[&Path]),
    selection: &Selection,
    becomes_one: bool,
) -> Vec<String> {
    let mut lines = Vec::new();
    if selection.thins() && headers.iter().any(|header| header.has_faces) {
        lines.push("triangles are kept only where no point is left out".to_owned());
    }
    if selection.thins() && headers.iter().any(|header| header.grid.is_some()) {
        lines.push(
            "the rows and columns of a grid are kept only where no point is left out".to_owned(),
        );
    }
    lines.extend(becomes_one.then(|| only_apart(headers)).flatten());
    let mut systems = headers.iter().map(|header| header.coordinate_system.trim());
    if let Some(first) = systems.find(|system| !system.is_empty())
        && becomes_one
        && systems.any(|other| !other.is_empty() && other != first)
    {
        lines.push(
            "the clouds have different coordinate systems; what is written has that of the first"
                .to_owned(),
        );
    }
    let unknown = headers.iter().zip(files).filter(|(header, _)| header.metres_per_unit <= 0.0);
    let unknown: Vec<&Path> = unknown.map(|(_, file)| *file).collect();
    if let (true, true, [first, rest @ ..]) =
        (becomes_one, unknown.len() < headers.len(), unknown.as_slice())
    {
        let others = match rest.len() {
            0 => " does".to_owned(),
            n => format!(" and {n} more of {} clouds do", headers.len()),
        };
        lines.push(format!(
            "{}{others} not say the unit of its coordinates, which is taken to be that of the others",
            first.display()
        ));
    }
    let mut partly: Vec<&str> = headers
        .iter()
        .flat_map(|header| &header.columns)
        .map(|column| column.name.as_str())
        .filter(|name| ![POSITION, SCAN].contains(name) && selection.keeps(name))
        .filter(|name| headers.iter().any(|header| header.column(name).is_none()))
        .collect();
    partly.sort_unstable();
    partly.dedup();
    if becomes_one && !partly.is_empty() {
        let names: Vec<String> = partly.iter().map(|name| format!("`{name}`")).collect();
        lines.push(format!(
            "not every cloud has {}: points without a value get NaN, or 0 in columns of whole numbers and of spherical harmonics; \
             without a colour, grey",
            names.join(", ")
        ));
    }
    lines
}

/// What several clouds have each for itself, and one of all has no place for.
fn only_apart(headers: &[CloudHeader]) -> Option<String> {
    if headers.len() < 2 {
        return None;
    }
    let any = |test: fn(&CloudHeader) -> bool| headers.iter().any(test);
    let known = [
        (any(|header| header.pose != Pose::default()), "poses"),
        (any(|header| header.scanner.is_some()), "the places of their scanners"),
        (any(|header| header.grid.is_some()), "their grids"),
        (any(|header| !header.name.is_empty()), "all names but the first"),
        (headers.iter().any(|header| header.time != headers[0].time), "all times but the first"),
    ];
    let lost: Vec<&str> = known.iter().filter(|(is, _)| *is).map(|(_, what)| *what).collect();
    let list = match lost.as_slice() {
        [] => return None,
        [one] => (*one).to_owned(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    };
    Some(format!("{} clouds become one, which leaves out {list}", headers.len()))
}

/// The largest value of 16-bit colours, as far as one that 8 bits do not hold.
#[derive(Default)]
struct LargestColor {
    /// Where colours lie in a batch; `None` where the cloud has none of 16 bits.
    place: Option<usize>,
    most: u16,
}

impl CloudSinkHost for LargestColor {
    fn begin(&mut self, header: &CloudHeader) -> Result<bool> {
        self.place = header
            .column(COLOR)
            .filter(|(_, column)| column.element == Element::U16)
            .map(|(place, _)| place);
        Ok(self.place.is_some())
    }

    fn batch(&mut self, values: &[Values<'_>]) -> Result<()> {
        if let Some(Values::U16(colors)) = self.place.and_then(|place| values.get(place)) {
            self.most = colors.iter().copied().fold(self.most, u16::max);
        }
        match self.most > u16::from(u8::MAX) {
            true => Err(Error::new("colours have 16 bits")),
            false => Ok(()),
        }
    }

    fn faces(&mut self, _triangles: &[[u32; 3]]) -> Result<()> {
        Ok(())
    }

    fn warn(&mut self, _line: &str) {}
}

/// Whether 16-bit colours hold 8-bit values, as many programs write them. Files with other colours are read up to the
/// first of those.
pub(super) fn colors_are_narrow(
    inputs: &[PathBuf],
    headers: &[CloudHeader],
    options: &ReadOptions<'_>,
) -> std::result::Result<bool, ReadError> {
    let is_wide = |header: &CloudHeader| {
        header.column(COLOR).is_some_and(|(_, column)| column.element == Element::U16)
    };
    if !headers.iter().any(is_wide) || options.color_bits != ColorBits::Told {
        return Ok(options.color_bits == ColorBits::Eight);
    }
    let found = Arc::new(Mutex::new(LargestColor::default()));
    let most = || found.lock().unwrap_or_else(PoisonError::into_inner).most;
    // No part of the work that the bar shows, and it may be stopped all the same.
    let progress = |_: f64| (options.progress)(0.0);
    let columns = [COLOR.to_owned()];
    for input in inputs {
        let sink: SharedSink = found.clone();
        let options = ReadOptions { progress: &progress, ..*options };
        let read = stream(input, &options, Some(&columns), &sink);
        if most() > u16::from(u8::MAX) {
            return Ok(false);
        }
        read?;
    }
    Ok(most() > 0)
}

/// Takes 16-bit colours for the 8-bit ones that they hold.
pub fn narrow_colors(header: &mut CloudHeader) {
    for column in header.columns.iter_mut().filter(|column| column.name == COLOR) {
        if column.element == Element::U16 {
            column.element = Element::U8;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use surfelshop_api::format::FileColumn;

    fn header(names: &[&str]) -> CloudHeader {
        let column = |name: &&str| FileColumn::new(*name, 1, Element::F32);
        let bounds = Some([DVec3::ZERO, DVec3::ONE]);
        let columns = names.iter().map(column).collect();
        CloudHeader { columns, bounds, ..CloudHeader::default() }
    }

    #[test]
    fn selections_that_leave_nothing_are_refused() {
        let headers = [header(&[POSITION, "heat"])];
        let of = |columns: &[&str], crop| Selection {
            columns: Some(columns.iter().map(|&name| name.to_owned()).collect()),
            crop,
            every: 1,
        };
        let line = selection(&headers, &of(&["heat", "colour"], None)).unwrap_err();
        assert!(line.contains("no cloud has a column `colour`; there are `heat`, `position`"));
        assert!(selection(&headers, &of(&["scan"], None)).is_err());
        let two = [headers[0].clone(), header(&[POSITION])];
        assert_eq!(selection(&two, &of(&["scan"], None)), Ok(()));
        let lines = of_two(&two, &of(&["heat"], None), true);
        assert!(lines.len() == 1 && lines[0].contains("not every cloud has `heat`"), "{lines:?}");
        assert!(of_two(&two, &of(&["heat"], None), false).is_empty());
    }

    /// What is said of clouds of two files.
    fn of_two(headers: &[CloudHeader], selection: &Selection, becomes_one: bool) -> Vec<String> {
        let files: Vec<&Path> =
            (0..headers.len()).map(|i| Path::new(if i == 0 { "a" } else { "b" })).collect();
        remarks((headers, &files), selection, becomes_one)
    }

    fn of_unit(metres_per_unit: f64) -> CloudHeader {
        CloudHeader { metres_per_unit, ..CloudHeader::default() }
    }

    #[test]
    fn feet_and_metres_make_no_cloud_and_unknown_units_are_said() {
        let headers = |units: &[f64]| units.iter().map(|unit| of_unit(*unit)).collect::<Vec<_>>();
        let [survey, foot] = [1200.0 / 3937.0, 0.3048];
        for units in [&[1.0, survey][..], &[0.0, survey, 1.0], &[foot, survey]] {
            let line = one_unit(&headers(units)).unwrap_err();
            assert!(line.contains("different units") && line.contains("one by one"), "{line}");
        }
        for units in [&[][..], &[0.0], &[0.0, 0.0], &[survey, 0.0, 0.304_800_6], &[1.0, 1.0]] {
            assert_eq!(one_unit(&headers(units)), Ok(()), "{units:?}");
        }
        let lines = of_two(&headers(&[1.0, 0.0]), &Selection::default(), true);
        assert!(lines[0].starts_with("b does not say the unit"), "{lines:?}");
        assert!(of_two(&headers(&[1.0, 0.0]), &Selection::default(), false).is_empty());
        let lines = of_two(&headers(&[1.0, 0.0, 0.0]), &Selection::default(), true);
        assert!(lines[0].starts_with("b and 1 more of 3 clouds do not say"), "{lines:?}");
        let system = |name: &str| CloudHeader { coordinate_system: name.into(), ..of_unit(1.0) };
        let lines = of_two(&[system("A"), system(""), system("B")], &Selection::default(), true);
        assert!(lines[0].contains("different coordinate systems"), "{lines:?}");
    }

    #[test]
    fn what_each_cloud_has_for_itself_is_said_to_be_lost() {
        let scan =
            CloudHeader { grid: Some([2, 3]), scanner: Some(DVec3::ZERO), ..header(&[POSITION]) };
        let other = CloudHeader { time: "2020-01-02".to_owned(), ..scan.clone() };
        let two = [scan.clone(), other];
        assert_eq!(
            of_two(&two, &Selection::default(), true),
            [
                "2 clouds become one, which leaves out the places of their scanners, their grids and all times but the first"
            ]
        );
        assert!(of_two(&two, &Selection::default(), false).is_empty());
        assert!(of_two(&two[..1], &Selection::default(), true).is_empty());
        let every = Selection { every: 2, ..Selection::default() };
        let lines = of_two(&two[..1], &every, false);
        assert!(lines.len() == 1 && lines[0].contains("rows and columns"), "{lines:?}");
    }
}
