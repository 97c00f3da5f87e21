//! The metrics in plain words.

use crate::theme::Icon;

/// What a metric is called in the panel, its unit, and what it means.
pub(super) struct Words {
    pub(super) name: &'static str,
    pub(super) unit: &'static str,
    pub(super) about: &'static str,
    /// Whether more of it is closer to the reference.
    pub(super) more_is_better: bool,
}

impl Words {
    /// All that the pointer is told over it.
    pub(super) fn help(&self, id: &str) -> String {
        let better = if self.more_is_better { "More is better." } else { "Less is better." };
        format!("{}\n{better}\nIn reports it is called {id}.", self.about)
    }

    /// The name with an arrow to the better side.
    pub(super) fn title(&self) -> String {
        let arrow = if self.more_is_better { Icon::ArrowUp } else { Icon::ArrowDown };
        let arrow = arrow.unicode();
        match self.unit {
            "" => format!("{} {arrow}", self.name),
            unit => format!("{}, {unit} {arrow}", self.name),
        }
    }
}

/// The words of a metric, by its name in reports.
pub(super) fn words(id: &str) -> Option<Words> {
    let of = |name, unit, about, more_is_better| Words { name, unit, about, more_is_better };
    Some(match id {
        "rmse" => of(
            "error (RMSE)",
            "",
            "Root of the mean squared difference of radiance, before tone mapping and without the background. The number \
             below two pictures in a view is another one: it is of the colours on the screen, background included.",
            false,
        ),
        "rel_mse" => of(
            "relative error",
            "",
            "Mean squared difference over the squared radiance of the reference (plus 0.01): dark parts count as much as \
             bright ones.",
            false,
        ),
        "rel_mse_without_outliers" => of(
            "without outliers",
            "",
            "The relative error without the worst tenth of a percent of the pixels.",
            false,
        ),
        "psnr" => of(
            "PSNR",
            "dB",
            "Peak signal-to-noise ratio of what a screen shows. Above 40 dB a difference is hardly seen.",
            true,
        ),
        "ssim" => of(
            "structure (SSIM)",
            "",
            "Structural similarity of what a screen shows, up to 1 for equal pictures.",
            true,
        ),
        "flip.mean" => of(
            "seen (FLIP)",
            "",
            "What an observer sees when the pictures are flipped, at 67 pixels a degree: 0 nothing, 1 the most; the mean.",
            false,
        ),
        "flip.p99" => {
            of("seen at most (FLIP)", "", "The same: 99 % of the pixels do not exceed it.", false)
        }
        "max_absolute" => of(
            "largest difference",
            "",
            "The largest difference of radiance of a single pixel.",
            false,
        ),
        "coverage_difference" => of(
            "outline",
            "share",
            "The share of the pixels that one picture covers and the other does not.",
            false,
        ),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_evaluate::compare::METRICS;

    #[test]
    fn every_metric_has_words_and_the_same_better_side() {
        for (id, _, better) in METRICS {
            let words = words(id).unwrap();
            assert_eq!(words.more_is_better, better == "more", "{id}");
            assert!(words.about.ends_with('.') && !words.name.contains('_'), "{id}");
        }
        assert!(words("luck").is_none());
    }
}
