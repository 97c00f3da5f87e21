//! Writes the sample cloud, the Cornell box and the sample light probe into `assets/`.

#![expect(clippy::print_stdout, reason = "the line per file is this program's output")]

use std::path::Path;

use surfelshop_assets::cornell;

fn main() -> anyhow::Result<()> {
    let own_folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = own_folder.with_file_name("sample.ply");
    surfelshop_assets::write_sample(&path)?;
    println!("{}", path.display());
    let path = own_folder.with_file_name("sky.hdr");
    surfelshop_assets::write_sky(&path)?;
    println!("{}", path.display());
    let path = own_folder.with_file_name(cornell::CLOUD_FILE);
    cornell::write_cornell_box(&path)?;
    println!("{}", path.display());
    let path = own_folder.with_file_name("cornell-box.scene.toml");
    cornell::write_cornell_scene(&path)?;
    println!("{}", path.display());
    Ok(())
}
