//! Pyramids: opened, chosen from and read.

use crate::assert_one_line;
use crate::cloud::with_file;
use glam::DVec3;
use surfelshop_api::{Camera, Projection, SurfaceSettings, View};
use surfelshop_cloud::Transform;
use surfelshop_pyramid::{Cut, CutView, Pyramid};

/// Opens a pyramid and reads some of its nodes, with the checksums as they are and with right ones: behind wrong ones
/// nothing is looked at.
pub fn pyramid(bytes: &[u8]) {
    run(bytes);
    if let Some(sealed) = sealed(bytes) {
        run(&sealed);
    }
}

fn run(bytes: &[u8]) {
    with_file(bytes, "surfels", |path| {
        let pyramid = match Pyramid::open(path) {
            Ok(pyramid) => pyramid,
            Err(error) => return assert_one_line(&error.to_string()),
        };
        let camera = Camera {
            eye: DVec3::new(1.0, 2.0, 3.0),
            target: DVec3::ZERO,
            up: DVec3::Y,
            projection: Projection::Perspective { fov_y: 1.0 },
        };
        let view = View { camera, size_px: [64, 48], near: 0.01, far: 100.0 };
        let (surface, transform) = (SurfaceSettings::default(), Transform::default());
        for detail in [0.0, 1.0, 100.0] {
            let view = CutView::new(&view, &surface, &transform, detail);
            let cut = Cut::of(
                pyramid.nodes(),
                &view,
                1 << 20,
                (|node| node % 3 != 1, |node| node % 7 != 6),
            );
            assert!(cut.nodes.len() <= pyramid.nodes().len());
        }
        for node in pyramid.overview(1 << 16).into_iter().take(4) {
            match pyramid.read(node) {
                Ok(cloud) => {
                    assert_eq!(cloud.len(), pyramid.nodes()[node as usize].n_surfels as usize)
                }
                Err(error) => assert_one_line(&error.to_string()),
            }
        }
        if let Err(error) = pyramid.overview_cloud(1 << 12) {
            assert_one_line(&error.to_string());
        }
    });
}

fn number<const N: usize>(bytes: &[u8], at: usize) -> Option<u64> {
    let found: [u8; N] = bytes.get(at..at + N)?.try_into().ok()?;
    Some(found.iter().rev().fold(0, |number, byte| number << 8 | u64::from(*byte)))
}

/// The same file with right checksums, as far as its parts are within it.
fn sealed(bytes: &[u8]) -> Option<Vec<u8>> {
    let mut sealed = bytes.to_vec();
    let part = |bytes: &[u8], at: usize| {
        let start = usize::try_from(number::<8>(bytes, at)?).ok()?;
        let length = usize::try_from(number::<8>(bytes, at + 8)?).ok()?;
        Some(start..start.checked_add(length).filter(|end| *end <= bytes.len())?)
    };
    let (directory, table) = (part(bytes, 16)?, part(bytes, 40)?);
    let n_nodes = usize::try_from(number::<4>(bytes, 12)?).ok()?;
    let record = table.len().checked_div(n_nodes)?;
    for start in table.clone().step_by(record.max(1)) {
        for column in (start + 120..(start + record).min(table.end)).step_by(24) {
            let (Some(at), Some(n)) = (number::<8>(bytes, column), number::<4>(bytes, column + 8))
            else {
                continue;
            };
            let range = usize::try_from(at).ok().zip(usize::try_from(n).ok());
            let stored = range.and_then(|(at, n)| bytes.get(at..at.checked_add(n)?));
            if let (Some(stored), Some(place)) = (stored, sealed.get_mut(column + 16..column + 20))
            {
                place.copy_from_slice(&crc32fast::hash(stored).to_le_bytes());
            }
        }
    }
    for (at, range) in [(32, directory), (56, table)] {
        let crc = crc32fast::hash(sealed.get(range)?);
        sealed.get_mut(at..at + 4)?.copy_from_slice(&crc.to_le_bytes());
    }
    let crc = crc32fast::hash(sealed.get(..60)?);
    sealed.get_mut(60..64)?.copy_from_slice(&crc.to_le_bytes());
    Some(sealed)
}
