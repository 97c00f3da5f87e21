//! Where growth is measured.

use super::body;
use super::cells::Of;
use glam::DVec3;
use serde_json::json;
use surfelshop_api::{Camera, View};
use surfelshop_session::options::LensArguments;
use surfelshop_session::options::camera::{self, Extent};

/// Numbers of surfels.
const SURFELS: [u32; 8] =
    [10_000, 30_000, 100_000, 300_000, 1_000_000, 3_000_000, 10_000_000, 20_000_000];

/// Sides of pictures, pixels.
const SIDES: [u32; 5] = [256, 512, 1024, 2048, 4096];

/// Distances of the camera from the surface, in that of a view of the whole body.
const DISTANCES: [f64; 4] = [1.0, 0.5, 0.25, 0.125];

/// Where only one thing grows, the others are these, or less where less is asked for.
const USUAL_SURFELS: u32 = 300_000;
pub(super) const USUAL_SIDE: u32 = 1024;

/// What grows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Series {
    Surfels,
    Pixels,
    Closeness,
}

impl Series {
    pub(super) const ALL: [Self; 3] = [Self::Surfels, Self::Pixels, Self::Closeness];

    /// Its name, in tables and files.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Surfels => "surfels",
            Self::Pixels => "pixels",
            Self::Closeness => "closeness",
        }
    }

    /// What stands below its plot.
    pub(super) fn across(self) -> &'static str {
        match self {
            Self::Surfels => "surfels",
            Self::Pixels => "pixels",
            Self::Closeness => "how many times closer to the surface",
        }
    }
}

/// A place in a series.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Point {
    pub(super) series: Series,
    pub(super) surfels: u32,
    pub(super) side: u32,
    pub(super) distance: f64,
}

impl Point {
    /// What grows.
    pub(super) fn x(&self) -> f64 {
        match self.series {
            Series::Surfels => f64::from(self.surfels),
            Series::Pixels => f64::from(self.side).powi(2),
            Series::Closeness => 1.0 / self.distance,
        }
    }

    pub(super) fn of(&self) -> Of {
        vec![
            ("series", json!(self.series.name())),
            ("surfels", json!(self.surfels)),
            ("side", json!(self.side)),
            ("distance", json!(self.distance)),
        ]
    }

    /// The body from so near.
    pub(super) fn view(&self, lens: &LensArguments) -> View {
        // The same for all numbers of surfels, whose radii reach out less and less.
        let extent = Extent::new(DVec3::ZERO, body::REACH);
        let size = [self.side; 2];
        let seen = camera::view(lens, &extent, size);
        let eye = seen.camera.eye;
        let towards = eye.normalize_or(DVec3::Z);
        let surface = towards * body::height(towards);
        let eye = surface + self.distance * (eye - surface);
        camera::framed_view(Camera { eye, ..seen.camera }, &extent, size)
    }
}

/// All places up to what is asked for, those of one cloud together.
pub(super) fn points(most: u32, largest: u32) -> Vec<Point> {
    let (n, side) = (USUAL_SURFELS.min(most), USUAL_SIDE.min(largest));
    let usual = Point { series: Series::Surfels, surfels: n, side, distance: 1.0 };
    let surfels = SURFELS.into_iter().filter(|n| *n <= most);
    let sides = SIDES.into_iter().filter(|side| *side <= largest);
    let mut all: Vec<Point> = surfels.map(|surfels| Point { surfels, ..usual }).collect();
    all.extend(sides.map(|side| Point { series: Series::Pixels, side, ..usual }));
    let closer = |distance| Point { series: Series::Closeness, distance, ..usual };
    all.extend(DISTANCES.map(closer));
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use surfelshop_session::options::UpAxis;
    use surfelshop_session::options::camera::CameraSpec;

    #[test]
    fn places_end_where_they_are_asked_to() {
        let all = points(30_000, 256);
        assert!(all.iter().all(|point| point.surfels <= 30_000 && point.side <= 256));
        let n = |series| all.iter().filter(|point| point.series == series).count();
        assert_eq!(Series::ALL.map(n), [2, 1, 4]);
        let all = points(20_000_000, 4096);
        assert_eq!(all.len(), SURFELS.len() + SIDES.len() + DISTANCES.len());
        for series in Series::ALL {
            let x: Vec<f64> = all.iter().filter(|p| p.series == series).map(Point::x).collect();
            assert!(x.windows(2).all(|pair| pair[0] < pair[1]), "{x:?}");
        }
    }

    #[test]
    fn closer_places_halve_the_distance_to_the_surface() {
        let camera = CameraSpec::three_quarter();
        let lens =
            LensArguments { camera, up: UpAxis::Y, fov: None, orthographic: false, zoom: 1.0 };
        let closer = points(20_000, 512).into_iter().filter(|p| p.series == Series::Closeness);
        let away = closer.map(|point| {
            let eye = point.view(&lens).camera.eye;
            eye.length() - body::height(eye.normalize_or(DVec3::X))
        });
        let away: Vec<f64> = away.collect();
        assert!(away.windows(2).all(|pair| (pair[1] / pair[0] - 0.5).abs() < 1e-9), "{away:?}");
        assert!(away[3] > 0.1, "outside: {away:?}");
    }
}
