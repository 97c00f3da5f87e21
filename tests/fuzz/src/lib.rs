//! Everything that reads bytes of third parties, fed with any bytes.
//!
//! Each function takes the bytes of one input and returns; a panic, a hang or memory beyond
//! [`MOST_BYTES`] is a finding. `targets` beside this crate drives them with libFuzzer, the tests with the
//! inputs in `corpus`: seeds, and every finding there was.
//!
//! Invariants: inputs are never trusted by the functions themselves; what they call is what the program
//! calls.

mod cloud;
mod device;
mod format;
mod graph;
mod manifest;
mod module;
mod mutate;
mod parameters;
mod pyramid;
mod scene;
mod shader;

pub use cloud::{cloud, probe};
pub use format::{
    compressed_ply, e57, gltf, las, pcd, potree, pts, ptx, sfl, sog, splat, spz, stl, xyz,
};
pub use graph::graph;
pub use manifest::manifest;
pub use module::module;
pub use mutate::{Chance, mutated};
pub use parameters::parameters;
pub use pyramid::pyramid;
pub use scene::scene;
pub use shader::shader;

/// Most memory that reading one input may take at a time. The largest share is that of naga: 256 KiB of
/// shader, the most that is compiled, become syntax trees a thousand times as large.
pub const MOST_BYTES: usize = 512 << 20;

/// A function that takes any bytes.
pub type Target = fn(&[u8]);

/// The targets by the names of their folders in `corpus`.
pub const TARGETS: [(&str, Target); 23] = [
    ("cloud", cloud),
    ("compressed-ply", compressed_ply),
    ("e57", e57),
    ("gltf", gltf),
    ("graph", graph),
    ("las", las),
    ("manifest", manifest),
    ("module", module),
    ("parameters", parameters),
    ("pcd", pcd),
    ("potree", potree),
    ("probe", probe),
    ("pts", pts),
    ("ptx", ptx),
    ("pyramid", pyramid),
    ("scene", scene),
    ("sfl", sfl),
    ("shader", shader),
    ("sog", sog),
    ("splat", splat),
    ("spz", spz),
    ("stl", stl),
    ("xyz", xyz),
];

/// The targets whose work is done by plugins, with an allocator of their own.
pub const FORMATS: [&str; 14] = [
    "compressed-ply",
    "e57",
    "gltf",
    "las",
    "pcd",
    "potree",
    "pts",
    "ptx",
    "sfl",
    "sog",
    "splat",
    "spz",
    "stl",
    "xyz",
];

/// Lets panics of shader compilers pass: they happen in code of others, on a thread that is there to
/// contain them, and become a line. All others go to the hook that was there.
pub fn allow_contained_panics() {
    static ONCE: std::sync::Once = std::sync::Once::new();
    ONCE.call_once(|| {
        let previous = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            if std::thread::current().name() != Some("shader compiler") {
                previous(info);
            }
        }));
    });
}

/// What is said to a person: one line without anything that steers a terminal.
fn assert_one_line(line: &str) {
    assert!(!line.is_empty() && !line.contains(char::is_control), "{line:?}");
}

/// The corpus of a target: seeds, and inputs that fuzzers kept, sorted by path.
///
/// # Errors
/// Where its folder or one in it cannot be listed.
pub fn corpus(target: &str) -> std::io::Result<Vec<std::path::PathBuf>> {
    let all = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus");
    let of_gaussians = all.join("gaussians").join(target);
    let folder = if of_gaussians.is_dir() { of_gaussians } else { all.join(target) };
    let mut files = Vec::new();
    for inner in folder.read_dir()? {
        for file in inner?.path().read_dir()? {
            files.push(file?.path());
        }
    }
    files.sort();
    Ok(files)
}
