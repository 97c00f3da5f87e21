//! Sharp edges: what a mesh looks like, and how far splats of its samples are from it there.

use super::{bake_with, views_around};
use crate::{stage, twin};
use anyhow::{Context as _, Result};
use glam::{DVec3, Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh_from_tris;
use obvhs::ray::{Ray, RayHit};
use obvhs::triangle::Triangle;
use std::time::Duration;
use surfelshop_api::columns;
use surfelshop_api::graph::Output;
use surfelshop_api::params::Value;
use surfelshop_api::{Scene, UnitKind, View};
use surfelshop_cloud::{Buffer, Cloud, Column};
use surfelshop_render::RendererView;

/// Directions that solids are seen from.
const DIRECTIONS: [[f64; 3]; 3] = [[0.5, 0.6, 1.0], [-1.0, 0.5, 0.4], [0.3, -0.7, -1.0]];

/// Normals of neighbouring pixels that differ by more than this are an edge, degrees.
const EDGE_DEGREES: f32 = 30.0;

/// Pixels around an edge that count.
const AROUND: i64 = 1;

/// The baseline's lighting, of both pictures.
const LIT: twin::Phong =
    twin::Phong { diffuse: 1.0, specular: 0.25, shininess: 64.0, ambient: 0.08 };

/// How far splats are from the mesh at its edges.
#[derive(Clone, Copy, Debug, Default)]
pub struct AtEdges {
    /// Root mean square difference of radiance.
    pub radiance: f64,
    /// Root mean square angle between normals, degrees.
    pub normal_degrees: f64,
    /// Pixels of edges.
    pub n: usize,
    /// Root mean square difference of radiance everywhere else on the mesh.
    pub elsewhere: f64,
    /// Pixels beside the mesh that splats cover, as a share of those of the mesh.
    pub beyond: f64,
}

/// A mesh seen from several sides.
pub struct EdgeBench {
    triangles: Vec<Triangle>,
    bvh: CwBvh,
    scene: Scene,
    views: Vec<View>,
}

/// Samples of a mesh with the normals of its faces, made by the tool `sample`.
///
/// # Errors
/// Those of the tool.
pub fn sampled(mesh: &Cloud, count: usize) -> Result<Cloud> {
    let tool = stage::built_unit("surfelshop-preparation", UnitKind::Tool, "sample");
    let count = Value::Int(i64::try_from(count)?);
    let values = [("count", count), ("normals", Value::Text("face".to_owned()))];
    Ok(bake_with(&tool, mesh, &values)?.cloud)
}

/// An L-shaped prism: convex and concave edges and corners.
///
/// # Panics
/// Never: the columns have equal lengths.
#[must_use]
pub fn ell() -> Cloud {
    let outline = [[0.0, 0.0], [2.0, 0.0], [2.0, 0.8], [0.9, 0.8], [0.9, 1.7], [0.0, 1.7]];
    let (mut positions, mut faces): (Vec<f32>, Vec<[u32; 3]>) = (Vec::new(), Vec::new());
    let mut face = |corners: &[[f32; 3]]| {
        let first = (positions.len() / 3) as u32;
        positions.extend(corners.iter().flatten());
        faces.extend((2..corners.len() as u32).map(|i| [first, first + i - 1, first + i]));
    };
    for i in 0..outline.len() {
        let ([a, b], [c, d]) = (outline[i], outline[(i + 1) % outline.len()]);
        face(&[[a, b, 1.0], [a, b, 0.0], [c, d, 0.0], [c, d, 1.0]]);
    }
    // Both ends, as two rectangles each.
    let rectangles = [[0.0, 0.0, 2.0, 0.8], [0.0, 0.8, 0.9, 1.7]];
    for [x0, y0, x1, y1] in rectangles {
        face(&[[x0, y0, 1.0], [x1, y0, 1.0], [x1, y1, 1.0], [x0, y1, 1.0]]);
        face(&[[x0, y1, 0.0], [x1, y1, 0.0], [x1, y0, 0.0], [x0, y0, 0.0]]);
    }
    let n = positions.len() / 3;
    let columns = vec![
        Column::new(columns::POSITION, 3, Buffer::F32(positions)),
        Column::new(columns::NORMAL, 3, Buffer::F32([0.0, 0.0, 1.0].repeat(n))),
        Column::new(columns::RADIUS, 1, Buffer::F32(vec![0.1; n])),
    ];
    let cloud = Cloud::new(DVec3::ZERO, columns).expect("test clouds are consistent");
    cloud.with_faces(faces).expect("faces of its own corners")
}

impl EdgeBench {
    /// A mesh in pictures of this size.
    ///
    /// # Errors
    /// Where it has no triangles.
    pub fn new(mesh: &Cloud, size: u32) -> Result<Self> {
        let at = |i: u32| Vec3A::from(mesh.positions()[i as usize]);
        let triangles: Vec<Triangle> = mesh
            .faces()
            .iter()
            .map(|[a, b, c]| Triangle { v0: at(*a), v1: at(*b), v2: at(*c) })
            .collect();
        anyhow::ensure!(!triangles.is_empty(), "the mesh has no triangles");
        let mut took = Duration::default();
        let bvh = build_cwbvh_from_tris(&triangles, BvhBuildParams::fast_build(), &mut took);
        let scene = Scene::default();
        let views = views_around(mesh, DIRECTIONS, size);
        Ok(Self { triangles, bvh, scene, views })
    }

    /// The views.
    #[must_use]
    pub fn views(&self) -> &[View] {
        &self.views
    }

    /// The scene.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// What the pixels of a view see of the mesh: its face, lit and unlit.
    #[must_use]
    pub fn seen(&self, view: &View) -> Vec<twin::Pixel> {
        let [width, height] = view.size_px;
        let camera = &view.camera;
        let world_from_view = camera.view_from_world().transpose();
        let pixel = |i: u32| {
            let (_, direction) = view.ray(f64::from(i % width) + 0.5, f64::from(i / width) + 0.5);
            let direction = (world_from_view * direction).normalize_or(DVec3::Z);
            let ray = Ray::new(
                Vec3A::from(camera.eye.as_vec3()),
                // Adding zero makes negative zeros positive, which the hierarchy counts on.
                Vec3A::from(direction.as_vec3() + Vec3::ZERO),
                0.0,
                f32::INFINITY,
            );
            let mut hit = RayHit::none();
            let places = &self.bvh.primitive_indices;
            let of = |place: usize| &self.triangles[places[place] as usize];
            if !self.bvh.ray_traverse(ray, &mut hit, |ray, place| of(place).intersect(ray)) {
                return twin::Pixel::default();
            }
            let normal = Vec3::from(of(hit.primitive_id as usize).compute_normal()).as_dvec3();
            let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
            let along = camera.view_from_world() * direction;
            twin::Pixel {
                depth: f64::from(hit.t) * -along.z,
                normal: normal.normalize_or(DVec3::Z),
                albedo: DVec3::splat(0.5),
                ..twin::Pixel::default()
            }
        };
        (0..width * height).map(pixel).collect()
    }

    /// How far splats are from the mesh, in a way to draw them.
    ///
    /// # Errors
    /// Those of drawing.
    pub fn off(
        &self,
        splats: &Cloud,
        engine: &mut surfelshop_render::Engine,
        renderer: &mut RendererView,
    ) -> Result<AtEdges> {
        let (mut radiance, mut angles, mut rest) = ((0.0, 0), (0.0, 0), (0.0, 0));
        let (mut beyond, mut on) = (0, 0);
        for view in &self.views {
            let outputs = [Output::Color, Output::Normal];
            let drawn = stage::render(engine, renderer, splats, &self.scene, *view, &outputs)?;
            let color = drawn.image(&Output::Color).context("no colours")?;
            let normals = drawn.image(&Output::Normal).context("no normals")?;
            let seen = self.seen(view);
            let width = view.size_px[0];
            for (i, truth) in seen.iter().enumerate() {
                let (x, y) = (i as u32 % width, i as u32 / width);
                if truth.depth <= 0.0 {
                    beyond += usize::from(color.pixel(x, y)[3] > 0.0);
                    continue;
                }
                on += 1;
                let position = [f64::from(x) + 0.5, f64::from(y) + 0.5];
                let lit = twin::shade(truth, &self.scene, view, position, &LIT);
                let found = Vec3::from_slice(color.pixel(x, y)).as_dvec3();
                let squared = (found - lit).length_squared() / 3.0;
                if !is_edge(&seen, [i64::from(x), i64::from(y)], i64::from(width)) {
                    rest = (rest.0 + squared, rest.1 + 1);
                    continue;
                }
                radiance = (radiance.0 + squared, radiance.1 + 1);
                let normal = normals.pixel(x, y);
                if normal[3] > 0.0 {
                    let angle = Vec3::from_slice(normal).as_dvec3().angle_between(truth.normal);
                    angles = (angles.0 + angle.to_degrees().powi(2), angles.1 + 1);
                }
            }
        }
        let root = |(sum, n): (f64, usize)| (sum / n.max(1) as f64).sqrt();
        Ok(AtEdges {
            radiance: root(radiance),
            normal_degrees: root(angles),
            n: radiance.1,
            elsewhere: root(rest),
            beyond: beyond as f64 / on.max(1) as f64,
        })
    }
}

/// Whether normals differ around a pixel, where all is covered.
fn is_edge(seen: &[twin::Pixel], [x, y]: [i64; 2], width: i64) -> bool {
    let height = seen.len() as i64 / width;
    let own = &seen[(y * width + x) as usize];
    let mut differs = false;
    for (dx, dy) in (-AROUND..=AROUND).flat_map(|dy| (-AROUND..=AROUND).map(move |dx| (dx, dy))) {
        let (x, y) = (x + dx, y + dy);
        if !(0..width).contains(&x) || !(0..height).contains(&y) {
            return false;
        }
        let other = &seen[(y * width + x) as usize];
        if other.depth <= 0.0 {
            return false;
        }
        let angle = own.normal.angle_between(other.normal) as f32;
        differs |= angle.to_degrees() > EDGE_DEGREES;
    }
    differs
}
