//! Sides by the places of the devices that saw the points.

use crate::discs::{Discs, Hit};
use crate::normals;
use crate::progress::{Cancelled, Progress, map, part, report};
use crate::visibility::surfels::{Choice, NEAR, Surfels};
use glam::Vec3;

/// What [`towards_scanners`] did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TowardsScanners {
    /// Normals that were turned.
    pub turned: usize,
    /// Normals that face a device now.
    pub decided: usize,
    /// Of these, those whose angle to the line of sight is over 85 degrees: noise may have chosen.
    pub grazing: usize,
    /// Normals left alone: without a direction, a finite position or any device.
    pub unknown: usize,
}

impl TowardsScanners {
    /// Share of the decided normals that are unsure, in [0, 1]; 0 where none was decided.
    #[must_use]
    pub fn unsure(&self) -> f64 {
        self.grazing as f64 / self.decided.max(1) as f64
    }
}

/// The cosine of 85 degrees.
const GRAZING: f64 = 0.087_155_742_747_658;

/// Devices that are tried for a point, the nearest first.
const TRIED: usize = 8;

/// Turns normals towards the devices that saw the points, whatever their signs were; lengths stay.
///
/// `scanner_of` has for each point the device it belongs to, as an index into `scanners`. A point
/// without one (beyond the end of `scanner_of`, or with an index beyond the devices) gets the nearest
/// that sees it, and sees it at less than 85 degrees; the nearest if none does. Scene units, O(n) time;
/// where devices must be chosen, O(n log n) and at most eight rays a point.
///
/// # Errors
/// Where `progress` asks to stop; `normals` are then unchanged.
pub fn towards_scanners(
    positions: &[Vec3],
    normals: &mut [Vec3],
    scanners: &[Vec3],
    scanner_of: Option<&[u32]>,
    progress: Progress<'_>,
) -> Result<TowardsScanners, Cancelled> {
    let finite: Vec<Vec3> = scanners.iter().copied().filter(|place| place.is_finite()).collect();
    let known = |index: usize| {
        let scanner = *scanner_of?.get(index)?;
        scanners.get(scanner as usize).copied().filter(|place| place.is_finite())
    };
    let n = positions.len().min(normals.len());
    let needs_search = finite.len() > 1 && (0..n).any(|index| known(index).is_none());
    let occluders = if needs_search {
        Some(Occluders::of(positions, normals, &part(progress, 0.0..0.6))?)
    } else {
        None
    };
    let unchanged = &*normals;
    let cosines = map(n, &part(progress, 0.6..1.0), |index| {
        let (position, normal) = (positions[index], unchanged[index]);
        if !position.is_finite() || !normals::is_valid(normal) {
            return None;
        }
        let search = || chosen(position, normal, &finite, occluders.as_ref());
        cosine(position, normal, known(index).or_else(search)?)
    })?;
    report(progress, 1.0)?;
    let mut done = TowardsScanners { unknown: normals.len() - n, ..TowardsScanners::default() };
    for (normal, cosine) in normals.iter_mut().zip(cosines) {
        let Some(cosine) = cosine else {
            done.unknown += 1;
            continue;
        };
        if cosine < 0.0 {
            *normal = -*normal;
            done.turned += 1;
        }
        done.decided += 1;
        done.grazing += usize::from(cosine.abs() < GRAZING);
    }
    Ok(done)
}

/// The cosine between a normal and the direction to a device; `None` for a device at the point.
fn cosine(position: Vec3, normal: Vec3, scanner: Vec3) -> Option<f64> {
    let towards = scanner.as_dvec3() - position.as_dvec3();
    let towards = towards / towards.abs().max_element();
    let towards = towards.try_normalize()?;
    Some(towards.dot(normals::normalised(normal).as_dvec3()))
}

/// The nearest device that sees a point, or could but for what lies between, or at all.
fn chosen(
    position: Vec3,
    normal: Vec3,
    scanners: &[Vec3],
    occluders: Option<&Occluders>,
) -> Option<Vec3> {
    let normal = normals::normalised(normal);
    let distance = |place: &Vec3| (place.as_dvec3() - position.as_dvec3()).length_squared();
    let mut order: Vec<Vec3> = scanners.to_vec();
    order.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    order.truncate(TRIED);
    let is_plausible = |place: &&Vec3| {
        cosine(position, normal, **place).is_some_and(|cosine| cosine.abs() >= GRAZING)
    };
    let is_free = |place: &&Vec3| {
        occluders.is_none_or(|occluders| occluders.is_free((position, normal), **place))
    };
    let plausible = || order.iter().filter(is_plausible);
    plausible().find(is_free).or_else(|| plausible().next()).or(order.first()).copied()
}

/// What may lie between a point and a device.
struct Occluders {
    surfels: Surfels,
    discs: Discs,
}

impl Occluders {
    fn of(positions: &[Vec3], normals: &[Vec3], progress: Progress<'_>) -> Result<Self, Cancelled> {
        let choice = Choice { count: super::DECIDING.max(positions.len() / 8), refit: false };
        let surfels = Surfels::choose(positions, normals, choice, &part(progress, 0.0..0.8))?;
        let discs = surfels.discs(&part(progress, 0.8..1.0))?;
        Ok(Self { surfels, discs })
    }

    /// Whether nothing but the point's own surface lies between it and a place.
    fn is_free(&self, (position, normal): (Vec3, Vec3), place: Vec3) -> bool {
        let frame = self.surfels.frame;
        let (from, to) = (frame.inside(place), frame.inside(position));
        let length = from.distance(to);
        let Some(direction) = (to - from).try_normalize() else { return true };
        let blocks = |hit: Hit| {
            let disc = &self.surfels.all[hit.index as usize];
            hit.distance < length - NEAR * disc.radius || !disc.continues(to, normal)
        };
        // Discs that the point lies in block nothing.
        let reach = 0.0..length * (1.0 - 1e-4);
        self.discs.nearest(from, direction, reach, blocks).is_none()
    }
}
