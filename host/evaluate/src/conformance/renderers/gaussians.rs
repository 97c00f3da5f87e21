//! What pictures of Gaussians are held to: they fade out, and have no edge and no one depth.

use super::silhouettes::COVERAGE;
use crate::conformance::cast::{beyond_reach, cast};
use crate::conformance::hard;
use crate::conformance::verdict::{Failure, Judged, Said};
use surfelshop_api::View;
use surfelshop_api::columns::RADIUS;
use surfelshop_cloud::{Buffer, Cloud, Column};
use surfelshop_image::Image;

/// Radii of a disc, which are two standard deviations, at which a Gaussian is no longer seen: √(2 ln 255) / 2, where
/// one of 255 steps is left of a full opacity.
const REACH: f32 = 1.665;

/// Pixels beyond which no low-pass of usual width takes a Gaussian: 3.33 deviations of 0.71 pixels.
const FILTER_PX: f64 = 2.5;

/// Pixels to all sides among whose depths that of a pixel lies.
const AROUND: usize = 3;

/// Discs as large as their Gaussians are seen.
fn wide(cloud: &Cloud) -> Cloud {
    let radii = cloud.radii().iter().map(|radius| radius * REACH).collect();
    hard::with_column(cloud, Column::new(RADIUS, 1, Buffer::F32(radii)))
}

/// The centre of a pixel of so wide a picture.
fn center(at: usize, width: usize) -> [f64; 2] {
    [(at % width) as f64 + 0.5, (at / width) as f64 + 0.5]
}

fn is_covered(pixel: &[f32]) -> bool {
    pixel.get(3).is_some_and(|coverage| *coverage > 0.0)
}

/// How many pixels no Gaussian reaches, and how many of those are not 0.
pub(super) fn nothing(cloud: &Cloud, view: &View, color: &Image) -> (usize, usize) {
    let width = color.width as usize;
    let all: Vec<[f64; 2]> =
        (0..width * color.height as usize).map(|at| center(at, width)).collect();
    let empty = beyond_reach(&wide(cloud), view, &all, FILTER_PX);
    let is_filled =
        |[x, y]: &&[f64; 2]| color.pixel(*x as u32, *y as u32).iter().any(|value| *value != 0.0);
    (empty.len(), empty.iter().filter(is_filled).count())
}

/// Gaussians cover what discs of two deviations would, and nothing that they do not reach.
pub(super) fn cover(cloud: &Cloud, view: &View, color: &Image) -> Judged {
    let width = color.width as usize;
    let reference = cast(cloud, view);
    let (mut n_met, mut n_missing, mut around) = (0, 0, Vec::new());
    for (at, (pixel, depth)) in color.data.chunks_exact(4).zip(&reference.depth).enumerate() {
        if depth.is_finite() {
            n_met += 1;
            n_missing += usize::from(!is_covered(pixel));
        } else if is_covered(pixel) {
            around.push(center(at, width));
        }
    }
    let n_beyond = beyond_reach(&wide(cloud), view, &around, FILTER_PX).len();
    let line = format!(
        "rays meet discs of two deviations at {n_met} pixels, {n_missing} of them are not covered; \
         {n_beyond} are covered that no Gaussian reaches"
    );
    let wrong = n_missing + n_beyond;
    match wrong as f64 <= (1.0 - COVERAGE) * f64::from(n_met as u32) && n_met > 100 {
        true => Ok(Said::Measured(line)),
        false => Err(Failure::showing(line, [("color", color)]).counting(wrong, n_met)),
    }
}

/// The depth of a pixel is one of the surface around it, within a Gaussian's reach: how many pixels are inside of the
/// surface, and at how many of them it is not.
pub(super) fn depths(cloud: &Cloud, view: &View, depth: &Image) -> (usize, usize) {
    let [width, height] = [depth.width as usize, depth.height as usize];
    let reference = cast(cloud, view);
    let slack = f64::from(REACH * cloud.radii().iter().copied().fold(0.0, f32::max));
    let (mut n, mut wrong) = (0, 0);
    for y in AROUND..height.saturating_sub(AROUND) {
        for x in AROUND..width.saturating_sub(AROUND) {
            let rows = y - AROUND..=y + AROUND;
            let window = rows.flat_map(|y| {
                let row = y * width;
                &reference.depth[row + x - AROUND..=row + x + AROUND]
            });
            let (least, most) = window.fold((f64::INFINITY, 0.0f64), |(least, most), &depth| {
                (least.min(depth), most.max(depth))
            });
            if most.is_finite() {
                n += 1;
                let found = f64::from(depth.pixel(x as u32, y as u32)[0]);
                wrong += usize::from(!(least - slack..=most + slack).contains(&found));
            }
        }
    }
    (n, wrong)
}

#[cfg(test)]
mod tests {
    use super::super::bench::front;
    use super::*;
    use crate::conformance::clouds;

    const SIZE: u32 = 96;

    /// A picture of the discs that are as many times as large, and their depths.
    fn drawn(cloud: &Cloud, factor: f32) -> [Image; 2] {
        let radii = cloud.radii().iter().map(|radius| radius * factor).collect();
        let cloud = hard::with_column(cloud, Column::new(RADIUS, 1, Buffer::F32(radii)));
        let cast = cast(&cloud, &front(SIZE));
        let is_met: Vec<f32> = cast.depth.iter().map(|d| f32::from(d.is_finite())).collect();
        let image = |data| Image { width: SIZE, height: SIZE, components: 4, data };
        let depth = cast.depth.iter().map(|d| if d.is_finite() { *d as f32 } else { 0.0 });
        [
            image(is_met.iter().flat_map(|met| [*met; 4]).collect()),
            image(depth.flat_map(|depth| [depth; 4]).collect()),
        ]
    }

    #[test]
    fn what_fades_out_within_reach_is_right_and_nothing_else() {
        let (cloud, view) = (clouds::sphere(2000, 1.0).cloud(), front(SIZE));
        for (factor, is_right) in [(0.5, false), (1.0, true), (1.6, true), (4.0, false)] {
            let [color, _] = drawn(&cloud, factor);
            assert_eq!(cover(&cloud, &view, &color).is_ok(), is_right, "{factor}");
            let (n_empty, n_filled) = nothing(&cloud, &view, &color);
            assert!(n_empty > 1000 && (n_filled > 0) == (factor > 2.0), "{factor}: {n_filled}");
        }
    }

    #[test]
    fn depths_are_those_of_the_surface() {
        let (cloud, view) = (clouds::sphere(2000, 1.0).cloud(), front(SIZE));
        let [_, mut depth] = drawn(&cloud, 1.0);
        let (n, wrong) = depths(&cloud, &view, &depth);
        assert!(n > 2000 && wrong == 0, "{wrong} of {n}");
        // The far side, and nothing at all.
        for change in [|d: f32| d + 1.0, |_| 0.0] {
            depth.data.iter_mut().for_each(|depth| *depth = change(*depth));
            let (n, wrong) = depths(&cloud, &view, &depth);
            assert!(wrong > n / 2, "{wrong} of {n}");
        }
    }
}
