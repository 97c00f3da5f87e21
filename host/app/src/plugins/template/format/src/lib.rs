//! # `{{id}}`: files of points, read and written
//!
//! A format that was made up to be changed. A file `.{{ending}}` has, without gaps and with the least
//! significant byte of each number first:
//!
//! | bytes        | what                                              |
//! |--------------|---------------------------------------------------|
//! | a first line | `points {{ending}} 1`, which tells the format apart |
//! | 8            | how many points follow, u64                       |
//! | 27 a point   | x, y, z (f64 each), red, green, blue (u8, sRGB)   |
//!
//! | parameter | type   | default   | meaning                                               |
//! |-----------|--------|-----------|-------------------------------------------------------|
//! | `up`      | choice | `unknown` | the axis that points up in a file, which does not say |
//!
//! `surfelshop check` writes files and reads them back, whole, cut short and with bits turned over. What
//! reading makes of a few bytes is tested below: `cargo test`.

use surfelshop_api::Format;
use surfelshop_api::columns::{COLOR, Element, POSITION, Values};
use surfelshop_api::format::{
    BATCH, CloudHeader, CloudSink, CloudSource, FileColumn, FileSink, FileSource, FileTypes,
    HeaderSupport, UpAxis,
};
use surfelshop_api::params::linear_to_srgb;
use surfelshop_api::prelude::{
    CloudView, Error, HostInfo, Job, Result, UnitInfo, choices, export_plugin, params,
};

/// The first line of every file.
const FIRST_LINE: &[u8] = b"points {{ending}} 1\n";
/// Where the number of points stands.
const COUNT_AT: u64 = FIRST_LINE.len() as u64;
/// Where the first point begins.
const POINTS_AT: u64 = COUNT_AT + 8;
/// Bytes of a place, of which there are three numbers.
const PLACE_LEN: usize = 3 * 8;
/// Bytes of a point.
const POINT_LEN: usize = PLACE_LEN + 3;

choices! {
    /// Which axis points up.
    pub enum Up {
        /// Nobody knows.
        Unknown = "unknown",
        /// x.
        X = "x",
        /// y.
        Y = "y",
        /// z.
        Z = "z",
    }
}

params! {
    /// Settings of `{{id}}`: `--format-set` and the window's panel are made from these lines.
    pub struct Settings {
        /// The axis that points up in a file.
        up: Up { default: Up::Unknown },
    }
}

struct {{Name}};

impl Format for {{Name}} {
    const INFO: UnitInfo = UnitInfo::new(
        "{{id}}",
        "{{title}}",
        "Points with colours in a simple file: begin here with a format of your own.",
    );
    // The host finds the format by this: first by the bytes of a file, then by its name.
    const FILES: FileTypes = FileTypes::new()
        .ending("{{ending}}")
        .magic(0, FIRST_LINE)
        .written();
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn read(
        &mut self,
        file: &FileSource,
        params: &Settings,
        clouds: &mut CloudSink<'_>,
        job: &Job<'_>,
    ) -> Result<()> {
        let n_points = count(file, clouds)?;
        let mut columns = vec![FileColumn::new(POSITION, 3, Element::F64)];
        // What nobody reads is not announced, and then not handed over either.
        if clouds.wants(COLOR) {
            columns.push(FileColumn::new(COLOR, 3, Element::U8));
        }
        let n_columns = columns.len();
        let header = CloudHeader {
            format: "{{title}}, version 1".to_owned(),
            rows: Some(n_points),
            columns,
            up: match params.up {
                Up::Unknown => UpAxis::Unknown,
                Up::X => UpAxis::X,
                Up::Y => UpAxis::Y,
                Up::Z => UpAxis::Z,
            },
            ..CloudHeader::default()
        };
        if !clouds.begin(&header)? {
            return Ok(()); // The header was all that somebody asked for.
        }
        // A batch after the other, so that files larger than the memory can be read.
        let (mut bytes, mut places, mut colors) = (Vec::new(), Vec::new(), Vec::new());
        let mut n_done = 0;
        while n_done < n_points {
            job.check()?;
            let n = (n_points - n_done).min(BATCH as u64);
            bytes.resize(n as usize * POINT_LEN, 0);
            file.read_exact_at(POINTS_AT + n_done * POINT_LEN as u64, &mut bytes)?;
            places.clear();
            colors.clear();
            for point in bytes.chunks_exact(POINT_LEN) {
                let (place, color) = point.split_at(PLACE_LEN);
                for number in place.chunks_exact(8) {
                    places.push(f64::from_le_bytes(number.try_into()?));
                }
                colors.extend_from_slice(color);
            }
            let values = [Values::F64(&places), Values::U8(&colors)];
            clouds.batch(&values[..n_columns])?;
            n_done += n;
            job.progress(n_done as f64 / n_points as f64, "");
        }
        Ok(())
    }

    fn write(
        &mut self,
        clouds: &mut CloudSource<'_>,
        _params: &Settings,
        file: &FileSink,
        job: &Job<'_>,
    ) -> Result<Vec<String>> {
        let (mut lost, mut bytes, mut n_points) = (Vec::new(), Vec::new(), 0u64);
        // How many points there are shows when they have come. Until then the file says none.
        file.write_at(0, &[FIRST_LINE, &[0; 8]].concat())?;
        while let Some(header) = clouds.next_cloud()? {
            lost.extend(what_is_lost(&header));
            while let Some(batch) = clouds.next_batch()? {
                job.check()?;
                pack(&batch, &mut bytes)?;
                file.write_at(POINTS_AT + n_points * POINT_LEN as u64, &bytes)?;
                n_points += batch.len as u64;
            }
        }
        file.write_at(COUNT_AT, &n_points.to_le_bytes())?;
        Ok(lost)
    }
}

/// How many points can be read: as many as the file announces, where it has room for them.
fn count(file: &FileSource, clouds: &mut CloudSink<'_>) -> Result<u64> {
    let head = file.bytes_at(0, POINTS_AT)?;
    let Some(announced) = head.strip_prefix(FIRST_LINE) else {
        return Err(Error::new(format!(
            "expected a first line `points {{ending}} 1`, found \"{}\"",
            head.escape_ascii()
        )));
    };
    // A number in a file may be any: what follows from it is held against the file's length first.
    let announced = u64::from_le_bytes(announced.try_into()?);
    let rest = file.length().saturating_sub(POINTS_AT);
    let there = rest / POINT_LEN as u64;
    if announced > there {
        clouds.warn(&format!(
            "{announced} points are announced, {there} are there: the file is cut short"
        ));
    } else if rest > announced * POINT_LEN as u64 {
        clouds.warn("the bytes behind the last point were left out");
    }
    Ok(announced.min(there))
}

/// The points of a batch as a file has them.
fn pack(batch: &CloudView<'_>, bytes: &mut Vec<u8>) -> Result<()> {
    bytes.clear();
    if batch.len == 0 {
        return Ok(()); // The last batch may have nothing but triangles.
    }
    let Some(Values::F64(places)) = batch.column(POSITION).map(|column| column.values) else {
        return Err(Error::new(
            "expected a column `position` of f64, found none",
        ));
    };
    // Colours of any type come as linear ones, and as grey where there are none.
    for (place, albedo) in places.chunks_exact(3).zip(batch.albedos()) {
        for number in place {
            bytes.extend(number.to_le_bytes());
        }
        let encoded = |linear| (255.0 * linear_to_srgb(linear)).round() as u8;
        bytes.extend(albedo.to_array().map(encoded));
    }
    Ok(())
}

/// What such a file cannot hold of a cloud, in lines for people.
fn what_is_lost(header: &CloudHeader) -> Vec<String> {
    let mut lines = Vec::new();
    for column in &header.columns {
        match (column.name.as_str(), column.element) {
            (POSITION, _) | (COLOR, Element::U8) => {}
            (COLOR, _) => lines.push("colours were rounded to 8 bits".to_owned()),
            (name, _) => lines.push(format!("`{name}` was left out")),
        }
    }
    if header.column(COLOR).is_none() {
        lines.push("there are no colours: all points are grey".to_owned());
    }
    // Units, scanners, triangles: what such a file has a place for would be `true` here.
    lines.extend(header.left_out("{{Name}}", HeaderSupport::default()));
    lines
}

export_plugin! { id: "{{package}}",{{minor}} formats: [{{Name}}] }

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_api::format::Collected;
    use surfelshop_api::job::JobHost;
    use surfelshop_api::tool::EditHeader;

    /// A host that waits.
    struct Waiting;

    impl JobHost for Waiting {
        fn progress(&self, fraction: f64, _message: &str) {
            assert!((0.0..=1.0).contains(&fraction), "{fraction}");
        }

        fn cancelled(&self) -> bool {
            false
        }

        fn stage(&self, _header: &EditHeader, _values: &[&[u8]]) -> Result<()> {
            Err(Error::new("formats stage nothing"))
        }
    }

    /// What is read of these bytes: all columns, or only those that are named.
    fn read(bytes: Vec<u8>, columns: Option<&[String]>) -> Result<Collected> {
        let file = FileSource::of_bytes(bytes, "scan.{{ending}}");
        let mut collected = Collected::default();
        let mut clouds = CloudSink::new(&mut collected, columns);
        let settings = Settings { up: Up::Z };
        {{Name}}.read(&file, &settings, &mut clouds, &Job::new(&Waiting))?;
        Ok(collected)
    }

    /// A file of two points.
    fn file() -> Vec<u8> {
        let point = |place: [f64; 3], color: [u8; 3]| {
            [place.map(f64::to_le_bytes).concat(), color.to_vec()].concat()
        };
        let points = [
            point([1.5, -2.0, 7e6], [255, 128, 0]),
            point([0.0, 0.25, -1.0], [1, 2, 3]),
        ];
        [FIRST_LINE, &2u64.to_le_bytes(), &points.concat()].concat()
    }

    #[test]
    fn places_and_colours_are_those_of_the_file() {
        let found = read(file(), None).unwrap();
        let cloud = &found.clouds[0];
        assert_eq!(cloud.columns[0], [1.5, -2.0, 7e6, 0.0, 0.25, -1.0]);
        assert_eq!(cloud.columns[1], [255.0, 128.0, 0.0, 1.0, 2.0, 3.0]);
        assert_eq!((cloud.header.rows, cloud.header.up), (Some(2), UpAxis::Z));
        assert!(found.warnings.is_empty(), "{:?}", found.warnings);
    }

    #[test]
    fn columns_that_nobody_wants_are_left_out() {
        let found = read(file(), Some(&[POSITION.to_owned()])).unwrap();
        assert_eq!(found.clouds[0].header.columns.len(), 1);
        assert_eq!(found.clouds[0].columns[0].len(), 6);
    }

    #[test]
    fn a_file_that_is_cut_short_or_goes_on_is_warned_of() {
        let mut bytes = file();
        bytes.push(0);
        let found = read(bytes.clone(), None).unwrap();
        assert!(found.warnings[0].contains("behind the last point"));
        bytes.truncate(bytes.len() - 10);
        let found = read(bytes.clone(), None).unwrap();
        assert_eq!(found.clouds[0].columns[0].len(), 3);
        assert!(found.warnings[0].contains("2 points are announced, 1 are there"));
        // A number that no file has room for takes no memory and no time.
        bytes[COUNT_AT as usize..][..8].copy_from_slice(&[255; 8]);
        assert_eq!(read(bytes, None).unwrap().clouds[0].header.rows, Some(1));
    }

    #[test]
    fn what_is_no_such_file_is_refused_in_a_line() {
        let line = read(b"solid cube\n".repeat(5), None).unwrap_err();
        assert!(line.message().contains("expected a first line"), "{line}");
        let line = read(FIRST_LINE.to_vec(), None).unwrap_err();
        assert!(line.message().contains("cut short"), "{line}");
    }
}
