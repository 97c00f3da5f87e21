//! # `transform`: moves, turns, scales and mirrors a cloud
//!
//! | parameter              | type   | default  | meaning                                         |
//! |------------------------|--------|----------|-------------------------------------------------|
//! | `translate-x`, `-y`, `-z` | float | 0      | how far the cloud is moved, scene units          |
//! | `rotate-x`, `-y`, `-z` | float  | 0        | degrees anticlockwise about axes that stay: x, then y, then z |
//! | `scale`                | float  | 1        | factor on all lengths                           |
//! | `mirror`               | choice | `none`   | `none`, `x`, `y` or `z`: the axis that is turned round |
//! | `about`                | choice | `origin` | `origin` of coordinates or `centre` of the cloud's box: what stays in place but for the move |
//!
//! Method. The cloud is mirrored, scaled, turned and then moved. A move changes the cloud's origin,
//! in f64, and no position, so that it is exact and its reverse gives the same bits. Columns change by what they
//! hold: radii and other lengths are scaled, normals, tangents and the rotations of splats turned, and so
//! are the coefficients of spherical harmonics; clip lines stay, for they are in units of their
//! surfel.
//!
//! Limits: triangles of a mesh are left out, and columns whose names mean nothing to Surfelshop stay
//! as they are.
//!
//! ```text
//! surfelshop bake scan.ply -t transform --set rotate-x=90 --set scale=0.001 -o metres.ply
//! ```

use crate::linear::{Similarity, rows};
use crate::surfels::{finite, flat};
use surfelshop_api::columns::{NORMAL_FIELD, POSITION, TANGENT_U, TANGENT_V, Values};
use surfelshop_api::glam::{DMat3, DQuat, DVec3, Vec3};
use surfelshop_api::prelude::*;
use surfelshop_api::tool::NewColumn;
use surfelshop_geometry::Bounds;

choices! {
    /// The axis that a mirror turns round.
    pub enum Mirror {
        /// None.
        None = "none",
        /// The x axis.
        X = "x",
        /// The y axis.
        Y = "y",
        /// The z axis.
        Z = "z",
    }
}

choices! {
    /// What stays in place.
    pub enum About {
        /// The origin of coordinates.
        Origin = "origin",
        /// The middle of the cloud's box.
        Centre = "centre",
    }
}

params! {
    /// Settings of `transform`.
    pub struct Settings {
        /// How far the cloud is moved along x.
        translate_x: f64 { default: 0.0, unit: "scene units" },
        /// How far the cloud is moved along y.
        translate_y: f64 { default: 0.0, unit: "scene units" },
        /// How far the cloud is moved along z.
        translate_z: f64 { default: 0.0, unit: "scene units" },
        /// Turn about the x axis, before the others.
        rotate_x: f64 { default: 0.0, range: -360.0..=360.0, unit: "deg" },
        /// Turn about the y axis, after that about x.
        rotate_y: f64 { default: 0.0, range: -360.0..=360.0, unit: "deg" },
        /// Turn about the z axis, after the others.
        rotate_z: f64 { default: 0.0, range: -360.0..=360.0, unit: "deg" },
        /// Factor on all lengths.
        scale: f64 { default: 1.0, range: 1e-9..=1e9, logarithmic: true },
        /// The axis that is turned round.
        mirror: Mirror { default: Mirror::None },
        /// What stays in place but for the move: the origin of coordinates, or the middle of the
        /// cloud's box.
        about: About { default: About::Origin },
    }
}

/// The tool.
pub(crate) struct Transform;

impl Tool for Transform {
    const INFO: UnitInfo =
        UnitInfo::new("transform", "Transform", "Moves, turns, scales and mirrors a cloud.");
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn run(&mut self, cloud: &CloudView<'_>, params: &Settings, job: &Job<'_>) -> Result<()> {
        let placement = Placement::of(params)?;
        let positions: Vec<Vec3> = cloud.vectors(POSITION).collect();
        let bounds = Bounds::of_positions(&positions)
            .ok_or_else(|| Error::new("expected surfels, found an empty cloud"))?;
        let about = match params.about {
            About::Origin => DVec3::ZERO,
            About::Centre => cloud.origin + bounds.centre(),
        };
        placement.about(about).stage(cloud, job, "")
    }
}

/// A map of places: `p -> linear (p - pivot) + pivot + move`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placement {
    pub(crate) linear: Similarity,
    /// Where the origin of coordinates comes to lie, scene units.
    pub(crate) translation: DVec3,
}

impl Placement {
    fn of(params: &Settings) -> Result<Self> {
        let number = |id: &str, value: f64| finite(id, value);
        let translation = DVec3::new(
            number("translate-x", params.translate_x)?,
            number("translate-y", params.translate_y)?,
            number("translate-z", params.translate_z)?,
        );
        let angles = [
            number("rotate-x", params.rotate_x)?,
            number("rotate-y", params.rotate_y)?,
            number("rotate-z", params.rotate_z)?,
        ];
        let scale = number("scale", params.scale)?;
        if scale <= 0.0 {
            return Err(Error::new(format!("expected a `scale` above 0, found {scale}")));
        }
        let mirror = DMat3::from_diagonal(match params.mirror {
            Mirror::None => DVec3::ONE,
            Mirror::X => DVec3::new(-1.0, 1.0, 1.0),
            Mirror::Y => DVec3::new(1.0, -1.0, 1.0),
            Mirror::Z => DVec3::new(1.0, 1.0, -1.0),
        });
        let [x, y, z] = angles.map(quarter_exact);
        let about_x =
            DMat3::from_cols(DVec3::X, DVec3::new(0.0, x.1, x.0), DVec3::new(0.0, -x.0, x.1));
        let about_y =
            DMat3::from_cols(DVec3::new(y.1, 0.0, -y.0), DVec3::Y, DVec3::new(y.0, 0.0, y.1));
        let about_z =
            DMat3::from_cols(DVec3::new(z.1, z.0, 0.0), DVec3::new(-z.0, z.1, 0.0), DVec3::Z);
        let turn = about_z * about_y * about_x * mirror;
        Ok(Self { linear: Similarity { scale, turn }, translation })
    }

    /// A rigid motion.
    pub(crate) fn rigid(turn: DQuat, translation: DVec3) -> Self {
        Self { linear: Similarity { scale: 1.0, turn: DMat3::from_quat(turn) }, translation }
    }

    /// The same map with this place in the part of the origin.
    fn about(self, pivot: DVec3) -> Self {
        let translation = self.translation + (pivot - self.linear.matrix() * pivot);
        Self { translation, ..self }
    }

    fn is_move(&self) -> bool {
        self.linear.turn == DMat3::IDENTITY && self.linear.scale.to_bits() == 1f64.to_bits()
    }

    /// Stages the cloud under the map, and says so, with these words behind.
    pub(crate) fn stage(&self, cloud: &CloudView<'_>, job: &Job<'_>, words: &str) -> Result<()> {
        job.progress(0.9, "moving surfels");
        job.check()?;
        let mut said = format!("{} surfels", cloud.len);
        if !cloud.faces.is_empty() {
            said += &format!("; {} triangles are left out", cloud.faces.len());
        }
        said += words;
        if self.is_move() {
            let columns = cloud.columns.iter().map(unchanged).collect();
            let origin = cloud.origin + self.translation;
            if !origin.is_finite() {
                return Err(out_of_range());
            }
            job.progress(1.0, &said);
            return job.edit(&Edit::NewCloud { origin, columns });
        }
        // Offsets from the middle of the box, which rounds least.
        let positions: Vec<Vec3> = cloud.vectors(POSITION).collect();
        let middle = Bounds::of_positions(&positions).map_or(DVec3::ZERO, |box_of| box_of.centre());
        let matrix = self.linear.matrix();
        let origin = matrix * (cloud.origin + middle) + self.translation;
        let mut moved = Vec::with_capacity(cloud.columns.len());
        for column in &cloud.columns {
            job.check()?;
            let values = match (column.name, cloud.floats(column.name, 3)) {
                (POSITION, _) => {
                    Some(flat(positions.iter().map(|p| matrix * (p.as_dvec3() - middle))))
                }
                (TANGENT_U | TANGENT_V, Some(values)) => {
                    Some(rows(values, |t: [f64; 3]| (matrix * DVec3::from(t)).to_array()))
                }
                (NORMAL_FIELD, _) => self.field(cloud),
                _ => self.linear.moved(column),
            };
            if values.iter().flatten().any(|value| !value.is_finite()) {
                return Err(out_of_range());
            }
            moved.push(values);
        }
        let columns = cloud.columns.iter().zip(&moved).map(|(column, moved)| match moved {
            Some(values) => NewColumn { values: Values::F32(values), ..unchanged(column) },
            None => unchanged(column),
        });
        let columns = columns.collect();
        job.progress(1.0, &said);
        job.edit(&Edit::NewCloud { origin, columns })
    }

    /// Normal fields lie in the axes of the tangents; a mirror turns the normal that these have
    /// round, and so the field's numbers.
    fn field(&self, cloud: &CloudView<'_>) -> Option<Vec<f32>> {
        let values = cloud.floats(NORMAL_FIELD, 4)?;
        self.linear.mirrors().then(|| values.iter().map(|value| -value).collect())
    }
}

fn out_of_range() -> Error {
    Error::new("expected a transform whose result single precision can hold, found one beyond it")
}

/// A column as it is.
pub(crate) fn unchanged<'a>(column: &ColumnView<'a>) -> NewColumn<'a> {
    NewColumn { name: column.name, components: column.components, values: column.values }
}

/// Sine and cosine of an angle in degrees, exact for quarter turns.
fn quarter_exact(degrees: f64) -> (f64, f64) {
    match degrees.rem_euclid(360.0) {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        angle => angle.to_radians().sin_cos(),
    }
}
