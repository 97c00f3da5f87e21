//! Boolean operations of a closed mesh's surfels and a turned copy of them: `surface booleans MESH`.
//!
//! Rays from within the true result, which the triangles of both say, meet the surfels of the result: those that meet
//! none have found a hole, and those that meet one before the true surface something left inside. The same rays from
//! within the mesh and the mesh's own surfels are beside it: scans have holes of their own.

use super::meshes::Mesh;
use anyhow::{Context as _, Result, ensure};
use glam::DVec3;
use rayon::prelude::*;
use std::path::Path;
use std::process::Command;
use surfelshop_cloud::{Cloud, ReadOptions};
use surfelshop_tests::stage;

/// Rays from within each result.
const RAYS: usize = 2000;

/// What stands out by less is no mistake: spacings.
const NEAR: f64 = 1.0;

/// How the copy is turned about the vertical axis, degrees, and moved, shares of the mesh's width.
const TURN: f64 = 40.0;
const MOVE: [f64; 3] = [0.2, 0.1, 0.1];

/// What of two solids, by whether a place is in each.
type Within = fn(bool, bool) -> bool;

/// Triangles.
struct Solid(Vec<[DVec3; 3]>);

impl Solid {
    /// Distances along a ray at which it passes the surface.
    fn passes(&self, from: DVec3, along: DVec3) -> Vec<f64> {
        let pass = |[a, b, c]: &[DVec3; 3]| {
            // Source: Moeller & Trumbore 1997.
            let (u, v) = (*b - *a, *c - *a);
            let across = along.cross(v);
            let volume = u.dot(across);
            let offset = (from - *a) / volume;
            let (x, turned) = (offset.dot(across), offset.cross(u));
            let y = along.dot(turned);
            let far = v.dot(turned);
            (x >= 0.0 && y >= 0.0 && x + y <= 1.0 && far > 0.0).then_some(far)
        };
        self.0.iter().filter_map(pass).collect()
    }
}

/// A surfel as rays meet it.
struct Piece {
    place: DVec3,
    normal: DVec3,
    axes: [DVec3; 2],
    lines: [f64; 7],
}

impl Piece {
    fn meets(&self, from: DVec3, along: DVec3) -> Option<f64> {
        let far = self.normal.dot(self.place - from) / self.normal.dot(along);
        let offset = from + far * along - self.place;
        let [u, v] = self.axes.map(|axis| offset.dot(axis) / axis.length_squared());
        let [a, b, c, d, e, f, kind] = self.lines;
        let sides = [a * u + b * v + c >= 0.0, d * u + e * v + f >= 0.0];
        let is_there = match kind.round() as i32 {
            0 => true,
            1 => sides[0] && sides[1],
            _ => sides[0] || sides[1],
        };
        (far > 0.0 && u * u + v * v <= 1.0 && is_there).then_some(far)
    }
}

fn pieces(cloud: &Cloud) -> Result<Vec<Piece>> {
    let view = cloud.view();
    let floats = |name: &str, n: u32| view.floats(name, n);
    let (places, normals) = floats("position", 3).zip(floats("normal", 3)).context("surfels")?;
    let three = |values: &[f32], i: usize| {
        DVec3::from_array([0, 1, 2].map(|k| f64::from(values[3 * i + k])))
    };
    let tangents = floats("tangent_u", 3).zip(floats("tangent_v", 3));
    let (radii, lines) = (floats("radius", 1), floats("clip", 7));
    let piece = |i: usize| {
        let normal = three(normals, i);
        let axes = match tangents {
            Some((u, v)) => [three(u, i), three(v, i)],
            None => {
                let (u, v) = normal.any_orthonormal_pair();
                let radius = radii.map_or(0.0, |radii| f64::from(radii[i]));
                [u * radius, v * radius]
            }
        };
        let lines =
            lines.map_or([0.0; 7], |all| std::array::from_fn(|k| f64::from(all[7 * i + k])));
        Piece { place: view.origin + three(places, i), normal, axes, lines }
    };
    Ok((0..view.len).map(piece).collect())
}

/// What rays found.
#[derive(Default)]
struct Found {
    rays: usize,
    holes: usize,
    inside: usize,
    outside: usize,
}

/// Sends rays from places that are in the result, by what is in each solid.
fn rays(
    solids: &[Solid; 2],
    pieces: &[Piece],
    spacing: f64,
    is_in: &(dyn Fn(bool, bool) -> bool + Sync),
) -> Found {
    let corners = solids.iter().flat_map(|solid| solid.0.iter().flatten());
    let (low, high) = corners
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)));
    // Source: Roberts 2018, "The unreasonable effectiveness of quasirandom sequences".
    let along = |i: usize, k: i32| ((i + 1) as f64 * 1.167_303_978_261_418_7_f64.powi(-k)).fract();
    let one = |i: usize| {
        let share = DVec3::new(along(i, 1), along(i, 2), along(i, 3));
        let (z, angle) = (2.0 * along(i, 4) - 1.0, std::f64::consts::TAU * along(i, 5));
        let ring = (1.0 - z * z).sqrt();
        let (from, along) =
            (low + share * (high - low), DVec3::new(ring * angle.cos(), ring * angle.sin(), z));
        let mut passes: Vec<(f64, usize)> = Vec::new();
        for (which, solid) in solids.iter().enumerate() {
            passes.extend(solid.passes(from, along).into_iter().map(|far| (far, which)));
        }
        passes.sort_by(|a, b| a.0.total_cmp(&b.0));
        let n_of = |which: usize| passes.iter().filter(|pass| pass.1 == which).count();
        let mut are_in = [n_of(0) % 2 == 1, n_of(1) % 2 == 1];
        if !is_in(are_in[0], are_in[1]) {
            return None;
        }
        let leaves = passes.iter().find_map(|&(far, which)| {
            are_in[which] ^= true;
            (!is_in(are_in[0], are_in[1])).then_some(far)
        })?;
        // Beside the surface, where discs stand out to both sides, nothing is told.
        let first = pieces
            .iter()
            .filter_map(|piece| piece.meets(from, along))
            .fold(f64::INFINITY, f64::min);
        (leaves > 2.0 * spacing).then_some((leaves, first))
    };
    let all: Vec<(f64, f64)> =
        (0..32 * RAYS).into_par_iter().filter_map(one).take_any(RAYS).collect();
    let count = |test: &dyn Fn(f64, f64) -> bool| {
        all.iter().filter(|(leaves, first)| test(*leaves, *first)).count()
    };
    Found {
        rays: all.len(),
        holes: count(&|_, first| first.is_infinite()),
        inside: count(&|leaves, first| first < leaves - NEAR * spacing),
        outside: count(&|leaves, first| first.is_finite() && first > leaves + NEAR * spacing),
    }
}

fn surfelshop(folder: &Path, arguments: &[&str]) -> Result<String> {
    let done = Command::new(stage::build_folder().join("surfelshop"))
        .args(arguments)
        .current_dir(folder)
        .output()?;
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    ensure!(done.status.success(), "{said}");
    Ok(said)
}

pub(super) fn run(meshes: &[Mesh], files: &[String]) -> Result<()> {
    for (mesh, file) in meshes.iter().zip(files) {
        measure(mesh, &std::fs::canonicalize(file)?)?;
    }
    Ok(())
}

fn measure(mesh: &Mesh, file: &Path) -> Result<()> {
    let folder = tempfile::tempdir()?;
    let file = file.to_string_lossy();
    let places: Vec<DVec3> = mesh.positions.iter().map(|p| p.as_dvec3()).collect();
    let (low, high) = places
        .iter()
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
    let offset = DVec3::from_array(MOVE) * (high.x - low.x);
    let set = [
        ("rotate-y", TURN),
        ("translate-x", offset.x),
        ("translate-y", offset.y),
        ("translate-z", offset.z),
    ];
    let set: Vec<String> = set.iter().map(|(name, value)| format!("{name}={value}")).collect();
    let mut turned = vec!["bake", &*file, "-t", "transform", "-o", "other.ply"];
    set.iter().for_each(|value| turned.extend(["--set", value]));
    surfelshop(folder.path(), &turned)?;
    surfelshop(folder.path(), &["bake", &file, "-t", "transform", "-o", "own.ply"])?;
    let read =
        |name: &str| surfelshop_cloud::read(folder.path().join(name), &ReadOptions::default());
    let own = read("own.ply")?.cloud;
    let pieces_of = pieces(&own)?;
    let other = pieces(&read("other.ply")?.cloud)?;
    ensure!(
        own.len() == places.len() && other.len() == places.len(),
        "expected a surfel for each vertex"
    );
    let solid = |at: &dyn Fn(usize) -> DVec3| {
        Solid(mesh.faces.iter().map(|face| face.map(|i| at(i as usize))).collect())
    };
    let solids = [solid(&|i| places[i]), solid(&|i| other[i].place)];
    let area: f64 =
        solids[0].0.iter().map(|[a, b, c]| 0.5 * (*b - *a).cross(*c - *a).length()).sum();
    let spacing = (area / places.len() as f64).sqrt();
    println!("\n{}: {} surfels, {spacing:.2e} apart\n", mesh.name, places.len());
    println!(
        "| result | surfels | rays | holes | something inside | surface farther out |\n|---|---|---|---|---|---|"
    );
    let say = |name: &str, n: usize, found: &Found| {
        let Found { rays, holes, inside, outside } = found;
        println!("| {name} | {n} | {rays} | {holes} | {inside} | {outside} |");
    };
    say("the first alone", own.len(), &rays(&solids, &pieces_of, spacing, &|own, _| own));
    say("the second alone", own.len(), &rays(&solids, &other, spacing, &|_, other| other));
    let operations: [(&str, Within); 3] =
        [("union", |a, b| a || b), ("intersection", |a, b| a && b), ("difference", |a, b| a && !b)];
    for (name, is_in) in operations {
        let operation = format!("operation={name}");
        surfelshop(
            folder.path(),
            &[
                "bake",
                "own.ply",
                "-t",
                "boolean",
                "--set",
                "with=other.ply",
                "--set",
                &operation,
                "-o",
                "result.ply",
            ],
        )?;
        let result = read("result.ply")?.cloud;
        say(name, result.len(), &rays(&solids, &pieces(&result)?, spacing, &is_in));
    }
    Ok(())
}
