//! Clouds that are hard, for units of every kind.

use crate::conformance::clouds::{self, Surfels};
use glam::{DVec3, Vec3};
use surfelshop_api::columns;
use surfelshop_cloud::{Buffer, Cloud, Column};

/// What is hard of a cloud, and the cloud.
pub(crate) type Hard = (&'static str, Cloud);

fn small() -> Surfels {
    clouds::sphere(400, 1.0)
}

/// Clouds with next to nothing in them, or all in one place, line or plane.
pub(crate) fn degenerate() -> Vec<Hard> {
    let points = |all: &[Vec3]| {
        let mut surfels = Surfels::default();
        for at in all {
            surfels.push(*at, Vec3::Z, 0.2);
        }
        surfels.colors = vec![[200, 120, 40]; all.len()];
        surfels.cloud()
    };
    let line: Vec<Vec3> = (0..40).map(|i| Vec3::X * (i as f32 * 0.05 - 1.0)).collect();
    vec![
        ("no surfels", Surfels::default().cloud()),
        ("one surfel", points(&[Vec3::ZERO])),
        ("two surfels", points(&[Vec3::ZERO, Vec3::X * 0.3])),
        ("a line", points(&line)),
        ("a plane", clouds::plane(20, 1.0).cloud()),
        ("all at one place", points(&[Vec3::ZERO; 3000])),
    ]
}

/// Clouds some of whose values are at the end of what there is. Those that are no numbers no cloud has.
pub(crate) fn damaged() -> Vec<Hard> {
    let with = |change: &dyn Fn(usize, &mut Surfels)| {
        let mut surfels = small();
        for i in (0..surfels.positions.len()).step_by(7) {
            change(i, &mut surfels);
        }
        surfels.cloud()
    };
    let normals = [Vec3::ZERO, Vec3::splat(1e-30), Vec3::splat(1e30), Vec3::splat(f32::MAX)];
    let radii = [0.0, -1.0, 1e-30, 1e30, f32::MAX];
    vec![
        ("normals of every length", with(&|i, s| s.normals[i] = normals[i / 7 % normals.len()])),
        ("normals that cancel", with(&|i, s| s.normals[i] = -s.normals[i])),
        ("radii of every size", with(&|i, s| s.radii[i] = radii[i / 7 % radii.len()])),
        ("positions beyond all others", with(&|i, s| s.positions[i] *= 1e30)),
        ("colours of every size", odd_colors()),
    ]
}

/// Colours in floats.
fn odd_colors() -> Cloud {
    let odd = [-1.0, 1e30, 1e-40, f32::MAX, f32::MIN];
    let mut surfels = small();
    let n = surfels.positions.len();
    surfels.colors = Vec::new();
    let values = (0..3 * n).map(|i| if i % 5 == 0 { odd[i / 5 % odd.len()] } else { 0.5 });
    let column = Column::new(columns::COLOR, 3, Buffer::F32(values.collect()));
    with_column(&surfels.cloud(), column)
}

/// A cloud with one column more, of a case's own: one that did not fit would make the case say nothing.
///
/// # Panics
/// Where it has not as many values as there are surfels.
pub(crate) fn with_column(cloud: &Cloud, column: Column) -> Cloud {
    cloud.with_columns(vec![column]).expect("generated columns fit")
}

/// Light on some values: all of it, or none.
pub(crate) fn occluded() -> Vec<Hard> {
    let with_ao = |value: f32| {
        let mut surfels = small();
        surfels.ao = vec![value; surfels.positions.len()];
        surfels.cloud()
    };
    vec![("nothing reaches it", with_ao(0.0)), ("all reaches it", with_ao(1.0))]
}

/// Factors on whole scenes. Beyond them squares of lengths leave the range of f32.
pub(crate) const SIZES: [f32; 6] = [1e-6, 1e6, 1e-15, 1e15, 1e-30, 1e30];

/// A ball of another size.
pub(crate) fn sized(surfels: &Surfels, factor: f32) -> Surfels {
    let mut surfels = surfels.clone();
    surfels.positions.iter_mut().for_each(|place| *place *= factor);
    surfels.radii.iter_mut().for_each(|radius| *radius *= factor);
    surfels
}

/// A place where f32 resolves half a metre.
pub(crate) const FAR: DVec3 = DVec3::new(5e6, -4e6, 3e6);

/// Which of so many surfels comes to a place.
fn shuffled_from(to: usize, n: usize) -> usize {
    // A prime that divides no number of surfels here: multiples of it visit every place once.
    (to * 7919 + 13) % n
}

/// Where each of so many surfels goes.
pub(crate) fn shuffled_to(n: usize) -> Vec<u32> {
    let mut to = vec![0; n];
    for place in 0..n {
        to[shuffled_from(place, n)] = place as u32;
    }
    to
}

/// Positions, normals and the rest in another order.
pub(crate) fn shuffled(surfels: &Surfels) -> Surfels {
    let n = surfels.positions.len();
    let from = |to: usize| shuffled_from(to, n);
    fn taken<T: Copy>(list: &[T], from: impl Fn(usize) -> usize) -> Vec<T> {
        (0..list.len()).map(|to| list[from(to)]).collect()
    }
    Surfels {
        origin: surfels.origin,
        positions: taken(&surfels.positions, from),
        normals: taken(&surfels.normals, from),
        radii: taken(&surfels.radii, from),
        tangents: taken(&surfels.tangents, from),
        round: taken(&surfels.round, from),
        fields: taken(&surfels.fields, from),
        clips: taken(&surfels.clips, from),
        colors: taken(&surfels.colors, from),
        ao: taken(&surfels.ao, from),
        materials: taken(&surfels.materials, from),
    }
}
