//! Pulses that came back several times: their rays.

use crate::table::Table;
use glam::{DVec3, Vec3};
use surfelshop_api::format::{GPS_TIME, N_RETURNS, POINT_SOURCE, RETURN_NUMBER};

/// Channel of a scanner with several, as LAS 1.4 has it.
const CHANNEL: &str = "scanner_channel";

/// Returns that are looked at, about: those of a pulse together, pulses evenly over all times. 32 bytes each.
pub(super) const MOST: usize = 1 << 20;

/// What sent a pulse: the number of its flight line or device, and its channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Device([u32; 2]);

/// A pulse with several returns.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pulse {
    pub(super) device: Device,
    /// Seconds.
    pub(super) time: f64,
    /// Its first return, relative to the cloud's origin.
    pub(super) first: DVec3,
    /// From its last return to the first, in units of the file; not 0.
    pub(super) back: DVec3,
}

/// One return of such a pulse.
struct Return {
    device: Device,
    time: f64,
    number: f32,
    row: u32,
}

/// What sent each point's pulse.
pub(super) fn devices(table: &Table) -> impl Iterator<Item = Device> {
    let numbers = |name: &str| {
        let column = table.woven(&[name]).map(|numbers| numbers.iter_f64());
        // What is no number is of device 0.
        let all = column.into_iter().flatten().map(|number| number as u32);
        all.chain(std::iter::repeat(0))
    };
    let sources = numbers(POINT_SOURCE).zip(numbers(CHANNEL)).take(table.n_rows);
    sources.map(|(source, channel)| Device([source, channel]))
}

/// Pulses with several returns, those of a device together, in the order of time; `None` where the table has no
/// times or does not tell returns apart, or has no such pulse.
pub(super) fn pulses(table: &Table, positions: &[Vec3]) -> Option<Vec<Pulse>> {
    let column = |name: &str| Some(table.woven(&[name])?.iter_f64());
    let (times, numbers) = (column(GPS_TIME)?, column(RETURN_NUMBER)?);
    // Where the returns of a pulse are not counted, every point may be one of several.
    let counts = || column(N_RETURNS).into_iter().flatten().chain(std::iter::repeat(2.0));
    let n = counts().take(table.n_rows).filter(|count| *count >= 2.0).count();
    // One in so many, the same for all returns of a pulse.
    let every = n.div_ceil(MOST).max(1) as u64;
    let mut returns: Vec<Return> = Vec::new();
    // By chance a few more are chosen than their share.
    let share = n / every as usize;
    returns.try_reserve(share + share / 16 + 1000).ok()?;
    let all = devices(table).zip(times).zip(numbers).zip(counts()).enumerate();
    for (row, (((device, time), number), count)) in all {
        let is_one = time.is_finite() && number.is_finite() && count >= 2.0;
        if is_one && is_chosen(time, every) {
            // Where very many have one time, times tell no pulses.
            if returns.len() == returns.capacity() {
                return None;
            }
            let (number, row) = (number as f32, u32::try_from(row).ok()?);
            returns.push(Return { device, time, number, row });
        }
    }
    returns.sort_unstable_by(|a, b| {
        let of_pulse = a.device.cmp(&b.device).then(a.time.total_cmp(&b.time));
        of_pulse.then(a.number.total_cmp(&b.number)).then(a.row.cmp(&b.row))
    });
    let place = |one: &Return| positions[one.row as usize].as_dvec3();
    let of_pulse = returns.chunk_by(|a, b| a.device == b.device && a.time == b.time);
    let pulses: Vec<Pulse> = of_pulse
        .filter(|all| all[0].number < all[all.len() - 1].number)
        .map(|all| (&all[0], place(&all[0]), place(&all[all.len() - 1])))
        .map(|(one, first, last)| Pulse {
            device: one.device,
            time: one.time,
            first,
            back: first - last,
        })
        .filter(|pulse| pulse.back.length_squared() > 0.0)
        .collect();
    (!pulses.is_empty()).then_some(pulses)
}

/// Whether a pulse is one of those looked at, one in `every`; neighbours in time are chosen independently.
fn is_chosen(time: f64, every: u64) -> bool {
    // Multiplicative hashing by the golden ratio; the upper half of the product is well mixed.
    (time.to_bits().wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32).is_multiple_of(every)
}
