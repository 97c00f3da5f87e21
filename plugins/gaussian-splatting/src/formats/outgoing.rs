//! Gaussians on their way into a file, out of the columns of any cloud.

use super::{ANTIALIASED, Gaussian, MOST_REST, SH_0, rest_of, rotation, sign};
use std::borrow::Cow;
use surfelshop_api::columns::{
    COLOR, OPACITY, POSITION, RADIUS, SH, SPLAT_ROTATION, SPLAT_SCALE, Values,
};
use surfelshop_api::format::{CloudHeader, CloudSource, HeaderSupport, UpAxis, UpSupport};
use surfelshop_api::params::linear_to_srgb;
use surfelshop_api::prelude::{CloudView, Error, Job, Result};

/// Standard deviation of splats whose size nobody knows, in scene units.
const UNKNOWN_SCALE: f32 = 0.01;

/// Standard deviation of splats that stand for discs, in radii: that of the tool `gaussians`, which closes surfaces.
const OF_RADIUS: f32 = 0.7;

/// Thickness of flat splats, in their smaller standard deviations: sizes of 0 have no logarithm, and no inverse where
/// they are drawn.
const FLAT: f32 = 1e-3;

/// The columns of a batch.
struct Columns<'a> {
    positions: &'a [f64],
    opacity: Option<Cow<'a, [f32]>>,
    /// Standard deviations, and how many of each Gaussian.
    scale: Option<(usize, Cow<'a, [f32]>)>,
    radius: Option<Cow<'a, [f32]>>,
    rotation: Option<Cow<'a, [f32]>>,
    sh: [Option<Cow<'a, [f32]>>; 4],
    albedos: Vec<[f32; 3]>,
}

/// The numbers of a column with this many components, as `f32`.
fn floats<'a>(view: &CloudView<'a>, name: &str, components: usize) -> Option<Cow<'a, [f32]>> {
    let column = view.column(name).filter(|column| column.components as usize == components)?;
    let values = match column.values {
        Values::F32(values) => Cow::Borrowed(values),
        other => Cow::Owned(other.iter_f64().map(|value| value as f32).collect()),
    };
    (values.len() >= components * view.len).then_some(values)
}

/// Numbers of a column's Gaussian.
fn at<const N: usize>(values: &[f32], i: usize) -> [f32; N] {
    std::array::from_fn(|k| values[N * i + k])
}

impl<'a> Columns<'a> {
    fn of(view: &CloudView<'a>, degree: usize) -> Result<Self> {
        let positions = match view.column(POSITION).map(|column| column.values) {
            Some(Values::F64(positions)) if positions.len() >= 3 * view.len => positions,
            _ if view.len == 0 => &[],
            _ => return Err(Error::new("expected positions of three f64, found none")),
        };
        let sh = std::array::from_fn(|order| {
            let is_kept = order <= degree;
            if is_kept { floats(view, SH[order], 3 * (2 * order + 1)) } else { None }
        });
        let albedos = match sh[0] {
            Some(_) => Vec::new(),
            None => view.albedos().iter().map(|albedo| albedo.to_array()).collect(),
        };
        let scale = [3, 2].into_iter().find_map(|n| Some((n, floats(view, SPLAT_SCALE, n)?)));
        Ok(Self {
            positions,
            opacity: floats(view, OPACITY, 1),
            scale,
            radius: floats(view, RADIUS, 1),
            rotation: floats(view, SPLAT_ROTATION, 4),
            sh,
            albedos,
        })
    }

    fn scale(&self, i: usize) -> [f32; 3] {
        match (&self.scale, &self.radius) {
            (Some((3, scale)), _) => at(scale, i),
            (Some((_, scale)), _) => {
                let [u, v] = at(scale, i);
                [u, v, FLAT * u.min(v)]
            }
            (None, Some(radius)) => [OF_RADIUS * radius[i]; 3],
            (None, None) => [UNKNOWN_SCALE; 3],
        }
    }

    fn color(&self, i: usize) -> [f32; 3] {
        match &self.sh[0] {
            Some(values) => at(values, i),
            None => self.albedos[i].map(|albedo| (linear_to_srgb(albedo) - 0.5) / SH_0),
        }
    }

    /// The Gaussian at a place in the batch, and its position exactly.
    fn gaussian(&self, i: usize) -> (Gaussian, [f64; 3]) {
        let position: [f64; 3] = std::array::from_fn(|axis| self.positions[3 * i + axis]);
        let mut rest = [[0.0; 3]; MOST_REST];
        for (order, values) in self.sh.iter().enumerate().skip(1) {
            let (Some(values), first) = (values, rest_of(order - 1)) else { continue };
            for k in 0..2 * order + 1 {
                let value: [f32; 3] = at(values, (2 * order + 1) * i + k);
                rest[first + k] = value.map(|value| sign(first + k) * value);
            }
        }
        let found = Gaussian {
            position: position.map(|value| value as f32),
            opacity: self.opacity.as_ref().map_or(1.0, |values| values[i]),
            scale: self.scale(i).map(|value| if value.is_finite() { value.abs() } else { 0.0 }),
            rotation: rotation::unit(
                self.rotation.as_ref().map_or(rotation::IDENTITY, |values| at(values, i)),
            ),
            color: self.color(i),
            rest,
        };
        (found, position)
    }
}

/// What a format keeps.
#[derive(Clone, Copy, Debug)]
pub(super) struct FormatRange {
    /// The format's name.
    pub(super) name: &'static str,
    /// The highest degree of spherical harmonics.
    pub(super) degree: usize,
    /// The axis that points up in its files, where that is known.
    pub(super) up: UpAxis,
    /// Whether files say that splats were trained with antialiasing.
    pub(super) antialiased: bool,
}

impl FormatRange {
    /// The degree of spherical harmonics that a cloud has and the format keeps: up to the first that is missing.
    pub(super) fn degree_of(self, header: &CloudHeader) -> usize {
        let has = |order: &usize| {
            let column = header.column(SH[*order]);
            column.is_some_and(|(_, column)| column.components as usize == 3 * (2 * order + 1))
        };
        (1..=self.degree).take_while(has).last().unwrap_or(0)
    }

    /// Lines of what is left out or made up, with so many Gaussians that [`each`](Self::each) left out.
    pub(super) fn notes(self, header: &CloudHeader, n_placeless: u64) -> Vec<String> {
        let (name, degree) = (self.name, self.degree_of(header));
        let has = |column: &str| header.column(column).is_some();
        let mut lines = Vec::new();
        let shape = [POSITION, OPACITY, SPLAT_SCALE, SPLAT_ROTATION];
        let made_into_shape: &[&str] = if has(SPLAT_SCALE) { &[] } else { &[RADIUS] };
        let made_into_color: &[&str] = if has(SH[0]) { &[] } else { &[COLOR] };
        let used = [&shape[..], &SH[..=degree], made_into_shape, made_into_color].concat();
        let lost = header.columns.iter().filter(|column| !used.contains(&column.name.as_str()));
        let lost: Vec<String> = lost.map(|column| format!("`{}`", column.name)).collect();
        if !lost.is_empty() {
            lines.push(format!("{name} has no place for {}: left out", lost.join(", ")));
        }
        if !has(SPLAT_SCALE) {
            let size = if has(RADIUS) { "0.7 of their radii" } else { "0.01" };
            lines.push(format!(
                "the cloud has no `{SPLAT_SCALE}`: its splats are round, with standard deviations of {size}"
            ));
        }
        if self.up != UpAxis::Unknown && ![UpAxis::Unknown, self.up].contains(&header.up) {
            lines.push(format!(
                "in {name} files y points up, in this cloud another axis: coordinates are left as they are"
            ));
        }
        if n_placeless > 0 {
            lines
                .push(format!("{n_placeless} Gaussians whose places are no numbers were left out"));
        }
        // The axis is said above, where the format has one.
        let up = if self.up == UpAxis::Unknown { UpSupport::TakenAsY } else { UpSupport::Said };
        let mut header = header.clone();
        header.comments.retain(|comment| !(self.antialiased && comment == ANTIALIASED));
        lines.extend(header.left_out(name, HeaderSupport { up, ..HeaderSupport::default() }));
        lines
    }

    /// Calls `take` with each Gaussian of the one cloud that has a place, and that place; returns how many have none.
    /// Progress goes up to `share`.
    pub(super) fn each(
        self,
        header: &CloudHeader,
        clouds: &mut CloudSource<'_>,
        share: f64,
        job: &Job<'_>,
        mut take: impl FnMut(&Gaussian, [f64; 3]) -> Result<()>,
    ) -> Result<u64> {
        let (mut n, mut n_placeless) = (0, 0);
        while let Some(view) = clouds.next_batch()? {
            job.check()?;
            let columns = Columns::of(&view, self.degree)?;
            for i in 0..view.len {
                let (gaussian, position) = columns.gaussian(i);
                match gaussian.position.iter().all(|number| number.is_finite()) {
                    true => take(&gaussian, position)?,
                    false => n_placeless += 1,
                }
            }
            n += view.len as u64;
            if let Some(all) = header.rows.filter(|all| *all > 0) {
                job.progress(share * (n as f64 / all as f64).min(1.0), "");
            }
        }
        match clouds.next_cloud()? {
            None => Ok(n_placeless),
            Some(_) => Err(Error::new(format!(
                "expected one cloud, found several: {} files hold one",
                self.name
            ))),
        }
    }
}

/// A number of 0 to 255; what is no number becomes 0.
pub(super) fn byte(value: f32) -> u8 {
    value.round() as u8
}
