//! A cloud: named typed columns around an origin, and what can be done to it as a whole.

pub(crate) mod axis;
pub(crate) mod buffer;
pub(crate) mod changes;
pub(crate) mod color;
pub(crate) mod column;
pub(crate) mod delta;
pub(crate) mod edit;
mod facts;
pub(crate) mod part;
pub(crate) mod patch;
pub(crate) mod provenance;
pub(crate) mod roles;
pub mod selection;
pub(crate) mod source;
pub(crate) mod splats;
pub(crate) mod transform;

use crate::error::CloudError;
use crate::faces;
use buffer::Buffer;
use column::Column;
use glam::{DVec3, Vec3};
use provenance::CloudEdit;
use source::Source;
use splats::{SplatKind, splat_kind};
use std::collections::HashSet;
use std::sync::{Arc, OnceLock};
use surfelshop_api::columns::{NORMAL, POSITION, RADIUS};
use surfelshop_api::{CloudFacts, CloudView, ObjectFrame};

/// Named typed columns of equal length around an f64 origin.
///
/// `position` holds f32 offsets from the origin in scene units, right-handed and y up; the other
/// columns are described in [`surfelshop_api::columns`]. Columns are shared: a clone or an edit
/// copies none but those that change. Triangles between the surfels, where the cloud comes from a
/// mesh, are shared alike.
#[derive(Clone, Debug)]
pub struct Cloud {
    origin: DVec3,
    len: usize,
    columns: Vec<Column>,
    faces: Arc<[[u32; 3]]>,
    facts: OnceLock<CloudFacts>,
    history: Vec<CloudEdit>,
    /// The cloud's own box, where it was moved or edited; else the box around it.
    object: Option<ObjectFrame>,
    /// What its file said besides the points.
    source: Arc<Source>,
}

impl Default for Cloud {
    /// An empty cloud: a `position` column without surfels.
    fn default() -> Self {
        let position = Column::new(POSITION, 3, Buffer::F32(Vec::new()));
        let (faces, facts, history, object, source) = Default::default();
        let columns = vec![position];
        Self { origin: DVec3::ZERO, len: 0, columns, faces, facts, history, object, source }
    }
}

impl Cloud {
    /// A cloud of these columns, one of which is `position`.
    ///
    /// # Errors
    /// Where `position` is missing, a name comes twice, a column's length is not that of
    /// `position`, a well-known column has another type than it should or holds a number that is
    /// not finite, or `origin` is not finite.
    pub fn new(origin: DVec3, columns: Vec<Column>) -> Result<Self, CloudError> {
        let position = columns.iter().find(|column| column.name() == POSITION);
        let len = position.ok_or(CloudError::NoPosition)?.values().len() / 3;
        if !origin.is_finite() {
            return Err(CloudError::Origin { origin });
        }
        let mut names = HashSet::with_capacity(columns.len());
        for column in &columns {
            column.check(len)?;
            if !names.insert(column.name()) {
                return Err(CloudError::Twice { column: column.name().to_owned() });
            }
        }
        let (faces, facts, history, object, source) = Default::default();
        Ok(Self { origin, len, columns, faces, facts, history, object, source })
    }

    /// The cloud with these triangles between its surfels, counterclockwise seen from outside,
    /// instead of those it had.
    ///
    /// # Errors
    /// Where a triangle names a surfel that is not there.
    pub fn with_faces(mut self, faces: Vec<[u32; 3]>) -> Result<Self, CloudError> {
        let is_there = |corner: &u32| (*corner as usize) < self.len;
        if let Some(triangle) = faces.iter().position(|face| !face.iter().all(is_there)) {
            return Err(CloudError::Face { triangle, len: self.len });
        }
        self.faces = faces.into();
        Ok(self)
    }

    /// The cloud with columns added, or replaced where the name exists; all others are shared.
    ///
    /// # Errors
    /// As in [`Cloud::new`]; a replaced `position` must have as many surfels as before.
    pub fn with_columns(&self, new: Vec<Column>) -> Result<Self, CloudError> {
        let mut columns = self.columns.clone();
        for column in new {
            column.check(self.len)?;
            match columns.iter_mut().find(|old| old.name() == column.name()) {
                Some(old) => *old = column,
                None => columns.push(column),
            }
        }
        Ok(self.with_origin(self.origin, columns).with_object(self.object()))
    }

    /// The cloud without a column; `position` stays, and an unknown name changes nothing.
    #[must_use]
    pub fn without_column(&self, name: &str) -> Self {
        let mut columns = self.columns.clone();
        columns.retain(|column| column.name() == POSITION || column.name() != name);
        self.with_origin(self.origin, columns)
    }

    /// The cloud of the surfels whose entry is true, with the triangles all of whose corners stay.
    ///
    /// # Errors
    /// Where there is not one entry per surfel.
    pub fn keep(&self, mask: &[bool]) -> Result<Self, CloudError> {
        if mask.len() != self.len {
            return Err(CloudError::Mask { expected: self.len, found: mask.len() });
        }
        let columns = self.columns.iter().map(|column| column.select(mask)).collect();
        let len = mask.iter().filter(|&&keep| keep).count();
        // A mask that keeps all keeps the triangles as they are.
        let faces = match len == self.len {
            true => Arc::clone(&self.faces),
            false => faces::kept(&self.faces, mask).into(),
        };
        let kept = self.with_origin(self.origin, columns).with_object(self.object());
        Ok(Self { len, faces, ..kept })
    }

    /// The columns with one added, or replaced where the name exists.
    fn columns_with(&self, column: Column) -> Vec<Column> {
        let mut columns = self.columns.clone();
        match columns.iter_mut().find(|old| old.name() == column.name()) {
            Some(old) => *old = column,
            None => columns.push(column),
        }
        columns
    }

    /// The cloud with other colours, a column that fits it. What is known of it stays known but for its colours.
    pub(crate) fn recolored(&self, color: Column) -> Self {
        let recolored =
            self.with_origin(self.origin, self.columns_with(color)).with_object(self.object());
        let facts = facts::recolored(self.facts(), &recolored);
        Self { facts: OnceLock::from(facts), ..recolored }
    }

    /// The cloud with a column that fits it and says how it is displayed. What is known of it stays known: its box is
    /// around centres, whatever their radii.
    pub(crate) fn displayed_with(&self, column: Column) -> Self {
        Self { columns: self.columns_with(column), ..self.clone() }
    }

    /// The cloud without a column, if it has one of this name, that says how it is displayed.
    pub(crate) fn displayed_without(&self, name: &str) -> Self {
        let columns = self.columns.iter().filter(|column| column.name() != name);
        Self { columns: columns.cloned().collect(), ..self.clone() }
    }

    /// The cloud of `len` of its surfels, with columns that hold theirs and the triangles between them.
    pub(crate) fn with_rows(&self, columns: Vec<Column>, len: usize, faces: Vec<[u32; 3]>) -> Self {
        let kept = self.with_origin(self.origin, columns).with_object(self.object());
        Self { len, faces: faces.into(), ..kept }
    }

    /// The cloud around another origin; the columns must be of its length.
    pub(crate) fn with_origin(&self, origin: DVec3, columns: Vec<Column>) -> Self {
        let (faces, history) = (Arc::clone(&self.faces), self.history.clone());
        let (len, object, facts) = (self.len, self.object, OnceLock::new());
        let source = Arc::clone(&self.source);
        Self { origin, len, columns, faces, facts, history, object, source }
    }

    /// What the cloud's file said besides its points. Scenes that move the cloud leave it as it was.
    #[must_use]
    pub fn source(&self) -> &Source {
        &self.source
    }

    /// The same cloud as one of which a file said this.
    #[must_use]
    pub fn with_source(&self, source: Source) -> Self {
        Self { source: Arc::new(source), ..self.clone() }
    }

    /// What tools did to the cloud as a whole, oldest first; what they did to a column is in
    /// [`Column::made`].
    #[must_use]
    pub fn history(&self) -> &[CloudEdit] {
        &self.history
    }

    /// The same cloud with another past.
    #[must_use]
    pub fn with_history(&self, history: Vec<CloudEdit>) -> Self {
        Self { history, ..self.clone() }
    }

    /// Number of surfels.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there are no surfels.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// World position that `position` is relative to, scene units.
    #[must_use]
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// The columns.
    #[must_use]
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// Triangles between the surfels, as indices of their corners counterclockwise seen from
    /// outside; none where the cloud does not come from a mesh.
    #[must_use]
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// The column of this name.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|column| column.name() == name)
    }

    /// The cloud as a plugin sees it; nothing is copied.
    #[must_use]
    pub fn view(&self) -> CloudView<'_> {
        let columns = self.columns.iter().map(Column::view).collect();
        let (faces, object) = (&*self.faces, self.object());
        CloudView { origin: self.origin, len: self.len, columns, faces, object }
    }

    /// The cloud's own box: around the surfels as they were loaded, moved, turned and scaled with
    /// them since. Edits leave it where it is.
    #[must_use]
    pub fn object(&self) -> ObjectFrame {
        self.object.unwrap_or_else(|| self.facts().objects.first().copied().unwrap_or_default())
    }

    /// The same cloud with a box of its own.
    #[must_use]
    pub fn with_object(self, object: ObjectFrame) -> Self {
        Self { object: Some(object), facts: OnceLock::new(), ..self }
    }

    /// The box that was there before transforms and edits.
    pub(crate) fn moved_object(&self) -> Option<ObjectFrame> {
        self.object
    }

    /// Facts of the cloud, computed on the first call.
    ///
    /// Where there are surfels and no `color` column, the colour that all share is
    /// [`NEUTRAL_ALBEDO`](crate::NEUTRAL_ALBEDO).
    #[must_use]
    pub fn facts(&self) -> &CloudFacts {
        self.facts.get_or_init(|| facts::of(self))
    }

    /// Surfel centres, offsets from the origin in scene units.
    #[must_use]
    pub fn positions(&self) -> &[Vec3] {
        self.vectors(POSITION)
    }

    /// Outward normals; empty where there is no such column.
    #[must_use]
    pub fn normals(&self) -> &[Vec3] {
        self.vectors(NORMAL)
    }

    /// Disc radii, scene units; empty where there is no such column.
    #[must_use]
    pub fn radii(&self) -> &[f32] {
        self.floats(RADIUS, 1)
    }

    /// A column of three `f32` as vectors; empty where there is no such column.
    #[must_use]
    pub fn vectors(&self, name: &str) -> &[Vec3] {
        bytemuck::try_cast_slice(self.floats(name, 3)).unwrap_or_default()
    }

    /// A column of `components` `f32`; empty where there is no such column.
    #[must_use]
    pub fn floats(&self, name: &str, components: u32) -> &[f32] {
        match self.column(name).map(|column| (column.components(), column.values())) {
            Some((found, Buffer::F32(values))) if found == components => values,
            _ => &[],
        }
    }

    /// The centre of a surfel in world space; `None` where the index is out of range.
    #[must_use]
    pub fn world_position(&self, index: usize) -> Option<DVec3> {
        self.positions().get(index).map(|offset| self.origin + offset.as_dvec3())
    }
}

/// What kind of Gaussian splats a cloud consists of; `None` where it has not all their columns with their types:
/// `opacity`, `splat_scale` and `splat_rotation` as [`surfelshop_api::columns`] describes them. Harmonics may be
/// missing.
#[must_use]
pub fn splat_columns(cloud: &Cloud) -> Option<SplatKind> {
    splat_kind(|name| {
        let column = cloud.column(name)?;
        Some((column.values().element(), column.components()))
    })
}
