//! The grid on the ground below what is open.

use super::{nice, on_screen};
use crate::render_thread::RenderedView;
use eframe::egui::{Color32, Painter, Pos2, Rect, Stroke};
use glam::{DVec2, DVec3};
use surfelshop_api::Camera;
use surfelshop_image::display_transform::Background;
use surfelshop_session::options::UpAxis;

/// About how many cells lie along the longer side.
const CELLS: f64 = 12.0;

/// Most lines in each direction: fewer than the cells need in any scene.
const MOST_LINES: i64 = 40;

/// Parts of a line that are tested for what hides them.
const PARTS: u32 = 64;

/// How much nearer, as a share of the distance, something must be to hide the grid: the picture's depths are single
/// precision, and the ground touches what stands on it.
const NEARER: f64 = 2e-3;

/// What the grid lies below.
pub(super) struct Ground {
    pub(super) bounds: [DVec3; 2],
    pub(super) up: UpAxis,
    pub(super) background: Background,
}

/// A line of the grid in the scene, and whether an axis runs along it.
struct Line {
    ends: [DVec3; 2],
    along: Option<usize>,
}

/// The lines: between them lies a length of 1, 2 or 5 times a power of ten.
fn lines(ground: &Ground) -> Vec<Line> {
    let axis = ground.up.axis();
    let up = axis.index();
    let flat = [[1, 2], [0, 2], [0, 1]][up];
    let [min, max] = ground.bounds;
    let lowest = if axis.sign() > 0.0 { min[up] } else { max[up] };
    let size = flat.map(|axis| max[axis] - min[axis]).into_iter().fold(0.0, f64::max);
    let step = nice(size / CELLS * 1.5);
    if !(step.is_finite() && step > 0.0 && min.is_finite() && max.is_finite()) {
        return Vec::new();
    }
    // A cell more on each side.
    let range = flat.map(|axis| {
        let first = (min[axis] / step).floor() as i64 - 1;
        let last = (max[axis] / step).ceil() as i64 + 1;
        [first, last.min(first + MOST_LINES)]
    });
    let mut lines = Vec::new();
    for (this, other) in [(0, 1), (1, 0)] {
        for i in range[this][0]..=range[this][1] {
            let end = |j: i64| {
                let mut place = DVec3::ZERO;
                place[up] = lowest;
                place[flat[this]] = i as f64 * step;
                place[flat[other]] = j as f64 * step;
                place
            };
            let along = (i == 0).then_some(flat[other]);
            lines.push(Line { ends: range[other].map(end), along });
        }
    }
    lines
}

/// Shows the grid over a picture, where nothing hides it.
pub(super) fn show(
    painter: &Painter,
    rect: Rect,
    camera: &Camera,
    rendered: &RenderedView,
    ground: &Ground,
) {
    let behind = ground.background.mean();
    let is_light =
        behind.is_some_and(|[red, green, blue]| 0.3 * red + 0.6 * green + 0.1 * blue > 0.5);
    let plain = match is_light {
        true => Color32::from_black_alpha(44),
        false => Color32::from_white_alpha(30),
    };
    // As the axes in the corner.
    let of_axis = |axis: usize| match axis {
        0 => Color32::from_rgba_unmultiplied(230, 80, 76, 120),
        1 => Color32::from_rgba_unmultiplied(116, 186, 64, 120),
        _ => Color32::from_rgba_unmultiplied(84, 144, 240, 120),
    };
    for line in lines(ground) {
        let stroke = Stroke::new(1.0, line.along.map_or(plain, of_axis));
        for run in visible_runs(rect, camera, rendered, &line) {
            painter.line_segment(run, stroke);
        }
    }
}

/// The parts of a line that are seen, joined.
fn visible_runs(
    rect: Rect,
    camera: &Camera,
    rendered: &RenderedView,
    line: &Line,
) -> Vec<[Pos2; 2]> {
    let mut runs: Vec<[Pos2; 2]> = Vec::new();
    let mut joins = false;
    let place = |i: u32| line.ends[0].lerp(line.ends[1], f64::from(i) / f64::from(PARTS));
    let mut before = on_screen(camera, rect, place(0));
    for i in 1..=PARTS {
        let now = on_screen(camera, rect, place(i));
        let seen = match (before, now) {
            (Some((from, near)), Some((to, far))) => {
                let middle = from + 0.5 * (to - from);
                let is_seen = !is_hidden(rect, rendered, middle, 0.5 * (near + far));
                is_seen.then_some([from, to])
            }
            _ => None,
        };
        match (seen, runs.last_mut().filter(|_| joins)) {
            (Some([_, to]), Some(run)) => run[1] = to,
            (Some(part), None) => runs.push(part),
            (None, _) => {}
        }
        joins = seen.is_some();
        before = now;
    }
    runs
}

/// Whether something lies before a point of the screen: by the picture's depths, and while it has none by whether it
/// shows anything there.
fn is_hidden(rect: Rect, rendered: &RenderedView, at: Pos2, depth: f64) -> bool {
    let share = (at - rect.min) / rect.size();
    let pixel = |width: u32, height: u32| {
        let place = DVec2::new(f64::from(share.x), f64::from(share.y))
            * DVec2::new(f64::from(width), f64::from(height));
        let is_inside =
            place.min_element() >= 0.0 && place.x < f64::from(width) && place.y < f64::from(height);
        is_inside.then_some((place.x as u32, place.y as u32))
    };
    if let Some(image) = &rendered.depth {
        return pixel(image.width, image.height).is_some_and(|(x, y)| {
            let nearest = f64::from(image.pixel(x, y)[0]);
            nearest > 0.0 && nearest < depth * (1.0 - NEARER)
        });
    }
    let image = &rendered.color;
    pixel(image.width, image.height)
        .is_some_and(|(x, y)| image.pixel(x, y).get(3).is_some_and(|coverage| *coverage > 0.5))
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_cloud::scene::Axis;

    fn ground(bounds: [DVec3; 2], up: UpAxis) -> Ground {
        Ground { bounds, up, background: Background::Transparent }
    }

    #[test]
    fn the_grid_lies_below_everything_and_reaches_past_it() {
        let bounds = [DVec3::new(-1.3, 0.2, 480_000.1), DVec3::new(0.9, 7.0, 480_003.0)];
        for up in Axis::ALL {
            let (axis, lowest) = (up.index(), bounds[usize::from(up.sign() < 0.0)]);
            let lines = lines(&ground(bounds, up.into()));
            assert!(lines.len() > 10 && lines.len() < 60, "{}", lines.len());
            let ends = || lines.iter().flat_map(|line| line.ends);
            assert!(ends().all(|end| end[axis].to_bits() == lowest[axis].to_bits()));
            for flat in (0..3).filter(|flat| *flat != axis) {
                assert!(ends().any(|end| end[flat] < bounds[0][flat]));
                assert!(ends().any(|end| end[flat] > bounds[1][flat]));
            }
        }
    }

    #[test]
    fn without_an_extent_there_is_no_grid_and_a_thin_one_is_bounded() {
        for bounds in [[DVec3::ZERO; 2], [DVec3::NAN; 2], [DVec3::INFINITY, DVec3::NEG_INFINITY]] {
            assert!(lines(&ground(bounds, UpAxis::Y)).is_empty());
        }
        let far = [DVec3::splat(1e7), DVec3::splat(1e7) + DVec3::new(1e-3, 1.0, 1e6)];
        assert!(lines(&ground(far, UpAxis::Y)).len() <= 2 * (MOST_LINES as usize + 1));
    }
}
