//! Values of options as they are typed: each reader says what it expected.

use crate::input::budget::LEAST_MEMORY;
use glam::DVec3;
use std::path::{Path, PathBuf};
use std::time::Duration;
use surfelshop_api::graph::Output;
use surfelshop_api::params::{ParamDecl, ParamKind, Value, linear_to_srgb};
use surfelshop_cloud::environment_map::Mapping;
use surfelshop_cloud::scene::Axis;
use surfelshop_cloud::scene::{
    ANTIALIAS, DEPTH_TOLERANCE, EYE_DOME_RADIUS, EYE_DOME_STRENGTH, EyeDomeLighting, EyeDomeUse,
    FIELD_OF_VIEW_DEG, LARGEST_RADIUS, LOW_PASS, NumberRange, PLANARITIES, RADIUS_SCALE, STOPS,
};
use surfelshop_image::display_transform::Background;

/// Width and height in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size(pub [u32; 2]);

impl Size {
    /// Reads `640x480`, or `512` for a square.
    pub fn parse(text: &str) -> Result<Self, String> {
        let (width, height) = text.split_once(['x', 'X']).unwrap_or((text, text));
        let side = |text: &str| text.trim().parse().ok().filter(|side| *side > 0);
        match (side(width), side(height)) {
            (Some(width), Some(height)) => Ok(Self([width, height])),
            _ => Err("expected width and height in pixels such as 640x480".to_owned()),
        }
    }
}

/// How a picture is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// What a screen shows, sRGB-encoded.
    Png,
    /// Linear floats in layers.
    Exr,
}

/// A picture to write.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OutputFile {
    /// The file.
    pub path: PathBuf,
    /// The format its ending names.
    pub format: Format,
}

impl OutputFile {
    /// Takes a path whose ending names a format.
    pub fn parse(text: &str) -> Result<Self, String> {
        let path = PathBuf::from(text);
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        let format = match ending.as_deref() {
            Some("png") => Format::Png,
            Some("exr") => Format::Exr,
            Some(other) => {
                return Err(format!("expected a name ending in .png or .exr, found .{other}"));
            }
            None => {
                return Err("expected a name ending in .png or .exr, found no ending".to_owned());
            }
        };
        Ok(Self { path, format })
    }

    /// The path.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

/// Takes the path of a cloud to write.
pub fn cloud_file(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match path.extension() {
        Some(_) => Ok(path),
        None => Err("expected a name that ends in .ply or that of another format, found no ending"
            .to_owned()),
    }
}

/// Takes the path of a pyramid to write.
pub fn pyramid_file(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match path.extension() {
        Some(ending) if ending.eq_ignore_ascii_case("surfels") => Ok(path),
        _ => Err(format!("expected a name that ends in .surfels, found {text}")),
    }
}

/// Reads a size of memory, such as `500MB`, `4GB` or `2GiB`; bytes.
pub fn memory(text: &str) -> Result<u64, String> {
    let expected = || format!("expected a size from 64MB on, such as 500MB or 4GB, found {text}");
    size_in_bytes(text).filter(|bytes| *bytes >= LEAST_MEMORY).ok_or_else(expected)
}

/// Reads the size of a file, such as `500kB` or `10MB`; bytes.
pub fn bytes(text: &str) -> Result<u64, String> {
    let expected = || format!("expected a size such as 500kB or 10MB, found {text}");
    size_in_bytes(text).filter(|bytes| *bytes > 0).ok_or_else(expected)
}

fn size_in_bytes(text: &str) -> Option<u64> {
    let digits = text.trim_end_matches(|letter: char| letter.is_ascii_alphabetic());
    let unit = match text[digits.len()..].to_ascii_lowercase().as_str() {
        "kb" | "k" => 1e3,
        "kib" => 1024.0,
        "mb" | "m" => 1e6,
        "gb" | "g" => 1e9,
        "tb" | "t" => 1e12,
        "mib" => 1024f64.powi(2),
        "gib" => 1024f64.powi(3),
        "tib" => 1024f64.powi(4),
        _ => return None,
    };
    let bytes = digits.trim().parse::<f64>().ok()? * unit;
    (0.0..1e18).contains(&bytes).then_some(bytes as u64)
}

/// Reads a box: smallest and largest coordinates, `X,Y,Z:X,Y,Z`.
pub fn crop_box(text: &str) -> Result<[DVec3; 2], String> {
    let expected =
        || format!("expected X,Y,Z:X,Y,Z, smallest and largest coordinates, found {text}");
    let corner = |text: &str| {
        let numbers: Option<Vec<f64>> =
            text.split(',').map(|number| number.trim().parse().ok()).collect();
        let numbers: [f64; 3] = numbers?.try_into().ok()?;
        Some(DVec3::from_array(numbers)).filter(|corner| corner.is_finite())
    };
    let (low, high) = text.split_once(':').ok_or_else(expected)?;
    let (low, high) = corner(low).zip(corner(high)).ok_or_else(expected)?;
    match (0..3).find(|&axis| low[axis] > high[axis]) {
        None => Ok([low, high]),
        Some(axis) => Err(format!(
            "{} runs from {} down to {}; put the smallest coordinates first, the largest behind the colon",
            ["x", "y", "z"][axis],
            low[axis],
            high[axis]
        )),
    }
}

/// Reads a number of threads.
pub fn threads(text: &str) -> Result<usize, String> {
    number(text, "a whole number from 0 to 1024", |n| {
        n.fract() == 0.0 && (0.0..=1024.0).contains(&n)
    })
    .map(|n| n as usize)
}

/// A limit on a metric.
#[derive(Clone, Debug, PartialEq)]
pub struct Limit {
    /// The metric's id.
    pub metric: String,
    /// The value.
    pub value: f64,
}

/// Reads `metric=value`.
pub fn limit(text: &str) -> Result<Limit, String> {
    let expected = "expected METRIC=VALUE, such as rmse=0.01";
    let (metric, value) = text.split_once('=').ok_or(expected)?;
    let value: f64 = value.trim().parse().map_err(|_error| expected)?;
    if metric.trim().is_empty() || !value.is_finite() {
        return Err(expected.to_owned());
    }
    Ok(Limit { metric: metric.trim().to_owned(), value })
}

/// Reads how often something is repeated.
pub fn repeats(text: &str) -> Result<u32, String> {
    number(text, "a whole number from 0 to 1000", |n| {
        n.fract() == 0.0 && (0.0..=1000.0).contains(&n)
    })
    .map(|n| n as u32)
}

/// Reads how often something is timed.
pub fn timed(text: &str) -> Result<u32, String> {
    number(text, "a whole number from 1 to 3600", |n| {
        n.fract() == 0.0 && (1.0..=3600.0).contains(&n)
    })
    .map(|n| n as u32)
}

/// Reads how many frames are timed.
pub fn frames(text: &str) -> Result<usize, String> {
    timed(text).map(|n| n as usize)
}

/// Reads the name of an output.
pub fn output(text: &str) -> Result<Output, String> {
    let name = if text == "colour" { "color" } else { text };
    let expected = "expected color, depth, normal, albedo, ao or debug.NAME";
    Output::from_name(name).ok_or_else(|| expected.to_owned())
}

/// Reads how a probe's picture shows directions.
pub fn mapping(text: &str) -> Result<Mapping, String> {
    let names = Mapping::ALL.map(Mapping::name).join(", ");
    Mapping::from_name(text).ok_or_else(|| format!("expected one of {names}"))
}

/// Reads an axis of the world.
pub fn axis(text: &str) -> Result<Axis, String> {
    Axis::from_name(text).ok_or_else(|| "expected one of x, -x, y, -y, z, -z".to_owned())
}

/// Reads an angle to turn by, degrees.
pub fn turn(text: &str) -> Result<f64, String> {
    number(text, "an angle in degrees from -1e6 to 1e6", |n| n.abs() <= 1e6)
}

/// Reads numbers separated by commas, all finite.
pub fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let mut numbers = [0.0; N];
    let mut parts = text.split(',');
    for number in &mut numbers {
        *number = parts.next()?.trim().parse().ok().filter(|number: &f64| number.is_finite())?;
    }
    parts.next().is_none().then_some(numbers)
}

/// Farthest place on any axis, as in scenes: beyond it squares of distances are no numbers in single precision's
/// range.
const FARTHEST: f64 = 1e37;

/// Reads a place or a direction; `None` where it is not three numbers.
pub fn vector(text: &str) -> Option<Result<DVec3, String>> {
    let found = DVec3::from(numbers::<3>(text)?);
    Some(match found.abs().max_element() <= FARTHEST {
        true => Ok(found),
        false => Err(format!("expected three numbers from -1e37 to 1e37, found `{}`", text.trim())),
    })
}

/// What stands behind the cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Backdrop(pub Background);

impl Backdrop {
    /// Reads a name or a colour, or two with a colon between them for the upper and the lower edge.
    pub fn parse(text: &str) -> Result<Self, String> {
        if text == "transparent" {
            return Ok(Self(Background::Transparent));
        }
        Ok(Self(match text.split_once(':') {
            Some((top, bottom)) => {
                Background::Gradient { top: encoded_color(top)?, bottom: encoded_color(bottom)? }
            }
            None => Background::Color(encoded_color(text)?),
        }))
    }
}

/// The sRGB-encoded colour of a name, or of what parameters of renderers are typed as.
fn encoded_color(text: &str) -> Result<[f32; 3], String> {
    Ok(match text {
        "white" => [1.0; 3],
        "black" => [0.0; 3],
        "gray" | "grey" => [0.5; 3],
        _ => {
            let color = ParamDecl { kind: ParamKind::Color, ..ParamDecl::default() };
            match color.parse(text) {
                Ok(Value::Color(linear)) => linear.map(|c| linear_to_srgb(c.clamp(0.0, 1.0))),
                _ => {
                    let expected = color.expectation();
                    return Err(format!(
                        "expected transparent, white, black, gray or {expected}, or two colours as TOP:BOTTOM, \
                         found `{text}`"
                    ));
                }
            }
        }
    })
}

/// A parameter's value as typed, not yet checked against its declaration.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    /// The renderer it is meant for, where that was said.
    pub unit: Option<String>,
    /// The parameter's id.
    pub id: String,
    /// The value.
    pub value: String,
}

impl Setting {
    /// Reads `id=value` or `RENDERER:id=value`.
    pub fn parse(text: &str) -> Result<Self, String> {
        let expected = || "expected id=value or RENDERER:id=value".to_owned();
        let (name, value) = text.split_once('=').ok_or_else(expected)?;
        let (unit, id) = match name.rsplit_once(':') {
            Some((unit, id)) => (Some(unit.trim().to_owned()), id.trim()),
            None => (None, name.trim()),
        };
        if id.is_empty() || unit.as_ref().is_some_and(String::is_empty) {
            return Err(expected());
        }
        Ok(Self { unit, id: id.to_owned(), value: value.trim().to_owned() })
    }
}

/// A number inside a range.
fn number(text: &str, expected: &str, allowed: impl Fn(f64) -> bool) -> Result<f64, String> {
    let number = text.trim().parse().ok().filter(|number| allowed(*number));
    number.ok_or_else(|| format!("expected {expected}"))
}

/// A number of a range that scene files and sliders have, too.
fn within(text: &str, range: &NumberRange) -> Result<f64, String> {
    number(text, &range.expected(), |n| range.contains(n))
}

/// Reads an exposure.
pub fn stops(text: &str) -> Result<f32, String> {
    within(text, &STOPS).map(|n| n as f32)
}

/// Reads a factor on radii.
pub fn factor(text: &str) -> Result<f32, String> {
    within(text, &RADIUS_SCALE).map(|n| n as f32)
}

/// Reads a depth tolerance.
pub fn depth_tolerance(text: &str) -> Result<f32, String> {
    within(text, &DEPTH_TOLERANCE).map(|n| n as f32)
}

/// Reads the radius of the screen-space low-pass.
pub fn low_pass(text: &str) -> Result<f32, String> {
    within(text, &LOW_PASS).map(|n| n as f32)
}

/// Reads a planarity.
pub fn planarity(text: &str) -> Result<f32, String> {
    within(text, &PLANARITIES).map(|n| n as f32)
}

/// Reads the largest radius of discs.
pub fn largest_radius(text: &str) -> Result<f32, String> {
    within(text, &LARGEST_RADIUS).map(|n| n as f32)
}

/// Reads of how many frames an antialiased picture is the mean.
pub fn antialias(text: &str) -> Result<u32, String> {
    let is_allowed = |n: f64| n.fract() == 0.0 && ANTIALIAS.contains(n);
    number(text, &ANTIALIAS.expected(), is_allowed).map(|n| n as u32)
}

/// Reads `on`, `off`, `automatic`, or a strength and perhaps a radius: `0.5,2`.
pub fn eye_dome(text: &str) -> Result<EyeDomeLighting, String> {
    let usual = EyeDomeLighting::default();
    if let Some(when) = EyeDomeUse::named(text.trim()) {
        return Ok(EyeDomeLighting { when, ..usual });
    }
    let (strength, radius) = match text.split_once(',') {
        Some((strength, radius)) => (strength, Some(radius)),
        None => (text, None),
    };
    let strength = within(strength, &EYE_DOME_STRENGTH)
        .map_err(|reason| format!("expected on, off, automatic or a strength; {reason}"))?;
    let radius = radius.map(|radius| within(radius, &EYE_DOME_RADIUS)).transpose()?;
    Ok(EyeDomeLighting {
        when: EyeDomeUse::On,
        strength: strength as f32,
        radius: radius.map_or(usual.radius, |radius| radius as f32),
    })
}

/// Reads the radius of merged surfels.
pub fn detail(text: &str) -> Result<f32, String> {
    number(text, "a number of pixels from 0 to 64", |n| (0.0..=64.0).contains(&n)).map(|n| n as f32)
}

/// Reads a time to wait.
pub fn seconds(text: &str) -> Result<Duration, String> {
    number(text, "a number of seconds above 0, at most 86400", |n| n > 1e-3 && n <= 86400.0)
        .map(Duration::from_secs_f64)
}

/// Reads a field of view in degrees.
pub fn field_of_view(text: &str) -> Result<f64, String> {
    within(text, &FIELD_OF_VIEW_DEG)
}

/// Reads an enlargement.
pub fn zoom(text: &str) -> Result<f64, String> {
    number(text, "a factor from 0.001 to 1000000", |n| (1e-3..=1e6).contains(&n))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_two_numbers_or_a_square() {
        assert_eq!(Size::parse("640x480"), Ok(Size([640, 480])));
        assert_eq!(Size::parse("512"), Ok(Size([512, 512])));
        for wrong in ["", "x", "0x5", "5x0", "-5x5", "5x", "5x5x5", "1.5x2", "99999999999x1"] {
            assert!(Size::parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn endings_name_the_format_in_any_case() {
        assert_eq!(OutputFile::parse("a.b/c.PNG").unwrap().format, Format::Png);
        assert_eq!(OutputFile::parse("c.exr").unwrap().format, Format::Exr);
        assert!(OutputFile::parse("c.jpg").unwrap_err().contains("found .jpg"));
        assert!(OutputFile::parse("png").unwrap_err().contains("no ending"));
    }

    #[test]
    fn hexadecimal_backgrounds_stay_what_they_are() {
        let Backdrop(Background::Color(color)) = Backdrop::parse("#336699").unwrap() else {
            panic!("not a colour");
        };
        for (found, expected) in color.into_iter().zip([0.2, 0.4, 0.6]) {
            // Decoding and encoding sRGB in f32.
            assert!((found - expected).abs() < 1e-6);
        }
        assert_eq!(Backdrop::parse("transparent").unwrap().0, Background::Transparent);
        assert!(Backdrop::parse("mauve").unwrap_err().contains("#rrggbb"));
        let (top, bottom) = ([1.0; 3], [0.5; 3]);
        let gradient = Background::Gradient { top, bottom };
        assert_eq!(Backdrop::parse("white:gray").unwrap().0, gradient);
        assert!(Backdrop::parse("white:mauve").unwrap_err().contains("found `mauve`"));
    }

    #[test]
    fn settings_may_name_their_renderer() {
        let plain = Setting::parse("gain = 2").unwrap();
        assert_eq!((plain.unit, plain.id.as_str(), plain.value.as_str()), (None, "gain", "2"));
        let qualified = Setting::parse("org.example/flat:path=C:/a=b").unwrap();
        assert_eq!(qualified.unit.as_deref(), Some("org.example/flat"));
        assert_eq!((qualified.id.as_str(), qualified.value.as_str()), ("path", "C:/a=b"));
        for wrong in ["gain", "=2", ":gain=2", "flat:=2"] {
            assert!(Setting::parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn numbers_outside_their_range_are_refused() {
        assert!(stops("-3").is_ok() && stops("nan").is_err() && stops("1e9").is_err());
        assert!(factor("0.5").is_ok() && factor("0").is_err() && factor("inf").is_err());
        assert!(field_of_view("35").is_ok() && field_of_view("180").is_err());
        assert!(depth_tolerance("0").is_ok() && depth_tolerance("17").is_err());
        assert!(zoom("2").is_ok() && zoom("-2").is_err());
    }
}
