//! Writes the sample cloud and the sample light probe into `assets/`.

#![expect(clippy::print_stdout, reason = "the line per file is this program's output")]

use std::path::Path;

fn main() -> anyhow::Result<()> {
    let own_folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = own_folder.with_file_name("sample.ply");
    surfelshop_assets::write_sample(&path)?;
    println!("{}", path.display());
    let path = own_folder.with_file_name("sky.hdr");
    surfelshop_assets::write_sky(&path)?;
    println!("{}", path.display());
    Ok(())
}
