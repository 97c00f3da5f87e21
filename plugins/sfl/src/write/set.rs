//! A surfel set as it is written: its directory, that of its resolution, and the records.

use super::Place;
use super::fields::{Column, fields};
use super::origin::origin;
use super::records::{Records, positions};
use super::report::Report;
use super::scene::{bounds_floats, cut};
use crate::gff::{Block, ENTRY_BYTES, Link, closing, tags};
use crate::settings::Settings;
use crate::surfel::layout::Layout;
use surfelshop_api::format::{CloudHeader, CloudSource, FileSink, Pose};
use surfelshop_api::glam::{DMat3, DQuat, DVec3};
use surfelshop_api::{Error, Job, Result};

/// What is known of a set before its surfels.
pub(super) struct SetWriter {
    name: String,
    layout: Layout,
    columns: Vec<Column>,
    pose: Pose,
    announced: Option<[DVec3; 2]>,
    rows: Option<u64>,
    place: Place,
}

/// A set that is written.
pub(super) struct Written {
    /// Where the next one lies.
    pub(super) end: Place,
    /// Its box in the file's coordinates.
    pub(super) bounds: Option<[DVec3; 2]>,
}

/// What the directories of a set say.
struct SetBlock<'a> {
    set: &'a SetWriter,
    placed: Pose,
    bounds: Option<[DVec3; 2]>,
    n_surfels: u32,
    /// Where the directory lies that closes the resolutions.
    closing: u32,
    /// Where the next set lies.
    next: u32,
}

impl SetBlock<'_> {
    /// The bytes from the beginning of the set to its records; as many whatever the set has.
    fn bytes(&self) -> Vec<u8> {
        let Self { set, bounds, n_surfels, closing, next, .. } = *self;
        let layout = &set.layout;
        // Numbers and places of the known properties fit into any of these types.
        let (ids, offsets): (Vec<u16>, Vec<u32>) =
            layout.properties().map(|(id, place)| (id as u16, place as u32)).unzip();
        let block = Block::default()
            .words(tags::N_RESOLUTIONS, &[1])
            .words(tags::SURFEL_FORMAT, &[1])
            .words(tags::SURFEL_BYTES, &[layout.record as u32])
            .words(tags::PROPERTY_BITS, &layout.bits())
            .shorts(tags::PROPERTY_IDS, &ids)
            .words(tags::PROPERTY_OFFSETS, &offsets)
            .text(tags::IDENTIFIER, cut(&set.name))
            .floats(tags::BOUNDS, &bounds_floats(bounds));
        let block = transform(block, &self.placed);
        let mut bytes = block.bytes(set.place.0, Link::Parent { next, n_children: 1 });
        let resolution = Block::default()
            .words(tags::N_SURFELS, &[n_surfels])
            .data(tags::SURFELS, n_surfels.wrapping_mul(layout.record as u32));
        // Directories are small, and the writer checks that the set ends within 32 bits.
        let place = set.place.0.wrapping_add(bytes.len() as u32);
        bytes.extend(resolution.bytes(place, Link::Leaf { next: closing }));
        bytes
    }
}

/// Adds the matrix of a pose where it is one: as 32-bit floats where they hold it, else as 64-bit floats, which readers take
/// for any number.
fn transform(block: Block, pose: &Pose) -> Block {
    if *pose == Pose::default() {
        return block;
    }
    let rows = DMat3::from_quat(pose.rotation).transpose();
    let moved = pose.translation;
    let row = |axis: DVec3, moved: f64| [axis.x, axis.y, axis.z, moved];
    let matrix = [
        row(rows.x_axis, moved.x),
        row(rows.y_axis, moved.y),
        row(rows.z_axis, moved.z),
        [0.0, 0.0, 0.0, 1.0],
    ];
    let matrix = matrix.as_flattened();
    let singles: Vec<f32> = matrix.iter().map(|&entry| entry as f32).collect();
    let is_exact = singles.iter().zip(matrix).all(|(&single, &entry)| f64::from(single) == entry);
    if is_exact {
        block.floats(tags::TRANSFORM, &singles)
    } else {
        block.doubles(tags::TRANSFORM, matrix)
    }
}

/// A pose whose rotation is one.
fn sound(pose: Pose) -> Pose {
    let rotation = pose.rotation.normalize();
    let is_unit = (pose.rotation.length_squared() - 1.0).abs() < 1e-12;
    match (rotation.is_finite(), is_unit) {
        (true, true) => pose,
        (true, false) => Pose { rotation, ..pose },
        (false, _) => Pose { rotation: DQuat::IDENTITY, ..pose },
    }
}

/// The box around a box that was rotated and moved.
fn placed_bounds(bounds: [DVec3; 2], pose: &Pose) -> [DVec3; 2] {
    let (centre, half) = ((bounds[0] + bounds[1]) / 2.0, (bounds[1] - bounds[0]) / 2.0);
    let rotation = DMat3::from_quat(pose.rotation);
    let reach =
        DMat3::from_cols(rotation.x_axis.abs(), rotation.y_axis.abs(), rotation.z_axis.abs());
    let (centre, half) = (pose.rotation * centre + pose.translation, reach * half);
    [centre - half, centre + half]
}

impl SetWriter {
    /// A set for a cloud, from a place of the file on.
    pub(super) fn new(
        header: &CloudHeader,
        number: u32,
        settings: &Settings,
        place: Place,
        report: &mut Report,
    ) -> Self {
        let (layout, columns) = fields(header, settings, report);
        let usual = || format!("surfelSet{number:02}");
        let name = if header.name.is_empty() { usual() } else { header.name.clone() };
        let (pose, announced) = (sound(header.pose), header.bounds);
        Self { name, layout, columns, pose, announced, rows: header.rows, place }
    }

    /// Writes the set.
    ///
    /// # Errors
    /// Where there is no room for it, the clouds fail, the system refuses, or the user asked to stop.
    pub(super) fn write(
        self,
        clouds: &mut CloudSource<'_>,
        file: &FileSink,
        job: &Job<'_>,
        report: &mut Report,
    ) -> Result<Written> {
        let mut bytes = Vec::new();
        let mut begun: Option<Begun> = None;
        let mut n_surfels: u32 = 0;
        while let Some(batch) = clouds.next_batch()? {
            let begun = match &mut begun {
                Some(begun) => begun,
                none => {
                    let origin = origin(&positions(&batch)?, self.announced);
                    if origin != DVec3::ZERO {
                        report.origin(&self.name, origin);
                    }
                    none.insert(self.begin(origin, file)?)
                }
            };
            begun.records.encode(&batch, &mut bytes, report)?;
            let end = begun.end.after(bytes.len())?;
            file.write_at(begun.end.0.into(), &bytes)?;
            begun.end = end;
            // As many bytes fit into 32 bits, and a surfel has at least twelve.
            n_surfels += u32::try_from(batch.len)?;
            if let Some(rows) = self.rows.filter(|&rows| rows > 0) {
                job.progress((f64::from(n_surfels) / rows as f64).min(1.0), "");
            }
            job.check()?;
        }
        let begun = match begun {
            Some(begun) => begun,
            None => self.begin(DVec3::ZERO, file)?,
        };
        self.finish(&begun, n_surfels, file)
    }

    /// Writes directories that keep the room for the final ones.
    fn begin(&self, origin: DVec3, file: &FileSink) -> Result<Begun> {
        if self.layout.record == 0 {
            return Err(Error::new("expected positions of three numbers, found none"));
        }
        let Pose { rotation, translation } = self.pose;
        let placed = Pose { rotation, translation: rotation * origin + translation };
        let (bounds, n_surfels, closing, next) = Default::default();
        let block = SetBlock { set: self, placed, bounds, n_surfels, closing, next }.bytes();
        let end = self.place.after(block.len())?;
        file.write_at(self.place.0.into(), &block)?;
        let records = Records::new(self.layout.clone(), self.columns.clone(), origin);
        Ok(Begun { records, placed, end })
    }

    /// Closes the list of resolutions and writes the final directories.
    fn finish(&self, begun: &Begun, n_surfels: u32, file: &FileSink) -> Result<Written> {
        let rest = begun.end.0.next_multiple_of(4) - begun.end.0;
        let closing_place = begun.end.after(rest as usize)?;
        let next = closing_place.after(ENTRY_BYTES as usize)?;
        let mut bytes = vec![0; rest as usize];
        bytes.extend(closing(next.0));
        file.write_at(begun.end.0.into(), &bytes)?;
        let bounds = begun.records.bounds();
        let (placed, closing, next_place) = (begun.placed, closing_place.0, next.0);
        let block =
            SetBlock { set: self, placed, bounds, n_surfels, closing, next: next_place }.bytes();
        file.write_at(self.place.0.into(), &block)?;
        let bounds = bounds.map(|bounds| placed_bounds(bounds, &begun.placed));
        Ok(Written { end: next, bounds })
    }
}

/// A set whose records are being written.
struct Begun {
    records: Records,
    placed: Pose,
    /// Where the next record lies.
    end: Place,
}
