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
//! Where surfels are pulled apart more than 1.25 times, by s = sqrt(1 + (h w')²), others are put between them down the slope:
//! two, or four, up to eight, a radius times s over their number apart. w' is as much flatter as w is less than what the
//! falloff alone gives: by pressure, and where the surfel faces another way.
//!
//! Limits: each stroke over a slope puts others between anew. Along a ridge that is bent surfels are pulled apart, too, which
//! is not seen. The tangents of ellipses stay. Without a stroke, and in clouds without radii, nothing is put between.

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
    let mut between = Between::default();
    for (i, place) in cloud.vectors(POSITION).enumerate() {
        let normal = Vec3::from_slice(&normals[3 * i..3 * i + 3]);
        let (unit, slope) = match stroke {
            Some(stroke) => {
                let away = away(stroke, cloud.origin + place.as_dvec3());
                // Pressure, and how the surfel faces the stroke, make it flatter.
                let full = stroke.dabs.falloff.weight(away.length()) as f32;
                let part = if full > 0.0 { (weights[i] / full).min(1.0) } else { 0.0 };
                (stroke.radius as f32, slope(stroke, away, normal) * part)
            }
            None => (own_radii.map_or(0.0, |radii| radii[i]), Vec3::ZERO),
        };
        let moved = place + normal * (weights[i] * height * unit);
        let steeper = normal + slope * height;
        let now = steeper.normalize_or(normal);
        if let (Some(radii), Some(_)) = (own_radii, stroke) {
            between.put(i as u32, moved, now, (slope * height, normal, radii[i]));
        }
        positions.extend(moved.to_array());
        turned.extend(now.to_array());
    }
    job.edit(&Edit::Columns(columns_of(&positions, &turned)))?;
    if between.like.is_empty() {
        return Ok(());
    }
    let columns = columns_of(&between.positions, &between.normals);
    job.edit(&Edit::Add { like: &between.like, columns })
}

fn columns_of<'a>(positions: &'a [f32], normals: &'a [f32]) -> Vec<NewColumn<'a>> {
    let column = |(name, values)| NewColumn { name, components: 3, values: Values::F32(values) };
    [(POSITION, positions), (NORMAL, normals)].map(column).into()
}

/// Surfels between those that are pulled apart.
#[derive(Default)]
struct Between {
    like: Vec<u32>,
    positions: Vec<f32>,
    normals: Vec<f32>,
}

/// How many times farther apart surfels are before others are put between them: discs overlap so much at least, where radii
/// were estimated.
const PULLED_APART: f32 = 1.25;

impl Between {
    /// Puts some beside a surfel that was moved, up and down a slope: what is lost of the height in a radius of the way, in
    /// the direction in which it is lost.
    fn put(
        &mut self,
        like: u32,
        place: Vec3,
        now: Vec3,
        (slope, normal, radius): (Vec3, Vec3, f32),
    ) {
        let steepness = slope.length();
        let stretch = steepness.hypot(1.0);
        if stretch <= PULLED_APART || !stretch.is_finite() || radius <= 0.0 {
            return;
        }
        // An odd number, as the surfel itself stays where it is.
        let n = 2 * (0.5 * stretch).ceil().clamp(1.0, 4.0) as i16 + 1;
        let downwards = (slope / steepness - normal * steepness) / stretch;
        for k in (-n / 2..=n / 2).filter(|k| *k != 0) {
            let off = downwards * (f32::from(k) * radius * stretch / f32::from(n));
            self.like.push(like);
            self.positions.extend((place + off).to_array());
            self.normals.extend(now.to_array());
        }
    }
}

/// From the nearest place on a line between samples to a place, in radii.
pub(crate) fn away(stroke: &Stroke, place: DVec3) -> DVec3 {
    let from_line = |ends: &[StrokeSample]| {
        let (from, along) = (place - ends[0].place, ends[1].place - ends[0].place);
        let share = from.dot(along) / along.length_squared();
        // Of samples at one place there is no share.
        from - along * if share > 0.0 { share.min(1.0) } else { 0.0 }
    };
    let first = stroke.samples.first().map(|sample| place - sample.place);
    let all = first.into_iter().chain(stroke.samples.windows(2).map(from_line));
    let nearest = all.min_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
    nearest.unwrap_or_default() / stroke.radius
}

/// How fast the weight falls at a place, in radii: along the surface, away from the stroke.
pub(crate) fn slope(stroke: &Stroke, away: DVec3, normal: Vec3) -> Vec3 {
    let share = away.length();
    /// Of a radius: where the slope is measured.
    const STEP: f64 = 1e-3;
    let falloff = stroke.dabs.falloff;
    let fall =
        (falloff.weight((share - STEP).max(0.0)) - falloff.weight(share + STEP)) / (2.0 * STEP);
    let along = away.as_vec3().reject_from_normalized(normal.normalize_or(Vec3::Y));
    along.normalize_or_zero() * fall.clamp(0.0, 4.0) as f32
}
