//! Tests through `Tool::run`, with a host that keeps what is staged.

mod clouds;
mod meshes;

use crate::surfels::count;
use std::cell::{Cell, RefCell};
use surfelshop_api::columns::{NORMAL, POSITION, RADIUS, Values};
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
}

/// A cloud and what a test gave it.
#[derive(Clone, Default)]
struct TestCloud {
    origin: DVec3,
    positions: Vec<f32>,
    normals: Vec<f32>,
    radii: Vec<f32>,
    colors: Vec<u8>,
    heights: Vec<f32>,
    labels: Vec<i32>,
    faces: Vec<[u32; 3]>,
}

impl TestCloud {
    fn new(positions: &[Vec3]) -> Self {
        Self { positions: flat(positions), ..Self::default() }
    }

    fn view(&self) -> CloudView<'_> {
        let columns = [
            (POSITION, 3, Values::F32(&self.positions)),
            (NORMAL, 3, Values::F32(&self.normals)),
            (RADIUS, 1, Values::F32(&self.radii)),
            ("color", 3, Values::U8(&self.colors)),
            ("height", 1, Values::F32(&self.heights)),
            ("label", 1, Values::I32(&self.labels)),
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
        let len = self.positions.len() / 3;
        CloudView { origin: self.origin, len, columns, faces: &self.faces, ..CloudView::default() }
    }
}

/// What a run staged.
struct ToolOutput {
    staged: Vec<(EditHeader, Vec<Vec<u8>>)>,
    /// The last message.
    message: String,
}

impl ToolOutput {
    /// A column of `f32`, whichever edit it is of.
    fn floats(&self, name: &str) -> Vec<f32> {
        for (header, values) in &self.staged {
            let (EditHeader::Columns(columns) | EditHeader::NewCloud { columns, .. }) = header
            else {
                continue;
            };
            if let Some(place) = columns.iter().position(|column| column.name == name) {
                let (words, _) = values[place].as_chunks::<4>();
                return words.iter().map(|word| f32::from_le_bytes(*word)).collect();
            }
        }
        panic!("no column `{name}`")
    }

    fn vectors(&self, name: &str) -> Vec<Vec3> {
        self.floats(name).chunks_exact(3).map(Vec3::from_slice).collect()
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        let EditHeader::NewCloud { columns, .. } = &self.staged[0].0 else { panic!() };
        let place = columns.iter().position(|column| column.name == name).unwrap();
        self.staged[0].1[place].clone()
    }

    fn mask(&self) -> Vec<bool> {
        let (header, values) = self.staged.last().unwrap();
        assert!(matches!(header, EditHeader::Keep));
        values[0].iter().map(|&byte| byte == 1).collect()
    }
}

/// Runs a tool to its end.
fn run<T: Tool>(given: &TestCloud, params: &T::Params) -> Result<ToolOutput> {
    let host = RecordingHost::default();
    T::new(&HostInfo::default())?.run(&given.view(), params, &Job::new(&host))?;
    let message = host.messages.borrow().last().map(|(_, message)| message.clone());
    Ok(ToolOutput { staged: host.staged.into_inner(), message: message.unwrap_or_default() })
}

/// The line that a run is refused with.
fn refusal<T: Tool>(given: &TestCloud, params: &T::Params) -> String {
    let error = run::<T>(given, params).map(|ran| ran.message).unwrap_err().to_string();
    assert!(!error.contains('\n') && error.starts_with("expected"), "{error}");
    error
}

/// Stops a run at every question it asks, until there are no more, and holds that it stages
/// nothing then and tells of progress that only rises.
fn stops_everywhere<T: Tool>(given: &TestCloud, params: &T::Params) {
    for stops_at in 1.. {
        let host = RecordingHost { stops_at, ..RecordingHost::default() };
        let mut tool = T::new(&HostInfo::default()).unwrap();
        let result = tool.run(&given.view(), params, &Job::new(&host));
        if host.n_checks.get() < stops_at {
            result.unwrap();
            assert!(!host.staged.borrow().is_empty());
            let messages = host.messages.borrow();
            assert!(messages.windows(2).all(|pair| pair[0].0 <= pair[1].0 + 1e-12), "{messages:?}");
            assert_eq!(messages.last().map(|(fraction, _)| *fraction), Some(1.0));
            assert!(stops_at > 1, "{stops_at}");
            return;
        }
        assert_eq!(result.unwrap_err().message(), CANCELLED);
        assert!(host.staged.borrow().is_empty(), "stopped at {stops_at}");
    }
}

fn flat(vectors: &[Vec3]) -> Vec<f32> {
    vectors.iter().flat_map(|vector| vector.to_array()).collect()
}

/// Points on a spiral over the unit sphere.
fn sphere(n: u32) -> Vec<Vec3> {
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let point = |i: u32| {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(n);
        let (angle, r) = (golden * f64::from(i), (1.0 - z * z).sqrt());
        DVec3::new(r * angle.cos(), r * angle.sin(), z).as_vec3()
    };
    (0..n).map(point).collect()
}

/// Clouds that have nothing, one point, copies of one, and points that are not finite.
fn odd_clouds() -> Vec<TestCloud> {
    let sets = [
        vec![Vec3::ONE],
        vec![Vec3::ONE; 40],
        vec![Vec3::ZERO, Vec3::X],
        vec![Vec3::NAN, Vec3::INFINITY, Vec3::ZERO, Vec3::X, Vec3::Y],
    ];
    sets.iter()
        .map(|positions| TestCloud {
            normals: flat(&vec![Vec3::Z; positions.len()]),
            radii: vec![0.1; positions.len()],
            ..TestCloud::new(positions)
        })
        .collect()
}
