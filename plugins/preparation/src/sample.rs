//! # `sample`: surfels on the triangles of a mesh
//!
//! | parameter | type   | default      | meaning                                                    |
//! |-----------|--------|--------------|------------------------------------------------------------|
//! | `method`  | choice | `blue-noise` | `blue-noise`, `random`, or `vertices`: one at each vertex    |
//! | `count`   | int    | 0            | surfels; with `density` 0 too, as many as there are vertices |
//! | `density` | float  | 0            | instead: surfels per squared scene unit                     |
//! | `normals` | choice | `vertex`     | `vertex`: blended from the corners; `face`: of the triangle  |
//! | `radius`  | choice | `cover`      | `cover`: no holes; `area`: discs as large as the areas       |
//! | `factor`  | float  | 1            | factor on the radii                                        |
//! | `seed`    | int    | 1            | of the random places                                       |
//!
//! Method. `vertices` is the thesis's: each vertex becomes an element with a third of the area of
//! its triangles. The others choose places at random, uniform in area; `blue-noise` takes five times
//! as many as it needs and removes the most crowded one by one, and each surfel then stands for the
//! same area. Colours are blended in linear light and other numbers as they are; whole numbers
//! such as materials come from the nearest corner. The column `area` says what each stands for;
//! they add up to the mesh's area. The result is a cloud of its own, without triangles.
//!
//! `cover` estimates radii from the new points, or for `vertices` from the triangles; `area` makes
//! discs of the elements' areas, sqrt(area / pi) times `factor`, which leave holes below about
//! 1.5 for `blue-noise` and at any factor for `random`.
//!
//! Limits: distances are straight, so sides of a sheet thinner than the spacing thin each other.
//! Triangles without area get no surfels, nor do vertices without triangles; both are counted.
//!
//! Source: Liu 2006, section 2.8, after Bunnell 2005; Yuksel, "Sample Elimination for Generating
//! Poisson Disk Sample Sets", Eurographics 2015.
//!
//! ```text
//! surfelshop bake bunny.ply -t sample --set count=100000 -o surfels.ply
//! ```

use crate::blend::{ColumnValues, MeshSamples};
use crate::surfels::{finite, flat, floats, normals, positions, progress_of};
use surfelshop_api::columns::{NORMAL, POSITION, RADIUS, TANGENT_U, TANGENT_V};
use surfelshop_api::glam::Vec3;
use surfelshop_api::prelude::*;
use surfelshop_geometry::mesh::{self, MeshPoint};
use surfelshop_geometry::normals::is_valid;
use surfelshop_geometry::{radii, spread};

choices! {
    /// Where surfels come to lie.
    pub enum Method {
        /// Evenly apart.
        BlueNoise = "blue-noise",
        /// At random.
        Random = "random",
        /// At the vertices.
        Vertices = "vertices",
    }
}

choices! {
    /// Which normals surfels have.
    pub enum From {
        /// Those of the vertices, blended.
        Vertex = "vertex",
        /// That of the triangle.
        Face = "face",
    }
}

choices! {
    /// Which radii surfels have.
    pub enum Radius {
        /// They cover the surface.
        Cover = "cover",
        /// Discs have the areas that surfels stand for.
        Area = "area",
    }
}

params! {
    /// Settings of `sample`.
    pub struct Settings {
        /// Where surfels come to lie: evenly apart, at random, or at the vertices.
        method: Method { default: Method::BlueNoise },
        /// Number of surfels, but for method vertices; where both this and the density are 0, as
        /// many as there are vertices.
        count: u32 { default: 0, range: 0..=100_000_000 },
        /// Surfels per squared scene unit, instead of a count.
        density: f64 { default: 0.0, range: 0.0..=1e30 },
        /// Normals of the vertices, blended and made unit length, or of the triangles.
        normals: From { default: From::Vertex },
        /// Radii that cover the surface, or discs of the areas that surfels stand for.
        radius: Radius { default: Radius::Cover },
        /// Factor on the radii.
        factor: f64 { default: 1.0, range: 0.01..=100.0, logarithmic: true },
        /// Beginning of the random places.
        seed: u32 { default: 1, range: 0..=1_000_000_000 },
    }
}

/// Most surfels that are made: what a large machine's memory holds while they are chosen.
const MOST: f64 = 1e8;

/// Random places for each surfel that stays. More make little difference.
///
/// Source: Yuksel 2015, section 4.
const PLACES_FOR_EACH: usize = 5;

/// What an element of the mesh becomes.
struct Elements {
    places: Vec<MeshPoint>,
    /// Area of each, squared scene units.
    areas: Vec<f32>,
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    /// What was left out, in words.
    left_out: String,
}

/// The tool.
pub(crate) struct Sample;

impl Tool for Sample {
    const INFO: UnitInfo =
        UnitInfo::new("sample", "Sample a mesh", "Makes surfels on the triangles of a mesh.");
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn run(&mut self, cloud: &CloudView<'_>, params: &Settings, job: &Job<'_>) -> Result<()> {
        let positions = positions(cloud)?;
        has_faces(cloud)?;
        let factor = finite("factor", params.factor)?;
        let density = finite("density", params.density)?;
        if params.count > 0 && density > 0.0 {
            return Err(Error::new(format!(
                "expected a `count` or a `density`, found both ({} and {density}); leave one at 0",
                params.count
            )));
        }
        job.progress(0.0, "measuring triangles");
        job.check()?;
        let areas = mesh::areas(&positions, cloud.faces);
        let total: f64 = areas.iter().sum();
        if !(total > 0.0 && total.is_finite()) {
            return Err(Error::new("expected triangles with an area, found none that has any"));
        }
        let elements = match params.method {
            Method::Vertices => at_vertices(cloud, &positions, params, job)?,
            Method::BlueNoise | Method::Random => {
                let wanted = match (params.count, density > 0.0) {
                    (0, true) => (density * total).round(),
                    (0, false) => positions.len() as f64,
                    (count, _) => f64::from(count),
                };
                if !(1.0..=MOST).contains(&wanted) {
                    return Err(Error::new(format!(
                        "expected 1 to {MOST} surfels, found {wanted} for an area of {total}"
                    )));
                }
                let places = scattered(&positions, cloud, &areas, wanted as usize, params, job)?;
                blended(cloud, &positions, places, total, params, job)?
            }
        };
        let radii = radii_of(cloud, &positions, &elements, params, factor, job)?;
        stage(cloud, &elements, &radii, job)
    }
}

/// Refuses clouds without triangles.
pub(crate) fn has_faces(cloud: &CloudView<'_>) -> Result<()> {
    match cloud.faces.is_empty() {
        false => Ok(()),
        true => Err(Error::new(
            "expected a mesh, found a cloud without triangles; read one from a PLY, OBJ or OFF \
             file with faces",
        )),
    }
}

/// An element for each vertex that has a triangle.
fn at_vertices(
    cloud: &CloudView<'_>,
    positions: &[Vec3],
    params: &Settings,
    job: &Job<'_>,
) -> Result<Elements> {
    let areas = mesh::vertex_areas(positions, cloud.faces);
    job.check()?;
    let mut places: Vec<Option<MeshPoint>> = vec![None; positions.len()];
    for (index, face) in (0u32..).zip(cloud.faces) {
        for (corner, &vertex) in face.iter().enumerate() {
            let mut weights = [0.0; 3];
            weights[corner] = 1.0;
            places[vertex as usize].get_or_insert(MeshPoint { face: index, weights });
        }
    }
    let of_faces = mesh::vertex_normals(positions, cloud.faces);
    let given = normals(cloud);
    let mut elements = Elements {
        places: Vec::new(),
        areas: Vec::new(),
        positions: Vec::new(),
        normals: Vec::new(),
        left_out: String::new(),
    };
    for (vertex, place) in places.into_iter().enumerate() {
        let (Some(place), true) = (place, areas[vertex] > 0.0) else { continue };
        let own = given.get(vertex).filter(|_| params.normals == From::Vertex).copied();
        let normal = own.unwrap_or(of_faces[vertex]);
        elements.places.push(place);
        elements.areas.push(held(areas[vertex]));
        elements.positions.push(positions[vertex]);
        // Faces on both sides of a sheet cancel out, and it has no outside.
        elements.normals.push(if is_valid(normal) { normal } else { Vec3::Z });
    }
    let n_loose = positions.len() - elements.places.len();
    elements.left_out = format!("{n_loose} vertices without a triangle");
    Ok(elements)
}

/// Random places on the triangles.
fn scattered(
    positions: &[Vec3],
    cloud: &CloudView<'_>,
    areas: &[f64],
    count: usize,
    params: &Settings,
    job: &Job<'_>,
) -> Result<Vec<MeshPoint>> {
    let seed = u64::from(params.seed);
    if params.method == Method::Random {
        return Ok(mesh::scatter(
            areas,
            count,
            seed,
            &progress_of(job, 0.0..0.5, "choosing places"),
        )?);
    }
    let progress = progress_of(job, 0.0..0.1, "choosing places");
    let mut places = mesh::scatter(areas, count * PLACES_FOR_EACH, seed, &progress)?;
    let points = job.map(places.len(), 0.1..0.15, |place| {
        places[place].mean(positions, cloud.faces).as_vec3()
    })?;
    let progress = progress_of(job, 0.15..0.5, "removing the most crowded");
    let kept = spread::evenly(&points, count, areas.iter().sum(), seed, &progress)?;
    let mut kept = kept.into_iter();
    places.retain(|_| kept.next().unwrap_or(false));
    Ok(places)
}

/// Elements of equal area at places on triangles.
fn blended(
    cloud: &CloudView<'_>,
    positions: &[Vec3],
    places: Vec<MeshPoint>,
    total: f64,
    params: &Settings,
    job: &Job<'_>,
) -> Result<Elements> {
    let mut given = normals(cloud);
    if given.is_empty() {
        given = mesh::vertex_normals(positions, cloud.faces);
    }
    let of_faces = mesh::face_normals(positions, cloud.faces);
    job.check()?;
    let at = job.map(places.len(), 0.5..0.55, |place| {
        places[place].mean(positions, cloud.faces).as_vec3()
    })?;
    let normals = job.map(places.len(), 0.55..0.6, |index| {
        let place = &places[index];
        let of_face = of_faces[place.face as usize];
        match params.normals {
            From::Face => of_face,
            From::Vertex => place
                .mean(&given, cloud.faces)
                .try_normalize()
                .map_or(of_face, |normal| normal.as_vec3()),
        }
    })?;
    let n_empty = of_faces.iter().filter(|normal| **normal == Vec3::ZERO).count();
    let share = held(total / places.len().max(1) as f64);
    Ok(Elements {
        areas: vec![share; places.len()],
        positions: at,
        normals,
        left_out: format!("{n_empty} triangles without area"),
        places,
    })
}

/// Radii of the elements.
fn radii_of(
    cloud: &CloudView<'_>,
    positions: &[Vec3],
    elements: &Elements,
    params: &Settings,
    factor: f64,
    job: &Job<'_>,
) -> Result<Vec<f32>> {
    let of_area = |&area: &f32| (f64::from(area) / std::f64::consts::PI).sqrt();
    let found: Vec<f64> = match (params.radius, params.method) {
        (Radius::Area, _) => elements.areas.iter().map(of_area).collect(),
        (Radius::Cover, Method::Vertices) => {
            let radii = mesh::vertex_radii(positions, &normals(cloud), cloud.faces);
            let vertex = |place: &MeshPoint| {
                let corner = place.weights.iter().position(|&weight| weight > 0.0).unwrap_or(0);
                cloud.faces[place.face as usize][corner] as usize
            };
            elements.places.iter().map(|place| f64::from(radii[vertex(place)])).collect()
        }
        (Radius::Cover, Method::BlueNoise | Method::Random) => {
            let progress = progress_of(job, 0.6..0.9, "covering the surface");
            let radii = radii::estimate(&elements.positions, &elements.normals, &progress)?;
            radii.into_iter().map(f64::from).collect()
        }
    };
    let (least, most) = (f64::from(f32::MIN_POSITIVE), f64::from(f32::MAX));
    Ok(found.into_iter().map(|radius| (radius * factor).clamp(least, most) as f32).collect())
}

/// An area as its column holds it: squares of lengths may lie beyond the largest number.
fn held(area: f64) -> f32 {
    area.min(f64::from(f32::MAX)) as f32
}

/// Name of the column of areas, squared scene units.
const AREA: &str = "area";

/// Share of the work before columns are blended.
const BLENDING: f64 = 0.9;

/// Stages the elements as a cloud of their own, with all other columns of the mesh.
fn stage(cloud: &CloudView<'_>, elements: &Elements, radii: &[f32], job: &Job<'_>) -> Result<()> {
    // Tangents are directions in the discs of the vertices, which are gone.
    let made = [POSITION, NORMAL, RADIUS, AREA, TANGENT_U, TANGENT_V];
    let others: Vec<&ColumnView<'_>> =
        cloud.columns.iter().filter(|column| !made.contains(&column.name)).collect();
    let places = MeshSamples { places: &elements.places, faces: cloud.faces };
    job.progress(BLENDING, "blending columns");
    let step = (1.0 - BLENDING) / others.len().max(1) as f64;
    let mut blended: Vec<ColumnValues> = Vec::with_capacity(others.len());
    for (i, column) in others.iter().enumerate() {
        let begin = BLENDING + i as f64 * step;
        blended.push(places.blend(column, job, begin..begin + step)?);
    }
    job.check()?;
    let (positions, normals) = (flat(&elements.positions), flat(&elements.normals));
    let mut columns = vec![
        floats(POSITION, 3, &positions),
        floats(NORMAL, 3, &normals),
        floats(RADIUS, 1, radii),
        floats(AREA, 1, &elements.areas),
    ];
    let blended = others.iter().zip(&blended);
    columns.extend(blended.map(|(old, new)| new.column(old.name, old.components)));
    let n = radii.len();
    job.progress(1.0, &format!("{n} surfels; left out: {}", elements.left_out));
    job.edit(&Edit::NewCloud { origin: cloud.origin, columns })
}
