//! Reading: what the scene shows, then its points, then its triangles.

use crate::buffers::Buffers;
use crate::columns::{Column, Columns};
use crate::container::{self, Container};
use crate::mesh::{Doubts, Mesh};
use crate::scene::{Instance, Scene};
use crate::triangles::Placed;
use crate::values::{Decoded, Movement, Source};
use crate::{Settings, extensions};
use surfelshop_api::columns::Values;
use surfelshop_api::format::{BATCH, CloudHeader, CloudSink, FileSource, UpAxis};
use surfelshop_api::prelude::{Error, Job, Result};

/// The share of the work that points are.
const POINTS: f64 = 0.8;

/// Reads a file.
pub(crate) fn read(
    file: &FileSource,
    params: &Settings,
    clouds: &mut CloudSink<'_>,
    job: &Job<'_>,
) -> Result<()> {
    let Container { mut root, names, binary, is_glb } = container::open(file)?;
    let unknown = extensions::check(&root)?;
    let mut buffers = Buffers::new(file, &mut root, binary)?;
    let scene = Scene::of(&root)?;
    job.check()?;
    let mut meshes: Vec<Option<Mesh>> = Vec::new();
    meshes.resize_with(root.meshes.len(), || None);
    let mut doubts = Doubts::default();
    for Instance { mesh, .. } in &scene.instances {
        if !matches!(meshes.get(*mesh), Some(Some(_))) {
            let found = Mesh::find((&root, &names), &mut buffers, *mesh, &mut doubts)?;
            meshes[*mesh] = Some(found);
        }
    }
    let mut found = meshes.iter().flatten().flat_map(|mesh| &mesh.vertices);
    if found.any(|vertices| vertices.splats.is_some()) {
        let counts = meshes.iter_mut().flatten().map(Mesh::keep_splats);
        doubts.n_beside_splats = counts.sum();
    }
    let Columns { columns, left_out } =
        Columns::new(&scene.instances, &meshes, params.colors, clouds);
    if !left_out.is_empty() {
        let n = left_out.len();
        doubts
            .attributes
            .push(format!("{n} attributes that differ from mesh to mesh were left out"));
    }
    let lines = unknown.into_iter().chain(scene.warnings.iter().cloned()).chain(doubts.lines());
    lines.for_each(|line| clouds.warn(&line));
    let shown = Shown { instances: &scene.instances, meshes: &meshes, buffers: &buffers };
    let n_points = shown.n_points()?;
    let asset = &root.asset;
    let version: String = asset.version.chars().filter(|c| !c.is_control()).take(10).collect();
    let comments = [&asset.generator, &asset.copyright].into_iter().flatten().cloned();
    let header = CloudHeader {
        format: format!("{} {version}", if is_glb { "GLB" } else { "glTF" }),
        name: scene.name.clone(),
        rows: Some(u64::from(n_points)),
        columns: columns.iter().map(|column| column.column.clone()).collect(),
        up: UpAxis::Y,
        metres_per_unit: 1.0,
        has_faces: meshes.iter().flatten().any(|mesh| !mesh.topologies.is_empty()),
        comments: comments.collect(),
        ..CloudHeader::default()
    };
    if !clouds.begin(&header)? {
        return Ok(());
    }
    shown.points(params, &columns, n_points, clouds, job)?;
    shown.triangles(n_points, clouds, job)
}

/// The meshes of a scene.
struct Shown<'a> {
    instances: &'a [Instance],
    meshes: &'a [Option<Mesh>],
    buffers: &'a Buffers,
}

impl Shown<'_> {
    /// Each mesh as often as it is shown.
    fn each(&self) -> impl Iterator<Item = (&Mesh, Movement)> {
        self.instances.iter().filter_map(|instance| {
            let mesh = self.meshes.get(instance.mesh)?.as_ref()?;
            Some((mesh, Movement::new(instance.matrix)))
        })
    }

    fn n_points(&self) -> Result<u32> {
        let counts =
            self.each().flat_map(|(mesh, _)| &mesh.vertices).map(|vertices| vertices.count);
        let sum = counts.fold(0u64, |sum, count| sum.saturating_add(u64::from(count)));
        u32::try_from(sum).ok().ok_or_else(|| {
            Error::new(format!(
                "expected at most 4294967295 points, found {sum} in all meshes that are shown"
            ))
        })
    }

    fn points(
        &self,
        params: &Settings,
        columns: &[Column],
        n_points: u32,
        clouds: &mut CloudSink<'_>,
        job: &Job<'_>,
    ) -> Result<()> {
        let mut done = 0u64;
        for (mesh, movement) in self.each() {
            for vertices in &mesh.vertices {
                let source = Source::new(vertices, movement, params.colors, columns, self.buffers)?;
                let mut first = 0;
                while first < vertices.count {
                    job.check()?;
                    // At most a batch.
                    let n = (vertices.count - first).min(BATCH as u32);
                    let batch = source.batch(first, n as usize)?;
                    let values: Vec<Values<'_>> = batch.iter().map(Decoded::values).collect();
                    clouds.batch(&values)?;
                    first += n;
                    done += u64::from(n);
                    job.progress(POINTS * done as f64 / f64::from(n_points), "");
                }
            }
        }
        Ok(())
    }

    fn triangles(&self, n_points: u32, clouds: &mut CloudSink<'_>, job: &Job<'_>) -> Result<()> {
        let (mut base, mut n_wrong) = (0, 0);
        for (mesh, movement) in self.each() {
            let mut bases = Vec::with_capacity(mesh.vertices.len());
            for vertices in &mesh.vertices {
                bases.push(base);
                // All points together fit.
                base += vertices.count;
            }
            for topology in &mesh.topologies {
                let vertices = topology.vertices;
                let (base, count) = (bases[vertices], mesh.vertices[vertices].count);
                let placed = Placed { topology, mirrors: movement.mirrors(), base, count };
                n_wrong += placed.each(self.buffers, job, |triangles| clouds.faces(triangles))?;
            }
            let done = f64::from(base) / f64::from(n_points.max(1));
            job.progress(POINTS + (1.0 - POINTS) * done, "");
        }
        if n_wrong > 0 {
            clouds.warn(&format!(
                "{n_wrong} triangles with corners that are no points were left out"
            ));
        }
        Ok(())
    }
}
