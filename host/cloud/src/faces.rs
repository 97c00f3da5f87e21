//! Faces of a file, of whatever shape, as triangles between its points.

use crate::memory::{OutOfMemory, ask, grow};

/// Triangles between the rows of a table. A face that cannot be used is left out and counted.
#[derive(Debug, Default)]
pub(crate) struct Faces {
    /// Rows that there are.
    n_rows: usize,
    triangles: Vec<[u32; 3]>,
    n_faces: u64,
    n_bad: u64,
}

impl Faces {
    /// No faces yet, between `n_rows` points.
    pub(crate) fn new(n_rows: usize) -> Self {
        Self { n_rows, ..Self::default() }
    }

    /// Rows that there are.
    pub(crate) fn n_rows(&self) -> usize {
        self.n_rows
    }

    /// The index, where there is such a row.
    fn row(&self, index: i64) -> Option<u32> {
        let is_there = usize::try_from(index).is_ok_and(|index| index < self.n_rows);
        u32::try_from(index).ok().filter(|_| is_there)
    }

    /// Adds a convex polygon as a fan. Corners that are named twice in a row count once, since some
    /// programs write triangles as quads.
    ///
    /// # Errors
    /// Where there is no memory for it.
    pub(crate) fn polygon(&mut self, corners: &[i64]) -> Result<(), OutOfMemory> {
        self.n_faces += 1;
        grow(&mut self.triangles, corners.len())?;
        // Rows, in both orders.
        ask(corners.len() as u64 * 8)?;
        let rows: Option<Vec<u32>> = corners.iter().map(|&corner| self.row(corner)).collect();
        let Some(mut rows) = rows else {
            self.n_bad += 1;
            return Ok(());
        };
        rows.dedup();
        if rows.len() > 1 && rows.first() == rows.last() {
            rows.pop();
        }
        let mut sorted = rows.clone();
        sorted.sort_unstable();
        let is_simple = sorted.windows(2).all(|pair| pair[0] != pair[1]);
        match rows[..] {
            [first, _, _, ..] if is_simple => {
                let fan = rows[1..].windows(2).map(|pair| [first, pair[0], pair[1]]);
                self.triangles.extend(fan);
            }
            _ => self.n_bad += 1,
        }
        Ok(())
    }

    /// Adds a strip: each corner makes a triangle with the two before it, every second one with its
    /// corners in the other order; -1 starts anew. Triangles with a corner that is named twice only
    /// lead from one part of a strip to the next.
    ///
    /// # Errors
    /// Where there is no memory for them.
    pub(crate) fn strip(&mut self, corners: &[i64]) -> Result<(), OutOfMemory> {
        grow(&mut self.triangles, corners.len())?;
        for strip in corners.split(|&corner| corner == -1) {
            for (place, triple) in strip.windows(3).enumerate() {
                let [a, b, c] = if place % 2 == 0 { [0, 1, 2] } else { [1, 0, 2] };
                let rows = (self.row(triple[a]), self.row(triple[b]), self.row(triple[c]));
                match rows {
                    (Some(a), Some(b), Some(c)) if a != b && b != c && c != a => {
                        self.n_faces += 1;
                        self.triangles.push([a, b, c]);
                    }
                    (Some(_), Some(_), Some(_)) => {}
                    _ => {
                        self.n_faces += 1;
                        self.n_bad += 1;
                    }
                }
            }
        }
        Ok(())
    }

    /// Counts a face that could not be read.
    pub(crate) fn add_bad(&mut self) {
        self.n_faces += 1;
        self.n_bad += 1;
    }

    /// The triangles, and a sentence about the faces that were left out.
    pub(crate) fn finish(self) -> (Vec<[u32; 3]>, Option<String>) {
        let Self { n_faces, n_bad, n_rows, triangles } = self;
        let warning = (n_bad > 0).then(|| {
            format!(
                "{n_bad} of {n_faces} faces were left out: they have fewer than three different \
                 corners, name one twice, or name none of the {n_rows} points"
            )
        });
        (triangles, warning)
    }
}

/// The triangles all of whose corners stay, with the places that these then have.
pub(crate) fn kept(triangles: &[[u32; 3]], mask: &[bool]) -> Vec<[u32; 3]> {
    if triangles.is_empty() {
        return Vec::new();
    }
    let mut n_kept = 0;
    let places: Vec<Option<u32>> = mask
        .iter()
        .map(|&keep| {
            n_kept += u32::from(keep);
            keep.then(|| n_kept - 1)
        })
        .collect();
    let place = |corner: u32| places.get(corner as usize).copied().flatten();
    let moved = |&[a, b, c]: &[u32; 3]| Some([place(a)?, place(b)?, place(c)?]);
    triangles.iter().filter_map(moved).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The triangles of one polygon between ten points, and whether it was left out.
    fn polygon(corners: &[i64]) -> (Vec<[u32; 3]>, bool) {
        let mut faces = Faces::new(10);
        faces.polygon(corners).unwrap();
        let (triangles, warning) = faces.finish();
        (triangles, warning.is_some())
    }

    #[test]
    fn polygons_become_fans() {
        assert_eq!(polygon(&[3, 1, 2]), (vec![[3, 1, 2]], false));
        assert_eq!(polygon(&[0, 1, 2, 3]), (vec![[0, 1, 2], [0, 2, 3]], false));
        assert_eq!(polygon(&[4, 5, 6, 7, 8]).0, [[4, 5, 6], [4, 6, 7], [4, 7, 8]]);
        assert_eq!(polygon(&[0, 1, 2, 2]), (vec![[0, 1, 2]], false));
        assert_eq!(polygon(&[0, 1, 2, 0]), (vec![[0, 1, 2]], false));
    }

    #[test]
    fn bad_polygons_are_left_out_whole() {
        let bad: [&[i64]; 8] =
            [&[], &[1], &[1, 2], &[1, 1, 2], &[0, 1, 10], &[0, 1, 2, -1], &[0, 1, 2, 1], &[1; 5]];
        for corners in bad {
            assert_eq!(polygon(corners), (vec![], true), "{corners:?}");
        }
        assert_eq!(polygon(&[0, 1, i64::from(u32::MAX) + 3]), (vec![], true));
    }

    #[test]
    fn strips_alternate_and_start_anew() {
        let mut faces = Faces::new(6);
        faces.strip(&[0, 1, 2, 3, -1, 2, 3, 4, -1, -1, 5, 0]).unwrap();
        faces.strip(&[0, 1, 2, 2, 3, 4]).unwrap();
        faces.strip(&[]).unwrap();
        let (triangles, warning) = faces.finish();
        let expected = [[0, 1, 2], [2, 1, 3], [2, 3, 4], [0, 1, 2], [3, 2, 4]];
        assert_eq!((&triangles[..], warning), (&expected[..], None));
    }

    #[test]
    fn triangles_of_strips_with_a_bad_corner_are_left_out_and_counted() {
        let mut faces = Faces::new(4);
        faces.strip(&[0, 1, 2, 9, 3, 0, 1]).unwrap();
        let (triangles, warning) = faces.finish();
        assert_eq!(triangles, [[0, 1, 2], [3, 0, 1]]);
        assert!(warning.unwrap().starts_with("3 of 5 faces were left out"));
    }

    #[test]
    fn triangles_stay_where_all_corners_stay() {
        let triangles = [[0, 1, 2], [1, 2, 3], [4, 3, 1]];
        let mask = [false, true, true, true, true];
        assert_eq!(kept(&triangles, &mask), [[0, 1, 2], [3, 2, 0]]);
        assert_eq!(kept(&triangles, &[true; 5]), triangles);
        assert!(kept(&triangles, &[false; 5]).is_empty());
    }
}
