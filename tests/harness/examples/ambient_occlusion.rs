//! Dev measurement.
#![allow(clippy::print_stdout, reason = "a program that prints a table")]
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;
use surfelshop_ambient_occlusion::SurfelshopPackage;
use surfelshop_api::abi::host_side::Plugin;
use surfelshop_api::glam::{Vec3, Vec3A};
use surfelshop_api::job::JobHost;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::tool::EditHeader;
use surfelshop_api::{HostInfo, Result};

#[derive(Default)]
struct Desk {
    staged: Mutex<Vec<f32>>,
    message: Mutex<String>,
}
impl JobHost for Desk {
    fn progress(&self, _fraction: f64, message: &str) {
        if !message.is_empty() {
            *self.message.lock().unwrap() = message.to_owned();
        }
    }
    fn cancelled(&self) -> bool {
        false
    }
    fn stage(&self, _header: &EditHeader, values: &[&[u8]]) -> Result<()> {
        *self.staged.lock().unwrap() =
            values[0].chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
        Ok(())
    }
    fn parallel(
        &self,
        count: usize,
        _share: Range<f64>,
        work: &(dyn Fn(Range<usize>) + Sync),
    ) -> bool {
        let done = AtomicUsize::new(0);
        (0..count.div_ceil(64)).into_par_iter().for_each(|b| {
            work(b * 64..(b * 64 + 64).min(count));
            done.fetch_add(1, Ordering::Relaxed);
        });
        true
    }
}
fn cpu() -> f64 {
    let s = std::fs::read_to_string("/proc/self/stat").unwrap();
    let f: Vec<&str> = s.rsplit(')').next().unwrap().split_whitespace().collect();
    (f[11].parse::<f64>().unwrap() + f[12].parse::<f64>().unwrap()) / 100.0
}
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let name = &args[1];
    let path = format!("/work/shared/data/points/{name}_points.ply");
    let cloud =
        surfelshop_cloud::read(&path, &surfelshop_cloud::ReadOptions::default()).unwrap().cloud;
    let faces: Vec<u32> = std::fs::read(format!("/tmp/ao/{name}.faces"))
        .unwrap()
        .chunks_exact(4)
        .map(|b| u32::from_le_bytes(b.try_into().unwrap()))
        .collect();
    let n = cloud.len();
    let mut used = vec![false; n];
    faces.iter().for_each(|&i| used[i as usize] = true);
    let truth = truth(name, cloud.positions(), cloud.normals(), &faces);
    let brute = std::fs::read(format!("/tmp/ao/{name}.brute")).ok().map(|b| {
        b.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect::<Vec<f32>>()
    });
    let plugin = Plugin::of::<SurfelshopPackage>();
    for spec in &args[2..] {
        let mut values = Values::new();
        for pair in spec.split(',').filter(|s| !s.is_empty()) {
            let (k, v) = pair.split_once('=').unwrap();
            let value = match v.parse::<f64>() {
                Ok(f) if f.fract() == 0.0 && !v.contains('.') => Value::Int(f as i64),
                Ok(f) => Value::Float(f),
                Err(_) if v == "true" => Value::Bool(true),
                Err(_) => Value::Text(v.into()),
            };
            values.insert(k.into(), value);
        }
        let desk = Desk::default();
        let (w, c) = (Instant::now(), cpu());
        plugin.create(0, &HostInfo::default()).unwrap().run(&values, &cloud.view(), &desk).unwrap();
        let (wall, cpu) = (w.elapsed().as_secs_f64(), cpu() - c);
        let ao = desk.staged.into_inner().unwrap();
        if spec.contains("brute") && spec.contains("save") {
            std::fs::write(
                format!("/tmp/ao/{name}.brute"),
                ao.iter().flat_map(|a| a.to_le_bytes()).collect::<Vec<u8>>(),
            )
            .unwrap();
        }
        let stats = |truth: &[f32]| {
            let mut e: Vec<f64> = (0..n)
                .filter(|&i| used[i])
                .map(|i| f64::from(ao[i]) - f64::from(truth[i]))
                .collect();
            let bias = e.iter().sum::<f64>() / e.len() as f64;
            let rms = |e: &[f64]| (e.iter().map(|e| e * e).sum::<f64>() / e.len() as f64).sqrt();
            let all = rms(&e);
            e.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
            let trimmed = rms(&e[..e.len() * 99 / 100]);
            format!(
                "rms {all:.4} bias {bias:+.4} trim {trimmed:.4} max {:.3}",
                e.last().unwrap().abs()
            )
        };
        println!(
            "{name} {spec:50} cpu {cpu:6.2} wall {wall:6.2}  {}  brute: {} [{}]",
            stats(&truth),
            brute.as_ref().map_or(String::new(), |b| stats(b)),
            desk.message.into_inner().unwrap()
        );
    }
}
fn truth(name: &str, positions: &[Vec3], normals: &[Vec3], faces: &[u32]) -> Vec<f32> {
    let path = format!("/tmp/ao/{name}.truth");
    if let Ok(b) = std::fs::read(&path) {
        return b.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
    }
    let at = |i: u32| Vec3A::from(positions[i as usize]);
    let tris: Vec<obvhs::triangle::Triangle> = faces
        .chunks_exact(3)
        .map(|f| obvhs::triangle::Triangle { v0: at(f[0]), v1: at(f[1]), v2: at(f[2]) })
        .collect();
    let bvh = obvhs::cwbvh::builder::build_cwbvh_from_tris(
        &tris,
        obvhs::BvhBuildParams::medium_build(),
        &mut Default::default(),
    );
    let b = surfelshop_geometry::Bounds::of_positions(positions).unwrap();
    let eps = 1e-4 * b.diagonal() as f32;
    let rays: u32 = std::env::var("TRUTH").map_or(1024, |t| t.parse().unwrap());
    let t: Vec<f32> = (0..positions.len())
        .into_par_iter()
        .map(|i| {
            let n = normals[i];
            let (u, v) = n.any_orthonormal_pair();
            let o = positions[i] + eps * n;
            let mut h = (i as u32).wrapping_mul(0x9e3779b9) ^ 0x1234567;
            h ^= h >> 16;
            h = h.wrapping_mul(0x7feb352d);
            h ^= h >> 15;
            h = h.wrapping_mul(0x846ca68b);
            h ^= h >> 16;
            let (a0, b0) = ((h & 0xffff) as f64 / 65536.0, (h >> 16) as f64 / 65536.0);
            let mut hits = 0;
            for k in 0..rays {
                let a = (a0 + f64::from(k) * 0.754877666246693).fract();
                let b = (b0 + f64::from(k) * 0.569840290998053).fract();
                let r = a.sqrt();
                let (s, c) = (b * std::f64::consts::TAU).sin_cos();
                let d =
                    u * (r * c) as f32 + v * (r * s) as f32 + n * (1.0 - a).max(0.0).sqrt() as f32;
                let ray =
                    obvhs::ray::Ray::new(o.into(), (d + Vec3::ZERO).into(), 0.0, f32::INFINITY);
                if !bvh.ray_traverse_miss(ray, |ray, id| {
                    tris[bvh.primitive_indices[id] as usize].intersect(ray)
                }) {
                    hits += 1;
                }
            }
            1.0 - hits as f32 / rays as f32
        })
        .collect();
    std::fs::write(path, t.iter().flat_map(|a| a.to_le_bytes()).collect::<Vec<u8>>()).unwrap();
    t
}
