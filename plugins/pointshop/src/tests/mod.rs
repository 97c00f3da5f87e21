//! Tests through `Tool::run`, with a host that records what is staged.

mod boolean;
mod holes;
mod maps;
mod ply;
mod register;
mod shapes;
mod smooth;
mod stamp;
mod texture;

use std::cell::{Cell, RefCell};
use surfelshop_api::Stroke;
use surfelshop_api::columns::{COLOR, NORMAL, POSITION, RADIUS, Values};
use surfelshop_api::glam::{DVec3, Vec3};
use surfelshop_api::job::{CANCELLED, JobHost};
use surfelshop_api::prelude::*;
use surfelshop_api::tool::EditHeader;
use surfelshop_geometry::hashing::{fraction, scattered};

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

/// A cloud of a test.
#[derive(Clone, Default)]
struct TestCloud {
    origin: DVec3,
    positions: Vec<f32>,
    normals: Vec<f32>,
    radii: Vec<f32>,
    colors: Vec<u8>,
    /// Further columns of floats: name, components, values.
    others: Vec<(&'static str, u32, Vec<f32>)>,
}

impl TestCloud {
    fn new(positions: &[Vec3], normals: &[Vec3], radius: f32) -> Self {
        Self {
            positions: flat(positions),
            normals: flat(normals),
            radii: vec![radius; positions.len()],
            ..Self::default()
        }
    }

    fn view(&self) -> CloudView<'_> {
        let columns = [
            (POSITION, 3, Values::F32(&self.positions)),
            (NORMAL, 3, Values::F32(&self.normals)),
            (RADIUS, 1, Values::F32(&self.radii)),
            (COLOR, 3, Values::U8(&self.colors)),
        ];
        let others = self.others.iter().map(|(name, n, values)| (*name, *n, Values::F32(values)));
        let columns = columns.into_iter().chain(others);
        let columns = columns
            .filter(|(name, _, values)| *name == POSITION || !values.is_empty())
            .map(|(name, components, values)| ColumnView {
                name,
                components,
                generation: 1,
                values,
            })
            .collect();
        let len = self.positions.len() / 3;
        CloudView { origin: self.origin, len, columns, ..CloudView::default() }
    }

    fn places(&self) -> Vec<Vec3> {
        self.positions.chunks_exact(3).map(Vec3::from_slice).collect()
    }
}

/// What a run staged.
struct ToolOutput {
    staged: Vec<(EditHeader, Vec<Vec<u8>>)>,
    /// The last message.
    message: String,
}

impl ToolOutput {
    fn names(&self) -> Vec<String> {
        assert!(!self.staged.is_empty(), "{}", self.message);
        let (EditHeader::Columns(columns) | EditHeader::NewCloud { columns, .. }) =
            &self.staged[0].0
        else {
            panic!()
        };
        columns.iter().map(|column| column.name.clone()).collect()
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        let place = self.names().iter().position(|other| other == name);
        self.staged[0].1[place.unwrap_or_else(|| panic!("no column `{name}`"))].clone()
    }

    /// A column of `f32`, whichever edit it is of.
    fn floats(&self, name: &str) -> Vec<f32> {
        let bytes = self.bytes(name);
        bytes.as_chunks::<4>().0.iter().map(|word| f32::from_le_bytes(*word)).collect()
    }

    fn vectors(&self, name: &str) -> Vec<Vec3> {
        self.floats(name).chunks_exact(3).map(Vec3::from_slice).collect()
    }
}

/// Runs a tool to its end.
fn run<T: Tool>(cloud: &TestCloud, params: &T::Params) -> Result<ToolOutput> {
    run_along::<T>(cloud, params, None)
}

/// The same along a stroke.
fn run_along<T: Tool>(
    cloud: &TestCloud,
    params: &T::Params,
    stroke: Option<&Stroke>,
) -> Result<ToolOutput> {
    let host = RecordingHost::default();
    let job = Job::new(&host);
    let job = match stroke {
        Some(stroke) => job.with_stroke(stroke),
        None => job,
    };
    T::new(&HostInfo::default())?.run(&cloud.view(), params, &job)?;
    let message = host.messages.borrow().last().map(|(_, message)| message.clone());
    Ok(ToolOutput { staged: host.staged.into_inner(), message: message.unwrap_or_default() })
}

/// The line that a run is refused with.
fn refusal<T: Tool>(cloud: &TestCloud, params: &T::Params) -> String {
    let error = run::<T>(cloud, params).map(|ran| ran.message).unwrap_err().to_string();
    assert!(!error.contains('\n') && error.contains("expected"), "{error}");
    error
}

/// Stops a run at every question it asks, until there are no more, and holds that it stages
/// nothing then and tells of progress that only rises.
fn stops_everywhere<T: Tool>(cloud: &TestCloud, params: &T::Params) {
    for stops_at in 1.. {
        let host = RecordingHost { stops_at, ..RecordingHost::default() };
        let mut tool = T::new(&HostInfo::default()).unwrap();
        let result = tool.run(&cloud.view(), params, &Job::new(&host));
        if host.n_checks.get() < stops_at {
            result.unwrap();
            let messages = host.messages.borrow();
            assert!(!host.staged.borrow().is_empty(), "{:?}", messages.last());
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

/// A sphere of surfels that cover it.
fn ball(n: u32) -> TestCloud {
    let positions = sphere(n);
    let radius = 1.3 * (4.0 * std::f32::consts::PI / n as f32).sqrt();
    TestCloud::new(&positions, &positions, 0.75 * radius)
}

/// A number in [-1, 1) that follows from `seed`.
fn noise(seed: u64) -> f64 {
    2.0 * fraction(scattered(seed)) - 1.0
}

/// Clouds that have one point, copies of one, two, and points that are not finite.
fn odd_clouds() -> Vec<TestCloud> {
    let sets = [
        vec![Vec3::ONE],
        vec![Vec3::ONE; 40],
        vec![Vec3::ZERO, Vec3::X],
        vec![Vec3::NAN, Vec3::INFINITY, Vec3::ZERO, Vec3::X, Vec3::Y],
    ];
    sets.iter().map(|set| TestCloud::new(set, &vec![Vec3::Z; set.len()], 0.1)).collect()
}
