//! Prints what the stages of a frame of `global-illumination` take on the Cornell box, by numbers of
//! lights, bounces and interleaved pixels, beside frames of `ewa-phong` of the same view taken in turns,
//! how the time of the shadow maps depends on the number of lights, and what is left of a frame's time where
//! less is drawn, as while a lamp is dragged:
//! `gi_times [--short | --large]`; with `--short`, fewer settings and repeats; with `--large`, of 4.7
//! million surfels instead.

use anyhow::Result;
use surfelshop_api::graph::Output;
use surfelshop_assets::cornell::{N_POINTS, cornell_box};
use surfelshop_tests::gi::{Bench, Set, Times, Timing, int, quartiles};

/// Surfels of the large box.
const LARGE: usize = 4_700_000;

/// Numbers of lights of which the maps are timed.
const LIGHTS: [u32; 5] = [64, 128, 256, 512, 1024];

/// Of how many surfels one is drawn, as in windows while something moves.
const STRIDES: [u32; 7] = [1, 2, 4, 8, 16, 32, 64];

/// Settings whose stages are timed: lights, bounces, interleaved pixels.
struct Range {
    vpls: &'static [u32],
    bounces: &'static [u32],
    interleaving: &'static [u32],
}

const ALL: Range = Range { vpls: &[64, 128, 256], bounces: &[1, 2, 3], interleaving: &[1, 2, 4] };
const FEW: Range = Range { vpls: &[64, 256], bounces: &[1, 3], interleaving: &[1, 4] };
const ONE: Range = Range { vpls: &[256], bounces: &[1, 2, 3], interleaving: &[4] };

pub(crate) fn run() -> Result<()> {
    let has = |name: &str| std::env::args().any(|argument| argument == name);
    if has("--large") {
        return by_stage(&mut Bench::new(cornell_box(LARGE)?, 512), &ONE, 3);
    }
    let (range, repeats) = if has("--short") { (FEW, 3) } else { (ALL, 5) };
    let small = cornell_box(N_POINTS)?;
    let mut bench = Bench::new(small.clone(), 256);
    by_lights(&mut bench, 2 * repeats)?;
    by_stride(&mut bench, 2 * repeats)?;
    by_stage(&mut bench, &range, repeats)?;
    by_stage(&mut Bench::new(small, 512), &FEW, 3)
}

fn debug(name: &str) -> Output {
    Output::Debug(name.to_owned())
}

/// Median CPU time, milliseconds.
fn median(times: &[Times]) -> f64 {
    quartiles(times.iter().map(|times| times.cpu).collect())[1]
}

/// Prints the time of each stage.
fn by_stage(bench: &mut Bench, range: &Range, repeats: usize) -> Result<()> {
    let mut jobs = vec![(vec![("bounces", int(0))], Output::Color)];
    let mut rows = Vec::new();
    for vpls in range.vpls {
        for bounces in range.bounces {
            let sets = |more: &[Set<'static>]| -> Vec<Set<'static>> {
                let usual = [("frames", int(1)), ("vpls", int(*vpls)), ("bounces", int(*bounces))];
                [&usual[..], more].concat()
            };
            let maps = jobs.len();
            jobs.push((sets(&[("bounces", int(1)), ("light-map", int(64))]), debug("vpls")));
            jobs.push((sets(&[("bounces", int(1))]), debug("vpls")));
            jobs.push((sets(&[]), debug("ism")));
            for n in range.interleaving {
                rows.push(([*vpls, *bounces, *n], maps, jobs.len()));
                for (smoothing, compensation) in [(0, 0), (2, 0), (2, 8)] {
                    let more = [
                        ("interleaving", int(*n)),
                        ("smoothing", int(smoothing)),
                        ("compensation", int(compensation)),
                    ];
                    jobs.push((sets(&more), Output::Color));
                }
            }
        }
    }
    let times = Timing::of(bench, &jobs).run(bench, repeats)?;
    let cpu: Vec<f64> = times[1..].iter().map(|times| median(times)).collect();
    println!(
        "## {} surfels, {} pixels a side, {}\n\n`ewa-phong` takes {:.1} ms, direct light {:.1}\n",
        bench.cloud.len(),
        bench.view.size_px[0],
        bench.engine.gpu().describe(),
        median(&times[0]),
        cpu[0]
    );
    println!(
        "| lights | bounces | interleaving | light surface | maps | shading | merge | compensate | frame | by the clock | over `ewa-phong`, quartiles |\n|{}",
        "---|".repeat(11)
    );
    for (setting, maps, own) in rows {
        let lights = cpu[maps + 1] - cpu[maps];
        let maps = cpu[maps + 2] - cpu[maps + 1];
        let [bare, merged, whole] = [cpu[own], cpu[own + 1], cpu[own + 2]];
        let stages = [lights, maps, bare - cpu[0] - maps, merged - bare, whole - merged, whole];
        // Frames that were taken in one turn saw the same machine.
        let pairs = times[own + 3].iter().zip(&times[0]);
        let ratios = quartiles(pairs.map(|(own, other)| own.cpu / other.cpu).collect());
        let clock = quartiles(times[own + 3].iter().map(|times| times.clock).collect())[1];
        println!(
            "| {} | {} | {clock:.0} | {:.1} ({:.1} to {:.1}) |",
            setting.map(|n| n.to_string()).join(" | "),
            stages.map(|ms| format!("{ms:.1}")).join(" | "),
            ratios[1],
            ratios[0],
            ratios[2]
        );
    }
    println!();
    Ok(())
}

/// Prints the time of frames while something moves, by how much is drawn.
fn by_stride(bench: &mut Bench, repeats: usize) -> Result<()> {
    let usual = [("frames", 1), ("vpls", 64), ("bounces", 2), ("interleaving", 4)];
    let sets: Vec<Set<'static>> = usual.map(|(id, value)| (id, int(value))).into();
    println!(
        "| 1 surfel of | frame by the clock, ms, quartiles | frames a second |\n|---|---|---|"
    );
    for stride in STRIDES {
        bench.stride = stride;
        let times = Timing::of(bench, &[(sets.clone(), Output::Color)]).run(bench, repeats)?;
        let clock = times[1].iter().map(|times| times.clock).collect();
        let [low, middle, high] = quartiles(clock);
        println!("| {stride} | {middle:.0} ({low:.0} to {high:.0}) | {:.1} |", 1e3 / middle);
    }
    bench.stride = 1;
    println!();
    Ok(())
}

/// Prints the time of the shadow maps of one bounce by the number of lights.
fn by_lights(bench: &mut Bench, repeats: usize) -> Result<()> {
    let sets = |vpls: u32| -> Vec<Set<'static>> {
        vec![("frames", int(1)), ("bounces", int(1)), ("vpls", int(vpls))]
    };
    let stages = ["vpls", "ism-points", "ism"];
    let jobs: Vec<(Vec<Set<'static>>, Output)> =
        LIGHTS.iter().flat_map(|n| stages.map(|stage| (sets(*n), debug(stage)))).collect();
    let times = Timing::of(bench, &jobs).run(bench, repeats)?;
    let stages_of = |i: usize| -> [Vec<f64>; 3] {
        let cpu = |stage: usize| times[1 + 3 * i + stage].iter().map(|times| times.cpu);
        let less = |one: usize, other: usize| cpu(one).zip(cpu(other)).map(|(a, b)| a - b);
        [less(1, 0).collect(), less(2, 1).collect(), less(2, 0).collect()]
    };
    let usual = quartiles(stages_of(2)[2].clone())[1];
    println!(
        "| lights | maps, ms | fill, ms | both, quartiles | over 256 lights |\n|---|---|---|---|---|"
    );
    for (i, n) in LIGHTS.iter().enumerate() {
        let [[_, maps, _], [_, fill, _], [low, both, high]] = stages_of(i).map(quartiles);
        println!(
            "| {n} | {maps:.1} | {fill:.1} | {both:.1} ({low:.1} to {high:.1}) | {:.2} |",
            both / usual
        );
    }
    println!();
    Ok(())
}
