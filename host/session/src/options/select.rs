//! What is selected, as it is typed.

use super::colors::FilterSpec;
use super::values::crop_box;
use glam::{DQuat, DVec3};
use surfelshop_cloud::Cloud;
use surfelshop_cloud::Transform;
use surfelshop_cloud::scene::Axis;
use surfelshop_cloud::selection::{
    Combine, Region, RegionSelection, RegionStep, Selection, SelectionError, component, grown,
    shrunk, usual_distance,
};

/// A step of a selection.
#[derive(Clone, Debug, PartialEq)]
pub struct SelectStep {
    how: Combine,
    what: What,
}

#[derive(Clone, Debug, PartialEq)]
enum What {
    Region(Region),
    /// A box that is turned about the upward axis, degrees.
    TurnedBox([DVec3; 2], f64),
    /// What hangs together with a place, by steps of at most so far.
    Component(DVec3, Option<f64>),
    Invert,
    Grow(Option<f64>),
    Shrink(Option<f64>),
}

/// What can be typed.
const EXPECTED: &str = "expected all, box:X,Y,Z:X,Y,Z[:DEGREES], sphere:X,Y,Z:RADIUS, plane:X,Y,Z:X,Y,Z, \
                        component:X,Y,Z[:DISTANCE], NAME=LOW..HIGH or NAME=N,N, with not: or and: before it, or invert, \
                        grow[:DISTANCE] or shrink[:DISTANCE]";

impl SelectStep {
    /// Reads a step.
    ///
    /// # Errors
    /// A line that says what was expected.
    pub fn parse(text: &str) -> Result<Self, String> {
        let (how, text) = match (text.strip_prefix("not:"), text.strip_prefix("and:")) {
            (Some(rest), _) => (Combine::Subtract, rest),
            (_, Some(rest)) => (Combine::Intersect, rest),
            _ => (Combine::Add, text),
        };
        let expected = || format!("{EXPECTED}; found {text}");
        let what = match text.split_once(':') {
            _ if text == "all" => What::Region(Region::All),
            None if text == "invert" => What::Invert,
            None if text == "grow" => What::Grow(None),
            None if text == "shrink" => What::Shrink(None),
            Some(("grow", rest)) => What::Grow(Some(length(rest).ok_or_else(expected)?)),
            Some(("shrink", rest)) => What::Shrink(Some(length(rest).ok_or_else(expected)?)),
            Some(("box", rest)) => match rest.splitn(3, ':').collect::<Vec<_>>()[..] {
                [low, high, degrees] => {
                    let corners = crop_box(&format!("{low}:{high}"))?;
                    let degrees: Option<f64> = degrees.trim().parse().ok();
                    let degrees = degrees.filter(|degrees| degrees.is_finite());
                    What::TurnedBox(corners, degrees.ok_or_else(expected)?)
                }
                _ => What::Region(Region::Box(crop_box(rest)?)),
            },
            Some(("sphere", rest)) => {
                let (center, radius) = rest.split_once(':').ok_or_else(expected)?;
                let center = place(center).ok_or_else(expected)?;
                let radius = length(radius).ok_or_else(expected)?;
                What::Region(Region::Sphere { center, radius })
            }
            Some(("plane", rest)) => {
                let (point, normal) = rest.split_once(':').ok_or_else(expected)?;
                let (point, normal) = place(point).zip(place(normal)).ok_or_else(expected)?;
                if normal.length() <= 0.0 {
                    return Err(expected());
                }
                What::Region(Region::Plane { point, normal })
            }
            Some(("component", rest)) => {
                let (at, distance) = match rest.split_once(':') {
                    Some((at, distance)) => (at, Some(length(distance).ok_or_else(expected)?)),
                    None => (rest, None),
                };
                What::Component(place(at).ok_or_else(expected)?, distance)
            }
            _ => match FilterSpec::parse(text) {
                Ok(FilterSpec(Some((attribute, test)))) => {
                    let up = Axis::default();
                    What::Region(Region::Values { attribute, test, up })
                }
                _ => return Err(expected()),
            },
        };
        let stands_alone = matches!(what, What::Invert | What::Grow(_) | What::Shrink(_));
        match stands_alone && how != Combine::Add {
            true => Err(expected()),
            false => Ok(Self { how, what }),
        }
    }
}

pub(super) fn place(text: &str) -> Option<DVec3> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|n| n.trim().parse().ok()).collect();
    let numbers: [f64; 3] = numbers?.try_into().ok()?;
    Some(DVec3::from_array(numbers)).filter(|place| place.is_finite())
}

fn length(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|length: &f64| length.is_finite() && *length > 0.0)
}

/// A box between two corners, turned about its middle and the upward axis, counter-clockwise as seen from above.
#[must_use]
pub fn turned_box([low, high]: [DVec3; 2], degrees: f64, up: Axis) -> Region {
    let turn = DQuat::from_axis_angle(up.direction(), degrees.to_radians());
    Region::TurnedBox { middle: 0.5 * (low + high), half: 0.5 * (high - low), turn }
}

/// What steps select of a cloud, one after the other from nothing; where the first one leaves something out, from
/// everything.
///
/// # Errors
/// Where the cloud lacks an attribute, or there is no memory.
pub fn select(cloud: &Cloud, steps: &[SelectStep], up: Axis) -> Result<Selection, SelectionError> {
    let begins_whole = steps.first().is_some_and(|first| first.how != Combine::Add);
    let nothing = Selection::none(cloud.len())?;
    let mut chosen = if begins_whole { nothing.inverted() } else { nothing };
    let usual = |distance: &Option<f64>| distance.unwrap_or_else(|| usual_distance(cloud));
    for SelectStep { how, what } in steps {
        chosen = match what {
            What::Invert => chosen.inverted(),
            What::Grow(distance) => grown(cloud, &chosen, usual(distance))?,
            What::Shrink(distance) => shrunk(cloud, &chosen, usual(distance))?,
            What::Component(place, distance) => {
                chosen.combined(&component(cloud, *place, usual(distance))?, *how)?
            }
            What::TurnedBox(corners, degrees) => {
                chosen.combined(&turned_box(*corners, *degrees, up).select(cloud)?, *how)?
            }
            What::Region(Region::Values { attribute, test, .. }) => {
                let (attribute, test) = (attribute.clone(), test.clone());
                let region = Region::Values { attribute, test, up };
                chosen.combined(&region.select(cloud)?, *how)?
            }
            What::Region(region) => chosen.combined(&region.select(cloud)?, *how)?,
        };
    }
    Ok(chosen)
}

/// What steps select of a cloud that is not in memory, in the same order.
///
/// # Errors
/// Where a step wants the neighbours of surfels.
pub fn regions(
    steps: &[SelectStep],
    placed: Transform,
    up: Axis,
) -> Result<RegionSelection, String> {
    let begins_whole = steps.first().is_some_and(|first| first.how != Combine::Add);
    let mut all = Vec::new();
    if begins_whole {
        all.push(RegionStep::Invert);
    }
    for SelectStep { how, what } in steps {
        let region = match what {
            What::Invert => {
                all.push(RegionStep::Invert);
                continue;
            }
            What::Grow(_) | What::Shrink(_) | What::Component(..) => {
                return Err("grow, shrink and component want all surfels in memory, and this is a pyramid; use the \
                            files that it was made of"
                    .to_owned());
            }
            What::TurnedBox(corners, degrees) => turned_box(*corners, *degrees, up),
            What::Region(Region::Values { attribute, test, .. }) => {
                Region::Values { attribute: attribute.clone(), test: test.clone(), up }
            }
            What::Region(region) => region.clone(),
        };
        all.push(RegionStep::Take { how: *how, region });
    }
    Ok(RegionSelection { placed, steps: all })
}

/// A value for a column of what is selected.
#[derive(Clone, Debug, PartialEq)]
pub struct ColumnValue {
    /// The column.
    pub name: String,
    /// A number for each component.
    pub values: Vec<f64>,
}

impl ColumnValue {
    /// Reads `NAME=VALUE` or `NAME=VALUE,VALUE,VALUE`.
    ///
    /// # Errors
    /// A line that says what was expected.
    pub fn parse(text: &str) -> Result<Self, String> {
        let expected = || {
            format!("expected NAME=VALUE, such as classification=6 or color=255,0,0, found {text}")
        };
        let (name, values) = text.split_once('=').ok_or_else(expected)?;
        let values: Option<Vec<f64>> = values.split(',').map(|v| v.trim().parse().ok()).collect();
        let values = values.filter(|values| values.iter().all(|value| value.is_finite()));
        match (name.trim(), values) {
            ("", _) | (_, None) => Err(expected()),
            (name, Some(values)) => Ok(Self { name: name.to_owned(), values }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_cloud::{Buffer, Column};

    fn cloud() -> Cloud {
        let position = (0..10).flat_map(|i| [i as f32, 0.0, 0.0]).collect();
        let class = (0..10).map(|i| i % 2).collect();
        let columns = vec![
            Column::new("position", 3, Buffer::F32(position)),
            Column::new("class", 1, Buffer::U8(class)),
        ];
        Cloud::new(DVec3::ZERO, columns).unwrap()
    }

    #[test]
    fn steps_are_done_one_after_the_other() {
        let select = |steps: &[&str]| {
            let steps: Vec<SelectStep> =
                steps.iter().map(|s| SelectStep::parse(s).unwrap()).collect();
            select(&cloud(), &steps, Axis::PlusY).unwrap().indices().collect::<Vec<_>>()
        };
        assert_eq!(select(&["box:0,-1,-1:3,1,1"]), [0, 1, 2, 3]);
        assert_eq!(select(&["box:0,-1,-1:3,1,1", "class=1"]), [0, 1, 2, 3, 5, 7, 9]);
        assert_eq!(select(&["box:0,-1,-1:3,1,1", "and:class=1"]), [1, 3]);
        assert_eq!(select(&["box:-0.1,-1,-1:6.1,1,1:180"]), [0, 1, 2, 3, 4, 5, 6]);
        // Turned by about a right angle it stands across the row of places.
        assert_eq!(select(&["box:0,-1,-1:6,1,1:-90.5"]), [2, 3, 4]);
        assert_eq!(select(&["not:class=1", "not:sphere:0,0,0:3"]), [4, 6, 8]);
        assert_eq!(select(&["plane:6.5,0,0:1,0,0", "grow:1.5", "invert"]), [0, 1, 2, 3, 4, 5]);
        assert_eq!(select(&["all", "shrink:1"]).len(), 10);
        assert_eq!(select(&["component:-5,0,0:0.5"]), [0]);
        assert_eq!(select(&["component:-5,0,0:1"]).len(), 10);
    }

    #[test]
    fn boxes_are_turned_counter_clockwise_as_seen_from_above() {
        let (sin, cos) = 30f32.to_radians().sin_cos();
        // A place at the end of a long box, and its mirror image, with z, y and -z upwards.
        for (up, places) in [
            (Axis::PlusZ, [[2.9 * cos, 2.9 * sin, 0.0], [2.9 * cos, -2.9 * sin, 0.0]]),
            (Axis::PlusY, [[2.9 * cos, 0.0, -2.9 * sin], [2.9 * cos, 0.0, 2.9 * sin]]),
            (Axis::MinusZ, [[2.9 * cos, -2.9 * sin, 0.0], [2.9 * cos, 2.9 * sin, 0.0]]),
        ] {
            let position = Buffer::F32(places.into_iter().flatten().collect());
            let columns = vec![Column::new("position", 3, position)];
            let cloud = Cloud::new(DVec3::ZERO, columns).unwrap();
            let step = SelectStep::parse("box:-3,-0.3,-0.3:3,0.3,0.3:30").unwrap();
            let chosen = select(&cloud, &[step], up).unwrap();
            assert_eq!(chosen.indices().collect::<Vec<_>>(), [0], "{up:?}");
        }
    }

    #[test]
    fn what_is_mistyped_is_answered_in_a_line() {
        for wrong in [
            "",
            "sphere:1,2:3",
            "sphere:1,2,3:-1",
            "plane:0,0,0:0,0,0",
            "grow:x",
            "box:0,0,0:1,1,1:x",
            "box:0,0,0:1,1,1:inf",
            "box:0,0,0:1,1,1:90:90",
            "not:invert",
            "a",
            "none",
        ] {
            let line = SelectStep::parse(wrong).unwrap_err();
            assert!(line.starts_with("expected all, box:") && !line.contains('\n'), "{line}");
        }
        assert!(
            SelectStep::parse("box:1,1,1:0,0,0").unwrap_err().contains("x runs from 1 down to 0")
        );
        let parse = ColumnValue::parse;
        assert_eq!(parse("color=1, 2,3").unwrap().values, [1.0, 2.0, 3.0]);
        for wrong in ["a", "=1", "a=x", "a=nan", "a="] {
            assert!(parse(wrong).unwrap_err().starts_with("expected NAME=VALUE"));
        }
    }
}
