//! Pictures against sums over all texels in f64.

use crate::environment::light::{TO_EYE, all_reflected, matte, probes, sun, text, values};
use glam::DVec3;
use surfelshop_api::params::Value;
use surfelshop_cloud::environment_map::Probe;
use surfelshop_tests::natural_light::{Errors, Lab, NaturalLight, Pixel, ggx_times_cosine};

/// Invariant: a white surface in even light is as bright as the light
#[test]
fn a_white_surface_in_even_light_is_as_bright_as_the_light() {
    let mut lab = Lab::new(20_000, 40);
    let even = Probe::constant([1.0; 3]);
    for pixel in lab.pixels(&even, &matte()).unwrap() {
        assert!(pixel.color.iter().all(|c| (c - 1.0).abs() < 1e-3), "{:?}", pixel.color);
    }
    for step in 0..=10 {
        let roughness = f64::from(step) / 10.0;
        for pixel in lab.pixels(&even, &all_reflected(roughness)).unwrap() {
            let c = pixel.color;
            assert!(c.iter().all(|c| (c - 1.0).abs() < 0.02), "roughness {roughness}: {c:?}");
        }
        // Body and surface together, too, give back what arrives.
        let both = values(&[("roughness", Value::Float(roughness))]);
        for pixel in lab.pixels(&even, &both).unwrap() {
            assert!((pixel.color[1] - 1.0).abs() < 0.02, "{:?}", pixel.color);
        }
    }
}

/// What even light of radiance 1 becomes when GGX reflects it once: the sum over a fine grid.
fn reflected_once(normal: DVec3, roughness: f64) -> f64 {
    let n = 1200;
    let (u, v) = normal.any_orthonormal_pair();
    let step = |i: usize| (i as f64 + 0.5) / n as f64;
    let row = |i: usize| {
        let cosine = step(i);
        let sine = (1.0 - cosine * cosine).sqrt();
        let value = |j: usize| {
            let (s, c) = (std::f64::consts::TAU * step(j)).sin_cos();
            let towards = cosine * normal + sine * (c * u + s * v);
            ggx_times_cosine(normal, TO_EYE, towards, roughness, 1.0)
        };
        (0..n).map(value).sum::<f64>()
    };
    (0..n).map(row).sum::<f64>() * std::f64::consts::TAU / (n * n) as f64
}

#[test]
fn light_reflected_once_is_the_integral() {
    let mut lab = Lab::new(20_000, 40);
    let even = Probe::constant([1.0; 3]);
    for roughness in [0.3, 0.5, 0.8, 1.0] {
        let mut once = all_reflected(roughness);
        once.insert("multiple-scattering".to_owned(), Value::Bool(false));
        let pixels = lab.pixels(&even, &once).unwrap();
        for cosine in [0.15, 0.3, 0.6, 0.99] {
            let far = |p: &&Pixel| (p.normal.dot(TO_EYE) - cosine).abs();
            let pixel = pixels.iter().min_by(|a, b| far(a).total_cmp(&far(b))).unwrap();
            let (found, expected) = (pixel.color[0], reflected_once(pixel.normal, roughness));
            println!("roughness {roughness}, cosine {cosine}: {found:.4} for {expected:.4}");
            assert!((found - expected).abs() < 0.01 * expected, "{found} for {expected}");
        }
    }
}

/// Invariant: light of a probe, on matte and shiny surfaces, is what sums over all its texels in
/// f64 say
#[test]
fn matte_surfaces_agree_with_the_sum_over_all_texels() {
    let mut lab = Lab::new(20_000, 40);
    for (probe, most) in [
        // Soft boxes against a dim room are far from what nine numbers can say: twenty-five
        // leave a fifth of this (`higher_orders_are_no_worse`).
        (Probe::studio(), 0.05),
        (Probe::sky(), 0.01),
        (sun(), 0.002),
        (Probe::constant([0.3, 0.5, 2.0]), 1e-3),
    ] {
        let truth = NaturalLight::of(&probe);
        let pixels = lab.pixels(&probe, &matte()).unwrap();
        let Errors { mean, largest, .. } =
            Errors::of(&pixels, |pixel| truth.white_diffuse(pixel.normal));
        println!("{}: mean error {mean:.5}, largest {largest:.5}", probe.name);
        assert!(mean < most, "{}: {mean}", probe.name);
    }
}

#[test]
fn higher_orders_are_no_worse() {
    let mut lab = Lab::new(20_000, 40);
    let probe = Probe::studio();
    let truth = NaturalLight::of(&probe);
    let mut error = |order: i64| {
        let mut matte = matte();
        matte.insert("sh-order".to_owned(), Value::Int(order));
        matte.insert("window".to_owned(), Value::Bool(false));
        let pixels = lab.pixels(&probe, &matte).unwrap();
        Errors::of(&pixels, |pixel| truth.white_diffuse(pixel.normal)).mean
    };
    let by_order: Vec<f64> = (1..=5).map(&mut error).collect();
    println!("{by_order:?}");
    assert!(by_order[1] < 0.5 * by_order[0] && by_order[3] < by_order[1], "{by_order:?}");
    // Odd orders above 1 have no part in matte light.
    assert!((by_order[2] - by_order[1]).abs() < 1e-6 && (by_order[4] - by_order[3]).abs() < 1e-6);
}

#[test]
fn nothing_gets_darker_than_black() {
    let mut lab = Lab::new(20_000, 40);
    for probe in &probes() {
        for model in ["ggx", "thesis"] {
            let pixels = lab.pixels(probe, &values(&[("model", text(model))])).unwrap();
            let least = pixels.iter().flat_map(|p| p.color).fold(f64::INFINITY, f64::min);
            assert!(least >= 0.0, "{} by {model}: {least}", probe.name);
        }
    }
    // Also where the sun stays among the harmonics: the window alone prevents it.
    let mut with_window = matte();
    with_window.insert("sun".to_owned(), Value::Bool(false));
    let least =
        |pixels: &[Pixel]| pixels.iter().flat_map(|p| p.color).fold(f64::INFINITY, f64::min);
    assert!(least(&lab.pixels(&sun(), &with_window).unwrap()) >= -1e-4);
    with_window.insert("window".to_owned(), Value::Bool(false));
    assert!(
        least(&lab.pixels(&sun(), &with_window).unwrap()) < -0.1,
        "the window has nothing to do"
    );
}

#[test]
fn rough_surfaces_agree_with_the_sum_where_the_split_is_exact() {
    let mut errors_found = Vec::new();
    // Seen along the normal, the map is filtered by the very lobe: what remains is its texels, the
    // levels between two of them, and sampling, a hundredth each.
    let mut lab = Lab::new(20_000, 40);
    for (probe, most) in [(Probe::studio(), 0.03), (Probe::sky(), 0.03)] {
        let truth = NaturalLight::of(&probe);
        for roughness in [0.4, 0.6, 0.8, 1.0] {
            let mut once = all_reflected(roughness);
            once.insert("multiple-scattering".to_owned(), Value::Bool(false));
            let pixels = lab.pixels(&probe, &once).unwrap();
            let ahead: Vec<Pixel> =
                pixels.into_iter().filter(|pixel| pixel.normal.z > 0.998).collect();
            let expected = |p: &Pixel| truth.ggx(p.normal, TO_EYE, roughness, 1.0);
            let Errors { mean, .. } = Errors::of(&ahead, expected);
            println!("{} at roughness {roughness}: {mean:.4}", probe.name);
            errors_found.push((mean, most, probe.name.clone()));
        }
    }
    for (mean, most, name) in errors_found {
        assert!(mean < most, "{name}: {mean}");
    }
}
