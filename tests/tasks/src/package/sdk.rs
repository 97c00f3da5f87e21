//! The crates that plugins link, as a workspace of their own in the package.

use std::fs;
use std::path::Path;

use super::{copy_folder, said};

/// The crates, in `host/sdk`.
const CRATES: [&str; 3] = ["api", "geometry", "shading"];

/// Copies the crates and the C header, and writes the workspace that their manifests refer to.
pub(super) fn stage(root: &Path, folder: &Path) -> Result<(), String> {
    for name in CRATES.iter().chain(&["c"]) {
        let path = Path::new("host/sdk").join(name);
        copy_folder(&root.join(&path), &folder.join(&path))?;
    }
    let manifest = root.join("Cargo.toml");
    let text = fs::read_to_string(&manifest).map_err(|error| said(&manifest, &error))?;
    let target = folder.join("Cargo.toml");
    fs::write(&target, workspace(&text)).map_err(|error| said(&target, &error))
}

/// The workspace of the crates alone: their members, and of the checkout's manifest what they inherit.
fn workspace(checkout: &str) -> String {
    let members = CRATES.map(|name| format!("\"host/sdk/{name}\"")).join(", ");
    let mut text = format!("[workspace]\nresolver = \"3\"\nmembers = [{members}]\n");
    let mut is_inherited = false;
    for line in checkout.lines() {
        if line.starts_with('[') {
            let name = line.trim_matches(['[', ']']);
            is_inherited = ["workspace.package", "workspace.dependencies"].contains(&name)
                || name.starts_with("workspace.lints");
            if is_inherited {
                text.push('\n');
            }
        }
        // Crates of the host are not there.
        let is_elsewhere = line.contains("path = \"")
            && !CRATES.iter().any(|name| line.contains(&format!("\"host/sdk/{name}\"")));
        if is_inherited && !is_elsewhere && !line.is_empty() {
            text.push_str(line);
            text.push('\n');
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_workspace_has_what_its_crates_inherit_and_nothing_of_the_host() {
        let checkout = "[workspace]\nmembers = [\"host/app\"]\n\n[workspace.package]\nversion = \"1.2.3\"\n\n\
                        [workspace.dependencies]\nsurfelshop-api = { path = \"host/sdk/api\" }\n\
                        surfelshop-app = { path = \"host/app\" }\nglam = \"1\"\n\n\
                        [workspace.lints.rust]\nunsafe_code = \"deny\"\n\n[profile.release]\npanic = \"unwind\"\n";
        let expected = "[workspace]\nresolver = \"3\"\n\
                        members = [\"host/sdk/api\", \"host/sdk/geometry\", \"host/sdk/shading\"]\n\n\
                        [workspace.package]\nversion = \"1.2.3\"\n\n[workspace.dependencies]\n\
                        surfelshop-api = { path = \"host/sdk/api\" }\nglam = \"1\"\n\n\
                        [workspace.lints.rust]\nunsafe_code = \"deny\"\n";
        assert_eq!(workspace(checkout), expected);
    }
}
