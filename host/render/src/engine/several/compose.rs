//! One picture of several renderers': pixel by pixel the nearest surfel says whose picture shows, and what renderers
//! draw themselves lies over it by its coverage.

use rayon::prelude::*;
use surfelshop_api::graph::Output;
use surfelshop_api::params::{linear_to_srgb, srgb_to_linear};
use surfelshop_image::Image;

/// What one renderer drew.
#[derive(Default)]
pub(super) struct Layer {
    /// For each cloud whether it is this renderer's.
    pub(super) own: Vec<bool>,
    /// Whether its graph draws clouds itself, over what the surface shows.
    pub(super) lies_over: bool,
    /// Whether the host's surface hides what it draws, splat by splat.
    pub(super) is_hidden_by_surface: bool,
    /// Whether its colours go over others' as sRGB-encoded numbers.
    pub(super) is_encoded: bool,
    pub(super) pictures: Vec<(Output, Image)>,
    /// Distances by which its pixels are ordered among those of other renderers that draw clouds themselves.
    pub(super) order: Option<Image>,
}

impl Layer {
    fn picture(&self, output: &Output) -> Option<&Image> {
        self.pictures.iter().find(|(other, _)| other == output).map(|(_, image)| image)
    }

    fn owns(&self, object: usize) -> bool {
        self.own.get(object).copied().unwrap_or(false)
    }
}

/// What the host knows of the surface.
pub(super) struct HostPictures {
    /// Distance of the nearest surfel and the number of its cloud; all 0 where nothing is.
    pub(super) owner: Image,
    /// Its values, for clouds whose renderer has none of its own.
    pub(super) others: Vec<(Output, Image)>,
}

/// A pixel with four components; missing ones are 0, and coverage is told from the first.
fn texel(image: &Image, at: usize) -> [f32; 4] {
    let n = image.components as usize;
    let mut found = [0.0; 4];
    let Some(pixel) = image.data.get(at * n..(at + 1) * n) else { return found };
    for (value, own) in found.iter_mut().zip(pixel) {
        *value = *own;
    }
    if n < 4 {
        found[3] = if pixel.iter().any(|value| *value != 0.0) { 1.0 } else { 0.0 };
    }
    found
}

/// The surface at a pixel.
struct SurfacePixel {
    at: usize,
    /// Distance of the nearest surfel; 0 where nothing is.
    depth: f32,
    /// The layer whose cloud that is.
    owner: Option<usize>,
}

impl SurfacePixel {
    fn new(host: &HostPictures, layers: &[Layer], at: usize) -> Self {
        let [depth, object, ..] = texel(&host.owner, at);
        let is_there = depth > 0.0;
        let owner = layers.iter().position(|layer| is_there && layer.owns(object as usize));
        Self { at, depth, owner }
    }
}

/// The picture of an output.
pub(super) fn composed(output: &Output, host: &HostPictures, layers: &[Layer]) -> Image {
    let (width, height) = (host.owner.width, host.owner.height);
    let mut data = vec![0.0; 4 * width as usize * height as usize];
    let rows = data.par_chunks_exact_mut((4 * width as usize).max(1)).enumerate();
    rows.for_each(|(row, pixels)| {
        for (column, pixel) in pixels.chunks_exact_mut(4).enumerate() {
            let seen = SurfacePixel::new(host, layers, row * width as usize + column);
            let value = match output {
                Output::Color => color(&seen, layers),
                _ => nearest(output, &seen, host, layers),
            };
            pixel.copy_from_slice(&value);
        }
    });
    Image { width, height, components: 4, data }
}

/// The distance of what is seen of a graph's own clouds and of the surface beside them: of the surface where it is
/// nearer, or where what the graph draws hides less than half of it.
pub(super) fn with_surface(own: &mut Image, surface: &Image) {
    let n = own.components as usize;
    for (at, pixel) in own.data.chunks_exact_mut(n.max(1)).enumerate() {
        let [behind, ..] = texel(surface, at);
        if let Some(own) = pixel.first_mut()
            && behind > 0.0
            && (*own <= 0.0 || behind < *own)
        {
            *own = behind;
        }
    }
}

/// The colour of what the surface shows, and over it that of renderers that draw clouds themselves, from far to near.
fn color(seen: &SurfacePixel, layers: &[Layer]) -> [f32; 4] {
    let of = |layer: &Layer| {
        layer.picture(&Output::Color).map_or([0.0; 4], |image| texel(image, seen.at))
    };
    let beneath = match seen.owner.and_then(|owner| layers.get(owner)) {
        Some(owner) if owner.lies_over => [0.0; 4],
        Some(owner) => of(owner),
        // Beside the surface a renderer may show what it likes; what covers most is seen, of equal ones the first.
        None => {
            let surfaces = layers.iter().filter(|layer| !layer.lies_over).map(of);
            surfaces.fold([0.0; 4], |most, next| if next[3] > most[3] { next } else { most })
        }
    };
    let mut over: Vec<(f32, usize)> = layers
        .iter()
        .enumerate()
        .filter(|(_, layer)| layer.lies_over && !is_behind(layer, seen))
        .map(|(i, layer)| {
            let distance = layer.order.as_ref().map_or(0.0, |order| texel(order, seen.at)[0]);
            // One that has surfels of its own there lies beneath: its picture is of both together.
            (if seen.owner == Some(i) { f32::INFINITY } else { distance }, i)
        })
        .collect();
    over.sort_by(|a, b| b.0.total_cmp(&a.0).then(b.1.cmp(&a.1)));
    over.into_iter().fold(beneath, |beneath, (_, i)| match layers.get(i) {
        Some(layer) => over_others(of(layer), beneath, layer.is_encoded),
        None => beneath,
    })
}

/// Whether a renderer's pixel lies behind the surface, where the surface has not hidden it already.
fn is_behind(layer: &Layer, seen: &SurfacePixel) -> bool {
    let distance = layer.picture(&Output::Depth).map_or(0.0, |image| texel(image, seen.at)[0]);
    !layer.is_hidden_by_surface && seen.depth > 0.0 && distance > seen.depth
}

/// Premultiplied colour over another.
fn over_others(front: [f32; 4], back: [f32; 4], is_encoded: bool) -> [f32; 4] {
    let coverage = front[3].clamp(0.0, 1.0);
    let left = 1.0 - coverage;
    // Where one alone is there it stays as it is, to the bit.
    if front.iter().all(|value| *value == 0.0) {
        return back;
    }
    if back.iter().all(|value| *value == 0.0) {
        return front;
    }
    let mut shown = [0.0; 4];
    for ((shown, front), back) in shown.iter_mut().zip(&front[..3]).zip(&back[..3]) {
        *shown = match is_encoded {
            true => srgb_to_linear(
                linear_to_srgb(front.max(0.0)) + left * linear_to_srgb(back.max(0.0)),
            ),
            false => front + left * back,
        };
    }
    shown[3] = coverage + left * back[3];
    shown
}

/// The value of what is nearest: of the surface, or of what lies before it and hides at least half of it.
fn nearest(
    output: &Output,
    seen: &SurfacePixel,
    host: &HostPictures,
    layers: &[Layer],
) -> [f32; 4] {
    let of_host = || {
        let found = host.others.iter().find(|(other, _)| other == output);
        found.map_or([0.0; 4], |(_, image)| texel(image, seen.at))
    };
    let owner = seen.owner.and_then(|owner| layers.get(owner));
    let mut shown = match owner {
        Some(owner) if !owner.lies_over => match owner.picture(output) {
            Some(own) => texel(own, seen.at),
            None => [0.0; 4],
        },
        Some(_) => of_host(),
        None => [0.0; 4],
    };
    let mut distance = if owner.is_some() { seen.depth } else { f32::INFINITY };
    for layer in layers.iter().filter(|layer| layer.lies_over && !is_behind(layer, seen)) {
        let own = layer.picture(&Output::Depth).map_or(0.0, |image| texel(image, seen.at)[0]);
        let Some(picture) = layer.picture(output) else { continue };
        if own > 0.0 && own < distance {
            (distance, shown) = (own, texel(picture, seen.at));
        }
    }
    shown
}
