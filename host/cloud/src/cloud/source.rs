//! What a file said of its clouds besides their points.

use crate::cloud::axis::Axis;
use glam::DVec3;
use serde::Serialize;
use surfelshop_api::format::{CloudHeader, Pose, UpAxis};

/// One scan of a file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Scan {
    /// What the file calls it; may be empty.
    pub name: String,
    /// Where it stands in the common coordinates.
    pub pose: Pose,
    /// Where the device stood, in the common coordinates, where the file says so.
    pub scanner: Option<DVec3>,
}

/// A cloud in the coordinates of a depth camera, which is at zero and looks along z.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CameraFrame {
    /// The axis that points up.
    pub up: Axis,
    /// Whether that camera saw all of it.
    pub is_one_view: bool,
}

/// What a file said of its clouds besides their points; all of it may be unknown.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Source {
    /// The axis that points up.
    pub up: UpAxis,
    /// How the points lie before a depth camera at zero, where the file does not say how they stand and they do.
    pub camera_frame: Option<CameraFrame>,
    /// Whether the points lie as in coordinates of a map, with heights along z, where the file does not say which axis
    /// points up.
    pub is_on_map: bool,
    /// Metres of a unit of coordinates; 0 where unknown.
    pub metres_per_unit: f64,
    /// Coordinate reference system as the file has it; may be empty.
    pub coordinate_system: String,
    /// When it was taken, for people; may be empty.
    pub time: String,
    /// Smallest step of coordinates, where the file has one.
    pub step: Option<DVec3>,
    /// The scans, in the order of the file. Where there are several, the column `scan` says which one a
    /// point belongs to.
    pub scans: Vec<Scan>,
    /// Columns and rows of the grid of an organised cloud, as long as no point was taken out.
    pub grid: Option<[u32; 2]>,
    /// Of an organised cloud: the direction that lies up in its grid, as from the device, unit length.
    pub grid_up: Option<DVec3>,
    /// Comments of the file.
    pub comments: Vec<String>,
}

impl Source {
    /// What headers say of all clouds together.
    pub(crate) fn of_headers<'a>(headers: impl Iterator<Item = &'a CloudHeader> + Clone) -> Self {
        let headers = || headers.clone();
        let first = |text: fn(&CloudHeader) -> &String| {
            headers().map(text).find(|text| !text.is_empty()).cloned().unwrap_or_default()
        };
        let up = headers().map(|header| header.up).find(|&up| up != UpAxis::Unknown);
        let scan = |header: &CloudHeader| Scan {
            name: header.name.clone(),
            pose: header.pose,
            scanner: header.scanner.map(|place| header.pose.place(place)),
        };
        let mut metres = headers().map(|header| header.metres_per_unit);
        Self {
            up: up.unwrap_or_default(),
            camera_frame: None,
            is_on_map: false,
            metres_per_unit: metres
                .find(|metres| metres.is_finite() && *metres > 0.0)
                .unwrap_or(0.0),
            coordinate_system: first(|header| &header.coordinate_system),
            time: first(|header| &header.time),
            step: headers().find_map(|header| header.step).filter(|step| step.is_finite()),
            scans: headers().map(scan).collect(),
            grid: None,
            grid_up: None,
            comments: Vec::new(),
        }
    }

    /// The axis that the file says points up.
    #[must_use]
    pub fn said_up(&self) -> Option<Axis> {
        match self.up {
            UpAxis::Unknown => None,
            UpAxis::X => Some(Axis::PlusX),
            UpAxis::Y => Some(Axis::PlusY),
            UpAxis::Z => Some(Axis::PlusZ),
        }
    }

    /// The axis that points up by how the points lie, where that tells.
    #[must_use]
    pub fn guessed_up(&self) -> Option<Axis> {
        let of_camera = self.camera_frame.map(|frame| frame.up);
        of_camera.or_else(|| self.is_on_map.then_some(Axis::PlusZ))
    }

    /// The axis that points up for files that are written: that which the file said, and heights of a map.
    #[must_use]
    pub fn up_to_write(&self) -> UpAxis {
        if self.up == UpAxis::Unknown && self.is_on_map { UpAxis::Z } else { self.up }
    }

    /// Metres of a unit of coordinates, above 0, where the file says so.
    #[must_use]
    pub fn metres(&self) -> Option<f64> {
        Some(self.metres_per_unit).filter(|metres| metres.is_finite() && *metres > 0.0)
    }

    /// Places of devices in the common coordinates, of each scan or of the cloud: as the file says, or that of the
    /// depth camera that saw all of it; `None` where no scan has one.
    #[must_use]
    pub fn scanners(&self) -> Option<Vec<Option<DVec3>>> {
        let places: Vec<_> = self.scans.iter().map(|scan| scan.scanner).collect();
        if places.iter().any(Option::is_some) {
            return Some(places);
        }
        let is_seen = self.camera_frame.is_some_and(|frame| frame.is_one_view);
        is_seen.then(|| vec![Some(DVec3::ZERO); places.len().max(1)])
    }
}
