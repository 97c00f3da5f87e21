//! What clouds take in memory and on the device.

use super::cells::Table;
use super::variant::Contestant;
use serde_json::json;
use surfelshop_cloud::{Cloud, Column};
use surfelshop_session::input::clouds::Clouds;

/// Bytes of a scene's clouds.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Memory {
    pub(super) of: String,
    pub(super) surfels: u64,
    pub(super) variant: String,
    /// Columns as files have them.
    pub(super) cloud_bytes: u64,
    /// Columns on the device.
    pub(super) device_bytes: u64,
    /// Columns in memory, as the CPU draws them.
    pub(super) host_bytes: u64,
}

/// What each contestant keeps of the clouds it drew last.
pub(super) fn memory(of: &str, clouds: &Clouds, contestants: &[Contestant]) -> Vec<Memory> {
    let cloud_bytes = clouds.loaded.iter().map(|loaded| bytes(&loaded.cloud)).sum();
    let each = contestants.iter().map(|Contestant { variant, studio }| {
        let counters = studio.engine.counters();
        Memory {
            of: of.to_owned(),
            surfels: clouds.facts.n_surfels,
            variant: variant.name.clone(),
            cloud_bytes,
            device_bytes: counters.column_bytes,
            host_bytes: counters.host_column_bytes,
        }
    });
    each.collect()
}

fn bytes(cloud: &Cloud) -> u64 {
    let bytes = |column: &Column| {
        let values = column.values().as_values();
        values.len() as u64 * values.element().size() as u64
    };
    cloud.columns().iter().map(bytes).sum()
}

/// The table's columns in JSON.
pub(super) const NAMES: [&str; 8] = [
    "of",
    "surfels",
    "variant",
    "device_bytes",
    "host_bytes",
    "cloud_bytes_per_surfel",
    "device_bytes_per_surfel",
    "host_bytes_per_surfel",
];

/// A row for each.
pub(super) fn table(all: &[Memory]) -> Table {
    let head: [&str; NAMES.len()] = [
        "of",
        "surfels",
        "variant",
        "device, bytes",
        "host, bytes",
        "cloud a surfel",
        "device a surfel",
        "host a surfel",
    ];
    let row = |one: &Memory| {
        let each = |bytes: u64| json!(bytes as f64 / one.surfels.max(1) as f64);
        let (device, host) = (one.device_bytes, one.host_bytes);
        let own =
            [json!(one.of), json!(one.surfels), json!(one.variant), json!(device), json!(host)];
        own.into_iter().chain([each(one.cloud_bytes), each(device), each(host)]).collect()
    };
    Table { head: head.map(str::to_owned).to_vec(), rows: all.iter().map(row).collect() }
}
