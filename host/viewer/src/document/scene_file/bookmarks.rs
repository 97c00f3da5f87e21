//! Remembered cameras: in a scene they stand in its `layout`, each with its name and a small picture.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use image::{ImageFormat, RgbaImage, imageops};
use std::io::Cursor;
use std::sync::Arc;
use surfelshop_api::{Camera, Projection};
use surfelshop_cloud::scene::Table;
use toml::Value as Toml;

/// Most remembered cameras: more than a list shows well.
pub(crate) const MOST_BOOKMARKS: usize = 64;

/// Width and height of a small picture, pixels.
pub(crate) const PICTURE: [u32; 2] = [96, 60];

/// Most characters of a small picture in a scene: more than its pixels take without compression.
const LONGEST: usize = 40_000;

const KEY: &str = "cameras";

/// A small picture: four levels a pixel, of [`PICTURE`].
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Thumbnail(Arc<Vec<u8>>);

impl Thumbnail {
    /// The middle of a picture, small; `None` where the picture is empty or not of this size.
    pub(crate) fn of(size: [u32; 2], levels: &[u8]) -> Option<Self> {
        let [width, height] = size;
        if width == 0 || height == 0 {
            return None;
        }
        let picture = RgbaImage::from_raw(width, height, levels.to_vec())?;
        let (across, down) = (width.max(1), height.max(1));
        let cut_height = (across * PICTURE[1] / PICTURE[0]).clamp(1, down);
        let cut_width = (cut_height * PICTURE[0] / PICTURE[1]).clamp(1, across);
        let (left, top) = ((width - cut_width) / 2, (height - cut_height) / 2);
        let cut = imageops::crop_imm(&picture, left, top, cut_width, cut_height).to_image();
        let small = imageops::thumbnail(&cut, PICTURE[0], PICTURE[1]);
        Some(Self(Arc::new(small.into_raw())))
    }

    /// The pixels.
    pub(crate) fn levels(&self) -> &[u8] {
        &self.0
    }

    fn text(&self) -> Option<String> {
        let picture = RgbaImage::from_raw(PICTURE[0], PICTURE[1], self.0.to_vec())?;
        let mut bytes = Cursor::new(Vec::new());
        // Two levels in each channel's last bits are not seen, and take a third of the characters.
        let coarse = image::DynamicImage::ImageRgba8(picture).into_rgb8();
        let coarse = image::RgbImage::from_fn(PICTURE[0], PICTURE[1], |x, y| {
            image::Rgb(coarse.get_pixel(x, y).0.map(|level| level & 0xf8))
        });
        coarse.write_to(&mut bytes, ImageFormat::Png).ok()?;
        Some(STANDARD.encode(bytes.get_ref()))
    }

    fn read(text: &str) -> Option<Self> {
        if text.len() > LONGEST {
            return None;
        }
        let bytes = STANDARD.decode(text).ok()?;
        let picture = image::load_from_memory_with_format(&bytes, ImageFormat::Png).ok()?;
        if [picture.width(), picture.height()] != PICTURE {
            return None;
        }
        Some(Self(Arc::new(picture.into_rgba8().into_raw())))
    }
}

/// A remembered camera.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Bookmark {
    pub(crate) name: String,
    pub(crate) camera: Camera,
    pub(crate) picture: Option<Thumbnail>,
}

/// The cameras of a layout; what is none is left out.
pub(super) fn read(layout: &Table) -> Vec<Bookmark> {
    let rows = layout.get(KEY).and_then(Toml::as_array).map(Vec::as_slice).unwrap_or_default();
    rows.iter().filter_map(bookmark).take(MOST_BOOKMARKS).collect()
}

fn bookmark(row: &Toml) -> Option<Bookmark> {
    let table = row.as_table()?;
    let camera: Camera = table.get("camera")?.clone().try_into().ok()?;
    let name = table.get("name").and_then(Toml::as_str).unwrap_or("camera").to_owned();
    let picture = table.get("picture").and_then(Toml::as_str).and_then(Thumbnail::read);
    can_see(&camera).then_some(Bookmark { name, camera, picture })
}

/// Whether a camera can be looked through.
fn can_see(camera: &Camera) -> bool {
    let lens = match camera.projection {
        Projection::Perspective { fov_y } => fov_y > 0.0 && fov_y < std::f64::consts::PI,
        Projection::Orthographic { height } => height > 0.0 && height.is_finite(),
    };
    let distance = camera.eye.distance(camera.target);
    lens && distance > 0.0
        && distance.is_finite()
        && camera.up.is_finite()
        && camera.view_from_world().is_finite()
}

/// Puts the cameras into a layout.
pub(super) fn write(layout: &mut Table, bookmarks: &[Bookmark]) {
    let rows: Vec<Toml> = bookmarks.iter().filter_map(row).collect();
    match rows.is_empty() {
        true => layout.remove(KEY),
        false => layout.insert(KEY.to_owned(), Toml::Array(rows)),
    };
}

fn row(bookmark: &Bookmark) -> Option<Toml> {
    let mut table = Table::new();
    table.insert("name".to_owned(), Toml::String(bookmark.name.clone()));
    table.insert("camera".to_owned(), Toml::try_from(bookmark.camera).ok()?);
    if let Some(text) = bookmark.picture.as_ref().and_then(Thumbnail::text) {
        table.insert("picture".to_owned(), Toml::String(text));
    }
    Some(Toml::Table(table))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn camera(projection: Projection) -> Camera {
        let (eye, target) = (DVec3::new(481_309.25, 3.5, -2.0), DVec3::new(481_300.0, 1e-3, 0.0));
        Camera { eye, target, up: DVec3::Z, projection }
    }

    #[test]
    fn cameras_come_back_with_names_and_pictures() {
        let size = [300, 200];
        let levels: Vec<u8> = (0..size[0] * size[1]).flat_map(|i| [i as u8, 90, 7, 255]).collect();
        let picture = Thumbnail::of(size, &levels);
        assert!(picture.is_some());
        let all =
            [Projection::Perspective { fov_y: 0.61 }, Projection::Orthographic { height: 3.0 }]
                .map(|projection| Bookmark {
                    name: "from the \"door\"".to_owned(),
                    camera: camera(projection),
                    picture: picture.clone(),
                });
        let mut layout = Table::new();
        write(&mut layout, &all);
        let text = layout.to_string();
        let again = read(&text.parse().unwrap());
        assert_eq!(again.len(), 2);
        for (again, first) in again.iter().zip(&all) {
            assert_eq!((&again.name, again.camera), (&first.name, first.camera));
            let [a, b] = [again, first].map(|one| one.picture.as_ref().unwrap().levels().to_vec());
            assert!(a.iter().zip(&b).all(|(a, b)| a.abs_diff(*b) < 8));
        }
        // Written again it is the same text.
        let mut other = Table::new();
        write(&mut other, &again);
        assert_eq!(other.to_string(), text);
        write(&mut layout, &[]);
        assert!(layout.is_empty());
    }

    #[test]
    fn what_is_no_camera_is_left_out() {
        let flat = Projection::Perspective { fov_y: 0.0 };
        let row = |camera: &Camera| {
            let toml = Toml::try_from(*camera).unwrap();
            Toml::Table(Table::from_iter([("camera".to_owned(), toml)]))
        };
        let good = camera(Projection::Perspective { fov_y: 1.0 });
        let blind = Camera { target: good.eye, ..good };
        let rows = vec![Toml::Integer(3), row(&camera(flat)), row(&blind), row(&good)];
        let layout = Table::from_iter([(KEY.to_owned(), Toml::Array(rows))]);
        let found = read(&layout);
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].camera, found[0].picture.as_ref()), (good, None));
        for text in ["", "no picture", &"A".repeat(LONGEST + 1)] {
            assert_eq!(Thumbnail::read(text), None);
        }
        assert_eq!(Thumbnail::of([4, 4], &[0; 3]), None);
        assert_eq!(Thumbnail::of([0, 4], &[]), None);
    }
}
