//! EXR files: linear 32-bit floats, several outputs in one file.

use crate::pictures::four_components;
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image as ExrImage, Layer, LayerAttributes,
    Text, WritableImage as _,
};
use std::io::Cursor;
use surfelshop_api::graph::Output;
use surfelshop_engine::Image;

/// The outputs as one EXR file.
///
/// Layers are told apart by the channels' names, `depth.Z`, which every reader of EXR understands
/// (files of several parts are newer). Colour is the layer without a name. As the format demands,
/// colour is multiplied by alpha. Data is stored without loss.
pub(crate) fn exr(images: &[&(Output, Image)]) -> anyhow::Result<Vec<u8>> {
    let Some((_, first)) = images.first().copied() else { anyhow::bail!("no output to write") };
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
