//! Writes the sample clouds into `assets/`.

#![expect(clippy::print_stdout, reason = "the line per file is this program's output")]

use std::path::Path;

use anyhow::Context;

fn main() -> anyhow::Result<()> {
    let own_folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = own_folder.with_file_name("sample.ply");
    let bytes = surfelshop_assets::sample_cloud();
    std::fs::write(&path, &bytes).with_context(|| format!("cannot write {}", path.display()))?;
    println!("{}: {} bytes", path.display(), bytes.len());
    Ok(())
}
