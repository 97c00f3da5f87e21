//! What becomes of columns where a cloud is scaled and turned, by their roles.

use crate::cloud::buffer::Buffer;
use crate::cloud::splats::components_of;
use glam::{DMat3, DQuat, DVec3};
use rayon::prelude::*;
use std::sync::OnceLock;
use surfelshop_api::columns::{Element, Role, role_of};
use surfelshop_api::format::FileColumn;
use surfelshop_geometry::harmonics::{self, MAX_ORDER};

/// Rows that are worth a thread.
const LEAST: usize = 1 << 12;

/// The role of a column that nobody gave one: that of its name, where it holds floats and as many of them as the name
/// stands for.
pub(crate) fn natural_role(name: &str, element: Element, components: u32) -> Role {
    let fits = is_float(element)
        && components_of(name).is_some_and(|allowed| allowed.contains(&components));
    if fits { role_of(name) } else { Role::Plain }
}

/// The role of a column of a file.
pub(crate) fn role_in_file(column: &FileColumn) -> Role {
    match column.role {
        role if role == Role::Plain || role == role_of(&column.name) => {
            natural_role(&column.name, column.element, column.components)
        }
        role => role,
    }
}

fn is_float(element: Element) -> bool {
    matches!(element, Element::F32 | Element::F64)
}

/// Whether a column of this type can be scaled and turned in a role.
pub(crate) fn can_have(role: Role, element: Element, components: u32) -> bool {
    let is_moved = !matches!(role, Role::Plain | Role::Radiance);
    has_components(role, components) && (is_float(element) || !is_moved)
}

/// Whether a role can have so many components.
fn has_components(role: Role, components: u32) -> bool {
    match role {
        Role::Plain | Role::Length | Role::LogLength | Role::Radiance => true,
        Role::Direction => components == 3,
        Role::Quaternion => components == 4,
        Role::SphericalHarmonics(order) => {
            usize::from(order) <= MAX_ORDER && components.is_multiple_of(2 * u32::from(order) + 1)
        }
    }
}

/// What a column of this role must be to be scaled and turned.
fn expected(role: Role) -> &'static str {
    match role {
        Role::Direction => "directions of three f32 or f64",
        Role::Quaternion => "rotations of four f32 or f64",
        Role::SphericalHarmonics(_) => {
            "spherical harmonics of an order up to 5, 2 l + 1 coefficients of f32 or f64 each"
        }
        _ => "lengths of f32 or f64",
    }
}

/// Why a column cannot be scaled or turned.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Misfit {
    pub(crate) expected: &'static str,
    pub(crate) found: String,
}

/// Says what is wrong with a column of a file that is turned, or has a role that it cannot have.
pub(crate) fn misfit(column: &FileColumn, is_turned: bool) -> Option<Misfit> {
    let role = role_in_file(column);
    let FileColumn { name, components, element, .. } = column;
    let fits = has_components(role, *components)
        && (is_float(*element) || !is_turned || !Motion::turns(role));
    let found = || format!("column `{name}` of {components} x {}", element.name());
    (!fits).then(|| Misfit { expected: expected(role), found: found() })
}

/// A scale and a rotation, as they act on columns.
pub(crate) struct Motion {
    rotation: DQuat,
    scale: f64,
    harmonics: [OnceLock<Vec<f64>>; MAX_ORDER + 1],
}

impl Motion {
    /// A unit quaternion and a factor above 0.
    pub(crate) fn new(rotation: DQuat, scale: f64) -> Self {
        Self { rotation, scale, harmonics: Default::default() }
    }

    /// Whether a rotation changes values of a role.
    fn turns(role: Role) -> bool {
        match role {
            Role::Direction | Role::Quaternion => true,
            Role::SphericalHarmonics(order) => order > 0,
            Role::Plain | Role::Length | Role::LogLength | Role::Radiance => false,
        }
    }

    /// The values after it; `None` where they stay as they are.
    ///
    /// # Errors
    /// Where values of this role cannot be of this type, or a length no longer fits it.
    pub(crate) fn moved(
        &self,
        (name, role, components): (&str, Role, u32),
        values: &Buffer,
    ) -> Result<Option<Buffer>, Misfit> {
        let is_scaled = self.scale.to_bits() != 1f64.to_bits();
        let is_turned = self.rotation.xyz() != DVec3::ZERO;
        let changes = match role {
            Role::Length | Role::LogLength => is_scaled,
            role => is_turned && Self::turns(role),
        };
        if !changes {
            return Ok(None);
        }
        let found = || format!("column `{name}` of {components} x {}", values.element().name());
        let refused = || Misfit { expected: expected(role), found: found() };
        if !has_components(role, components) {
            return Err(refused());
        }
        let moved = match values {
            Buffer::F32(values) => self.floats(role, components, values).map(Buffer::F32),
            Buffer::F64(values) => self.floats(role, components, values).map(Buffer::F64),
            _ => return Err(refused()),
        };
        moved.map(Some).ok_or_else(|| Misfit {
            expected: "a scale that the types of columns can hold",
            found: format!("{:e}, which column `{name}` cannot hold", self.scale),
        })
    }

    /// The values after it; `None` where one is no longer finite that was.
    fn floats<T: Float>(&self, role: Role, components: u32, values: &[T]) -> Option<Vec<T>> {
        match role {
            Role::Length => {
                let scaled = |value: &T| {
                    let scaled = T::narrow(value.wide() * self.scale);
                    (scaled.wide().is_finite() || !value.wide().is_finite()).then_some(scaled)
                };
                values.par_iter().with_min_len(LEAST).map(scaled).collect()
            }
            Role::LogLength => {
                let more = self.scale.ln();
                let longer = |value: &T| T::narrow(value.wide() + more);
                Some(values.par_iter().with_min_len(LEAST).map(longer).collect())
            }
            Role::Direction => {
                let matrix = DMat3::from_quat(self.rotation);
                Some(rows(values, 3, |given, turned| {
                    let direction = DVec3::new(given[0].wide(), given[1].wide(), given[2].wide());
                    store(&(matrix * direction).to_array(), turned);
                }))
            }
            Role::Quaternion => Some(rows(values, 4, |given, turned| {
                let [x, y, z, w] = [0, 1, 2, 3].map(|i| given[i].wide());
                // The rotation may have any length, and keeps it.
                store(&product(self.rotation, DQuat::from_xyzw(x, y, z, w)), turned);
            })),
            Role::SphericalHarmonics(order) => {
                let order = usize::from(order);
                let matrix = self.harmonics.get(order)?;
                let matrix = matrix.get_or_init(|| {
                    let turn = DMat3::from_quat(self.rotation);
                    harmonics::rotation(order, turn).unwrap_or_default()
                });
                let n_channels = components as usize / (2 * order + 1);
                Some(rows(values, components as usize, |given, turned| {
                    turn_harmonics(matrix, n_channels, given, turned);
                }))
            }
            Role::Plain | Role::Radiance => Some(values.to_vec()),
        }
    }
}

/// The product of two quaternions, neither of which has to have unit length.
fn product(a: DQuat, b: DQuat) -> [f64; 4] {
    let (u, v) = (a.xyz(), b.xyz());
    let xyz = a.w * v + b.w * u + u.cross(v);
    [xyz.x, xyz.y, xyz.z, a.w * b.w - u.dot(v)]
}

/// Coefficients of one order and some channels under the matrix of a rotation.
fn turn_harmonics<T: Float>(matrix: &[f64], n_channels: usize, given: &[T], turned: &mut [T]) {
    let n = given.len() / n_channels;
    for (row, turned) in matrix.chunks_exact(n).zip(turned.chunks_exact_mut(n_channels)) {
        for (channel, turned) in turned.iter_mut().enumerate() {
            let of_channel = given.iter().skip(channel).step_by(n_channels);
            *turned = T::narrow(row.iter().zip(of_channel).map(|(m, c)| m * c.wide()).sum());
        }
    }
}

/// What a map makes of each row of so many values.
fn rows<T: Float>(values: &[T], n: usize, map: impl Fn(&[T], &mut [T]) + Sync) -> Vec<T> {
    let mut made = vec![T::default(); values.len()];
    let places = made.par_chunks_exact_mut(n).zip(values.par_chunks_exact(n)).with_min_len(LEAST);
    places.for_each(|(made, given)| map(given, made));
    made
}

fn store<T: Float>(from: &[f64], to: &mut [T]) {
    to.iter_mut().zip(from).for_each(|(to, &from)| *to = T::narrow(from));
}

/// Floats of either width.
trait Float: Copy + Default + Send + Sync {
    fn wide(self) -> f64;
    fn narrow(wide: f64) -> Self;
}

impl Float for f32 {
    fn wide(self) -> f64 {
        f64::from(self)
    }

    fn narrow(wide: f64) -> Self {
        wide as Self
    }
}

impl Float for f64 {
    fn wide(self) -> f64 {
        self
    }

    fn narrow(wide: f64) -> Self {
        wide
    }
}
