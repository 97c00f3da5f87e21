//! Reading a file: header, records, columns, points.

use crate::compressed::{self, Chunks, Compression};
use crate::extra;
use crate::header::Header;
use crate::hierarchy;
use crate::layout::Layout;
use crate::notes;
use crate::plain;
use crate::points::Points;
use crate::projection::Projection;
use crate::records::Records;
use surfelshop_api::format::{CloudHeader, CloudSink, FileSource, PointNode, UpAxis};
use surfelshop_api::{Job, Result};

/// Reads the cloud of a file.
///
/// # Errors
/// Where the file is damaged so that no point can be read, the host or the system refuses, or the user asked to
/// stop.
pub(crate) fn read(file: &FileSource, clouds: &mut CloudSink<'_>, job: &Job<'_>) -> Result<()> {
    let mut warnings = Vec::new();
    let header = Header::read(file)?;
    let records = Records::read(file, &header, &mut warnings)?;
    if let Some(other) = header.n_points_elsewhere {
        warnings.push(format!(
            "the header announces {} points, and {other} in the field of older versions",
            header.n_points
        ));
    }
    let body = Body::find(file, &header, &records, &mut warnings, job)?;
    let extra =
        extra::fields(&records.extra_bytes, header.format.len, header.record_len, &mut warnings);
    let layout = Layout::new(&header, extra, |column| clouds.wants(column), &mut warnings);
    if header.format.waveform.is_some() {
        warnings.push("the waveforms of the points are left out".to_owned());
    }
    let projection = Projection::of(&records);
    warnings.extend(projection.warning.clone());
    let rows = body.rows();
    let mut cloud = describe(&header, &records, projection, &layout, rows);
    let wanted = clouds.nodes().map(<[PointNode]>::to_vec);
    if let (Some(_), Body::Compressed(..), Some(copc)) = (&wanted, &body, &records.copc) {
        let with_nodes = wanted.as_ref().is_none_or(Vec::is_empty);
        cloud.tree = Some(hierarchy::tree(file, copc, with_nodes, header.n_points)?);
        // The nodes say how many points there are, which no command has all of at once.
        cloud.rows = None;
    }
    for warning in &warnings {
        clouds.warn(warning);
    }
    if !clouds.begin(&cloud)? {
        return Ok(());
    }
    if let (Some(nodes), Some(_), Body::Compressed(compression, _)) = (wanted, cloud.tree, &body) {
        return hierarchy::read(file, compression, &nodes, (&layout, clouds, job));
    }
    let expected = rows.unwrap_or_else(|| body.most());
    let (n_read, fault) = Default::default();
    let mut points = Points { layout: &layout, clouds, job, expected, n_read, fault };
    match &body {
        Body::Plain(_) => plain::read(file, &header, &mut points)?,
        Body::Compressed(compression, chunks) => {
            compressed::read(file, compression, chunks, &mut points)?;
        }
    }
    points.finish(rows)
}

/// Where the points are.
enum Body {
    /// So many records.
    Plain(u64),
    Compressed(Compression, Chunks),
}

impl Body {
    fn find(
        file: &FileSource,
        header: &Header,
        records: &Records,
        warnings: &mut Vec<String>,
        job: &Job<'_>,
    ) -> Result<Self> {
        if !header.is_compressed {
            return Ok(Self::Plain(plain::count(file, header, warnings)?));
        }
        let compression = Compression::new(records.laszip.as_deref(), header)?;
        let chunks = Chunks::find(file, header, &compression, warnings, job)?;
        Ok(Self::Compressed(compression, chunks))
    }

    /// Number of points, where it is known.
    fn rows(&self) -> Option<u64> {
        match self {
            Self::Plain(rows) => Some(*rows),
            Self::Compressed(_, Chunks::Known { points, .. } | Chunks::Stream { points, .. }) => {
                *points
            }
        }
    }

    /// The most points that there can be.
    fn most(&self) -> u64 {
        match self {
            Self::Plain(rows) => *rows,
            Self::Compressed(_, Chunks::Known { chunks, .. }) => {
                chunks.iter().map(|chunk| chunk.points).sum()
            }
            Self::Compressed(_, Chunks::Stream { most, .. }) => *most,
        }
    }
}

/// The header as the host takes it.
fn describe(
    header: &Header,
    records: &Records,
    projection: Projection,
    layout: &Layout,
    rows: Option<u64>,
) -> CloudHeader {
    let source = if header.source_id == 0 { String::new() } else { header.source_id.to_string() };
    let named = [
        (notes::SYSTEM, &header.system),
        (notes::SOFTWARE, &header.software),
        (notes::SOURCE_ID, &source),
        (notes::PROJECT_ID, &header.project_id),
    ];
    let named = named.into_iter().filter(|(_, text)| !text.is_empty());
    let named = named.map(|(what, text)| format!("{what}{text}"));
    let others = records.others.iter().map(|other| format!("{}{other}", notes::NOT_READ));
    let texts = records.texts.iter().filter(|text| !text.is_empty()).cloned();
    CloudHeader {
        format: header.describe(records.copc.is_some() && header.is_compressed),
        rows,
        columns: layout.columns.iter().map(|column| column.file.clone()).collect(),
        bounds: header.bounds,
        step: Some(header.scale.abs()),
        up: records.up.unwrap_or(UpAxis::Z),
        metres_per_unit: projection.metres_per_unit,
        coordinate_system: projection.name,
        time: header.date.clone(),
        comments: named.chain(texts).chain(projection.comments).chain(others).collect(),
        ..CloudHeader::default()
    }
}
