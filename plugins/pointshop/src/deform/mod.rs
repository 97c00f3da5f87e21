//! # `deform`: bends a cloud by a lattice of control points
//!
//! | parameter | type  | default | meaning                                                          |
//! |-----------|-------|---------|------------------------------------------------------------------|
//! | `lattice` | text  | `2 2 2` | how many control points there are and which are moved, see below  |
//! | `file`    | file  |         | a text file with the same, instead                               |
//!
//! The text is numbers: k, l and m, at least 2 each and at most 32, the control points along x, y and z;
//! then, for each that is moved, i, j and k from 0, and how far it is moved along x, y and z, in shares
//! of the cloud's box. Numbers stand apart by spaces, commas or new lines; `#` begins a comment. `2 2 2
//! 1 1 1 0 0 0.5` pulls the corner of the largest x, y and z up by half the box's height. The lattice is the box of the
//! cloud.
//!
//! Method. Places are blended from the control points by Bernstein polynomials, in f64. Each surfel
//! becomes the ellipse that the map's derivative makes of it: tangents by the derivative, normals by
//! its cofactors, radii by the longer half axis; clip lines stay on what they cut. Discs that are not
//! stretched unevenly by more than a thousandth stay discs where the cloud has no tangents.
//!
//! Limits: a map that turns the cloud inside out somewhere is refused. Triangles of a mesh are left out,
//! normal fields of Phong splats become flat, and Gaussian splats are refused.
//!
//! Source: Sederberg and Parry, "Free-form deformation of solid geometric models", SIGGRAPH 1986.
//!
//! ```text
//! surfelshop bake model.ply -t deform --set lattice="2 2 3  0 0 2 0.3 0 0  1 0 2 0.3 0 0" -o bent.ply
//! ```

pub(crate) mod lattice;

use crate::deform::lattice::Lattice;
use crate::linear::{cofactors, half_axes};
use crate::surfels::{Surfels, flat};
use crate::transform::unchanged;
use surfelshop_api::columns::{
    CLIP, NORMAL, NORMAL_FIELD, POSITION, RADIUS, SPLAT_SCALE, TANGENT_U, TANGENT_V, Values,
};
use surfelshop_api::glam::{DMat3, DVec2, DVec3, Vec3};
use surfelshop_api::prelude::*;
use surfelshop_api::tool::NewColumn;
use surfelshop_geometry::Bounds;

params! {
    /// Settings of `deform`.
    pub struct Settings {
        /// Control points along x, y and z, and then, of each that is moved: its numbers along x, y
        /// and z, from 0, and how far, in shares of the box: `2 2 2 1 1 1 0 0 0.5`.
        lattice: String { default: "2 2 2".to_owned() },
        /// A text file with the same, which counts instead.
        file: FilePath { default: FilePath::default(), endings: &["txt"] },
    }
}

/// The tool.
pub(crate) struct Deform;

/// A surfel under the map.
struct Bent {
    place: DVec3,
    normal: DVec3,
    tangents: [DVec3; 2],
    /// See [`half_axes`].
    turn: DVec2,
    /// Determinant of the derivative.
    volume: f64,
}

impl Tool for Deform {
    const INFO: UnitInfo =
        UnitInfo::new("deform", "Deform by a lattice", "Bends a cloud by moved control points.");
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn run(&mut self, cloud: &CloudView<'_>, params: &Settings, job: &Job<'_>) -> Result<()> {
        let surfels = Surfels::of(cloud)?;
        if cloud.column(SPLAT_SCALE).is_some() {
            return Err(Error::new("expected a cloud of surfels, found Gaussian splats"));
        }
        let lattice = lattice(params)?;
        let positions: Vec<Vec3> = cloud.vectors(POSITION).collect();
        let bounds = Bounds::of_positions(&positions)
            .ok_or_else(|| Error::new("expected finite positions, found none"))?;
        // A flat cloud has no height to share; its lattice is as high as it is wide.
        let extent = bounds.extent();
        let size = bounds.size().map(|size| if size > 1e-9 * extent { size } else { extent });
        let size = if extent > 0.0 { size } else { DVec3::ONE };
        job.progress(0.0, "bending surfels");
        let tangents = tangents(cloud, &surfels);
        let bent = job.map(cloud.len, 0.0..0.9, |i| {
            let share = (surfels.places[i] - bounds.min) / size;
            let (offset, slope) = lattice.offset(share);
            // The derivative of `p + size * offset((p - min) / size)`.
            let slope = DMat3::from_diagonal(size) * slope * DMat3::from_diagonal(1.0 / size);
            let map = DMat3::IDENTITY + slope;
            let [u, v] = tangents[i];
            let (u, v, turn) = half_axes(map * u, map * v);
            Bent {
                place: surfels.places[i] + size * offset,
                normal: (cofactors(map) * surfels.normals[i]).normalize_or(surfels.normals[i]),
                tangents: [u, v],
                turn,
                volume: map.determinant(),
            }
        })?;
        let n_inside_out = bent.iter().filter(|bent| bent.volume <= 0.0).count();
        if n_inside_out > 0 {
            return Err(Error::new(format!(
                "expected a lattice that folds nothing over, found {n_inside_out} of {} surfels \
                 turned inside out; move its points less, or their neighbours along with them",
                bent.len()
            )));
        }
        stage(cloud, &bent, job)
    }
}

/// The half axes of each surfel; of a disc any two.
fn tangents(cloud: &CloudView<'_>, surfels: &Surfels) -> Vec<[DVec3; 2]> {
    let (us, vs) = (cloud.vectors(TANGENT_U), cloud.vectors(TANGENT_V));
    if us.len() == cloud.len && vs.len() == cloud.len {
        return us.zip(vs).map(|(u, v)| [u.as_dvec3(), v.as_dvec3()]).collect();
    }
    let of = |(i, normal): (usize, &DVec3)| {
        let (u, v) = normal.any_orthonormal_pair();
        let radius = surfels.radii.get(i).copied().unwrap_or(0.0);
        [radius * u, radius * v]
    };
    surfels.normals.iter().enumerate().map(of).collect()
}

fn lattice(params: &Settings) -> Result<Lattice> {
    if params.file.is_empty() {
        return Lattice::read(&params.lattice);
    }
    let text = std::fs::read_to_string(&params.file).at(&params.file)?;
    Lattice::read(&text).map_err(|error| error.at(&params.file))
}

/// Stretches by less than this share leave discs round.
const ROUND: f64 = 1e-3;

fn stage(cloud: &CloudView<'_>, bent: &[Bent], job: &Job<'_>) -> Result<()> {
    let is_elliptical =
        cloud.floats(TANGENT_U, 3).is_some() && cloud.floats(TANGENT_V, 3).is_some();
    let lengths = |bent: &Bent| bent.tangents.map(DVec3::length);
    let uneven = bent.iter().map(lengths).any(|[u, v]| v < (1.0 - ROUND) * u);
    let radii: Vec<f32> = bent.iter().map(|bent| lengths(bent)[0] as f32).collect();
    let mut columns = vec![
        (POSITION, 3, flat(bent.iter().map(|bent| bent.place))),
        (NORMAL, 3, flat(bent.iter().map(|bent| bent.normal))),
    ];
    if radii.iter().all(|&radius| radius > 0.0) {
        columns.push((RADIUS, 1, radii));
        if is_elliptical || uneven {
            columns.push((TANGENT_U, 3, flat(bent.iter().map(|bent| bent.tangents[0]))));
            columns.push((TANGENT_V, 3, flat(bent.iter().map(|bent| bent.tangents[1]))));
        }
    }
    if let Some(lines) = cloud.floats(CLIP, 7) {
        let turned = lines.chunks_exact(7).zip(bent).flat_map(|(lines, bent)| {
            let line = |at: usize| {
                let (a, b) = (f64::from(lines[at]), f64::from(lines[at + 1]));
                let (c, s) = (bent.turn.x, bent.turn.y);
                [(c * a + s * b) as f32, (c * b - s * a) as f32, lines[at + 2]]
            };
            let ([a, b, c], [d, e, f]) = (line(0), line(3));
            [a, b, c, d, e, f, lines[6]]
        });
        columns.push((CLIP, 7, turned.collect()));
    }
    if cloud.floats(NORMAL_FIELD, 4).is_some() {
        columns.push((NORMAL_FIELD, 4, vec![0.0; 4 * bent.len()]));
    }
    if columns.iter().flat_map(|(_, _, values)| values).any(|value| !value.is_finite()) {
        return Err(Error::new("expected a lattice whose result single precision can hold"));
    }
    job.check()?;
    let is_new = |name: &str| columns.iter().any(|(other, _, _)| *other == name);
    let others = cloud.columns.iter().filter(|column| !is_new(column.name)).map(unchanged);
    let changed = columns.iter().map(|(name, components, values)| NewColumn {
        name,
        components: *components,
        values: Values::F32(values),
    });
    let all = changed.chain(others).collect();
    let stretched = |share: f64| bent.iter().filter(|bent| bent.volume > share).count();
    let (n, larger) = (bent.len(), stretched(1.0));
    let mut said = format!("{n} surfels, {larger} of them where space grew");
    if !cloud.faces.is_empty() {
        said += &format!("; {} triangles are left out", cloud.faces.len());
    }
    job.progress(1.0, &said);
    job.edit(&Edit::NewCloud { origin: cloud.origin, columns: all })
}
