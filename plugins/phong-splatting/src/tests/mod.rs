//! Tests through `Tool::run`, with a host that keeps what is staged.

mod audit;
mod faces;
mod odd;
mod shapes;
mod smooth;

use crate::tool::{Settings, Splats};
use std::cell::{Cell, RefCell};
use std::ops::Range;
use std::thread;
use surfelshop_api::columns::{AO, COLOR, NORMAL, POSITION, RADIUS, Values};
use surfelshop_api::glam::{DVec3, Vec3};
use surfelshop_api::job::{CANCELLED, JobHost};
use surfelshop_api::prelude::*;
use surfelshop_api::tool::EditHeader;

/// A host that records messages and edits, and may ask a job to stop.
#[derive(Default)]
struct RecordingHost {
    staged: RefCell<Vec<(EditHeader, Vec<Vec<u8>>)>>,
    messages: RefCell<Vec<(f64, String)>>,
    n_checks: Cell<usize>,
    /// The question that is answered with a wish to stop; 0 for none.
    stops_at: usize,
    /// Threads beside each other in parallel loops; 0 for the loop that asks after each range.
    n_threads: usize,
}

impl JobHost for RecordingHost {
    fn progress(&self, fraction: f64, message: &str) {
        assert!((0.0..=1.0).contains(&fraction), "{fraction} {message}");
        self.messages.borrow_mut().push((fraction, message.to_owned()));
    }

    fn cancelled(&self) -> bool {
        self.n_checks.set(self.n_checks.get() + 1);
        self.stops_at > 0 && self.n_checks.get() >= self.stops_at
    }

    fn stage(&self, header: &EditHeader, values: &[&[u8]]) -> Result<()> {
        let values = values.iter().map(|bytes| bytes.to_vec()).collect();
        self.staged.borrow_mut().push((header.clone(), values));
        Ok(())
    }

    fn parallel(
        &self,
        count: usize,
        share: Range<f64>,
        work: &(dyn Fn(Range<usize>) + Sync),
    ) -> bool {
        let n = self.n_threads.max(1);
        thread::scope(|scope| {
            for first in 0..n {
                // Dealt out like cards, the last first.
                let ranges = (0..count.div_ceil(7)).rev().filter(move |number| number % n == first);
                scope.spawn(move || {
                    ranges.for_each(|number| work(number * 7..(number * 7 + 7).min(count)));
                });
            }
        });
        self.progress(share.end, "");
        !self.cancelled()
    }
}

/// A cloud and what a test gave it.
#[derive(Clone, Default)]
struct TestCloud {
    origin: DVec3,
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    radii: Vec<f32>,
    colors: Vec<u8>,
    access: Vec<f32>,
}

impl TestCloud {
    fn run(&self, settings: &Settings) -> Result<ToolOutput> {
        self.run_on(settings, 2)
    }

    fn run_on(&self, settings: &Settings, n_threads: usize) -> Result<ToolOutput> {
        let host = RecordingHost { n_threads, ..RecordingHost::default() };
        self.run_at(settings, &host)?;
        let message = host.messages.borrow().last().map(|(_, message)| message.clone());
        let message = message.unwrap_or_default();
        assert!(message.contains("splats hold all "), "{message}");
        Ok(ToolOutput { staged: host.staged.into_inner(), message })
    }

    fn run_at(&self, settings: &Settings, host: &RecordingHost) -> Result<()> {
        let (positions, normals) = (flat(&self.positions), flat(&self.normals));
        let columns = [
            (POSITION, 3, Values::F32(&positions)),
            (NORMAL, 3, Values::F32(&normals)),
            (RADIUS, 1, Values::F32(&self.radii)),
            (COLOR, 3, Values::U8(&self.colors)),
            (AO, 1, Values::F32(&self.access)),
        ];
        let columns =
            columns.into_iter().filter(|(name, _, values)| *name == POSITION || !values.is_empty());
        let columns = columns
            .map(|(name, components, values)| ColumnView {
                name,
                components,
                generation: 1,
                values,
            })
            .collect();
        let len = self.positions.len();
        let view = CloudView { origin: self.origin, len, columns, ..CloudView::default() };
        Splats::new(&HostInfo::default())?.run(&view, settings, &Job::new(host))
    }

    /// The line that a run is refused with.
    fn refusal(&self) -> String {
        let error = self.run(&Settings::default()).map(|ran| ran.message).unwrap_err().to_string();
        assert!(!error.contains('\n') && error.starts_with("expected"), "{error}");
        error
    }

    /// A tolerance in scene units as a share of the diagonal.
    fn share(&self, tolerance: f64) -> f64 {
        tolerance / surfelshop_geometry::Bounds::of_positions(&self.positions).unwrap().diagonal()
    }
}

/// What a run staged.
#[derive(PartialEq)]
struct ToolOutput {
    staged: Vec<(EditHeader, Vec<Vec<u8>>)>,
    /// The last message.
    message: String,
}

impl ToolOutput {
    fn bytes(&self, name: &str) -> Option<&[u8]> {
        let [(EditHeader::NewCloud { columns, .. }, values)] = &self.staged[..] else { panic!() };
        let place = columns.iter().position(|column| column.name == name)?;
        Some(&values[place])
    }

    fn floats(&self, name: &str) -> Vec<f32> {
        let Some(bytes) = self.bytes(name) else { return Vec::new() };
        let (words, _) = bytes.as_chunks::<4>();
        words.iter().map(|word| f32::from_le_bytes(*word)).collect()
    }

    fn vectors(&self, name: &str) -> Vec<DVec3> {
        self.floats(name).chunks_exact(3).map(|c| Vec3::from_slice(c).as_dvec3()).collect()
    }
}

fn flat(vectors: &[Vec3]) -> Vec<f32> {
    vectors.iter().flat_map(|vector| vector.to_array()).collect()
}

/// Settings of a tolerance, a share of the diagonal.
fn within(tolerance: f64) -> Settings {
    Settings { tolerance, ..Settings::default() }
}
