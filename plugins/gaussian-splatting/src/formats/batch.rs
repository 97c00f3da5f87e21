//! Gaussians on their way out of a file, in the columns that somebody wants.

use super::{Gaussian, rest_of, sign};
use surfelshop_api::columns::{
    Element, OPACITY, POSITION, SH, SPLAT_ROTATION, SPLAT_SCALE, Values,
};
use surfelshop_api::format::{BATCH, CloudSink, FileColumn};
use surfelshop_api::prelude::{Job, Result};

/// A column of Gaussians.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Column {
    Position,
    Opacity,
    Scale,
    Rotation,
    /// Spherical harmonics of this order.
    Sh(usize),
}

impl Column {
    const fn name(self) -> &'static str {
        match self {
            Self::Position => POSITION,
            Self::Opacity => OPACITY,
            Self::Scale => SPLAT_SCALE,
            Self::Rotation => SPLAT_ROTATION,
            Self::Sh(order) => SH[order],
        }
    }

    const fn components(self) -> u32 {
        match self {
            Self::Opacity => 1,
            Self::Position | Self::Scale => 3,
            Self::Rotation => 4,
            Self::Sh(order) => 3 * (2 * order as u32 + 1),
        }
    }
}

/// Columns that are filled and handed over.
pub(super) struct Batch {
    columns: Vec<(Column, Vec<f32>)>,
    /// Gaussians with numbers that are none.
    n_repaired: u64,
}

impl Batch {
    /// The columns that are wanted, with spherical harmonics of at most this degree. Positions always are.
    pub(super) fn new(clouds: &CloudSink<'_>, degree: usize) -> Self {
        let all = [Column::Position, Column::Opacity, Column::Scale, Column::Rotation];
        let all = all.into_iter().chain((0..SH.len().min(degree + 1)).map(Column::Sh));
        let wanted =
            all.filter(|column| *column == Column::Position || clouds.wants(column.name()));
        Self { columns: wanted.map(|column| (column, Vec::new())).collect(), n_repaired: 0 }
    }

    /// The columns of the cloud's header.
    pub(super) fn header(&self) -> Vec<FileColumn> {
        let columns = self.columns.iter().map(|(column, _)| *column);
        columns
            .map(|column| FileColumn::new(column.name(), column.components(), Element::F32))
            .collect()
    }

    /// Whether a column is wanted.
    pub(super) fn has(&self, wanted: Column) -> bool {
        self.columns.iter().any(|(column, _)| *column == wanted)
    }

    /// Whether spherical harmonics beyond the constant one are wanted.
    pub(super) fn has_rest(&self) -> bool {
        self.columns.iter().any(|(column, _)| matches!(column, Column::Sh(1..)))
    }

    /// Adds a Gaussian. The host drops those whose places are no numbers; other numbers become 0.
    pub(super) fn push(&mut self, gaussian: &Gaussian) {
        let Gaussian { position, opacity, scale, rotation, color, rest } = gaussian;
        let mut repaired = false;
        let mut number = |value: &f32| {
            repaired |= !value.is_finite();
            if value.is_finite() { *value } else { 0.0 }
        };
        for (column, values) in &mut self.columns {
            match *column {
                Column::Position => values.extend(position),
                Column::Opacity => values.push(*opacity),
                Column::Scale => values.extend(scale.iter().map(&mut number)),
                Column::Rotation => values.extend(rotation),
                Column::Sh(0) => values.extend(color.iter().map(&mut number)),
                Column::Sh(order) => {
                    let of_order = rest_of(order - 1)..rest_of(order);
                    for (i, color) in
                        rest.iter().enumerate().take(of_order.end).skip(of_order.start)
                    {
                        values.extend(color.map(|value| sign(i) * value));
                    }
                }
            }
        }
        self.n_repaired += u64::from(repaired);
    }

    /// Hands over the Gaussians that were added.
    pub(super) fn hand_over(&mut self, clouds: &mut CloudSink<'_>) -> Result<()> {
        let values: Vec<Values<'_>> =
            self.columns.iter().map(|(_, values)| Values::F32(values)).collect();
        clouds.batch(&values)?;
        for (_, values) in &mut self.columns {
            values.clear();
        }
        Ok(())
    }

    /// Says what was doubtful.
    pub(super) fn finish(&self, clouds: &mut CloudSink<'_>) {
        if self.n_repaired > 0 {
            clouds.warn(&format!(
                "{} Gaussians have sizes or colours that are no numbers: they are 0",
                self.n_repaired
            ));
        }
    }
}

/// Calls `read` for the first and the number of the Gaussians of each batch, in order, and tells progress within
/// `share`.
pub(super) fn in_batches(
    n: u64,
    share: std::ops::Range<f64>,
    job: &Job<'_>,
    mut read: impl FnMut(u64, usize) -> Result<()>,
) -> Result<()> {
    for first in (0..n).step_by(BATCH) {
        job.check()?;
        read(first, (n - first).min(BATCH as u64) as usize)?;
        let done = (first + BATCH as u64).min(n) as f64 / n as f64;
        job.progress(share.start + done * (share.end - share.start), "");
    }
    Ok(())
}

/// Makes a buffer this long, for bytes that are known to be in the file.
pub(super) fn resize(buffer: &mut Vec<u8>, len: usize) -> Result<()> {
    buffer.clear();
    buffer.try_reserve(len)?;
    buffer.resize(len, 0);
    Ok(())
}
