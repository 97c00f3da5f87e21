//! Every number that compares two pictures, or values of the same points.
//!
//! A test is measured against a reference. Both are pictures of linear radiance with straight
//! coverage, four values a pixel, as renderers make them. [`compare`] gives two families of numbers:
//!
//! - *linear* ones ([`Errors::rmse`], [`Errors::rel_mse`], [`Errors::max_absolute`]) of radiance times
//!   coverage, that is, of the pictures over black without exposure or tone mapping;
//! - *displayed* ones ([`Errors::psnr`], [`Errors::ssim`], [`Errors::flip`]) of what a screen shows:
//!   both pictures developed alike by [`Settings::development`], coverage included, over its
//!   background. Over a transparent background they are shown on black.
//!
//! [`compare_levels`] measures pictures that are 8-bit levels already, as the window shows them, and
//! [`compare_values`] values of points, such as the columns that tools make.
//!
//! Invariants: no number is NaN or infinite; a test with pixels that are not finite has no errors,
//! and [`Comparison::n_not_finite`] says so; results do not depend on the number of threads.

mod color;
mod displayed;
mod error;
mod filter;
mod flip;
mod levels;
mod linear;
mod pooled;
mod ssim;
#[cfg(test)]
mod tests;
mod values;

use crate::display_transform::DisplayTransform;
use crate::{Image, TracedPicture};
use serde::{Deserialize, Serialize};

pub use color::in_color;
pub use error::MetricsError;
pub use levels::{LevelErrors, compare_levels, psnr};
pub use values::{ValueErrors, compare_values};

/// Coverage from which a pixel counts as covered. At a half, a silhouette that is antialiased in one
/// picture only is no difference.
const COVERED: f32 = 0.5;

/// What the numbers depend on besides the pictures; kept beside them in [`Comparison`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// Added to the squared radiance that relative errors are divided by, so that black pixels do not
    /// decide them; 1e-12 to 1e12. 0.01 unless given.
    ///
    /// Source: Rousselle, Knaus and Zwicker 2011, "Adaptive Sampling and Reconstruction using Greedy
    /// Error Minimization".
    pub epsilon: f64,
    /// Share of the pixels, those of the largest relative squared errors, that
    /// [`Squared::rel_mse_without_outliers`] leaves out; 0 to below 1. 0.001 unless given.
    pub outlier_share: f64,
    /// How large pixels are seen for FLIP, in pixels per degree of the visual field; 1 to 1000. 67
    /// unless given, the paper's: a screen 0.7 m wide with 3840 pixels, seen from 0.7 m.
    pub pixels_per_degree: f64,
    /// How both pictures are developed for the displayed metrics. A transparent background is
    /// black.
    pub development: DisplayTransform,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            epsilon: 0.01,
            outlier_share: 0.001,
            pixels_per_degree: 67.0,
            development: DisplayTransform::default(),
        }
    }
}

/// What a picture is measured against.
#[derive(Clone, Copy, Debug)]
pub struct Reference<'a> {
    /// Linear radiance and straight coverage, four values a pixel, all finite.
    pub picture: &'a Image,
    /// Variance of the picture itself where it is an average of random samples: of the mean of every
    /// pixel, not of its samples. Four values a pixel in the picture's shape: the variances of
    /// radiance times coverage in three channels, and a fourth that is not read. It is taken off
    /// squared errors, see [`Squared`].
    pub variance: Option<&'a Image>,
}

impl<'a> From<&'a Image> for Reference<'a> {
    /// A reference that is exact.
    fn from(picture: &'a Image) -> Self {
        Self { picture, variance: None }
    }
}

impl<'a> From<&'a TracedPicture> for Reference<'a> {
    /// A traced picture, whose variance is known from two samples a pixel on.
    fn from(traced: &'a TracedPicture) -> Self {
        Self { picture: &traced.color, variance: (traced.samples > 1).then_some(&traced.variance) }
    }
}

/// How a picture compares with a reference.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// What the numbers depend on.
    pub settings: Settings,
    /// Pixels of the test of which a value is not finite. Where there are any, nothing is averaged.
    pub n_not_finite: u64,
    /// The errors; `None` where the test has pixels that are not finite.
    pub errors: Option<Errors>,
}

/// Errors of a picture of which every value is finite; finite themselves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// Root of the mean squared error of radiance times coverage, over pixels and channels, in units
    /// of radiance. The root of [`Squared::mse`] of `estimate`, 0 where that is negative.
    pub rmse: f64,
    /// Mean of (t - r)² / (r² + [`Settings::epsilon`]) over pixels and channels, t and r being
    /// radiance times coverage; 0 where its estimate is negative.
    pub rel_mse: f64,
    /// [`Self::rel_mse`] without outliers; 0 where its estimate is negative.
    pub rel_mse_without_outliers: f64,
    /// How many pixels were left out of it.
    pub n_outliers: u64,
    /// The squared errors as they are, the reference's noise included.
    pub measured: Squared,
    /// The squared errors less what the reference's noise adds to them; may be negative.
    pub estimate: Squared,
    /// The squared errors that a perfect picture would have against this reference: an error far
    /// below cannot be told from none. 0 for a reference that is exact.
    pub reference_noise: Squared,
    /// Largest absolute difference of radiance times coverage in any pixel and channel. The
    /// reference's noise is in it.
    pub max_absolute: f64,
    /// Peak signal-to-noise ratio of the displayed pictures in decibels, over pixels and the
    /// sRGB-encoded channels, the peak being 1; `None` for equal pictures, where it is infinite. The
    /// reference's noise is in it.
    pub psnr: Option<f64>,
    /// Mean structural similarity of the displayed pictures' luma, -1 to 1, 1 for equal ones; `None`
    /// where a side is shorter than the window, 11 pixels.
    ///
    /// Source: Wang, Bovik, Sheikh and Simoncelli 2004, "Image Quality Assessment: From Error
    /// Visibility to Structural Similarity", with its Gaussian window (deviation 1.5), K1 = 0.01, K2
    /// = 0.03, and of the windows that lie inside the picture. Luma is that of Rec. 709. Nothing is
    /// scaled down before.
    pub ssim: Option<f64>,
    /// FLIP of the displayed pictures.
    pub flip: Flip,
    /// Share of the pixels that are covered by half or more in one picture and not in the other, 0
    /// to 1.
    pub coverage_difference: f64,
}

/// Mean squared errors.
///
/// Against a reference with noise the mean of (t - r)² is too large by the reference's variance on
/// average. With that taken off it is right on average whatever the noise, if the variance is right on
/// average and the test was made independently; by chance it is negative where the test is about as
/// good as the reference, and means over several pictures must be of such values, before they are
/// cut off at 0. Relative errors divide by the noisy reference, too: of them is taken off half the
/// variance times the second derivative by r, and what is left is right to first order in variance
/// / (r² + epsilon). Leaving outliers out prefers pixels that noise has made large, so that
/// [`Self::rel_mse_without_outliers`] errs low.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Squared {
    /// Mean of (t - r)².
    pub mse: f64,
    /// Mean of (t - r)² / (r² + epsilon).
    pub rel_mse: f64,
    /// The same without the pixels of the largest (t - r)² / (r² + epsilon), as measured, averaged
    /// over channels.
    pub rel_mse_without_outliers: f64,
}

/// FLIP over a picture: how different pictures look that are shown one after the other at the same
/// place, 0 to 1.
///
/// Source: Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild 2020, "FLIP: A
/// Difference Evaluator for Alternating Images".
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Flip {
    /// Mean of all pixels: the paper's choice of a single number.
    pub mean: f64,
    /// The least value that half of the pixels do not exceed; pixels count alike.
    pub p50: f64,
    /// The same for 95 % of the pixels.
    pub p95: f64,
    /// The same for 99 % of the pixels.
    pub p99: f64,
    /// Largest value of a pixel.
    pub max: f64,
}

/// Errors pixel by pixel, one value a pixel; [`in_color`] makes pictures of them.
#[derive(Clone, Debug)]
pub struct Maps {
    /// Relative squared errors averaged over channels, the reference's noise included, at most
    /// [`f32::MAX`]; NaN where the test is not finite.
    pub relative_squared: Image,
    /// FLIP, 0 to 1; `None` where the test has pixels that are not finite.
    pub flip: Option<Image>,
}

/// The names of all numbers of [`Errors::named`], in its order.
pub const NAMES: [&str; 12] = [
    "rmse",
    "rel_mse",
    "rel_mse_without_outliers",
    "max_absolute",
    "psnr",
    "ssim",
    "flip.mean",
    "flip.p50",
    "flip.p95",
    "flip.p99",
    "flip.max",
    "coverage_difference",
];

impl Errors {
    /// Root of the mean squared error that the reference itself has, in units of radiance: an error
    /// below cannot be told from none. 0 for a reference that is exact.
    #[must_use]
    pub fn noise(&self) -> f64 {
        self.reference_noise.mse.max(0.0).sqrt()
    }

    /// Every number with its name, as `rmse` or `flip.p99`, in a fixed order: for tables and for
    /// limits by name. Infinite for the PSNR of equal pictures; what there is none of is left out.
    #[must_use]
    pub fn named(&self) -> Vec<(&'static str, f64)> {
        let mut all = vec![
            ("rmse", self.rmse),
            ("rel_mse", self.rel_mse),
            ("rel_mse_without_outliers", self.rel_mse_without_outliers),
            ("max_absolute", self.max_absolute),
            ("psnr", self.psnr.unwrap_or(f64::INFINITY)),
        ];
        all.extend(self.ssim.map(|ssim| ("ssim", ssim)));
        all.extend([
            ("flip.mean", self.flip.mean),
            ("flip.p50", self.flip.p50),
            ("flip.p95", self.flip.p95),
            ("flip.p99", self.flip.p99),
            ("flip.max", self.flip.max),
            ("coverage_difference", self.coverage_difference),
        ]);
        all
    }
}

/// Compares a picture with a reference.
///
/// # Errors
/// Where a picture has other than four values a pixel, no pixels, or another size than the other;
/// where the reference is not finite or its variance not finite and 0 or more; where a setting is
/// out of range.
pub fn compare<'a>(
    test: &Image,
    reference: impl Into<Reference<'a>>,
    settings: &Settings,
) -> Result<Comparison, MetricsError> {
    compare_with_maps(test, reference, settings).map(|(comparison, _)| comparison)
}

/// [`compare`], and where the errors are.
///
/// # Errors
/// Those of [`compare`].
pub fn compare_with_maps<'a>(
    test: &Image,
    reference: impl Into<Reference<'a>>,
    settings: &Settings,
) -> Result<(Comparison, Maps), MetricsError> {
    let reference = reference.into();
    error::check(test, &reference, settings)?;
    let pair = linear::Pair::new(test, &reference, settings.epsilon);
    let relative = pair.relative();
    let mut comparison = Comparison {
        size: [test.width, test.height],
        settings: *settings,
        n_not_finite: error::count_not_finite(test),
        errors: None,
    };
    let mut maps = Maps { relative_squared: linear::map(&relative, test), flip: None };
    if comparison.n_not_finite == 0 {
        let shown = |picture| displayed::shown(picture, &settings.development);
        let shown: [Image; 2] = rayon::join(|| shown(test), || shown(reference.picture)).into();
        let flip = flip::map(&shown[0], &shown[1], settings.pixels_per_degree);
        let linear = pair.errors(relative, settings.outlier_share);
        comparison.errors = Some(Errors {
            rmse: linear.estimate.mse.max(0.0).sqrt(),
            rel_mse: linear.estimate.rel_mse.max(0.0),
            rel_mse_without_outliers: linear.estimate.rel_mse_without_outliers.max(0.0),
            n_outliers: linear.n_outliers,
            measured: linear.measured,
            estimate: linear.estimate,
            reference_noise: linear.noise,
            max_absolute: linear.max_absolute,
            psnr: displayed::psnr(&shown[0], &shown[1]),
            ssim: ssim::mean(&shown[0], &shown[1]),
            flip: flip::summary(&flip),
            coverage_difference: coverage_difference(test, reference.picture),
        });
        maps.flip = Some(flip);
    }
    Ok((comparison, maps))
}

/// Share of the pixels that are covered in one picture only.
fn coverage_difference(test: &Image, reference: &Image) -> f64 {
    let pixels = test.data.chunks_exact(4).zip(reference.data.chunks_exact(4));
    let n_pixels = pixels.len();
    let n_differ = pixels.filter(|(t, r)| (t[3] >= COVERED) != (r[3] >= COVERED)).count();
    n_differ as f64 / n_pixels as f64
}
