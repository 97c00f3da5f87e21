//! A lattice of control points and the polynomials that blend them.

use surfelshop_api::glam::{DMat3, DVec3};
use surfelshop_api::prelude::*;

/// Most control points along an axis.
const MOST: usize = 32;

/// How far control points are moved, in shares of the lattice's box.
#[derive(Clone, Debug)]
pub(crate) struct Lattice {
    /// Control points along x, y and z.
    counts: [usize; 3],
    /// Control points that are moved: their numbers along the axes, and how far.
    moved: Vec<([usize; 3], DVec3)>,
}

impl Lattice {
    /// Reads a lattice from text.
    ///
    /// # Errors
    /// A line that says what was expected and what was found.
    pub(crate) fn read(text: &str) -> Result<Self> {
        let lines = text.lines().map(|line| line.split('#').next().unwrap_or_default());
        let words = lines.flat_map(|line| line.split([' ', '\t', ',', ';']));
        let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
        let whole = |word: &str, least: usize, most: usize, what: &str| {
            let number = word.parse().ok().filter(|number| (least..=most).contains(number));
            number.ok_or_else(|| {
                Error::new(format!(
                    "lattice: expected {what}, a whole number from {least} to {most}, found `{word}`"
                ))
            })
        };
        let Some((counts, rest)) = words.split_first_chunk::<3>() else {
            return Err(Error::new(format!(
                "lattice: expected how many control points there are along x, y and z, found {} numbers",
                words.len()
            )));
        };
        let mut n = [0; 3];
        for (n, word) in n.iter_mut().zip(counts) {
            *n = whole(word, 2, MOST, "how many control points there are along an axis")?;
        }
        let (points, rest) = rest.as_chunks::<6>();
        if !rest.is_empty() {
            return Err(Error::new(format!(
                "lattice: expected six numbers for each point that is moved, found {} after the last",
                rest.len()
            )));
        }
        let mut moved: Vec<([usize; 3], DVec3)> = Vec::new();
        for point in points {
            let mut at = [0; 3];
            for axis in 0..3 {
                at[axis] = whole(point[axis], 0, n[axis] - 1, "the number of a control point")?;
            }
            let mut far = DVec3::ZERO;
            for axis in 0..3 {
                let word = point[3 + axis];
                let share = word.parse().ok().filter(|share: &f64| share.is_finite());
                far[axis] = share.ok_or_else(|| {
                    Error::new(format!(
                        "lattice: expected a finite share of the box, found `{word}`"
                    ))
                })?;
            }
            if moved.iter().any(|(other, _)| *other == at) {
                let [i, j, k] = at;
                return Err(Error::new(format!(
                    "lattice: expected each point once, found {i} {j} {k} twice"
                )));
            }
            moved.push((at, far));
        }
        Ok(Self { counts: n, moved })
    }

    /// How far a place is moved, and the derivative of that; place and result in shares of the box.
    pub(crate) fn offset(&self, at: DVec3) -> (DVec3, DMat3) {
        let blends = [0, 1, 2].map(|axis| bernstein(self.counts[axis] - 1, at[axis]));
        let (mut offset, mut slope) = (DVec3::ZERO, DMat3::ZERO);
        for ([i, j, k], far) in &self.moved {
            let [(x, dx), (y, dy), (z, dz)] = [blends[0][*i], blends[1][*j], blends[2][*k]];
            offset += x * y * z * *far;
            let change = DVec3::new(dx * y * z, x * dy * z, x * y * dz);
            slope += DMat3::from_cols(change.x * *far, change.y * *far, change.z * *far);
        }
        (offset, slope)
    }
}

/// The Bernstein polynomials of a degree at `t`, and their derivatives.
fn bernstein(degree: usize, t: f64) -> [(f64, f64); MOST] {
    let mut values = [(0.0, 0.0); MOST];
    values[0].0 = 1.0;
    for step in 1..=degree {
        if step == degree {
            // Derivatives follow from the polynomials of one degree less.
            for i in 0..=degree {
                let before = if i > 0 { values[i - 1].0 } else { 0.0 };
                let here = if i < degree { values[i].0 } else { 0.0 };
                values[i].1 = degree as f64 * (before - here);
            }
        }
        for i in (0..=step).rev() {
            let before = if i > 0 { values[i - 1].0 } else { 0.0 };
            let here = if i < step { values[i].0 } else { 0.0 };
            values[i].0 = t * before + (1.0 - t) * here;
        }
    }
    values
}
