//! Pictures of reflected light put together as printed, with errata P3 and P4 of the paper on point GI.

use super::{Bench, Computed};
use anyhow::bail;
use surfelshop_image::Image;

/// Sums of pictures, each times its factor; coverage is that of the first.
fn combined(all: &[(&Image, f32)]) -> Image {
    let Some((first, _)) = all.first() else { return Image::default() };
    let value = |i: usize| match i % 4 {
        3 => first.data[i],
        _ => all.iter().map(|(image, factor)| image.data.get(i).map_or(0.0, |v| v * factor)).sum(),
    };
    Image { data: (0..first.data.len()).map(value).collect(), ..(*first).clone() }
}

/// An erratum in the Cornell box.
pub(super) fn erratum(which: &str, bench: &Bench<'_, '_>) -> anyhow::Result<Computed> {
    let render = |name: &str, options: &str| -> anyhow::Result<Image> {
        bench.run(&format!(
            "render {{cornell}} -r global-illumination {options} --low-pass 0 -o {{out}}/{name}.exr"
        ))?;
        bench.radiance(&format!("{name}.exr"))
    };
    let traced = |bounces: u32| -> anyhow::Result<Image> {
        bench.run(&format!(
            "render {{cornell}} -r reference --set bounces={bounces} --set samples={{samples}} -o {{out}}/truth.exr"
        ))?;
        bench.radiance("truth.exr")
    };
    match which {
        "P3" => {
            let direct = render("direct", "--set show=direct")?;
            let indirect = render("indirect", "--set show=indirect --set interleaving=4")?;
            let printed = combined(&[(&direct, 1.0), (&indirect, 1.0 / 16.0)]);
            let corrected = combined(&[(&direct, 1.0), (&indirect, 1.0)]);
            Computed::pair(&printed, &corrected, &traced(2)?)
        }
        "P4" => {
            let lit = |b: u32| render(&format!("bounces-{b}"), &format!("--set bounces={b}"));
            let [none, one, two, three] = [lit(0)?, lit(1)?, lit(2)?, lit(3)?];
            // Light of one bounce is in all three sets, of two in two of them.
            let printed = combined(&[(&none, -2.0), (&one, 1.0), (&two, 1.0), (&three, 1.0)]);
            let mut all = Computed::pair(&printed, &three, &traced(3)?)?;
            for bounces in [2, 4] {
                let (wrong, right) = furnace(0.5, bounces);
                let what = format!(
                    "reflected light in a furnace of albedo 0.5, {bounces} bounces, over what it is"
                );
                all.number(&what, wrong / right, "");
            }
            Ok(all)
        }
        other => bail!("there is no erratum {other} of bounces"),
    }
}

/// Reflected light within a closed surface of one albedo and of the radiance 1: as printed, and as it is.
fn furnace(albedo: f64, bounces: i32) -> (f64, f64) {
    let light = |k: i32| albedo.powi(k);
    let printed = (1..=bounces).map(|k| f64::from(bounces + 1 - k) * light(k)).sum();
    (printed, (1..=bounces).map(light).sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_furnace_is_too_bright_by_what_the_erratum_says() {
        for (bounces, expected) in [(2, 1.67), (4, 3.27)] {
            let (printed, right) = furnace(0.5, bounces);
            assert!((printed / right - expected).abs() < 0.005, "{bounces}");
        }
    }

    #[test]
    fn light_of_one_bounce_counts_three_times() {
        let pixel = |v: f32| Image { width: 1, height: 1, components: 4, data: vec![v, v, v, 1.0] };
        // 1, then 0.5, 0.25, 0.125 more.
        let [none, one, two, three] = [1.0, 1.5, 1.75, 1.875].map(pixel);
        let sum = combined(&[(&none, -2.0), (&one, 1.0), (&two, 1.0), (&three, 1.0)]);
        assert_eq!(
            sum.data,
            [1.0 + 3.0 * 0.5 + 2.0 * 0.25 + 0.125; 3]
                .into_iter()
                .chain([1.0])
                .collect::<Vec<f32>>()
        );
    }
}
