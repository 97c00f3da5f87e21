//! Writing version 3. How far positions reach is known at the end, so attributes are kept in memory until then.

use super::super::{ANTIALIASED, rest_of};
use super::RANGE;
use super::header::Header;
use super::points::{bytes, harmonic, position};
use flate2::Compression;
use flate2::write::GzEncoder;
use std::io::{BufWriter, Write};
use surfelshop_api::format::{CloudSource, FileSink, FileStream};
use surfelshop_api::prelude::{Error, Job, Result};

/// Most bits behind the point of a position. More cost space and tell nothing.
const MOST_BITS: u8 = 16;

/// The largest whole number of 24 bits with a sign.
const MOST: f64 = 8_388_607.0;

/// The share of the progress that taking points has.
const SHARE: f64 = 0.4;

/// Bytes that are packed at once.
const PIECE: usize = 1 << 18;

/// Attributes of all Gaussians.
#[derive(Default)]
struct Store {
    positions: Vec<[f64; 3]>,
    opacities: Vec<[u8; 1]>,
    colors: Vec<[u8; 3]>,
    sizes: Vec<[u8; 3]>,
    rotations: Vec<[u8; 4]>,
    harmonics: Vec<[u8; 3]>,
    /// The farthest coordinate from zero.
    reach: f64,
    n_cut: u64,
}

fn add<T>(values: &mut Vec<T>, value: T) -> Result<()> {
    values.try_reserve(1)?;
    values.push(value);
    Ok(())
}

/// Writes the one cloud. Returns lines of what the file does not hold.
pub(super) fn write(
    clouds: &mut CloudSource<'_>,
    file: &FileSink,
    job: &Job<'_>,
) -> Result<Vec<String>> {
    let header = clouds.next_cloud()?;
    let header = header.ok_or_else(|| Error::new("expected a cloud to write, found none"))?;
    let (degree, mut store) = (RANGE.degree_of(&header), Store::default());
    let n_placeless = RANGE.each(&header, clouds, SHARE, job, |gaussian, place| {
        store.reach = place.iter().fold(store.reach, |reach, number| reach.max(number.abs()));
        let (opacity, color, size, rotation, mut holds) = bytes(gaussian);
        add(&mut store.positions, place)?;
        add(&mut store.opacities, opacity)?;
        add(&mut store.colors, color)?;
        add(&mut store.sizes, size)?;
        add(&mut store.rotations, rotation)?;
        for value in &gaussian.rest[..rest_of(degree)] {
            let bytes = value.map(harmonic);
            holds &= bytes.iter().all(|(_, holds)| *holds);
            add(&mut store.harmonics, bytes.map(|(byte, _)| byte))?;
        }
        store.n_cut += u64::from(!holds);
        Ok(())
    })?;
    let mut notes = RANGE.notes(&header, n_placeless);
    if store.n_cut > 0 {
        notes.push(format!(
            "{} Gaussians have sizes or colours beyond what SPZ holds: they were cut off",
            store.n_cut
        ));
    }
    let antialiased = header.comments.iter().any(|comment| comment == ANTIALIASED);
    let bits = store.bits()?;
    let points = u32::try_from(store.positions.len()).ok().ok_or_else(|| {
        Error::new(format!(
            "expected fewer than 2^32 Gaussians, which SPZ holds, found {}",
            store.positions.len()
        ))
    })?;
    let header = Header {
        version: 3,
        points: points.into(),
        degree,
        bits,
        antialiased,
        ..Header::default()
    };
    store.pack(&header, file, job)?;
    Ok(notes)
}

impl Store {
    /// Bits behind the point of positions: the most that still hold the farthest.
    fn bits(&self) -> Result<u8> {
        let holds = |bits: &u8| (self.reach * f64::from(1u32 << bits)).round() <= MOST;
        (0..=MOST_BITS).rev().find(holds).ok_or_else(|| {
            Error::new(format!(
                "expected coordinates within {MOST}, which SPZ holds, found {}: move the cloud towards zero",
                self.reach
            ))
        })
    }

    fn pack(&self, header: &Header, file: &FileSink, job: &Job<'_>) -> Result<()> {
        let out = BufWriter::with_capacity(PIECE, file.stream());
        let mut out = GzEncoder::new(out, Compression::default());
        out.write_all(&header.bytes())?;
        for places in self.positions.chunks(PIECE / 9) {
            job.check()?;
            let places: Vec<[u8; 9]> =
                places.iter().map(|place| position(*place, header.bits)).collect();
            out.write_all(places.as_flattened())?;
        }
        let attributes = [
            self.opacities.as_flattened(),
            self.colors.as_flattened(),
            self.sizes.as_flattened(),
            self.rotations.as_flattened(),
            self.harmonics.as_flattened(),
        ];
        for (i, bytes) in attributes.into_iter().enumerate() {
            write_pieces(&mut out, bytes, job)?;
            let done = (i + 1) as f64 / attributes.len() as f64;
            job.progress(SHARE + (1.0 - SHARE) * done, "");
        }
        out.finish()?.flush()?;
        Ok(())
    }
}

fn write_pieces(
    out: &mut GzEncoder<BufWriter<FileStream>>,
    bytes: &[u8],
    job: &Job<'_>,
) -> Result<()> {
    for piece in bytes.chunks(PIECE) {
        job.check()?;
        out.write_all(piece)?;
    }
    Ok(())
}
