//! Splats as trainers write them, converted batch by batch.

use super::*;
use crate::cloud::source::Source;
use crate::convert::{Collection, ConvertError, Converted, Selection, convert};
use crate::formats::plugins::{FormatCall, Formats, SharedSink, WriteFault};
use crate::formats::table_sink::TableSink;
use crate::{
    Buffer, Loaded, Progress, ReadFault, ReadOptions, WriteOptions, assemble, read, write,
};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use surfelshop_api::columns::{ColumnView, NORMAL, POSITION, Role, TANGENT_U, TANGENT_V};
use surfelshop_api::format::{CloudHeader, CloudSinkHost as _, CloudSourceHost, FileHost};
use tempfile::TempDir;

/// A format that keeps the columns it is given.
#[derive(Default)]
struct Collected(Mutex<Option<(CloudHeader, TableSink, usize)>>);

impl Formats for Collected {
    fn by_bytes(&self, _head: &[u8]) -> Option<String> {
        None
    }

    fn by_name(&self, name: &str, _written: bool) -> Option<String> {
        [".kept", ".kept.ply"].iter().any(|end| name.ends_with(end)).then(|| "kept".to_owned())
    }

    fn takes_several(&self, _id: &str) -> bool {
        false
    }

    fn endings(&self, _written: bool) -> Vec<String> {
        vec!["kept".to_owned()]
    }

    fn read(
        &self,
        _id: &str,
        _file: Arc<dyn FileHost>,
        _call: FormatCall<'_>,
        _sink: SharedSink,
        _progress: Progress<'_>,
    ) -> Result<(), ReadFault> {
        Err(ReadFault::NoClouds)
    }

    fn write(
        &self,
        _id: &str,
        mut clouds: Box<dyn CloudSourceHost + Send>,
        _file: Arc<dyn FileHost>,
        _call: FormatCall<'_>,
        _progress: Progress<'_>,
    ) -> Result<Vec<String>, WriteFault> {
        let (mut sink, mut n_batches) = (TableSink::default(), 0);
        let header = clouds.next_cloud().unwrap().unwrap();
        sink.begin(&header).unwrap();
        while let Some(batch) = clouds.next_batch().unwrap() {
            let values: Vec<_> = batch.columns.iter().map(|column| column.values).collect();
            sink.batch(&values).unwrap();
            n_batches += 1;
        }
        *self.0.lock().unwrap() = Some((header, sink, n_batches));
        Ok(Vec::new())
    }
}

#[test]
fn an_ending_that_is_longer_than_that_of_ply_is_its_format_s() {
    let formats = Collected::default();
    let options = WriteOptions { formats: &formats, ..WriteOptions::default() };
    for (name, expected) in [
        ("a.ply", None),
        ("a.b.ply", None),
        (".ply.ply", None),
        ("a.kept", Some("kept")),
        ("a.kept.ply", Some("kept")),
        ("a.b.kept.ply", Some("kept")),
    ] {
        let found = crate::writer(Path::new(name), &options).unwrap();
        assert_eq!(found.as_deref(), expected, "{name}");
    }
}

/// What came of a conversion to that format, and the number of batches.
fn kept(
    inputs: &[&Path],
    selection: &Selection,
) -> Result<(Converted, CloudHeader, Loaded, usize), ConvertError> {
    let folder = TempDir::new().unwrap();
    let formats = Collected::default();
    let writing = WriteOptions { formats: &formats, ..WriteOptions::default() };
    let (to, inputs) = (folder.path().join("out.kept"), inputs.iter().map(PathBuf::from));
    let inputs: Vec<PathBuf> = inputs.collect();
    let done = convert(&inputs, &to, selection, true, &ReadOptions::default(), &writing)?;
    let (header, sink, n_batches) = formats.0.into_inner().unwrap().unwrap();
    let (table, _) = sink.finish().unwrap();
    let loaded = assemble::cloud(table, Source::default(), &ReadOptions::default()).unwrap();
    Ok((done, header, loaded, n_batches))
}

fn stored(folder: &TempDir, name: &str, trained: &Trained, kind: &str) -> PathBuf {
    let path = folder.path().join(name);
    std::fs::write(&path, trained.ply("binary_little_endian", kind).bytes()).unwrap();
    path
}

fn names(header: &CloudHeader) -> Vec<&str> {
    header.columns.iter().map(|column| column.name.as_str()).collect()
}

/// Bit by bit, whatever the size of batches.
#[test]
fn conversions_of_trained_splats_give_other_formats_what_a_load_gives() {
    let folder = TempDir::new().unwrap();
    for (n, n_scales, order, kind) in
        [(40, 3, 3, "float"), (40, 2, 1, "double"), (70_000, 3, 0, "float")]
    {
        let trained = Trained::new(n, n_scales, order).and("class", 7.0).and("sh_0", 0.5);
        let path = stored(&folder, "in.ply", &trained, kind);
        let (done, header, found, n_batches) = kept(&[&path], &Selection::default()).unwrap();
        let expected = read(&path, &ReadOptions::default()).unwrap();
        assert!(n_batches > usize::from(n > 1000));
        let splats = [OPACITY, SPLAT_SCALE, SPLAT_ROTATION];
        let splats = splats.iter().chain(&SH[..=order]).copied();
        let all: Vec<&str> = [POSITION, "class", "sh_0_"].into_iter().chain(splats).collect();
        assert_eq!(names(&header), all);
        assert_eq!(done.columns, all);
        assert_eq!(done.warnings, expected.summary.warnings);
        for column in &header.columns {
            let [a, b] = [&expected, &found].map(|c| c.cloud.column(&column.name).unwrap());
            assert_eq!((a.values(), a.role()), (b.values(), b.role()), "{}", column.name);
            if splat_names().any(|name| name == column.name) {
                assert!(column.role != Role::Plain || column.name == OPACITY);
            }
        }
        // And so are all columns that are made of them.
        for name in [NORMAL, "radius", TANGENT_U, TANGENT_V, "color"] {
            let [a, b] = [&expected, &found].map(|c| c.cloud.column(name).unwrap());
            assert_eq!(a.values(), b.values(), "{name}");
        }
    }
}

fn splat_names() -> impl Iterator<Item = &'static str> {
    OWN.into_iter().chain(SH)
}

#[test]
fn damaged_splats_are_converted_as_they_are_loaded() {
    let folder = TempDir::new().unwrap();
    let mut trained = Trained::new(40, 3, 1);
    for (splat, name, value) in [
        (0, "rot_0", f64::NAN),
        (2, "opacity", f64::NAN),
        (4, "scale_1", f64::NAN),
        (6, "f_dc_1", f64::NAN),
        (8, "scale_0", 100.0),
    ] {
        trained.set(splat, name, value);
    }
    for i in 0..5 {
        trained = trained.and(&format!("f_rest_{}", 9 + i), 0.25);
    }
    let path = stored(&folder, "in.ply", &trained, "float");
    let (done, header, found, _) = kept(&[&path], &Selection::default()).unwrap();
    let expected = read(&path, &ReadOptions::default()).unwrap();
    assert_eq!(done.warnings, expected.summary.warnings);
    // The number of harmonics, rotations, splats and scales.
    assert_eq!(done.warnings.len(), 4, "{:?}", done.warnings);
    for column in &header.columns {
        let [a, b] = [&expected, &found].map(|c| c.cloud.column(&column.name).unwrap());
        assert_eq!(a.values(), b.values(), "{}", column.name);
    }
    assert!(header.column("f_rest_13").is_some() && header.column("sh_1").is_none());
    // Nothing is said twice of what is right by now.
    assert_eq!(found.summary.warnings, Vec::<String>::new());
}

#[test]
fn columns_of_trained_splats_are_selected_by_the_names_of_the_host() {
    let folder = TempDir::new().unwrap();
    let path = stored(&folder, "in.ply", &Trained::new(40, 3, 1), "float");
    let of = |name: &str| Selection {
        columns: Some(vec![name.to_owned()]),
        every: 3,
        ..Selection::default()
    };
    let expected = read(&path, &ReadOptions::default()).unwrap().cloud;
    for (name, n) in [(OPACITY, 1), ("sh_1", 9)] {
        let (_, header, found, _) = kept(&[&path], &of(name)).unwrap();
        assert_eq!(names(&header), [POSITION, name]);
        let all = expected.floats(name, n as u32).chunks(n).step_by(3);
        let all: Vec<f32> = all.flatten().copied().collect();
        assert_eq!(found.cloud.column(name).unwrap().values(), &Buffer::F32(all));
    }
    let error = kept(&[&path], &of("f_dc_0")).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("no cloud has a column `f_dc_0`"), "{error}");
}

/// Splats that stand in properties under the names of the host, and with those of a trainer.
#[test]
fn splats_of_both_names_come_together() {
    let folder = TempDir::new().unwrap();
    let path = stored(&folder, "in.ply", &Trained::new(40, 3, 1), "float");
    let cloud = read(&path, &ReadOptions::default()).unwrap().cloud;
    let own = folder.path().join("own.ply");
    write(&own, &cloud.without_column("sh_0"), &WriteOptions::default()).unwrap();
    let (_, header, found, _) = kept(&[&own], &Selection::default()).unwrap();
    assert!(header.column(SPLAT_SCALE).is_some(), "{:?}", names(&header));
    for name in OWN {
        assert_eq!(
            found.cloud.column(name).unwrap().values(),
            cloud.column(name).unwrap().values()
        );
    }
    let both = folder.path().join("both.ply");
    let inputs = [own, path];
    let (reading, writing) = (ReadOptions::default(), WriteOptions::default());
    convert(&inputs, &both, &Selection::default(), true, &reading, &writing).unwrap();
    let both = read(&both, &ReadOptions::default()).unwrap().cloud;
    let scales = cloud.floats(SPLAT_SCALE, 3);
    for (found, expected) in both.floats(SPLAT_SCALE, 3).iter().zip([scales, scales].concat()) {
        assert!((found - expected).abs() < 1e-5 * expected, "{found} for {expected}");
    }
}

#[test]
fn collections_have_the_columns_of_splats() {
    let folder = TempDir::new().unwrap();
    let path = stored(&folder, "in.ply", &Trained::new(40, 2, 1), "float");
    let expected = read(&path, &ReadOptions::default()).unwrap().cloud;
    let reading = ReadOptions::default();
    let collection = Collection::of(std::slice::from_ref(&path), &reading).unwrap();
    assert!(collection.are_splats() && collection.all_have("sh_1"));
    assert!(!collection.all_have("f_dc_0") && !collection.all_have(NORMAL));
    let mut found = Vec::new();
    let mut take = |batch: &surfelshop_api::CloudView<'_>| {
        let column: &ColumnView<'_> = batch.column(SPLAT_SCALE).unwrap();
        found.extend(column.values.iter_f64().map(|value| value as f32));
        Ok(())
    };
    collection.read((0, &path), &reading, &mut take).unwrap();
    assert_eq!(found, expected.floats(SPLAT_SCALE, 2));
}
