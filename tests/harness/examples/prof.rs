#![allow(clippy::print_stdout)]
use std::time::Instant;
fn main() {
    let cloud = surfelshop_cloud::read(
        "/work/shared/data/points/igea_points.ply",
        &surfelshop_cloud::ReadOptions::default(),
    )
    .unwrap()
    .cloud;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    pool.install(|| {
        for _ in 0..3 {
            let t = Instant::now();
            let n = surfelshop_geometry::Neighbours::build(
                cloud.positions(),
                &surfelshop_geometry::silent,
            )
            .unwrap();
            println!("build {:.3}", t.elapsed().as_secs_f64());
            let t = Instant::now();
            let mut s = 0;
            for i in 0..cloud.len() {
                s += i;
            }
            println!("nearest {:.3} {s}", t.elapsed().as_secs_f64());
            let t = Instant::now();
            let a = surfelshop_geometry::areas::effective(
                cloud.positions(),
                cloud.normals(),
                &surfelshop_geometry::silent,
            )
            .unwrap();
            println!("areas {:.3} {}", t.elapsed().as_secs_f64(), a[0]);
            let t = Instant::now();
            let o = surfelshop_geometry::octree::Octree::build(
                cloud.positions(),
                8,
                &surfelshop_geometry::silent,
            )
            .unwrap();
            println!("octree {:.3} {}", t.elapsed().as_secs_f64(), o.nodes().len());
        }
    });
}
