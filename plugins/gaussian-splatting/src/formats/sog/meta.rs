//! What `meta.json` says: how many Gaussians, the names of the images, and what their numbers stand for.

use serde::Deserialize;
use surfelshop_api::prelude::{Error, Result};

/// Numbers of a codebook.
const CODES: usize = 256;

/// Bands of spherical harmonics by the pixels of an entry of the palette.
pub(super) const COEFFICIENTS: [usize; 4] = [0, 3, 8, 15];

/// Entries of the palette in a row of its image.
pub(super) const PER_ROW: usize = 64;

/// What the numbers 0 to 255 of a channel stand for.
pub(super) type Codes = [f32; CODES];

/// The file as it is. Version 1 has no `version`; bounds stand in the place of codebooks.
#[derive(Deserialize)]
struct Json {
    version: Option<u64>,
    count: Option<u64>,
    antialias: Option<bool>,
    means: Channels,
    scales: Channels,
    quats: Channels,
    sh0: Channels,
    #[serde(rename = "shN")]
    rest: Option<Channels>,
}

#[derive(Deserialize)]
struct Channels {
    #[serde(default)]
    files: Vec<String>,
    #[serde(default)]
    shape: Vec<u64>,
    mins: Option<Bounds>,
    maxs: Option<Bounds>,
    codebook: Option<Vec<Option<f64>>>,
    count: Option<u64>,
    bands: Option<u64>,
}

/// One number for all channels, or one for each.
#[derive(Deserialize)]
#[serde(untagged)]
enum Bounds {
    All(f64),
    Each(Vec<f64>),
}

impl Bounds {
    fn channel(&self, channel: usize) -> Option<f64> {
        match self {
            Self::All(bound) => Some(*bound),
            Self::Each(bounds) => bounds.get(channel).copied(),
        }
    }
}

/// What the opacity of an image is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Opacity {
    /// A share of 255.
    Share,
    /// A logit between two bounds.
    Logit([f32; 2]),
}

/// The palette of spherical harmonics beyond the constant one.
#[derive(Clone, Debug)]
pub(super) struct Palette {
    /// The bands; where the file does not say, the width of the image does.
    pub(super) bands: Option<usize>,
    /// The entries; where the file does not say, the image has as many as fit.
    pub(super) count: Option<usize>,
    pub(super) codes: Box<Codes>,
    /// Images of the entries and of which entry each Gaussian has.
    pub(super) files: [String; 2],
}

/// A scene.
#[derive(Clone, Debug)]
pub(super) struct Meta {
    pub(super) version: u64,
    pub(super) count: u64,
    pub(super) antialiased: bool,
    /// Bounds of the logarithms of positions, for each axis.
    pub(super) bounds: [[f64; 2]; 3],
    /// Images of the lower and the upper bytes.
    pub(super) means: [String; 2],
    /// Logarithms of sizes, for each axis.
    pub(super) scales: Box<[Codes; 3]>,
    pub(super) scales_file: String,
    pub(super) quats_file: String,
    /// The constant harmonic, for each colour.
    pub(super) colors: Box<[Codes; 3]>,
    pub(super) opacity: Opacity,
    pub(super) colors_file: String,
    pub(super) palette: Option<Palette>,
}

impl Meta {
    /// The scene of a file's bytes.
    pub(super) fn parse(bytes: &[u8]) -> Result<Self> {
        let json: Json = serde_json::from_slice(bytes).map_err(|error| {
            Error::new(format!("meta.json: expected what SOG has, found: {error}"))
        })?;
        let version = json.version.unwrap_or(1);
        if !(1..=2).contains(&version) {
            return Err(wrong("version", &format!("expected 1 or 2, found {version}")));
        }
        let count = json.count.or_else(|| json.means.shape.first().copied());
        let count =
            count.ok_or_else(|| wrong("count", "expected how many Gaussians, found none"))?;
        if count > u64::from(u32::MAX) {
            return Err(wrong("count", &format!("expected at most {}, found {count}", u32::MAX)));
        }
        let mut bounds = [[0.0; 2]; 3];
        for (axis, bounds) in bounds.iter_mut().enumerate() {
            *bounds = json.means.bounds("means", axis)?;
        }
        let (scales, colors) = (json.scales.codes("scales", 3)?, json.sh0.codes("sh0", 3)?);
        let opacity = match json.sh0.codebook {
            Some(_) => Opacity::Share,
            None => Opacity::Logit(json.sh0.bounds("sh0", 3)?.map(|bound| bound as f32)),
        };
        let palette = json.rest.as_ref().map(Palette::of).transpose()?.flatten();
        Ok(Self {
            version,
            count,
            antialiased: json.antialias.unwrap_or(false),
            bounds,
            means: json.means.files("means")?,
            scales: three(scales),
            scales_file: json.scales.file("scales")?,
            quats_file: json.quats.file("quats")?,
            colors: three(colors),
            opacity,
            colors_file: json.sh0.file("sh0")?,
            palette,
        })
    }
}

impl Palette {
    fn of(channels: &Channels) -> Result<Option<Self>> {
        if channels.bands == Some(0) {
            return Ok(None);
        }
        let bands = channels.bands.map(|bands| match bands {
            1..=3 => Ok(bands as usize),
            _ => Err(wrong("shN.bands", &format!("expected 0 to 3, found {bands}"))),
        });
        let codes = channels.codes("shN", 1)?;
        Ok(Some(Self {
            bands: bands.transpose()?,
            count: channels.count.map(|count| usize::try_from(count).unwrap_or(usize::MAX)),
            codes: Box::new(codes.first().copied().unwrap_or([0.0; CODES])),
            files: channels.files("shN")?,
        }))
    }
}

fn wrong(place: &str, line: &str) -> Error {
    Error::new(format!("meta.json: {place}: {line}"))
}

/// The first three of a list that has them.
fn three(codes: Vec<Codes>) -> Box<[Codes; 3]> {
    Box::new(std::array::from_fn(|i| codes.get(i).copied().unwrap_or([0.0; CODES])))
}

impl Channels {
    fn files<const N: usize>(&self, place: &str) -> Result<[String; N]> {
        let line = || format!("expected {N} names of images, found {}", self.files.len());
        let found = self.files.get(..N).and_then(|files| files.to_vec().try_into().ok());
        found.ok_or_else(|| wrong(&format!("{place}.files"), &line()))
    }

    fn file(&self, place: &str) -> Result<String> {
        let [file] = self.files(place)?;
        Ok(file)
    }

    /// The least and the most number of a channel.
    fn bounds(&self, place: &str, channel: usize) -> Result<[f64; 2]> {
        let of = |bounds: &Option<Bounds>| bounds.as_ref()?.channel(channel);
        let bounds = of(&self.mins).zip(of(&self.maxs));
        let bounds = bounds.ok_or_else(|| {
            wrong(
                place,
                &format!("expected a codebook, or mins and maxs of {}, found neither", channel + 1),
            )
        })?;
        Ok([bounds.0, bounds.1])
    }

    /// What numbers of so many channels stand for: the codebook's, the same for all, or those between bounds.
    fn codes(&self, place: &str, n: usize) -> Result<Vec<Codes>> {
        let between = |channel: usize| {
            let [least, most] = self.bounds(place, channel)?;
            Ok(std::array::from_fn(|i| (least + (most - least) * i as f64 / 255.0) as f32))
        };
        let Some(codebook) = &self.codebook else { return (0..n).map(between).collect() };
        let line = || format!("expected {CODES} numbers, found {}", codebook.len());
        let book: [Option<f64>; CODES] = codebook
            .as_slice()
            .try_into()
            .ok()
            .ok_or_else(|| wrong(&format!("{place}.codebook"), &line()))?;
        let number = |i: usize| book[i].unwrap_or_default();
        // Some writers left the first out, which is as far before the second as the mean step.
        let first = book[0].unwrap_or(number(1) + (number(1) - number(CODES - 1)) / 255.0);
        let codes = std::array::from_fn(|i| if i == 0 { first as f32 } else { number(i) as f32 });
        Ok(vec![codes; n])
    }
}
