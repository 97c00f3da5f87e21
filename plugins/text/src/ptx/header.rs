//! What a PTX file says of a scan before its points.

use crate::text::{Line, LineReader, count, number, quoted};
use surfelshop_api::format::Pose;
use surfelshop_api::glam::{DMat3, DMat4, DQuat, DVec3, DVec4};
use surfelshop_api::{Error, Result};

/// How far the axes of a rotation may be from unit length and from right angles: files have six decimals.
const TOLERANCE: f64 = 1e-3;

/// What a PTX file says of a scan before its points.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ScanHeader {
    pub(super) columns: u64,
    pub(super) rows: u64,
    /// From the scan's axes to common coordinates, for column vectors.
    pub(super) matrix: DMat4,
    /// Whether the file has the matrix for column vectors, against the rules.
    pub(super) transposed: bool,
}

impl ScanHeader {
    /// Reads the ten lines.
    ///
    /// # Errors
    /// Where one of them is not there or has other numbers than expected.
    pub(super) fn read(reader: &mut LineReader<'_>) -> Result<Self> {
        let columns = lone_count(reader, "columns")?;
        let rows = lone_count(reader, "rows")?;
        for _place_and_axes in 0..4 {
            let [_, _, _] = numbers(reader, "of the scanner's place or axes")?;
        }
        let mut lines = [[0.0; 4]; 4];
        for line in &mut lines {
            *line = numbers(reader, "of the matrix")?;
        }
        // The file has row vectors: its lines are where the axes and zero go, which are a matrix's columns.
        let matrix = DMat4::from_cols_array_2d(&lines);
        let turned = matrix.transpose();
        let is_proper = |m: &DMat4| [m.x_axis.w, m.y_axis.w, m.z_axis.w] == [0.0; 3];
        let transposed = !is_proper(&matrix) && is_proper(&turned);
        let matrix = if transposed { turned } else { matrix };
        Ok(Self { columns, rows, matrix, transposed })
    }

    /// The grid of the scan's places, whose rows are the columns of the file; `None` where it has one row or column.
    pub(super) fn grid(&self) -> Option<[u32; 2]> {
        let [width, height] =
            [self.rows, self.columns].map(|n| u32::try_from(n).ok().filter(|n| *n > 1));
        Some([width?, height?])
    }

    /// The pose that the matrix is; `None` where it is no rotation.
    pub(super) fn pose(&self) -> Option<Pose> {
        let axes = DMat3::from_mat4(self.matrix);
        let errors = axes * axes.transpose() - DMat3::IDENTITY;
        let largest = errors.to_cols_array().iter().fold(0.0, |max: f64, e| max.max(e.abs()));
        let is_rotation = largest < TOLERANCE && axes.determinant() > 0.0;
        let rotation = DQuat::from_mat3(&axes).normalize();
        let DVec4 { x, y, z, .. } = self.matrix.w_axis;
        let translation = DVec3::new(x, y, z);
        let is_finite = translation.is_finite() && rotation.is_finite();
        (is_rotation && is_finite).then_some(Pose { rotation, translation })
    }
}

fn expected(what: &str, line: Option<&Line>) -> Error {
    Error::new(match line {
        Some(line) => {
            let (number, text) = (line.number, quoted(&line.text));
            format!("line {number}: expected {what}, found {text}")
        }
        None => format!("expected {what}, found the end of the file"),
    })
}

fn lone_count(reader: &mut LineReader<'_>, what: &str) -> Result<u64> {
    let line = reader.next()?;
    let found = line.as_ref().and_then(|line| count(&line.text));
    found.ok_or_else(|| expected(&format!("the number of {what} of a scan"), line.as_ref()))
}

fn numbers<const N: usize>(reader: &mut LineReader<'_>, what: &str) -> Result<[f64; N]> {
    let line = reader.next()?;
    let read = |line: &Line| {
        let words = line.text.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        let numbers: Vec<f64> = words.map(|word| number(word, b'.')).collect::<Option<_>>()?;
        <[f64; N]>::try_from(numbers).ok().filter(|all| all.iter().all(|n| n.is_finite()))
    };
    let found = line.as_ref().and_then(read);
    found.ok_or_else(|| expected(&format!("{N} numbers {what}"), line.as_ref()))
}
