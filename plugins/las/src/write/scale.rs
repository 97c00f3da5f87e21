//! Steps of coordinates: how fine positions are in a file, and where they count from.

use surfelshop_api::format::CloudHeader;
use surfelshop_api::glam::DVec3;
use surfelshop_api::{Error, Result};

/// Steps that a coordinate has at most, with some to spare of the 2^32 that there are.
const MOST_STEPS: f64 = 4.0e9;
/// Steps from the offset to a coordinate, with some to spare.
const REACH: f64 = 2.1e9;
/// The finest step that is chosen for clouds that say nothing, where their extent is that of a survey.
const FINEST: f64 = 1e-5;

/// Scale and offset of coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Steps {
    pub(super) scale: DVec3,
    pub(super) offset: DVec3,
}

impl Steps {
    /// Those for a cloud with such a header whose first positions are these. `chosen` is the user's scale, or 0.
    ///
    /// # Errors
    /// Where the user's scale is too fine for the cloud.
    pub(super) fn choose(header: &CloudHeader, first: &[f64], chosen: f64) -> Result<Self> {
        let [low, high] = header.bounds.filter(are_in_order).unwrap_or_else(|| bounds(first));
        let extent = high - low;
        let step = header.step.filter(|step| step.is_finite() && step.cmpgt(DVec3::ZERO).all());
        let start = first.chunks_exact(3).map(DVec3::from_slice).find(|point| point.is_finite());
        let usual = usual(extent.max_element());
        let (mut scale, mut offset) = (DVec3::ZERO, DVec3::ZERO);
        for axis in 0..3 {
            let promised = step.map(|step| step[axis]);
            let least = extent[axis] / MOST_STEPS;
            let mut one = if chosen > 0.0 { chosen } else { promised.unwrap_or(usual) };
            if one < least {
                if chosen > 0.0 {
                    return Err(Error::new(format!(
                        "a scale of {chosen:?} does not reach over the {:?} units of the cloud; expected at least {:?}",
                        extent[axis],
                        power_above(least)
                    )));
                }
                one = power_above(least);
            }
            scale[axis] = one;
            offset[axis] = base(low[axis], high[axis], one);
            if let (Some(_), Some(start)) = (promised, start) {
                offset[axis] += off_lattice(start[axis], offset[axis], one);
            }
        }
        Ok(Self { scale, offset })
    }
}

fn are_in_order([low, high]: &[DVec3; 2]) -> bool {
    low.is_finite() && high.is_finite() && low.cmple(*high).all()
}

/// The box around the finite ones of these positions.
fn bounds(positions: &[f64]) -> [DVec3; 2] {
    let points = positions.chunks_exact(3).map(DVec3::from_slice);
    let around = points.filter(|point| point.is_finite()).fold(None, |around, point| {
        let [low, high] = around.unwrap_or([point; 2]);
        Some([point.min(low), point.max(high)])
    });
    around.unwrap_or_default()
}

/// The step for a cloud of this extent that says nothing of steps: a power of ten about as fine as single
/// precision there, at most [`FINEST`], and coarser only where 32 bits do not reach.
fn usual(extent: f64) -> f64 {
    if extent.is_nan() || extent <= 0.0 {
        return FINEST;
    }
    let single = 10f64.powf((extent * 1e-7).log10().floor());
    single.min(FINEST).max(power_above(extent * 1e-9))
}

/// The smallest power of ten that is not smaller.
fn power_above(number: f64) -> f64 {
    10f64.powf(number.log10().ceil())
}

/// The place that coordinates from `low` to `high` count from: 0, or a round number near their middle.
fn base(low: f64, high: f64, scale: f64) -> f64 {
    if low.abs().max(high.abs()) <= REACH * scale {
        return 0.0;
    }
    let unit = scale * 1e6;
    ((low + high) / 2.0 / unit).round() * unit
}

/// How far a place lies from the next of the places that are whole steps from `offset`; 0 where that is little.
/// Moving the offset by it keeps the steps that a cloud had in its file.
fn off_lattice(place: f64, offset: f64, scale: f64) -> f64 {
    let steps = (place - offset) / scale;
    let off = steps - steps.round();
    if off.abs() > 0.1 { off * scale } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud(low: f64, high: f64, step: Option<f64>) -> CloudHeader {
        CloudHeader {
            bounds: Some([DVec3::splat(low), DVec3::splat(high)]),
            step: step.map(DVec3::splat),
            ..CloudHeader::default()
        }
    }

    #[test]
    fn steps_are_those_of_the_cloud_or_suit_its_extent() {
        let scale = |low, high, step, chosen| {
            Steps::choose(&cloud(low, high, step), &[], chosen).unwrap().scale.x
        };
        assert!((scale(0.0, 0.15, None, 0.0) / 1e-8 - 1.0).abs() < 1e-9);
        assert!((scale(0.0, 500.0, None, 0.0) / 1e-5 - 1.0).abs() < 1e-9);
        assert!((scale(-3e6, 3e6, None, 0.0) / 1e-2 - 1.0).abs() < 1e-9);
        assert_eq!(scale(0.0, 500.0, Some(0.00025), 0.0), 0.00025);
        assert_eq!(scale(0.0, 500.0, Some(0.00025), 0.5), 0.5);
        assert_eq!(scale(0.0, 5e9, Some(0.001), 0.0), 10.0);
        let line = Steps::choose(&cloud(0.0, 1e9, None), &[], 0.001).unwrap_err();
        assert!(line.to_string().contains("at least 1"), "{line}");
    }

    #[test]
    fn offsets_are_round_and_keep_the_steps_of_the_file() {
        let header = cloud(6_010_935.0, 6_010_946.0, Some(1e-4));
        let first = [6_010_935.000_05; 3];
        let steps = Steps::choose(&header, &first, 0.0).unwrap();
        let whole = (first[0] - steps.offset.x) / steps.scale.x;
        assert!((whole - whole.round()).abs() < 1e-3, "{whole}");
        assert!(whole.abs() < REACH);
        let plain = Steps::choose(&header, &[6_010_935.0; 3], 0.0).unwrap();
        assert_eq!(plain.offset.x, 6_010_900.0);
        let near = Steps::choose(&cloud(-5.0, 5.0, Some(0.01)), &[1.0; 3], 0.0);
        assert_eq!(near.unwrap().offset, DVec3::ZERO);
        let none = Steps::choose(&CloudHeader::default(), &[f64::NAN; 3], 0.0);
        assert!(none.unwrap().scale.x > 0.0);
    }
}
