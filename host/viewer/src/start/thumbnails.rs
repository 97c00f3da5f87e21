//! Small pictures of the files that were open last, beside the list of these files.

use crate::document::StateFolder;
use anyhow::Context as _;
use eframe::egui::{ColorImage, Context, TextureHandle, TextureOptions};
use image::{ImageFormat, RgbaImage, imageops};
use siphasher::sip::SipHasher13;
use std::collections::HashMap;
use std::hash::Hasher as _;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use surfelshop_session::output::files;

/// Width and height, pixels.
const SIZE: [u32; 2] = [160, 100];

/// Most bytes of one: more than its pixels take without compression.
const LARGEST: u64 = 1 << 17;

/// The small pictures that are on the screen.
#[derive(Default)]
pub(crate) struct Thumbnails {
    pub(super) shown: HashMap<PathBuf, Option<TextureHandle>>,
    /// The file and the picture that were written last.
    pub(super) written: Option<(PathBuf, u64)>,
}

pub(super) fn file_of(folder: &StateFolder, path: &Path) -> PathBuf {
    let mut hasher = SipHasher13::new();
    hasher.write(path.as_os_str().as_encoded_bytes());
    folder.folder().join("thumbnails").join(format!("{:016x}.png", hasher.finish()))
}

impl Thumbnails {
    /// The small picture of a recent file, if there is one.
    pub(super) fn of(
        &mut self,
        ctx: &Context,
        folder: Option<&StateFolder>,
        path: &Path,
    ) -> Option<TextureHandle> {
        let load = || {
            let bytes = files::read_short(&file_of(folder?, path), LARGEST).ok()?;
            let picture = image::load_from_memory_with_format(&bytes, ImageFormat::Png).ok()?;
            let (width, height) = (picture.width(), picture.height());
            // Somebody may have put another picture there.
            if [width, height] != SIZE {
                return None;
            }
            let size = [width as usize, height as usize];
            let image = ColorImage::from_rgba_unmultiplied(size, picture.into_rgba8().as_raw());
            Some(ctx.load_texture("thumbnail", image, TextureOptions::LINEAR))
        };
        self.shown.entry(path.to_owned()).or_insert_with(load).clone()
    }
}

/// The middle of a picture, small.
fn small(size: [u32; 2], levels: &[u8]) -> Option<RgbaImage> {
    let [width, height] = size;
    let picture = RgbaImage::from_raw(width, height, levels.to_vec())?;
    // What is looked at leaves room around it.
    let [across, down] = [width, height].map(|side| (side * 3 / 4).max(1));
    let cut_height = (across * SIZE[1] / SIZE[0]).clamp(1, down);
    let cut_width = (cut_height * SIZE[0] / SIZE[1]).clamp(1, across);
    let (left, top) = ((width - cut_width) / 2, (height - cut_height) / 2);
    let cut = imageops::crop_imm(&picture, left, top, cut_width, cut_height).to_image();
    Some(imageops::thumbnail(&cut, SIZE[0], SIZE[1]))
}

pub(super) fn write(file: &Path, size: [u32; 2], levels: &[u8]) -> anyhow::Result<()> {
    anyhow::ensure!(size.iter().all(|side| *side > 0), "the picture is empty");
    let small = small(size, levels).context("the picture has another size than it says")?;
    let mut bytes = Cursor::new(Vec::new());
    small.write_to(&mut bytes, ImageFormat::Png)?;
    if let Some(folder) = file.parent() {
        std::fs::create_dir_all(folder)?;
    }
    files::write_whole(file, bytes.get_ref())
}

/// Removes the small pictures of files that are no longer in the list.
pub(super) fn remove_others(folder: &StateFolder, recent: &[PathBuf], written: &Path) {
    let wanted: Vec<PathBuf> = recent.iter().map(|path| file_of(folder, path)).collect();
    let Some(found) = written.parent().and_then(|folder| folder.read_dir().ok()) else { return };
    for entry in found.flatten().map(|entry| entry.path()) {
        let is_thumbnail = entry.extension().is_some_and(|ending| ending == "png");
        if is_thumbnail && !wanted.contains(&entry) {
            // The next one tries again.
            drop(std::fs::remove_file(entry));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thumbnail_is_the_middle_of_the_picture() {
        // A white square in the middle of black.
        let size = [400, 300];
        let levels: Vec<u8> = (0..size[1])
            .flat_map(|y| (0..size[0]).map(move |x| (x, y)))
            .flat_map(|(x, y)| {
                let is_white = (150..250).contains(&x) && (100..200).contains(&y);
                [[0, 0, 0, 255], [255; 4]][usize::from(is_white)]
            })
            .collect();
        let picture = small(size, &levels).unwrap();
        assert_eq!([picture.width(), picture.height()], SIZE);
        assert_eq!(
            (picture.get_pixel(80, 50).0, picture.get_pixel(5, 5).0),
            ([255; 4], [0, 0, 0, 255])
        );
        for odd in [[1, 1], [1, 500], [700, 1]] {
            let levels = vec![7; (odd[0] * odd[1] * 4) as usize];
            assert_eq!(small(odd, &levels).unwrap().width(), SIZE[0], "{odd:?}");
        }
        assert!(small([4, 4], &[0; 3]).is_none());
    }

    #[test]
    fn only_those_of_recent_files_stay() {
        let folder = tempfile::tempdir().unwrap();
        let state = StateFolder::in_folder(folder.path().to_owned());
        let paths = ["/a.ply", "/b.ply"].map(PathBuf::from);
        for path in &paths {
            write(&file_of(&state, path), [32, 20], &[9; 32 * 20 * 4]).unwrap();
        }
        let ctx = Context::default();
        let shown = |path: &Path| Thumbnails::default().of(&ctx, Some(&state), path).is_some();
        assert!(shown(&paths[0]) && shown(&paths[1]));
        remove_others(&state, &paths[..1], &file_of(&state, &paths[0]));
        assert!(shown(&paths[0]) && !shown(&paths[1]));
    }
}
