//! A motion from pairs of places that are the same.

use super::icp::Motion;
use crate::typed::rows;
use surfelshop_api::glam::{DMat3, DMat4, DQuat, DVec3, DVec4};
use surfelshop_api::prelude::*;
use surfelshop_geometry::eigen;

/// Squarings of a matrix after which its largest eigenvalue alone is left: of two that are a billionth apart as well.
const SQUARINGS: usize = 40;

/// The rigid motion, of offsets from `origin`, that brings the first places of typed pairs nearest to the second ones in
/// the mean square.
///
/// # Errors
/// Where there are not three pairs, or all places are one.
pub(super) fn motion(text: &str, origin: DVec3) -> Result<Motion> {
    let form = "three pairs or more, `x y z x y z` with semicolons between";
    let place = |x, y, z| DVec3::new(x, y, z) - origin;
    let pairs = rows("pairs", text, form)?.into_iter();
    let pairs: Vec<(DVec3, DVec3)> =
        pairs.map(|[a, b, c, x, y, z]: [f64; 6]| (place(a, b, c), place(x, y, z))).collect();
    if pairs.len() < 3 {
        return Err(Error::new(format!("`pairs`: expected {form}, found {}", pairs.len())));
    }
    let n = pairs.len() as f64;
    let own = pairs.iter().map(|pair| pair.0).sum::<DVec3>() / n;
    let other = pairs.iter().map(|pair| pair.1).sum::<DVec3>() / n;
    let outer = |a: DVec3, b: DVec3| DMat3::from_cols(b * a.x, b * a.y, b * a.z);
    let (mut sum, mut owns, mut others) = (DMat3::ZERO, DMat3::ZERO, DMat3::ZERO);
    for (a, b) in &pairs {
        let (a, b) = (*a - own, *b - other);
        sum += outer(a, b);
        owns += outer(a, a);
        others += outer(b, b);
    }
    let turn = rotation(sum).filter(|_| is_spread(owns, own) && is_spread(others, other));
    let turn = turn.ok_or_else(|| {
        Error::new(
            "`pairs`: expected three places of each cloud that are not on one line, found others",
        )
    })?;
    Ok(Motion { turn, translation: other - turn * own })
}

/// Places spread across a line by at least this share of how they spread along it, squared: less tells no turn about it.
const LEAST_SPREAD: f64 = 1e-6;

/// Whether places, of which the sum of outer products is given, around `middle`, are not all near one line.
fn is_spread(sum: DMat3, middle: DVec3) -> bool {
    let [along, across, _] = eigen::symmetric(sum).values;
    // All at one place but for rounding.
    let is_point = along <= (1e-12 * middle.length()).powi(2);
    !is_point && across > LEAST_SPREAD * along
}

/// The rotation R for which the trace of R transposed times `sum` is largest: the eigenvector of the largest eigenvalue of
/// Horn's matrix.
fn rotation(sum: DMat3) -> Option<DQuat> {
    let s = |row: usize, column: usize| sum.col(column)[row];
    let (w, x, y, z) =
        (s(0, 0) + s(1, 1) + s(2, 2), s(2, 1) - s(1, 2), s(0, 2) - s(2, 0), s(1, 0) - s(0, 1));
    let (xy, xz, yz) = (s(0, 1) + s(1, 0), s(0, 2) + s(2, 0), s(1, 2) + s(2, 1));
    let matrix = DMat4::from_cols(
        DVec4::new(w, x, y, z),
        DVec4::new(x, s(0, 0) - s(1, 1) - s(2, 2), xy, xz),
        DVec4::new(y, xy, s(1, 1) - s(0, 0) - s(2, 2), yz),
        DVec4::new(z, xz, yz, s(2, 2) - s(0, 0) - s(1, 1)),
    );
    let size = |m: &DMat4| m.to_cols_array().iter().map(|value| value * value).sum::<f64>().sqrt();
    // No eigenvalue is above this in magnitude, so that all are positive with it added.
    let shift = size(&matrix);
    if !(shift > 0.0 && shift.is_finite()) {
        return None;
    }
    let mut power = matrix * (1.0 / shift) + DMat4::IDENTITY;
    for _ in 0..SQUARINGS {
        power = power * power;
        power *= 1.0 / size(&power);
    }
    let columns = [power.x_axis, power.y_axis, power.z_axis, power.w_axis];
    let longest =
        columns.into_iter().max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))?;
    let [w, x, y, z] = longest.try_normalize()?.to_array();
    Some(DQuat::from_xyzw(x, y, z, w))
}
