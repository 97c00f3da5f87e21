//! How often a cloud winds around a place: 1 inside a closed one, 0 outside.
//!
//! Source: Barill et al., "Fast winding numbers for soups and clouds", SIGGRAPH 2018: surfels far
//! away count together, as one.

use std::f64::consts::PI;
use surfelshop_api::glam::DVec3;
use surfelshop_api::prelude::*;

/// Surfels that are summed up one by one.
const LEAF: usize = 16;

/// Sizes of a part from which on it counts as one surfel.
const FAR: f64 = 2.5;

/// A part of the cloud.
struct Part {
    /// The mean place, weighted by area.
    centre: DVec3,
    /// The farthest of its surfels from there.
    reach: f64,
    /// The sum of areas times normals.
    area: DVec3,
    start: u32,
    end: u32,
    /// Where the second half is in the list of parts; the first follows. 0 of a leaf.
    second: u32,
}

/// The cloud, part by part.
pub(crate) struct Winding {
    parts: Vec<Part>,
    /// Places, and areas times normals, in the order of the parts.
    surfels: Vec<(DVec3, DVec3)>,
    /// The length of the sum of all areas times normals, as a share of the area: 0 of a closed cloud.
    pub(crate) openness: f64,
}

impl Winding {
    /// The parts of a cloud: O(n log n).
    ///
    /// # Errors
    /// Where the job is to stop.
    pub(crate) fn build(
        places: &[DVec3],
        normals: &[DVec3],
        areas: &[f32],
        job: &Job<'_>,
    ) -> Result<Self> {
        let each = places.iter().zip(normals).zip(areas);
        let mut surfels: Vec<(DVec3, DVec3)> =
            each.map(|((&place, &normal), &area)| (place, f64::from(area) * normal)).collect();
        let all: f64 = surfels.iter().map(|(_, area)| area.length()).sum();
        let sum: DVec3 = surfels.iter().map(|(_, area)| *area).sum();
        let openness = if all > 0.0 { sum.length() / all } else { 1.0 };
        let mut parts: Vec<Part> = Vec::new();
        // Ranges to come, and of which part each is the second half.
        let mut open = vec![(0, surfels.len(), None)];
        while let Some((start, end, second_of)) = open.pop() {
            if end - start > 1 << 12 {
                job.check()?;
            }
            if let Some(parent) = second_of {
                let place: usize = parent;
                parts[place].second = parts.len() as u32;
            }
            let range = &mut surfels[start..end];
            parts.push(part(range, start));
            if range.len() > LEAF {
                let axis = widest(range);
                let middle = range.len() / 2;
                range.select_nth_unstable_by(middle, |(a, _), (b, _)| a[axis].total_cmp(&b[axis]));
                let own = parts.len() - 1;
                open.push((start + middle, end, Some(own)));
                open.push((start, start + middle, None));
            }
        }
        Ok(Self { parts, surfels, openness })
    }

    /// How often the cloud winds around a place.
    pub(crate) fn number(&self, at: DVec3) -> f64 {
        let angle = |place: DVec3, area: DVec3| {
            let offset = place - at;
            let squared = offset.length_squared();
            if squared > 0.0 { area.dot(offset) / (squared * squared.sqrt()) } else { 0.0 }
        };
        let mut sum = 0.0;
        let mut open = vec![0];
        while let Some(place) = open.pop() {
            let Some(part) = self.parts.get(place) else { continue };
            if part.centre.distance(at) > FAR * part.reach {
                sum += angle(part.centre, part.area);
            } else if part.second == 0 {
                let surfels = &self.surfels[part.start as usize..part.end as usize];
                sum += surfels.iter().map(|(place, area)| angle(*place, *area)).sum::<f64>();
            } else {
                open.extend([part.second as usize, place + 1]);
            }
        }
        sum / (4.0 * PI)
    }
}

fn part(surfels: &[(DVec3, DVec3)], start: usize) -> Part {
    let weighed = surfels.iter().map(|(place, area)| (*place, area.length()));
    let (sum, weight) = weighed.fold((DVec3::ZERO, 0.0), |(sum, all), (place, weight)| {
        (sum + weight * place, all + weight)
    });
    let plain =
        surfels.iter().map(|(place, _)| *place).sum::<DVec3>() / surfels.len().max(1) as f64;
    let centre = if weight > 0.0 { sum / weight } else { plain };
    let distances = surfels.iter().map(|(place, _)| place.distance(centre));
    Part {
        centre,
        reach: distances.fold(0.0, f64::max),
        area: surfels.iter().map(|(_, area)| *area).sum(),
        start: start as u32,
        end: (start + surfels.len()) as u32,
        second: 0,
    }
}

/// The axis along which surfels spread most.
fn widest(surfels: &[(DVec3, DVec3)]) -> usize {
    let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (min, max) = surfels.iter().fold(start, |(min, max), (p, _)| (min.min(*p), max.max(*p)));
    let size = max - min;
    if size.x >= size.y && size.x >= size.z { 0 } else { 1 + usize::from(size.z > size.y) }
}
