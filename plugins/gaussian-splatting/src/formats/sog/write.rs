//! Writing version 2: positions as they lie between their bounds, all else by codebooks of what the cloud has.

use super::super::outgoing::byte;
use super::super::{ANTIALIASED, Gaussian, rest_of};
use super::RANGE;
use super::archive::Outgoing;
use super::codebook::{codes_of, nearest, palette};
use super::meta::{COEFFICIENTS, PER_ROW};
use super::points::packed;
use image_webp::{ColorType, WebPEncoder};
use serde_json::{Value, json};
use surfelshop_api::format::{CloudSource, FileSink};
use surfelshop_api::prelude::{Error, Job, Result};

/// The share of the progress that taking points has.
const SHARE: f64 = 0.3;

/// Most entries of a palette: labels have 16 bits.
const MOST_ENTRIES: usize = 1 << 16;

/// Sides of images are multiples of this.
const SIDE: usize = 4;

/// The logarithm of a size of 0, which has none: beneath that of any other.
const LEAST_SIZE: f32 = -90.0;

/// What all Gaussians have.
#[derive(Default)]
struct Store {
    /// Logarithms, with signs.
    positions: Vec<[f64; 3]>,
    opacities: Vec<u8>,
    colors: Vec<[f32; 3]>,
    /// Logarithms.
    sizes: Vec<[f32; 3]>,
    rotations: Vec<[u8; 4]>,
    /// All coefficients of a Gaussian, red, green and blue of each.
    harmonics: Vec<f32>,
}

fn add<T>(values: &mut Vec<T>, value: T) -> Result<()> {
    values.try_reserve(1)?;
    values.push(value);
    Ok(())
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
    let (degree, mut store) = (RANGE.degree_of(&header), Store::default());
    let n_placeless = RANGE.each(&header, clouds, SHARE, job, |gaussian, place| {
        store.take(gaussian, place, rest_of(degree))
    })?;
    let mut notes = RANGE.notes(&header, n_placeless);
    let mut archive = Outgoing::new(file);
    let mut meta = store.write_images(&mut archive, job)?;
    if degree > 0 {
        let (of_rest, note) = store.write_harmonics(degree, &mut archive, job)?;
        meta["shN"] = of_rest;
        notes.extend(note);
    }
    if header.comments.iter().any(|comment| comment == ANTIALIASED) {
        meta["antialias"] = json!(true);
    }
    let meta = serde_json::to_vec(&meta);
    let meta = meta.map_err(|error| Error::new(format!("meta.json cannot be written: {error}")))?;
    archive.add(super::META, &meta)?;
    archive.finish()?;
    Ok(notes)
}

/// Width and height of an image with a pixel for each of so many.
fn sides(n: usize) -> [usize; 2] {
    let width = ((n as f64).sqrt().ceil() as usize).next_multiple_of(SIDE).max(SIDE);
    [width, n.div_ceil(width).next_multiple_of(SIDE).max(SIDE)]
}

/// A lossless image of pixels, row after row; those that are missing are 0.
fn image<const N: usize>(
    [width, height]: [usize; 2],
    pixels: impl ExactSizeIterator<Item = [u8; N]>,
) -> Result<Vec<u8>> {
    let mut bytes: Vec<u8> = Vec::new();
    bytes.try_reserve_exact(width * height * N)?;
    for pixel in pixels {
        bytes.extend(pixel);
    }
    bytes.resize(width * height * N, 0);
    let color = if N == 4 { ColorType::Rgba8 } else { ColorType::Rgb8 };
    let mut packed = Vec::new();
    let encoder = WebPEncoder::new(&mut packed);
    let [width, height] = [u32::try_from(width)?, u32::try_from(height)?];
    encoder.encode(&bytes, width, height, color).map_err(|error| {
        Error::new(format!("an image of {width} x {height} pixels cannot be packed: {error}"))
    })?;
    Ok(packed)
}

impl Store {
    fn take(&mut self, gaussian: &Gaussian, place: [f64; 3], n_rest: usize) -> Result<()> {
        add(&mut self.positions, place.map(|number| number.abs().ln_1p().copysign(number)))?;
        add(&mut self.opacities, byte(255.0 * gaussian.opacity))?;
        add(&mut self.colors, gaussian.color.map(finite))?;
        add(&mut self.sizes, gaussian.scale.map(|size| size.ln().max(LEAST_SIZE)))?;
        add(&mut self.rotations, packed(gaussian.rotation))?;
        let rest = gaussian.rest[..n_rest].as_flattened();
        self.harmonics.try_reserve(rest.len())?;
        self.harmonics.extend(rest.iter().copied().map(finite));
        Ok(())
    }

    /// The least and the most of the positions along each axis.
    fn bounds(&self) -> [[f64; 2]; 3] {
        if self.positions.is_empty() {
            return [[0.0; 2]; 3];
        }
        std::array::from_fn(|axis| {
            let along = self.positions.iter().map(|position| position[axis]);
            let (least, most) = (f64::INFINITY, f64::NEG_INFINITY);
            along.fold([least, most], |[least, most], number| [least.min(number), most.max(number)])
        })
    }

    /// Adds the images of all but spherical harmonics beyond the constant one; what says what they are.
    fn write_images(&self, archive: &mut Outgoing, job: &Job<'_>) -> Result<Value> {
        let sides = sides(self.positions.len());
        let step = |done: f64| {
            job.progress(SHARE + (0.7 - SHARE) * done, "");
            job.check()
        };
        let bounds = self.bounds();
        let number = |position: &[f64; 3]| -> [[u8; 2]; 3] {
            std::array::from_fn(|axis| {
                let [least, most] = bounds[axis];
                let share = (position[axis] - least) / (most - least);
                // Where all are at one place, there is no share, which becomes 0.
                ((65535.0 * share).round() as u16).to_le_bytes()
            })
        };
        for (i, name) in ["means_l.webp", "means_u.webp"].into_iter().enumerate() {
            let pixels = self.positions.iter().map(|position| number(position).map(|b| b[i]));
            archive.add(name, &image(sides, pixels)?)?;
            step(0.2 * (i + 1) as f64)?;
        }
        let of_sizes = codes_of(self.sizes.as_flattened().to_vec());
        let pixels = self.sizes.iter().map(|sizes| sizes.map(|size| nearest(&of_sizes, size)));
        archive.add("scales.webp", &image(sides, pixels)?)?;
        step(0.6)?;
        archive.add("quats.webp", &image(sides, self.rotations.iter().copied())?)?;
        step(0.8)?;
        let of_colors = codes_of(self.colors.as_flattened().to_vec());
        let pixels = self.colors.iter().zip(&self.opacities).map(|(color, opacity)| {
            let [r, g, b] = color.map(|value| nearest(&of_colors, value));
            [r, g, b, *opacity]
        });
        archive.add("sh0.webp", &image(sides, pixels)?)?;
        step(1.0)?;
        let (mins, maxs) = (bounds.map(|[least, _]| least), bounds.map(|[_, most]| most));
        Ok(json!({
            "version": 2,
            "asset": { "generator": "Surfelshop" },
            "count": self.positions.len(),
            "means": { "mins": mins, "maxs": maxs, "files": ["means_l.webp", "means_u.webp"] },
            "scales": { "codebook": of_sizes, "files": ["scales.webp"] },
            "quats": { "files": ["quats.webp"] },
            "sh0": { "codebook": of_colors, "files": ["sh0.webp"] },
        }))
    }

    /// Adds the palette of the other spherical harmonics, and which entry each Gaussian has; says what they are, and
    /// in a line where Gaussians share one that is not quite theirs.
    fn write_harmonics(
        &self,
        degree: usize,
        archive: &mut Outgoing,
        job: &Job<'_>,
    ) -> Result<(Value, Option<String>)> {
        let n = COEFFICIENTS[degree];
        let found = palette(&self.harmonics, 3 * n, MOST_ENTRIES, job)?;
        job.progress(0.85, "");
        let count = found.values.len() / (3 * n);
        let codes = codes_of(found.values.clone());
        // The last row may have fewer entries.
        let sides_of_entries = [PER_ROW * n, count.div_ceil(PER_ROW).max(1)];
        let values = found.values.as_chunks::<3>().0.iter();
        let pixels = values.map(|value| value.map(|number| nearest(&codes, number)));
        archive.add("shN_centroids.webp", &image(sides_of_entries, pixels)?)?;
        job.check()?;
        let labels = found.labels.iter().map(|label| {
            let [low, high] = label.to_le_bytes();
            [low, high, 0]
        });
        archive.add("shN_labels.webp", &image(sides(found.labels.len()), labels)?)?;
        job.progress(1.0, "");
        let note = (found.is_shared && count >= MOST_ENTRIES).then(|| {
            format!(
                "{} Gaussians share {count} sets of spherical harmonics, as many as SOG holds",
                found.labels.len()
            )
        });
        let of_rest = json!({
            "count": count,
            "bands": degree,
            "codebook": codes,
            "files": ["shN_centroids.webp", "shN_labels.webp"],
        });
        Ok((of_rest, note))
    }
}
