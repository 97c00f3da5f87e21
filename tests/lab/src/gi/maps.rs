//! Prints how far visibility by the shadow maps of virtual lights is from visibility by rays, on the
//! Cornell box: by number of lights, by surfels that go over the maps and by levels of filling, and by
//! how far a shadow begins behind what throws it:
//! `gi_maps [--rules]`; with `--rules`, of maps made on the CPU by other rules, too.

use anyhow::Result;
use surfelshop_assets::cornell::cornell_box;
use surfelshop_tests::gi::{Bench, Errors, Maps, Pairs, Rules, Surfels, receivers};

/// Lights of the bounce.
const LIGHTS: [u32; 3] = [64, 256, 1024];

/// Levels of filling.
const LEVELS: [u32; 3] = [0, 2, 3];

/// Surfels of the cloud, and those that go over the maps.
const POINTS: [(usize, u32); 3] = [(100_000, 51_000), (100_000, u32::MAX), (400_000, u32::MAX)];

/// Texels on a side of all maps together, and of the picture that shows them.
const SIZE: u32 = 1024;

/// Places of the surface.
const RECEIVERS: usize = 2000;

/// Factors on the renderer's thickness, and on what a texel's width leaves open.
const BIASES: [f32; 5] = [0.0, 0.25, 0.5, 1.0, 2.0];
const SLOPES: [f32; 3] = [0.0, 1.0, 2.0];

/// The lights and the surfels by which rules are compared.
const USUAL: u32 = 256;

pub(crate) fn run() -> Result<()> {
    let by_rules = std::env::args().any(|argument| argument == "--rules");
    println!(
        "| cloud | points | lights | a map | levels | empty | {HEADS} |\n|---|---|---|---|---|---|{RULE}"
    );
    for (n_surfels, points) in POINTS {
        let mut bench = Bench::new(cornell_box(n_surfels)?, SIZE);
        let (places, discs) = receivers(&bench, RECEIVERS)?;
        for n in LIGHTS {
            let mut pairs: Option<Pairs> = None;
            for levels in LEVELS {
                let [filled, raw] = Maps::drawn(&mut bench, n, SIZE, points, levels)?;
                let pairs =
                    pairs.get_or_insert_with(|| Pairs::new(&filled.lights, &places, &discs));
                let maps = if levels == 0 { raw } else { filled };
                let per_map = maps.n_points / n as usize;
                println!(
                    "| {} | {} | {n} | {}^2 texels, {per_map} points | {levels} | {:.3} | {} |",
                    bench.cloud.len(),
                    maps.n_points,
                    maps.side,
                    maps.empty(),
                    told(&pairs.errors(&maps, [1.0, 1.0]))
                );
            }
        }
    }
    println!();
    let mut bench = Bench::new(cornell_box(100_000)?, SIZE);
    biases(&mut bench)?;
    if by_rules { rules(&mut bench) } else { Ok(()) }
}

/// Columns of errors.
const HEADS: &str = "open | shadowed | lit | weighted: shadowed | lit | bias | mean error";
const RULE: &str = "---|---|---|---|---|---|---|";

fn told(e: &Errors) -> String {
    let pairs = [e.open, e.shadowed, e.lit, e.weighted_shadowed, e.weighted_lit];
    let pairs = pairs.map(|share| format!("{share:.4}")).join(" | ");
    format!("{pairs} | {:+.4} | {:.4}", e.bias, e.absolute)
}

/// Prints errors by how far a shadow begins behind what throws it.
fn biases(bench: &mut Bench) -> Result<()> {
    let (places, discs) = receivers(bench, RECEIVERS)?;
    let [maps, _] = Maps::drawn(bench, USUAL, SIZE, u32::MAX, 3)?;
    let pairs = Pairs::new(&maps.lights, &places, &discs);
    println!("{} pairs, thickness {:.4} extents\n", pairs.len(), maps.thickness());
    println!("| thickness | slope | {HEADS} |\n|---|---|{RULE}");
    for thickness in BIASES {
        for slope in SLOPES {
            let errors = pairs.errors(&maps, [thickness, slope]);
            println!("| {thickness} | {slope} | {} |", told(&errors));
        }
    }
    println!();
    Ok(())
}

/// Prints errors of maps made by other rules.
fn rules(bench: &mut Bench) -> Result<()> {
    let (places, discs) = receivers(bench, RECEIVERS)?;
    let surfels = Surfels::of(bench);
    let [filled, raw] = Maps::drawn(bench, USUAL, SIZE, u32::MAX, 3)?;
    let pairs = Pairs::new(&filled.lights, &places, &discs);
    let twins = surfels.maps(&filled.lights, filled.side, 1, &Rules::default());
    for (name, drawn, twin) in [("raw", &raw, &twins[0]), ("filled", &filled, &twins[1])] {
        let all = drawn.texels.iter().zip(&twin.texels);
        let other = all.filter(|(a, b)| (*a - *b).abs() > 1e-3 * a.max(**b)).count();
        let share = other as f64 / drawn.texels.len() as f64;
        println!("{name}: {share:.5} of the texels differ between device and processor");
    }
    println!("\n| rules | empty | {HEADS} |\n|---|---|{RULE}");
    let (usual, covering) = (Rules::default(), Rules::covering());
    let all = [
        ("as drawn", usual),
        ("covering discs, filled by a pyramid", covering),
        ("covering discs, not filled", Rules { levels: 0, ..covering }),
        ("smaller discs, filled by a pyramid", Rules { enlarged: 0.6, ..covering }),
        ("not filled", Rules { levels: 0, ..usual }),
        ("filled twice as wide", Rules { levels: 4, ..usual }),
        ("radius 0.5", Rules { enlarged: 0.5, ..usual }),
        ("radius 0.7", Rules { enlarged: 0.7, ..usual }),
        ("radius 0.8", Rules { enlarged: 0.8, ..usual }),
        ("smallest discs in a texel", Rules { smallest: true, ..usual }),
        ("own surface 0.25 off its plane", Rules { own_off_plane: 0.25, ..usual }),
        ("own surface 1 off its plane", Rules { own_off_plane: 1.0, ..usual }),
        ("same surface 0.2", Rules { same_surface: 0.2, ..usual }),
    ];
    for (name, rules) in all {
        let [_, maps] = surfels.maps(&filled.lights, filled.side, 1, &rules);
        let errors = pairs.errors(&maps, [1.0, 1.0]);
        println!("| {name} | {:.3} | {} |", maps.empty(), told(&errors));
    }
    Ok(())
}
