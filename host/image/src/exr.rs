//! EXR files: linear 32-bit floats, several outputs in one file.

use crate::outputs::four_components;
use crate::{FileError, Image};
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image as ExrImage, Layer, LayerAttributes,
    Text, WritableImage as _,
};
use std::io::Cursor;
use std::path::Path;
use surfelshop_api::graph::Output;

/// The outputs as one EXR file.
///
/// Layers are told apart by the channels' names, `depth.Z`, which every reader of EXR understands
/// (files of several parts are newer). Colour is the layer without a name. As the format demands,
/// colour is multiplied by alpha. Data is stored without loss.
///
/// # Errors
/// Where there is no output, or it cannot be encoded.
pub fn encode(images: &[&(Output, Image)]) -> Result<Vec<u8>, FileError> {
    let Some((_, first)) = images.first().copied() else { return Err(FileError::NoOutput) };
    let size = (first.width as usize, first.height as usize);
    let channels = images.iter().flat_map(|(output, image)| channels(output, image));
    let software = concat!("surfelshop ", env!("CARGO_PKG_VERSION"));
    let attributes = LayerAttributes {
        software_name: Text::new_or_none(software),
        ..LayerAttributes::default()
    };
    let layer = Layer::new(
        size,
        attributes,
        Encoding::SMALL_LOSSLESS,
        AnyChannels::sort(channels.collect()),
    );
    let mut bytes = Cursor::new(Vec::new());
    ExrImage::from_layer(layer).write().to_buffered(&mut bytes)?;
    Ok(bytes.into_inner())
}

/// Most pixels of a picture: 16384 on each side, the largest that can be drawn.
pub const MOST_PIXELS: u64 = 1 << 28;

/// Reads the colour of an EXR file of at most so many pixels: R, G and B of the layer without a name, with
/// straight alpha; A is 1 where there is none.
///
/// # Errors
/// Where the file cannot be read, has no such channels, or promises more pixels: its head is read
/// before there is memory for them.
pub fn read_color(path: &Path, most_pixels: u64) -> Result<Image, FileError> {
    let wrong = |what: String| FileError::Unreadable { path: path.to_owned(), what };
    let no_colors = |error: exr::error::Error| wrong(format!("it has no colours to read: {error}"));
    let head = exr::meta::MetaData::read_from_file(path, false).map_err(no_colors)?;
    let sizes = head.headers.iter().map(|header| header.layer_size);
    let n_pixels = sizes.map(|size| (size.width() as u64).saturating_mul(size.height() as u64));
    let n_pixels = n_pixels.max().unwrap_or(0);
    if n_pixels > most_pixels {
        return Err(wrong(format!("expected at most {most_pixels} pixels, found {n_pixels}")));
    }
    let read = exr::prelude::read_first_rgba_layer_from_file(
        path,
        |size, _| (size, vec![[0.0f32; 4]; size.width() * size.height()]),
        |(size, pixels): &mut (exr::prelude::Vec2<usize>, Vec<[f32; 4]>), at, (r, g, b, a)| {
            let (r, g, b, a): (f32, f32, f32, f32) = (r, g, b, a);
            pixels[at.y() * size.width() + at.x()] = [r, g, b, a];
        },
    );
    let image = read.map_err(no_colors)?;
    let (size, pixels) = image.layer_data.channel_data.pixels;
    let side = |n: usize| u32::try_from(n).map_err(|_error| wrong("it is too large".to_owned()));
    let straight = |[r, g, b, a]: [f32; 4]| match a > 0.0 && a != 1.0 {
        true => [r / a, g / a, b / a, a],
        false => [r, g, b, a],
    };
    let data = pixels.into_iter().flat_map(straight).collect();
    Ok(Image { width: side(size.width())?, height: side(size.height())?, components: 4, data })
}

/// The channels of one output.
fn channels(output: &Output, image: &Image) -> Vec<AnyChannel<FlatSamples>> {
    let rgba = four_components(output, image);
    let layer = output.name();
    let named = |name: &str| match output {
        Output::Color => name.to_owned(),
        _ => format!("{layer}.{name}"),
    };
    let values = |i: usize| rgba.data.iter().skip(i).step_by(4).copied().collect::<Vec<f32>>();
    let channel = |name: String, values| AnyChannel::new(name.as_str(), FlatSamples::F32(values));
    match output {
        Output::Color | Output::Debug(_) => {
            let alpha = values(3);
            let premultiplied = |i| values(i).iter().zip(&alpha).map(|(c, a)| c * a).collect();
            let mut channels: Vec<_> = ["R", "G", "B"]
                .iter()
                .enumerate()
                .map(|(i, name)| channel(named(name), premultiplied(i)))
                .collect();
            channels.push(channel(named("A"), alpha));
            channels
        }
        Output::Depth => vec![channel(named("Z"), values(0))],
        Output::Normal => ["X", "Y", "Z"]
            .iter()
            .enumerate()
            .map(|(i, name)| channel(named(name), values(i)))
            .collect(),
        Output::Albedo => ["R", "G", "B"]
            .iter()
            .enumerate()
            .map(|(i, name)| channel(named(name), values(i)))
            .collect(),
        Output::Ao => vec![channel(named("Y"), values(0))],
    }
}
