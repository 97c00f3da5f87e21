//! `surfelshop plugins pack`: one file to hand on, of a module, its README, its licence and a preview.

pub(super) mod archive;

use super::{inspected, named};
use crate::plugins::arguments::{PackArguments, PluginsArguments};
use anyhow::{Context as _, anyhow, bail, ensure};
use archive::{ENDING, Packed};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::process::Command;
use surfelshop_api::UnitKind;
use surfelshop_api::manifest::Manifest;
use surfelshop_runtime::plugins::is_module;
use surfelshop_session::output::{files, terminal};

/// Where Cargo leaves modules.
const BUILT: &str = "target/wasm32-unknown-unknown/release";

/// Most bytes of a text.
const MAX_TEXT: u64 = 1 << 20;

/// Sides of a preview, pixels.
const PREVIEW_SIZE: &str = "256";

/// Runs the command.
pub(super) fn run(arguments: &PluginsArguments, pack: &PackArguments) -> anyhow::Result<()> {
    let PackArguments { folder, output, cloud } = pack;
    ensure!(
        archive::is_pack(output),
        "{}: expected a name that ends in .{ENDING}; rename it",
        output.display()
    );
    files::check_writable(output)?;
    let path = module_in(folder)?;
    let (manifest, _) = inspected(&path)?;
    let module = files::read_short(&path, u64::MAX)?;
    ensure!(
        is_module(&module),
        "{}: expected a WebAssembly module, found a library; `plugins new --sandbox` begins a module",
        path.display()
    );
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let packed = Packed {
        name: format!("{stem}.wasm"),
        module,
        readme: text_in(folder, &["README.md"])?,
        licence: text_in(folder, &["LICENSE", "LICENSE.md", "LICENSE.txt", "COPYING"])?,
        preview: preview(&manifest, &path, cloud.as_deref())?,
    };
    let bytes = packed.to_bytes()?;
    files::write_whole(output, &bytes)?;
    // What is handed on is what `plugins add` takes.
    Packed::read(output)?;
    let has_preview = !packed.preview.is_empty();
    if arguments.json {
        return terminal::json(&json!({
            "command": "plugins pack",
            "file": output.display().to_string(),
            "bytes": bytes.len(),
            "module": path.display().to_string(),
            "preview": has_preview,
            "manifest": manifest,
        }));
    }
    let preview = if has_preview { "with a preview" } else { "without a preview" };
    terminal::line(format!(
        "{}\n  file      {} ({:.2} MB, {preview})",
        named(&manifest),
        output.display(),
        bytes.len() as f64 * 1e-6
    ))
}

/// The only module of a project: in its folder, or where Cargo leaves it.
fn module_in(folder: &Path) -> anyhow::Result<PathBuf> {
    let modules = |folder: &Path| -> Vec<PathBuf> {
        let files = folder.read_dir().into_iter().flatten().flatten().map(|file| file.path());
        files.filter(|path| path.extension().is_some_and(|ending| ending == "wasm")).collect()
    };
    ensure!(folder.is_dir(), "{}: expected the folder of a plugin", folder.display());
    let mut found = modules(folder);
    if found.is_empty() {
        found = modules(&folder.join(BUILT));
    }
    found.sort();
    match found.as_slice() {
        [only] => Ok(only.clone()),
        [] => bail!(
            "{}: expected a module there or in {BUILT}, found none; build it first",
            folder.display()
        ),
        [first, second, ..] => bail!(
            "{}: expected one module, found {} and {}; remove one",
            folder.display(),
            first.display(),
            second.display()
        ),
    }
}

/// The first of these files that there is.
fn text_in(folder: &Path, names: &[&str]) -> anyhow::Result<Vec<u8>> {
    let found = names.iter().map(|name| folder.join(name)).find(|path| path.exists());
    let path = found.ok_or_else(|| {
        anyhow!("{}: expected a {}, which a pack holds; write one", folder.display(), names[0])
    })?;
    files::read_short(&path, MAX_TEXT)
}

/// A picture of a cloud by the first renderer of a module, made by this program as `render` makes it; nothing where it
/// has no renderer.
fn preview(manifest: &Manifest, module: &Path, cloud: Option<&Path>) -> anyhow::Result<Vec<u8>> {
    let Some(unit) = manifest.units.iter().find(|unit| unit.kind == UnitKind::Renderer) else {
        return Ok(Vec::new());
    };
    let folder = tempfile::tempdir().context("a folder for the preview cannot be made")?;
    let png = folder.path().join("preview.png");
    let program = std::env::current_exe().context("the place of the program is not known")?;
    let cloud = match cloud {
        Some(cloud) => cloud.to_owned(),
        None => surfelshop_session::input::sample::find_sample()?,
    };
    let mut render = Command::new(program);
    render.arg("render").arg(&cloud).arg("-r").arg(format!("{}/{}", manifest.id, unit.id));
    render.arg("--plugin").arg(module).args(["--size", PREVIEW_SIZE, "-o"]).arg(&png);
    let output = render.output().context("the preview cannot be rendered")?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        let line = said.lines().last().unwrap_or_default().trim_start_matches("error: ");
        bail!("{}: no preview could be rendered: {line}", module.display());
    }
    files::read_short(&png, 4 << 20)
}
