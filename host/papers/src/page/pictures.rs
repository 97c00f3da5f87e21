//! The pictures of a page, as it holds them.

use crate::outcome::Made;
use std::collections::HashMap;
use std::path::PathBuf;
use surfelshop_evaluate::comparison_page::{Page, Picture};
use surfelshop_session::output::files;

/// Bytes of the pictures of a page: with tables and drawings it stays below 15 MB.
const MOST_ON_PAGE: usize = 11_000_000;

/// Most bytes of a picture that is read.
const MOST_BYTES: u64 = 256 << 20;

/// Pictures by their files, as data addresses.
pub(super) struct Pictures {
    addresses: HashMap<PathBuf, String>,
    are_smaller: bool,
}

impl Pictures {
    /// Reads the pictures of entries, smaller where they would not fit on a page.
    pub(super) fn read(entries: &[Made<'_>]) -> anyhow::Result<Self> {
        let (mut paths, mut page) = (Vec::new(), Page::default());
        for outcome in entries.iter().filter_map(|made| made.outcome.as_ref().ok()) {
            for picture in &outcome.pictures {
                let path = outcome.folder.join(&picture.file);
                let png = files::read_short(&path, MOST_BYTES)?;
                page.pictures.push(Picture::new(picture.name.clone(), [0; 2], png));
                paths.push(path);
            }
        }
        let are_smaller = page.shrink(MOST_ON_PAGE)?;
        let addresses = page.pictures.iter().map(Picture::address);
        Ok(Self { addresses: paths.into_iter().zip(addresses).collect(), are_smaller })
    }

    /// Whether pictures are smaller than they were drawn.
    pub(super) fn are_smaller(&self) -> bool {
        self.are_smaller
    }

    /// The address of a picture.
    pub(super) fn address(&self, path: &std::path::Path) -> &str {
        self.addresses.get(path).map_or("", String::as_str)
    }
}
