//! Runs the tool over a cloud and takes its column.

use crate::measure::cpu_seconds;
use crate::recording_host::RecordingHost;
use std::time::Instant;
use surfelshop_ambient_occlusion::SurfelshopPackage;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::{CloudView, HostInfo};
use surfelshop_runtime::boundary::{Fault, Plugin};

/// A column `ao` and what it cost.
#[derive(Clone, Debug)]
pub struct Baked {
    /// Accessibility of each surfel.
    pub ao: Vec<f32>,
    /// User and system time of all threads, seconds.
    pub cpu: f64,
    /// Elapsed time, seconds.
    pub wall: f64,
    /// The messages in their order.
    pub messages: Vec<String>,
}

/// Bakes with these settings.
///
/// # Errors
/// The tool's own.
///
/// # Panics
/// Never: no thread of the job panics with a lock in its hands.
pub fn bake(cloud: &CloudView<'_>, values: &Values) -> Result<Baked, Fault> {
    let desk = RecordingHost::default();
    let mut tool = Plugin::of::<SurfelshopPackage>().create(0, &HostInfo::default())?;
    let (started, before) = (Instant::now(), cpu_seconds());
    tool.run(values, cloud, &desk)?;
    let (cpu, wall) = (cpu_seconds() - before, started.elapsed().as_secs_f64());
    let staged = desk.staged.into_inner().expect("no thread panics");
    let bytes = staged.iter().flat_map(|(_, columns)| columns).flat_map(|c| c.as_chunks::<4>().0);
    let ao = bytes.map(|bytes| f32::from_le_bytes(*bytes)).collect();
    let messages = desk.messages.into_inner().expect("no thread panics");
    Ok(Baked { ao, cpu, wall, messages: messages.into_iter().map(|(_, m)| m).collect() })
}

/// Settings from text such as `method=rays rays=64`.
///
/// # Panics
/// Where a word is no pair.
#[must_use]
pub fn values(text: &str) -> Values {
    let pair = |word: &str| {
        let (id, value) = word.split_once('=').expect("words like id=value");
        let value = match (value.parse::<i64>(), value.parse::<f64>(), value.parse::<bool>()) {
            (Ok(number), ..) => Value::Int(number),
            (_, Ok(number), _) => Value::Float(number),
            (.., Ok(flag)) => Value::Bool(flag),
            _ => Value::Text(value.to_owned()),
        };
        (id.to_owned(), value)
    };
    text.split_whitespace().map(pair).collect()
}
