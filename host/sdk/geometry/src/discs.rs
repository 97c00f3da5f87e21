//! A bounding volume hierarchy of discs, to trace rays at.

use crate::progress::{Cancelled, Progress, aside};
use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh;
use obvhs::ploc::PlocBuilder;
use obvhs::ray::{Ray, RayHit};
use obvhs::{Boundable, BvhBuildParams};
use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

/// A flat round piece of surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    /// Its centre.
    pub centre: Vec3,
    /// Its unit normal.
    pub normal: Vec3,
    /// Its radius, in the unit of the centre; nothing hits a radius that is not positive.
    pub radius: f32,
}

impl Boundable for Disc {
    fn aabb(&self) -> Aabb {
        let n = self.normal;
        // Half the size along an axis is the radius times the sine between axis and normal.
        let half = self.radius.max(0.0) * (Vec3::ONE - n * n).max(Vec3::ZERO).map(f32::sqrt);
        // A few rounding steps more, so that rays along a face of the box do not miss it.
        let half = half + 4.0 * f32::EPSILON * (self.centre.abs() + half);
        Aabb { min: Vec3A::from(self.centre - half), max: Vec3A::from(self.centre + half) }
    }
}

/// Where a ray meets a disc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Meeting {
    /// Distance along the ray, in lengths of its direction.
    pub distance: f32,
    /// Whether the ray comes from the side the normal points to.
    pub front: bool,
    /// The disc's radius.
    pub radius: f32,
}

/// A disc that a ray meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Position of the disc in the list the hierarchy was built from.
    pub index: u32,
    /// Distance along the ray, in lengths of its direction.
    pub distance: f32,
    /// Distance from the disc's centre as a share of its radius, squared.
    pub share_squared: f32,
    /// Whether the ray comes from the side the normal points to.
    pub front: bool,
}

/// Discs in a hierarchy of boxes, eight to a node (Ylitie et al. 2017).
pub struct Discs {
    bvh: CwBvh,
    /// In the order of the hierarchy's leaves.
    discs: Vec<Disc>,
    /// Indices of the discs in the list they were built from.
    source_index: Vec<u32>,
    /// What they are divided by, a power of two: products of lengths stay in the range of f32, and the
    /// hierarchy's own smallest lengths are small.
    unit: f32,
}

/// What discs are divided by.
fn unit_of(discs: &[Disc]) -> f32 {
    let largest = |disc: &Disc| disc.centre.abs().max_element().max(disc.radius);
    let exponent = discs.iter().map(largest).fold(0.0, f32::max).log2().floor();
    // Within exponents whose inverses are finite, too.
    if exponent.is_finite() { exponent.clamp(-126.0, 126.0).exp2() } else { 1.0 }
}

/// The hierarchy of discs, of which there is one at least. As `obvhs` builds one for primitives, without the time that
/// it takes of it: a WebAssembly module has no clock to ask.
fn build(discs: &[Disc]) -> CwBvh {
    let how = BvhBuildParams::fast_build();
    let indices = (0..discs.len() as u32).collect();
    let mut bvh = PlocBuilder::with_capacity(discs.len()).build(
        how.ploc_search_distance,
        discs,
        indices,
        how.sort_precision,
        how.search_depth_threshold,
    );
    ReinsertionOptimizer::default().run(&mut bvh, how.reinsertion_batch_ratio, None);
    bvh2_to_cwbvh(&bvh, how.max_prims_per_leaf.clamp(1, 3), true, false)
}

impl Default for Discs {
    fn default() -> Self {
        Self { bvh: CwBvh::default(), discs: Vec::new(), source_index: Vec::new(), unit: 1.0 }
    }
}

impl Discs {
    /// Builds the hierarchy, for rays whose directions are about as long as 1: O(n log n) time, about 60 bytes a disc.
    ///
    /// Where `progress` asks to stop, this returns at once; a thread that nobody waits for finishes
    /// the hierarchy and drops it. Discs that are not finite or have no size are left out.
    ///
    /// # Errors
    /// Where `progress` asks to stop.
    pub fn build(discs: &[Disc], progress: Progress<'_>) -> Result<Self, Cancelled> {
        let is_finite = |disc: &&Disc| {
            let finite = disc.centre.is_finite() && disc.normal.is_finite();
            finite && disc.radius.is_finite() && disc.radius > 0.0
        };
        let finite: Vec<Disc> = discs.iter().filter(is_finite).copied().collect();
        let unit = unit_of(&finite);
        let scaled =
            |disc: &Disc| Disc { centre: disc.centre / unit, radius: disc.radius / unit, ..*disc };
        let finite: Arc<[Disc]> = finite.iter().map(scaled).collect();
        let kept: Vec<u32> =
            (0u32..).zip(discs).filter(|(_, disc)| is_finite(disc)).map(|(i, _)| i).collect();
        // Measured: about 300 ns a disc.
        let usually = Duration::from_nanos(300 * finite.len() as u64);
        let theirs = Arc::clone(&finite);
        let bvh = aside(progress, usually, move || {
            // The builder wants something to build.
            let nothing = theirs.is_empty();
            (!nothing).then(|| build(&theirs))
        })?;
        let bvh = bvh.unwrap_or_default();
        let discs = bvh.primitive_indices.iter().map(|&index| finite[index as usize]).collect();
        let source_index =
            bvh.primitive_indices.iter().map(|&index| kept[index as usize]).collect();
        Ok(Self { bvh, discs, source_index, unit })
    }

    /// Whether a ray meets a disc within `reach` (lengths of its direction) that `counts`.
    #[must_use]
    pub fn is_hit(
        &self,
        origin: Vec3,
        direction: Vec3,
        reach: Range<f32>,
        counts: impl Fn(Meeting) -> bool,
    ) -> bool {
        if self.discs.is_empty() {
            return false;
        }
        // The hierarchy tells directions by comparing with zero and inverts by the sign bit, which
        // differ for the negative zero; adding zero makes it positive.
        let (origin, direction) = (origin / self.unit, direction + Vec3::ZERO);
        let ray = self.ray(origin, direction, &reach);
        !self.bvh.ray_traverse_miss(ray, |ray, place| {
            let disc = &self.discs[place];
            let slope = disc.normal.dot(direction);
            let distance = disc.normal.dot(disc.centre - origin) / slope;
            let offset = origin + distance * direction - disc.centre;
            // A ray within the disc's own plane has no distance, which is in no range.
            let meets = distance > ray.tmin
                && distance < ray.tmax
                && offset.length_squared() < disc.radius * disc.radius
                && counts(Meeting {
                    distance: distance * self.unit,
                    front: slope < 0.0,
                    radius: disc.radius * self.unit,
                });
            if meets { distance } else { f32::INFINITY }
        })
    }

    /// Calls `visit` for every disc that a ray meets within `reach`, in no particular order.
    pub fn each(
        &self,
        origin: Vec3,
        direction: Vec3,
        reach: Range<f32>,
        mut visit: impl FnMut(Hit),
    ) {
        if self.discs.is_empty() {
            return;
        }
        let (origin, direction) = (origin / self.unit, direction + Vec3::ZERO);
        let ray = self.ray(origin, direction, &reach);
        self.bvh.ray_traverse_miss(ray, |ray, place| {
            if let Some(hit) = self.hit(place, origin, direction, ray.tmin..ray.tmax) {
                visit(self.in_scene_units(hit));
            }
            f32::INFINITY
        });
    }

    /// The nearest disc that a ray meets within `reach` and that `counts`.
    #[must_use]
    pub fn nearest(
        &self,
        origin: Vec3,
        direction: Vec3,
        reach: Range<f32>,
        counts: impl Fn(Hit) -> bool,
    ) -> Option<Hit> {
        if self.discs.is_empty() {
            return None;
        }
        let (origin, direction) = (origin / self.unit, direction + Vec3::ZERO);
        let ray = self.ray(origin, direction, &reach);
        let mut nearest: Option<Hit> = None;
        let mut met = RayHit::none();
        self.bvh.ray_traverse(ray, &mut met, |ray, place| {
            let end = nearest.map_or(ray.tmax, |hit| hit.distance);
            let hit = self.hit(place, origin, direction, ray.tmin..end);
            match hit.filter(|hit| counts(self.in_scene_units(*hit))) {
                Some(hit) => {
                    nearest = Some(hit);
                    hit.distance
                }
                None => f32::INFINITY,
            }
        });
        nearest.map(|hit| self.in_scene_units(hit))
    }

    /// A ray as the hierarchy takes it.
    fn ray(&self, origin: Vec3, direction: Vec3, reach: &Range<f32>) -> Ray {
        let (start, end) = (reach.start / self.unit, reach.end / self.unit);
        Ray::new(origin.into(), direction.into(), start, end)
    }

    /// A hit in the lengths of the discs before they were scaled.
    fn in_scene_units(&self, hit: Hit) -> Hit {
        Hit { distance: hit.distance * self.unit, ..hit }
    }

    /// Where a ray meets the disc at a place of the hierarchy, in its lengths.
    fn hit(&self, place: usize, origin: Vec3, direction: Vec3, reach: Range<f32>) -> Option<Hit> {
        let disc = &self.discs[place];
        let slope = disc.normal.dot(direction);
        let distance = disc.normal.dot(disc.centre - origin) / slope;
        let offset = origin + distance * direction - disc.centre;
        let share_squared = offset.length_squared() / (disc.radius * disc.radius);
        let meets = distance > reach.start && distance < reach.end && share_squared < 1.0;
        let (index, front) = (self.source_index[place], slope < 0.0);
        meets.then_some(Hit { index, distance, share_squared, front })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::silent;
    use crate::samples::Random;

    fn random_discs(count: usize) -> Vec<Disc> {
        let mut random = Random::new(3);
        (0..count)
            .map(|_| Disc {
                centre: random.in_ball().as_vec3(),
                normal: random.on_sphere().as_vec3(),
                radius: 0.1 * random.unit() as f32,
            })
            .collect()
    }

    /// The same question to one disc after the other, in f64.
    fn brute_force(discs: &[Disc], origin: Vec3, direction: Vec3, reach: Range<f32>) -> bool {
        let (origin, direction) = (origin.as_dvec3(), direction.as_dvec3());
        discs.iter().any(|disc| {
            let (centre, normal) = (disc.centre.as_dvec3(), disc.normal.as_dvec3());
            let distance = normal.dot(centre - origin) / normal.dot(direction);
            let meets = (origin + distance * direction).distance(centre) < f64::from(disc.radius);
            meets && distance > f64::from(reach.start) && distance < f64::from(reach.end)
        })
    }

    #[test]
    fn hits_are_those_of_a_full_search() {
        let discs = random_discs(500);
        let built = Discs::build(&discs, &silent).unwrap();
        let mut random = Random::new(8);
        let mut n_hits = 0;
        let mut n_different = 0;
        for _ in 0..5000 {
            let origin = random.in_ball().as_vec3();
            let direction = random.on_sphere().as_vec3();
            let hit = built.is_hit(origin, direction, 0.0..1.0, |_| true);
            let expected = brute_force(&discs, origin, direction, 0.0..1.0);
            n_hits += i32::from(hit);
            n_different += i32::from(hit != expected);
        }
        assert!((500..4500).contains(&n_hits), "{n_hits}");
        // Rays within a rounding error of a disc's edge.
        assert!(n_different <= 1, "{n_different}");
    }

    #[test]
    fn sides_and_reach_are_told() {
        let disc = Disc { centre: Vec3::Z, normal: Vec3::Z, radius: 0.5 };
        let discs = Discs::build(&[disc], &silent).unwrap();
        let front = |m: Meeting| m.front;
        assert!(!discs.is_hit(Vec3::ZERO, Vec3::Z, 0.0..9.0, front));
        assert!(discs.is_hit(2.0 * Vec3::Z, -Vec3::Z, 0.0..9.0, front));
        assert!(discs.is_hit(Vec3::ZERO, Vec3::Z, 0.0..9.0, |m| !m.front && m.distance == 1.0));
        assert!(!discs.is_hit(Vec3::ZERO, Vec3::Z, 0.0..0.9, |_| true));
        assert!(!discs.is_hit(Vec3::ZERO, Vec3::Z, 1.1..9.0, |_| true));
        assert!(!discs.is_hit(Vec3::ZERO, -Vec3::Z, 0.0..9.0, |_| true));
    }

    #[test]
    fn what_is_told_of_a_meeting_has_the_lengths_of_the_scene() {
        for size in [0.01, 0.3, 1.0, 70.0] {
            let disc = Disc { centre: size * Vec3::Z, normal: Vec3::Z, radius: 0.5 * size };
            let discs = Discs::build(&[disc], &silent).unwrap();
            let is_right = |m: Meeting| m.distance == size && m.radius == 0.5 * size;
            assert!(discs.is_hit(Vec3::ZERO, Vec3::Z, 0.0..f32::INFINITY, is_right), "{size}");
        }
    }

    #[test]
    fn nearest_and_all_hits_are_those_of_a_full_search() {
        let mut discs = random_discs(500);
        // Positions are those of the list, also behind one that is left out.
        discs[0].radius = f32::NAN;
        let built = Discs::build(&discs, &silent).unwrap();
        let mut random = Random::new(8);
        let mut n_several = 0;
        for _ in 0..2000 {
            let (origin, direction) = (random.in_ball().as_vec3(), random.on_sphere().as_vec3());
            let mut all = Vec::new();
            built.each(origin, direction, 0.0..9.0, |hit| all.push(hit));
            for hit in &all {
                let disc = &discs[hit.index as usize];
                let place = origin + hit.distance * direction;
                assert!(place.distance(disc.centre) < disc.radius * 1.0001);
                assert!((disc.normal.dot(place - disc.centre)).abs() < 1e-5);
            }
            let one = |i: usize| brute_force(&discs[i..=i], origin, direction, 0.0..9.0);
            let expected = (1..discs.len()).filter(|&i| one(i)).count();
            assert!(expected.abs_diff(all.len()) <= 1, "{expected} {}", all.len());
            all.sort_by(|a, b| a.distance.total_cmp(&b.distance));
            let nearest = built.nearest(origin, direction, 0.0..9.0, |_| true);
            assert_eq!(nearest.map(|hit| hit.index), all.first().map(|hit| hit.index));
            let other = |hit: Hit| Some(hit.index) != nearest.map(|hit| hit.index);
            let second = built.nearest(origin, direction, 0.0..9.0, other);
            assert_eq!(second.map(|hit| hit.index), all.get(1).map(|hit| hit.index));
            n_several += i32::from(all.len() > 1);
        }
        assert!(n_several > 100, "{n_several}");
    }

    /// Products of their lengths would leave the range of f32, and with them what boxes are sorted by.
    #[test]
    fn discs_of_any_size_and_far_apart_are_hit() {
        for size in [1.0, 1e-30, 1e30] {
            let scaled = |disc: Disc| Disc {
                centre: disc.centre * size,
                radius: disc.radius * size,
                ..disc
            };
            let discs: Vec<Disc> = random_discs(500).into_iter().map(scaled).collect();
            let built = Discs::build(&discs, &silent).unwrap();
            let mut random = Random::new(8);
            let hit = |built: &Discs, random: &mut Random| {
                let origin = random.in_ball().as_vec3() * size;
                built.is_hit(origin, random.on_sphere().as_vec3(), 0.0..size, |_| true)
            };
            let n = (0..1000).filter(|_| hit(&built, &mut random)).count();
            assert!((100..900).contains(&n), "{size}: {n}");
        }
        let mut discs = random_discs(600);
        for disc in discs.iter_mut().step_by(7) {
            disc.centre *= 1e30;
        }
        let built = Discs::build(&discs, &silent).unwrap();
        let far = discs[7];
        let towards = far.centre - far.normal;
        let found = built.nearest(
            Vec3::ZERO,
            (towards / 1e30).normalize_or(Vec3::Z),
            0.0..f32::MAX,
            |_| true,
        );
        assert!(found.is_none_or(|hit| hit.distance.is_finite()));
    }

    #[test]
    fn no_disc_and_discs_without_size_are_never_hit() {
        let nothing = Discs::build(&[], &silent).unwrap();
        assert!(!nothing.is_hit(Vec3::ZERO, Vec3::Z, 0.0..9.0, |_| true));
        let radii = [0.0, -1.0, f32::NAN, f32::INFINITY];
        let discs = radii.map(|radius| Disc { centre: Vec3::Z, normal: Vec3::Z, radius });
        let discs = Discs::build(&discs, &silent).unwrap();
        assert!(!discs.is_hit(Vec3::ZERO, Vec3::Z, 0.0..9.0, |_| true));
    }
}
