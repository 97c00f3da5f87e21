//! Time and memory of the estimates.

use super::cloud::Random;
use glam::{DVec3, Vec3};
use std::time::Instant;
use surfelshop_geometry::{Neighbours, normals, radii, sides, silent};

pub(super) fn run(sizes: &[String]) -> anyhow::Result<()> {
    let sizes: Vec<usize> = if sizes.is_empty() {
        vec![100_000, 1_000_000]
    } else {
        sizes.iter().map(|size| size.parse()).collect::<Result<_, _>>()?
    };
    println!("random points of a bumpy sphere; CPU seconds, and seconds");
    for size in sizes {
        let mut random = Random::new(5);
        let point = |random: &mut Random| {
            let at = random.in_ball().normalize_or(DVec3::Z);
            let bump = 0.1 * ((7.0 * at.x).sin() * (7.0 * at.y).sin() + 0.3 * (13.0 * at.z).cos());
            (at * (1.0 + bump)).as_vec3()
        };
        let points: Vec<Vec3> = (0..size).map(|_| point(&mut random)).collect();
        let base = memory("VmRSS:");
        let (neighbours, build) = timed(|| Neighbours::build(&points, &silent));
        let neighbours = neighbours?;
        let (found, fit) =
            timed(|| normals::estimate_with(&neighbours, normals::DEFAULT_NEIGHBOURS, &silent));
        let found = found?;
        let outwards = points.iter().zip(&found.normals).filter(|(p, n)| p.dot(**n) > 0.0).count();
        // In the order in which clouds are read.
        let normals::Estimate { normals: mut turned, planarity, errors, .. } = found;
        drop(errors);
        let hints = sides::Hints::default();
        let (seen, look) = timed(|| sides::by_visibility(&points, &mut turned, &hints, &silent));
        let seen = 100.0 * seen?.decided as f64 / size as f64;
        let (radii, cover) =
            timed(|| radii::estimate_with(&neighbours, &turned, &planarity, &silent));
        let radii = radii?;
        let mean = radii.iter().map(|&r| f64::from(r)).sum::<f64>() / size as f64;
        println!(
            "{size:>9}: search {:.2} ({:.2}), normals {:.2} ({:.2}), sides by visibility {:.2} ({:.2}), radii {:.2} ({:.2}), all but sides {:.2}; {:.2} % outwards, {seen:.2} % decided; mean radius {:.2} spacings; peaks {} MB, points {} MB",
            build.0,
            build.1,
            fit.0,
            fit.1,
            look.0,
            look.1,
            cover.0,
            cover.1,
            build.0 + fit.0 + cover.0,
            100.0 * outwards as f64 / size as f64,
            mean / (4.0 * std::f64::consts::PI / size as f64).sqrt(),
            [build, fit, look, cover].map(|cost| cost.2.to_string()).join(", "),
            base / 1000,
        );
    }
    Ok(())
}

/// What work gives, its processor seconds, its seconds, and the most memory that was in use meanwhile, MB.
fn timed<T>(work: impl FnOnce() -> T) -> (T, (f64, f64, u64)) {
    // From here on the kernel keeps the peak anew; where it does not, peaks are those of all until then.
    drop(std::fs::write("/proc/self/clear_refs", "5"));
    let (start, cpu) = (Instant::now(), processor_seconds());
    let result = work();
    (result, (processor_seconds() - cpu, start.elapsed().as_secs_f64(), memory("VmHWM:") / 1000))
}

/// Seconds that this process computed, on all threads.
fn processor_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = stat.rsplit(')').next().unwrap_or_default().split_whitespace().skip(11);
    let ticks: f64 = fields.take(2).filter_map(|ticks| ticks.parse::<f64>().ok()).sum();
    ticks / 100.0
}

/// Memory by its name in the list of what this process has, kB.
fn memory(name: &str) -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix(name));
    line.and_then(|rest| rest.split_whitespace().next()?.parse().ok()).unwrap_or(0)
}
