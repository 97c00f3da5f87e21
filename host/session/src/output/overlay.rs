//! What is drawn over a picture as a screen shows it: measures, and the legend of colours.

use super::legend;
use super::measures::{self, DrawnMeasure};
use super::terminal;
use surfelshop_api::View;
use surfelshop_cloud::display::Legend;
use surfelshop_image::Image;

/// What is drawn over the picture of a view.
#[derive(Clone, Debug, PartialEq)]
pub struct Overlay {
    /// The view of the picture.
    pub view: View,
    /// The measures.
    pub measures: Vec<DrawnMeasure>,
    /// What is drawn into its corner.
    pub legend: Option<Legend>,
}

impl Overlay {
    /// Whether nothing is drawn.
    pub fn is_empty(&self) -> bool {
        self.measures.is_empty() && self.legend.is_none()
    }

    /// Draws it.
    pub fn draw(&self, image: &mut Image) {
        measures::draw(image, &self.view, &self.measures);
        if let Some(legend) = &self.legend
            && !legend::draw(image, legend)
        {
            terminal::warn_once(
                "the legend would hide more than half of the picture and is left out; make the picture larger",
            );
        }
    }
}
