//! Where a plugin's project finds the crates that it links, and `surfelshop plugins sdk`, which says it anew.
//!
//! A project is for every machine: `Cargo.toml` names the crates by version, or in a repository by tag. Where a machine has
//! them stands in Cargo's configuration beside it, which is that machine's own.

use super::arguments::{NewArguments, SdkArguments};
use anyhow::{Context as _, bail, ensure};
use serde_json::json;
use std::path::{Path, PathBuf};
use surfelshop_session::output::{files, terminal};

/// Cargo's configuration of a project.
pub(super) const CONFIG: &str = ".cargo/config.toml";

/// What stands above what this command writes, to the end of the file.
const ABOVE: &str = "\
# Where this machine has the crates of Surfelshop. `surfelshop plugins sdk` writes this anew, with all that is below.
";

/// Crates that plugins link, by what follows `surfelshop-` in their names and by their folders.
const CRATES: [&str; 3] = ["api", "geometry", "shading"];

/// Where the crates are.
pub(super) enum Sdk {
    /// In the registry, or else where this machine has them: their folder.
    Registry(String),
    /// In a folder, seen from the project's.
    Folder(String),
    /// In a repository: its address, and words that say which revision.
    Repository { address: String, revision: String },
}

impl Sdk {
    /// What was asked for.
    ///
    /// # Errors
    /// Where there is none.
    pub(super) fn of(arguments: &NewArguments) -> anyhow::Result<Self> {
        let revision = match (&arguments.tag, &arguments.rev) {
            (Some(tag), _) => format!(", tag = {}", quoted(tag)),
            (None, Some(rev)) => format!(", rev = {}", quoted(rev)),
            (None, None) => String::new(),
        };
        let is_address = |text: &str| text.contains("://") || text.starts_with("git@");
        match arguments.api.as_deref() {
            Some(address) if is_address(address) => {
                Ok(Self::Repository { address: address.to_owned(), revision })
            }
            Some(path) => {
                ensure!(
                    revision.is_empty(),
                    "--api {path}: --tag and --rev are of the address of a repository, and this is a folder"
                );
                let folder = named_folder(path)?;
                match Path::new(path).is_relative() {
                    true => Ok(Self::Folder(utf8(&from_project(&folder, &arguments.path)?)?)),
                    false => Ok(Self::Registry(utf8(&folder)?)),
                }
            }
            None => Ok(Self::Registry(utf8(&own_folder()?)?)),
        }
    }

    /// Lines of `Cargo.toml` that name crates.
    pub(super) fn dependencies(&self, crates: &[&str]) -> String {
        let line = |name: &&str| {
            let source = match self {
                Self::Registry(_) => quoted(concat!(
                    env!("CARGO_PKG_VERSION_MAJOR"),
                    ".",
                    env!("CARGO_PKG_VERSION_MINOR")
                )),
                Self::Folder(folder) => format!("{{ path = {} }}", quoted(&below(folder, name))),
                Self::Repository { address, revision } => {
                    format!("{{ git = {}{revision} }}", quoted(address))
                }
            };
            format!("surfelshop-{name} = {source}")
        };
        crates.iter().map(line).collect::<Vec<_>>().join("\n")
    }

    /// What Cargo has to be told besides, where it has to.
    pub(super) fn config(&self, crates: &[&str]) -> Option<String> {
        match self {
            Self::Registry(folder) => Some(places(folder, crates)),
            Self::Folder(_) | Self::Repository { .. } => None,
        }
    }

    /// What whoever builds the project elsewhere has to know.
    pub(super) fn told(&self) -> &'static str {
        match self {
            Self::Registry(_) => {
                "\
`Cargo.toml` names the crates of Surfelshop by their version. Where this machine has them stands in
`.cargo/config.toml`; on another machine `surfelshop plugins sdk`, typed in this folder, writes that file for the
Surfelshop that is installed there. To do without, name the repository and a tag or commit of it:
`surfelshop-api = { git = \"…\", tag = \"…\" }`."
            }
            Self::Folder(_) => {
                "\
`Cargo.toml` says where the crates of Surfelshop are, seen from this folder: move both together. For everybody name
the repository and a tag or commit of it: `surfelshop-api = { git = \"…\", tag = \"…\" }`."
            }
            Self::Repository { .. } => {
                "\
`Cargo.toml` says in which repository the crates of Surfelshop are. Without a tag or commit, `cargo update` moves to
whatever is newest."
            }
        }
    }
}

/// Runs `surfelshop plugins sdk`.
pub(super) fn run(arguments: &SdkArguments, json: bool) -> anyhow::Result<()> {
    let folder = match arguments.api.as_deref() {
        Some(path) => named_folder(path)?,
        None => own_folder()?,
    };
    let folder = utf8(&folder)?;
    let project = &arguments.project;
    let crates = crates_of(&project.join("Cargo.toml"))?;
    let path = project.join(CONFIG);
    let known = match std::fs::read_to_string(&path) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => String::new(),
        Err(error) => bail!("{}: cannot be read: {error}", path.display()),
    };
    let (own, _) = known.split_once(ABOVE).unwrap_or((&known, ""));
    let parsed: toml::Table =
        own.parse().with_context(|| format!("{}: expected TOML", path.display()))?;
    ensure!(
        !parsed.contains_key("patch"),
        "{}: has a table [patch] of its own; add to it, or take it away:\n{}",
        path.display(),
        places(&folder, &crates).trim_end()
    );
    let parent = path.parent().unwrap_or(project);
    std::fs::create_dir_all(parent)
        .with_context(|| format!("{}: the folder cannot be made", parent.display()))?;
    files::write_whole(&path, with_places(own, &places(&folder, &crates)).as_bytes())?;
    if json {
        return terminal::json(&json!({
            "command": "plugins sdk",
            "written": path.display().to_string(),
            "sdk": folder,
            "crates": crates.iter().map(|name| format!("surfelshop-{name}")).collect::<Vec<_>>(),
        }));
    }
    let all: Vec<String> = crates.iter().map(|name| format!("surfelshop-{name}")).collect();
    terminal::line(format!("{}: {} in {folder}", path.display(), all.join(", ")))
}

/// The crates of Surfelshop that a project names by version.
fn crates_of(manifest: &Path) -> anyhow::Result<Vec<&'static str>> {
    let name = manifest.display();
    let text = std::fs::read_to_string(manifest)
        .with_context(|| format!("{name}: expected the Cargo.toml of a plugin"))?;
    let parsed: toml::Table = text.parse().with_context(|| format!("{name}: expected TOML"))?;
    let by_version = |table: &str, name: &str| {
        let dependency = parsed.get(table)?.get(format!("surfelshop-{name}"))?;
        let elsewhere = ["path", "git"].iter().any(|key| dependency.get(key).is_some());
        (!elsewhere).then_some(())
    };
    let tables = ["dependencies", "dev-dependencies", "build-dependencies"];
    let is_named = |name: &&str| tables.iter().any(|table| by_version(table, name).is_some());
    let crates: Vec<&str> = CRATES.into_iter().filter(is_named).collect();
    ensure!(
        !crates.is_empty(),
        "{name}: expected a dependency by version, such as surfelshop-api = \"{}.{}\", found none",
        env!("CARGO_PKG_VERSION_MAJOR"),
        env!("CARGO_PKG_VERSION_MINOR")
    );
    Ok(crates)
}

/// A configuration with the places of crates below it.
pub(super) fn with_places(own: &str, places: &str) -> String {
    let gap = if own.trim().is_empty() { "" } else { "\n\n" };
    format!("{}{gap}{ABOVE}{places}", own.trim_end())
}

/// Lines of Cargo's configuration that say where crates are.
fn places(folder: &str, crates: &[&str]) -> String {
    let line = |name: &&str| {
        format!("surfelshop-{name} = {{ path = {} }}\n", quoted(&below(folder, name)))
    };
    format!("[patch.crates-io]\n{}", crates.iter().map(line).collect::<String>())
}

fn below(folder: &str, name: &str) -> String {
    format!("{folder}/{name}")
}

fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}

fn utf8(folder: &Path) -> anyhow::Result<String> {
    let text = folder.to_str().map(str::to_owned);
    text.with_context(|| format!("{}: the path is not UTF-8; rename it", folder.display()))
}

/// A folder as it is named from the folder of a project that is to be made.
fn from_project(folder: &Path, project: &Path) -> anyhow::Result<PathBuf> {
    let absolute = std::path::absolute(project)
        .with_context(|| format!("{}: there is no current folder", project.display()))?;
    // What is there of it without links, as the folder is.
    let known = absolute.ancestors().find_map(|there| Some((there, there.canonicalize().ok()?)));
    let project = match known {
        Some((there, real)) => real.join(absolute.strip_prefix(there).unwrap_or(Path::new(""))),
        None => absolute,
    };
    let shared = project.components().zip(folder.components()).take_while(|(a, b)| a == b).count();
    let up = project.components().skip(shared).map(|_| "..");
    let down = folder.components().skip(shared).map(|part| part.as_os_str().to_owned());
    Ok(up.map(std::ffi::OsString::from).chain(down).collect())
}

/// The folder that was typed.
fn named_folder(path: &str) -> anyhow::Result<PathBuf> {
    sdk_folder(Path::new(path)).with_context(|| {
        format!("--api {path}: expected a checkout of Surfelshop or its `host/sdk`")
    })
}

/// The folder `host/sdk` of a checkout, or of one that a path leads into.
fn sdk_folder(path: &Path) -> Option<PathBuf> {
    let path = path.canonicalize().ok()?;
    let is_sdk = |folder: &PathBuf| {
        let text = std::fs::read_to_string(folder.join("api/Cargo.toml")).unwrap_or_default();
        text.contains("name = \"surfelshop-api\"")
    };
    let parent = path.parent().map(Path::to_owned);
    let below = ["host/sdk", "sdk"].map(|below| Some(path.join(below)));
    below.into_iter().chain([Some(path), parent]).flatten().find(is_sdk)
}

/// The folder of the package that this program is of, or of the checkout in whose target folder it lies.
fn own_folder() -> anyhow::Result<PathBuf> {
    let found = std::env::current_exe().ok().and_then(|program| {
        program.ancestors().skip(1).find_map(|folder| {
            folder.join("host/sdk").is_dir().then(|| sdk_folder(folder)).flatten()
        })
    });
    found.context(
        "the checkout that this program was built in is not there; name its folder or the address of its \
         repository with --api",
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_are_named_from_the_project() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().canonicalize().unwrap();
        let named =
            |project: &str| from_project(&root.join("sdk/api"), &root.join(project)).unwrap();
        assert_eq!(named("rim"), Path::new("../sdk/api"));
        assert_eq!(named("plugins/rim"), Path::new("../../sdk/api"));
        assert_eq!(named("sdk/rim"), Path::new("../api"));
    }

    #[test]
    fn what_is_not_ours_of_a_configuration_stays() {
        let first = with_places("[build]\njobs = 2\n", &places("/a", &["api"]));
        let (own, _) = first.split_once(ABOVE).unwrap();
        let again = with_places(own, &places("/b", &["api", "geometry"]));
        let parsed: toml::Table = again.parse().unwrap();
        assert_eq!(parsed["build"]["jobs"].as_integer(), Some(2));
        let patched = &parsed["patch"]["crates-io"];
        assert_eq!(patched["surfelshop-api"]["path"].as_str(), Some("/b/api"));
        assert_eq!(patched["surfelshop-geometry"]["path"].as_str(), Some("/b/geometry"));
        assert!(!again.contains("/a/"), "{again}");
    }
}
