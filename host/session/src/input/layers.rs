//! Files of layers: the edits of a cloud that is larger than memory, kept beside it.
//!
//! ```text
//! {"format": "surfelshop layer", "version": 1, "surfels": 500000000, "edits": [
//!   {"select": {"steps": [{"take": {"how": "add", "region": {"sphere": {"center": [0, 1, 0], "radius": 2}}}}]},
//!    "change": "delete"},
//!   {"select": {"steps": [{"take": {"how": "add", "region": {"box": [[0, 0, 0], [1, 1, 1]]}}}, "invert"]},
//!    "change": {"set": {"column": "classification", "values": [6]}}}]}
//! ```

use anyhow::{Context as _, ensure};
use serde::{Deserialize, Serialize};
use std::path::Path;
use surfelshop_cloud::files::write_whole;
use surfelshop_cloud::selection::EditLayer;

/// How files of layers end.
pub const ENDING: &str = "layer.json";

/// What the first key says.
const FORMAT: &str = "surfelshop layer";
/// The version that is written; others are refused.
const VERSION: u32 = 1;
/// Bytes of the largest file that is read: a selection by what is visible takes 400 kB at most.
const MOST_BYTES: u64 = 1 << 30;

#[derive(Serialize, Deserialize)]
struct LayerFile {
    format: String,
    version: u32,
    /// Surfels of the cloud that it belongs to.
    surfels: u64,
    edits: EditLayer,
}

/// Whether a path ends as files of layers do.
#[must_use]
pub fn is_layer(path: &Path) -> bool {
    path.to_string_lossy().to_lowercase().ends_with(&format!(".{ENDING}"))
}

/// Reads the layer of a cloud of `n_surfels`.
///
/// # Errors
/// Where it cannot be read, is none, or belongs to a cloud of another number of surfels.
pub fn read(path: &Path, n_surfels: u64) -> anyhow::Result<EditLayer> {
    let name = path.display();
    let length = std::fs::metadata(path).with_context(|| format!("{name}"))?.len();
    ensure!(
        length <= MOST_BYTES,
        "{name}: expected a layer of at most 1 GiB, found {length} bytes"
    );
    let text = std::fs::read_to_string(path).with_context(|| format!("{name}"))?;
    let file: LayerFile = serde_json::from_str(&text)
        .with_context(|| format!("{name}: expected a layer of edits"))?;
    let LayerFile { format, version, surfels, edits } = file;
    ensure!(format == FORMAT, "{name}: expected \"format\": \"{FORMAT}\", found \"{format}\"");
    ensure!(
        version == VERSION,
        "{name}: expected version {VERSION} of layers, found {version}; update Surfelshop"
    );
    ensure!(
        surfels == n_surfels,
        "{name}: expected the layer of a cloud of {n_surfels} surfels, found that of one of {surfels}; name the \
         pyramid that it was made for"
    );
    Ok(edits)
}

/// Writes the layer of a cloud of `n_surfels`.
///
/// # Errors
/// Where the system refuses, or a number is none.
pub fn write(path: &Path, n_surfels: u64, layer: &EditLayer) -> anyhow::Result<()> {
    let (format, edits) = (FORMAT.to_owned(), layer.clone());
    let file = LayerFile { format, version: VERSION, surfels: n_surfels, edits };
    let text = serde_json::to_string(&file)? + "\n";
    write_whole(path, text.as_bytes())
        .with_context(|| format!("{}: cannot be written", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec2, DVec3};
    use surfelshop_api::{Camera, Projection, View};
    use surfelshop_cloud::selection::{
        Combine, DepthPicture, HiddenOnes, LayerChange, Region, RegionSelection, RegionStep,
        ScreenRegion, ScreenShape,
    };
    use surfelshop_cloud::{Buffer, Cloud, Column};

    fn layer() -> EditLayer {
        let projection = Projection::Perspective { fov_y: 1.0 };
        let camera = Camera { eye: DVec3::Z, target: DVec3::ZERO, up: DVec3::Y, projection };
        let view = View { camera, size_px: [8, 6], near: 0.1, far: 10.0 };
        let line = [[1.0, 1.0], [6.0, 2.0], [3.0, 5.0]].map(DVec2::from_array);
        let shape = ScreenShape::Lasso(line.to_vec());
        let depth = DepthPicture::new([8, 6], &[1.0; 48], (&shape, view.size_px)).unwrap();
        let seen = ScreenRegion { view, shape, depth: Some(depth.coarse(4, 1.5)) };
        let steps = [
            Region::Box([DVec3::splat(-1.0), DVec3::splat(0.9)]),
            Region::Spheres { centers: vec![DVec3::X, DVec3::Y], radius: 0.5 },
            Region::Seen(Box::new(seen)),
        ];
        let steps = steps.map(|region| RegionStep::Take { how: Combine::Add, region });
        let select = RegionSelection { steps: steps.to_vec(), ..RegionSelection::default() };
        let set = LayerChange::Set { column: "class".to_owned(), values: vec![2.0] };
        EditLayer::default().with(select.clone(), set).with(select, LayerChange::Hide)
    }

    fn cloud() -> Cloud {
        let position = (0..90).map(|i| (0.37 * i as f32).sin()).collect();
        let position = Column::new("position", 3, Buffer::F32(position));
        Cloud::new(DVec3::ZERO, vec![position]).unwrap()
    }

    /// Invariant: a layer's file is read as it was written, and damage is a line or another edit, never a crash
    ///
    /// Costs 0.5 s.
    #[test]
    fn layers_are_read_as_they_were_written_and_damage_is_a_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.layer.json");
        write(&path, 30, &layer()).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let edited = |layer: &EditLayer| {
            let ball = Some((DVec3::ZERO, 2.0));
            let edited = layer.applied(cloud(), ball, HiddenOnes::LeftOut);
            edited.map(|cloud| cloud.len()).map_err(|error| error.to_string())
        };
        let read_again = read(&path, 30).unwrap();
        assert_eq!(edited(&read_again), edited(&layer()));
        assert!(edited(&layer()).unwrap() < 30);
        let line = format!("{:#}", read(&path, 31).unwrap_err());
        assert!(line.contains("a cloud of 31 surfels, found that of one of 30"), "{line}");
        let (mut n_read, mut n_refused) = (0, 0);
        for at in 0..text.len() {
            for byte in [b'9', b'-', b'"', b'e'] {
                let mut damaged = text.clone().into_bytes();
                damaged[at] = byte;
                std::fs::write(&path, damaged).unwrap();
                match read(&path, 30) {
                    Ok(layer) => {
                        n_read += 1;
                        let ball = (DVec3::ONE, 0.5);
                        let removes = layer.removes(ball, HiddenOnes::LeftOut);
                        assert!(layer.version(ball, |_| true) != 0 || !removes);
                        // Numbers that are too large are a line, too.
                        drop(edited(&layer));
                    }
                    Err(error) => {
                        n_refused += 1;
                        assert!(format!("{error:#}").contains("a.layer.json: "));
                    }
                }
            }
        }
        assert!(n_read > 100 && n_refused > 1000, "{n_read} and {n_refused}");
    }
}
