//! The first points of a cloud that is written, held back until it is clear how positions are stored.

use crate::element::Buffer;
use surfelshop_api::columns::{CloudView, POSITION, Values};
use surfelshop_api::glam::DVec3;
use surfelshop_api::{Error, Result};

/// Points that are held back at most, some 50 MB.
const MOST: usize = 1 << 20;
/// Most bits of a number of steps; more are no longer exact in `f64`.
const MOST_BITS: u32 = 53;

/// Values of points.
pub(crate) struct Points<'a> {
    pub(crate) len: usize,
    pub(crate) columns: Vec<Values<'a>>,
    position: usize,
    origin: DVec3,
    metres: f64,
}

impl<'a> Points<'a> {
    /// Those of a batch, whose columns are to have these numbers of components, in units of so many metres.
    ///
    /// # Errors
    /// Where the columns are others.
    pub(crate) fn new(batch: &CloudView<'a>, components: &[u32], metres: f64) -> Result<Self> {
        let (len, found) = (batch.len, batch.columns.len());
        let fits = |(column, &n): (&surfelshop_api::ColumnView<'_>, &u32)| {
            column.values.len() == n as usize * len
        };
        if found != components.len() || !batch.columns.iter().zip(components).all(fits) {
            return Err(Error::new(format!(
                "expected a batch of {} columns of {len} points, found others",
                components.len()
            )));
        }
        let position = batch.columns.iter().position(|column| column.name == POSITION);
        let position = position
            .filter(|&i| components[i] == 3)
            .ok_or_else(|| Error::new("expected positions of three numbers, found none"))?;
        let columns = batch.columns.iter().map(|column| column.values).collect();
        Ok(Self { len, columns, position, origin: batch.origin, metres })
    }

    /// The position of a point, metres.
    pub(crate) fn place(&self, i: usize) -> DVec3 {
        let own = match self.columns[self.position] {
            Values::F64(values) => DVec3::from_slice(&values[3 * i..]),
            Values::F32(values) => {
                let [x, y, z] = [values[3 * i], values[3 * i + 1], values[3 * i + 2]];
                DVec3::new(x.into(), y.into(), z.into())
            }
            _ => DVec3::NAN,
        };
        (own + self.origin) * self.metres
    }
}

/// How a coordinate is stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Storage {
    /// As `f64`.
    Double,
    /// As `f32`, which all coordinates are.
    Single,
    /// As a whole number of steps from an offset.
    Steps { step: f64, offset: f64, min: i64, max: i64 },
}

impl Storage {
    /// The number of steps that is nearest to a coordinate, and how far it is away in steps.
    pub(crate) fn steps(step: f64, offset: f64, value: f64) -> (f64, f64) {
        let steps = (value - offset) / step;
        (steps.round(), (steps - steps.round()).abs())
    }
}

/// A batch of the host's, copied.
struct Copied {
    len: usize,
    columns: Vec<Buffer>,
    position: usize,
    origin: DVec3,
    metres: f64,
}

/// Points that are held back.
pub(crate) struct Held {
    batches: Vec<Copied>,
    n_points: usize,
    all_f32: bool,
    /// Smallest and largest coordinates.
    box_of: Option<[DVec3; 2]>,
    first: Option<DVec3>,
    step: Option<DVec3>,
}

impl Held {
    /// None yet; coordinates are whole numbers of these steps.
    pub(crate) fn new(step: Option<DVec3>) -> Self {
        let step = step.filter(|step| step.is_finite() && step.cmpgt(DVec3::ZERO).all());
        let (batches, n_points, box_of, first) = Default::default();
        Self { batches, n_points, all_f32: true, box_of, first, step }
    }

    /// Takes points; whether more are needed.
    pub(crate) fn add(&mut self, points: &Points<'_>) -> bool {
        for place in (0..points.len).map(|i| points.place(i)).filter(|place| place.is_finite()) {
            self.all_f32 &= place.as_vec3().as_dvec3() == place;
            let [low, high] = self.box_of.unwrap_or([place, place]);
            self.box_of = Some([low.min(place), high.max(place)]);
            self.first.get_or_insert(place);
        }
        self.n_points += points.len;
        let columns = points.columns.iter().map(Buffer::of).collect();
        let Points { len, position, origin, metres, .. } = *points;
        self.batches.push(Copied { len, columns, position, origin, metres });
        let open = self.all_f32 || self.step.is_some();
        open && self.n_points < MOST
    }

    /// The points, batch by batch.
    pub(crate) fn points(&self) -> impl Iterator<Item = Points<'_>> {
        self.batches.iter().map(|batch| Points {
            len: batch.len,
            columns: batch.columns.iter().map(Buffer::values).collect(),
            position: batch.position,
            origin: batch.origin,
            metres: batch.metres,
        })
    }

    /// How coordinates are stored; `complete` says that these are all points of the cloud.
    pub(crate) fn storage(&self, complete: bool) -> [Storage; 3] {
        if let Some(step) = self.step {
            let axis = |i: usize| self.axis(i, step[i], complete);
            if let [Some(x), Some(y), Some(z)] = [axis(0), axis(1), axis(2)] {
                return [x, y, z];
            }
        }
        if complete && self.all_f32 { [Storage::Single; 3] } else { [Storage::Double; 3] }
    }

    /// Steps of an axis: numbers of whole bytes, which the crate `e57` writes fastest.
    fn axis(&self, axis: usize, step: f64, complete: bool) -> Option<Storage> {
        let (first, [low, high]) = (self.first?[axis], self.box_of?);
        // Multiples of the step where they are, else as many steps from the first coordinate.
        let (steps, away) = Storage::steps(step, 0.0, first);
        let offset = if away < 1e-3 { 0.0 } else { first - steps * step };
        let [low, high] = [low[axis], high[axis]].map(|end| Storage::steps(step, offset, end).0);
        let exact = (1u64 << MOST_BITS) as f64;
        if !(low.abs() < exact && high.abs() < exact) {
            return None;
        }
        // Both ends are whole numbers of fewer than 53 bits.
        let (low, high) = (low as i64, high as i64);
        let bits = if complete {
            (64 - (high - low).leading_zeros()).max(1).next_multiple_of(8)
        } else {
            40
        };
        let min = if complete { low } else { (low + high) / 2 - (1 << 39) };
        Some(Storage::Steps { step, offset, min, max: min + ((1i64 << bits) - 1) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_api::ColumnView;

    fn storage(places: &[f64], step: Option<f64>, complete: bool) -> [Storage; 3] {
        let values = Values::F64(places);
        let column = ColumnView { name: POSITION, components: 3, generation: 1, values };
        let len = places.len() / 3;
        let batch = CloudView { len, columns: vec![column], ..CloudView::default() };
        let mut held = Held::new(step.map(DVec3::splat));
        held.add(&Points::new(&batch, &[3], 1.0).unwrap());
        held.storage(complete)
    }

    #[test]
    fn positions_are_single_only_where_all_of_them_are() {
        assert_eq!(storage(&[0.5, 1.0, 2.0], None, true), [Storage::Single; 3]);
        assert_eq!(storage(&[0.5, 1.0, 2.0], None, false), [Storage::Double; 3]);
        assert_eq!(storage(&[0.5, 1.0, 0.1], None, true), [Storage::Double; 3]);
        assert_eq!(storage(&[], None, true), [Storage::Single; 3]);
        assert_eq!(storage(&[], Some(0.1), true), [Storage::Single; 3]);
    }

    #[test]
    fn steps_have_whole_bytes_and_begin_where_coordinates_do() {
        let places = [0.001, 5e6, -3.0, 0.301, 5e6 + 0.001, 3.0];
        let [x, y, z] = storage(&places, Some(0.001), true);
        assert_eq!(x, Storage::Steps { step: 0.001, offset: 0.0, min: 1, max: 1 + 0xffff });
        assert_eq!(
            y,
            Storage::Steps { step: 0.001, offset: 0.0, min: 5_000_000_000, max: 5_000_000_255 }
        );
        assert_eq!(z, Storage::Steps { step: 0.001, offset: 0.0, min: -3000, max: -3000 + 0xffff });
        let [x, ..] = storage(&places, Some(0.001), false);
        let Storage::Steps { min, max, .. } = x else { panic!("{x:?}") };
        assert_eq!((max - min, (max + min).abs() < 1000), ((1 << 40) - 1, true));
        let [x, ..] = storage(&[0.25, 0.0, 0.0, 1.25, 0.0, 0.0], Some(1.0), true);
        assert_eq!(x, Storage::Steps { step: 1.0, offset: 0.25, min: 0, max: 255 });
        // Steps that are too small to be counted.
        assert_eq!(storage(&[1.0, 0.1, 0.0], Some(1e-300), true), [Storage::Double; 3]);
    }
}
