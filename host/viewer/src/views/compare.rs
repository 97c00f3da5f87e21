//! Two pictures of the same view are compared by their display colours.

use eframe::egui::Color32;
use surfelshop_image::metrics::{LevelErrors, compare_levels, psnr};

/// The difference of two pictures.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Difference {
    pub(crate) size: [u32; 2],
    /// Largest absolute difference of the three channels, in [0, 1], pixel by pixel.
    pub(crate) largest: Vec<f32>,
    /// Root of the mean squared difference of all channels, in [0, 1].
    pub(crate) rmse: f64,
}

impl Difference {
    /// Compares two pictures of four 8-bit values a pixel; `None` where their sizes differ.
    pub(crate) fn new(size: [u32; 2], a: &[u8], b: &[u8]) -> Option<Self> {
        let LevelErrors { largest, rmse } = compare_levels(a, b)?;
        Some(Self { size, largest, rmse })
    }

    /// Peak signal-to-noise ratio in decibels; infinite for equal pictures.
    pub(crate) fn psnr(&self) -> f64 {
        psnr(self.rmse)
    }

    /// The heat map; `full` is the difference that is shown brightest.
    pub(crate) fn heat(&self, full: f32) -> Vec<Color32> {
        self.largest.iter().map(|value| heat(value / full.max(1.0 / 255.0))).collect()
    }

    /// RMSE and PSNR in words: of 8-bit levels as shown, background included, on a scale of 0 to 1.
    pub(crate) fn describe(&self) -> String {
        let psnr = self.psnr();
        if psnr.is_finite() {
            format!("RMSE {:.5}, PSNR {psnr:.2} dB", self.rmse)
        } else {
            "equal".to_owned()
        }
    }
}

/// Black, purple, orange, yellow, white, with evenly growing brightness.
pub(crate) fn heat(value: f32) -> Color32 {
    const STOPS: [[f32; 3]; 5] = [
        [0.0, 0.0, 0.0],
        [90.0, 20.0, 110.0],
        [205.0, 65.0, 70.0],
        [250.0, 165.0, 30.0],
        [255.0, 255.0, 225.0],
    ];
    let at = value.clamp(0.0, 1.0) * 4.0;
    let below = (at.floor() as usize).min(3);
    let share = at - below as f32;
    let [r, g, b] =
        [0, 1, 2].map(|c| STOPS[below][c] + (STOPS[below + 1][c] - STOPS[below][c]) * share);
    Color32::from_rgb(r as u8, g as u8, b as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_those_computed_by_hand() {
        let a = [0, 0, 0, 255, 255, 255, 255, 255];
        let b = [51, 0, 0, 255, 255, 204, 153, 255];
        let difference = Difference::new([2, 1], &a, &b).unwrap();
        assert_eq!(difference.largest, [0.2, 0.4]);
        // Squares of 51, 51 and 102 over six channels.
        let expected = ((51.0f64.powi(2) * 6.0) / 6.0).sqrt() / 255.0;
        assert!((difference.rmse - expected).abs() < 1e-12);
        assert!((difference.psnr() - 13.979).abs() < 1e-3);
    }

    #[test]
    fn equal_pictures_are_called_equal_and_others_not_compared() {
        let a = [10; 16];
        assert_eq!(Difference::new([2, 2], &a, &a).unwrap().describe(), "equal");
        assert_eq!(Difference::new([2, 2], &a, &a[..8]), None);
        assert_eq!(Difference::new([0, 0], &[], &[]), None);
    }

    #[test]
    fn heat_grows_brighter() {
        let brightness =
            |c: Color32| u32::from(c.r()) * 3 + u32::from(c.g()) * 6 + u32::from(c.b());
        let steps: Vec<u32> = (0..=20).map(|i| brightness(heat(i as f32 / 20.0))).collect();
        assert!(steps.is_sorted(), "{steps:?}");
    }
}
