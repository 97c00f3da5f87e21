//! Looking ahead: the first points of a cloud, copied until it is clear which version of LAS holds all of them.

use super::plan::Narrow;
use surfelshop_api::columns::{CloudView, ColumnView, Values};
use surfelshop_api::format::CloudSource;
use surfelshop_api::glam::DVec3;
use surfelshop_api::{Job, Result};

/// Most bytes of values that are held: a cloud that is larger is written as what holds anything.
const MOST: usize = 1 << 27;

/// Values of a column, copied.
enum Held {
    I8(Vec<i8>),
    U8(Vec<u8>),
    I16(Vec<i16>),
    U16(Vec<u16>),
    I32(Vec<i32>),
    U32(Vec<u32>),
    F32(Vec<f32>),
    F64(Vec<f64>),
}

macro_rules! each_variant {
    ($value:expr, $from:ident => $to:ident, $inner:ident => $body:expr) => {
        match $value {
            $from::I8($inner) => $to::I8($body),
            $from::U8($inner) => $to::U8($body),
            $from::I16($inner) => $to::I16($body),
            $from::U16($inner) => $to::U16($body),
            $from::I32($inner) => $to::I32($body),
            $from::U32($inner) => $to::U32($body),
            $from::F32($inner) => $to::F32($body),
            $from::F64($inner) => $to::F64($body),
        }
    };
}

impl Held {
    /// # Errors
    /// Where memory runs out.
    fn of(values: &Values<'_>) -> Result<Self> {
        Ok(each_variant!(values, Values => Held, slice => copied(slice)?))
    }

    fn values(&self) -> Values<'_> {
        each_variant!(self, Held => Values, vec => vec)
    }
}

fn copied<T: Copy>(slice: &[T]) -> Result<Vec<T>> {
    let mut copy = Vec::new();
    copy.try_reserve_exact(slice.len())?;
    copy.extend_from_slice(slice);
    Ok(copy)
}

/// A column of a batch, copied.
struct HeldColumn {
    name: String,
    components: u32,
    values: Held,
}

impl HeldColumn {
    fn view(&self) -> ColumnView<'_> {
        let (name, values) = (self.name.as_str(), self.values.values());
        ColumnView { name, components: self.components, generation: 0, values }
    }
}

/// A batch, copied.
struct HeldBatch {
    len: usize,
    origin: DVec3,
    columns: Vec<HeldColumn>,
}

impl HeldBatch {
    fn of(batch: &CloudView<'_>) -> Result<Self> {
        let column = |column: &ColumnView<'_>| {
            let (name, components) = (column.name.to_owned(), column.components);
            Ok(HeldColumn { name, components, values: Held::of(&column.values)? })
        };
        let columns = batch.columns.iter().map(column).collect::<Result<_>>()?;
        Ok(Self { len: batch.len, origin: batch.origin, columns })
    }

    fn view(&self) -> CloudView<'_> {
        let columns = self.columns.iter().map(HeldColumn::view).collect();
        CloudView { len: self.len, origin: self.origin, columns, ..CloudView::default() }
    }
}

/// What is known when no more is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outcome {
    /// All points were seen, and LAS 1.2 holds them.
    Fits,
    /// One of them needs LAS 1.4.
    Exceeds,
    /// There are more points than are held.
    Unknown,
}

/// The first batches of a cloud.
#[derive(Default)]
pub(super) struct Ahead {
    batches: std::collections::VecDeque<HeldBatch>,
    n_bytes: usize,
}

impl Ahead {
    /// Takes batches until one does not fit into the fields of LAS 1.2, all are there, or they are too many.
    ///
    /// # Errors
    /// Where the clouds fail, memory runs out, or the user asked to stop.
    pub(super) fn look(
        &mut self,
        clouds: &mut CloudSource<'_>,
        narrow: &[Narrow],
        job: &Job<'_>,
    ) -> Result<Outcome> {
        self.look_at_most(clouds, narrow, job, MOST)
    }

    fn look_at_most(
        &mut self,
        clouds: &mut CloudSource<'_>,
        narrow: &[Narrow],
        job: &Job<'_>,
        most: usize,
    ) -> Result<Outcome> {
        while let Some(batch) = clouds.next_batch()? {
            job.check()?;
            self.batches.push_back(HeldBatch::of(&batch)?);
            for column in &batch.columns {
                self.n_bytes += column.values.len() * column.values.element().size();
            }
            if !narrow.iter().all(|field| field.holds(&batch)) {
                return Ok(Outcome::Exceeds);
            }
            if self.n_bytes > most {
                return Ok(Outcome::Unknown);
            }
        }
        Ok(Outcome::Fits)
    }

    /// Whether nothing is held.
    pub(super) fn is_empty(&self) -> bool {
        self.batches.is_empty()
    }

    /// Takes a batch, where there is one.
    ///
    /// # Errors
    /// As [`look`](Self::look).
    pub(super) fn take_one(&mut self, clouds: &mut CloudSource<'_>) -> Result<()> {
        if let Some(batch) = clouds.next_batch()? {
            self.batches.push_back(HeldBatch::of(&batch)?);
        }
        Ok(())
    }

    /// The first batch that is held.
    pub(super) fn first(&self) -> Option<CloudView<'_>> {
        self.batches.front().map(HeldBatch::view)
    }

    /// Hands every batch of the cloud to `take`: those that are held, whose memory is given back one by one, then the
    /// others.
    ///
    /// # Errors
    /// Where the clouds or `take` fail.
    pub(super) fn each(
        mut self,
        clouds: &mut CloudSource<'_>,
        mut take: impl FnMut(&CloudView<'_>) -> Result<()>,
    ) -> Result<()> {
        while let Some(batch) = self.batches.pop_front() {
            take(&batch.view())?;
        }
        while let Some(batch) = clouds.next_batch()? {
            take(&batch)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::{Alone, Cloud, Owned};
    use crate::write::plan::narrow;
    use surfelshop_api::format::CloudSourceHost as _;

    /// Invariant: what is held is what was there, and no more is held than is allowed
    /// Cost: milliseconds
    #[test]
    fn batches_are_held_until_it_is_clear_what_they_need() {
        let n = 40;
        let classes =
            |most: u8| Owned::U8((0..n).map(|i| if i == 30 { most } else { 2 }).collect());
        for (most, bytes, expected, n_held) in [
            (31, MOST, Outcome::Fits, 6),
            (32, MOST, Outcome::Exceeds, 5),
            (31, 200, Outcome::Unknown, 2),
        ] {
            let places = (0..3 * n).map(f64::from).collect();
            let mut cloud = Cloud::at(places).with("classification", 1, classes(most));
            let header = cloud.next_cloud().unwrap().unwrap();
            let mut source = CloudSource::new(&mut cloud);
            let (mut ahead, job) = (Ahead::default(), Job::new(&Alone));
            let narrow = narrow(&header).unwrap();
            let found = ahead.look_at_most(&mut source, &narrow, &job, bytes).unwrap();
            assert_eq!((found, ahead.batches.len()), (expected, n_held));
            let mut seen = Vec::new();
            let take = |batch: &CloudView<'_>| {
                seen.extend(batch.column("position").unwrap().values.iter_f64());
                Ok(())
            };
            ahead.each(&mut source, take).unwrap();
            assert_eq!(seen, (0..3 * n).map(f64::from).collect::<Vec<_>>());
        }
    }
}
