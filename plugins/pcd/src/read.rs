//! Reading: the header, then points in batches.

use crate::decode::{Decoded, Place, Rows, decode};
use crate::header::{Header, Viewpoint};
use crate::layout::Layout;
use crate::{Encoding, ViewpointMeaning, ascii, packed};
use surfelshop_api::columns::Values;
use surfelshop_api::format::{BATCH, CloudHeader, CloudSink, FileSource, Pose};
use surfelshop_api::glam::{DQuat, DVec3};
use surfelshop_api::prelude::{Error, Job, Result};

/// Bytes of points that are read at once, about.
const CHUNK: usize = 8 << 20;

/// Reads a file.
pub(crate) fn read(
    file: &FileSource,
    meaning: ViewpointMeaning,
    clouds: &mut CloudSink<'_>,
    job: &Job<'_>,
) -> Result<()> {
    let header = Header::read(file)?;
    let layout = Layout::new(&header.fields, clouds)?;
    for warning in header.warnings.iter().chain(&layout.warnings) {
        clouds.warn(warning);
    }
    if !clouds.begin(&cloud_header(&header, &layout, meaning))? || header.rows == 0 {
        return Ok(());
    }
    match header.encoding {
        Encoding::Ascii => ascii::read(file, &header, &layout, clouds, job),
        Encoding::Binary => binary(file, &header, &layout, clouds, job),
        Encoding::BinaryCompressed => {
            packed::read(file, &header, &layout, packed::MOST_WHOLE, clouds, job)
        }
    }
}

/// How a comment begins that says how the sensor was turned, as VIEWPOINT has it: w x y z of a quaternion.
pub(crate) const ORIENTATION: &str = "sensor orientation: ";

fn cloud_header(header: &Header, layout: &Layout, meaning: ViewpointMeaning) -> CloudHeader {
    let encoding = match header.encoding {
        Encoding::Ascii => "ascii",
        Encoding::Binary => "binary",
        Encoding::BinaryCompressed => "binary_compressed",
    };
    let space = if header.version.is_empty() { "" } else { " " };
    let (pose, scanner) = place(header, meaning);
    let turned = header.viewpoint.filter(|view| view.rotation != DQuat::IDENTITY);
    let turned = turned.filter(|_| meaning == ViewpointMeaning::Scanner && scanner.is_some());
    let orientation = turned.map(|view| {
        let DQuat { x, y, z, w } = view.rotation;
        format!("{ORIENTATION}{w} {x} {y} {z}")
    });
    CloudHeader {
        format: format!("PCD{space}{}, {encoding}", header.version),
        rows: Some(header.rows),
        columns: layout.columns.iter().map(|column| column.column.clone()).collect(),
        pose,
        scanner,
        grid: header.grid,
        comments: header.comments.iter().cloned().chain(orientation).collect(),
        ..CloudHeader::default()
    }
}

/// Where the cloud stands, and where the sensor stood in its axes.
fn place(header: &Header, meaning: ViewpointMeaning) -> (Pose, Option<DVec3>) {
    // Whoever knows no viewpoint writes the default; whoever has a grid has a sensor, which stands at zero unless
    // it is somewhere else.
    let believed = |view: &Viewpoint| header.grid.is_some() || !view.is_default();
    let Some(view) = header.viewpoint.filter(believed) else { return (Pose::default(), None) };
    match meaning {
        ViewpointMeaning::Scanner => (Pose::default(), Some(view.translation)),
        ViewpointMeaning::Pose => {
            let Viewpoint { rotation, translation } = view;
            (Pose { rotation, translation }, Some(DVec3::ZERO))
        }
    }
}

/// Rows of a batch, so that its bytes are not too many.
pub(crate) fn batch_rows(step: usize) -> usize {
    (CHUNK / step.max(1)).clamp(1, BATCH)
}

/// Where fields lie in points that lie one after the other.
pub(crate) fn interleaved(header: &Header) -> Vec<Place> {
    let place = |offset| Place { start: offset, stride: header.step };
    header.fields.iter().map(|field| place(field.offset)).collect()
}

/// Hands points over in batches.
pub(crate) fn hand_over(
    rows: &Rows<'_>,
    layout: &Layout,
    clouds: &mut CloudSink<'_>,
) -> Result<()> {
    let values: Vec<Decoded> = layout.columns.iter().map(|column| decode(column, rows)).collect();
    let values: Vec<Values<'_>> = values.iter().map(Decoded::values).collect();
    clouds.batch(&values)
}

pub(crate) fn cut_short(expected: u64, found: u64) -> Error {
    Error::new(format!(
        "expected {expected} bytes of points, found {found}: the file is cut short, or its header is wrong"
    ))
}

fn binary(
    file: &FileSource,
    header: &Header,
    layout: &Layout,
    clouds: &mut CloudSink<'_>,
    job: &Job<'_>,
) -> Result<()> {
    let left = file.length().saturating_sub(header.start);
    let all = header.rows.saturating_mul(header.step as u64);
    if all > left {
        return Err(cut_short(all, left));
    }
    let (places, at_once) = (interleaved(header), batch_rows(header.step));
    let (mut bytes, mut done) = (Vec::new(), 0);
    while done < header.rows {
        job.check()?;
        // At most `at_once`.
        let n = (header.rows - done).min(at_once as u64) as usize;
        if bytes.len() != n * header.step {
            bytes.clear();
            bytes.try_reserve_exact(n * header.step)?;
            bytes.resize(n * header.step, 0);
        }
        file.read_exact_at(header.start + done * header.step as u64, &mut bytes)?;
        let fields = &header.fields;
        let rows = Rows { bytes: &bytes, fields, places: &places, first: 0, n };
        hand_over(&rows, layout, clouds)?;
        done += n as u64;
        job.progress(done as f64 / header.rows as f64, "");
    }
    Ok(())
}
