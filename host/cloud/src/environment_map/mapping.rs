//! Mappings between directions and the pixels of a probe.

use glam::{DVec2, DVec3, Vec3Swizzles as _};
use std::f64::consts::{PI, TAU};

/// How a picture shows all directions around a point.
///
/// Directions are those of probe space: right-handed, y up, -z in front.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Mapping {
    /// A disc whose radius grows with the angle from -z: centre -z, rim +z, right +x, top +y.
    ///
    /// Source: Debevec, "Light Probe Image Gallery", with the forward direction that its files
    /// have, which is -z; erratum T14.
    Angular,
    /// A photograph of a mirrored ball: as [`Angular`](Self::Angular), the radius being the sine of
    /// half the angle from -z.
    MirroredBall,
    /// Longitude and latitude: centre -z, right of it +x, top +y.
    LatLong,
    /// An unfolded cube, 3 faces wide and 4 high. From the top: +y; -x, -z and +x; -y; and +z
    /// upside down, as it continues -y downwards.
    VerticalCross,
    /// An unfolded cube, 4 faces wide and 3 high. From the top: +y above the second face of the
    /// row -x, -z, +x and +z; -y below it.
    HorizontalCross,
    /// An octahedron folded out to a square: centre +z, corners -z, right +x, bottom +y; texels lie
    /// inside the square, none of their centres on its border.
    ///
    /// Source: Meyer et al. 2010, "On Floating-Point Normal Vectors".
    Octahedral,
}

impl Mapping {
    /// All mappings.
    pub const ALL: [Self; 6] = [
        Self::Angular,
        Self::MirroredBall,
        Self::LatLong,
        Self::VerticalCross,
        Self::HorizontalCross,
        Self::Octahedral,
    ];

    /// Its name in files and on command lines.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Angular => "angular",
            Self::MirroredBall => "mirrored-ball",
            Self::LatLong => "lat-long",
            Self::VerticalCross => "vertical-cross",
            Self::HorizontalCross => "horizontal-cross",
            Self::Octahedral => "octahedral",
        }
    }

    /// The mapping of a name, where there is one.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|mapping| mapping.name() == name)
    }

    /// The unit direction that a point of the picture shows, u to the right and v down in [0, 1].
    ///
    /// `None` where it shows nothing: beyond the disc, in the empty parts of a cross, and outside
    /// the picture.
    #[must_use]
    pub fn direction(self, u: f64, v: f64) -> Option<DVec3> {
        if !(0.0..=1.0).contains(&u) || !(0.0..=1.0).contains(&v) {
            return None;
        }
        match self {
            Self::Angular | Self::MirroredBall => self.on_disc(2.0 * u - 1.0, 1.0 - 2.0 * v),
            Self::LatLong => {
                let (sine, cosine) = (PI * v).sin_cos();
                let (x, z) = (TAU * (u - 0.5)).sin_cos();
                Some(DVec3::new(sine * x, cosine, -sine * z))
            }
            Self::VerticalCross | Self::HorizontalCross => {
                let [columns, rows] = self.cells()?;
                let cell = |place: f64, n: u32| (place * f64::from(n)).min(f64::from(n) - 0.5);
                let (x, y) = (cell(u, columns), cell(v, rows));
                let at = [x.floor() as u32, y.floor() as u32];
                let face = self.faces().iter().find(|face| face.cell == at)?;
                // Measured from the cell's own corner, so that the picture's far edges are shown.
                let s = 2.0 * (u * f64::from(columns) - x.floor()) - 1.0;
                let t = 2.0 * (v * f64::from(rows) - y.floor()) - 1.0;
                Some((face.centre + s * face.right + t * face.down).normalize_or(DVec3::NEG_Z))
            }
            Self::Octahedral => Some(octahedral_decode(2.0 * u - 1.0, 2.0 * v - 1.0)),
        }
    }

    /// Where the picture shows a direction, which needs no unit length: u to the right and v down,
    /// in [0, 1].
    ///
    /// A direction shown at several places, such as +z on the rim of a disc, has one of them. A
    /// direction of length 0 or that is not finite is taken for -z.
    #[must_use]
    pub fn place(self, direction: DVec3) -> [f64; 2] {
        let d = near_unit(direction);
        match self {
            Self::Angular | Self::MirroredBall => {
                let s = d.xy().length();
                let angle = s.atan2(-d.z);
                let r = if self == Self::Angular { angle / PI } else { (0.5 * angle).sin() };
                // At the rim's own direction every point of the rim is right.
                let (a, b) = if s > 0.0 { (d.x / s, d.y / s) } else { (1.0, 0.0) };
                [0.5 + 0.5 * r * a, 0.5 - 0.5 * r * b]
            }
            Self::LatLong => {
                let horizontal = d.xz().length();
                let u = if horizontal > 0.0 { d.x.atan2(-d.z) / TAU } else { 0.0 };
                [u + 0.5, horizontal.atan2(d.y) / PI]
            }
            Self::VerticalCross | Self::HorizontalCross => {
                let (face, s, t) = self.place_on_cube(d);
                let [columns, rows] = self.cells().unwrap_or([1, 1]);
                [
                    (f64::from(face.cell[0]) + s) / f64::from(columns),
                    (f64::from(face.cell[1]) + t) / f64::from(rows),
                ]
            }
            Self::Octahedral => octahedral_encode(d).map(|p| 0.5 + 0.5 * p),
        }
    }

    /// The direction at a point of the unit disc, x right and y up; `None` beyond it.
    fn on_disc(self, a: f64, b: f64) -> Option<DVec3> {
        let r = DVec2::new(a, b).length();
        if r > 1.0 {
            return None;
        }
        let (sideways, forwards) = if self == Self::Angular {
            let (sine, cosine) = (PI * r).sin_cos();
            (if r > 0.0 { sine / r } else { PI }, cosine)
        } else {
            (2.0 * (1.0 - r * r).max(0.0).sqrt(), 1.0 - 2.0 * r * r)
        };
        Some(DVec3::new(sideways * a, sideways * b, -forwards))
    }

    /// Columns and rows of faces, of a cross.
    pub(super) const fn cells(self) -> Option<[u32; 2]> {
        match self {
            Self::VerticalCross => Some([3, 4]),
            Self::HorizontalCross => Some([4, 3]),
            _ => None,
        }
    }

    /// The faces of a cross; those of the vertical one for other mappings.
    const fn faces(self) -> &'static [Face; 6] {
        match self {
            Self::HorizontalCross => &HORIZONTAL,
            _ => &VERTICAL,
        }
    }

    /// The face of a cross that shows a direction, and where on it: right and down in [0, 1].
    pub(super) fn place_on_cube(self, direction: DVec3) -> (&'static Face, f64, f64) {
        let d = near_unit(direction);
        let faces = self.faces();
        let mut best = &faces[0];
        for face in faces {
            if face.centre.dot(d) > best.centre.dot(d) {
                best = face;
            }
        }
        let depth = best.centre.dot(d);
        let along = |axis: DVec3| (0.5 + 0.5 * axis.dot(d) / depth).clamp(0.0, 1.0);
        (best, along(best.right), along(best.down))
    }
}

/// One face of an unfolded cube.
#[derive(Debug)]
pub(super) struct Face {
    /// Column and row in the picture.
    pub(super) cell: [u32; 2],
    /// Direction of its centre, and of right and down on it.
    centre: DVec3,
    right: DVec3,
    down: DVec3,
}

const fn face(cell: [u32; 2], centre: DVec3, right: DVec3, down: DVec3) -> Face {
    Face { cell, centre, right, down }
}

const TOP: Face = face([1, 0], DVec3::Y, DVec3::X, DVec3::NEG_Z);
const LEFT: Face = face([0, 1], DVec3::NEG_X, DVec3::NEG_Z, DVec3::NEG_Y);
const FRONT: Face = face([1, 1], DVec3::NEG_Z, DVec3::X, DVec3::NEG_Y);
const RIGHT: Face = face([2, 1], DVec3::X, DVec3::Z, DVec3::NEG_Y);
const BOTTOM: Face = face([1, 2], DVec3::NEG_Y, DVec3::X, DVec3::Z);
static VERTICAL: [Face; 6] =
    [FRONT, LEFT, RIGHT, TOP, BOTTOM, face([1, 3], DVec3::Z, DVec3::X, DVec3::Y)];
static HORIZONTAL: [Face; 6] =
    [FRONT, LEFT, RIGHT, TOP, BOTTOM, face([3, 1], DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y)];

/// The direction with its largest component scaled to 1; -z where there is no such direction.
fn near_unit(direction: DVec3) -> DVec3 {
    let largest = direction.abs().max_element();
    if direction.is_finite() && largest > 0.0 { direction / largest } else { DVec3::NEG_Z }
}

/// Octahedral coordinates in [-1, 1] of a direction other than 0; its length does not matter.
///
/// Source: Meyer et al. 2010, "On Floating-Point Normal Vectors"; the same as
/// `octahedral_encode` of `shaders/surface/packing.wgsl`.
pub(super) fn octahedral_encode(n: DVec3) -> [f64; 2] {
    let sum = n.x.abs() + n.y.abs() + n.z.abs();
    let (x, y) = (n.x / sum, n.y / sum);
    if n.z >= 0.0 {
        return [x, y];
    }
    let sign = |value: f64| if value >= 0.0 { 1.0 } else { -1.0 };
    [(1.0 - y.abs()) * sign(x), (1.0 - x.abs()) * sign(y)]
}

/// The unit direction of octahedral coordinates in [-1, 1].
pub(super) fn octahedral_decode(x: f64, y: f64) -> DVec3 {
    on_octahedron(x, y).normalize_or(DVec3::NEG_Z)
}

/// The point of the octahedron `|x| + |y| + |z| = 1` of octahedral coordinates in [-1, 1].
pub(super) fn on_octahedron(x: f64, y: f64) -> DVec3 {
    let z = 1.0 - x.abs() - y.abs();
    let t = (-z).max(0.0);
    let inwards = |value: f64| if value >= 0.0 { value - t } else { value + t };
    DVec3::new(inwards(x), inwards(y), z)
}
