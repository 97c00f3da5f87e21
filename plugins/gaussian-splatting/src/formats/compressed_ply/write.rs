//! Writing: neighbours in space share their bounds, so all Gaussians are kept in memory until they are in order.

use super::super::outgoing::{FormatRange, byte};
use super::super::{ANTIALIASED, Gaussian, SH_0, rest_of};
use super::header::{BOUNDS, COLOR_BOUNDS, PACKED};
use super::points::{CHUNK, Chunk, Prepared, harmonic_byte};
use std::io::{BufWriter, Write};
use surfelshop_api::format::{CloudSource, FileSink, UpAxis};
use surfelshop_api::prelude::{Error, Job, Result};

/// The share of the progress that taking points has.
const SHARE: f64 = 0.5;

/// Chunks that are written between two looks at whether somebody stops it.
const AT_ONCE: usize = 64;

/// Logarithms of sizes reach as far as this both ways, as in the files of others: one of 0 would leave its chunk no
/// steps.
const MOST_LOG: f32 = 20.0;

const RANGE: FormatRange =
    FormatRange { name: "compressed PLY", degree: 3, up: UpAxis::Unknown, antialiased: true };

/// All Gaussians.
#[derive(Default)]
struct Store {
    gaussians: Vec<Prepared>,
    /// Red, green and blue of each coefficient.
    harmonics: Vec<[u8; 3]>,
    n_rest: usize,
    n_cut: u64,
}

fn finite(value: f32) -> f32 {
    if value.is_finite() { value } else { 0.0 }
}

/// Writes the one cloud. Returns lines of what the file does not hold.
pub(super) fn write(
    clouds: &mut CloudSource<'_>,
    file: &FileSink,
    job: &Job<'_>,
) -> Result<Vec<String>> {
    let header = clouds.next_cloud()?;
    let header = header.ok_or_else(|| Error::new("expected a cloud to write, found none"))?;
    let n_rest = rest_of(RANGE.degree_of(&header));
    let mut store = Store { n_rest, ..Store::default() };
    let n_placeless =
        RANGE.each(&header, clouds, SHARE, job, |gaussian, place| store.take(gaussian, place))?;
    let mut notes = RANGE.notes(&header, n_placeless);
    if store.n_cut > 0 {
        notes.push(format!(
            "{} Gaussians have sizes or colours beyond what compressed PLY holds: they were cut off",
            store.n_cut
        ));
    }
    let antialiased = header.comments.iter().any(|comment| comment == ANTIALIASED);
    store.pack(antialiased, file, job)?;
    Ok(notes)
}

impl Store {
    fn take(&mut self, gaussian: &Gaussian, position: [f64; 3]) -> Result<()> {
        let logs = gaussian.scale.map(f32::ln);
        let scale = logs.map(|log| log.clamp(-MOST_LOG, MOST_LOG));
        let mut holds = scale == logs;
        self.gaussians.try_reserve(1)?;
        self.gaussians.push(Prepared {
            position,
            scale,
            color: gaussian.color.map(|value| 0.5 + SH_0 * finite(value)),
            opacity: byte(255.0 * gaussian.opacity),
            rotation: gaussian.rotation,
        });
        self.harmonics.try_reserve(self.n_rest)?;
        for value in &gaussian.rest[..self.n_rest] {
            let bytes = value.map(harmonic_byte);
            holds &= bytes.iter().all(|(_, holds)| *holds);
            self.harmonics.push(bytes.map(|(byte, _)| byte));
        }
        self.n_cut += u64::from(!holds);
        Ok(())
    }

    /// Numbers of the Gaussians along a Z-curve through their bounds; of equal places in the order of the cloud.
    fn order(&self) -> Result<Vec<u32>> {
        let n = self.gaussians.len();
        let last = u32::try_from(n).ok().ok_or_else(|| {
            Error::new(format!(
                "expected fewer than 2^32 Gaussians, found {n}: write them in parts"
            ))
        })?;
        let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for gaussian in &self.gaussians {
            for (axis, number) in gaussian.position.into_iter().enumerate() {
                bounds[0][axis] = bounds[0][axis].min(number);
                bounds[1][axis] = bounds[1][axis].max(number);
            }
        }
        let [low, high] = bounds;
        // Cubes, so that chunks are as wide as they are high.
        let extent = (0..3).map(|axis| high[axis] - low[axis]).fold(0.0, f64::max);
        let cells = f64::from((1u32 << 21) - 1) / extent;
        let place_of = |gaussian: &Prepared| {
            (0..3).fold(0, |key, axis| {
                // All at one place have the share NaN, which becomes 0.
                let cell = ((gaussian.position[axis] - low[axis]) * cells) as u64;
                key | spread(cell) << axis
            })
        };
        let mut places: Vec<(u64, u32)> = Vec::new();
        places.try_reserve_exact(n)?;
        places.extend(self.gaussians.iter().map(place_of).zip(0..last));
        places.sort_unstable();
        let mut order = Vec::new();
        order.try_reserve_exact(n)?;
        order.extend(places.iter().map(|(_, number)| *number));
        Ok(order)
    }

    fn pack(&self, antialiased: bool, file: &FileSink, job: &Job<'_>) -> Result<()> {
        let order = self.order()?;
        let of = |number: &u32| &self.gaussians[*number as usize];
        let mut out = BufWriter::with_capacity(1 << 18, file.stream());
        out.write_all(head(order.len(), self.n_rest, antialiased).as_bytes())?;
        let mut chunks: Vec<Chunk> = Vec::new();
        chunks.try_reserve_exact(order.len().div_ceil(CHUNK))?;
        chunks.extend(order.chunks(CHUNK).map(|numbers| Chunk::around(numbers.iter().map(of))));
        for chunk in &chunks {
            out.write_all(&chunk.bytes())?;
        }
        for (many, chunks) in order.chunks(CHUNK * AT_ONCE).zip(chunks.chunks(AT_ONCE)) {
            job.check()?;
            for (numbers, chunk) in many.chunks(CHUNK).zip(chunks) {
                for number in numbers {
                    out.write_all(&chunk.packed(of(number)))?;
                }
            }
        }
        job.progress(0.5 + 0.5 * SHARE, "");
        for many in order.chunks(CHUNK * AT_ONCE) {
            job.check()?;
            for number in many {
                let first = *number as usize * self.n_rest;
                let harmonics = &self.harmonics[first..first + self.n_rest];
                for channel in 0..3 {
                    for value in harmonics {
                        out.write_all(&[value[channel]])?;
                    }
                }
            }
        }
        out.flush()?;
        job.progress(1.0, "");
        Ok(())
    }
}

/// The lowest 21 bits, with two zeros between each.
fn spread(number: u64) -> u64 {
    let steps = [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ];
    let lowest = number & 0x001f_ffff;
    steps.into_iter().fold(lowest, |bits, (shift, mask)| (bits | bits << shift) & mask)
}

/// The header of a file of so many Gaussians, with so many spherical harmonics beyond the constant one.
fn head(n: usize, n_rest: usize, antialiased: bool) -> String {
    let comment = if antialiased { format!("comment {ANTIALIASED}\n") } else { String::new() };
    let bounds = BOUNDS.iter().chain(&COLOR_BOUNDS);
    let bounds: String = bounds.map(|name| format!("property float {name}\n")).collect();
    let packed = PACKED.map(|name| format!("property uint {name}\n")).concat();
    let harmonics = match n_rest {
        0 => String::new(),
        _ => {
            let names = (0..3 * n_rest).map(|i| format!("property uchar f_rest_{i}\n"));
            format!("element sh {n}\n{}", names.collect::<String>())
        }
    };
    format!(
        "ply\nformat binary_little_endian 1.0\n{comment}element chunk {}\n{bounds}element vertex {n}\n\
         {packed}{harmonics}end_header\n",
        n.div_ceil(CHUNK)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_spread_to_every_third_place() {
        for number in [0, 1, 2, 0b101, 0x1f_ffff, 0x15_5555, 0xff_ffff] {
            let expected = (0..21).map(|bit| (number >> bit & 1) << (3 * bit)).sum::<u64>();
            assert_eq!(spread(number), expected, "{number:x}");
        }
    }
}
