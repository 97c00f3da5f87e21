//! What tests of Gaussians share, besides what measuring programs have, too.

use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};
use surfelshop_image::Image;
use surfelshop_render::Rendered;
pub(crate) use surfelshop_tests::gaussians::{
    Gaussians, decibels, encoded, frame, pixels, renderer,
};

/// Both renderers.
pub(crate) const UNITS: [&str; 2] = ["gaussians", "gaussians-2d"];

/// All that they offer.
pub(crate) fn outputs() -> [Output; 4] {
    [Output::Color, Output::Normal, Output::Depth, expected_depth()]
}

/// The output of mean depths.
pub(crate) fn expected_depth() -> Output {
    Output::Debug("expected-depth".to_owned())
}

/// Of `gaussians-2d` alone.
pub(crate) fn distortion() -> Output {
    Output::Debug("distortion".to_owned())
}

/// Parameters of a renderer.
pub(crate) fn values(pairs: &[(&str, Value)]) -> Values {
    pairs.iter().map(|(id, value)| ((*id).to_owned(), value.clone())).collect()
}

/// A choice, as a parameter's value.
pub(crate) fn text(text: &str) -> Value {
    Value::Text(text.to_owned())
}

/// The first number of each pixel.
pub(crate) fn firsts(image: &Image) -> Vec<f32> {
    image.data.iter().step_by(image.components as usize).copied().collect()
}

/// The same picture in f64.
pub(crate) fn wide(pixels: &[[f32; 4]]) -> Vec<[f64; 4]> {
    pixels.iter().map(|pixel| pixel.map(f64::from)).collect()
}

/// Fails where a picture of a frame has a number that is none.
#[track_caller]
pub(crate) fn all_finite(frame: &Rendered, what: &str) {
    for (output, image) in &frame.images {
        assert!(image.data.iter().all(|v| v.is_finite()), "{what}: {output:?}");
    }
}

/// Fails where two frames differ in a bit, and where they show nothing.
#[track_caller]
pub(crate) fn equal_bits(a: &Rendered, b: &Rendered, what: &str) {
    for (output, image) in &a.images {
        assert!(image.data.iter().any(|v| *v != 0.0), "{what}: {output:?} is empty");
        let bits = |image: &Image| image.data.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        let other = b.image(output).unwrap();
        let n = bits(image).iter().zip(bits(other)).filter(|(a, b)| *a != b).count();
        assert_eq!(n, 0, "{what}: numbers of {output:?} that differ");
    }
}

/// Says figures of a test.
pub(crate) fn say(line: &str) {
    println!("gaussians: {line}");
}
