//! Pictures measured against one of them.

use super::candidate::Drawn;
use surfelshop_image::Image;
use surfelshop_image::display_transform::DisplayTransform;
use surfelshop_image::metrics::{self, Comparison, Errors, Maps, Reference};
use surfelshop_session::setup::RenderSetup;
use surfelshop_session::timing::Run;

/// What a candidate made in a frame: a picture, or a line that says why not.
pub(super) struct CandidateImage {
    pub(super) drawn: Result<Drawn, String>,
    /// Frames after the first.
    pub(super) runs: Vec<Run>,
}

/// What candidates are measured against.
pub struct Truth {
    /// The name.
    pub name: String,
    /// What is seen, and in which light.
    pub picture: Image,
    /// Variance of each pixel's mean, where it is known.
    pub variance: Option<Image>,
    /// The candidate that it is, where it is one.
    pub candidate: Option<usize>,
}

impl Truth {
    /// Measures a picture.
    pub fn compare(
        &self,
        picture: &Image,
        development: DisplayTransform,
    ) -> Result<Comparison, String> {
        metrics::compare(picture, self.reference(), &settings(development))
            .map_err(|error| error.to_string())
    }

    /// Measures a picture, and says where its errors are.
    fn compare_with_maps(
        &self,
        picture: &Image,
        development: DisplayTransform,
    ) -> Result<(Comparison, Maps), String> {
        metrics::compare_with_maps(picture, self.reference(), &settings(development))
            .map_err(|error| error.to_string())
    }

    fn reference(&self) -> Reference<'_> {
        Reference { picture: &self.picture, variance: self.variance.as_ref() }
    }
}

fn settings(development: DisplayTransform) -> metrics::Settings {
    metrics::Settings { development, ..metrics::Settings::default() }
}

/// A picture's numbers, or why there are none.
pub(super) struct Measured {
    pub(super) comparison: Result<Comparison, String>,
    pub(super) maps: Option<Maps>,
}

/// Measures what was drawn in a frame.
pub(super) fn measure(shot: &CandidateImage, truth: &Truth, staging: &RenderSetup) -> Measured {
    let drawn = shot.drawn.as_ref().map_err(String::clone);
    match drawn.and_then(|drawn| truth.compare_with_maps(&drawn.color, staging.how)) {
        Ok((comparison, maps)) => Measured { comparison: Ok(comparison), maps: Some(maps) },
        Err(line) => Measured { comparison: Err(line), maps: None },
    }
}

/// The errors of a comparison, or why there are none.
pub fn errors(comparison: &Result<Comparison, String>) -> Result<&Errors, String> {
    match comparison {
        Ok(Comparison { errors: Some(errors), .. }) => Ok(errors),
        Ok(comparison) => Err(format!("{} pixels are not finite", comparison.n_not_finite)),
        Err(line) => Err(line.clone()),
    }
}
