//! Some of a cloud's surfels, for a tool to work on, and what it makes of them put back.

use crate::cloud::Cloud;
use crate::cloud::buffer::Buffer;
use crate::cloud::column::Column;
use crate::cloud::edit::EditedCloud;
use crate::cloud::patch::enlarged;
use crate::cloud::provenance::{CloudEdit, How, ToolRun};
use crate::cloud::selection::{Selection, SurfelRuns};
use crate::error::CloudError;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use surfelshop_api::columns::WEIGHT;
use surfelshop_api::{Reach, Stroke};

/// Most samples of a stroke, and most dabs.
const MOST_SAMPLES: usize = 1 << 20;

/// Cosine of the angle between normals from which on surfels face a dab less: of 75 degrees.
const FADING: f32 = 0.258_819;

/// Surfels that are looked at by a thread at a time.
const BLOCK: usize = 1 << 13;

/// Some of a cloud's surfels.
#[derive(Clone, Debug)]
pub struct CloudPart {
    /// The surfels alone; of a stroke with their weights.
    pub cloud: Cloud,
    /// Where they are in the whole cloud, ascending.
    pub rows: Arc<[u32]>,
    whole: Cloud,
    is_stroke: bool,
    /// Whether some along the stroke are left out, since others are selected or they are hidden.
    is_restricted: bool,
}

/// A sphere of a stroke, around a place in a cloud's own coordinates.
struct Dab {
    place: DVec3,
    normal: Vec3,
    pressure: f64,
}

/// What a run is noted with besides its parameters, where a stroke left surfels near it out: which it concerned, as
/// [`SurfelRuns`].
pub const AMONG_NOTE: &str = "stroke.among";

impl CloudPart {
    /// What is selected.
    ///
    /// # Errors
    /// Where nothing is, the selection is of another cloud, or there is no memory.
    pub fn selected(whole: &Cloud, selection: &Selection) -> Result<Self, CloudError> {
        let wrong = |found: String| CloudError::Edit {
            expected: format!("a selection of some of {} surfels", whole.len()),
            found,
        };
        if selection.len() != whole.len() {
            return Err(wrong(format!("one of {}", selection.len())));
        }
        let rows: Vec<u32> = selection.indices().filter_map(|i| u32::try_from(i).ok()).collect();
        if rows.is_empty() {
            return Err(wrong("none".to_owned()));
        }
        Self::of(whole, rows.into(), None)
    }

    /// All surfels, each with a weight of 1, for a tool that is handled.
    ///
    /// # Errors
    /// Where there is no memory.
    pub fn all(whole: &Cloud) -> Result<Self, CloudError> {
        let n = u32::try_from(whole.len()).map_err(|_more| CloudError::Stroke {
            expected: "at most 4294967295 surfels".to_owned(),
            found: whole.len().to_string(),
        })?;
        Self::of(whole, (0..n).collect(), Some(vec![1.0; whole.len()]))
    }

    /// The surfels along a stroke, of those that are selected where some are. None may be: strokes go beside clouds.
    ///
    /// A surfel's weight is the largest that a dab gives it, by the distance of its centre, the pressure, and where only
    /// those that face a side are concerned, by how far it is turned away. What comes
    /// of it depends on the cloud and the stroke alone.
    ///
    /// # Errors
    /// Where the stroke cannot be followed, or there is no memory.
    pub fn along(
        whole: &Cloud,
        stroke: &Stroke,
        within: Option<&Selection>,
    ) -> Result<Self, CloudError> {
        let dabs = dabs(stroke, whole.origin())?;
        let reach = DVec3::splat(stroke.radius);
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for dab in &dabs {
            (low, high) = (low.min(dab.place - reach), high.max(dab.place + reach));
        }
        let (positions, normals) = (whole.positions(), whole.normals());
        let faces_a_side = stroke.dabs.reach == Reach::Facing;
        let weight = |i: usize| {
            let at = positions[i].as_dvec3();
            if !(at.cmpge(low).all() && at.cmple(high).all()) {
                return 0.0;
            }
            let normal = normals.get(i).copied().unwrap_or_default();
            let of = |dab: &Dab| {
                let share = at.distance(dab.place) / stroke.radius;
                let facing = if faces_a_side { facing(normal, dab.normal) } else { 1.0 };
                stroke.dabs.falloff.weight(share) * dab.pressure * facing
            };
            dabs.iter().map(of).fold(0.0, f64::max) as f32
        };
        let is_within = |i: usize| within.is_none_or(|selection| selection.contains(i));
        let leaves_out = AtomicBool::new(false);
        let block = |start: usize| -> Vec<(u32, f32)> {
            let range = start..(start + BLOCK).min(whole.len());
            let found = range.map(|i| (i, weight(i))).filter(|(_, weight)| *weight > 0.0);
            let (inside, outside): (Vec<_>, Vec<_>) = found.partition(|(i, _)| is_within(*i));
            if !outside.is_empty() {
                leaves_out.store(true, Ordering::Relaxed);
            }
            inside.into_iter().map(|(i, weight)| (i as u32, weight)).collect()
        };
        let blocks: Vec<Vec<(u32, f32)>> =
            (0..whole.len().div_ceil(BLOCK)).into_par_iter().map(|i| block(i * BLOCK)).collect();
        let (rows, weights): (Vec<u32>, Vec<f32>) = blocks.into_iter().flatten().unzip();
        let part = Self::of(whole, rows.into(), Some(weights))?;
        Ok(Self { is_restricted: leaves_out.into_inner(), ..part })
    }

    /// The surfels that a stroke concerned, where it left others near it out.
    #[must_use]
    pub fn restriction(&self) -> Option<SurfelRuns> {
        let rows = || self.rows.iter().map(|row| *row as usize);
        self.is_restricted.then(|| SurfelRuns::of_rows(self.whole.len(), rows()))
    }

    fn of(whole: &Cloud, rows: Arc<[u32]>, weights: Option<Vec<f32>>) -> Result<Self, CloudError> {
        let columns = whole.columns().iter().filter(|column| column.name() != WEIGHT);
        let columns = columns.map(|column| column.gather(&rows)).collect::<Result<Vec<_>, _>>();
        let mut columns = columns.map_err(CloudError::Memory)?;
        let is_stroke = weights.is_some();
        columns.extend(weights.map(|weights| Column::new(WEIGHT, 1, Buffer::F32(weights))));
        let cloud = whole.with_rows(columns, rows.len(), Vec::new()).with_history(Vec::new());
        Ok(Self { cloud, rows, whole: whole.clone(), is_stroke, is_restricted: false })
    }

    /// The whole cloud.
    #[must_use]
    pub fn whole(&self) -> &Cloud {
        &self.whole
    }

    /// What a tool made of the part, put into the whole cloud. Values go where the surfels were, those that are gone are
    /// taken out, and new ones come behind all others.
    ///
    /// # Errors
    /// Where it made a cloud of its own or a column of another type than the whole cloud has, or there is no memory.
    pub fn put_back(&self, edited: &EditedCloud, made: ToolRun) -> Result<EditedCloud, CloudError> {
        if edited.whole == Some(How::Derived) {
            let expected = "values, removals or new surfels of some of a cloud".to_owned();
            return Err(CloudError::Edit { expected, found: "a cloud of its own".to_owned() });
        }
        // Which surfels it concerned is said once, by the cloud's history.
        let of_columns = Arc::new(made.without(AMONG_NOTE));
        let made = Arc::new(made);
        let left: Vec<u32> = match &edited.kept {
            Some(kept) => {
                let stays = self.rows.iter().zip(kept).filter(|(_, stays)| **stays);
                stays.map(|(row, _)| *row).collect()
            }
            None => self.rows.to_vec(),
        };
        let mut columns = Vec::new();
        for name in edited.columns.iter().filter(|name| *name != WEIGHT) {
            let Some(new) = edited.cloud.column(name) else { continue };
            let before = match self.whole.column(name) {
                Some(before) => before.clone(),
                None => new.unsaid(self.whole.len())?,
            };
            let patched = before.patched(&left, &self.first_rows(new, left.len())?)?;
            let is_other = patched.generation() != before.generation();
            if is_other || self.whole.column(name).is_none() {
                columns.push(patched.made_by(Some(of_columns.clone())));
            }
        }
        let names = columns.iter().map(|column| column.name().to_owned()).collect();
        let mut cloud = self.whole.with_columns(columns)?;
        let mut kept = None;
        if left.len() < self.rows.len() {
            let mut mask = vec![true; self.whole.len()];
            self.rows.iter().for_each(|row| mask[*row as usize] = false);
            left.iter().for_each(|row| mask[*row as usize] = true);
            cloud = cloud.keep(&mask)?;
            kept = Some(mask);
        }
        if edited.n_added > 0 {
            let rows: Vec<u32> = (left.len()..edited.cloud.len()).map(|row| row as u32).collect();
            let longer = |column: &Column| match edited.cloud.column(column.name()) {
                Some(new) => column.followed_by(&new.gather(&rows).map_err(CloudError::Memory)?),
                None => column.followed_by(&column.unsaid(rows.len())?),
            };
            let columns = cloud.columns().iter().map(longer).collect::<Result<_, _>>()?;
            cloud = enlarged(&cloud, columns)?;
        }
        let mut history = self.whole.history().to_vec();
        let how = match (self.is_stroke, edited.whole) {
            (true, _) => Some(How::Stroked),
            (false, whole) => whole,
        };
        history.extend(how.map(|how| CloudEdit {
            how,
            n_surfels: if self.is_stroke { self.rows.len() } else { cloud.len() } as u64,
            n_before: self.whole.len() as u64,
            made,
        }));
        let cloud = cloud.with_history(history);
        Ok(EditedCloud { cloud, columns: names, whole: how, kept, n_added: edited.n_added })
    }

    /// A column of the part without what was added to it.
    fn first_rows(&self, column: &Column, n: usize) -> Result<Column, CloudError> {
        if column.values().len() == n * column.components() as usize {
            return Ok(column.clone());
        }
        let rows: Vec<u32> = (0..n as u32).collect();
        column.gather(&rows).map_err(CloudError::Memory)
    }
}

/// How much a surfel faces where a dab's normal points: all of it up to 75 degrees, and from there less, to nothing at a
/// right angle. Normals of scans are off by some degrees, and a wall beside the stroke would be speckled by a bound. Where
/// one of both has no direction all of it does.
fn facing(normal: Vec3, dab: Vec3) -> f64 {
    let lengths = normal.length() * dab.length();
    if lengths > 0.0 { f64::from(normal.dot(dab) / lengths / FADING).clamp(0.0, 1.0) } else { 1.0 }
}

/// The dabs of a stroke: at its first sample, and from there on along the lines between samples, always equally far
/// apart.
fn dabs(stroke: &Stroke, origin: DVec3) -> Result<Vec<Dab>, CloudError> {
    let wrong = |expected: &str, found: String| {
        Err(CloudError::Stroke { expected: expected.to_owned(), found })
    };
    let Stroke { radius, dabs: chosen, samples } = stroke;
    if !(radius.is_finite() && *radius > 0.0) {
        return wrong("a radius above 0", radius.to_string());
    }
    let spacing = f64::from(chosen.spacing);
    if !(0.01..=10.0).contains(&spacing) {
        return wrong("a spacing of 0.01 to 10 radii", chosen.spacing.to_string());
    }
    if samples.is_empty() || samples.len() > MOST_SAMPLES {
        return wrong("1 to 1048576 samples", samples.len().to_string());
    }
    let is_sound = |i: &usize| {
        let sample = &samples[*i];
        sample.place.is_finite()
            && sample.normal.is_finite()
            && (0.0..=1.0).contains(&sample.pressure)
    };
    if let Some(bad) = (0..samples.len()).find(|i| !is_sound(i)) {
        let found = format!("sample {bad} with other numbers");
        return wrong("finite places and normals, and pressures from 0 to 1", found);
    }
    let length: f64 = samples.windows(2).map(|ends| ends[0].place.distance(ends[1].place)).sum();
    let step = spacing * radius;
    if length / step > MOST_SAMPLES as f64 {
        return wrong("at most 1048576 dabs", format!("a stroke {} radii long", length / radius));
    }
    let dab = |i: usize, share: f64| {
        let (a, b) = (&samples[i], &samples[(i + 1).min(samples.len() - 1)]);
        let normal = a.normal.lerp(b.normal, share as f32);
        let pressure =
            f64::from(a.pressure) + share * (f64::from(b.pressure) - f64::from(a.pressure));
        Dab { place: a.place.lerp(b.place, share) - origin, normal, pressure }
    };
    let mut dabs = vec![dab(0, 0.0)];
    // How far along the present line the next one is.
    let mut next = step;
    for i in 0..samples.len() - 1 {
        let length = samples[i].place.distance(samples[i + 1].place);
        while next <= length && length > 0.0 {
            dabs.push(dab(i, next / length));
            next += step;
        }
        next -= length;
    }
    Ok(dabs)
}
