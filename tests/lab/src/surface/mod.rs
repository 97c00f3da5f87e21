//! From bare points to a surface: time and memory, normals against truth, and discs against the mesh.
//!
//! `surface speed [POINTS…]`, `surface normals [MESH…]`, `surface sides [FOLDER]`, `surface radii [MESH…]`, `surface city FOLDER MILLIONS [FILES]`, `surface gaussians COUNT OUT.ply`,
//! `surface gaussian-reading FILE.ply [ROUNDS]`, `surface gaussian-truth FILE...`,
//! `surface strokes [SURFELS…]`, `surface booleans MESH…`, `surface occlusion PYRAMID…`, `surface sampled PYRAMID OUT`, `surface pictures FOLDER SCAN…` and
//! `surface dump FOLDER [MESH…]`, which writes the clouds of `normals` for other programs: see `peers.py` beside this file. Meshes are OBJ, OFF
//! and text PLY files; without any, shapes are made.

mod booleans;
mod city;
mod cloud;
mod cloudcompare;
mod discs;
mod gaussian_reading;
mod gaussian_truth;
mod gaussians;
mod meshes;
mod normals;
mod occlusion;
mod pictures;
mod sampled;
mod sides;
mod speed;
mod strokes;

/// What `surface --help` says.
const USAGE: &str = "surface speed [POINTS...]            time and memory of the estimates
surface normals [MESH...]            normals against those of meshes
surface sides [FOLDER]               which side normals face; dumps the clouds to the folder
surface radii [MESH...]              holes and overshoot of discs
surface city FOLDER MILLIONS [FILES] a made city for pyramids
surface gaussians COUNT OUT.ply      made Gaussian splats
surface gaussian-reading FILE [ROUNDS]  what Gaussians cost a reader
surface gaussian-truth FILE...       pictures of Gaussians against a plain renderer in f64
surface occlusion PYRAMID...         ambient occlusion of pyramids against rays
surface sampled PYRAMID OUT          a pyramid of chosen surfels in the place of merged ones
surface booleans MESH...             Boolean operations of a mesh's surfels and a turned copy
surface strokes [cpu] [SURFELS...]   a brush of 5,000 surfels over clouds
surface pictures FOLDER SCAN...      scans as surfaces and as points, beside CloudCompare's pictures of the same views
surface dump FOLDER [MESH...]        the clouds of `normals` for other programs
Meshes are OBJ, OFF and text PLY files; without any, shapes are made.";

pub(crate) fn run() -> anyhow::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(2).collect();
    let (mode, rest) = arguments.split_first().map_or(("", &[][..]), |(m, r)| (m.as_str(), r));
    match mode {
        "speed" => speed::run(rest),
        "booleans" => booleans::run(&meshes::all(rest)?, rest),
        "strokes" => strokes::run(rest),
        "normals" => normals::run(&meshes::all(rest)?),
        "radii" => discs::run(&meshes::all(rest)?),
        "dump" => match rest.split_first() {
            Some((folder, rest)) => cloud::dump(folder, &meshes::all(rest)?),
            None => anyhow::bail!("expected a folder to write clouds to, found none"),
        },
        "city" => city::run(rest),
        "gaussians" => gaussians::run(rest),
        "gaussian-reading" => gaussian_reading::run(rest),
        "gaussian-truth" => gaussian_truth::run(rest),
        "occlusion" => occlusion::run(rest),
        "sampled" => sampled::run(rest),
        "sides" => sides::run(rest.first()),
        "pictures" => match rest.split_first() {
            Some((folder, scans)) => pictures::run(folder, scans),
            None => anyhow::bail!("expected a folder to write pictures to, found none"),
        },
        "--help" | "-h" | "help" => {
            println!("{USAGE}");
            Ok(())
        }
        other => {
            anyhow::bail!("expected one of the words below, found `{other}`\n{USAGE}")
        }
    }
}
