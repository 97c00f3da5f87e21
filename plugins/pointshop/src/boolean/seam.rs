//! What of a surfel stays outside or inside another solid, and the lines that cut it there.

use crate::boolean::winding::Winding;
use crate::search::{Found, Search};
use crate::sphere_fit::{AlgebraicSphere, Foot, Sums};
use crate::surfels::Surfels;
use surfelshop_api::glam::DVec3;

/// A closed cloud that others are cut by.
pub(crate) struct Solid {
    pub(crate) surfels: Surfels,
    pub(crate) search: Search,
    /// How far surfels are apart.
    pub(crate) apart: Vec<f64>,
    pub(crate) winding: Winding,
    /// Half axes of the surfels.
    pub(crate) tangents: Vec<[DVec3; 2]>,
}

/// The side of the other solid that stays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Side {
    Outside,
    Inside,
}

/// What becomes of a surfel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Fate {
    /// It stays whole.
    Whole,
    /// It goes.
    Gone,
    /// It is cut, by the values of a column `clip`.
    Cut([f32; 7]),
}

/// Lines that cut nothing.
pub(crate) const UNCUT: [f32; 7] = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0];

/// Whether lines are said to cut nothing.
pub(crate) fn cuts_nothing(lines: &[f32; 7]) -> bool {
    lines[6] < 0.5
}

/// Nearest surfels of the other solid that a surfel is compared with.
const COMPARED: usize = 32;

/// Cosine of the angle between normals from which on they are of two faces with an edge between.
const CREASE: f64 = 0.82;

/// Cosine from which on a face is the back of a thin wall.
const BACK: f64 = -0.9;

/// Most faces that meet in a corner of which something is made.
const MOST_FACES: usize = 3;

/// Distance in spacings of the other solid within which its surface is looked at, beyond the disc.
const NEAR: f64 = 2.0;

/// A surfel lies in the other's surface where its plane is off by less than this share of its radius
/// everywhere.
const SAME_PLACE: f64 = 0.03;

/// A face of the other solid near a surfel.
struct Face {
    sphere: AlgebraicSphere,
    /// The mean place of its surfels.
    middle: DVec3,
    normal: DVec3,
}

/// What of a disc is on the side of one face that stays.
#[derive(Clone, Copy)]
enum Half {
    All,
    Nothing,
    /// Where `a u + b v + c >= 0`.
    Line([f64; 3]),
}

impl Solid {
    /// What becomes of a surfel of another solid of which `side` stays. `in_same_place` says whether
    /// it stays where it lies in this surface, and by whether it faces the same way.
    pub(crate) fn fate(
        &self,
        place: DVec3,
        normal: DVec3,
        [u, v]: [DVec3; 2],
        side: Side,
        in_same_place: impl Fn(bool) -> bool,
    ) -> Fate {
        let whole = |is_inside: bool| {
            let stays = is_inside == (side == Side::Inside);
            if stays { Fate::Whole } else { Fate::Gone }
        };
        let radius = u.length().max(v.length());
        let Some(closest) = self.search.closest(place) else { return whole(false) };
        let apart = self.apart[closest.index as usize];
        let reach = radius + NEAR * apart;
        if closest.squared > reach * reach {
            return whole(self.winding.number(place) > 0.5);
        }
        let around = self.search.nearest(place, COMPARED, reach + apart);
        let width = radius.max(apart);
        let faces = self.faces(place, width, &around);
        let Some(first) = faces.first() else {
            return whole(self.winding.number(place) > 0.5);
        };
        let half = |face: &Face| {
            half_of(face, place, normal, [u, v], side, &in_same_place).unwrap_or(Half::All)
        };
        let halves: Vec<Half> = faces.iter().map(half).collect();
        // Outside an edge that stands out is outside of either face, inside it within both.
        let stands_out = |second: &Face| {
            let between = second.middle - first.middle;
            first.normal.dot(between) - second.normal.dot(between) < 0.0
        };
        let is_convex = faces.get(1).is_some_and(stands_out);
        joined(&halves, is_convex == (side == Side::Outside))
    }

    /// The faces near a place, nearest first: surfels of one face have about the same normal.
    fn faces(&self, place: DVec3, width: f64, around: &[Found]) -> Vec<Face> {
        let normal = |found: &Found| self.surfels.normals[found.index as usize];
        let mut turned: Vec<DVec3> = Vec::with_capacity(MOST_FACES);
        for n in around.iter().map(normal) {
            let is_new = turned.iter().all(|other| n.dot(*other) <= CREASE);
            // The back of a thin wall is no face of an edge.
            let is_back = turned.first().is_some_and(|first| n.dot(*first) < BACK);
            if is_new && !is_back && turned.len() < MOST_FACES {
                turned.push(n);
            }
        }
        let face = |i: usize| {
            let is_of = |n: DVec3, j: usize| n.dot(turned[j]) > CREASE;
            self.face(place, width, around, |n| is_of(n, i) && !(0..i).any(|j| is_of(n, j)))
        };
        (0..turned.len()).filter_map(face).collect()
    }

    /// The face of those surfels around a place whose normals fit.
    fn face(
        &self,
        place: DVec3,
        width: f64,
        around: &[Found],
        fits: impl Fn(DVec3) -> bool,
    ) -> Option<Face> {
        let surfels = &self.surfels;
        let members = || {
            let found = around.iter().map(|found| (found.index as usize, found.squared));
            found.filter(|(i, _)| fits(surfels.normals[*i]))
        };
        let (_, nearest) = members().next()?;
        let mut sums = Sums::default();
        for (i, squared) in members() {
            // The nearest always has a say, however far it is.
            let weight = (-(squared - nearest) / (width * width)).exp();
            sums.add(weight, surfels.places[i] - place, surfels.normals[i]);
        }
        let sphere = sums.fit(place, members().count() < 4)?;
        let normal = sphere.foot(place)?.normal;
        Some(Face { sphere, middle: place + sums.mean(), normal })
    }
}

/// Steps towards the line where two surfaces meet.
const STEPS: usize = 3;

/// What of a disc is on the side of a face that stays.
fn half_of(
    face: &Face,
    place: DVec3,
    normal: DVec3,
    [u, v]: [DVec3; 2],
    side: Side,
    in_same_place: impl Fn(bool) -> bool,
) -> Option<Half> {
    let line_at = |Foot { place: foot, normal: n }: Foot| [n.dot(u), n.dot(v), n.dot(place - foot)];
    let mut foot = face.sphere.foot(place)?;
    let [a, b, c] = line_at(foot);
    let radius = u.length().max(v.length());
    if a.hypot(b) + c.abs() < SAME_PLACE * radius {
        let stays = in_same_place(foot.normal.dot(normal) > 0.0);
        return Some(if stays { Half::All } else { Half::Nothing });
    }
    // The face's tangent plane at the nearest place of the seam, not the one below the centre.
    for _ in 0..STEPS {
        let [a, b, c] = line_at(foot);
        let squared = a * a + b * b;
        if squared <= 0.0 || c.abs() > 1.5 * squared.sqrt() {
            break;
        }
        let step = -c / squared;
        foot = face.sphere.foot(place + step * (a * u + b * v))?;
    }
    let sign = if side == Side::Outside { 1.0 } else { -1.0 };
    let [a, b, c] = line_at(foot).map(|number| sign * number);
    let length = a.hypot(b);
    Some(if c >= length {
        Half::All
    } else if c <= -length {
        Half::Nothing
    } else {
        Half::Line([a / length, b / length, c / length])
    })
}

/// What stays on the sides of faces: of any of them, or of all. Two lines at most cut a surfel, those of
/// the nearest faces.
fn joined(halves: &[Half], any: bool) -> Fate {
    let is_single = halves.len() == 1;
    let decides = |half: &Half| match half {
        Half::All => any,
        Half::Nothing => !any,
        Half::Line(_) => false,
    };
    if !is_single && halves.iter().any(decides) {
        return if any { Fate::Whole } else { Fate::Gone };
    }
    let mut lines = halves.iter().filter_map(|half| match half {
        Half::Line(line) => Some(line.map(|number| number as f32)),
        Half::All | Half::Nothing => None,
    });
    let Some([a, b, c]) = lines.next() else {
        let stays = matches!(halves.first(), Some(Half::All));
        return if stays { Fate::Whole } else { Fate::Gone };
    };
    match lines.next() {
        None => Fate::Cut([a, b, c, 0.0, 0.0, 1.0, 1.0]),
        Some([d, e, f]) => Fate::Cut([a, b, c, d, e, f, if any { 2.0 } else { 1.0 }]),
    }
}

/// Lines that cut a surfel which others cut already: where each is one line, both count; else
/// the new ones.
pub(crate) fn cut_again(before: &[f32], new: [f32; 7]) -> [f32; 7] {
    let is_one = |lines: &[f32]| lines[3..6] == UNCUT[3..6] && lines[6] > 0.5 && lines[6] < 1.5;
    if before.len() == 7 && is_one(before) && is_one(&new) {
        let [a, b, c] = [before[0], before[1], before[2]];
        return [new[0], new[1], new[2], a, b, c, 1.0];
    }
    new
}
