//! Which side of a scan's surface faces free space.

mod couplings;
mod rays;
mod sets;
mod signs;
mod surfels;

use crate::progress::{Cancelled, Progress, part};
use couplings::Coupling;
use glam::{Quat, Vec3};
use rays::{Ray, SKY};
use surfels::Surfels;

/// What is known.
#[derive(Clone, Copy, Debug, Default)]
pub struct Hints {
    /// up
    pub up: Option<Vec3>,
    /// metres
    pub metres: Option<f32>,
    /// interior
    pub interior: Option<bool>,
}

/// Prototype.
pub fn prototype(
    positions: &[Vec3],
    normals: &mut [Vec3],
    hints: &Hints,
    progress: Progress<'_>,
) -> Result<String, Cancelled> {
    use std::fmt::Write;
    let t0 = std::time::Instant::now();
    let mut log = String::new();
    let surfels = Surfels::choose(positions, normals, &part(progress, 0.0..0.3))?;
    let _ = write!(log, "surfels {} {:.2}", surfels.surfels.len(), t0.elapsed().as_secs_f64());
    let discs = surfels.discs(progress)?;
    let _ = write!(log, " discs {:.2}", t0.elapsed().as_secs_f64());
    let turn = hints.up.map_or(Quat::IDENTITY, |up| Quat::from_rotation_arc(up, Vec3::Z));
    let rays = rays::trace(&surfels, &discs, turn, progress)?;
    let _ = write!(log, " rays {} {:.2}", rays.len(), t0.elapsed().as_secs_f64());
    let all = &surfels.surfels;
    let n = all.len();
    let pairs = couplings::neighbours(all, progress)?;
    let most = (n / 2000).clamp(4, 64) as u32;
    let (mut member, n_patches) = couplings::patches(n, &pairs, most, progress)?;
    for sky in 0..SKY {
        member.push(((n_patches + sky) as u32, false));
    }
    let _ = write!(log, " patches {} {:.2}", n_patches, t0.elapsed().as_secs_f64());
    let grouped = couplings::gathered(couplings::of_surfels(&pairs, &rays), &member, progress)?;
    let _ = write!(log, " couplings {} {:.2}", grouped.len(), t0.elapsed().as_secs_f64());
    let (signs, parts) = signs::solve(n_patches + SKY, grouped, progress)?;
    let mut x: Vec<bool> = member.iter().map(|&(g, o)| signs[g as usize] != o).collect();
    let _ = write!(log, " solved {:.2}", t0.elapsed().as_secs_f64());
    // point level
    for pass in 0..4 {
        let mut field = vec![(0i64, 0i64); n + SKY];
        for Coupling { a, b, net, total } in couplings::of_surfels(&pairs, &rays) {
            let f = |o: bool| if o { net } else { -net };
            field[a as usize].0 += f(x[b as usize]);
            field[b as usize].0 += f(x[a as usize]);
            field[a as usize].1 += total;
            field[b as usize].1 += total;
        }
        let mut turned = 0;
        for i in 0..n {
            let agrees = if x[i] { field[i].0 } else { -field[i].0 };
            if (agrees as f64) < -0.2 * field[i].1 as f64 {
                x[i] = !x[i];
                turned += 1;
            }
        }
        let _ = write!(log, " pass {pass}: {turned}");
    }
    let ev = evidence(n, &rays, &x, turn);
    let _ = write!(log, " {:.2}\n   {ev}", t0.elapsed().as_secs_f64());
    let mut sizes = std::collections::BTreeMap::new();
    for i in 0..n {
        *sizes.entry(parts[member[i].0 as usize]).or_insert(0usize) += 1;
    }
    let mut sizes: Vec<_> = sizes.values().copied().collect();
    sizes.sort_unstable_by(|a, b| b.cmp(a));
    sizes.truncate(5);
    let _ = write!(log, " parts {sizes:?}");
    for (i, &index) in surfels.index.iter().enumerate() {
        let normal = &mut normals[index as usize];
        *normal = if x[i] { *normal } else { -*normal };
    }
    // others: mark by zero
    let mut is = vec![false; positions.len()];
    for &i in &surfels.index {
        is[i as usize] = true;
    }
    for i in 0..positions.len() {
        if !is[i] {
            normals[i] = Vec3::ZERO;
        }
    }
    Ok(log)
}

fn evidence(n: usize, rays: &[Ray], x: &[bool], turn: Quat) -> String {
    // per surfel and side (0 front of label, 1 back of label): weights (plus, total)
    let mut side = vec![[(0.0f32, 0.0f32); 2]; n];
    let mut skyw = vec![[0.0f64; 2]; SKY];
    for r in rays {
        let near = r.leaves_front == x[r.from as usize];
        let far = r.arrives_front == x[r.to as usize];
        let w = f32::from(r.weight);
        let e = &mut side[r.from as usize][usize::from(!near)];
        e.0 += if far { w } else { -w };
        e.1 += w;
        if (r.to as usize) < n {
            let e = &mut side[r.to as usize][usize::from(!far)];
            e.0 += if near { w } else { -w };
            e.1 += w;
        } else {
            skyw[r.to as usize - n][usize::from(!near)] += 1.0;
        }
    }
    let (mut both_plus, mut both_minus, mut good, mut bad) = (0, 0, 0, 0);
    for s in &side {
        let m = s.map(|(net, total)| if total > 0.0 { net / total } else { 0.0 });
        if m[0] > 0.5 && m[1] > 0.5 {
            both_plus += 1;
        } else if m[0] < -0.5 && m[1] < -0.5 {
            both_minus += 1;
        } else if m[0] > 0.3 && m[1] < -0.3 {
            good += 1;
        } else if m[0] < -0.3 && m[1] > 0.3 {
            bad += 1;
        }
    }
    let f = |c: i32| f64::from(c) / n as f64;
    let sky: Vec<String> = rays::sky_directions(turn)
        .iter()
        .zip(&skyw)
        .zip(&x[n..])
        .map(|((_, w), s)| format!("{}{:.0}/{:.0}", if *s { '+' } else { '-' }, w[0] / 100.0, w[1] / 100.0))
        .collect();
    format!(
        "++ {:.4} -- {:.4} good {:.3} bad {:.3}\n   sky {}",
        f(both_plus),
        f(both_minus),
        f(good),
        f(bad),
        sky.join(" ")
    )
}
