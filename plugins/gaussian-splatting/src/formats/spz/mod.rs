//! # `spz`: Niantic's packed Gaussians
//!
//! Read are versions 1 to 3, one stream of gzip, and version 4, a stream of zstd for each attribute. In all of them
//! sizes, opacities, colours and spherical harmonics have 8 bits, and rotations 24 or 32; positions are whole numbers
//! of 24 bits of a step (16-bit floats in version 1). Values are what `load-spz` makes of them; spherical harmonics of
//! order 4 are left out. y points up, unless an extension of version 4 names other axes; other extensions are not read.
//!
//! Attributes that nobody wants are not unpacked. The points of version 4 are read batch by batch; those of older
//! versions are unpacked into memory, 20 to 65 bytes each, since one attribute follows the other.
//!
//! Written is version 3, with the finest step down to 1/65536 whose whole numbers reach the farthest position.
//! Spherical harmonics are rounded to 1/128, not more coarsely; what was read is written as it was.
//!
//! Source: nianticlabs/spz, README and `load-spz.cc`.

mod axes;
mod gzip;
mod header;
mod points;
mod write;
mod zstd;

use super::batch::{Batch, Column, in_batches, resize};
use super::outgoing::FormatRange;
use header::{ATTRIBUTES, Attribute, Header, MAGIC};
use surfelshop_api::format::{CloudSink, CloudSource, FileSink, FileSource, FileTypes, UpAxis};
use surfelshop_api::prelude::{Error, HostInfo, Job, LimitInfo, Result, UnitInfo};

const RANGE: FormatRange = FormatRange { name: "SPZ", degree: 3, up: UpAxis::Y, antialiased: true };

/// The format.
pub(crate) struct Spz;

impl surfelshop_api::Format for Spz {
    const INFO: UnitInfo =
        UnitInfo::new("spz", "SPZ", "Reads and writes Niantic's packed Gaussian splats (.spz).");
    // Versions 1 to 3 begin as any gzip file does.
    const FILES: FileTypes = FileTypes::new().ending("spz").magic(0, MAGIC).written();
    type Params = ();
    const LIMITS: &'static [LimitInfo] =
        &[LimitInfo::new("moved", "positions have 24 bits from zero in such files")];

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
        let head = file.bytes_at(0, file.length().min(MAGIC.len() as u64))?;
        if head == MAGIC {
            let (header, streams) = zstd::open(file)?;
            let Some(mut batch) = begin(&header, clouds)? else { return Ok(()) };
            let mut streams = streams.start(file, &header, &wanted(&batch))?;
            hand_over(&header, &mut streams, &mut batch, 0.0, clouds, job)?;
            streams.finish()
        } else if head.starts_with(&gzip::MAGIC) {
            let (header, stream) = gzip::open(file)?;
            let Some(mut batch) = begin(&header, clouds)? else { return Ok(()) };
            let mut memory = stream.unpack(&header, &wanted(&batch), job)?;
            hand_over(&header, &mut memory, &mut batch, gzip::SHARE, clouds, job)
        } else {
            Err(Error::new(
                "expected a gzip file, or one that begins with NGSP, found neither: this is no .spz file",
            ))
        }
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

/// Where bytes of attributes come from.
trait Attributes {
    /// The next bytes of an attribute.
    fn read(&mut self, attribute: Attribute, bytes: &mut [u8]) -> Result<()>;
}

/// Begins the cloud; the columns to fill, where its points are wanted.
fn begin(header: &Header, clouds: &mut CloudSink<'_>) -> Result<Option<Batch>> {
    let batch = Batch::new(clouds, header.degree);
    for warning in header.warnings() {
        clouds.warn(&warning);
    }
    let cloud = header.cloud(batch.header());
    Ok(clouds.begin(&cloud)?.then_some(batch))
}

/// The attributes that columns are made of.
fn wanted(batch: &Batch) -> [bool; 6] {
    ATTRIBUTES.map(|attribute| match attribute {
        Attribute::Positions => true,
        Attribute::Opacities => batch.has(Column::Opacity),
        Attribute::Colors => batch.has(Column::Sh(0)),
        Attribute::Sizes => batch.has(Column::Scale),
        Attribute::Rotations => batch.has(Column::Rotation),
        Attribute::Harmonics => batch.has_rest(),
    })
}

/// Hands over all Gaussians; progress begins at `start`.
fn hand_over(
    header: &Header,
    attributes: &mut dyn Attributes,
    batch: &mut Batch,
    start: f64,
    clouds: &mut CloudSink<'_>,
    job: &Job<'_>,
) -> Result<()> {
    let wanted = wanted(batch);
    let sizes = header.sizes();
    let mut bytes: [Vec<u8>; 6] = Default::default();
    in_batches(header.points, start..1.0, job, |_, n| {
        for attribute in ATTRIBUTES {
            let place = attribute as usize;
            if wanted[place] {
                resize(&mut bytes[place], n * sizes[place])?;
                attributes.read(attribute, &mut bytes[place])?;
            }
        }
        for i in 0..n {
            batch.push(&points::gaussian(header, &bytes, i));
        }
        batch.hand_over(clouds)
    })?;
    batch.finish(clouds);
    Ok(())
}
