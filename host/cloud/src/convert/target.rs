//! Batches as they are written: selected, moved, and with the columns of their target.

use super::check::narrow_colors;
use super::counts::SharedCounts;
use super::select::Selection;
use crate::cloud::buffer::Buffer;
use crate::cloud::roles::Motion;
use crate::formats::parts::{absent, turn, turn_by_role};
use glam::DVec3;
use std::borrow::Cow;
use std::sync::atomic::Ordering;
use surfelshop_api::CloudView;
use surfelshop_api::columns::{COLOR, ColumnView, Element, NORMAL, POSITION, TANGENT_U, TANGENT_V};
use surfelshop_api::format::{CloudHeader, FileColumn, Pose, SCAN};
use surfelshop_api::params::srgb_to_linear;

/// A batch as it is written.
#[derive(Default)]
pub(super) struct TargetBatch {
    pub(super) rows: usize,
    pub(super) columns: Vec<Buffer>,
    pub(super) faces: Vec<[u32; 3]>,
}

/// Types that differ from those that are read.
#[derive(Clone, Copy, Debug)]
pub(super) struct Types {
    /// Positions become `f64`.
    pub(super) wide_positions: bool,
    /// 16-bit colours become the 8-bit ones that they hold.
    pub(super) narrow_colors: bool,
    /// Splats stay as their trainer wrote them.
    pub(super) trained_splats: bool,
    /// Places of grids that hold no point are written, too.
    pub(super) grids: bool,
}

/// Makes the batches of a cloud that is written out of those of one or several that are read.
pub(super) struct Target {
    merged: Option<CloudHeader>,
    selection: Selection,
    types: Types,
    counts: SharedCounts,
    /// The cloud that is read.
    current: CloudHeader,
    /// The cloud that is written.
    out: CloudHeader,
    /// Number of the cloud that is read, where several become one.
    scan: u16,
    /// Number of the first of them.
    pub(super) first_scan: u16,
    /// Points read of all clouds, for one of so many.
    n_seen: u64,
    /// Points written of the cloud, and as many before the cloud that is read.
    n_out: u64,
    n_before: u64,
    /// Whether points of the cloud were left out, so that triangles no longer fit.
    has_gaps: bool,
    /// The box around all points that are cropped, in common coordinates, and whether one is not left out by that.
    extent: Option<[DVec3; 2]>,
    any_inside: bool,
}

impl Target {
    pub(super) fn new(
        merged: Option<CloudHeader>,
        selection: Selection,
        types: Types,
        counts: SharedCounts,
    ) -> Self {
        let (current, out, scan, first_scan, n_seen, n_out, n_before, has_gaps) =
            Default::default();
        let (extent, any_inside) = Default::default();
        Self {
            merged,
            selection,
            types,
            counts,
            current,
            out,
            scan,
            first_scan,
            n_seen,
            n_out,
            n_before,
            has_gaps,
            extent,
            any_inside,
        }
    }

    /// Whether several clouds become one.
    pub(super) fn merges(&self) -> bool {
        self.merged.is_some()
    }

    /// Whether triangles between the points are kept.
    pub(super) fn keeps_faces(&self) -> bool {
        self.out.has_faces && !self.has_gaps
    }

    /// Counts triangles from the first point that is written.
    pub(super) fn number(&self, faces: &mut [[u32; 3]]) {
        let before = u32::try_from(self.n_before).unwrap_or(u32::MAX);
        for corner in faces.as_flattened_mut() {
            *corner = corner.saturating_add(before);
        }
    }

    /// Begins a cloud that is written; its header.
    pub(super) fn begin(&mut self, header: CloudHeader) -> CloudHeader {
        self.out = match &self.merged {
            Some(merged) => merged.clone(),
            None => self.apart(&header),
        };
        if self.types.narrow_colors {
            narrow_colors(&mut self.out);
        }
        if self.types.wide_positions {
            for column in self.out.columns.iter_mut().filter(|column| column.name == POSITION) {
                column.element = Element::F64;
            }
        }
        (self.n_out, self.n_before, self.has_gaps) = (0, 0, false);
        self.scan = self.first_scan;
        self.current = header;
        self.out.clone()
    }

    /// A cloud that stays by itself, in its own axes.
    fn apart(&self, header: &CloudHeader) -> CloudHeader {
        let kept = header.columns.iter().filter(|column| self.selection.keeps(&column.name));
        CloudHeader {
            columns: kept.cloned().collect(),
            rows: None,
            bounds: header.bounds.filter(|_| self.selection.crop.is_none()),
            grid: header.grid.filter(|_| !self.selection.thins()),
            has_faces: header.has_faces && !self.selection.thins(),
            ..header.clone()
        }
    }

    /// Goes on with another cloud that is read.
    pub(super) fn go_on(&mut self, header: CloudHeader) {
        self.current = header;
        self.scan = self.scan.saturating_add(1);
        self.n_before = self.n_out;
    }

    /// How points get where they are written.
    fn pose(&self) -> Pose {
        if self.merges() { self.current.pose } else { Pose::default() }
    }

    /// A batch of no points.
    pub(super) fn empty(&self) -> TargetBatch {
        let columns =
            self.out.columns.iter().map(|column| Buffer::with_capacity(column.element, 0));
        TargetBatch { rows: 0, columns: columns.collect(), faces: Vec::new() }
    }

    /// A batch out of one that was read; columns that it does not take stay where they are.
    pub(super) fn batch(&mut self, columns: &mut [Buffer]) -> TargetBatch {
        let Some((place, _)) = self.current.column(POSITION) else { return self.empty() };
        let mask = self.mask(&points(&columns[place]));
        let rows = mask.iter().filter(|&&keep| keep).count();
        let all = rows == mask.len();
        self.has_gaps |= !all;
        self.counts.written.fetch_add(rows as u64, Ordering::Relaxed);
        self.n_out += rows as u64;
        if rows == 0 {
            return self.empty();
        }
        let pose = self.pose();
        let motion = Motion::new(pose.rotation, 1.0);
        let mut made = Vec::with_capacity(self.out.columns.len());
        for column in &self.out.columns {
            let found =
                self.current.column(&column.name).map(|(place, found)| (place, found.clone()));
            let values = match (column.name.as_str(), found) {
                (SCAN, None) => Buffer::U16(vec![self.scan; rows]),
                (_, None) => filled(column, rows),
                (POSITION, Some(_)) if pose != Pose::default() => {
                    let points = points(&columns[place]);
                    let moved = points.iter().zip(&mask).filter(|(_, keep)| **keep);
                    let moved = moved.map(|(p, _)| pose.place(DVec3::from_array(*p)).to_array());
                    Buffer::F64(moved.flatten().collect())
                }
                (name, Some((place, found))) => {
                    let components = found.components as usize;
                    let mut values = match all {
                        true => std::mem::replace(&mut columns[place], Buffer::U8(Vec::new())),
                        false => columns[place].select(components, &mask),
                    };
                    if matches!(name, NORMAL | TANGENT_U | TANGENT_V) {
                        turn(&mut values, pose.rotation);
                    } else {
                        turn_by_role(&found, &mut values, &motion);
                    }
                    converted(values, &found, column, rows)
                }
            };
            made.push(values);
        }
        TargetBatch { rows, columns: made, faces: Vec::new() }
    }

    /// The points that stay.
    fn mask(&mut self, points: &[[f64; 3]]) -> Vec<bool> {
        let every = self.selection.every.max(1);
        let (crop, pose) = (self.selection.crop, self.current.pose);
        // An organised cloud that nobody thins keeps its grid, with the points that are none.
        let keeps_grid = self.types.grids && self.out.grid.is_some();
        let mut not_finite = 0;
        let mask = points
            .iter()
            .map(|point| {
                let point = DVec3::from_array(*point);
                let number = self.n_seen;
                self.n_seen += 1;
                if !point.is_finite() {
                    not_finite += u64::from(!keeps_grid);
                    return keeps_grid;
                }
                let inside = crop.is_none_or(|[low, high]| {
                    let place = pose.place(point);
                    let [least, most] = self.extent.get_or_insert([place; 2]);
                    (*least, *most) = (least.min(place), most.max(place));
                    let is_inside = place.cmpge(low).all() && place.cmple(high).all();
                    self.any_inside |= is_inside;
                    is_inside
                });
                number.is_multiple_of(every) && inside
            })
            .collect();
        self.counts.read.fetch_add(points.len() as u64, Ordering::Relaxed);
        self.counts.not_finite.fetch_add(not_finite, Ordering::Relaxed);
        mask
    }

    /// Why there is nothing to write: no point lies in the box that was cropped to. Heads of files may say other
    /// bounds than their points have, so that it is known when all are there.
    pub(super) fn nothing_left(&self) -> Option<String> {
        let [least, most] = self.extent.filter(|_| !self.any_inside)?;
        let place = |p: DVec3| format!("{:?},{:?},{:?}", p.x, p.y, p.z);
        Some(format!(
            "no point lies in the box; the points reach from {} to {}",
            place(least),
            place(most)
        ))
    }

    /// A batch as writers see it.
    pub(super) fn view<'a>(
        &'a self,
        batch: &'a TargetBatch,
        faces: &'a [[u32; 3]],
    ) -> CloudView<'a> {
        let column = |(column, values): (&'a FileColumn, &'a Buffer)| ColumnView {
            name: &column.name,
            components: column.components,
            generation: 0,
            values: values.as_values(),
        };
        let columns = self.out.columns.iter().zip(&batch.columns).map(column).collect();
        CloudView { len: batch.rows, columns, faces, ..CloudView::default() }
    }
}

/// Coordinates in double precision.
fn points(values: &Buffer) -> Cow<'_, [[f64; 3]]> {
    match values {
        Buffer::F64(values) => Cow::Borrowed(values.as_chunks::<3>().0),
        other => {
            let wide: Vec<f64> = other.iter_f64().collect();
            Cow::Owned(wide.as_chunks::<3>().0.to_vec())
        }
    }
}

/// What stands where a cloud does not have a column.
fn filled(column: &FileColumn, rows: usize) -> Buffer {
    let n = rows * column.components as usize;
    let mut values = Buffer::with_capacity(column.element, n);
    for _ in 0..n {
        values.push(absent(column));
    }
    values
}

/// A channel of a colour in another type: 8-bit codes become 16-bit ones, and codes become linear floats.
fn color(value: f64, channel: usize, found: &FileColumn, target: &FileColumn) -> f64 {
    let most = match found.element {
        Element::U8 => 255.0,
        Element::U16 => 65_535.0,
        _ => return value,
    };
    match target.element {
        Element::U8 => value,
        Element::U16 => value * (65_535.0 / most),
        // Opacity is no light.
        _ if channel > 2 => value / most,
        _ => f64::from(srgb_to_linear((value / most) as f32)),
    }
}

/// Values in the type and number of components of their target.
fn converted(values: Buffer, found: &FileColumn, target: &FileColumn, rows: usize) -> Buffer {
    if found.element == target.element && found.components == target.components {
        return values;
    }
    let (n_found, n_target) = (found.components as usize, target.components as usize);
    let mut made = Buffer::with_capacity(target.element, rows * n_target);
    for row in 0..rows {
        for component in 0..n_target {
            let value = match component < n_found {
                true => values.get_f64(row * n_found + component).map(|value| {
                    if target.name == COLOR {
                        color(value, component, found, target)
                    } else {
                        value
                    }
                }),
                // Colours without opacity are opaque.
                false if target.element == Element::U8 => Some(255.0),
                false if target.element == Element::U16 => Some(65_535.0),
                false => Some(1.0),
            };
            made.push(value.unwrap_or(f64::NAN));
        }
    }
    made
}
