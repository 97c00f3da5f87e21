//! # `inflate` and `carve`: surfels moved along their normals
//!
//! | parameter | type  | default | meaning                                                       |
//! |-----------|-------|---------|---------------------------------------------------------------|
//! | `height`  | float | 0.2     | how far where the stroke is strongest, in radii of the stroke |
//!
//! Method. A surfel of weight w moves by w times the height along its normal, out or in. Its normal n becomes that of
//! the moved surface as far as the surfels around it tell: it is turned against the slope of the weights along the
//! stroke, which is found from the nearest place on it, n' = n + h |w'| t, where t points from that place to the surfel
//! within the surface and w' is the slope of the falloff.
//!
//! Limits: surfels that are pulled apart stay as large as they are; go over it with less height, or estimate radii
//! anew. The tangents of ellipses stay.

use surfelshop_api::columns::{NORMAL, POSITION};
use surfelshop_api::glam::{DVec3, Vec3};
use surfelshop_api::prelude::*;
use surfelshop_api::{Stroke, StrokeSample};

params! {
    /// Settings of `inflate` and `carve`.
    pub struct Settings {
        /// How far surfels move where the stroke is strongest, in radii of the stroke.
        height: f32 { default: 0.2, range: 0.0..=2.0 },
    }
}

/// Moves surfels out.
pub(crate) struct Inflate;
/// Moves surfels in.
pub(crate) struct Carve;

impl Tool for Inflate {
    const INFO: UnitInfo =
        UnitInfo::new("inflate", "Inflate", "Moves surfels out along their normals.");
    const HANDLING: Handling = Handling::STROKE;
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn run(&mut self, cloud: &CloudView<'_>, params: &Settings, job: &Job<'_>) -> Result<()> {
        raise(cloud, params.height, job)
    }
}

impl Tool for Carve {
    const INFO: UnitInfo = UnitInfo::new("carve", "Carve", "Moves surfels in along their normals.");
    const HANDLING: Handling = Handling::STROKE;
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn run(&mut self, cloud: &CloudView<'_>, params: &Settings, job: &Job<'_>) -> Result<()> {
        raise(cloud, -params.height, job)
    }
}

/// Moves surfels by so many radii of the stroke; without one, of themselves.
fn raise(cloud: &CloudView<'_>, height: f32, job: &Job<'_>) -> Result<()> {
    let Some(normals) = cloud.floats(NORMAL, 3) else {
        return Err(Error::new("expected normals, found none; run the tool `normals` first"));
    };
    let stroke = job.stroke().filter(|stroke| !stroke.samples.is_empty());
    let own_radii = cloud.floats(columns::RADIUS, 1);
    let weights = cloud.weights();
    let (mut positions, mut turned) = (Vec::<f32>::new(), Vec::<f32>::new());
    for (i, place) in cloud.vectors(POSITION).enumerate() {
        let normal = Vec3::from_slice(&normals[3 * i..3 * i + 3]);
        let (unit, slope) = match stroke {
            Some(stroke) => {
                (stroke.radius as f32, slope(stroke, cloud.origin + place.as_dvec3(), normal))
            }
            None => (own_radii.map_or(0.0, |radii| radii[i]), Vec3::ZERO),
        };
        positions.extend((place + normal * (weights[i] * height * unit)).to_array());
        let steeper = normal + slope * height;
        turned.extend(steeper.normalize_or(normal).to_array());
    }
    let columns = [(POSITION, &positions), (NORMAL, &turned)].map(|(name, values)| NewColumn {
        name,
        components: 3,
        values: Values::F32(values),
    });
    job.edit(&Edit::Columns(columns.into()))
}

/// From the nearest place on a line between samples to a place.
fn away(stroke: &Stroke, place: DVec3) -> DVec3 {
    let from_line = |ends: &[StrokeSample]| {
        let (from, along) = (place - ends[0].place, ends[1].place - ends[0].place);
        let share = from.dot(along) / along.length_squared();
        // Of samples at one place there is no share.
        from - along * if share > 0.0 { share.min(1.0) } else { 0.0 }
    };
    let first = stroke.samples.first().map(|sample| place - sample.place);
    let all = first.into_iter().chain(stroke.samples.windows(2).map(from_line));
    let nearest = all.min_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
    nearest.unwrap_or_default()
}

/// How fast the weight falls at a place, in radii: along the surface, away from the stroke.
pub(crate) fn slope(stroke: &Stroke, place: DVec3, normal: Vec3) -> Vec3 {
    let away = away(stroke, place) / stroke.radius;
    let share = away.length();
    /// Of a radius: where the slope is measured.
    const STEP: f64 = 1e-3;
    let falloff = stroke.dabs.falloff;
    let fall =
        (falloff.weight((share - STEP).max(0.0)) - falloff.weight(share + STEP)) / (2.0 * STEP);
    let along = away.as_vec3().reject_from_normalized(normal.normalize_or(Vec3::Y));
    along.normalize_or_zero() * fall.clamp(0.0, 4.0) as f32
}
