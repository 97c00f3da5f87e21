//! Noise: curves of its octaves, and the texture that patterns are made of.

use super::curves::{Line, chart, sampled};
use super::{Bench, Computed};
use surfelshop_session::output::files::write_whole;

/// A slope between -1 and 1 for each whole number.
fn slope(cell: i64) -> f64 {
    let mut x = (cell as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x2545_f491_4f6c_dd1d;
    x ^= x >> 29;
    x = x.wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x ^= x >> 32;
    (x >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// Gradient noise along a line: 0 at whole numbers, with the slope of each there, joined by the quintic fade.
///
/// Source: Perlin 2002, "Improving Noise".
fn gradient_noise(x: f64) -> f64 {
    let cell = x.floor();
    let t = x - cell;
    let fade = t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let at = |step: f64| slope((cell + step) as i64) * (t - step);
    at(0.0) + fade * (at(1.0) - at(0.0))
}

/// An octave: twice the frequency and half the height of the one before.
fn octave(k: i32, x: f64) -> f64 {
    gradient_noise(x * 2f64.powi(k) + 17.0 * f64::from(k)) * 0.5f64.powi(k)
}

/// The curves of figures 11 to 13, by number.
pub(super) fn octaves(which: &str) -> anyhow::Result<Computed> {
    let names = [
        "frequency 1",
        "frequency 2",
        "frequency 4",
        "frequency 8",
        "frequency 16",
        "frequency 32",
    ];
    let line =
        |k: usize| Line { name: names[k], points: sampled(0.0, 8.0, |x| octave(k as i32, x)) };
    let sum = |x: f64| (0..6).map(|k| octave(k, x)).sum::<f64>();
    let lines = match which {
        "1" => vec![line(0), line(1)],
        "2" => vec![line(2), line(3), line(4), line(5)],
        _ => vec![Line { name: "sum of six", points: sampled(0.0, 8.0, sum) }],
    };
    let mut all = Computed::default();
    all.drawing("noise along a line", chart("noise", "x", "", &lines)?);
    let mean =
        |f: &dyn Fn(f64) -> f64| (0..8000).map(|i| f(f64::from(i) * 0.037)).sum::<f64>() / 8000.0;
    all.number("mean of the sum", mean(&sum), "");
    all.number("deviation of the sum", mean(&|x| sum(x) * sum(x)).sqrt(), "");
    Ok(all)
}

/// A pattern that shows the noise itself.
const PATTERN: &str = "#import surfelshop::noise::Place
#import procedural::pattern::{Look, fbm}

fn look(at: Place, albedo: vec3<f32>) -> Look {
    return Look(vec3(clamp(0.5 + fbm(at).mean, 0.0, 1.0)), 0.0, 1.0, 0.0);
}
";

/// The noise of the renderer on a plate.
pub(super) fn texture(bench: &Bench<'_, '_>) -> anyhow::Result<Computed> {
    write_whole(&bench.folder.join("noise.wgsl"), PATTERN.as_bytes())?;
    bench.run(
        "render {plate} -r procedural --set file={out}/noise.wgsl --set lighting=none --set frequency=8 \
         --set own-color=0 --camera front --zoom 1.4 -o {out}/noise.exr",
    )?;
    let picture = bench.radiance("noise.exr")?;
    let mut all = Computed::default();
    all.picture("noise", &picture)?;
    let covered: Vec<f64> = picture
        .data
        .as_chunks::<4>()
        .0
        .iter()
        .filter(|p| p[3] > 0.5)
        .map(|p| f64::from(p[0]))
        .collect();
    let n = covered.len().max(1) as f64;
    let mean = covered.iter().sum::<f64>() / n;
    all.number("mean", mean, "");
    all.number(
        "deviation",
        (covered.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt(),
        "",
    );
    Ok(all)
}
