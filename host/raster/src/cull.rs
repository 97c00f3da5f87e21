//! Culling and level of detail, block by block: from the roots of the tree down, blocks outside of the view
//! frustum or facing away (normal cones) are culled, those whose merged surfels are too coarse on the screen
//! are refined, and the rest is sorted front to back.

use crate::cloud::CloudInView;
use crate::lanes::WIDTH;
use crate::level_of_detail::block::{Block, half_angle};
use crate::view::Eye;
use rayon::prelude::*;
use std::ops::Range;

/// A block in front of the eye.
#[derive(Clone, Copy, Debug)]
pub(crate) struct VisibleBlock {
    pub(crate) cloud: u32,
    pub(crate) block: u32,
    /// No pixel of it is nearer, brought nearer or not.
    pub(crate) nearest: f32,
    /// First and behind-last pixels it may cover: left, top, right, bottom.
    pub(crate) pixels: [i32; 4],
}

/// Blocks to be drawn, from near to far; of equal ones the first.
pub(crate) fn visible_blocks(clouds: &[CloudInView<'_>]) -> Vec<VisibleBlock> {
    let mut all = select(clouds);
    all.par_sort_unstable_by(|a, b| {
        a.nearest.total_cmp(&b.nearest).then((a.cloud, a.block).cmp(&(b.cloud, b.block)))
    });
    all
}

/// The same in no order.
fn select(clouds: &[CloudInView<'_>]) -> Vec<VisibleBlock> {
    let mut all = Vec::new();
    for (cloud, in_view) in clouds.iter().enumerate() {
        let mut blocks: Vec<u32> = in_view.columns.roots.clone().map(|at| at as u32).collect();
        // Level by level, so that all threads take part in large clouds.
        while !blocks.is_empty() {
            let visited: Vec<Visit> =
                blocks.par_iter().with_min_len(256).map(|&block| visit(in_view, block)).collect();
            blocks.clear();
            for (visited, cloud) in visited.into_iter().zip(std::iter::repeat(cloud as u32)) {
                match visited {
                    Visit::Culled => {}
                    Visit::Refine([first, end]) => blocks.extend(first..end),
                    Visit::Draw { block, nearest, pixels } => {
                        all.push(VisibleBlock { cloud, block, nearest, pixels });
                    }
                }
            }
        }
    }
    all
}

/// Places of a cloud that are drawn, in ascending order and none next to each other.
pub(crate) fn runs(in_view: CloudInView<'_>) -> Vec<Range<u32>> {
    let columns = in_view.columns;
    let place = |group: usize| (group * WIDTH) as u32;
    let run = |placed: &VisibleBlock| {
        let block = &columns.blocks[placed.block as usize];
        place(block.first)..place(block.first + block.count)
    };
    let mut all: Vec<Range<u32>> = select(&[in_view]).iter().map(run).collect();
    all.par_sort_unstable_by_key(|run| run.start);
    all.dedup_by(|next, run| {
        let follows = run.end == next.start;
        run.end = if follows { next.end } else { run.end };
        follows
    });
    all
}

enum Visit {
    /// It cannot be seen.
    Culled,
    /// Its parts are to be looked at.
    Refine([u32; 2]),
    Draw {
        block: u32,
        nearest: f32,
        pixels: [i32; 4],
    },
}

fn visit(in_view: &CloudInView<'_>, at: u32) -> Visit {
    let block = &in_view.columns.blocks[at as usize];
    let eye = &in_view.eye;
    let Some((nearest, pixels)) = screen_bounds(block, eye) else { return Visit::Culled };
    let [first, end] = block.parts;
    let has_parts = end > first;
    if has_parts && (block.count == 0 || !is_fine(block, eye)) {
        return Visit::Refine([first, end]);
    }
    Visit::Draw { block: at, nearest, pixels }
}

/// Whether a block's merged surfels are as small as they have to be.
fn is_fine(block: &Block, eye: &Eye) -> bool {
    let distance = if eye.orthographic {
        1.0
    } else {
        let center = eye.one(block.middle);
        -center.z - block.spread / eye.unit
    };
    let px = eye.px_per_unit[0].max(eye.px_per_unit[1]);
    // The scene's factor on radii moves no surfel. Where it makes discs smaller, those that a merged one
    // stands for lie farther apart than its disc reaches, and must lie that much closer on the screen for
    // the low-pass to cover what lies between.
    let coarse = match eye.tangent_scale {
        factor if factor < 1.0 => block.grain.max(block.apart) / (eye.unit * factor),
        _ => (block.grain * eye.radius_scale).max(block.apart / eye.unit),
    };
    distance > eye.near && coarse * px <= eye.detail_px * distance
}

/// A distance that no pixel of a block is nearer than, brought nearer or not, and the pixels it may
/// cover; `None` where it has none.
fn screen_bounds(block: &Block, eye: &Eye) -> Option<(f32, [i32; 4])> {
    let [width, height] = eye.size_px.map(|side| side as f32);
    let everywhere = [0, 0, eye.size_px[0] as i32, eye.size_px[1] as i32];
    let center = eye.one(block.middle);
    let own = block.reach * eye.radius_scale;
    // What rounding does to a position is far less than a thousandth of a surfel, or of the block.
    let reach = (block.spread / eye.unit + own) * 1.001 + 1e-6 * center.length();
    if !center.is_finite() || !reach.is_finite() {
        return Some((0.0, everywhere));
    }
    let distance = -center.z;
    if distance + reach < eye.near || (!eye.two_sided && faces_away(block, eye, center, reach)) {
        return None;
    }
    let depth = if eye.orthographic { 1.0 } else { distance - reach };
    if !eye.orthographic && distance - reach <= eye.near {
        return Some((0.0, everywhere));
    }
    let mut pixels = [0; 4];
    for (axis, (middle, size)) in [(center.x, width), (-center.y, height)].into_iter().enumerate() {
        let px = eye.px_per_unit[axis];
        let (low, high) = (middle - reach, middle + reach);
        let [low, high] = match eye.orthographic {
            true => [low, high],
            false => {
                let far = distance + reach;
                [(low / depth).min(low / far), (high / depth).max(high / far)]
            }
        };
        // The low-pass reaches this far beyond an outline, and a pixel counts at its middle.
        let margin = eye.low_pass + 1.0;
        let edge = |at: f32| (at * px + eye.middle_px[axis]).clamp(-1e6, 1e6 + size);
        pixels[axis] = (edge(low) - margin).floor() as i32;
        pixels[axis + 2] = (edge(high) + margin).ceil() as i32;
    }
    let [x0, y0, x1, y1] = pixels;
    if x1 <= 0 || y1 <= 0 || x0 >= everywhere[2] || y0 >= everywhere[3] {
        return None;
    }
    // A disc's widened outline leads out of its own depths by at most two pixels' width for each
    // pixel across, along two axes (`MAX_SLOPE` of the shaders).
    let pixel = depth / eye.px_per_unit[1];
    let widened = own + eye.low_pass * pixel;
    let out = 2.0 * 2f32.sqrt() * widened / depth;
    let nearest = match eye.orthographic {
        true => distance - reach - out,
        false => depth / (1.0 + out),
    };
    // What is brought nearer is so by the tolerance times the widened disc's longer half axis.
    let slack = eye.tolerance * 4.0 * widened;
    let brought = match eye.orthographic {
        true => nearest - slack,
        false => (nearest - slack).max(0.5 * nearest),
    };
    Some((brought, pixels))
}

/// Whether the eye is behind every surfel of a block.
fn faces_away(block: &Block, eye: &Eye, center: glam::Vec3, reach: f32) -> bool {
    let axis = eye.turned(block.axis);
    let spread = half_angle(block);
    let (towards, seen_angle) = if eye.orthographic {
        (axis.z, 0.0)
    } else {
        let distance = center.length();
        if distance <= reach {
            return false;
        }
        (-axis.dot(center) / distance, (reach / distance).asin())
    };
    // What rounding does to these angles is far less than a thousandth.
    let least = towards.clamp(-1.0, 1.0).acos() - spread - seen_angle;
    block.cosine > -1.0 && least > std::f32::consts::FRAC_PI_2 + 1e-3
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view::View;
    use glam::Mat4;

    fn eye(orthographic: bool) -> Eye {
        let view = View {
            size_px: [200, 200],
            half_extent: [0.5, 0.5],
            shift_px: [0.0; 2],
            near: 0.01,
            orthographic,
            world_from_view: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            two_sided: false,
            back_albedo: None,
            low_pass: 1.0,
            tolerance: 1.0,
            tangent_scale: 1.0,
            unit: 1.0,
            detail_px: 1.0,
        };
        Eye::new(&view, Mat4::IDENTITY, f32::INFINITY)
    }

    fn block(middle: [f32; 3], axis: [f32; 3], cosine: f32) -> Block {
        Block {
            first: 0,
            count: 1,
            parts: [0, 0],
            middle,
            spread: 0.1,
            reach: 0.01,
            grain: 0.02,
            apart: 0.01,
            axis,
            cosine,
        }
    }

    #[test]
    fn blocks_outside_of_the_picture_or_turned_away_are_left_out() {
        for orthographic in [false, true] {
            let eye = eye(orthographic);
            let at =
                |middle, axis, cosine| screen_bounds(&block(middle, axis, cosine), &eye).is_some();
            let front = [0.0, 0.0, 1.0];
            assert!(at([0.0, 0.0, -2.0], front, 0.9));
            assert!(!at([0.0, 0.0, 2.0], front, 0.9), "behind the eye");
            assert!(!at([5.0, 0.0, -2.0], front, 0.9), "beside the picture");
            assert!(!at([0.0, 0.0, -2.0], [0.0, 0.0, -1.0], 0.9), "turned away");
            assert!(at([0.0, 0.0, -2.0], [0.0, 0.0, -1.0], -0.5), "a wide cone");
            assert!(at([0.0, 0.0, -2.0], [0.0, 0.0, -1.0], -1.0), "no cone");
        }
    }

    #[test]
    fn merged_surfels_are_drawn_from_afar() {
        let eye = eye(false);
        let fine =
            |distance: f32| is_fine(&block([0.0, 0.0, -distance], [0.0, 0.0, 1.0], 0.9), &eye);
        // A radius of 0.02 is a pixel, a hundredth of twice half the extent, at a distance of 4.
        assert!(!fine(4.0) && fine(4.2));
    }
}
