//! Gaussian splats: attributes of points by the extension `KHR_gaussian_splatting`.
//!
//! Source: Khronos Group, `KHR_gaussian_splatting`.

use crate::accessor::{Accessor, Reader};
use crate::attributes;
use crate::buffers::Buffers;
use crate::decode::floats;
use crate::extensions;
use crate::names::Names;
use gltf::json::Root;
use gltf::json::mesh::Primitive;
use surfelshop_api::columns::{Element, OPACITY, SH, SPLAT_ROTATION, SPLAT_SCALE};
use surfelshop_api::format::FileColumn;
use surfelshop_api::glam::{DMat3, DQuat, DVec3};
use surfelshop_api::prelude::{Error, Result};
use surfelshop_geometry::{eigen, harmonics};

/// How far from 1 and 0 products of a similarity's columns may be.
const TOLERANCE: f64 = 1e-6;

/// A part of what splats consist of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    Opacity,
    Scale,
    Rotation,
    /// Spherical harmonics of an order.
    Harmonics(usize),
}

impl Part {
    /// The column of it.
    pub(crate) fn column(self) -> FileColumn {
        let (name, components) = match self {
            Self::Opacity => (OPACITY, 1),
            Self::Scale => (SPLAT_SCALE, 3),
            Self::Rotation => (SPLAT_ROTATION, 4),
            // At most 3.
            Self::Harmonics(order) => (SH[order], 3 * (2 * order as u32 + 1)),
        };
        FileColumn::new(name, components, Element::F32)
    }
}

/// The accessors of a primitive's splats.
#[derive(Debug)]
pub(crate) struct Splats {
    opacity: Accessor,
    scale: Accessor,
    rotation: Accessor,
    /// Of each order, from m = -l to l.
    harmonics: Vec<Vec<Accessor>>,
}

impl Splats {
    /// Finds the splats of a primitive with so many points; `None` where it is of none, or not all of them is there.
    ///
    /// # Errors
    /// Where an accessor is not there.
    pub(crate) fn find(
        (root, buffers): (&Root, &Buffers),
        primitive: &Primitive,
        names: &Names,
        count: u32,
        lines: &mut Vec<String>,
    ) -> Result<Option<Self>> {
        let Some(extension) = extensions::splats(primitive) else { return Ok(None) };
        let mut part = |name: &str, components: usize| {
            let full = format!("{}:{name}", extensions::SPLATS);
            let Some(index) = names.accessor(&full) else { return Ok(None) };
            let accessor = Accessor::find(root, buffers, index)?;
            let found = Some(accessor).filter(|accessor| accessor.shape.components == components);
            if found.is_none() {
                attributes::say(
                    lines,
                    format!("{full} was left out: expected {components} components"),
                );
            }
            Ok::<_, Error>(attributes::checked(&full, found, count, lines))
        };
        let (opacity, scale, rotation) =
            (part("OPACITY", 1)?, part("SCALE", 3)?, part("ROTATION", 4)?);
        let mut harmonics = Vec::new();
        for order in 0..SH.len() {
            let all = (0..=2 * order).map(|k| part(&format!("SH_DEGREE_{order}_COEF_{k}"), 3));
            let all: Vec<Option<Accessor>> = all.collect::<Result<_>>()?;
            let Some(all) = all.into_iter().collect::<Option<Vec<_>>>() else { break };
            harmonics.push(all);
        }
        let (Some(opacity), Some(scale), Some(rotation)) = (opacity, scale, rotation) else {
            attributes::say(
                lines,
                "Gaussians without an opacity, scale or rotation of each point were read as points"
                    .to_owned(),
            );
            return Ok(None);
        };
        let text = |name: &str| extension.get(name).and_then(|value| value.as_str());
        if let Some(kernel) = text("kernel").filter(|kernel| *kernel != "ellipse") {
            let kernel: String = kernel.escape_debug().take(40).collect();
            attributes::say(
                lines,
                format!("splats of the kernel `{kernel}` were read as ellipses"),
            );
        }
        if let Some(space) = text("colorSpace").filter(|space| !space.starts_with("srgb_rec709")) {
            let space: String = space.escape_debug().take(40).collect();
            attributes::say(
                lines,
                format!("the splats' colours of the space `{space}` were read as sRGB"),
            );
        }
        Ok(Some(Self { opacity, scale, rotation, harmonics }))
    }

    /// Of these accessors, of one element a splat; harmonics by order, from m = -l to l.
    pub(crate) fn of(
        opacity: Accessor,
        scale: Accessor,
        rotation: Accessor,
        harmonics: Vec<Vec<Accessor>>,
    ) -> Self {
        Self { opacity, scale, rotation, harmonics }
    }

    /// The orders of spherical harmonics, without a gap from 0 on.
    pub(crate) fn n_orders(&self) -> usize {
        self.harmonics.len()
    }
}

/// What a node's matrix does to splats.
enum Movement {
    Nothing,
    Similarity {
        scale: f64,
        rotation: DQuat,
    },
    /// Any other.
    Linear(DMat3),
}

/// Splats that are read where a node shows them.
pub(crate) struct SplatReader<'a> {
    opacity: Reader<'a>,
    scale: Reader<'a>,
    rotation: Reader<'a>,
    harmonics: Vec<Vec<Reader<'a>>>,
    movement: Movement,
    /// Of each order the matrix that turns its coefficients; none where nothing turns.
    turns: Vec<Vec<f64>>,
}

impl<'a> SplatReader<'a> {
    /// Ready to be read.
    ///
    /// # Errors
    /// As [`Accessor::reader`].
    pub(crate) fn new(splats: &'a Splats, matrix: DMat3, buffers: &'a Buffers) -> Result<Self> {
        let of_order = |all: &'a Vec<Accessor>| -> Result<Vec<_>> {
            all.iter().map(|accessor| accessor.reader(buffers)).collect()
        };
        let turn = if matrix == DMat3::IDENTITY { None } else { turn(matrix) };
        let orders = 0..splats.n_orders();
        let turns =
            turn.map(|turn| orders.map(move |l| harmonics::rotation(l, turn).unwrap_or_default()));
        Ok(Self {
            opacity: splats.opacity.reader(buffers)?,
            scale: splats.scale.reader(buffers)?,
            rotation: splats.rotation.reader(buffers)?,
            harmonics: splats.harmonics.iter().map(of_order).collect::<Result<_>>()?,
            movement: movement(matrix),
            turns: turns.map(Iterator::collect).unwrap_or_default(),
        })
    }

    /// The values of a part of `n` splats from the `first` on, for a column with so many components.
    ///
    /// # Errors
    /// Where memory runs out, or the system refuses.
    pub(crate) fn values(
        &self,
        part: Part,
        components: usize,
        first: u32,
        n: usize,
    ) -> Result<Vec<f32>> {
        let numbers = |reader: &Reader<'_>| -> Result<Vec<f64>> {
            Ok(floats(&reader.elements(first, n)?, reader.shape()))
        };
        let narrow = |values: Vec<f64>| values.into_iter().map(|value| value as f32).collect();
        match (part, &self.movement) {
            (Part::Opacity, _) => Ok(narrow(numbers(&self.opacity)?)),
            (Part::Scale, Movement::Nothing) => Ok(narrow(numbers(&self.scale)?)),
            (Part::Rotation, Movement::Nothing) => Ok(narrow(numbers(&self.rotation)?)),
            (Part::Scale, Movement::Similarity { scale, .. }) => {
                Ok(narrow(numbers(&self.scale)?.into_iter().map(|s| s * scale).collect()))
            }
            (Part::Rotation, Movement::Similarity { rotation, .. }) => {
                let turned = |q: &[f64; 4]| (*rotation * DQuat::from_array(*q)).to_array();
                let own = numbers(&self.rotation)?;
                Ok(narrow(own.as_chunks().0.iter().flat_map(turned).collect()))
            }
            (Part::Scale | Part::Rotation, Movement::Linear(matrix)) => {
                let (scales, rotations) = (numbers(&self.scale)?, numbers(&self.rotation)?);
                let splats = scales.as_chunks().0.iter().zip(rotations.as_chunks().0);
                let moved = splats.map(|(scale, q)| ellipsoid(*matrix, *scale, *q));
                Ok(match part {
                    Part::Scale => narrow(moved.flat_map(|(scale, _)| scale).collect()),
                    _ => narrow(moved.flat_map(|(_, q)| q).collect()),
                })
            }
            (Part::Harmonics(order), _) => {
                let mut made = vec![0.0; n * components];
                if let Some(readers) = self.harmonics.get(order) {
                    self.harmonics(order, readers, first, &mut made)?;
                }
                Ok(made)
            }
        }
    }

    /// Fills in the coefficients of an order, of each splat together.
    fn harmonics(
        &self,
        order: usize,
        readers: &[Reader<'_>],
        first: u32,
        made: &mut [f32],
    ) -> Result<()> {
        let n = 2 * order + 1;
        for (k, reader) in readers.iter().enumerate() {
            let bytes = reader.elements(first, made.len() / (3 * n))?;
            let values = floats(&bytes, reader.shape());
            // Files have the Condon-Shortley sign of odd m.
            let sign = if (order + k).is_multiple_of(2) { 1.0 } else { -1.0 };
            for (made, value) in made.chunks_exact_mut(3 * n).zip(values.as_chunks::<3>().0) {
                made[3 * k..3 * k + 3].copy_from_slice(&value.map(|v| sign * v as f32));
            }
        }
        let Some(matrix) = self.turns.get(order).filter(|_| order > 0) else { return Ok(()) };
        let mut before = Vec::new();
        for made in made.chunks_exact_mut(3 * n) {
            before.clear();
            before.extend_from_slice(made);
            for (row, turned) in matrix.chunks_exact(n).zip(made.as_chunks_mut::<3>().0) {
                for (channel, turned) in turned.iter_mut().enumerate() {
                    let of_channel = before.iter().skip(channel).step_by(3);
                    let sum: f64 = row.iter().zip(of_channel).map(|(m, c)| m * f64::from(*c)).sum();
                    *turned = sum as f32;
                }
            }
        }
        Ok(())
    }
}

/// What a matrix does to splats.
fn movement(matrix: DMat3) -> Movement {
    if matrix == DMat3::IDENTITY {
        return Movement::Nothing;
    }
    let scale = matrix.x_axis.length();
    if !scale.is_finite() || scale <= 0.0 {
        return Movement::Linear(matrix);
    }
    let turn = matrix * (1.0 / scale);
    let off = (turn.transpose() * turn - DMat3::IDENTITY).to_cols_array();
    if off.iter().any(|number| number.abs() > TOLERANCE) {
        return Movement::Linear(matrix);
    }
    // An ellipsoid is its own mirror image through its centre.
    let proper = if turn.determinant() < 0.0 { turn * -1.0 } else { turn };
    Movement::Similarity { scale, rotation: DQuat::from_mat3(&proper).normalize() }
}

/// Standard deviations and axes of an ellipsoid after a linear map.
fn ellipsoid(matrix: DMat3, scale: [f64; 3], q: [f64; 4]) -> ([f64; 3], [f64; 4]) {
    let q = DQuat::from_array(q);
    let length = q.length();
    let turns = length.is_finite() && length > 0.0;
    let axes = DMat3::from_quat(if turns { q / length } else { DQuat::IDENTITY });
    let spread = matrix * axes * DMat3::from_diagonal(DVec3::from_array(scale));
    let covariance = spread * spread.transpose();
    if !covariance.is_finite() {
        return ([f64::NAN; 3], DQuat::IDENTITY.to_array());
    }
    let found = eigen::symmetric(covariance);
    let [x, y, z] = found.vectors;
    let z = if x.cross(y).dot(z) < 0.0 { -z } else { z };
    let rotation = DQuat::from_mat3(&DMat3::from_cols(x, y, z)).normalize();
    (found.values.map(|value| value.max(0.0).sqrt()), rotation.to_array())
}

/// How a matrix turns directions: the orthogonal matrix next to it, which mirrors where it does. `None` where it
/// flattens.
///
/// Source: Higham 1986, "Computing the Polar Decomposition with Applications".
fn turn(matrix: DMat3) -> Option<DMat3> {
    let mut turn = matrix;
    for _ in 0..60 {
        let determinant = turn.determinant();
        if !determinant.is_finite() || determinant == 0.0 {
            return None;
        }
        let next = (turn + turn.inverse().transpose()) * 0.5;
        let step = (next - turn).to_cols_array().iter().map(|number| number.abs()).sum::<f64>();
        turn = next;
        if step < 1e-14 {
            break;
        }
    }
    turn.is_finite().then_some(turn)
}
