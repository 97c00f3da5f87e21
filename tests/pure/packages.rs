//! What the crates are that are published for plugins. Costs a second.

use crate::repository::root;
use std::process::Command;

/// The crates under the promise on versions, of which one needs the other.
const PUBLISHED: [&str; 2] = ["surfelshop-api", "surfelshop-geometry"];

/// Invariant: a crate that is published has its licence, its readme and all its sources, and nothing else
#[test]
fn crates_for_plugins_have_licence_readme_and_sources() {
    for name in PUBLISHED {
        let listed = Command::new(env!("CARGO"))
            .args(["package", "--list", "--allow-dirty", "--offline", "-p", name])
            .current_dir(root())
            .output()
            .expect("cargo runs");
        assert!(listed.status.success(), "{}", String::from_utf8_lossy(&listed.stderr));
        let text = String::from_utf8(listed.stdout).expect("names are UTF-8");
        let files: Vec<&str> = text.lines().collect();
        for file in ["LICENSE", "README.md", "src/lib.rs", "Cargo.toml"] {
            assert!(files.contains(&file), "{name} lacks {file}");
        }
        // Its documentation is made of pages of the manual.
        let has_guide = files.contains(&"guide/index.md");
        assert_eq!(has_guide, name == "surfelshop-api", "{name}: {files:?}");
        let is_expected = |file: &&&str| {
            ["src/", "guide/", "Cargo.", ".cargo_vcs"].iter().any(|start| file.starts_with(start))
        };
        let others = files.iter().filter(|file| !is_expected(file)).count();
        assert_eq!(others, 2, "{name}: {files:?}");
    }
}

/// A path alone is no dependency that a registry can serve.
#[test]
fn published_crates_depend_on_each_other_by_version() {
    let workspace = std::fs::read_to_string(root().join("Cargo.toml")).expect("it is there");
    for name in PUBLISHED {
        let line = workspace
            .lines()
            .find(|line| line.starts_with(&format!("{name} = ")))
            .expect("it is listed");
        assert!(line.contains(&format!("version = \"{}\"", env!("CARGO_PKG_VERSION"))), "{line}");
    }
}
