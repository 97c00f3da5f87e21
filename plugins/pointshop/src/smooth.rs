//! # `smooth`: a filter of positions and normals
//!
//! | parameter  | type   | default  | meaning                                                       |
//! |------------|--------|----------|---------------------------------------------------------------|
//! | `mode`     | choice | `smooth` | `smooth`, or `enhance`: what smoothing would take is added    |
//! | `apply`    | choice | `both`   | `both`, `positions` or `normals`                              |
//! | `strength` | float  | 0.8      | from 0, nothing, to 1                                         |
//! | `scale`    | float  | 1.5      | width of the filter, in spacings of the surfels               |
//! | `rounds`   | int    | 5        | how often it is applied, 1 to 50                              |
//! | `crease`   | float  | 60       | surfels whose normals differ by more have little say, degrees |
//!
//! Method. Each round moves surfels along their smoothed normals towards the weighted mean of those
//! around, and then a little farther back, so that bumps go and shapes stay (λ|μ smoothing). At last all
//! are moved by one distance such that the volume between before and after is none. Weights fall off
//! with distance and angle, and count a surfel by the area it stands for. `enhance` moves surfels
//! the other way, by twice the strength, at most half the width of the filter, which sharpens what
//! is there, noise too. Tangents turn with their normals.
//!
//! Limits: surfels move along normals alone, so that samplings stay as even as they were; radii and
//! other columns stay.
//!
//! Source: Taubin, "A signal processing approach to fair surface design", SIGGRAPH 1995.
//!
//! ```text
//! surfelshop bake scan.ply -t smooth --set scale=2 --set rounds=10 -o out.ply
//! ```

use crate::search::Search;
use crate::surfels::{Surfels, finite, flat, floats, spacings};
use std::ops::Range;
use surfelshop_api::columns::{NORMAL, POSITION, TANGENT_U, TANGENT_V};
use surfelshop_api::glam::{DQuat, DVec3};
use surfelshop_api::prelude::*;

choices! {
    /// Which way the filter works.
    pub enum Mode {
        /// Bumps go.
        Smooth = "smooth",
        /// They grow.
        Enhance = "enhance",
    }
}

choices! {
    /// What is filtered.
    pub enum Apply {
        /// Positions and normals.
        Both = "both",
        /// Positions alone.
        Positions = "positions",
        /// Normals alone.
        Normals = "normals",
    }
}

params! {
    /// Settings of `smooth`.
    pub struct Settings {
        /// Take bumps away (smooth) or make them stronger (enhance).
        mode: Mode { default: Mode::Smooth },
        /// What changes: positions and normals (both), or one of them.
        apply: Apply { default: Apply::Both },
        /// How much: from 0, nothing, to 1.
        strength: f64 { default: 0.8, range: 0.0..=1.0 },
        /// Width of the filter, in spacings of the surfels.
        scale: f64 { default: 1.5, range: 0.5..=5.0, logarithmic: true },
        /// How often the filter is applied.
        rounds: u32 { default: 5, range: 1..=50, logarithmic: true },
        /// Surfels whose normals differ by more have little say: small angles preserve edges.
        crease: f64 { default: 60.0, range: 1.0..=180.0, unit: "deg" },
    }
}

/// The tool.
pub(crate) struct Smooth;

/// Frequencies below this share stay as they are: Taubin's pass band.
const PASS_BAND: f64 = 0.1;

/// Widths of the filter beyond which nobody has a say.
const REACH: f64 = 2.0;

/// Cosine of the angle between normals from which on surfels are of the back of a thin sheet.
const BACK: f64 = -0.2;

/// Most surfels that have a say: where many coincide more would say the same.
const MOST_AROUND: usize = 256;

impl Tool for Smooth {
    const INFO: UnitInfo = UnitInfo::new(
        "smooth",
        "Smooth or sharpen",
        "Filters positions and normals, and preserves the volume.",
    );
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn run(&mut self, cloud: &CloudView<'_>, params: &Settings, job: &Job<'_>) -> Result<()> {
        let strength = finite("strength", params.strength)?;
        finite("scale", params.scale)?;
        finite("crease", params.crease)?;
        let surfels = Surfels::of(cloud)?;
        job.progress(0.0, "looking for neighbours");
        let search = Search::build(&surfels.places, job)?;
        let apart = spacings(&search, &surfels.places, job, 0.02..0.1)?;
        let filter = Filter::of(&surfels, &search, &apart, params, job, 0.1..0.4)?;
        drop(search);
        job.progress(0.4, "filtering normals");
        let rounds = params.rounds.max(1) as usize;
        let step = |from: f64, to: f64, round: usize| -> Range<f64> {
            let width = (to - from) / rounds as f64;
            from + width * round as f64..from + width * (round + 1) as f64
        };
        let mut directions = surfels.normals.clone();
        for round in 0..rounds {
            directions = filter.normals(&directions, strength, job, step(0.4, 0.6, round))?;
        }
        let normals: Vec<DVec3> = match params.mode {
            Mode::Smooth => directions.clone(),
            Mode::Enhance => surfels
                .normals
                .iter()
                .zip(&directions)
                .map(|(&n, &mean)| (n + 2.0 * strength * (n - mean)).normalize_or(n))
                .collect(),
        };
        if params.apply == Apply::Normals {
            job.progress(1.0, &format!("{} normals", normals.len()));
            return stage(cloud, &surfels, None, Some(&normals), job);
        }
        job.progress(0.6, "filtering positions");
        let mut moved = vec![0.0; surfels.places.len()];
        // The second factor takes back what the first shrinks of the pass band.
        let back = -strength / (1.0 - PASS_BAND * strength);
        for round in 0..rounds {
            for (factor, half) in [(strength, 0.0), (back, 0.5)] {
                let share = step(0.6, 0.9, round);
                let middle = share.start + half * (share.end - share.start);
                let share = middle..middle + 0.5 * (share.end - share.start);
                moved =
                    filter.move_along(&surfels.places, &directions, &moved, factor, job, share)?;
            }
        }
        if params.mode == Mode::Enhance {
            for (moved, apart) in moved.iter_mut().zip(&apart) {
                let most = 0.5 * params.scale * apart;
                *moved = (-2.0 * strength * *moved).clamp(-most, most);
            }
        }
        balance(&apart, &mut moved);
        job.check()?;
        let said = statement(&moved, &apart);
        let along = |((&place, &direction), &distance)| place + distance * direction;
        let places: Vec<DVec3> =
            surfels.places.iter().zip(&directions).zip(&moved).map(along).collect();
        job.progress(1.0, &said);
        let normals = (params.apply == Apply::Both).then_some(&normals[..]);
        stage(cloud, &surfels, Some(&places), normals, job)
    }
}

/// How far surfels were moved, in words.
fn statement(moved: &[f64], apart: &[f64]) -> String {
    let shares = || moved.iter().zip(apart).map(|(m, a)| if *a > 0.0 { m.abs() / a } else { 0.0 });
    let mean = shares().sum::<f64>() / moved.len().max(1) as f64;
    let most = shares().fold(0.0, f64::max);
    format!("{} surfels moved by {mean:.3} spacings on average, at most {most:.3}", moved.len())
}

/// Moves all by one distance along their normals, so that as much volume is added as is taken.
fn balance(apart: &[f64], moved: &mut [f64]) {
    // A surfel stands for the square of its spacing.
    let weighed = apart.iter().zip(moved.iter()).map(|(apart, moved)| (apart * apart, *moved));
    let (whole, swept) = weighed
        .filter(|(area, moved)| area.is_finite() && moved.is_finite())
        .fold((0.0, 0.0), |(whole, swept), (area, moved)| (whole + area, swept + area * moved));
    if whole > 0.0 && (swept / whole).is_finite() {
        moved.iter_mut().for_each(|moved| *moved -= swept / whole);
    }
}

/// Surfels around each that have a say, row by row.
struct Filter {
    ends: Vec<usize>,
    entries: Vec<(u32, f32)>,
}

impl Filter {
    fn of(
        surfels: &Surfels,
        search: &Search,
        apart: &[f64],
        params: &Settings,
        job: &Job<'_>,
        share: Range<f64>,
    ) -> Result<Self> {
        let blunt = 1.0 - params.crease.to_radians().cos();
        let rows = job.map(surfels.places.len(), share, |i| {
            let width = params.scale * apart[i];
            let around = search.nearest(surfels.places[i], MOST_AROUND, REACH * width);
            let others = around.into_iter().filter(|found| found.index as usize != i);
            let weight = |found: crate::search::Found| {
                let j = found.index as usize;
                let cosine = surfels.normals[i].dot(surfels.normals[j]);
                let bend = (1.0 - cosine) / blunt;
                let near = (-0.5 * found.squared / (width * width)).exp();
                let area = (apart[j] / apart[i]).powi(2);
                let weight = if cosine > BACK { near * area * (-bend * bend).exp() } else { 0.0 };
                (found.index, weight as f32)
            };
            let said = others.map(weight).filter(|(_, w)| *w > 1e-6 && w.is_finite());
            said.collect::<Vec<_>>()
        })?;
        let count = rows.iter().map(Vec::len).sum();
        let mut entries = Vec::new();
        entries.try_reserve_exact(count).map_err(|_refused| {
            Error::new(format!("expected memory for {count} neighbours; choose a smaller `scale`"))
        })?;
        let mut ends = Vec::with_capacity(rows.len());
        for row in rows {
            entries.extend(row);
            ends.push(entries.len());
        }
        job.check()?;
        Ok(Self { ends, entries })
    }

    fn row(&self, i: usize) -> &[(u32, f32)] {
        let start = if i == 0 { 0 } else { self.ends[i - 1] };
        &self.entries[start..self.ends[i]]
    }

    /// Normals nearer to the mean of those around, by a share.
    fn normals(
        &self,
        normals: &[DVec3],
        share: f64,
        job: &Job<'_>,
        progress: Range<f64>,
    ) -> Result<Vec<DVec3>> {
        job.map(normals.len(), progress, |i| {
            // The surfel itself has a say of 1.
            let mut sum = normals[i];
            for &(j, weight) in self.row(i) {
                sum += f64::from(weight) * normals[j as usize];
            }
            let mean = sum.normalize_or(normals[i]);
            (normals[i] + share * (mean - normals[i])).normalize_or(normals[i])
        })
    }

    /// Distances along directions, moved towards the mean of the surfels around by a factor.
    fn move_along(
        &self,
        places: &[DVec3],
        directions: &[DVec3],
        moved: &[f64],
        factor: f64,
        job: &Job<'_>,
        progress: Range<f64>,
    ) -> Result<Vec<f64>> {
        let place = |i: usize| places[i] + moved[i] * directions[i];
        job.map(places.len(), progress, |i| {
            let (own, mut sum, mut weights) = (place(i), DVec3::ZERO, 1.0);
            for &(j, weight) in self.row(i) {
                sum += f64::from(weight) * (place(j as usize) - own);
                weights += f64::from(weight);
            }
            moved[i] + factor * (sum / weights).dot(directions[i])
        })
    }
}

/// Stages what changed, tangents turned with their normals.
fn stage(
    cloud: &CloudView<'_>,
    surfels: &Surfels,
    places: Option<&[DVec3]>,
    normals: Option<&[DVec3]>,
    job: &Job<'_>,
) -> Result<()> {
    let positions = places.map(|places| flat(places.iter().copied()));
    let flat_normals = normals.map(|normals| flat(normals.iter().copied()));
    let turned = |name: &str| -> Option<Vec<f32>> {
        let normals = normals?;
        cloud.floats(name, 3)?;
        let turns = surfels.normals.iter().zip(normals);
        let turns = turns.map(|(&from, &to)| DQuat::from_rotation_arc(from, to));
        let turned = turns.zip(cloud.vectors(name)).map(|(turn, t)| turn * t.as_dvec3());
        Some(flat(turned))
    };
    let tangents = [TANGENT_U, TANGENT_V].map(|name| (name, turned(name)));
    let mut columns = Vec::new();
    columns.extend(positions.as_deref().map(|values| floats(POSITION, 3, values)));
    columns.extend(flat_normals.as_deref().map(|values| floats(NORMAL, 3, values)));
    for (name, values) in &tangents {
        columns.extend(values.as_deref().map(|values| floats(name, 3, values)));
    }
    job.edit(&Edit::Columns(columns))
}
