//! Gaussian splats of trained radiance fields, in the form that the host gives them. Nothing of them is estimated:
//! each splat says by itself what it looks like.

mod lanes;
mod plan;
mod shape;
mod trained;

use super::position::Positions;
use super::shape::{Shape, report};
use crate::cloud::buffer::Buffer;
use crate::cloud::column::Column;
use crate::error::ReadFault;
use crate::memory::with_room;
use crate::options::ReadOptions;
use crate::summary::Summary;
use crate::table::Table;
use glam::{DQuat, Quat};
use lanes::{FileColumns, values};
use plan::Plan;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};
use surfelshop_api::columns::{COLOR, OPACITY, SH, SPLAT_ROTATION, SPLAT_SCALE, Values};
use surfelshop_geometry::Progress;

pub(crate) use plan::{are_splats, may_be_splats, woven};
pub(crate) use trained::TrainedSplats;

/// The largest scale of a splat: f32 holds its square. Larger ones, also those that overflow, become this.
const MAX_SCALE: f32 = 1e18;

/// The scale of a splat whose own scales are no numbers; it is not seen.
const NO_SCALE: f32 = 1e-20;

/// Bytes a splat for what is derived: normal, radius, tangents, colour, and marks.
pub(super) const DERIVED: u64 = 48;

/// The value of the spherical harmonic of order 0.
const Y0: f32 = 0.282_094_79;

/// Splats that are worked on together.
const BLOCK: usize = 1024;

/// Squared length by which a quaternion may differ from 1 and keep its bits.
const UNIT_TOLERANCE: f64 = 1e-6;

/// What splats consist of, besides their positions.
pub(super) struct Gaussians {
    opacity: Vec<f32>,
    /// Two or three of each splat.
    scales: Vec<f32>,
    n_scales: usize,
    /// x, y, z, w of each splat.
    rotations: Vec<f32>,
    /// Of each order from 0 on the coefficients of each splat.
    harmonics: Vec<Vec<f32>>,
}

/// What was wrong with splats, counted on all threads.
#[derive(Default)]
struct Damage {
    rotations: AtomicUsize,
    splats: AtomicUsize,
    scales: AtomicUsize,
    opacities: AtomicUsize,
}

impl Damage {
    fn tell(self, warnings: &mut Vec<String>) {
        let mut tell = |n: AtomicUsize, line: &str| match n.into_inner() {
            0 => {}
            n => warnings.push(format!("{n} {line}")),
        };
        tell(self.rotations, "rotations of splats were zero or not finite and became the identity");
        tell(
            self.splats,
            "splats have scales, opacities or harmonics that are no numbers; they got opacity 0",
        );
        tell(self.scales, "scales of splats exceeded 1e18 and became that");
        tell(self.opacities, "opacities of splats were outside [0, 1]");
    }
}

/// Counts one more.
fn count(n: &AtomicUsize) {
    n.fetch_add(1, Ordering::Relaxed);
}

/// Takes Gaussian splats out of the table; `None`, and nothing taken, where it holds none.
///
/// # Errors
/// Where memory runs out or `progress` asks to stop.
pub(super) fn take(
    table: &mut Table,
    options: &ReadOptions<'_>,
    summary: &mut Summary,
) -> Result<Option<Gaussians>, ReadFault> {
    let Some(plan) = Plan::find(&table.fields, &mut summary.warnings) else { return Ok(None) };
    let damage = Damage::default();
    let n_rows = table.n_rows;
    let given = FileColumns::Own(&mut table.fields);
    let found = Gaussians::of(&plan, given, n_rows, &damage, options.progress)?;
    damage.tell(&mut summary.warnings);
    plan.remove_from(table);
    Ok(Some(found))
}

/// Values of a field, and how many of each splat.
type FileValues<'a> = (Values<'a>, usize);

impl Gaussians {
    /// The splats of so many rows, from all the fields that a plan was made for. What is taken of them is empty then.
    fn of(
        plan: &Plan,
        mut given: FileColumns<'_>,
        n: usize,
        damage: &Damage,
        progress: Progress<'_>,
    ) -> Result<Self, ReadFault> {
        let out = |out| ReadFault::memory(n)(out);
        let mut marks: Vec<bool> = with_room(n).map_err(out)?;
        marks.resize(n, false);
        let (marks, given) = (&mut marks[..], &mut given);
        let mut harmonics = Vec::with_capacity(plan.harmonics.len());
        for (order, lanes) in plan.harmonics.iter().enumerate() {
            report(progress, 0.15 * order as f64)?;
            let coefficients = match order {
                0 => values(given, lanes, marks, finite_harmonics::<3>),
                1 => values(given, lanes, marks, finite_harmonics::<9>),
                2 => values(given, lanes, marks, finite_harmonics::<15>),
                _ => values(given, lanes, marks, finite_harmonics::<21>),
            };
            harmonics.push(coefficients.map_err(out)?);
        }
        report(progress, 0.6)?;
        let (is_raw, n_scales) = (plan.is_raw, plan.scales.len());
        let scales = match n_scales {
            2 => values(given, &plan.scales, marks, |rows: &mut [[f32; 2]], marks| {
                finite_scales(rows, is_raw, marks, damage);
            }),
            _ => values(given, &plan.scales, marks, |rows: &mut [[f32; 3]], marks| {
                finite_scales(rows, is_raw, marks, damage);
            }),
        };
        let scales = scales.map_err(out)?;
        let opacity = values(given, &[plan.opacity], marks, |rows: &mut [[f32; 1]], marks| {
            for ([opacity], mark) in rows.iter_mut().zip(marks) {
                *opacity = finite_opacity(*opacity, is_raw, *mark, damage);
            }
        });
        let opacity = opacity.map_err(out)?;
        let rotations = values(given, &plan.rotation, marks, |rows: &mut [[f32; 4]], _| {
            rows.iter_mut().for_each(|q| *q = unit_rotation(*q, damage));
        });
        let rotations = rotations.map_err(out)?;
        Ok(Self { opacity, scales, n_scales, rotations, harmonics })
    }

    fn rotation(&self, splat: usize) -> Quat {
        self.rotations
            .as_chunks::<4>()
            .0
            .get(splat)
            .map_or(Quat::IDENTITY, |q| Quat::from_array(*q))
    }

    /// Normals, radii and tangents, from the splats where the file does not have them.
    pub(super) fn shape(
        &self,
        table: &mut Table,
        placed: &Positions,
        summary: &mut Summary,
    ) -> Shape {
        shape::take(self, table, placed, summary)
    }

    /// What the splats look like from all around, as 8-bit codes: harmonics stand for colours as they are encoded.
    /// `None` where there are none.
    pub(super) fn color(&self, summary: &mut Summary) -> Option<Column> {
        let code = |c: f32| (255.0 * (0.5 + Y0 * c).clamp(0.0, 1.0)).round() as u8;
        let codes = self.harmonics.first()?.par_iter().with_min_len(BLOCK).map(|&c| code(c));
        summary.colors.of_splats = std::mem::take(&mut summary.colors.neutral);
        Some(Column::new(COLOR, 3, Buffer::U8(codes.collect())))
    }

    /// The columns of the splats themselves.
    pub(super) fn columns(self) -> impl Iterator<Item = Column> {
        let column =
            |(name, n, values): (&str, usize, _)| Column::new(name, n as u32, Buffer::F32(values));
        self.values().map(column)
    }

    /// Of each of these columns the name, the components and the values.
    fn values(self) -> impl Iterator<Item = (&'static str, usize, Vec<f32>)> {
        let own = [
            (OPACITY, 1, self.opacity),
            (SPLAT_SCALE, self.n_scales, self.scales),
            (SPLAT_ROTATION, 4, self.rotations),
        ];
        let orders = SH.iter().zip(self.harmonics).enumerate();
        let harmonics = orders.map(|(l, (name, c))| (*name, 3 * (2 * l + 1), c));
        own.into_iter().chain(harmonics)
    }
}

/// Coefficients, of which those are 0 that are not finite.
fn finite_harmonics<const N: usize>(rows: &mut [[f32; N]], marks: &mut [bool]) {
    // A loop without a way out looks at several numbers at a time.
    if rows.as_flattened().iter().fold(true, |all, c| all & c.is_finite()) {
        return;
    }
    for (row, mark) in rows.iter_mut().zip(marks) {
        for c in row.iter_mut().filter(|c| !c.is_finite()) {
            *mark = true;
            *c = 0.0;
        }
    }
}

/// Scales of at most [`MAX_SCALE`], from their logarithms where they are `raw`; all are tiny where one is no length.
fn finite_scales<const N: usize>(
    rows: &mut [[f32; N]],
    raw: bool,
    marks: &mut [bool],
    damage: &Damage,
) {
    // That of minus infinity is 0, which is a length; others may overflow.
    let has_length = |s: &f32| *s < f32::INFINITY && (raw || *s >= 0.0);
    for (row, mark) in rows.iter_mut().zip(marks) {
        if !row.iter().all(has_length) {
            *mark = true;
            *row = [NO_SCALE; N];
            continue;
        }
        for s in row {
            let scale = if raw { s.exp() } else { *s };
            if scale > MAX_SCALE {
                count(&damage.scales);
            }
            *s = scale.min(MAX_SCALE);
        }
    }
}

/// An opacity in [0, 1], from its logit where it is `raw`; 0 for splats that are damaged.
fn finite_opacity(given: f32, raw: bool, is_damaged: bool, damage: &Damage) -> f32 {
    if is_damaged || !given.is_finite() {
        count(&damage.splats);
        return 0.0;
    }
    let opacity = if raw { 1.0 / (1.0 + (-given).exp()) } else { given };
    if !(0.0..=1.0).contains(&opacity) {
        count(&damage.opacities);
    }
    opacity.clamp(0.0, 1.0)
}

/// A quaternion of unit length, the identity where it has no direction.
fn unit_rotation(given: [f32; 4], damage: &Damage) -> [f32; 4] {
    let [x, y, z, w] = given.map(f64::from);
    let wide = DQuat::from_xyzw(x, y, z, w);
    let squared = wide.length_squared();
    if (squared - 1.0).abs() <= UNIT_TOLERANCE {
        return given;
    }
    // Squares of any f32 are numbers in f64, and above 0 but for zero.
    if squared.is_finite() && squared > 0.0 {
        return (wide / squared.sqrt()).as_quat().to_array();
    }
    count(&damage.rotations);
    DQuat::IDENTITY.as_quat().to_array()
}
