//! A patch of a surface laid flat with as little stretch as can be.
//!
//! Method. Each surfel u of the plane wants its neighbours where its tangent plane, turned, has them: the sum of
//! `w |u_j - u_i - R_i t_ij|²` over all links is made small in turns by the best rotation `R_i` of each surfel, in closed
//! form, and by the best places, a sparse linear system that conjugate gradients solve (Sorkine and Alexa 2007, Liu et
//! al. 2008). It starts from the discrete exponential map (Schmidt et al. 2006). The limit of many surfels is the map whose
//! principal stretches are nearest to 1 in the mean square, whatever the surface; what can be unrolled is unrolled.
//!
//! Places of the picture hold some surfels, up to a similarity: how large and how turned the picture lies on the surface is
//! not said, but follows. So it is what no similarity of the picture explains of where they lie that is made small, and two
//! places hold nothing.

use super::patch::Patch;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::ops::Range;
use surfelshop_api::glam::{DMat2, DQuat, DVec2, DVec3};
use surfelshop_api::prelude::*;

/// Steps of conjugate gradients in each round: the next round goes on where it ended.
const STEPS: usize = 60;

/// Share of the mean length of links by which a round moves surfels at most where it is the last.
const SETTLED: f64 = 1e-3;

/// How firmly surfels are held, over how firmly their neighbours hold them: off by about a thousandth of what these pull.
const HOLD: f64 = 1e3;

/// By how much better a mirror has to fit than a similarity: places that are clicked are not exact.
const MIRRORED: f64 = 1.5;

/// A place of the surface that has a place in the picture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pin {
    /// The surfel nearest to it, by its place in the patch.
    pub(crate) surfel: usize,
    /// Where it lies in the tangent plane of that.
    pub(crate) offset: DVec2,
    /// Where it lies in the picture: to the right and upwards, in heights of the picture.
    pub(crate) picture: DVec2,
}

impl Pin {
    /// Where it lies in the plane, by where surfels lie there and how these are turned.
    fn plane(&self, places: &[DVec2], turns: &[DVec2]) -> DVec2 {
        places[self.surfel] + turns[self.surfel].rotate(self.offset)
    }
}

/// How the picture lies in the plane: turned and as large as `turn`, which is a complex number, and moved.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lie {
    pub(crate) turn: DVec2,
    pub(crate) shift: DVec2,
}

impl Lie {
    /// The similarity that brings places of the picture nearest to places of the plane; none where all are one.
    /// It is never a mirror.
    fn fitted(pairs: impl Iterator<Item = (DVec2, DVec2)> + Clone) -> Option<Self> {
        let n = pairs.clone().count() as f64;
        let middles = pairs.clone().fold([DVec2::ZERO; 2], |sum, (p, u)| [sum[0] + p, sum[1] + u]);
        let [p0, u0] = middles.map(|sum| sum / n);
        let (mut turn, mut size) = (DVec2::ZERO, 0.0);
        for (p, u) in pairs {
            let (p, u) = (p - p0, u - u0);
            turn += DVec2::new(p.dot(u), p.perp_dot(u));
            size += p.length_squared();
        }
        let turn = turn / size;
        turn.is_finite().then(|| Self { turn, shift: u0 - turn.rotate(p0) })
    }

    /// The place of the plane.
    pub(crate) fn plane(self, picture: DVec2) -> DVec2 {
        self.turn.rotate(picture) + self.shift
    }

    /// The place of the picture.
    pub(crate) fn picture(self, plane: DVec2) -> DVec2 {
        let turned = DVec2::new(self.turn.x, -self.turn.y).rotate(plane - self.shift);
        turned / self.turn.length_squared()
    }
}

/// A patch in the plane.
pub(crate) struct Flat {
    /// Where each surfel lies, scene units.
    pub(crate) places: Vec<DVec2>,
    /// The rotation of each tangent plane, as a complex number of length 1.
    turns: Vec<DVec2>,
    /// How the picture lies.
    pub(crate) lie: Lie,
    /// Whether the last round moved nothing any more.
    pub(crate) settled: bool,
}

impl Flat {
    /// Lays a patch flat.
    ///
    /// # Errors
    /// Where the job is to stop, and where no picture fits.
    pub(crate) fn of(
        patch: &Patch,
        normals: &[DVec3],
        pins: &[Pin],
        rounds: u32,
        job: &Job<'_>,
        share: Range<f64>,
    ) -> Result<Self> {
        let (mut places, mut turns) = unrolled(patch, normals, pins, job)?;
        refuse_mirrored(&places, &turns, pins)?;
        let enough = SETTLED * patch.mean_length();
        let mut settled = false;
        for round in 0..rounds {
            let done = f64::from(round) / f64::from(rounds);
            let done = share.start + (share.end - share.start) * done;
            job.progress(done, "laying the surface flat");
            for (i, turn) in turns.iter_mut().enumerate() {
                *turn = best_turn(patch, &places, i).unwrap_or(*turn);
            }
            let moved = improve(patch, &mut places, &turns, pins, job)?;
            settled = moved <= enough;
            if settled {
                break;
            }
        }
        let lie = lie_of(&places, &turns, pins)?;
        Ok(Self { places, turns, lie, settled })
    }

    /// The derivative of the map at a surfel, from its tangent plane into the plane: the affine map that fits its links
    /// best; none where these lie on a line.
    pub(crate) fn slope(&self, patch: &Patch, i: usize) -> Option<DMat2> {
        let (mut mixed, mut own) = (DMat2::ZERO, DMat2::ZERO);
        for link in patch.links(i) {
            let apart = self.places[link.to as usize] - self.places[i];
            let t = link.offset * link.weight;
            mixed += DMat2::from_cols(apart * t.x, apart * t.y);
            own += DMat2::from_cols(link.offset * t.x, link.offset * t.y);
        }
        // Weights make the numbers of `own` shares of 1.
        let flat = own.determinant() > 1e-6 * (own.x_axis.x + own.y_axis.y).powi(2);
        let slope = mixed * own.inverse();
        (flat && slope.is_finite()).then_some(slope)
    }

    /// Where a pin lies in the plane.
    pub(crate) fn pinned(&self, pin: &Pin) -> DVec2 {
        pin.plane(&self.places, &self.turns)
    }
}

fn lie_of(places: &[DVec2], turns: &[DVec2], pins: &[Pin]) -> Result<Lie> {
    let pairs = pins.iter().map(|pin| (pin.picture, pin.plane(places, turns)));
    Lie::fitted(pairs)
        .filter(|lie| lie.turn.length_squared() > 0.0)
        .ok_or_else(|| Error::new("expected places that differ, on the cloud and in the picture"))
}

/// Refuses places that a mirror brings nearer to those of the picture than a similarity does.
fn refuse_mirrored(places: &[DVec2], turns: &[DVec2], pins: &[Pin]) -> Result<()> {
    let n = pins.len() as f64;
    let at = |pin: &Pin| pin.plane(places, turns);
    let p0 = pins.iter().map(|pin| pin.picture).sum::<DVec2>() / n;
    let u0 = pins.iter().map(at).sum::<DVec2>() / n;
    let (mut similar, mut mirrored) = (DVec2::ZERO, DVec2::ZERO);
    for pin in pins {
        let (p, u) = (pin.picture - p0, at(pin) - u0);
        // Products of complex numbers, of the conjugate of one and of both.
        similar += DVec2::new(p.dot(u), p.perp_dot(u));
        mirrored += p.rotate(u);
    }
    // Of places on a line both are equal.
    if mirrored.length() > MIRRORED * similar.length() {
        return Err(Error::new(
            "`pairs`: expected places that lie to each other in the picture as on the surface, seen from outside, \
             found the picture mirrored; `v` counts from the top",
        ));
    }
    Ok(())
}

/// The rotation that brings a surfel's tangent plane nearest to where its neighbours lie.
fn best_turn(patch: &Patch, places: &[DVec2], i: usize) -> Option<DVec2> {
    let sum = patch.links(i).iter().fold(DVec2::ZERO, |sum, link| {
        let apart = places[link.to as usize] - places[i];
        sum + link.weight * DVec2::new(link.offset.dot(apart), link.offset.perp_dot(apart))
    });
    sum.try_normalize()
}

/// The discrete exponential map: from the first pin on, each surfel lies where those before it have it, in the mean; its axes
/// are carried along.
fn unrolled(
    patch: &Patch,
    normals: &[DVec3],
    pins: &[Pin],
    job: &Job<'_>,
) -> Result<(Vec<DVec2>, Vec<DVec2>)> {
    let n = patch.surfels.len();
    let (mut places, mut turns) = (vec![DVec2::ZERO; n], vec![DVec2::X; n]);
    let (mut reached, mut settled) = (vec![f64::INFINITY; n], vec![false; n]);
    let mut open = BinaryHeap::new();
    // The first pin begins: what is carried over a developable surface is the same from anywhere.
    if let Some(first) = pins.first() {
        reached[first.surfel] = 0.0;
        open.push((Reverse(0f64.to_bits()), first.surfel));
    }
    let mut n_settled = 0;
    while let Some((Reverse(bits), i)) = open.pop() {
        if settled[i] {
            continue;
        }
        if n_settled % 4096 == 0 {
            job.check()?;
        }
        n_settled += 1;
        let (mut place, mut turn, mut weights) = (DVec2::ZERO, DVec2::ZERO, 0.0);
        for link in patch.links(i) {
            let j = link.to as usize;
            if settled[j] {
                // As seen from there: the axes here, brought into that plane, and the way here.
                let here = carried(patch, normals, i, j);
                let way = here.rotate(link.offset);
                let weight = link.weight.sqrt();
                place += weight * (places[j] - turns[j].rotate(way));
                turn += weight * turns[j].rotate(here);
                weights += weight;
            }
        }
        if weights > 0.0 {
            places[i] = place / weights;
            turns[i] = turn.normalize_or(DVec2::X);
        }
        settled[i] = true;
        let distance = f64::from_bits(bits);
        for link in patch.links(i) {
            let (j, whole) = (link.to as usize, distance + link.offset.length());
            if whole < reached[j] {
                reached[j] = whole;
                open.push((Reverse(whole.to_bits()), j));
            }
        }
    }
    if let Some(i) = pins.iter().position(|pin| !settled[pin.surfel]) {
        return Err(Error::new(format!(
            "`pairs`: expected places that hang together over the surface, found a gap or a sharp edge \
             between place 1 and place {}; a larger `reach` may lead around it",
            i + 1
        )));
    }
    // Islands that no place is on stay out of the way, and are not painted.
    for (place, settled) in places.iter_mut().zip(&settled) {
        if !settled {
            *place = DVec2::NAN;
        }
    }
    Ok((places, turns))
}

/// The rotation that brings the axes of a surfel into those of another one, by the shortest turn of one normal onto the
/// other.
fn carried(patch: &Patch, normals: &[DVec3], from: usize, to: usize) -> DVec2 {
    let [a, b] = [from, to].map(|i| normals[patch.surfels[i] as usize]);
    let turn = DQuat::from_rotation_arc(a, b);
    let right = turn * patch.axes[from][0];
    DVec2::new(right.dot(patch.axes[to][0]), right.dot(patch.axes[to][1])).normalize_or(DVec2::X)
}

/// The right side of the normal equations: where links, turned, pull each surfel.
fn pulls(patch: &Patch, turns: &[DVec2]) -> Vec<DVec2> {
    let mut pulls = vec![DVec2::ZERO; turns.len()];
    for (i, turn) in turns.iter().enumerate() {
        for link in patch.links(i) {
            let way = link.weight * turn.rotate(link.offset);
            pulls[link.to as usize] += way;
            pulls[i] -= way;
        }
    }
    pulls
}

/// Better places for these rotations, by some steps of conjugate gradients on the normal equations; how far the one that is
/// moved most is moved.
fn improve(
    patch: &Patch,
    places: &mut [DVec2],
    turns: &[DVec2],
    pins: &[Pin],
    job: &Job<'_>,
) -> Result<f64> {
    let n = places.len();
    let mut diagonal: Vec<f64> =
        (0..n).map(|i| 2.0 * patch.links(i).iter().map(|link| link.weight).sum::<f64>()).collect();
    let mut right = pulls(patch, turns);
    // As firmly for all, so that what is left after the fit is its orthogonal rest.
    let firm = HOLD * pins.iter().map(|pin| diagonal[pin.surfel]).fold(0.0, f64::max);
    let unexplained = |places: &[DVec2]| -> Vec<DVec2> {
        let pairs = pins.iter().zip(places).map(|(pin, place)| (pin.picture, *place));
        let lie = Lie::fitted(pairs);
        let rest = pins.iter().zip(places).map(|(pin, place)| {
            lie.map_or(DVec2::ZERO, |lie| firm * (*place - lie.plane(pin.picture)))
        });
        rest.collect()
    };
    let ways: Vec<DVec2> = pins.iter().map(|pin| turns[pin.surfel].rotate(pin.offset)).collect();
    for (pin, rest) in pins.iter().zip(unexplained(&ways)) {
        right[pin.surfel] -= rest;
        diagonal[pin.surfel] += firm * pins.len().saturating_sub(2) as f64 / pins.len() as f64;
    }
    // Links are mutual and of about the same weight both ways; what is not exactly so is made so by summing both.
    let apply = |x: &[DVec2]| -> Vec<DVec2> {
        let mut y = vec![DVec2::ZERO; n];
        let held: Vec<DVec2> = pins.iter().map(|pin| x[pin.surfel]).collect();
        for (pin, rest) in pins.iter().zip(unexplained(&held)) {
            y[pin.surfel] += rest;
        }
        for i in 0..n {
            for link in patch.links(i) {
                let pull = link.weight * (x[i] - x[link.to as usize]);
                y[i] += pull;
                y[link.to as usize] -= pull;
            }
        }
        y
    };
    let is_there: Vec<bool> = places.iter().map(|place| place.is_finite()).collect();
    let mut x: Vec<DVec2> =
        places.iter().map(|place| if place.is_finite() { *place } else { DVec2::ZERO }).collect();
    let dot = |a: &[DVec2], b: &[DVec2]| a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum::<f64>();
    let divided = |r: &[DVec2]| -> Vec<DVec2> {
        r.iter().zip(&diagonal).map(|(r, d)| if *d > 0.0 { *r / *d } else { DVec2::ZERO }).collect()
    };
    let mut rest: Vec<DVec2> = right.iter().zip(apply(&x)).map(|(b, y)| *b - y).collect();
    let mut scaled = divided(&rest);
    let mut way = scaled.clone();
    let mut size = dot(&rest, &scaled);
    let enough = 1e-24 * dot(&right, &divided(&right));
    for _ in 0..STEPS {
        job.check()?;
        if size.is_nan() || size <= enough {
            break;
        }
        let pulled = apply(&way);
        let length = size / dot(&way, &pulled);
        if !length.is_finite() {
            break;
        }
        for i in 0..n {
            x[i] += length * way[i];
            rest[i] -= length * pulled[i];
        }
        scaled = divided(&rest);
        let next = dot(&rest, &scaled);
        let share = next / size;
        size = next;
        for (way, scaled) in way.iter_mut().zip(&scaled) {
            *way = *scaled + share * *way;
        }
    }
    let mut most = 0.0f64;
    for ((place, x), is_there) in places.iter_mut().zip(x).zip(is_there) {
        if is_there {
            most = most.max(place.distance(x));
            *place = x;
        }
    }
    Ok(most)
}
