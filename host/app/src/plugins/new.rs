//! `surfelshop plugins new`: a project that builds, loads and passes `check`, to be changed from there.

use super::names::check_name;
use super::sdk::{self, Sdk};
use crate::plugins::arguments::{NewArguments, NewKind};
use anyhow::{Context as _, ensure};
use serde_json::json;
use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
use std::path::Path;
use surfelshop_api::format::MAX_ENDING_LEN;
use surfelshop_api::manifest::{ABI_MAJOR, ABI_MINOR};
use surfelshop_runtime::plugins::is_package_id;
use surfelshop_session::output::{command_line, terminal};

/// A file of a template: where it goes, and its text.
type File = (&'static str, &'static str);

/// The files of every project.
const COMMON: [File; 3] = [
    ("Cargo.toml", include_str!("template/Cargo.toml.txt")),
    ("README.md", include_str!("template/README.txt")),
    (".gitignore", "/target\n{{ignored}}"),
];

/// What has Cargo build a WebAssembly module.
const SANDBOX: &str = include_str!("template/sandbox/config.toml.txt");

impl NewKind {
    fn files(self) -> &'static [File] {
        match self {
            Self::Shading => &[
                ("src/lib.rs", include_str!("template/shading/src/lib.rs")),
                ("src/shade.wgsl", include_str!("template/shading/src/shade.wgsl")),
            ],
            Self::Graph => &[
                ("src/lib.rs", include_str!("template/graph/src/lib.rs")),
                ("src/shade.wgsl", include_str!("template/graph/src/shade.wgsl")),
                ("src/measure.wgsl", include_str!("template/graph/src/measure.wgsl")),
                ("src/edges.wgsl", include_str!("template/graph/src/edges.wgsl")),
                ("src/ink.wgsl", include_str!("template/graph/src/ink.wgsl")),
            ],
            Self::Splat => &[
                ("src/lib.rs", include_str!("template/splat/src/lib.rs")),
                ("src/splat.wgsl", include_str!("template/splat/src/splat.wgsl")),
                ("src/resolve.wgsl", include_str!("template/splat/src/resolve.wgsl")),
            ],
            Self::Tool => &[("src/lib.rs", include_str!("template/tool/src/lib.rs"))],
            Self::Brush => &[("src/lib.rs", include_str!("template/brush/src/lib.rs"))],
            Self::Tracer => &[("src/lib.rs", include_str!("template/tracer/src/lib.rs"))],
            Self::Format => &[("src/lib.rs", include_str!("template/format/src/lib.rs"))],
        }
    }

    /// The crates of this project that it links.
    fn crates(self) -> &'static [&'static str] {
        match self {
            Self::Shading | Self::Graph | Self::Splat | Self::Tool | Self::Brush | Self::Format => {
                &["api"]
            }
            Self::Tracer => &["api", "geometry"],
        }
    }

    /// What the name of its type ends with.
    fn word(self) -> &'static str {
        match self {
            Self::Shading | Self::Graph | Self::Splat => "Renderer",
            Self::Tool => "Tool",
            Self::Brush => "Brush",
            Self::Tracer => "Tracer",
            Self::Format => "Format",
        }
    }

    fn what(self) -> &'static str {
        match self {
            Self::Shading => "A renderer of one WGSL function",
            Self::Graph => "A renderer with a graph of its own",
            Self::Splat => "A renderer of one splat function",
            Self::Tool => "A tool",
            Self::Brush => "An interactive tool",
            Self::Tracer => "A tracer, a renderer that computes pixels itself,",
            Self::Format => "A file format",
        }
    }

    /// What else its author should know: how builds are taken over, and what `check` does.
    fn remarks(self) -> &'static str {
        match self {
            Self::Format => include_str!("template/format/remarks.txt").trim_end(),
            _ => include_str!("template/remarks.txt").trim_end(),
        }
    }

    /// The commands that show what it does.
    fn look(self, name: &str, library: &str) -> String {
        match self {
            Self::Shading | Self::Graph | Self::Splat => format!("surfelshop --plugin {library}"),
            Self::Brush => format!(
                "surfelshop scan.ply --plugin {library}\n\
                 surfelshop bake scan.ply -t {name} --plugin {library} --strokes scan.strokes.json -o {name}.ply"
            ),
            Self::Tool => {
                format!("surfelshop bake scan.ply -t {name} --plugin {library} -o {name}.ply")
            }
            Self::Tracer => {
                format!("surfelshop render scan.ply -r {name} --plugin {library} -o {name}.png")
            }
            Self::Format => {
                let file = format!("scan.{}", ending(name));
                format!(
                    "surfelshop convert scan.ply {file} --plugin {library}\n\
                     surfelshop info {file} --plugin {library}"
                )
            }
        }
    }
}

/// Runs the command.
pub(super) fn run(arguments: &NewArguments, json: bool) -> anyhow::Result<()> {
    let path = &arguments.path;
    let project = Project::new(arguments)?;
    project.write(path)?;
    if json {
        return terminal::json(&json!({
            "command": "plugins new",
            "folder": path.display().to_string(),
            "package": project.package,
            "library": project.library(),
            "files": project.files().map(|(name, _)| name).collect::<Vec<_>>(),
        }));
    }
    let (folder, library) = (path.display(), project.library());
    let target = project.target();
    let enter = command_line::words("cd", [folder.to_string()]);
    terminal::line(format!("{} is in {folder}. Next:\n", project.kind.what()))?;
    terminal::line(format!("  {enter}\n{}  cargo build --release", indented(target)))?;
    let program = command_line::program_anywhere();
    if !project.sandbox {
        terminal::line(format!("  {program} plugins trust --place {library}"))?;
    }
    for look in project.kind.look(&project.name, &library).lines() {
        terminal::line(format!("  {}", look.replacen("surfelshop", &program, 1)))?;
    }
    terminal::line(format!("  {program} check {library}\n\n{folder}/README.md says more."))
}

/// A project that is to be written.
struct Project {
    kind: NewKind,
    name: String,
    package: String,
    sdk: Sdk,
    /// The oldest minor version of the ABI, where one is said.
    minor: Option<u16>,
    /// Whether it is to be a WebAssembly module.
    sandbox: bool,
}

impl Project {
    fn new(arguments: &NewArguments) -> anyhow::Result<Self> {
        let path = &arguments.path;
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default().to_owned();
        ensure!(!name.is_empty(), "{}: expected the name of a folder to make", path.display());
        check_name(&name)?;
        let package = arguments.id.clone().unwrap_or_else(|| format!("org.example.{name}"));
        ensure!(
            is_package_id(&package),
            "--id {package}: expected letters, digits, '.', '-' and '_', as in org.example.{name}"
        );
        check_minor(arguments.kind, arguments.minor)?;
        let sdk = Sdk::of(arguments)?;
        let (kind, minor, sandbox) = (arguments.kind, arguments.minor, arguments.sandbox);
        Ok(Self { kind, name, package, sdk, minor, sandbox })
    }

    /// Where Cargo puts the library.
    fn library(&self) -> String {
        let name = self.name.replace('-', "_");
        match self.sandbox {
            true => format!("target/wasm32-unknown-unknown/release/{name}.wasm"),
            false => format!("target/release/{DLL_PREFIX}{name}{DLL_SUFFIX}"),
        }
    }

    /// What Rust needs once before the project builds, as a line.
    fn target(&self) -> &'static str {
        match self.sandbox {
            true => "rustup target add wasm32-unknown-unknown\n",
            false => "",
        }
    }

    /// What is said of trust, as lines between the commands, and as a sentence behind them.
    fn trust(&self) -> (String, &'static str) {
        match self.sandbox {
            true => (String::new(), include_str!("template/sandbox/remarks.txt").trim_end()),
            false => (
                format!("surfelshop plugins trust --place {}\n", self.library()),
                "The second command says once that whatever is built there may run.",
            ),
        }
    }

    /// The files with their texts.
    fn files(&self) -> impl Iterator<Item = (&'static str, String)> {
        let files = COMMON.iter().chain(self.kind.files());
        let files = files.map(|(file, text)| (*file, self.filled(text)));
        files.chain(self.cargo_config().map(|text| (sdk::CONFIG, text)))
    }

    /// What Cargo is told besides: what to build, and where this machine has the crates.
    fn cargo_config(&self) -> Option<String> {
        let target = if self.sandbox { SANDBOX } else { "" };
        match self.sdk.config(self.kind.crates()) {
            Some(places) => Some(sdk::with_places(target, &places)),
            None => Some(target.to_owned()).filter(|text| !text.is_empty()),
        }
    }

    /// What of it is this machine's alone.
    fn ignored(&self) -> String {
        // What is built is everybody's.
        let is_own = !self.sandbox && self.sdk.config(self.kind.crates()).is_some();
        if is_own { format!("/{}\n", sdk::CONFIG) } else { String::new() }
    }

    fn filled(&self, text: &str) -> String {
        let words = || self.name.split('-').filter(|word| !word.is_empty());
        let capital = |word: &str| {
            let (first, rest) = word.split_at(1);
            format!("{}{rest}", first.to_ascii_uppercase())
        };
        // With its kind behind it, so that it is no name of the interface's or of Rust's own.
        let name: String = words().map(capital).collect();
        let type_name = format!("{name}{}", self.kind.word());
        let title = capital(&words().collect::<Vec<_>>().join(" "));
        let is_shader = |(name, _): &&File| name.ends_with(".wgsl");
        let shaders: Vec<String> = self
            .kind
            .files()
            .iter()
            .filter(is_shader)
            .map(|(name, _)| format!("`{name}`"))
            .collect();
        let shaders = match shaders.is_empty() {
            true => String::new(),
            false => format!(" and {}", shaders.join(", ")),
        };
        let (library, what) = (self.library(), self.kind.what().trim_end_matches(','));
        let (trust, about_trust) = self.trust();
        text.replace("{{id}}", &self.name)
            .replace("{{Name}}", &type_name)
            .replace("{{title}}", &title)
            .replace("{{ending}}", &ending(&self.name))
            .replace("{{package}}", &self.package)
            .replace("{{minor}}", &self.minor.map(|n| format!(" minor: {n},")).unwrap_or_default())
            .replace("{{dependencies}}", &self.sdk.dependencies(self.kind.crates()))
            .replace("{{ignored}}", &self.ignored())
            .replace("{{where}}", self.sdk.told())
            .replace("{{what}}", what)
            .replace("{{shader}}", &shaders)
            .replace("{{target}}", self.target())
            .replace("{{trust}}", &trust)
            .replace("{{about trust}}", about_trust)
            .replace("{{remarks}}", self.kind.remarks())
            .replace("{{look}}", &self.kind.look(&self.name, &library))
            .replace("{{library}}", &library)
    }

    /// Writes the folder, whole or not at all.
    fn write(&self, path: &Path) -> anyhow::Result<()> {
        let name = path.display();
        let is_empty = path.read_dir().is_ok_and(|mut folder| folder.next().is_none());
        ensure!(is_empty || !path.exists(), "{name}: is there already; name a folder that is not");
        let parent = path.parent().filter(|parent| !parent.as_os_str().is_empty());
        let parent = parent.unwrap_or(Path::new("."));
        std::fs::create_dir_all(parent)
            .with_context(|| format!("{}: the folder cannot be made", parent.display()))?;
        let cannot = || format!("{name}: cannot be written");
        let made = tempfile::Builder::new().prefix(".surfelshop-").tempdir_in(parent);
        let made = made.with_context(cannot)?;
        // A folder for temporary files is private; a project is like any other.
        let root = made.path().join("project");
        for (file, text) in self.files() {
            let file = root.join(file);
            std::fs::create_dir_all(file.parent().unwrap_or(&root)).with_context(cannot)?;
            std::fs::write(file, text).with_context(cannot)?;
        }
        if is_empty {
            std::fs::remove_dir(path).with_context(cannot)?;
        }
        std::fs::rename(&root, path).with_context(cannot)
    }
}

/// A line of a command as it stands below others.
fn indented(line: &str) -> String {
    if line.is_empty() { String::new() } else { format!("  {line}") }
}

/// The ending of a format's files: its name without hyphens, as far as endings go.
fn ending(name: &str) -> String {
    name.chars().filter(|c| *c != '-').take(MAX_ENDING_LEN).collect()
}

/// Refuses a minor version that the templates of a kind do not run in.
fn check_minor(kind: NewKind, minor: Option<u16>) -> anyhow::Result<()> {
    let least = match kind {
        NewKind::Shading | NewKind::Graph => 7,
        NewKind::Splat => 9,
        NewKind::Format => 8,
        NewKind::Brush => 11,
        NewKind::Tool | NewKind::Tracer => 0,
    };
    let minor = minor.unwrap_or(ABI_MINOR);
    ensure!(
        minor >= least,
        "--minor {minor}: {} needs hosts of ABI {ABI_MAJOR}.{least} at least",
        kind.what().to_lowercase().trim_end_matches(',')
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::ValueEnum as _;

    #[test]
    fn endings_of_files_are_short_and_of_letters_and_digits() {
        assert_eq!(ending("rim-light"), "rimlight");
        assert_eq!(ending("a-name-that-is-longer-than-endings"), "anamethatislonge");
    }

    #[test]
    fn nothing_of_a_template_is_left_unfilled() {
        for kind in NewKind::value_variants().iter().copied() {
            let (name, package) = ("rim-light".to_owned(), "org.example.rim-light".to_owned());
            let sdk = Sdk::Registry("/sdk".to_owned());
            let (minor, sandbox) = (Some(9), kind != NewKind::Graph);
            let project = Project { kind, name, package, sdk, minor, sandbox };
            for (file, text) in project.files() {
                assert!(!text.contains("{{"), "{file} of {kind:?}: {text}");
            }
            let (_, code) = project.files().find(|(file, _)| *file == "src/lib.rs").unwrap();
            assert!(code.contains("struct RimLight") && code.contains("\"Rim light\""), "{code}");
            assert!(code.contains("id: \"org.example.rim-light\", minor: 9, "), "{code}");
        }
    }
}
