//! Small pictures for the README and the manual: what entries made, side by side, with a name below each.

use crate::entries::Paper;
use crate::outcome::{Made, PictureFile};
use anyhow::{Context as _, ensure};
use std::path::Path;
use surfelshop_image::text::Line;
use surfelshop_image::{Image, png};
use surfelshop_session::output::files;

/// Pictures side by side.
const MOST: usize = 5;
/// Pixels between pictures.
const GAP: u32 = 4;
/// Pixels below a picture for its name, and the size of that.
const NAME: u32 = 18;
const TEXT: f32 = 13.0;
/// Most pixels of a picture that is read.
const MOST_PIXELS: u64 = 1 << 24;

/// Writes a sheet for each entry of the gallery that was made, and says where they are.
///
/// # Errors
/// One line where the folder or a picture cannot be written or read.
pub(crate) fn write(
    folder: &Path,
    made: &[(&Paper, Vec<Made<'_>>)],
) -> anyhow::Result<Vec<String>> {
    std::fs::create_dir_all(folder)
        .with_context(|| format!("{}: the folder cannot be made", folder.display()))?;
    let mut written = Vec::new();
    for (paper, entries) in made {
        for made in entries.iter().filter(|made| !made.entry.gallery.is_empty()) {
            // What failed is said where the command ends.
            let Ok(outcome) = &made.outcome else { continue };
            let path = folder.join(format!("{}.png", made.entry.folder(&paper.id)));
            let sheet = sheet(&outcome.folder, &outcome.pictures)
                .with_context(|| format!("{} of {}", made.entry.id, paper.id))?;
            files::write_whole(&path, &png::encode(&sheet, png::Bits::Eight)?)?;
            written.push(path.display().to_string());
        }
    }
    Ok(written)
}

/// The first pictures of a folder side by side on white.
fn sheet(folder: &Path, pictures: &[PictureFile]) -> anyhow::Result<Image> {
    // Maps of differences are no pictures that show something by themselves.
    let pictures = pictures.iter().filter(|picture| !picture.name.starts_with("difference"));
    let pictures: Vec<&PictureFile> = pictures.take(MOST).collect();
    let read = |picture: &&PictureFile| png::read(&folder.join(&picture.file), MOST_PIXELS);
    let images: Vec<Image> = pictures.iter().map(read).collect::<Result<_, _>>()?;
    let height = images.iter().map(|image| image.height).max().unwrap_or(0) + NAME;
    let gaps = GAP * (images.len().saturating_sub(1)) as u32;
    let width = images.iter().map(|image| image.width).sum::<u32>() + gaps;
    ensure!(
        !images.is_empty() && u64::from(width) * u64::from(height) <= MOST_PIXELS,
        "there is no picture to show, or they are too large"
    );
    let data = vec![1.0; (width * height * 4) as usize];
    let mut sheet = Image { width, height, components: 4, data };
    let mut left = 0;
    for (image, picture) in images.iter().zip(pictures) {
        paste(&mut sheet, image, left);
        let line = Line::new(&picture.name, TEXT);
        let x = left as f32 + 0.5 * (image.width as f32 - line.width).max(0.0);
        line.draw(&mut sheet, [x, height as f32 - 5.0], [0.15; 3]);
        left += image.width + GAP;
    }
    Ok(sheet)
}

/// Lays a picture over the top of a sheet, its left edge at a column.
fn paste(sheet: &mut Image, image: &Image, left: u32) {
    let row = (sheet.width * 4) as usize;
    for (y, from) in image.data.chunks_exact((image.width * 4) as usize).enumerate() {
        let Some(to) = sheet.data.get_mut(y * row + (left * 4) as usize..) else { return };
        for (to, from) in to.chunks_exact_mut(4).zip(from.chunks_exact(4)) {
            let alpha = from[3];
            for channel in 0..3 {
                to[channel] = from[channel] * alpha + to[channel] * (1.0 - alpha);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_stand_side_by_side_on_white() {
        let folder = tempfile::tempdir().unwrap();
        let picture = |name: &str, color: [f32; 4]| {
            let data = color.repeat(30 * 20);
            let image = Image { width: 30, height: 20, components: 4, data };
            let bytes = png::encode(&image, png::Bits::Eight).unwrap();
            std::fs::write(folder.path().join(name), bytes).unwrap();
            PictureFile { name: "a name".to_owned(), file: name.to_owned() }
        };
        let pictures = [picture("a", [1.0, 0.0, 0.0, 1.0]), picture("b", [0.0, 0.0, 0.0, 0.0])];
        let sheet = sheet(folder.path(), &pictures).unwrap();
        assert_eq!((sheet.width, sheet.height), (64, 38));
        let at = |x: usize, y: usize| &sheet.data[(y * 64 + x) * 4..][..4];
        assert_eq!(at(5, 5), [1.0, 0.0, 0.0, 1.0]);
        assert_eq!((at(32, 5), at(50, 5)), (&[1.0; 4][..], &[1.0; 4][..]));
        let is_dark = |pixel: &[f32]| pixel[0] < 0.6;
        assert!(sheet.data[64 * 20 * 4..].chunks_exact(4).any(is_dark), "names are below");
        assert!(super::sheet(folder.path(), &[]).is_err());
    }
}
