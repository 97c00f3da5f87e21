//! Where the device of a moving scanner was, from the pulses that came back several times.
//!
//! The first and the last return of a pulse lie on its ray, and the rays of a short time meet where the device
//! was, which moved along a line meanwhile. So a file of single points tells where an aeroplane flew, which LAS
//! has no place for.
//!
//! Source: Gatziolis & `McGaughey` 2019, "Reconstructing aircraft trajectories from multi-return airborne
//! laser-scanning data"; here with a robust fit of a line per second instead of a window per crossing.

mod fit;
mod pulses;

use super::position::Positions;
use crate::summary::Trajectory as Facts;
use crate::table::Table;
use fit::{fitted, median};
use glam::DVec3;
use pulses::{Device, devices, pulses};
use surfelshop_api::format::GPS_TIME;

/// Pulses of a piece, where its time has so many; with 32 the place is still known, less well.
const ENOUGH: usize = 200;
/// Shortest time of a piece, seconds: the rays of a sweep to and fro of the mirror, which takes a tenth.
const SHORTEST: f64 = 1.0;
/// Longest time of a piece, seconds, over which an aeroplane flies straight to a few centimetres.
const LONGEST: f64 = 4.0;
/// Points this long before or after a piece still have its device, seconds.
const BEYOND: f64 = 1.0;

/// A straight piece of the path of a device.
#[derive(Clone, Copy, Debug)]
struct Piece {
    device: Device,
    /// First and last time, seconds.
    times: [f64; 2],
    /// Time of `place`, seconds.
    middle: f64,
    /// Relative to the cloud's origin, units of the file.
    place: DVec3,
    /// Units of the file per second.
    velocity: DVec3,
}

/// The path of the devices that took a cloud.
pub(super) struct Trajectory {
    /// Those of a device together, in the order of time.
    pieces: Vec<Piece>,
    pub(super) facts: Facts,
}

impl Trajectory {
    /// The path that a cloud's returns tell; `None` where they tell none: no times, no second returns, or rays
    /// that do not meet.
    pub(super) fn of(table: &Table, placed: &Positions) -> Option<Self> {
        let pulses = pulses(table, &placed.positions)?;
        let mut pieces = Vec::new();
        let (mut n_pulses, mut worst) = (0, 0.0f64);
        let mut distances = Vec::new();
        for of_piece in parted(&pulses) {
            let Some(found) = fitted(of_piece) else { continue };
            n_pulses += of_piece.len() as u64;
            worst = worst.max(found.miss / found.distance);
            distances.push(found.distance);
            pieces.push(Piece {
                device: of_piece[0].device,
                times: [of_piece[0].time, of_piece[of_piece.len() - 1].time],
                middle: found.middle,
                place: found.place,
                velocity: found.velocity,
            });
        }
        let distance = median(distances)?;
        let facts = Facts { n_pulses, n_pieces: pieces.len() as u64, distance, miss: worst };
        Some(Self { pieces, facts })
    }

    /// For each point of the table where its device was, relative to the cloud's origin.
    pub(super) fn places(&self, table: &Table) -> impl Iterator<Item = Option<DVec3>> {
        let times = table.woven(&[GPS_TIME]).map(|times| times.iter_f64());
        devices(table).zip(times.into_iter().flatten()).map(|(device, time)| self.at(device, time))
    }

    fn at(&self, device: Device, time: f64) -> Option<DVec3> {
        let first =
            self.pieces.partition_point(|piece| (piece.device, piece.times[1]) < (device, time));
        let away = |piece: &Piece| (piece.times[0] - time).max(time - piece.times[1]).max(0.0);
        let around = &self.pieces[first.saturating_sub(1)..self.pieces.len().min(first + 1)];
        let nearest = around
            .iter()
            .filter(|piece| time.is_finite() && piece.device == device && away(piece) <= BEYOND)
            .min_by(|a, b| away(a).total_cmp(&away(b)))?;
        Some(nearest.place + nearest.velocity * (time - nearest.middle))
    }
}

/// The pulses of each piece: those of a device one after the other.
fn parted(pulses: &[pulses::Pulse]) -> Vec<&[pulses::Pulse]> {
    let mut parts: Vec<std::ops::Range<usize>> = Vec::new();
    let mut first = 0;
    for end in 1..=pulses.len() {
        let of_piece = &pulses[first..end];
        let begin = of_piece[0].time;
        let last = of_piece[of_piece.len() - 1].time;
        let next = pulses
            .get(end)
            .filter(|next| next.device == of_piece[0].device && next.time - last <= BEYOND);
        let is_full = |next: &pulses::Pulse| {
            let lasts = next.time - begin;
            lasts > LONGEST || (lasts > SHORTEST && of_piece.len() >= ENOUGH)
        };
        if next.is_some_and(|next| !is_full(next)) {
            continue;
        }
        // What is left at the end of a path is too little for a piece of its own.
        let follows = parts.last().is_some_and(|part| {
            let before = &pulses[part.end - 1];
            part.end == first
                && before.device == of_piece[0].device
                && begin - before.time <= BEYOND
        });
        match parts.last_mut().filter(|_| follows && next.is_none() && of_piece.len() < ENOUGH) {
            Some(part) => part.end = end,
            None => parts.push(first..end),
        }
        first = end;
    }
    parts.into_iter().map(|part| &pulses[part]).collect()
}

#[cfg(test)]
mod tests;
