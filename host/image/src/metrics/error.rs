//! What can be wrong with pictures that are to be compared.

use super::{Reference, Settings};
use crate::Image;

/// Why pictures cannot be compared.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MetricsError {
    /// A picture of other than radiance and coverage.
    #[error(
        "the {which} has {found} values a pixel and cannot be compared: radiance with coverage has 4"
    )]
    Components {
        /// `test`, `reference` or `variance of the reference`.
        which: &'static str,
        /// Values a pixel.
        found: u32,
    },
    /// A picture whose values are more or fewer than its size says.
    #[error("the {which} has {found} values; {width} x {height} pixels have {expected}")]
    Length {
        /// `test`, `reference` or `variance of the reference`.
        which: &'static str,
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
        /// Values there are.
        found: usize,
        /// Values there should be.
        expected: u64,
    },
    /// Pictures of different sizes.
    #[error(
        "the {which} has {} x {} pixels and the reference {} x {}: only pictures of one size can be \
         compared",
        found[0], found[1], expected[0], expected[1]
    )]
    Sizes {
        /// `test` or `variance of the reference`.
        which: &'static str,
        /// Its width and height in pixels.
        found: [u32; 2],
        /// Those of the reference.
        expected: [u32; 2],
    },
    /// Pictures without pixels.
    #[error("the pictures have {width} x {height} pixels: there is nothing to compare")]
    Empty {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
    },
    /// A reference that nothing can be measured against.
    #[error(
        "{n_pixels} of {of} pixels of the reference are not finite: nothing can be measured against it"
    )]
    Reference {
        /// Pixels of which a value is not finite.
        n_pixels: u64,
        /// Pixels there are.
        of: u64,
    },
    /// A variance that is none.
    #[error(
        "{n_pixels} of {of} pixels of the reference's variance are negative or not finite: a variance \
         is 0 or more"
    )]
    Variance {
        /// Pixels of which a value is no variance.
        n_pixels: u64,
        /// Pixels there are.
        of: u64,
    },
    /// Values of other points than the reference's.
    #[error(
        "there are {test} values and {reference} of the reference: only values of the same points can be \
         compared"
    )]
    Counts {
        /// Values there are.
        test: usize,
        /// Values of the reference.
        reference: usize,
    },
    /// Values that nothing can be said of.
    #[error("of {n} {whose}, {n_not_finite} are not finite: nothing can be measured")]
    Values {
        /// `values` or `values of the reference`.
        whose: &'static str,
        /// Values there are.
        n: usize,
        /// Those that are not finite.
        n_not_finite: u64,
    },
    /// A setting out of its range.
    #[error("{setting} is {found}; it must be {expected}")]
    Setting {
        /// What it is called.
        setting: &'static str,
        /// Its value.
        found: f64,
        /// What it may be.
        expected: &'static str,
    },
}

/// Whether two pictures can be compared so.
pub(super) fn check(
    test: &Image,
    reference: &Reference<'_>,
    settings: &Settings,
) -> Result<(), MetricsError> {
    check_settings(settings)?;
    let picture = reference.picture;
    check_shape("reference", picture)?;
    if picture.width == 0 || picture.height == 0 {
        return Err(MetricsError::Empty { width: picture.width, height: picture.height });
    }
    check_beside("test", test, picture)?;
    let of = (picture.data.len() / 4) as u64;
    let n_pixels = count_not_finite(picture);
    if n_pixels > 0 {
        return Err(MetricsError::Reference { n_pixels, of });
    }
    if let Some(variance) = reference.variance {
        check_beside("variance of the reference", variance, picture)?;
        let is_one = |value: &f32| value.is_finite() && *value >= 0.0;
        let pixels = variance.data.chunks_exact(4);
        let n_pixels = pixels.filter(|pixel| !pixel[..3].iter().all(is_one)).count() as u64;
        if n_pixels > 0 {
            return Err(MetricsError::Variance { n_pixels, of });
        }
    }
    Ok(())
}

fn check_settings(settings: &Settings) -> Result<(), MetricsError> {
    let Settings { epsilon, outlier_share, pixels_per_degree, development } = *settings;
    let stops = f64::from(development.exposure_stops);
    let all = [
        // So that the largest squared float divided by it is finite.
        ("epsilon of relMSE", epsilon, "1e-12 to 1e12", (1e-12..=1e12).contains(&epsilon)),
        (
            "the share of outliers",
            outlier_share,
            "0 to below 1",
            (0.0..1.0).contains(&outlier_share),
        ),
        // Filters of more degrees than a picture has pixels would cost time and say nothing.
        (
            "pixels per degree",
            pixels_per_degree,
            "1 to 1000",
            (1.0..=1000.0).contains(&pixels_per_degree),
        ),
        ("the exposure in stops", stops, "finite", stops.is_finite()),
    ];
    match all.into_iter().find(|(.., good)| !good) {
        Some((setting, found, expected, _)) => {
            Err(MetricsError::Setting { setting, found, expected })
        }
        None => Ok(()),
    }
}

/// Whether a picture has the reference's size and shape.
fn check_beside(which: &'static str, image: &Image, reference: &Image) -> Result<(), MetricsError> {
    check_shape(which, image)?;
    let [found, expected] = [image, reference].map(|image| [image.width, image.height]);
    if found == expected { Ok(()) } else { Err(MetricsError::Sizes { which, found, expected }) }
}

fn check_shape(which: &'static str, image: &Image) -> Result<(), MetricsError> {
    if image.components != 4 {
        return Err(MetricsError::Components { which, found: image.components });
    }
    let Image { width, height, ref data, .. } = *image;
    let (found, expected) = (data.len(), u64::from(width).saturating_mul(u64::from(height) * 4));
    if found as u64 == expected {
        Ok(())
    } else {
        Err(MetricsError::Length { which, width, height, found, expected })
    }
}

/// Pixels of four values of which any is not finite.
pub(super) fn count_not_finite(image: &Image) -> u64 {
    let pixels = image.data.chunks_exact(4);
    pixels.filter(|pixel| !pixel.iter().all(|value| value.is_finite())).count() as u64
}
