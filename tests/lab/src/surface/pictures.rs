//! Pictures of scans as surfaces and as points, of the same views, as the program renders them.

use anyhow::{Context as _, ensure};
use std::path::Path;
use std::process::Command;

/// What is rendered of each scan, and the name that the picture ends with.
const LOOKS: [(&str, &[&str]); 3] = [
    ("surface", &[]),
    ("points", &["--points", "2px"]),
    ("planarity", &["--color-by", "planarity"]),
];

/// Renders each scan from its first view, and from inside where one can stand there.
pub(super) fn run(folder: &str, scans: &[String]) -> anyhow::Result<()> {
    let program = std::env::current_exe()?.with_file_name("surfelshop");
    ensure!(program.exists(), "{}: missing; `cargo demo` builds it", program.display());
    std::fs::create_dir_all(folder).with_context(|| folder.to_owned())?;
    for scan in scans {
        let name = Path::new(scan).file_stem().unwrap_or_default().to_string_lossy();
        for camera in ["three-quarter", "inside"] {
            for (look, options) in LOOKS {
                let picture = Path::new(folder).join(format!("{name}-{camera}-{look}.png"));
                let mut command = Command::new(&program);
                command.args(["render", scan, "--size", "1200x800", "--camera", camera, "-o"]);
                let ended = command.arg(&picture).args(options).output()?;
                match ended.status.success() {
                    true => println!("{}", picture.display()),
                    // Not everything has an inside, and not every scan is anywhere no surface.
                    false => println!("{}", String::from_utf8_lossy(&ended.stderr).trim_end()),
                }
            }
        }
    }
    Ok(())
}
