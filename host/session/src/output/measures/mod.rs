//! The measures of a scene, drawn over a picture as a screen shows it.

mod projection;

pub use projection::{ScreenPoint, project, project_line};

use crate::input::clouds::Clouds;
use glam::{DVec2, DVec3};
use surfelshop_api::View;
use surfelshop_cloud::scene::Axis;
use surfelshop_cloud::scene::{Figure, Measure, Units};
use surfelshop_cloud::{Cloud, Loaded};
use surfelshop_image::Image;
use surfelshop_image::lines::line;
use surfelshop_image::text::{Line, fill};
use surfelshop_pyramid::PyramidError;

/// Pixels of a picture's shorter side for each of a line of text, and the smallest size of text that can be read, pixels.
const LINES: f32 = 42.0;
const SMALLEST: f32 = 12.0;

/// The colour of lines, sRGB-encoded: a yellow that is told from most surfaces.
pub const INK: [f32; 3] = [1.0, 0.84, 0.22];

/// What is behind lines, and behind labels, and how much of the picture it hides.
const GROUND: [f32; 3] = [0.05, 0.055, 0.065];
const HALO: f32 = 0.6;
const PANEL: f32 = 0.78;
const TEXT: [f32; 3] = [0.97; 3];

/// A measure with its label.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnMeasure {
    /// Its lines.
    pub figure: Figure,
    /// Its label; nothing is drawn for an empty one.
    pub label: String,
}

/// Surfels of a pyramid that one measure is of, at most; of more, merged ones are.
const MOST_OF_PYRAMID: u64 = 8_000_000;

/// The clouds that a measure of surfels is of; of pyramids the nodes that it reaches. Nothing of other measures.
///
/// # Errors
/// Where a node cannot be read.
pub fn measured(clouds: &Clouds, measure: &Measure, up: DVec3) -> Result<Vec<Cloud>, PyramidError> {
    let mut all = Vec::new();
    if !measure.kind.is_of_surfels() {
        return Ok(all);
    }
    for Loaded { cloud, .. } in &clouds.loaded {
        match clouds.pyramid_of(cloud) {
            None => all.push(cloud.clone()),
            Some(pyramid) => {
                let reaches = |middle, radius| measure.may_be_of(up, middle, radius);
                let parts = pyramid.within(reaches, MOST_OF_PYRAMID)?;
                all.extend(parts.iter().map(|part| Cloud::clone(part)));
            }
        }
    }
    Ok(all)
}

/// What is to be drawn of measures: those that are not hidden, with what they measure of clouds.
pub fn drawn<'a>(
    measures: impl Iterator<Item = &'a Measure>,
    up: Axis,
    units: Units,
    clouds: &Clouds,
) -> Vec<DrawnMeasure> {
    let up = up.direction();
    let shown = measures.filter(|measure| !measure.hidden);
    let one = |measure: &Measure| {
        // One that cannot be measured has its lines all the same.
        let of_surfels = measured(clouds, measure, up).ok().and_then(|clouds| {
            measure.surfel_quantities(up, &clouds.iter().collect::<Vec<_>>()).ok()
        });
        let of_surfels = of_surfels.unwrap_or_default();
        let label = units.label(measure, up, &of_surfels);
        DrawnMeasure { figure: Figure::of(measure, up), label }
    };
    shown.map(one).collect()
}

/// Draws measures over the picture of a view.
pub fn draw(image: &mut Image, view: &View, measures: &[DrawnMeasure]) {
    let size = [image.width, image.height].map(f64::from);
    let shorter = image.width.min(image.height) as f32;
    let text = (shorter / LINES).max(SMALLEST).round();
    let thick = f64::from(text) / 7.0;
    let pixel = |at: DVec2| [0.5 * size[0] + at.x * size[1], 0.5 * size[1] + at.y * size[1]];
    let camera = &view.camera;
    // Halos first, so that no line is below another one's.
    for (more, color, strength) in [(0.7 * thick + 1.0, GROUND, HALO), (0.0, INK, 1.0)] {
        for DrawnMeasure { figure, .. } in measures {
            for segment in &figure.segments {
                let share = if segment.is_faint { 0.6 } else { 1.0 };
                if let Some(ends) = project_line(camera, segment.ends) {
                    line(
                        image,
                        ends.map(pixel),
                        share * thick + more,
                        color,
                        share as f32 * strength,
                    );
                }
            }
            for place in figure.places.iter().filter_map(|place| project(camera, *place)) {
                let at = pixel(place.position);
                line(image, [at, at], 3.2 * thick + more, color, strength);
            }
        }
    }
    for DrawnMeasure { figure, label } in measures.iter().filter(|one| !one.label.is_empty()) {
        let found = figure.anchor.and_then(|anchor| project(camera, anchor));
        if let Some(found) = found {
            self::label(image, pixel(found.position).map(|n| n as f32), label, text);
        }
    }
}

/// Draws a label in the middle above a place.
fn label(image: &mut Image, [x, y]: [f32; 2], text: &str, size: f32) {
    let line = Line::new(text, size);
    let (margin, height) = ((0.4 * size).round(), (1.5 * size).round());
    let left = (x - 0.5 * line.width - margin).round();
    let bottom = (y - 0.7 * size).round();
    let corners = [[left, bottom - height], [left + line.width + 2.0 * margin, bottom]];
    fill(image, corners, GROUND, PANEL);
    line.draw(image, [left + margin, bottom - 0.5 * height + 0.34 * size], TEXT);
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use surfelshop_api::{Camera, Projection};
    use surfelshop_cloud::scene::MeasureKind;

    fn view() -> View {
        let projection = Projection::Orthographic { height: 10.0 };
        let (eye, target) = (DVec3::new(1e6, 0.0, 20.0), DVec3::new(1e6, 0.0, 0.0));
        let camera = Camera { eye, target, up: DVec3::Y, projection };
        View { camera, size_px: [300, 200], near: 0.1, far: 100.0 }
    }

    fn picture(width: u32, height: u32) -> Image {
        let data = [0.5, 0.5, 0.5, 1.0].repeat((width * height) as usize);
        Image { width, height, components: 4, data }
    }

    /// Invariant: a measure is drawn where its places are seen, with its number, and nothing else is changed
    #[test]
    fn a_line_and_its_label_are_drawn_where_the_places_are_seen() {
        let at = |x: f64, y: f64| DVec3::new(1e6 + x, y, 0.0);
        let mut measure = Measure::new(MeasureKind::Distance, vec![at(-4.0, 2.0), at(4.0, 2.0)]);
        let clouds = Clouds::of(Vec::new());
        let units = Units { metres: Some(1.0) };
        let all = drawn([&measure].into_iter(), Axis::PlusY, units, &clouds);
        assert_eq!(all[0].label, "8 m");
        let mut image = picture(300, 200);
        draw(&mut image, &view(), &all);
        // 20 pixels are a unit.
        for x in [71, 150, 229] {
            let found = image.pixel(x, 60);
            assert!(
                (found[0] - INK[0]).abs() < 0.2 && (found[2] - INK[2]).abs() < 0.1,
                "{found:?}"
            );
        }
        let far = |(i, _): &(usize, &[f32])| i / 300 > 75 || i % 300 < 60 || i % 300 > 240;
        let others = image.data.chunks(4).enumerate().filter(far);
        assert!(others.into_iter().all(|(_, pixel)| pixel == [0.5, 0.5, 0.5, 1.0]));
        let above = image.data.chunks(4).take(300 * 52).filter(|pixel| pixel[0] > 0.7).count();
        assert!(above > 10, "the text of the label: {above} pixels");
        // Small and empty pictures are no failure; what is hidden is not drawn.
        for size in [[0, 0], [1, 1], [8, 300]] {
            draw(&mut picture(size[0], size[1]), &view(), &all);
        }
        measure.hidden = true;
        assert!(drawn([&measure].into_iter(), Axis::PlusY, units, &clouds).is_empty());
    }
}
