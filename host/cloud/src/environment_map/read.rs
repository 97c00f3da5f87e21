//! Probes from files.

use super::Probe;
use super::error::{ProbeError, ProbeFault};
use super::limits::PIXELS_PER_BYTE;
use super::mapping::Mapping;
use super::picture::{Picture, check_size};
use crate::error::{listed, quoted};
use crate::{files, memory};
use exr::prelude::{ReadChannels as _, ReadLayers as _, ReadSpecificChannel as _};
use image::codecs::hdr::HdrDecoder;
use image::{ImageDecoder as _, ImageError};
use std::fs::File;
use std::io::{self, BufRead, BufReader, Seek as _};
use std::path::Path;

const RADIANCE: &str = "Radiance HDR";
const OPEN_EXR: &str = "OpenEXR";

/// Bytes that tell the format.
const MAGIC: usize = 64;

type Reader = BufReader<File>;

/// Reads a probe from a Radiance HDR or `OpenEXR` file, recognised by content; where no mapping is
/// given, its shape and corners tell it, as in [`Probe::from_picture`].
///
/// The exposure that a Radiance header states is undone. Of `OpenEXR` the first layer with channels
/// R, G and B is taken, or else the first with Y alone. Bytes after the last pixel are ignored.
///
/// # Errors
/// One line that names the file, what was expected and what was found.
pub fn read(path: impl AsRef<Path>, mapping: Option<Mapping>) -> Result<Probe, ProbeError> {
    let path = path.as_ref();
    let load = || {
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
        Probe::from_picture(name, picture(path)?, mapping)
    };
    load().map_err(|fault| ProbeError { path: path.to_owned(), fault })
}

pub(super) fn picture(path: &Path) -> Result<Picture, ProbeFault> {
    // Sizes are checked against the length, which a pipe or a device does not have.
    let (file, metadata) = files::open(path)?;
    let bytes = metadata.len();
    let mut reader = BufReader::with_capacity(1 << 16, file);
    let head = reader.fill_buf()?;
    let head = &head[..head.len().min(MAGIC)];
    if head.is_empty() {
        return Err(ProbeFault::Empty);
    }
    if head.starts_with(b"version https://git-lfs") {
        return Err(ProbeFault::LfsPointer);
    }
    if head.starts_with(b"#?RADIANCE") || head.starts_with(b"#?RGBE") {
        read_radiance(reader, bytes)
    } else if head.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        read_open_exr(reader, bytes)
    } else {
        Err(ProbeFault::UnknownFormat { found: format_of(head) })
    }
}

/// What a file that is no probe is, by its first bytes.
fn format_of(head: &[u8]) -> String {
    let known: [(&[u8], &str); 8] = [
        (b"\x89PNG", "PNG, whose pixels are no radiance"),
        (b"\xff\xd8\xff", "JPEG, whose pixels are no radiance"),
        (b"GIF8", "GIF, whose pixels are no radiance"),
        (b"BM", "BMP, whose pixels are no radiance"),
        (b"RIFF", "WebP, whose pixels are no radiance"),
        (b"II*\0", "TIFF"),
        (b"MM\0*", "TIFF"),
        (b"PF\n", "a portable float map"),
    ];
    let named = known.iter().find(|(magic, _)| head.starts_with(magic));
    named.map_or_else(|| quoted(head), |(_, name)| (*name).to_owned())
}

/// Checks a size that a header states before memory is taken for it.
fn plausible(width: u64, height: u64, bytes: u64) -> Result<(), ProbeFault> {
    check_size(width, height)?;
    if width * height > bytes.saturating_mul(PIXELS_PER_BYTE) {
        return Err(ProbeFault::Implausible { width, height, bytes });
    }
    // The picture as floats, and as much again while it is decoded.
    memory::ask(width * height * 24).map_err(|out| ProbeFault::Memory { width, height, out })
}

fn read_radiance(reader: Reader, bytes: u64) -> Result<Picture, ProbeFault> {
    // Not strict only so that `#?RGBE` is read, as other programs write it.
    let decoder = HdrDecoder::new_nonstrict(reader).map_err(|error| radiance(error, None))?;
    let (width, height) = decoder.dimensions();
    plausible(u64::from(width), u64::from(height), bytes)?;
    let exposure = decoder.metadata().exposure.filter(|e| e.is_finite() && *e > 0.0);
    let mut rgb = vec![[0.0f32; 3]; width as usize * height as usize];
    decoder
        .read_image(bytemuck::cast_slice_mut(&mut rgb))
        .map_err(|error| radiance(error, Some([width, height])))?;
    if let Some(exposure) = exposure {
        rgb.as_flattened_mut().iter_mut().for_each(|c| *c /= exposure);
    }
    Ok(Picture { width, height, rgb })
}

/// What the reader of Radiance files says.
fn radiance(error: ImageError, size: Option<[u32; 2]>) -> ProbeFault {
    match (error, size) {
        (ImageError::IoError(error), Some([width, height]))
            if error.kind() == io::ErrorKind::UnexpectedEof =>
        {
            ProbeFault::Truncated { format: RADIANCE, width, height }
        }
        (ImageError::IoError(error), _) if error.kind() != io::ErrorKind::UnexpectedEof => {
            ProbeFault::Io(error)
        }
        (error, _) => damaged(RADIANCE, &error.to_string()),
    }
}

fn damaged(format: &'static str, found: &str) -> ProbeFault {
    // Readers quote what they find, whatever that is.
    let shown = |c: char| if c.is_control() { '?' } else { c };
    let found: String = found.chars().map(|c| if c == '\n' { ' ' } else { shown(c) }).collect();
    ProbeFault::Damaged { format, found: found.split_whitespace().collect::<Vec<_>>().join(" ") }
}

/// Channels of a layer that are read.
#[derive(Clone, Copy)]
enum Channels {
    Rgb,
    Luminance,
}

fn read_open_exr(mut reader: Reader, bytes: u64) -> Result<Picture, ProbeFault> {
    let failed = |error| open_exr(error, None);
    let headers =
        exr::meta::MetaData::read_from_buffered(&mut reader, false).map_err(failed)?.headers;
    // All layers, as they are in memory for a moment where one of them is read.
    for header in &headers {
        plausible(header.layer_size.x() as u64, header.layer_size.y() as u64, bytes)?;
    }
    let names = |header: &exr::meta::header::Header| -> Vec<String> {
        header.channels.list.iter().map(|channel| channel.name.to_string()).collect()
    };
    let has = |names: &[String], all: &[&str]| all.iter().all(|n| names.iter().any(|m| m == n));
    let rgb = headers.iter().find(|h| !h.deep && has(&names(h), &["R", "G", "B"]));
    let luminance = || {
        headers.iter().find(|header| {
            let names = names(header);
            // With RY and BY it is a picture in colour, which Y alone would show in grey.
            !header.deep && has(&names, &["Y"]) && !has(&names, &["RY", "BY"])
        })
    };
    let (header, channels) = match rgb {
        Some(header) => (header, Channels::Rgb),
        None => match luminance() {
            Some(header) => (header, Channels::Luminance),
            None => {
                let all: Vec<String> = headers.iter().flat_map(names).collect();
                let found = listed(all.iter().map(String::as_str));
                return Err(ProbeFault::Channels { found });
            }
        },
    };
    check_whole(header)?;
    let size = [header.layer_size.x() as u32, header.layer_size.y() as u32];
    reader.rewind()?;
    let rgb = read_layer(reader, channels).map_err(|error| open_exr(error, Some(size)))?;
    Ok(Picture { width: size[0], height: size[1], rgb })
}

/// Checks that a layer has all pixels of the picture: a part of it does not tell its directions.
fn check_whole(header: &exr::meta::header::Header) -> Result<(), ProbeFault> {
    let display = header.shared_attributes.display_window;
    let place = header.own_attributes.layer_position;
    if display.position == place && display.size == header.layer_size {
        return Ok(());
    }
    let size = |size: exr::math::Vec2<usize>| format!("{} x {}", size.x(), size.y());
    let offset = place - display.position;
    Err(ProbeFault::Cropped {
        expected: size(display.size),
        found: format!("{} from {}, {}", size(header.layer_size), offset.x(), offset.y()),
    })
}

/// The texels of the first layer that has these channels.
fn read_layer(reader: Reader, channels: Channels) -> exr::error::Result<Vec<[f32; 3]>> {
    type Size = exr::math::Vec2<usize>;
    struct Texels(usize, Vec<[f32; 3]>);
    let texels = |size: Size| Texels(size.width(), vec![[0.0; 3]; size.area()]);
    let set = |texels: &mut Texels, at: Size, rgb: [f32; 3]| {
        let index = at.y() * texels.0 + at.x();
        if let Some(texel) = texels.1.get_mut(index) {
            *texel = rgb;
        }
    };
    let levels = exr::prelude::read().no_deep_data().largest_resolution_level();
    match channels {
        Channels::Rgb => {
            let layers = levels
                .specific_channels()
                .required("R")
                .required("G")
                .required("B")
                .collect_pixels(
                    move |size, _| texels(size),
                    move |texels, at, (r, g, b): (f32, f32, f32)| set(texels, at, [r, g, b]),
                )
                .first_valid_layer()
                .all_attributes();
            Ok(layers.from_buffered(reader)?.layer_data.channel_data.pixels.1)
        }
        Channels::Luminance => {
            let layers = levels
                .specific_channels()
                .required("Y")
                .collect_pixels(
                    move |size, _| texels(size),
                    move |texels, at, (y,): (f32,)| set(texels, at, [y; 3]),
                )
                .first_valid_layer()
                .all_attributes();
            Ok(layers.from_buffered(reader)?.layer_data.channel_data.pixels.1)
        }
    }
}

/// What the reader of `OpenEXR` files says; it tells missing bytes only by its words.
fn open_exr(error: exr::error::Error, size: Option<[u32; 2]>) -> ProbeFault {
    use exr::error::Error;
    match (error, size) {
        (Error::Io(error), _) => ProbeFault::Io(error),
        (Error::Invalid(found), Some([width, height])) if found.contains("missing bytes") => {
            ProbeFault::Truncated { format: OPEN_EXR, width, height }
        }
        (error, _) => damaged(OPEN_EXR, &error.to_string()),
    }
}
