//! A box and a plane: their edges, their handles, and what dragging these does.

use glam::{DMat3, DQuat, DVec3};
use surfelshop_cloud::scene::Axis;
use surfelshop_cloud::selection::{Combine, Region};
use surfelshop_session::options::select::turned_box;

/// A box is at least so thin, in shares of its largest side.
const THINNEST: f64 = 1e-4;

/// Length of a plane's arrow, in shares of half its square's side.
const ARROW: f64 = 0.5;

/// The line of sight through a place of the picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray {
    /// A place on it.
    pub(super) start: DVec3,
    /// Its direction, unit length.
    pub(super) direction: DVec3,
}

/// A box that may be turned about the upward axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct BoxShape {
    /// The corner with the smallest coordinates, before it is turned about the middle.
    pub(super) low: DVec3,
    /// The one with the largest.
    pub(super) high: DVec3,
    /// How far it is turned, counter-clockwise as seen from above.
    pub(super) degrees: f64,
}

/// A plane, of which a square is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PlaneShape {
    /// The square's middle.
    pub(super) point: DVec3,
    /// Unit length; what lies on its side is selected.
    pub(super) normal: DVec3,
    /// Half a side of the square, scene units.
    pub(super) reach: f64,
}

/// What selects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Shape {
    Box(BoxShape),
    Plane(PlaneShape),
}

/// What a handle moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Part {
    /// A side of a box: its axis, and whether it is that of the larger coordinate.
    Side(usize, bool),
    /// All of a box.
    Middle,
    /// An upright edge of a box, which turns it.
    Edge,
    /// A plane, along its normal.
    Point,
    /// The tip of its normal.
    Tip,
}

impl Part {
    /// The name for screen readers.
    pub(super) fn name(self) -> String {
        match self {
            Self::Side(axis, far) => {
                let (sign, name) = (if far { "+" } else { "-" }, ["x", "y", "z"][axis.min(2)]);
                format!("{sign}{name} side of the box")
            }
            Self::Middle => "middle of the box".to_owned(),
            Self::Edge => "edge that turns the box".to_owned(),
            Self::Point => "place of the plane".to_owned(),
            Self::Tip => "direction of the plane".to_owned(),
        }
    }

    /// What a drag does.
    pub(super) fn about(self) -> &'static str {
        match self {
            Self::Side(..) => "drag to move this side",
            Self::Middle => "drag to move the box in the plane of the picture",
            Self::Edge => "drag to turn the box",
            Self::Point => "drag to move the plane along its normal",
            Self::Tip => "drag to tilt the plane",
        }
    }
}

/// The place of a line that is nearest to a line of sight; none where these are all but parallel, or it lies behind the
/// eye.
fn nearest_on_line(place: DVec3, direction: DVec3, ray: &Ray) -> Option<DVec3> {
    let between = place - ray.start;
    let cosine = direction.dot(ray.direction);
    let apart = 1.0 - cosine * cosine;
    let along = (cosine * ray.direction.dot(between) - direction.dot(between)) / apart;
    let nearest = place + direction * along;
    let is_ahead = (nearest - ray.start).dot(ray.direction) > 0.0;
    (apart > 1e-4 && along.is_finite() && is_ahead).then_some(nearest)
}

/// The axes that are not upwards: the second is the first one turned by a right angle about the upward one.
fn level_axes(up: Axis) -> [DVec3; 2] {
    let first = [DVec3::X, DVec3::Y, DVec3::Z][(up.index() + 1) % 3];
    [first, up.direction().cross(first)]
}

impl BoxShape {
    fn middle(&self) -> DVec3 {
        0.5 * (self.low + self.high)
    }

    fn half(&self) -> DVec3 {
        0.5 * (self.high - self.low)
    }

    fn axes(&self, up: Axis) -> [DVec3; 3] {
        let turn = DQuat::from_axis_angle(up.direction(), self.degrees.to_radians());
        let axes = DMat3::from_quat(turn);
        [axes.x_axis, axes.y_axis, axes.z_axis]
    }

    /// A place of the box, of which -1 and 1 are the sides.
    fn place(&self, up: Axis, at: DVec3) -> DVec3 {
        let (axes, half) = (self.axes(up), self.half() * at);
        self.middle() + axes[0] * half.x + axes[1] * half.y + axes[2] * half.z
    }

    fn edges(&self, up: Axis) -> Vec<[DVec3; 2]> {
        let mut edges = Vec::with_capacity(12);
        for axis in 0..3 {
            for corner in 0..4u8 {
                let mut ends = [DVec3::ZERO; 2];
                for (end, along) in ends.iter_mut().zip([-1.0, 1.0]) {
                    end[axis] = along;
                    end[(axis + 1) % 3] = if corner & 1 == 0 { -1.0 } else { 1.0 };
                    end[(axis + 2) % 3] = if corner & 2 == 0 { -1.0 } else { 1.0 };
                }
                edges.push(ends.map(|end| self.place(up, end)));
            }
        }
        edges
    }

    fn handles(&self, up: Axis) -> Vec<(Part, DVec3)> {
        let side = |axis: usize, far: bool| {
            let mut at = DVec3::ZERO;
            at[axis] = if far { 1.0 } else { -1.0 };
            (Part::Side(axis, far), self.place(up, at))
        };
        // Seen along an axis its sides lie where the middle is, and cannot be moved.
        let mut handles: Vec<_> = (0..6).map(|i| side(i / 2, i % 2 == 1)).collect();
        handles.extend([(Part::Edge, self.edge(up)), (Part::Middle, self.middle())]);
        handles
    }

    /// The upper end of the edge that turns it: from no side is it seen where another handle is.
    fn edge(&self, up: Axis) -> DVec3 {
        let mut at = DVec3::ONE;
        at[up.index()] = up.sign();
        self.place(up, at)
    }

    fn dragged(&self, part: Part, ray: &Ray, across: Option<DVec3>, up: Axis) -> Option<Self> {
        match part {
            Part::Side(axis, far) => {
                let direction = *self.axes(up).get(axis)?;
                let to = nearest_on_line(self.middle(), direction, ray)?;
                let half = self.half();
                let along = (to - self.middle()).dot(direction);
                let thinnest = 2.0 * THINNEST * half.max_element();
                // The side across stays where it is, turned as it is.
                let [low, high] = match far {
                    true => [-half[axis], along.max(thinnest - half[axis])],
                    false => [along.min(half[axis] - thinnest), half[axis]],
                };
                let middle = self.middle() + direction * (0.5 * (low + high));
                let mut half = half;
                half[axis] = 0.5 * (high - low);
                Some(Self { low: middle - half, high: middle + half, ..*self })
            }
            Part::Middle => {
                let moved = across? - self.middle();
                Some(Self { low: self.low + moved, high: self.high + moved, ..*self })
            }
            Part::Edge => {
                let (edge, upwards) = (self.edge(up), up.direction());
                let steep = ray.direction.dot(upwards);
                // Seen from the side a drag says nothing of how far away the edge is to be.
                let away = (edge - ray.start).dot(upwards) / steep;
                let to = match steep.abs() > 0.2 && away > 0.0 {
                    true => ray.start + ray.direction * away,
                    false => across?,
                };
                let [first, second] = level_axes(up);
                let angle = |place: DVec3| {
                    let out = place - self.middle();
                    out.dot(second).atan2(out.dot(first))
                };
                let turned = self.degrees + (angle(to) - angle(edge)).to_degrees();
                // What is nearly straight is meant to be.
                let degrees = (turned - (turned / 360.0).round() * 360.0).clamp(-180.0, 180.0);
                let straight = 90.0 * (degrees / 90.0).round();
                let near = (degrees - straight).abs() < 0.5;
                Some(Self { degrees: if near { straight } else { degrees }, ..*self })
            }
            Part::Point | Part::Tip => None,
        }
    }
}

impl PlaneShape {
    fn tip(&self) -> DVec3 {
        self.point + self.normal * (ARROW * self.reach)
    }

    fn edges(&self) -> Vec<[DVec3; 2]> {
        let (u, v) = self.normal.any_orthonormal_pair();
        let corner = |a: f64, b: f64| self.point + (u * a + v * b) * self.reach;
        let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        let mut edges: Vec<_> = (0..4).map(|i| [corners[i], corners[(i + 1) % 4]]).collect();
        edges.push([self.point, self.tip()]);
        edges
    }

    fn dragged(&self, part: Part, ray: &Ray) -> Option<Self> {
        match part {
            Part::Point => {
                let point = nearest_on_line(self.point, self.normal, ray)?;
                Some(Self { point, ..*self })
            }
            Part::Tip => {
                // Where the line of sight meets the sphere that the tip moves on, on the side where it is now; beside
                // the sphere the place nearest to it.
                let to_point = self.point - ray.start;
                let along = to_point.dot(ray.direction);
                let beside = along * ray.direction - to_point;
                let radius = ARROW * self.reach;
                let inside = (radius * radius - beside.length_squared()).max(0.0).sqrt();
                let away = self.normal.dot(ray.direction) > 0.0;
                let tip = beside + ray.direction * if away { inside } else { -inside };
                Some(Self { normal: tip.try_normalize()?, ..*self })
            }
            Part::Side(..) | Part::Middle | Part::Edge => None,
        }
    }
}

impl Shape {
    /// The surfels that it selects.
    pub(super) fn region(&self, up: Axis) -> Region {
        match *self {
            Self::Box(BoxShape { low, high, degrees: 0.0 }) => Region::Box([low, high]),
            Self::Box(BoxShape { low, high, degrees }) => turned_box([low, high], degrees, up),
            Self::Plane(PlaneShape { point, normal, .. }) => Region::Plane { point, normal },
        }
    }

    /// The same for `surfelshop select`, which selects what [`region`](Self::region) does.
    pub(super) fn typed(&self, how: Combine, up: Axis) -> String {
        let place = |p: DVec3| format!("{},{},{}", p.x, p.y, p.z);
        let how = match how {
            Combine::Replace | Combine::Add => "",
            Combine::Subtract => "not:",
            Combine::Intersect => "and:",
        };
        match *self {
            Self::Box(BoxShape { low, high, degrees: 0.0 }) => {
                format!("{how}box:{}:{}", place(low), place(high))
            }
            Self::Box(BoxShape { low, high, degrees }) => {
                format!("{how}box:{}:{}:{degrees} --up {}", place(low), place(high), up.name())
            }
            Self::Plane(PlaneShape { point, normal, .. }) => {
                format!("{how}plane:{}:{}", place(point), place(normal))
            }
        }
    }

    /// Its lines.
    pub(super) fn edges(&self, up: Axis) -> Vec<[DVec3; 2]> {
        match self {
            Self::Box(shape) => shape.edges(up),
            Self::Plane(shape) => shape.edges(),
        }
    }

    /// Its handles, those that lie over others last.
    pub(super) fn handles(&self, up: Axis) -> Vec<(Part, DVec3)> {
        match self {
            Self::Box(shape) => shape.handles(up),
            Self::Plane(shape) => vec![(Part::Point, shape.point), (Part::Tip, shape.tip())],
        }
    }

    /// What it is after a handle was dragged into a line of sight; `across` is where that meets the plane of the picture
    /// through the handle. None where the drag says nothing, as along the line of sight.
    pub(super) fn dragged(
        &self,
        part: Part,
        ray: &Ray,
        across: Option<DVec3>,
        up: Axis,
    ) -> Option<Self> {
        let dragged = match self {
            Self::Box(shape) => Self::Box(shape.dragged(part, ray, across, up)?),
            Self::Plane(shape) => Self::Plane(shape.dragged(part, ray)?),
        };
        dragged.is_finite().then_some(dragged)
    }

    fn is_finite(&self) -> bool {
        match self {
            Self::Box(shape) => {
                shape.low.is_finite() && shape.high.is_finite() && shape.degrees.is_finite()
            }
            Self::Plane(shape) => shape.point.is_finite() && shape.normal.is_finite(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_cloud::{Buffer, Cloud, Column};

    const BOX: BoxShape = BoxShape { low: DVec3::NEG_ONE, high: DVec3::ONE, degrees: 0.0 };

    fn ray(start: DVec3, at: DVec3) -> Ray {
        Ray { start, direction: (at - start) / (at - start).length() }
    }

    #[test]
    fn a_side_follows_the_pointer_and_the_one_across_stays() {
        let eye = DVec3::new(3.0, 4.0, 9.0);
        for degrees in [0.0, 30.0, -140.0] {
            for up in [Axis::PlusY, Axis::PlusZ, Axis::MinusX] {
                let shape = BoxShape { degrees, ..BOX };
                let place = |shape: &BoxShape, x: f64| shape.place(up, DVec3::X * x);
                let to = place(&shape, 1.75);
                let ray = ray(eye, to);
                let dragged = shape.dragged(Part::Side(0, true), &ray, None, up).unwrap();
                assert!(place(&dragged, 1.0).distance(to) < 1e-12);
                assert!(place(&dragged, -1.0).distance(place(&shape, -1.0)) < 1e-12);
                let beyond = self::ray(eye, place(&shape, -5.0));
                let thin = shape.dragged(Part::Side(0, true), &beyond, None, up).unwrap();
                assert!(thin.half().x > 0.0 && thin.half().x < 2e-4, "{thin:?}");
            }
        }
        let along = Ray { start: DVec3::X * 5.0, direction: DVec3::NEG_X };
        assert_eq!(BOX.dragged(Part::Side(0, true), &along, None, Axis::PlusY), None);
    }

    #[test]
    fn an_edge_turns_the_box_as_typed_degrees_do() {
        for up in [Axis::PlusY, Axis::PlusZ, Axis::MinusX] {
            // From above: upright edges are seen where they stand.
            let eye = up.direction() * 9.0 + DVec3::ONE;
            for degrees in [10.0, 95.0, -60.0] {
                let goal = BoxShape { degrees, ..BOX };
                let ray = ray(eye, goal.edge(up));
                let turned = BOX.dragged(Part::Edge, &ray, None, up).unwrap();
                assert!((turned.degrees - degrees).abs() < 1e-9, "{turned:?} for {degrees}");
                assert!(turned.middle().length() < 1e-12);
            }
        }
    }

    #[test]
    fn a_plane_moves_along_its_normal_and_turns_to_its_tip() {
        let plane = PlaneShape { point: DVec3::ZERO, normal: DVec3::Y, reach: 2.0 };
        let eye = DVec3::new(1.0, 2.0, 8.0);
        let moved = plane.dragged(Part::Point, &ray(eye, DVec3::Y * 0.5)).unwrap();
        assert!(moved.point.distance(DVec3::Y * 0.5) < 1e-12 && moved.normal == plane.normal);
        let normal = DVec3::new(0.6, 0.8, 0.0);
        let turned = plane.dragged(Part::Tip, &ray(eye, normal)).unwrap();
        // The arrow is as long as the normal, and turned to the eye or away from it as it was.
        assert!(((turned.tip() - turned.point).length() - 1.0).abs() < 1e-12);
        assert!(turned.normal.distance(normal) < 0.5, "{turned:?}");
        let on = turned.normal - eye;
        assert!(
            on.cross(normal - eye).length() < 1e-9 * on.length_squared(),
            "on the line of sight"
        );
    }

    #[test]
    fn what_is_typed_selects_the_same() {
        let turned = Shape::Box(BoxShape { degrees: 0.1 + 0.2, low: DVec3::splat(-0.3), ..BOX });
        assert_eq!(
            turned.typed(Combine::Subtract, Axis::MinusZ),
            "not:box:-0.3,-0.3,-0.3:1,1,1:0.30000000000000004 --up -z"
        );
        let typed = Shape::Box(BOX).typed(Combine::Replace, Axis::PlusY);
        assert_eq!(typed, "box:-1,-1,-1:1,1,1");
        assert_eq!(Shape::Box(BOX).region(Axis::PlusY), Region::Box([BOX.low, BOX.high]));
    }

    /// Invariant: what a box selects lies between the lines that are drawn, turned about any axis
    #[test]
    fn corners_that_are_drawn_are_those_of_the_region() {
        let shape = BoxShape { low: DVec3::new(-3.0, -1.0, -0.5), high: -BOX.low, degrees: 30.0 };
        for up in Axis::ALL {
            let near = [0.99, 1.01].map(|at| shape.place(up, DVec3::new(at, -at, at)));
            let position = near.iter().flat_map(|place| place.as_vec3().to_array()).collect();
            let column = Column::new("position", 3, Buffer::F32(position));
            let cloud = Cloud::new(DVec3::ZERO, vec![column]).unwrap();
            let selected = Shape::Box(shape).region(up).select(&cloud).unwrap();
            assert_eq!(selected.indices().collect::<Vec<_>>(), [0], "{up:?}");
        }
    }

    #[test]
    fn from_above_the_middle_is_moved_and_sides_along_the_sight_are_not() {
        let up = Axis::PlusY;
        let handles = Shape::Box(BOX).handles(up);
        let (last, at) = handles.last().copied().unwrap();
        assert_eq!((last, at), (Part::Middle, DVec3::ZERO), "over the sides above and below it");
        let ray = Ray { start: DVec3::Y * 9.0, direction: DVec3::NEG_Y };
        assert_eq!(BOX.dragged(Part::Side(1, true), &ray, None, up), None);
        let moved = BOX.dragged(Part::Middle, &ray, Some(DVec3::X), up).unwrap();
        assert_eq!(moved.middle(), DVec3::X);
        // Nor is a side thrown behind the eye by a pointer beyond the vanishing point of its axis.
        let beyond = Ray { start: DVec3::Z, direction: DVec3::new(0.8, 0.0, 0.6) };
        assert_eq!(nearest_on_line(DVec3::ZERO, DVec3::X, &beyond), None);
        let ahead = Ray { direction: -beyond.direction, ..beyond };
        let nearest = nearest_on_line(DVec3::ZERO, DVec3::X, &ahead).unwrap();
        assert!((nearest.x + 4.0 / 3.0).abs() < 1e-12, "{nearest}");
    }
}
