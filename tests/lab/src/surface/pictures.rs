//! Pictures of scans as surfaces and as points, of the same views, as the program renders them and as `CloudCompare`
//! shows them: one by one and side by side.

use super::cloudcompare;
use anyhow::{Context as _, ensure};
use image::{Rgba, RgbaImage, imageops};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;
use surfelshop_api::{Camera, Projection, View};
use surfelshop_cloud::{Cloud, ReadOptions, silent};
use surfelshop_image::{Image, text};
use surfelshop_session::input::formats::SessionFormats;
use surfelshop_session::options::PluginFiles;

/// What is rendered of each scan: the name that the picture ends with, the options, and what is over it where pictures
/// are side by side.
const LOOKS: [(&str, &[&str], Option<&str>); 3] = [
    ("surface", &[], Some("Surfelshop, as a surface")),
    ("points", &["--points", "2px"], Some("Surfelshop, points of 2 px")),
    ("planarity", &["--color-by", "planarity"], None),
];

/// Height of the line over pictures that are side by side, pixels.
const HEADING: u32 = 40;

/// A picture and what is over it.
type Titled = (String, RgbaImage);

/// Renders each scan from its first view, and from inside where one can stand there.
pub(super) fn run(folder: &str, scans: &[String]) -> anyhow::Result<()> {
    let program = std::env::current_exe()?.with_file_name("surfelshop");
    ensure!(program.exists(), "{}: missing; `cargo demo` builds it", program.display());
    std::fs::create_dir_all(folder).with_context(|| folder.to_owned())?;
    let missing = cloudcompare::missing();
    if let Some(missing) = &missing {
        println!("{missing}");
    }
    for scan in scans {
        let started = Instant::now();
        let pictures = Pictures { program: &program, folder: Path::new(folder), scan };
        pictures.write(missing.is_none())?;
        println!("{scan}: {:.0} s", started.elapsed().as_secs_f64());
    }
    Ok(())
}

/// The pictures of a scan.
struct Pictures<'a> {
    program: &'a Path,
    folder: &'a Path,
    scan: &'a str,
}

impl Pictures<'_> {
    /// Writes the pictures of all views.
    fn write(&self, with_cloudcompare: bool) -> anyhow::Result<()> {
        let cloud = if with_cloudcompare { self.cloud() } else { None };
        let outside = self.of_view("three-quarter", None, cloud.as_ref())?;
        self.of_view("inside", outside.as_ref(), cloud.as_ref())?;
        Ok(())
    }

    /// Writes the pictures of a view, which is returned, unless it is the one that there are pictures of.
    fn of_view(
        &self,
        camera: &str,
        known: Option<&View>,
        cloud: Option<&Cloud>,
    ) -> anyhow::Result<Option<View>> {
        let mut first: Option<View> = None;
        let mut beside = Vec::new();
        for (look, options, title) in LOOKS {
            let typed = match &first {
                // What is drawn smaller is framed more tightly: it has to be seen from the same place, too.
                Some(view) if camera != "inside" => placed(&view.camera),
                _ => camera.to_owned(),
            };
            let file = self.file(camera, look);
            let Some(view) = self.render(&typed, &file, options)? else { continue };
            if known.is_some_and(|known| known.camera == view.camera) {
                println!("{}: no place inside to stand at", self.scan);
                std::fs::remove_file(&file)?;
                return Ok(None);
            }
            println!("{}", file.display());
            if let Some(title) = title {
                beside.push((title.to_owned(), image::open(&file)?.into_rgba8()));
            }
            first = first.or(Some(view));
        }
        if let (Some(cloud), Some(view)) = (cloud, &first) {
            beside.extend(self.cloudcompare(cloud, view, camera)?);
        }
        if !beside.is_empty() {
            let file = self.file(camera, "side-by-side");
            side_by_side(&beside).save(&file)?;
            println!("{}", file.display());
        }
        Ok(first)
    }

    fn file(&self, camera: &str, look: &str) -> PathBuf {
        let name = Path::new(self.scan).file_stem().unwrap_or_default().to_string_lossy();
        self.folder.join(format!("{name}-{camera}-{look}.png"))
    }

    /// Lets the program render a picture and say from where; `None` where it cannot, which is said.
    fn render(&self, camera: &str, file: &Path, options: &[&str]) -> anyhow::Result<Option<View>> {
        let mut command = Command::new(self.program);
        command.args(["render", self.scan, "--size", "1200x800", "--camera", camera, "--json"]);
        let ended = command.args(options).arg("-o").arg(file).output()?;
        if !ended.status.success() {
            // Not everything has an inside, and not every scan is anywhere no surface.
            println!("{}", String::from_utf8_lossy(&ended.stderr).trim_end());
            return Ok(None);
        }
        let said: serde_json::Value = serde_json::from_slice(&ended.stdout)?;
        let view =
            said.pointer("/frame/view").context("`surfelshop render --json` names no view")?;
        Ok(Some(serde_json::from_value(view.clone())?))
    }

    /// The points of the scan where the program has them; `None` where it cannot be read, which is said.
    fn cloud(&self) -> Option<Cloud> {
        let formats = SessionFormats::new(&PluginFiles::default());
        // Points need no radii, and estimates take time.
        let options = ReadOptions { radius: Some(1.0), ..formats.reading(&silent) };
        match surfelshop_cloud::read(self.scan, &options) {
            Ok(loaded) => Some(loaded.cloud),
            Err(error) => {
                println!("no pictures of CloudCompare: {error}");
                None
            }
        }
    }

    /// Writes `CloudCompare`'s picture of a view; `None` where it shows none, which is said.
    fn cloudcompare(
        &self,
        cloud: &Cloud,
        view: &View,
        camera: &str,
    ) -> anyhow::Result<Option<Titled>> {
        let started = Instant::now();
        let picture = match cloudcompare::picture(cloud, view) {
            Ok(picture) => picture,
            Err(error) => {
                println!("{}, {camera}: no picture of CloudCompare: {error:#}", self.scan);
                return Ok(None);
            }
        };
        let file = self.file(camera, "cloudcompare");
        picture.save(&file)?;
        let colors = if cloud.linear_colors().is_some() { "" } else { ", coloured by height" };
        let title =
            format!("CloudCompare, points of {} px, its default{colors}", cloudcompare::POINT_PX);
        let seconds = started.elapsed().as_secs_f64();
        println!("{} ({title}; {seconds:.0} s)", file.display());
        Ok(Some((title, picture)))
    }
}

/// A camera as the program takes it in numbers.
fn placed(camera: &Camera) -> String {
    let three = |place: glam::DVec3| place.to_array().map(|number| number.to_string()).join(",");
    let [eye, target, up] = [camera.eye, camera.target, camera.up].map(three);
    match camera.projection {
        Projection::Perspective { fov_y } => {
            format!("{eye}; {target}; {up}; {}", fov_y.to_degrees())
        }
        Projection::Orthographic { .. } => format!("{eye}; {target}; {up}"),
    }
}

/// Pictures from left to right, each with its line of text above; behind what is transparent is what the program's
/// window has there.
fn side_by_side(pictures: &[Titled]) -> RgbaImage {
    const BEHIND: [[u8; 4]; 2] = [[66, 70, 76, 255], [32, 33, 35, 255]];
    let width = pictures.iter().map(|(_, picture)| picture.width()).sum();
    let height = pictures.iter().map(|(_, picture)| picture.height()).max().unwrap_or(0);
    let mut sheet = RgbaImage::new(width, height);
    imageops::vertical_gradient(&mut sheet, &Rgba(BEHIND[0]), &Rgba(BEHIND[1]));
    let mut headed = RgbaImage::new(width, HEADING + height);
    let mut left = 0;
    for (title, picture) in pictures {
        imageops::replace(&mut headed, &heading(title, picture.width()), left, 0);
        imageops::overlay(&mut sheet, picture, left, 0);
        left += i64::from(picture.width());
    }
    imageops::replace(&mut headed, &sheet, 0, i64::from(HEADING));
    headed
}

/// A line of white text on black.
fn heading(title: &str, width: u32) -> RgbaImage {
    let data = [0.0, 0.0, 0.0, 1.0].repeat((width * HEADING) as usize);
    let mut line = Image { width, height: HEADING, components: 4, data };
    text::Line::new(title, 24.0).draw(&mut line, [12.0, 28.0], [1.0; 3]);
    RgbaImage::from_fn(width, HEADING, |x, y| {
        let pixel = line.pixel(x, y);
        Rgba(std::array::from_fn(|channel| (pixel[channel] * 255.0).round() as u8))
    })
}
