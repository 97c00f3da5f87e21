//! Judges pictures of own cases, and accepts them.

use super::declared::{OwnCase, is_exr};
use super::drawn::Drawn;
use crate::conformance::Verdict;
use anyhow::{Context as _, anyhow};
use std::path::{Path, PathBuf};
use surfelshop_api::graph::Output;
use surfelshop_api::params::srgb_to_linear;
use surfelshop_image::display_transform::{DisplayTransform, to_8_bit};
use surfelshop_image::{Image, exr, metrics, outputs, png};
use surfelshop_session::output::files;

/// What became of a case.
pub(super) struct Judged {
    pub(super) verdict: Verdict,
    pub(super) said: String,
    pub(super) pictures: Vec<(String, Image)>,
}

impl Judged {
    pub(super) fn passed(said: String) -> Self {
        Self { verdict: Verdict::Passed, said, pictures: Vec::new() }
    }
}

/// How far a picture is from the expected one, and where.
struct Distance {
    /// Decibels; infinite for equal ones.
    psnr: f64,
    said: String,
    map: Image,
}

/// FLIP, and share of the levels, from which a map of differences is lightest.
const FULL: f32 = 0.25;

/// Holds a picture against the expected one; one that is too far is written beside that, where it `is_written`.
pub(super) fn judge(case: &OwnCase, drawn: &Drawn, is_written: bool) -> anyhow::Result<Judged> {
    let expected = drawn.expected.as_ref().context("there is no picture to compare with")?;
    let found = [drawn.color.width, drawn.color.height];
    let size = [expected.width, expected.height];
    if found != size {
        return Err(anyhow!(
            "{}: expected {} x {} pixels, as the case says, found {} x {}; --accept writes it anew",
            case.expect.display(),
            found[0],
            found[1],
            size[0],
            size[1]
        ));
    }
    let Distance { psnr, said, map } = match is_exr(&case.expect) {
        true => linear(&drawn.color, expected, drawn.how)?,
        false => displayed(&drawn.color, expected, drawn.how)?,
    };
    if psnr >= case.psnr {
        return Ok(Judged::passed(said));
    }
    let difference = metrics::in_color(&map, FULL);
    let mut said = format!("{said}: below {} dB", case.psnr);
    if is_written {
        let (found, differs) = (named(&case.expect, "found"), named(&case.expect, "difference"));
        write_picture(&found, &drawn.color, drawn.how)?;
        let differs = differs.with_extension("png");
        files::write_whole(&differs, &png::encode(&difference, png::Bits::Eight)?)?;
        said = format!("{said}; see {} and {}", found.display(), differs.display());
    }
    // Those of a report are developed as they are written.
    let expected = match is_exr(&case.expect) {
        true => expected.clone(),
        false => decoded(expected),
    };
    let pictures = vec![
        ("found".to_owned(), drawn.color.clone()),
        ("expected".to_owned(), expected),
        ("difference".to_owned(), decoded(&difference)),
    ];
    Ok(Judged { verdict: Verdict::Failed, said, pictures })
}

/// The radiance of a picture that a screen shows.
fn decoded(shown: &Image) -> Image {
    let decode =
        |(i, value): (usize, &f32)| if i % 4 == 3 { *value } else { srgb_to_linear(*value) };
    Image { data: shown.data.iter().enumerate().map(decode).collect(), ..*shown }
}

/// Pictures of radiance, developed alike.
fn linear(
    color: &Image,
    expected: &Image,
    development: DisplayTransform,
) -> anyhow::Result<Distance> {
    let settings = metrics::Settings { development, ..metrics::Settings::default() };
    let (comparison, maps) = metrics::compare_with_maps(color, expected, &settings)?;
    let errors = comparison
        .errors
        .ok_or_else(|| anyhow!("{} pixels are not finite", comparison.n_not_finite))?;
    let psnr = errors.psnr.unwrap_or(f64::INFINITY);
    let said = match errors.psnr {
        Some(_) => {
            format!("PSNR {psnr:.2} dB, RMSE {:.6}, FLIP {:.4}", errors.rmse, errors.flip.mean)
        }
        None => "equal as they are shown".to_owned(),
    };
    Ok(Distance { psnr, said, map: maps.flip.context("there is no map of differences")? })
}

/// A picture of radiance as its PNG would be, and a PNG: both over black.
fn displayed(color: &Image, expected: &Image, how: DisplayTransform) -> anyhow::Result<Distance> {
    let shown = outputs::visible(&Output::Color, color, &how);
    let levels = |image: &Image| -> Vec<u8> {
        let over_black = |pixel: &[u8]| {
            let alpha = u32::from(pixel[3]);
            let over = |level: u8| ((u32::from(level) * alpha + 127) / 255) as u8;
            [over(pixel[0]), over(pixel[1]), over(pixel[2]), 255]
        };
        to_8_bit(image).chunks_exact(4).flat_map(over_black).collect()
    };
    let errors = metrics::compare_levels(&levels(&shown), &levels(expected))
        .context("there are no pixels to compare")?;
    let psnr = metrics::psnr(errors.rmse);
    let largest = errors.largest.iter().copied().fold(0.0, f32::max);
    let said = match errors.rmse > 0.0 {
        true => format!("PSNR {psnr:.2} dB, largest difference {:.0} of 255", 255.0 * largest),
        false => "equal".to_owned(),
    };
    let (width, height) = (expected.width, expected.height);
    let map = Image { width, height, components: 1, data: errors.largest };
    Ok(Distance { psnr, said, map })
}

/// Writes what was drawn as what is expected from now on.
pub(super) fn accept(case: &OwnCase, drawn: &Drawn) -> anyhow::Result<String> {
    let before = match judge(case, drawn, false) {
        Ok(judged) => format!("; from the one before: {}", judged.said),
        Err(_) => String::new(),
    };
    write_picture(&case.expect, &drawn.color, drawn.how)?;
    let Image { width, height, .. } = drawn.color;
    Ok(format!("accepted: {}, {width} x {height}{before}", case.expect.display()))
}

/// Writes a picture by its ending: radiance, or what a screen shows.
fn write_picture(path: &Path, color: &Image, how: DisplayTransform) -> anyhow::Result<()> {
    let bytes = match is_exr(path) {
        true => exr::encode(&[&(Output::Color, color.clone())])?,
        false => png::encode(&outputs::visible(&Output::Color, color, &how), png::Bits::Eight)?,
    };
    files::write_whole(path, &bytes)
}

/// The path with a word before its ending.
fn named(path: &Path, word: &str) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let ending = path.extension().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{stem}.{word}.{ending}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(value: f32) -> Image {
        Image { width: 16, height: 16, components: 4, data: [value, value, value, 1.0].repeat(256) }
    }

    #[test]
    fn equal_pictures_are_infinitely_near_and_others_as_far_as_their_levels() {
        let how = DisplayTransform::default();
        assert!(linear(&flat(0.5), &flat(0.5), how).unwrap().psnr.is_infinite());
        let shown = outputs::visible(&Output::Color, &flat(0.5), &how);
        let png = Image {
            data: to_8_bit(&shown).iter().map(|&l| f32::from(l) / 255.0).collect(),
            ..shown
        };
        assert!(displayed(&flat(0.5), &png, how).unwrap().psnr.is_infinite());
        let far = displayed(&flat(0.0), &png, how).unwrap();
        // Level 188 of 255 is what sRGB makes of a half.
        assert!((far.psnr - metrics::psnr(188.0 / 255.0)).abs() < 1e-6, "{}", far.psnr);
        assert!(far.said.ends_with("188 of 255"), "{}", far.said);
        assert!(linear(&flat(f32::NAN), &flat(0.5), how).is_err());
    }

    #[test]
    fn names_of_what_was_found_stand_beside_the_expectation() {
        assert_eq!(named(Path::new("cases/a.b.exr"), "found"), Path::new("cases/a.b.found.exr"));
    }
}
