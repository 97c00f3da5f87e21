//! # `sog`: `PlayCanvas`'s Gaussians in images
//!
//! A zip archive of `meta.json` and lossless WebP images in which a pixel is a Gaussian, row after row:
//!
//! | images, named in `meta.json`         | pixels                                                               |
//! |--------------------------------------|----------------------------------------------------------------------|
//! | `means`: lower and upper bytes         | sign(p) ln(1 + abs p) of positions, 16 bits between bounds             |
//! | `scales`                             | logarithms of sizes, by a codebook                                    |
//! | `quats`                              | rotations w, x, y, z without the largest, which alpha names: 252 is w   |
//! | `sh0`                                | the constant spherical harmonic by a codebook; alpha is the opacity    |
//! | `shN`: a palette, and labels into it   | others, by a codebook, 64 entries a row; missing where there are none  |
//!
//! Read are version 2, and version 1, which has bounds in the place of codebooks and logits as opacities. Images that
//! nobody wants are not unpacked. Files do not say which axis points up.
//!
//! A folder with these files is read as an archive of them: the host hands folders over so.
//!
//! Written is version 2. A codebook has the numbers of the cloud where these are 256 at most, so that what was read is
//! written as it was; more numbers share codes such that they are off by little. Likewise up to 65536 different sets of
//! spherical harmonics have an entry of the palette each, and more of them share entries, which a line says. The order
//! of the Gaussians stays.
//!
//! Source: `PlayCanvas`, "The SOG Format"; for version 1 playcanvas/splat-transform, `read-sog-v1.ts`.

mod archive;
mod codebook;
mod images;
mod meta;
mod points;
mod write;
mod zip;

use super::batch::{Batch, in_batches};
use super::outgoing::FormatRange;
use meta::Meta;
use points::{Images, UNPACKING};
use surfelshop_api::format::{
    CloudHeader, CloudSink, CloudSource, FileSink, FileSource, FileTypes, UpAxis,
};
use surfelshop_api::prelude::{Error, HostInfo, Job, LimitInfo, Result, UnitInfo};
use zip::Archive;

/// The file that says what the others are.
const META: &str = "meta.json";

/// Most bytes of it.
const MOST_META: u64 = 16 << 20;

/// Most Gaussians that are believed to be packed into one byte.
const MOST_RATIO: u64 = 256;

const RANGE: FormatRange =
    FormatRange { name: "SOG", degree: 3, up: UpAxis::Unknown, antialiased: true };

/// The format.
pub(crate) struct Sog;

impl surfelshop_api::Format for Sog {
    const INFO: UnitInfo = UnitInfo::new(
        "sog",
        "SOG",
        "Reads and writes PlayCanvas's Gaussian splats in images (.sog).",
    );
    const FILES: FileTypes = FileTypes::new().ending("sog").magic(0, zip::MAGIC).written();
    type Params = ();
    const LIMITS: &'static [LimitInfo] = &[LimitInfo::new(
        "moved",
        "positions have 16 bits between bounds and single precision in such files",
    )];

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn read(
        &mut self,
        file: &FileSource,
        (): &(),
        clouds: &mut CloudSink<'_>,
        job: &Job<'_>,
    ) -> Result<()> {
        let mut magic = [0; zip::MAGIC.len()];
        if file.read_at(0, &mut magic)? < magic.len() || magic != *zip::MAGIC {
            return Err(Error::new(
                "expected a zip archive, found something else: this is no .sog file",
            ));
        }
        let archive = Archive::open(file)?;
        let folder = folder(&archive)?;
        let meta = Meta::parse(&archive.bytes(&format!("{folder}{META}"), MOST_META)?)?;
        if meta.count / MOST_RATIO > file.length() {
            return Err(Error::new(format!(
                "expected {} Gaussians, found {} bytes, which cannot hold them: meta.json is damaged",
                meta.count,
                file.length()
            )));
        }
        let degree = points::degree(&archive, &folder, &meta)?;
        let mut batch = Batch::new(clouds, degree.min(RANGE.degree));
        let comments = meta.antialiased.then(|| super::ANTIALIASED.to_owned());
        let header = CloudHeader {
            format: format!(
                "{} {}, spherical harmonics of degree {degree}",
                RANGE.name, meta.version
            ),
            rows: Some(meta.count),
            columns: batch.header(),
            comments: comments.into_iter().collect(),
            ..CloudHeader::default()
        };
        if !clouds.begin(&header)? {
            return Ok(());
        }
        let mut images = Images::read(&archive, &folder, &meta, &batch, job)?;
        in_batches(meta.count, UNPACKING..1.0, job, |first, n| {
            for i in 0..n {
                // The images have as many pixels.
                batch.push(&images.gaussian(&meta, first as usize + i));
            }
            batch.hand_over(clouds)
        })?;
        images.warnings().iter().for_each(|line| clouds.warn(line));
        batch.finish(clouds);
        Ok(())
    }

    fn write(
        &mut self,
        clouds: &mut CloudSource<'_>,
        (): &(),
        file: &FileSink,
        job: &Job<'_>,
    ) -> Result<Vec<String>> {
        write::write(clouds, file, job)
    }
}

/// The folder in the archive that `meta.json` lies in, with a stroke behind it, or nothing.
fn folder(archive: &Archive<'_>) -> Result<String> {
    let of = |name: &str| {
        let folder = name.strip_suffix(META)?;
        (folder.is_empty() || folder.ends_with('/')).then(|| folder.to_owned())
    };
    let folders = archive.entries().iter().filter_map(|entry| of(&entry.name));
    folders.min_by_key(String::len).ok_or_else(|| {
        let first = archive.entries().first().map_or("nothing", |entry| entry.name.as_str());
        Error::new(format!(
            "expected meta.json of a .sog file in the zip archive, found {first}: unpack the archive and open what is in it"
        ))
    })
}
