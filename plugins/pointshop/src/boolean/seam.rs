//! What of a surfel stays outside or inside another solid, and the lines that cut it there.

use crate::boolean::shared::{Twin, among_twins, shared};
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
pub(crate) const CREASE: f64 = 0.82;

/// Cosine from which on a face is the back of a thin wall.
const BACK: f64 = -0.9;

/// Most faces that meet in a corner of which something is made.
const MOST_FACES: usize = 3;

/// Distance in spacings of the other solid within which its surface is looked at, beyond the disc.
const NEAR: f64 = 2.0;

/// A surfel lies in the other's surface where its plane is off by less than this share of its radius
/// everywhere.
pub(crate) const SAME_PLACE: f64 = 0.03;

/// A face of the other solid near a surfel.
pub(crate) struct Face {
    pub(crate) sphere: AlgebraicSphere,
    /// The mean place of its surfels.
    pub(crate) middle: DVec3,
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
    /// The larger half axis of a surfel.
    pub(crate) fn radius(&self, i: usize) -> f64 {
        let [u, v] = self.tangents[i];
        u.length().max(v.length())
    }

    /// How far surfels are apart around a surfel, scene units.
    fn apart(&self, found: &Found) -> f64 {
        self.apart[found.index as usize]
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

/// A solid and another one that cuts it.
#[derive(Clone, Copy)]
pub(crate) struct Pair<'a> {
    pub(crate) own: &'a Solid,
    pub(crate) other: &'a Solid,
    /// Which surfels of the own solid are the other's too.
    pub(crate) own_twins: &'a [Twin],
    /// Which surfels of the other solid are the own's too.
    pub(crate) other_twins: &'a [Twin],
}

/// Most times [`COMPARED`] surfels of the own solid that are compared where it is the denser one, so
/// that they are around as far as those of the other: 4 times as dense has half the spacing. Where it
/// is denser still the fit is the better one, and more surfels cost more than they tell.
const DENSER: f64 = 4.0;

impl Pair<'_> {
    /// The other solid, and this one that cuts it.
    pub(crate) fn swapped(&self) -> Self {
        Self {
            own: self.other,
            other: self.own,
            own_twins: self.other_twins,
            other_twins: self.own_twins,
        }
    }

    /// What becomes of a surfel of the own solid where `side` of the other stays. `in_same_place`
    /// says whether it stays where it lies in the other's surface, by whether it faces the same way.
    pub(crate) fn fate(&self, i: usize, side: Side, in_same_place: impl Fn(bool) -> bool) -> Fate {
        let Self { own, other, .. } = *self;
        let whole = |stays: bool| if stays { Fate::Whole } else { Fate::Gone };
        if let Some(same_way) = self.own_twins[i] {
            return whole(in_same_place(same_way));
        }
        let (place, normal) = (own.surfels.places[i], own.surfels.normals[i]);
        let of_inside = |is_inside: bool| whole(is_inside == (side == Side::Inside));
        let radius = own.radius(i);
        let Some(closest) = other.search.closest(place) else { return of_inside(false) };
        let apart = other.apart(&closest);
        let reach = radius + NEAR * apart;
        if closest.squared > reach * reach {
            return of_inside(other.winding.number(place) > 0.5);
        }
        let around = other.search.nearest(place, COMPARED, reach + apart);
        let near = radius + apart;
        if let Some(same_way) =
            among_twins(other, self.other_twins, (place, normal, radius), &around, near)
        {
            return whole(in_same_place(same_way));
        }
        let width = radius.max(apart);
        let faces = other.faces(place, width, &around);
        let Some(first) = faces.first() else {
            return of_inside(other.winding.number(place) > 0.5);
        };
        let disc = Disc { place, normal, axes: own.tangents[i] };
        // Farther off no face cuts the disc, even where it bends.
        let is_met = |face: &Face| {
            let foot = face.sphere.foot(place);
            foot.is_none_or(|foot| foot.place.distance(place) < 1.5 * radius)
        };
        let is_met = faces.iter().any(is_met);
        let shared = |face: &Face| {
            lies_in(face, &disc).or_else(|| is_met.then(|| self.shared(i, face, apart)).flatten())
        };
        let shared: Vec<Option<bool>> = faces.iter().map(shared).collect();
        if let Some(same_way) = in_shared(&faces, &shared, &disc) {
            return whole(in_same_place(same_way));
        }
        let half = |(face, &shared): (&Face, &Option<bool>)| {
            half_of(face, &disc, side, shared, &in_same_place).unwrap_or(Half::All)
        };
        let halves: Vec<Half> = faces.iter().zip(&shared).map(half).collect();
        // Outside an edge that stands out is outside of either face, inside it within both.
        let stands_out = |second: &Face| {
            let between = second.middle - first.middle;
            first.normal.dot(between) - second.normal.dot(between) < 0.0
        };
        let is_convex = faces.get(1).is_some_and(stands_out);
        joined(&halves, is_convex == (side == Side::Outside))
    }

    /// Whether the own solid has a face of the other near a surfel too, and whether both face the
    /// same way. Both surfaces are fitted in the same manner amid the face, so that where they
    /// coincide the fits are off alike. `apart` is the spacing of the other there, scene units.
    fn shared(&self, i: usize, face: &Face, apart: f64) -> Option<bool> {
        let Self { own, other, .. } = *self;
        let radius = own.radius(i);
        let (width, reach) = (radius.max(apart), radius + (NEAR + 1.0) * apart);
        let denser = (apart / own.apart[i]).powi(2).clamp(1.0, DENSER);
        // The spacing of a cloud all in one place is 0.
        let denser = if denser.is_finite() { denser } else { 1.0 };
        let count = (COMPARED as f64 * denser) as usize;
        let at = face.middle;
        let own_around = own.search.nearest(at, count, reach);
        let cosine = |found: &Found| own.surfels.normals[found.index as usize].dot(face.normal);
        if !own_around.iter().any(|found| cosine(found).abs() > CREASE) {
            return None;
        }
        let own_faces = own.faces(at, width, &own_around);
        let faces = other.faces(at, width, &other.search.nearest(at, COMPARED, reach));
        let mut same = faces.iter().filter(|other| other.normal.dot(face.normal) > CREASE);
        same.find_map(|face| shared(face, &own_faces, width))
    }
}

/// Steps towards the line where two surfaces meet.
const STEPS: usize = 3;

/// A surfel that is cut.
struct Disc {
    place: DVec3,
    normal: DVec3,
    /// Half axes.
    axes: [DVec3; 2],
}

/// Whether a disc's plane agrees with a face all over the disc, and whether both face the same way.
fn lies_in(face: &Face, disc: &Disc) -> Option<bool> {
    let [u, v] = disc.axes;
    let Foot { place, normal } = face.sphere.foot(disc.place)?;
    let off = normal.dot(u).hypot(normal.dot(v)) + normal.dot(disc.place - place).abs();
    let is_in = off < SAME_PLACE * u.length().max(v.length());
    is_in.then_some(normal.dot(disc.normal) > 0.0)
}

/// A disc is on a face of about its direction where its centre is off by less than this share of its
/// radius; faces that bend across a disc are extrapolated that badly. Farther off is another layer.
pub(crate) const ON: f64 = 0.5;

/// Whether a disc is on a face, of which the nearest place is given.
fn is_on(foot: &Foot, disc: &Disc) -> bool {
    let [u, v] = disc.axes;
    let off = foot.normal.dot(disc.place - foot.place).abs();
    foot.normal.dot(disc.normal).abs() > CREASE && off < ON * u.length().max(v.length())
}

/// Where all faces near a disc are shared, so that edges between them are too, and it is on one of
/// them: whether it faces the same way there.
fn in_shared(faces: &[Face], shared: &[Option<bool>], disc: &Disc) -> Option<bool> {
    let all: Vec<bool> = shared.iter().copied().collect::<Option<_>>()?;
    let is_on = |face: &Face| face.sphere.foot(disc.place).is_some_and(|foot| is_on(&foot, disc));
    faces.iter().zip(all).find(|(face, _)| is_on(face)).map(|(_, same_way)| same_way)
}

/// What of a disc is on the side of a face that stays. `shared` says whether the disc's own solid
/// has that face too, and whether both face the same way.
fn half_of(
    face: &Face,
    disc: &Disc,
    side: Side,
    shared: Option<bool>,
    in_same_place: impl Fn(bool) -> bool,
) -> Option<Half> {
    let Disc { place, axes: [u, v], .. } = *disc;
    let whole = |stays: bool| Some(if stays { Half::All } else { Half::Nothing });
    let line_at = |Foot { place: foot, normal: n }: Foot| [n.dot(u), n.dot(v), n.dot(place - foot)];
    let mut foot = face.sphere.foot(place)?;
    let radius = u.length().max(v.length());
    if let Some(same_way) = shared {
        let [_, _, c] = line_at(foot);
        if is_on(&foot, disc) || c.abs() < SAME_PLACE * radius {
            return whole(in_same_place(same_way));
        }
        // The face next to the disc's own at an edge that both solids have: what of the disc is
        // beyond it is none of the surface, and a line would leave that alone.
        let is_inside = c < 0.0;
        return whole(is_inside == (side == Side::Inside));
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
