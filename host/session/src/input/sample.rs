//! The sample cloud of a checkout.

use anyhow::Context as _;
use std::path::PathBuf;

/// Where the sample lies, from a folder above the program or from the current one.
const SAMPLE: &str = "assets/sample.ply";

/// The sample cloud beside the program or in the current folder.
pub fn find_sample() -> anyhow::Result<PathBuf> {
    let program = std::env::current_exe().ok();
    let above = program.iter().flat_map(|program| program.ancestors().skip(1));
    let found = above.map(|folder| folder.join(SAMPLE)).find(|sample| sample.is_file());
    found.or_else(|| Some(PathBuf::from(SAMPLE)).filter(|sample| sample.is_file())).with_context(
        || {
            format!(
                "expected the sample cloud {SAMPLE} in the current folder or in one above the \
             program, found none; packages and checkouts of Surfelshop have it"
            )
        },
    )
}
