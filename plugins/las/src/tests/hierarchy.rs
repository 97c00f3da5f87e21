//! COPC files node by node.

use super::handmade::Handmade;
use super::{Alone, column, read};
use crate::compressed::{Chunk, Chunks, Compression};
use crate::header::Header;
use crate::records::Records;
use crate::{Las, Settings};
use surfelshop_api::format::{CloudSink, Collected, FileSource, Format as _, PointNode};
use surfelshop_api::glam::DVec3;
use surfelshop_api::{HostInfo, Job, Result};

/// Entries of a page: key, offset, bytes, points.
type Entry = ([i32; 4], u64, i32, i32);

fn page(entries: &[Entry]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for (key, at, size, points) in entries {
        key.iter().for_each(|x| bytes.extend(x.to_le_bytes()));
        bytes.extend(at.to_le_bytes());
        bytes.extend(size.to_le_bytes());
        bytes.extend(points.to_le_bytes());
    }
    bytes
}

fn chunks(bytes: &[u8]) -> Vec<Chunk> {
    let file = FileSource::of_bytes(bytes.to_vec(), "a.laz");
    let header = Header::read(&file).unwrap();
    let records = Records::read(&file, &header, &mut Vec::new()).unwrap();
    let compression = Compression::new(records.laszip.as_deref(), &header).unwrap();
    let found = Chunks::find(&file, &header, &compression, &mut Vec::new(), &Job::new(&Alone));
    let Ok(Chunks::Known { chunks, .. }) = found else { panic!("{found:?}") };
    chunks
}

/// A file of three nodes of 100, 150 and 50 points, the last of them on a page of its own; `change` may spoil it.
fn copc(change: impl Fn(&mut Vec<u8>, &mut Vec<Entry>)) -> (Handmade, Vec<u8>) {
    let mut made = Handmade::new(4, 7).with_walk(300, 0);
    made.records.push(("copc", 1, vec![0; 160]));
    let mut bytes = made.usual_laz(&[100, 150, 50]);
    let nodes = chunks(&bytes);
    let second = bytes.len() as u64;
    let entry = |key: [i32; 4], i: usize| -> Entry {
        (key, nodes[i].at, nodes[i].len as i32, nodes[i].points as i32)
    };
    bytes.extend(page(&[entry([2, 3, 0, 1], 2)]));
    let first = bytes.len() as u64;
    let mut entries =
        vec![entry([0; 4], 0), entry([1, 1, 0, 0], 1), ([2, 2, 0, 0], second, 32, -1)];
    let mut info: Vec<u8> =
        [1.0f64, 2.0, 3.0, 4.0, 0.5].into_iter().flat_map(f64::to_le_bytes).collect();
    change(&mut info, &mut entries);
    bytes.extend(page(&entries));
    info.extend(first.to_le_bytes());
    info.extend((32 * entries.len() as u64).to_le_bytes());
    let name = bytes.windows(5).position(|bytes| bytes == b"copc\0").unwrap();
    // The name comes third in the head of a record, which has 54 bytes.
    let body = name - 2 + 54;
    bytes[body..body + info.len()].copy_from_slice(&info);
    (made, bytes)
}

fn nodes(bytes: Vec<u8>, wanted: &[PointNode]) -> Result<Collected> {
    let file = FileSource::of_bytes(bytes, "a.copc.laz");
    let mut collected = Collected::default();
    let mut sink = CloudSink::new(&mut collected, None).with_nodes(Some(wanted));
    let mut format = Las::new(&HostInfo::default())?;
    format.read(&file, &Settings::default(), &mut sink, &Job::new(&Alone))?;
    Ok(collected)
}

#[test]
fn nodes_are_listed_and_read_each_by_itself() {
    let (made, bytes) = copc(|_, _| ());
    let whole = read(made.las()).unwrap();
    assert!(read(bytes.clone()).unwrap().clouds[0].header.tree.is_none(), "nobody asked");
    let found = nodes(bytes.clone(), &[]).unwrap();
    assert!(found.clouds[0].columns.iter().all(Vec::is_empty));
    let tree = found.clouds[0].header.tree.clone().unwrap();
    assert_eq!((tree.low, tree.side, tree.spacing), (DVec3::new(-3.0, -2.0, -1.0), 8.0, 0.5));
    let keys: Vec<_> = tree.nodes.iter().map(|n| (n.level, n.cell, n.points)).collect();
    assert_eq!(keys, [(0, [0; 3], 100), (1, [1, 0, 0], 150), (2, [3, 0, 1], 50)]);
    let wanted = [tree.nodes[2], tree.nodes[0]];
    let found = nodes(bytes, &wanted).unwrap();
    for name in ["position", "intensity", "gps_time"] {
        let (n, all) = (column(&whole, name).len() / 300, column(&whole, name));
        let expected = [&all[250 * n..], &all[..100 * n]].concat();
        assert_eq!(column(&found, name), expected, "{name}");
    }
    assert!(found.warnings.is_empty(), "{:?}", found.warnings);
}

#[test]
fn damaged_trees_end_in_a_line() {
    let refused = |change: &dyn Fn(&mut Vec<u8>, &mut Vec<Entry>)| -> String {
        let (_, bytes) = copc(change);
        assert_eq!(
            read(bytes.clone()).unwrap().clouds[0].columns[0].len(),
            900,
            "as LAZ it is whole"
        );
        nodes(bytes, &[]).err().map(|error| error.message().to_owned()).unwrap_or_default()
    };
    let line = refused(&|info, _| info[24..32].copy_from_slice(&f64::NAN.to_le_bytes()));
    assert!(line.contains("half side"), "{line}");
    // A page that names itself, and one behind the end.
    for place in [(0, 64), (u64::MAX - 8, 32)] {
        let line = refused(&|_, entries| {
            entries[2].1 = place.0;
            entries[2].2 = place.1;
        });
        assert!(line.contains("hierarchy") || line.is_empty(), "{line}");
    }
    let line = refused(&|_, entries| entries[2].2 = 33);
    assert!(line.contains("found 33 bytes"), "{line}");
    // Cells that there are none of, and points that nobody has.
    for (change, found) in [
        (
            &(|entries: &mut Vec<Entry>| entries[1].0 = [1, 2, 0, 0]) as &dyn Fn(&mut Vec<Entry>),
            "[2, 0, 0]",
        ),
        (&|entries| entries[1].0 = [-1, 0, 0, 0], "level 4294967295"),
        (&|entries| entries[1].1 = u64::MAX, "150 points"),
        (&|entries| entries[1].3 = 10, "found one of 160"),
        (&|entries| entries[1].3 = -7, "-7 points"),
    ] {
        let line = refused(&|_, entries| change(entries));
        assert!(line.contains(found) && line.contains("as a whole"), "{line}");
    }
    let (_, bytes) = copc(|_, _| ());
    let tree = nodes(bytes.clone(), &[]).unwrap().clouds[0].header.tree.clone().unwrap();
    let far = PointNode { place: [bytes.len() as u64, 100], ..tree.nodes[0] };
    let many = PointNode { points: u64::MAX, ..tree.nodes[0] };
    for node in [far, many] {
        let line = nodes(bytes.clone(), &[node]).unwrap_err().message().to_owned();
        assert!(line.contains("expected a node of"), "{line}");
    }
}
