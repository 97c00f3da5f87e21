// Values that vary inside a pixel, known by mean and standard deviation: what is left of a pattern
// that is finer than the pixel.
//
// A pattern computed from the mean alone gets darker, duller or harder as its noise fades with the
// distance; computed from both it stays what a camera would see. Every function takes the value as
// normally distributed and gives the mean over that.
//
// Twin: `tests/support/procedural/filtered.rs`.
#define_import_path surfelshop::filtered

struct Filtered {
    mean: f32,
    // Standard deviation inside the pixel, at least 0.
    deviation: f32,
}

// A deviation as a divisor.
const LEAST_DEVIATION = 1e-12;

// The error function; its error is below 1.5e-7 everywhere.
//
// Source: Abramowitz & Stegun, "Handbook of Mathematical Functions", 7.1.26.
fn erf(x: f32) -> f32 {
    let a = abs(x);
    let t = 1.0 / (1.0 + 0.3275911 * a);
    var p = -1.453152027 + t * 1.061405429;
    p = 1.421413741 + t * p;
    p = -0.284496736 + t * p;
    p = t * (0.254829592 + t * p);
    return sign(x) * (1.0 - p * exp(-min(a * a, 80.0)));
}

// What does not vary.
fn known(value: f32) -> Filtered {
    return Filtered(value, 0.0);
}

// factor x + offset.
fn scaled(x: Filtered, factor: f32, offset: f32) -> Filtered {
    return Filtered(factor * x.mean + offset, abs(factor) * x.deviation);
}

// x + y, which know nothing of each other.
fn sum(x: Filtered, y: Filtered) -> Filtered {
    return Filtered(
        x.mean + y.mean,
        sqrt(x.deviation * x.deviation + y.deviation * y.deviation),
    );
}

// |x|.
fn magnitude(x: Filtered) -> Filtered {
    let s = max(x.deviation, LEAST_DEVIATION);
    let z = x.mean / s;
    let mean = x.mean * erf(z * 0.70710678) + 0.79788456 * s * exp(-0.5 * min(z * z, 160.0));
    let variance = x.mean * x.mean + x.deviation * x.deviation - mean * mean;
    return Filtered(mean, sqrt(max(variance, 0.0)));
}

// The share of x above an edge.
fn above(x: Filtered, edge: f32) -> f32 {
    return 0.5 + 0.5 * erf((x.mean - edge) / max(x.deviation, LEAST_DEVIATION) * 0.70710678);
}

// max(x - edge, 0).
fn excess(x: Filtered, edge: f32) -> f32 {
    let s = max(x.deviation, LEAST_DEVIATION);
    let d = x.mean - edge;
    let z = d / s;
    return d * above(x, edge) + 0.39894228 * s * exp(-0.5 * min(z * z, 160.0));
}

// (x - low) / (high - low) between 0 and 1; low is below high.
fn ramp(x: Filtered, low: f32, high: f32) -> f32 {
    return clamp((excess(x, low) - excess(x, high)) / (high - low), 0.0, 1.0);
}

// exp(-(x / width)^2): 1 at 0, a line as wide as that.
fn line(x: Filtered, width: f32) -> f32 {
    let wide = width * width + 2.0 * x.deviation * x.deviation;
    return width * inverseSqrt(wide) * exp(-min(x.mean * x.mean / wide, 80.0));
}

// Such lines at every whole number, of a width far below 1.
fn lines(x: Filtered, width: f32) -> f32 {
    let m = fract(x.mean);
    var sum = 0.0;
    for (var k = -1; k <= 2; k++) {
        sum += line(Filtered(m - f32(k), x.deviation), width);
    }
    // As with the pulse below; the mean of them all is the area of one.
    return mix(sum, 1.77245385 * width, smoothstep(0.3, 0.45, x.deviation));
}

// sin(2 pi x).
fn wave(x: Filtered) -> f32 {
    let faded = exp(-min(19.7392088 * x.deviation * x.deviation, 80.0));
    return faded * sin(6.28318531 * fract(x.mean));
}

// 1 in the first `duty` of each period of length 1, 0 in the rest: the share of x in there. Wide
// deviations leave the duty itself.
fn pulse(x: Filtered, duty: f32) -> f32 {
    let m = fract(x.mean);
    var share = 0.0;
    for (var k = -1; k <= 1; k++) {
        let one = Filtered(m, x.deviation);
        share += above(one, f32(k)) - above(one, f32(k) + duty);
    }
    // Three periods hold all but a thousandth of a deviation of a third; beyond twice that nothing
    // of the pulse is left to be seen.
    return mix(share, duty, smoothstep(0.3, 0.45, x.deviation));
}
