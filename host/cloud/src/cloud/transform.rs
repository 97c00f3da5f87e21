//! Similarity transforms of clouds.

use crate::cloud::Cloud;
use crate::cloud::buffer::Buffer;
use crate::cloud::column::Column;
use crate::cloud::roles::{Misfit, Motion};
use crate::error::CloudError;
use glam::{DMat3, DQuat, DVec3, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use surfelshop_api::ObjectFrame;
use surfelshop_api::columns::{NORMAL, POSITION, RADIUS, TANGENT_U, TANGENT_V};
use surfelshop_geometry::Bounds;

/// Where a cloud stands in a scene: scaled first, then turned, then moved.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Transform {
    /// Where the origin of the cloud's coordinates comes to lie, scene units.
    pub translation: DVec3,
    /// How the cloud is turned about the origin of its coordinates.
    pub rotation: Rotation,
    /// Factor on all lengths, above 0.
    pub scale: f64,
}

/// A rotation, kept in the form it was given in.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rotation {
    /// A quaternion that need not have unit length, but some.
    Quaternion(DQuat),
    /// Angles in radians, anticlockwise about the x axis, then the y axis, then the z axis, all of
    /// them axes of the scene that do not turn along.
    Euler(DVec3),
}

impl Default for Transform {
    /// Everything stays where it is.
    fn default() -> Self {
        Self { translation: DVec3::ZERO, rotation: Rotation::default(), scale: 1.0 }
    }
}

impl Default for Rotation {
    fn default() -> Self {
        Self::Quaternion(DQuat::IDENTITY)
    }
}

impl Rotation {
    /// The rotation as a quaternion of unit length; `None` where it is zero or not finite.
    #[must_use]
    pub fn quaternion(&self) -> Option<DQuat> {
        let quaternion = match *self {
            Self::Quaternion(quaternion) => quaternion,
            Self::Euler(angles) => {
                DQuat::from_rotation_z(angles.z)
                    * DQuat::from_rotation_y(angles.y)
                    * DQuat::from_rotation_x(angles.x)
            }
        };
        // Largest component first: the square of a tiny or huge one is not a number's length.
        let largest = quaternion.to_array().into_iter().fold(0.0, |most: f64, c| most.max(c.abs()));
        let scaled = quaternion / largest;
        (largest > 0.0 && scaled.is_finite()).then(|| scaled.normalize())
    }
}

/// A cloud's coordinates after a transform are below this, as those of a loaded cloud are: a
/// quarter of f32's range, so that differences and diagonals are finite in f32.
const MAX_COORDINATE: f64 = f32::MAX as f64 / 4.0;

/// Distance from their origin, in extents of the cloud, beyond which f32 offsets are taken from
/// another one before they are turned, as in reading.
const FAR: f64 = 256.0;

impl Cloud {
    /// The cloud scaled, turned and moved.
    ///
    /// Positions, normals, radii and tangents change, and columns whose [`Column::role`] says so; all
    /// other columns are shared, vectors that have no role among them. To move a cloud changes its
    /// origin only, so all columns are shared and none becomes less precise; without any change the
    /// result is a clone.
    ///
    /// # Errors
    /// Where the translation is not finite, the rotation has no length, the scale is not above 0,
    /// a column has a role that its type cannot have, or the result cannot be held: coordinates
    /// beyond a quarter of f32's range, or radii or tangents that become zero or infinite.
    pub fn transformed(&self, transform: &Transform) -> Result<Self, CloudError> {
        let Transform { translation, scale, rotation } = *transform;
        let wrong = |expected, found: String| CloudError::Transform { expected, found };
        if !translation.is_finite() {
            return Err(wrong("a finite translation", translation.to_string()));
        }
        if !(scale > 0.0 && scale.is_finite()) {
            return Err(wrong("a scale above 0", scale.to_string()));
        }
        let quaternion =
            rotation.quaternion().ok_or_else(|| wrong("a rotation", format!("{rotation:?}")))?;
        let is_turned = quaternion.xyz() != DVec3::ZERO;
        let scaled_or_turned = is_turned || scale.to_bits() != 1f64.to_bits();
        if !scaled_or_turned && translation == DVec3::ZERO {
            return Ok(self.clone());
        }
        let moved = match scaled_or_turned {
            true => self.turned(quaternion, scale, translation)?,
            false => self.with_origin(self.origin() + translation, self.columns().to_vec()),
        };
        let object = self.object();
        let object = ObjectFrame {
            center: quaternion * (object.center * scale) + translation,
            size: object.size * scale,
            rotation: (quaternion * object.rotation).normalize(),
        };
        moved.with_object(object).in_range()
    }

    /// The cloud under a linear map and a translation.
    fn turned(
        &self,
        quaternion: DQuat,
        scale: f64,
        translation: DVec3,
    ) -> Result<Self, CloudError> {
        let (rotation, motion) = (DMat3::from_quat(quaternion), Motion::new(quaternion, scale));
        // f32 offsets far from their origin would be rounded coarsely once they are turned.
        let pivot = Bounds::of_positions(self.positions())
            .filter(|bounds| bounds.reach() > FAR * bounds.extent())
            .map_or(DVec3::ZERO, |bounds| bounds.centre());
        let linear = rotation * scale;
        let known = |column: &Column| match (column.name(), column.values()) {
            (POSITION, _) => {
                vectors(self, column, |p| linear * (p - pivot), |_, turned| turned.is_finite())
            }
            (NORMAL, _) => vectors(self, column, |n| rotation * n, |_, _| true),
            (TANGENT_U | TANGENT_V, _) => vectors(
                self,
                column,
                |t| linear * t,
                |given, turned| turned.is_finite() && (turned != Vec3::ZERO || given == Vec3::ZERO),
            ),
            (RADIUS, Buffer::F32(radii)) => {
                let scaled = radii.par_iter().map(|&r| (f64::from(r) * scale) as f32);
                let fits = |r: f32| (r > 0.0 && r.is_finite()).then_some(r);
                let scaled: Option<Vec<f32>> = scaled.map(fits).collect();
                scaled.map(Buffer::F32)
            }
            _ => None,
        };
        let too_large = |column: &Column| CloudError::Transform {
            expected: "a scale that single precision can hold",
            found: format!("{scale:e}, which column `{}` cannot hold", column.name()),
        };
        let columns = self.columns().iter().map(|column| match column.name() {
            POSITION | NORMAL | TANGENT_U | TANGENT_V | RADIUS => {
                Ok(column.with_values(known(column).ok_or_else(|| too_large(column))?))
            }
            _ => by_role(&motion, column),
        });
        let origin = linear * (self.origin() + pivot) + translation;
        Ok(self.with_origin(origin, columns.collect::<Result<_, _>>()?))
    }

    /// The cloud, where its coordinates stay below [`MAX_COORDINATE`].
    fn in_range(self) -> Result<Self, CloudError> {
        let reach = Bounds::of_positions(self.positions()).map_or(0.0, |bounds| bounds.reach());
        let farthest = self.origin().abs().max_element() + reach;
        if farthest <= MAX_COORDINATE {
            return Ok(self);
        }
        let expected = "coordinates of at most 8.5e37";
        Err(CloudError::Transform { expected, found: format!("{farthest:e}") })
    }
}

/// A column of three `f32` under a map computed in f64; `None` where a result does not fit.
fn vectors(
    cloud: &Cloud,
    column: &Column,
    map: impl Fn(DVec3) -> DVec3 + Sync,
    fits: impl Fn(Vec3, Vec3) -> bool + Sync,
) -> Option<Buffer> {
    let given = cloud.vectors(column.name()).par_iter();
    let turned = given.map(|&given| {
        let turned = map(given.as_dvec3()).as_vec3();
        fits(given, turned).then_some(turned)
    });
    let turned: Vec<Vec3> = turned.collect::<Option<_>>()?;
    Some(Buffer::F32(bytemuck::cast_vec(turned)))
}

/// A column under a scale and a rotation as its role says; shared where that changes nothing.
fn by_role(motion: &Motion, column: &Column) -> Result<Column, CloudError> {
    let what = (column.name(), column.role(), column.components());
    let moved = motion.moved(what, column.values());
    let Misfit { expected, found } = match moved {
        Ok(moved) => {
            return Ok(moved.map_or_else(|| column.clone(), |values| column.with_values(values)));
        }
        Err(misfit) => misfit,
    };
    Err(CloudError::Transform { expected, found })
}
