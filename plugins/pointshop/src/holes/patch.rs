//! A patch of surfels over a hole.

use crate::holes::thin_plate::ThinPlate;
use crate::search::Search;
use crate::sphere_fit::{AlgebraicSphere, Sums};
use crate::surfels::{Surfels, median};
use std::collections::HashSet;
use std::f64::consts::PI;
use surfelshop_api::glam::{DVec2, DVec3};
use surfelshop_geometry::hashing::scattered;

/// A new surfel.
#[derive(Clone, Debug)]
pub(crate) struct NewSurfel {
    pub(crate) place: DVec3,
    pub(crate) normal: DVec3,
    pub(crate) radius: f64,
    /// Surfels around and their shares in its colours, the largest first; together 1.
    pub(crate) shares: Vec<(u32, f64)>,
}

/// What became of a border.
#[derive(Clone, Debug)]
pub(crate) enum Outcome {
    /// It encloses no hole.
    NoHole,
    /// The surface around folds over, so that no plane shows it whole.
    Folded,
    /// A hole, filled.
    Filled(Vec<NewSurfel>),
}

/// Spacings around a border that the patch is fitted to.
const BAND: f64 = 4.0;

/// The same where so many would fold over.
const NARROW: f64 = 2.0;

/// Nearest surfels that connect one with the rest of its surface, and spacings within which.
const STEPS: usize = 12;
const LINK: f64 = 2.5;

/// Most surfels that the patch goes through.
const MOST_CENTRES: usize = 300;

/// Most surfels that have a share in a new one's colours.
const MOST_SHARES: usize = 24;

/// Cells of the plane to a spacing.
const FINE: f64 = 2.0;

/// Most cells of the plane.
const MOST_CELLS: f64 = 4e6;

/// How far the plate may stay away from heights: see [`ThinPlate::through`].
const SLACK: f64 = 1e-3;

/// Cosine of the slope to the plane from which on a surface counts as folded.
const STEEP: f64 = 0.15;

/// Share of surfels around that may be folded.
const FEW: f64 = 0.05;

/// Spacings within which a new surfel lies beside another, and those that it may be off its plane there.
const BESIDE: f64 = 1.5;
const OFF: f64 = 0.7;

/// Spacings around a new surfel in which discs over it are looked for, and the share of their radii that is not their rim.
const LAYER: f64 = 1.5;
const WITHIN: f64 = 0.7;

/// Share of the rim of a hole that others must lie beside: what only looks like a hole, as layers one above
/// the other do, has few.
const SURROUNDED: f64 = 0.4;

/// Share of new surfels beside others that may be off.
const FEW_OFF: f64 = 0.25;

/// The surface around a hole in axes of its own.
struct Band {
    middle: DVec3,
    u: DVec3,
    v: DVec3,
    normal: DVec3,
    members: Vec<Member>,
    spacing: f64,
}

/// A surfel over the plane of a hole.
#[derive(Clone, Copy, Debug)]
struct Member {
    index: u32,
    /// Its place in the plane.
    at: DVec2,
    height: f64,
    radius: f64,
}

/// Fills what a border encloses.
pub(crate) fn filled(
    border: &[usize],
    surfels: &Surfels,
    search: &Search,
    apart: &[f64],
) -> Outcome {
    let around = |width: f64| Band::around(border, width, surfels, search, apart);
    let Some(band) = around(BAND).or_else(|| around(NARROW)) else { return Outcome::Folded };
    let covering = band.connected(border, surfels, search, apart);
    let Some(plane) = Plane::of(&band, &covering) else { return Outcome::NoHole };
    let holes = plane.holes();
    if !holes.contains(&true) {
        return Outcome::NoHole;
    }
    let Some(surface) = Surface::of(&band, surfels) else { return Outcome::Folded };
    let mut new = Vec::new();
    for at in plane.lattice(&holes, band.spacing) {
        match surface.surfel(at, &band) {
            Some(surfel) => new.push(surfel),
            None => return Outcome::Folded,
        }
    }
    if new.is_empty() {
        return Outcome::NoHole;
    }
    if !band.continues_in(&new, surfels) {
        return Outcome::Folded;
    }
    // What another layer closes, as where scans overlap, is no hole.
    let own: HashSet<u32> = covering.iter().map(|member| member.index).collect();
    new.retain(|surfel| !band.is_closed_at(surfel, surfels, (search, &own)));
    if new.is_empty() { Outcome::NoHole } else { Outcome::Filled(new) }
}

impl Band {
    fn around(
        border: &[usize],
        width: f64,
        surfels: &Surfels,
        search: &Search,
        apart: &[f64],
    ) -> Option<Self> {
        let mean: DVec3 = border.iter().map(|&i| surfels.normals[i]).sum();
        let normal = (mean / border.len() as f64).try_normalize()?;
        let middle = border.iter().map(|&i| surfels.places[i]).sum::<DVec3>() / border.len() as f64;
        let spacing = median(border.iter().map(|&i| apart[i]))?;
        let mut around: Vec<u32> = Vec::new();
        for &i in border {
            search.within(surfels.places[i], width * spacing, |found| {
                let turned = surfels.normals[found.index as usize].dot(surfels.normals[i]);
                if turned > 0.0 {
                    around.push(found.index);
                }
            });
        }
        around.sort_unstable();
        around.dedup();
        let is_steep = |&&i: &&u32| surfels.normals[i as usize].dot(normal) < STEEP;
        let n_steep = around.iter().filter(is_steep).count();
        if spacing <= 0.0 || n_steep as f64 > FEW * around.len() as f64 {
            return None;
        }
        let (u, v) = normal.any_orthonormal_pair();
        let mut band = Self { middle, u, v, normal, members: Vec::new(), spacing };
        let members = around.iter().filter(|i| !is_steep(i)).map(|&i| band.member(i, surfels));
        band.members = members.collect();
        Some(band)
    }

    fn member(&self, index: u32, surfels: &Surfels) -> Member {
        let offset = surfels.places[index as usize] - self.middle;
        let at = DVec2::new(offset.dot(self.u), offset.dot(self.v));
        let radius = surfels.radii.get(index as usize).copied().unwrap_or(0.0);
        Member { index, at, height: offset.dot(self.normal), radius }
    }

    /// Whether new surfels lie beside others all around, and in their planes.
    fn continues_in(&self, new: &[NewSurfel], surfels: &Surfels) -> bool {
        let beside = new.iter().filter_map(|surfel| {
            let nearest = surfel.shares.first()?.0 as usize;
            let offset = surfel.place - surfels.places[nearest];
            (offset.length() < BESIDE * self.spacing).then_some((surfel, nearest, offset))
        });
        let (mut n, mut n_off) = (0, 0);
        for (surfel, nearest, offset) in beside {
            let normal = surfels.normals[nearest];
            let is_off = offset.dot(normal).abs() > OFF * self.spacing;
            n += 1;
            n_off += usize::from(is_off || normal.dot(surfel.normal) < 0.3);
        }
        // The rim of a round hole of as many surfels has so many beside it.
        let rim = 2.0 * (PI * new.len() as f64).sqrt();
        f64::from(n) >= SURROUNDED * rim && f64::from(n_off as u32) <= FEW_OFF * f64::from(n)
    }

    /// Whether a disc of another layer lies over a new surfel's place, and not only with its rim.
    fn is_closed_at(
        &self,
        new: &NewSurfel,
        surfels: &Surfels,
        (search, own): (&Search, &HashSet<u32>),
    ) -> bool {
        search.any(new.place, LAYER * self.spacing, |found| {
            let i = found.index as usize;
            let (offset, normal) = (new.place - surfels.places[i], surfels.normals[i]);
            let above = offset.dot(normal);
            let radius = surfels.radii.get(i).copied().unwrap_or(0.0);
            let beside = (offset - above * normal).length();
            !own.contains(&found.index)
                && normal.dot(new.normal) > STEEP
                && above.abs() < OFF * self.spacing
                && beside < WITHIN * radius
        })
    }

    /// The surfels of the surface that the border is one of, as far as the border reaches: those
    /// that neighbours connect with it.
    fn connected(
        &self,
        border: &[usize],
        surfels: &Surfels,
        search: &Search,
        apart: &[f64],
    ) -> Vec<Member> {
        let far = |i: usize| surfels.places[i].distance_squared(self.middle);
        let reach = border.iter().map(|&i| far(i)).fold(0.0, f64::max).sqrt();
        let reach = (reach + BAND * self.spacing).powi(2);
        let is_of = |i: usize| far(i) <= reach && surfels.normals[i].dot(self.normal) >= STEEP;
        let mut found: HashSet<u32> = self.members.iter().map(|member| member.index).collect();
        let mut open: Vec<u32> = self.members.iter().map(|member| member.index).collect();
        let mut next = 0;
        while let Some(&i) = open.get(next) {
            next += 1;
            let i = i as usize;
            for near in search.nearest(surfels.places[i], STEPS, LINK * apart[i]) {
                let j = near.index as usize;
                let turned = surfels.normals[j].dot(surfels.normals[i]);
                if turned > 0.0 && is_of(j) && found.insert(near.index) {
                    open.push(near.index);
                }
            }
        }
        open.into_iter().map(|i| self.member(i, surfels)).collect()
    }
}

/// Cells of the plane around a hole.
struct Plane {
    min: DVec2,
    cell: f64,
    width: usize,
    height: usize,
    /// Cells that discs cover.
    covered: Vec<bool>,
}

impl Plane {
    /// The plane with what surfels cover of it; `None` where it would have too many cells.
    fn of(band: &Band, covering: &[Member]) -> Option<Self> {
        let cell = band.spacing / FINE;
        let start = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let places = band.members.iter().map(|member| member.at);
        let (min, max) = places.fold(start, |(min, max), at| (min.min(at), max.max(at)));
        // A row of cells beyond all surfels is surely outside.
        let margin = 4.0 * band.spacing;
        let (min, max) = (min - margin, max + margin);
        let size = ((max - min) / cell).ceil();
        if !size.is_finite() || size.x * size.y > MOST_CELLS {
            return None;
        }
        let (width, height) = (size.x as usize, size.y as usize);
        let mut plane = Self { min, cell, width, height, covered: vec![false; width * height] };
        for Member { at, radius, .. } in covering {
            // Where radii leave gaps, or stand out over a border, spacings tell what a surface is.
            let reach = radius.clamp(0.75 * band.spacing, 1.2 * band.spacing);
            plane.near(*at, reach, |cells, i| cells[i] = true);
        }
        Some(plane)
    }

    fn centre(&self, i: usize) -> DVec2 {
        let (x, y) = ((i % self.width) as f64 + 0.5, (i / self.width) as f64 + 0.5);
        self.min + self.cell * DVec2::new(x, y)
    }

    /// Visits the cells whose middles are within a distance.
    fn near(&mut self, at: DVec2, reach: f64, visit: impl Fn(&mut [bool], usize)) {
        let low = ((at - reach - self.min) / self.cell).floor().max(DVec2::ZERO);
        let high = ((at + reach - self.min) / self.cell).ceil();
        for y in low.y as usize..(high.y as usize + 1).min(self.height) {
            for x in low.x as usize..(high.x as usize + 1).min(self.width) {
                let i = y * self.width + x;
                if self.centre(i).distance_squared(at) <= reach * reach {
                    visit(&mut self.covered, i);
                }
            }
        }
    }

    /// Cells that nothing covers and that cannot be reached from outside over others such.
    fn holes(&self) -> Vec<bool> {
        let mut holes: Vec<bool> = self.covered.iter().map(|covered| !covered).collect();
        let mut open = vec![0];
        while let Some(i) = open.pop() {
            if !std::mem::replace(&mut holes[i], false) {
                continue;
            }
            let (x, y) = (i % self.width, i / self.width);
            open.extend((x > 0).then(|| i - 1));
            open.extend((x + 1 < self.width).then(|| i + 1));
            open.extend((y > 0).then(|| i - self.width));
            open.extend((y + 1 < self.height).then(|| i + self.width));
        }
        holes
    }

    /// Places of a hexagonal lattice that reach all cells of holes.
    fn lattice(&self, holes: &[bool], spacing: f64) -> Vec<DVec2> {
        let row = spacing * 0.75f64.sqrt();
        let mut places = Vec::new();
        let size = self.cell * DVec2::new(self.width as f64, self.height as f64);
        // The corners of a lattice's cell are 0.58 spacings from its middle, and those of a cell of the plane,
        // of which a disc that covers the middle may leave some bare, 0.71 of its width.
        let reach = 0.58 * spacing + 0.71 * self.cell;
        let cells = (reach / self.cell).ceil() as isize;
        for j in 0..(size.y / row) as usize {
            let shift = if j % 2 == 0 { 0.0 } else { 0.5 };
            for i in 0..(size.x / spacing) as usize {
                let at = self.min + DVec2::new((i as f64 + shift) * spacing, j as f64 * row);
                let [x, y] = ((at - self.min) / self.cell).to_array().map(|c| c as isize);
                let is_hole = |dx: isize, dy: isize| {
                    let (x, y) = (x + dx, y + dy);
                    let inside = x >= 0 && y >= 0;
                    let inside = inside && x < self.width as isize && y < self.height as isize;
                    let i = (y * self.width as isize + x) as usize;
                    inside && holes[i] && self.centre(i).distance(at) <= reach
                };
                let around = -cells..=cells;
                if around.clone().any(|dy| around.clone().any(|dx| is_hole(dx, dy))) {
                    places.push(at);
                }
            }
        }
        places
    }
}

/// Heights over the plane: a sphere or plane, and a thin plate for what is left.
struct Surface {
    sphere: Option<AlgebraicSphere>,
    plate: ThinPlate,
}

impl Surface {
    fn of(band: &Band, surfels: &Surfels) -> Option<Self> {
        let mut sums = Sums::default();
        for member in &band.members {
            let i = member.index as usize;
            sums.add(1.0, surfels.places[i] - band.middle, surfels.normals[i]);
        }
        // A sphere where it fits much better than a plane.
        let scatter = |sphere: &AlgebraicSphere| -> f64 {
            let off = |member: &Member| {
                let base = base(sphere, band, member.at);
                base.map_or(f64::INFINITY, |base| (base - member.height).powi(2))
            };
            band.members.iter().map(off).sum()
        };
        let flat = sums.fit(band.middle, true);
        let sphere = sums.fit(band.middle, false).filter(|sphere| {
            let of_plane = flat.as_ref().map_or(f64::INFINITY, scatter);
            scatter(sphere) < 0.25 * of_plane
        });
        let mut chosen: Vec<usize> = (0..band.members.len()).collect();
        chosen.sort_by_cached_key(|&i| (scattered(u64::from(band.members[i].index)), i));
        chosen.truncate(MOST_CENTRES);
        let places: Vec<DVec2> = chosen.iter().map(|&i| band.members[i].at).collect();
        let left = |&i: &usize| {
            let Member { at, height, .. } = band.members[i];
            let below = sphere.as_ref().map(|sphere| base(sphere, band, at));
            below.map_or(Some(height), |base| base.map(|base| height - base))
        };
        let heights: Option<Vec<f64>> = chosen.iter().map(left).collect();
        let plate = ThinPlate::through(&places, &heights?, SLACK)?;
        Some(Self { sphere, plate })
    }

    fn height(&self, at: DVec2, band: &Band) -> Option<f64> {
        let base = self.sphere.as_ref().map_or(Some(0.0), |sphere| base(sphere, band, at));
        base.map(|base| base + self.plate.height(at))
    }

    /// The surfel at a place of the plane; `None` where the surface is too steep there.
    fn surfel(&self, at: DVec2, band: &Band) -> Option<NewSurfel> {
        let step = 0.05 * band.spacing;
        let slope = |towards: DVec2| -> Option<f64> {
            let ahead = self.height(at + step * towards, band)?;
            Some((ahead - self.height(at - step * towards, band)?) / (2.0 * step))
        };
        let (x, y) = (slope(DVec2::X)?, slope(DVec2::Y)?);
        let normal = (band.normal - x * band.u - y * band.v).try_normalize()?;
        let height = self.height(at, band)?;
        let place = band.middle + at.x * band.u + at.y * band.v + height * band.normal;
        let stretch = 1.0 / normal.dot(band.normal).max(STEEP);
        // Discs that reach the corners of the lattice's cells, and a fifth more.
        let radius = 1.2 * band.spacing / 3f64.sqrt() * stretch;
        let mut near: Vec<(f64, u32)> =
            band.members.iter().map(|other| (other.at.distance_squared(at), other.index)).collect();
        let n = MOST_SHARES.min(near.len());
        let order = |a: &(f64, u32), b: &(f64, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        if n < near.len() {
            near.select_nth_unstable_by(n, order);
            near.truncate(n);
        }
        near.sort_unstable_by(order);
        let small = 0.01 * band.spacing * band.spacing;
        let weight = |squared: f64| (squared + small).powf(-1.5);
        let all: f64 = near.iter().map(|(squared, _)| weight(*squared)).sum();
        let shares = near.into_iter().map(|(squared, i)| (i, weight(squared) / all)).collect();
        Some(NewSurfel { place, normal, radius, shares })
    }
}

/// Height of a sphere or plane over a place of the plane: where the line along the normal meets it,
/// nearest to the plane's middle.
fn base(sphere: &AlgebraicSphere, band: &Band, at: DVec2) -> Option<f64> {
    let from = band.middle + at.x * band.u + at.y * band.v;
    sphere.along(from, band.normal)
}
