//! What a file says of a cloud before its points.

use super::support::HeaderSupport;
use super::tree::PointTree;
use crate::columns::{Element, Role, role_of};
use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

/// Strength of what came back, in the file's own units: one number.
pub const INTENSITY: &str = "intensity";
/// Class of a point, as ASPRS numbers them in LAS files: one whole number.
pub const CLASSIFICATION: &str = "classification";
/// Which return of its pulse a point is, counted from 1.
pub const RETURN_NUMBER: &str = "return_number";
/// Returns of the pulse.
pub const N_RETURNS: &str = "n_returns";
/// Angle of the beam, degrees: one `f32`.
pub const SCAN_ANGLE: &str = "scan_angle";
/// Time of the pulse, seconds: one `f64`.
pub const GPS_TIME: &str = "gps_time";
/// Number of the flight line or device that a point is from.
pub const POINT_SOURCE: &str = "point_source";
/// Number of the scan within a file, counted from 0; made by the host for files of several clouds.
pub const SCAN: &str = "scan";

/// Which axis of a file's coordinates points up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum UpAxis {
    /// The file does not say.
    #[default]
    Unknown,
    /// x.
    X,
    /// y, as in the engine.
    Y,
    /// z, as in surveying.
    Z,
}

/// Where a cloud of a file stands: rotated, then moved.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Rotation from the cloud's axes to those of the file's common coordinates.
    pub rotation: DQuat,
    /// Where the cloud's zero lies in the file's common coordinates.
    pub translation: DVec3,
}

impl Default for Pose {
    fn default() -> Self {
        Self { rotation: DQuat::IDENTITY, translation: DVec3::ZERO }
    }
}

impl Pose {
    /// A place in the cloud's own axes, in the file's common coordinates.
    #[must_use]
    pub fn place(&self, point: DVec3) -> DVec3 {
        self.rotation * point + self.translation
    }

    /// A place in the file's common coordinates, in the cloud's own axes.
    #[must_use]
    pub fn back(&self, point: DVec3) -> DVec3 {
        self.rotation.inverse() * (point - self.translation)
    }
}

/// A column of a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FileColumn {
    /// The name. `position`, `normal`, `color`, `radius`, `tangent_u`, `tangent_v`, `ao` and the
    /// names in [`format`](crate::format) have a meaning; any other is kept as it is.
    pub name: String,
    /// Elements of a point.
    pub components: u32,
    /// Type of an element. Positions may be `f32` or `f64`, directions and lengths too.
    pub element: Element,
    /// Unit, for people, such as `s`; may be empty.
    #[serde(default)]
    pub unit: String,
    /// What it holds, for people; may be empty.
    #[serde(default)]
    pub description: String,
    /// What becomes of the values where the cloud is scaled or turned. A name that has a meaning has that of
    /// [`role_of`] where this is [`Role::Plain`]. ABI 3.9.
    #[serde(default, skip_serializing_if = "is_plain")]
    pub role: Role,
}

fn is_plain(role: &Role) -> bool {
    *role == Role::Plain
}

impl FileColumn {
    /// A column, with the role that its name has.
    #[must_use]
    pub fn new(name: impl Into<String>, components: u32, element: Element) -> Self {
        let (unit, description) = Default::default();
        let name = name.into();
        let role = role_of(&name);
        Self { name, components, element, unit, description, role }
    }

    /// The column with another role. ABI 3.9.
    #[must_use]
    pub fn with_role(self, role: Role) -> Self {
        Self { role, ..self }
    }

    /// Bytes of a point's values.
    #[must_use]
    pub fn point_bytes(&self) -> usize {
        self.components as usize * self.element.size()
    }
}

/// What a file says of a cloud before its points. Everything but the columns may be unknown.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct CloudHeader {
    /// Format and encoding, for people: `LAS 1.2, point format 3`.
    pub format: String,
    /// What the file calls the cloud; may be empty.
    pub name: String,
    /// Number of points, where the file announces it: no more are taken.
    pub rows: Option<u64>,
    /// The columns of each batch, in order; one is `position`.
    pub columns: Vec<FileColumn>,
    /// Smallest and largest coordinates, in the cloud's own axes, as the file announces them.
    pub bounds: Option<[DVec3; 2]>,
    /// Smallest step of coordinates, where they are whole numbers of it in the file.
    pub step: Option<DVec3>,
    /// Where the cloud stands in the file's common coordinates. Positions and directions of batches are in
    /// the cloud's own axes: the host moves them.
    pub pose: Pose,
    /// Where the device stood, in the cloud's own axes, where that is known: normals face it.
    pub scanner: Option<DVec3>,
    /// The axis that points up, of the common coordinates.
    pub up: UpAxis,
    /// Metres of a unit of coordinates; 0 where unknown.
    pub metres_per_unit: f64,
    /// Coordinate reference system, as the file has it (WKT, an EPSG code); may be empty.
    pub coordinate_system: String,
    /// When it was taken, for people; may be empty.
    pub time: String,
    /// Columns and rows of the grid of an organised cloud, whose points are in its order, row by row.
    pub grid: Option<[u32; 2]>,
    /// Whether triangles follow the points.
    pub has_faces: bool,
    /// Comments of the file, for people.
    pub comments: Vec<String>,
    /// The octree that the points lie in, where there is one and [`CloudSink::nodes`](super::CloudSink::nodes) asks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tree: Option<PointTree>,
}

impl CloudHeader {
    /// The column of this name and its place among them.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<(usize, &FileColumn)> {
        self.columns.iter().enumerate().find(|(_, column)| column.name == name)
    }

    /// Lines that say what is left out by a format with no place for a coordinate system and a unit; none where the
    /// cloud has no system and metres. [`left_out`](Self::left_out) says this and more.
    #[must_use]
    pub fn without_system(&self) -> Vec<String> {
        let (unit, coordinate_system) = (self.metres_per_unit, self.coordinate_system.clone());
        let only = Self { metres_per_unit: unit, coordinate_system, ..Self::default() };
        only.left_out("the format", HeaderSupport::default())
    }
}
