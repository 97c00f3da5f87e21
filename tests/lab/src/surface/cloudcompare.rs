//! `CloudCompare`'s picture of a view, made without anybody at a screen.
//!
//! Its viewer opens a file seen from above, in parallel projection, framed by the box around all points. So the points
//! it gets are those of the view, projected already: x and y in pixels, and a depth that keeps what is in front in front.
//! It draws them on a screen of `Xvfb`, which keeps what it shows in a file.

use anyhow::{Context as _, ensure};
use image::{RgbaImage, imageops};
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use surfelshop_api::View;
use surfelshop_api::params::linear_to_srgb;
use surfelshop_cloud::Cloud;

/// The viewer of `CloudCompare`, which opens the files that it is called with.
const VIEWER: &str = "ccViewer";

/// What makes the system end a program when the one that started it has ended.
const LEASH: &str = "setpriv";

/// The programs that are needed, and the Debian packages that they are in.
const NEEDED: [[&str; 2]; 3] = [[VIEWER, "cloudcompare"], ["Xvfb", "xvfb"], [LEASH, "util-linux"]];

/// Width of the points, pixels: `CloudCompare`'s own choice, which is left as it is.
pub(super) const POINT_PX: u32 = 1;

/// The colour of the points that mark the corners, which no other point has.
const MARK: [u8; 3] = [255, 0, 255];

/// From the corners of the picture out to the marks, pixels.
const MARGIN: u32 = 8;

/// From the upper edge of the picture up to the middle of what the viewer draws on, where it draws a cross, pixels.
const BELOW_CROSS: u32 = 24;

/// What the viewer's window has around its picture, pixels. If another version has more, the picture is smaller and is
/// enlarged.
const AROUND: [u32; 2] = [46, 90];

/// How long a program may take to show what it is asked for.
const PATIENCE: Duration = Duration::from_secs(120);

/// How long a program may take to end when it is asked to.
const GRACE: Duration = Duration::from_secs(5);

/// Between two looks at the screen: what has not changed in the meantime is finished.
const PAUSE: Duration = Duration::from_millis(400);

/// Read by all of `CloudCompare`'s programs: all points are drawn, however many they are.
const SETTINGS: &str = "[OpenGL]\ncloudDecimation=false\n";

/// What is not installed and what to do about it, in one line; `None` where all is there.
pub(super) fn missing() -> Option<String> {
    let folders = std::env::var_os("PATH").unwrap_or_default();
    let is_there = |program: &str| {
        std::env::split_paths(&folders).any(|folder| folder.join(program).is_file())
    };
    let missing = || NEEDED.into_iter().filter(|[program, _]| !is_there(program));
    let of_all = |which: usize| missing().map(|both| both[which]).collect::<Vec<_>>();
    missing().next()?;
    let [programs, packages] = [of_all(0).join(", "), of_all(1).join(" ")];
    Some(format!(
        "no pictures of CloudCompare: {programs} not found; on Debian, `apt install {packages}`"
    ))
}

/// The picture that `CloudCompare` shows of a cloud's points from where a view is.
pub(super) fn picture(cloud: &Cloud, view: &View) -> anyhow::Result<RgbaImage> {
    let folder = tempfile::tempdir()?;
    let points = folder.path().join("points.ply");
    let frame = Frame::of(view.size_px);
    std::fs::write(&points, ply(&frame.points(cloud, view)))?;
    let settings = folder.path().join(".config");
    std::fs::create_dir(&settings)?;
    std::fs::write(settings.join("CCCorp.conf"), SETTINGS)?;
    let [width, height] = frame.window();
    let mut screen = Screen::start(folder.path(), [width, height])?;
    let size = [0, 0, width, height].map(|number| number.to_string());
    let mut arguments: Vec<&str> = vec![path_text(&points)?, "-WIN"];
    arguments.extend(size.iter().map(String::as_str));
    let display = [("DISPLAY", screen.display.as_str())];
    let mut viewer = Program::start(VIEWER, &arguments, &display, folder.path())?;
    let shown = screen.settled(&mut viewer);
    Ok(frame.cut(&shown?))
}

fn path_text(path: &Path) -> anyhow::Result<&str> {
    path.to_str().with_context(|| format!("{}: not a name in UTF-8", path.display()))
}

/// A point as `CloudCompare` gets it.
struct Vertex {
    at: [f64; 3],
    color: [u8; 3],
}

/// The picture in the coordinates of the points, and how it is found again on the screen.
struct Frame {
    /// Width and height of the picture.
    size: [u32; 2],
    /// Width and height from mark to mark, both included: the picture lies at the lower edge.
    marked: [u32; 2],
    /// Width and height of what the viewer draws on when it is opened: a point's pixel is then one of the screen's.
    side: u32,
    /// Depth of the box around the points, pixels.
    depth: f64,
}

impl Frame {
    fn of(size: [u32; 2]) -> Self {
        let marked = [size[0] + 2 * MARGIN, 2 * (MARGIN + size[1] + BELOW_CROSS)];
        // The viewer makes the diagonal of the box as long as its smaller side: even, so that the middle is between
        // pixels there, too, and long enough for the scale bar to be beside the picture.
        let [width, height] = marked.map(|pixels| f64::from(pixels - 1));
        let side = 2.0 * (0.55 * width.hypot(height)).ceil();
        let depth = (side * side - width * width - height * height).sqrt();
        Self { size, marked, side: side as u32, depth }
    }

    /// Width and height of the viewer's window.
    fn window(&self) -> [u32; 2] {
        AROUND.map(|around| self.side + around)
    }

    /// What a view shows of a cloud, and the marks.
    fn points(&self, cloud: &Cloud, view: &View) -> Vec<Vertex> {
        let view_from_offset = view.view_from_offset(cloud.origin());
        let clip_from_view = view.clip_from_view();
        let colors = colors(cloud, view);
        let mut seen = Vec::new();
        for (offset, color) in cloud.positions().iter().zip(colors) {
            let place = view_from_offset.transform_point3(offset.as_dvec3());
            let (clip, distance) = (clip_from_view * place.as_vec3().extend(1.0), -place.z);
            if distance < view.near || clip.x.abs() > clip.w || clip.y.abs() > clip.w {
                continue;
            }
            let inside = [clip.x, clip.y].map(|along| 0.5 + 0.5 * f64::from(along / clip.w));
            let [x, y] = [0, 1].map(|axis| inside[axis] * f64::from(self.size[axis]));
            seen.push(Vertex { at: [x, y, distance], color });
        }
        let nearest = seen.iter().map(|vertex| vertex.at[2]).fold(f64::INFINITY, f64::min);
        for Vertex { at: [_, _, z], .. } in &mut seen {
            // The viewer looks along -z. Of the inverse, what is flat in the view is flat in the box.
            *z = self.depth * nearest / *z;
        }
        seen.extend(self.marks());
        seen
    }

    /// The corners of the box: they are what frames the picture.
    fn marks(&self) -> impl Iterator<Item = Vertex> {
        // The middles of the pixels that are so far out.
        let first = 0.5 - f64::from(MARGIN);
        let ends = self.marked.map(|pixels| [first, first + f64::from(pixels - 1)]);
        let depth = self.depth;
        (0..8).map(move |corner| {
            let at = [ends[0][corner & 1], ends[1][corner >> 1 & 1], [0.0, depth][corner >> 2]];
            Vertex { at, color: MARK }
        })
    }

    /// The picture between the marks.
    fn cut(&self, shown: &Shown) -> RgbaImage {
        let [left, top, right, bottom] = shown.marks;
        let [width, height] = [right - left + 1, bottom - top + 1];
        let found = imageops::crop_imm(&shown.screen, left, top, width, height).to_image();
        let [wide, high] = self.marked;
        let whole = match [width, height] == [wide, high] {
            true => found,
            false => imageops::resize(&found, wide, high, imageops::FilterType::CatmullRom),
        };
        let [width, height] = self.size;
        imageops::crop_imm(&whole, MARGIN, high - MARGIN - height, width, height).to_image()
    }
}

/// The colours of a cloud's points, sRGB: those of its file, else `CloudCompare`'s usual ones for heights.
fn colors(cloud: &Cloud, view: &View) -> Vec<[u8; 3]> {
    let mut colors: Vec<[u8; 3]> = match cloud.linear_colors() {
        Some(linear) => linear.into_iter().map(|color| color.map(level)).collect(),
        None => by_height(cloud, view),
    };
    for color in colors.iter_mut().filter(|color| **color == MARK) {
        color[0] -= 1;
    }
    colors
}

/// The level of 8 bits of a linear value.
fn level(linear: f32) -> u8 {
    (linear_to_srgb(linear.clamp(0.0, 1.0)) * 255.0).round() as u8
}

/// From blue over green and yellow to red, from the lowest point to the highest.
fn by_height(cloud: &Cloud, view: &View) -> Vec<[u8; 3]> {
    const RAMP: [[f64; 3]; 4] =
        [[0.0, 0.0, 255.0], [0.0, 255.0, 0.0], [255.0, 255.0, 0.0], [255.0, 0.0, 0.0]];
    let height = |offset: &glam::Vec3| offset.as_dvec3().dot(view.camera.up);
    let heights = || cloud.positions().iter().map(height);
    let [low, high] =
        [heights().fold(f64::INFINITY, f64::min), heights().fold(-f64::INFINITY, f64::max)];
    let of_height = |height: f64| {
        let along = 3.0 * ((height - low) / (high - low).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        let first = (along as usize).min(2);
        let part = along - first as f64;
        std::array::from_fn(|channel| {
            let [from, to] = [RAMP[first][channel], RAMP[first + 1][channel]];
            (from + part * (to - from)).round() as u8
        })
    };
    heights().map(of_height).collect()
}

/// The points as a binary PLY file.
fn ply(points: &[Vertex]) -> Vec<u8> {
    let header = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\n\
         property float x\nproperty float y\nproperty float z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n",
        points.len()
    );
    let mut bytes = header.into_bytes();
    for Vertex { at, color } in points {
        bytes.extend(at.iter().flat_map(|number| (*number as f32).to_le_bytes()));
        bytes.extend(color);
    }
    bytes
}

/// A program that ends with what holds it.
struct Program {
    name: &'static str,
    child: Child,
    /// Where what it writes is.
    folder: PathBuf,
}

impl Program {
    /// Starts a program that knows nothing of the user's settings and screen. What it says is in files of the folder.
    fn start(
        name: &'static str,
        arguments: &[&str],
        environment: &[(&str, &str)],
        folder: &Path,
    ) -> anyhow::Result<Self> {
        let path = std::env::var_os("PATH").unwrap_or_default();
        let child = Command::new(LEASH)
            .args(["--pdeathsig", "TERM", name])
            .args(arguments)
            .env_clear()
            .env("PATH", path)
            .env("HOME", folder)
            .env("XDG_RUNTIME_DIR", folder)
            .env("LIBGL_ALWAYS_SOFTWARE", "1")
            .envs(environment.iter().copied())
            .stdin(Stdio::null())
            .stdout(File::create(folder.join(format!("{name}.out")))?)
            .stderr(File::create(folder.join(format!("{name}.err")))?)
            .spawn()
            .with_context(|| format!("{name}: cannot be started"))?;
        Ok(Self { name, child, folder: folder.to_owned() })
    }

    /// Whether it runs, so that its number is still its own.
    fn is_there(&mut self) -> bool {
        matches!(self.child.try_wait(), Ok(None))
    }

    /// An error where it has ended.
    fn check(&mut self) -> anyhow::Result<()> {
        let Some(status) = self.child.try_wait()? else { return Ok(()) };
        let said = std::fs::read(self.folder.join(format!("{}.err", self.name)))?;
        let said = String::from_utf8_lossy(&said);
        let last = said.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or_default();
        anyhow::bail!("{} ended before it showed a picture ({status}): {last}", self.name)
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        if self.is_there() {
            // The standard library can only end it at once, and a screen would leave its socket behind.
            let ask = format!("kill {}", self.child.id());
            drop(Command::new("sh").args(["-c", &ask]).stderr(Stdio::null()).status());
        }
        let asked = Instant::now();
        while self.is_there() && asked.elapsed() < GRACE {
            std::thread::sleep(Duration::from_millis(20));
        }
        drop(self.child.kill());
        drop(self.child.wait());
    }
}

/// A screen that nobody sees.
struct Screen {
    server: Program,
    /// As programs are told it: `:1`.
    display: String,
    /// What it shows, as it is.
    file: PathBuf,
}

/// What is on a screen.
#[derive(PartialEq)]
struct Shown {
    screen: RgbaImage,
    /// Left, upper, right and lower pixels of the marks.
    marks: [u32; 4],
}

impl Screen {
    fn start(folder: &Path, [width, height]: [u32; 2]) -> anyhow::Result<Self> {
        let size = format!("{width}x{height}x24");
        // It takes a number that is free and writes it.
        let arguments = [
            "-displayfd",
            "1",
            "-nolisten",
            "tcp",
            "-nocursor",
            "-screen",
            "0",
            &size,
            "-fbdir",
            path_text(folder)?,
        ];
        let mut server = Program::start("Xvfb", &arguments, &[], folder)?;
        let started = Instant::now();
        let number = loop {
            server.check()?;
            let said = std::fs::read_to_string(folder.join("Xvfb.out"))?;
            if let Some((number, _)) = said.split_once('\n') {
                break number.trim().to_owned();
            }
            ensure!(started.elapsed() < PATIENCE, "Xvfb: opens no screen");
            std::thread::sleep(Duration::from_millis(20));
        };
        Ok(Self { server, display: format!(":{number}"), file: folder.join("Xvfb_screen0") })
    }

    /// What is shown once all marks are there and nothing changes any more.
    fn settled(&mut self, viewer: &mut Program) -> anyhow::Result<Shown> {
        let started = Instant::now();
        let mut former = None;
        loop {
            std::thread::sleep(PAUSE);
            viewer.check()?;
            self.server.check()?;
            let screen = from_xwd(&std::fs::read(&self.file)?)?;
            let shown = marks(&screen).map(|marks| Shown { screen, marks });
            match shown {
                Some(shown) if former.as_ref() == Some(&shown) => return Ok(shown),
                shown => former = shown,
            }
            let waited = started.elapsed();
            ensure!(waited < PATIENCE, "{VIEWER}: shows no picture in {} s", waited.as_secs());
        }
    }
}

/// The box around the marks, where all four are on the screen.
fn marks(screen: &RgbaImage) -> Option<[u32; 4]> {
    let is_mark = |x: u32, y: u32| screen.get_pixel(x, y).0[..3] == MARK;
    let mut found: Option<[u32; 4]> = None;
    for (x, y, _) in screen.enumerate_pixels().filter(|(x, y, _)| is_mark(*x, *y)) {
        let [left, top, right, bottom] = found.unwrap_or([x, y, x, y]);
        found = Some([left.min(x), top.min(y), right.max(x), bottom.max(y)]);
    }
    let [left, top, right, bottom] = found?;
    let is_whole = right - left > 2 * MARGIN && bottom - top > 2 * MARGIN;
    let corners = [[left, top], [right, top], [left, bottom], [right, bottom]];
    found.filter(|_| is_whole && corners.iter().all(|[x, y]| is_mark(*x, *y)))
}

/// Reads the file that a screen is kept in: an X window dump of version 7, a header of numbers with the most significant
/// byte first, then pixels of four bytes: blue, green, red and nothing.
fn from_xwd(file: &[u8]) -> anyhow::Result<RgbaImage> {
    let number = |index: usize| {
        let bytes = file.get(4 * index..4 * index + 4).and_then(|bytes| bytes.try_into().ok());
        bytes.map(u32::from_be_bytes).context("the screen's file ends in its header")
    };
    let [header, version, width, height] = [number(0)?, number(1)?, number(4)?, number(5)?];
    let [order, bits, row, n_colors] = [number(7)?, number(11)?, number(12)?, number(19)?];
    ensure!(
        [version, order, bits] == [7, 0, 32] && row == 4 * width,
        "expected a screen of version 7 with 32 bits a pixel, the least significant byte first, found version \
         {version}, {bits} bits, order {order}"
    );
    let first = header as usize + 12 * n_colors as usize;
    let pixels = file.get(first..).unwrap_or_default();
    let pixels = pixels.chunks_exact(4).flat_map(|pixel| [pixel[2], pixel[1], pixel[0], 255]);
    let n_bytes = 4 * width as usize * height as usize;
    RgbaImage::from_raw(width, height, pixels.take(n_bytes).collect())
        .context("the screen's file is shorter than its picture")
}
