//! Tests through `Format`, with files in memory.

mod damage;
mod octree;
mod reading;

use crate::Potree;
use octree::Octree;
use surfelshop_api::Format;
use surfelshop_api::format::{CloudSink, Collected, PointNode};
use surfelshop_api::job::JobHost;
use surfelshop_api::prelude::{Error, HostInfo, Job, Result};
use surfelshop_api::tool::EditHeader;

/// A host whose loops run one after the other.
struct SerialHost;

impl JobHost for SerialHost {
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

/// Reads an octree; node by node where there is a list.
fn read_nodes(octree: &Octree, nodes: Option<&[PointNode]>) -> Result<Collected> {
    let mut found = Collected::default();
    Potree::new(&HostInfo::default())?.read(
        &octree.files(),
        &(),
        &mut CloudSink::new(&mut found, None).with_nodes(nodes),
        &Job::new(&SerialHost),
    )?;
    Ok(found)
}

fn read(octree: &Octree) -> Result<Collected> {
    read_nodes(octree, None)
}

/// The line that an octree is refused with.
fn refusal(octree: &Octree) -> String {
    let line = read(octree).map(|found| found.warnings.len()).unwrap_err().to_string();
    assert!(!line.contains('\n'), "{line}");
    line
}

/// The values of a column of the only cloud.
fn column<'a>(found: &'a Collected, name: &str) -> &'a [f64] {
    assert_eq!(found.clouds.len(), 1);
    let (place, _) = found.clouds[0].header.column(name).unwrap();
    &found.clouds[0].columns[place]
}
