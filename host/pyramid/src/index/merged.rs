//! Merged surfels of an inner node, with all columns of those that they stand for.

use glam::{DVec3, Vec3};
use std::ops::Range;
use surfelshop_api::columns::{
    AO, CLIP, COLOR, Element, MATERIAL, NORMAL, NORMAL_FIELD, PLANARITY, POSITION, RADIUS,
    TANGENT_U, TANGENT_V,
};
use surfelshop_api::format::INTENSITY;
use surfelshop_api::params::linear_to_srgb;
use surfelshop_cloud::{Buffer, Cloud, CloudError, Column};
use surfelshop_geometry::radii::PLANAR;
use surfelshop_raster::{Sample, merge_all, merge_neighbours};

/// A node has about so many surfels at most: a leaf's cell is divided where it has more, and merging goes on until
/// there are no more.
pub(crate) const NODE: usize = 1 << 15;

/// A round that leaves more than this share has surfels that do not look like any disc: the next one makes round
/// splats of them.
const STUCK: f64 = 0.6;

/// Round splats become so many times as coarse as surfels usually are; where that leaves too many, too, any number.
const ROUND: f32 = 4.0;

/// What is not kept by merged surfels: they are discs.
const SHAPES: [&str; 4] = [TANGENT_U, TANGENT_V, NORMAL_FIELD, CLIP];

/// Surfels of a node, and how coarse they are.
pub(crate) struct Merged {
    pub(crate) cloud: Cloud,
    /// The largest radius of one that stands for several, scene units.
    pub(crate) grain: f32,
    /// How far from it those lie at most, scene units.
    pub(crate) apart: f32,
}

/// One cloud for several: each of its surfels stands for up to four neighbours, and more where there would be too
/// many. `apart` says for each of the clouds how far what its own merged surfels stand for lies from them at most; of
/// a single one it is taken to be no more than its radius, which covers what it stands for.
pub(crate) fn merged(clouds: &[Cloud], apart: &[f32], origin: DVec3) -> Result<Merged, CloudError> {
    let rows: Vec<Row> = rows(clouds);
    let mut samples = samples(clouds, apart, origin);
    let mut members: Vec<Vec<u32>> = (0..samples.len() as u32).map(|row| vec![row]).collect();
    // How coarse round splats may be that surfels become which look like no disc.
    let mut round: Option<f32> = None;
    loop {
        let before = samples.len();
        for (number, sample) in (0..).zip(&mut samples) {
            sample.stands_for = number;
        }
        let found = match round {
            None => merge_neighbours(&mut samples),
            Some(coarsest) => merge_all(&mut samples, coarsest),
        };
        let of = |range: &Range<usize>| {
            let parts = samples[range.clone()].iter();
            parts.flat_map(|part| &members[part.stands_for as usize]).copied().collect()
        };
        members = found.iter().map(|(_, range)| of(range)).collect();
        samples = found.into_iter().map(|(one, _)| one).collect();
        if samples.len() <= NODE || (samples.len() == before && round == Some(f32::INFINITY)) {
            break;
        }
        if samples.len() as f64 > STUCK * before as f64 {
            round = Some(round.map_or(ROUND, |_| f32::INFINITY));
        }
    }
    let several = samples.iter().filter(|sample| sample.apart > 0.0);
    let grain = several.clone().map(|sample| sample.radius).fold(0.0, f32::max);
    let apart = several.map(|sample| sample.apart).fold(0.0, f32::max);
    let cloud = cloud(clouds, &rows, &samples, &members, origin)?;
    Ok(Merged { cloud, grain, apart })
}

/// A surfel of one of several clouds, and what it weighs.
struct Row {
    cloud: u32,
    index: u32,
    weight: f64,
}

fn rows(clouds: &[Cloud]) -> Vec<Row> {
    let mut rows = Vec::with_capacity(clouds.iter().map(Cloud::len).sum());
    for (number, cloud) in (0..).zip(clouds) {
        let radii = cloud.radii();
        rows.extend((0..).zip(radii).map(|(index, &radius)| Row {
            cloud: number,
            index,
            weight: f64::from(radius).powi(2),
        }));
    }
    rows
}

fn samples(clouds: &[Cloud], apart: &[f32], origin: DVec3) -> Vec<Sample> {
    let mut samples = Vec::with_capacity(clouds.iter().map(Cloud::len).sum());
    for (cloud, &apart) in clouds.iter().zip(apart) {
        let offset = cloud.origin() - origin;
        let (albedos, planarity) = (cloud.view().albedos(), cloud.floats(PLANARITY, 1));
        let (ao, materials) = (cloud.floats(AO, 1), materials(cloud));
        let (u, v) = (cloud.vectors(TANGENT_U), cloud.vectors(TANGENT_V));
        let surfels = cloud.positions().iter().zip(cloud.normals()).zip(cloud.radii());
        for (i, ((position, normal), &radius)) in surfels.enumerate() {
            // What an ellipse is drawn as beside it counts like what lies apart.
            let axis = |tangents: &[Vec3]| tangents.get(i).map_or(0.0, |tangent| tangent.length());
            let ellipse = axis(u).max(axis(v));
            samples.push(Sample {
                position: (offset + position.as_dvec3()).as_vec3().to_array(),
                normal: normal.to_array(),
                radius,
                is_round: planarity.get(i).is_some_and(|&planarity| planarity < PLANAR),
                albedo: albedos.get(i).copied().unwrap_or(Vec3::ZERO).to_array(),
                ao: ao.get(i).copied().unwrap_or(1.0),
                material: materials.and_then(|all| all.get(i)).copied().unwrap_or(0),
                stands_for: 0,
                apart: apart.min(radius).max(ellipse),
            });
        }
    }
    samples
}

fn materials(cloud: &Cloud) -> Option<&[u32]> {
    match cloud.column(MATERIAL)?.values() {
        Buffer::U32(values) => Some(values),
        _ => None,
    }
}

/// The cloud of merged surfels.
fn cloud(
    clouds: &[Cloud],
    rows: &[Row],
    samples: &[Sample],
    members: &[Vec<u32>],
    origin: DVec3,
) -> Result<Cloud, CloudError> {
    let floats = |of: &dyn Fn(&Sample) -> f32| Buffer::F32(samples.iter().map(of).collect());
    let vectors = |of: fn(&Sample) -> [f32; 3]| Buffer::F32(samples.iter().flat_map(of).collect());
    let mut columns: Vec<Column> = Vec::new();
    let all = clouds.iter().flat_map(Cloud::columns);
    for column in all {
        let name = column.name();
        let is_known = columns.iter().any(|known| known.name() == name);
        if is_known || SHAPES.contains(&name) {
            continue;
        }
        let n = column.components();
        let values = match name {
            POSITION => vectors(|sample| sample.position),
            NORMAL => vectors(|sample| sample.normal),
            RADIUS => floats(&|sample| sample.radius),
            AO => floats(&|sample| sample.ao),
            MATERIAL => Buffer::U32(samples.iter().map(|sample| sample.material).collect()),
            PLANARITY => {
                let mean = means(clouds, rows, members, column);
                // Of what was made round it is so that it stays round, and of a disc one.
                let value = |(sample, mean): (&Sample, f64)| {
                    let mean = if mean.is_finite() { mean as f32 } else { 1.0 };
                    let most = PLANAR * (1.0 - f32::EPSILON);
                    if sample.is_round { mean.min(most) } else { mean.max(PLANAR) }
                };
                Buffer::F32(samples.iter().zip(mean).map(value).collect())
            }
            COLOR => colors(clouds, rows, samples, members, column),
            _ if is_measured(name, column.values().element()) => {
                let mut values = Buffer::with_capacity(column.values().element(), 0);
                put(&mut values, means(clouds, rows, members, column));
                values
            }
            _ => majority(clouds, rows, members, column),
        };
        columns.push(Column::new(name, n, values));
    }
    let has_round = samples.iter().any(|sample| sample.is_round);
    if has_round && !columns.iter().any(|column| column.name() == PLANARITY) {
        let planarity = floats(&|sample| if sample.is_round { 0.0 } else { 1.0 });
        columns.push(Column::new(PLANARITY, 1, planarity));
    }
    Cloud::new(origin, columns)
}

/// Whether the mean of values means something: of classes, numbers of scans and identities it does not.
fn is_measured(name: &str, element: Element) -> bool {
    matches!(element, Element::F32 | Element::F64) || name == INTENSITY
}

/// Puts numbers into a column, whole ones rounded.
fn put(values: &mut Buffer, numbers: impl IntoIterator<Item = f64>) {
    let is_whole = !matches!(values.element(), Element::F32 | Element::F64);
    for number in numbers {
        values.push(if is_whole { number.round() } else { number });
    }
}

/// A surfel's values in a column of its cloud.
struct Lookup<'a>(Vec<Option<&'a Buffer>>, usize);

impl<'a> Lookup<'a> {
    fn new(clouds: &'a [Cloud], column: &Column) -> Self {
        let of = |cloud: &'a Cloud| {
            let found = cloud.column(column.name())?;
            let is_alike = found.components() == column.components()
                && found.values().element() == column.values().element();
            is_alike.then(|| found.values())
        };
        Self(clouds.iter().map(of).collect(), column.components() as usize)
    }

    fn get(&self, row: &Row, component: usize) -> Option<f64> {
        self.0[row.cloud as usize]?.get_f64(row.index as usize * self.1 + component)
    }
}

/// Means by area, all components of a surfel together; not finite where none has a number.
fn means(clouds: &[Cloud], rows: &[Row], members: &[Vec<u32>], column: &Column) -> Vec<f64> {
    let lookup = Lookup::new(clouds, column);
    let n = column.components() as usize;
    let mut means = Vec::with_capacity(members.len() * n);
    for group in members {
        for component in 0..n {
            let (mut sum, mut weights) = (0.0, 0.0);
            for row in group.iter().map(|&row| &rows[row as usize]) {
                let value = lookup.get(row, component).filter(|value| value.is_finite());
                if let Some(value) = value {
                    sum += value * row.weight;
                    weights += row.weight;
                }
            }
            means.push(sum / weights);
        }
    }
    means
}

/// The values that most of the area has; of equal ones the smallest.
fn majority(clouds: &[Cloud], rows: &[Row], members: &[Vec<u32>], column: &Column) -> Buffer {
    let lookup = Lookup::new(clouds, column);
    let mut values = Buffer::with_capacity(column.values().element(), 0);
    let mut seen: Vec<(f64, f64)> = Vec::new();
    for group in members {
        for component in 0..column.components() as usize {
            seen.clear();
            for row in group.iter().map(|&row| &rows[row as usize]) {
                let Some(value) = lookup.get(row, component) else { continue };
                match seen.iter_mut().find(|(known, _)| known.to_bits() == value.to_bits()) {
                    Some((_, weight)) => *weight += row.weight,
                    None => seen.push((value, row.weight)),
                }
            }
            let most = seen.iter().max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.total_cmp(&a.0)));
            values.push(most.map_or(0.0, |(value, _)| *value));
        }
    }
    values
}

/// Colours of merged surfels, in the type that they have.
fn colors(
    clouds: &[Cloud],
    rows: &[Row],
    samples: &[Sample],
    members: &[Vec<u32>],
    column: &Column,
) -> Buffer {
    let n = column.components() as usize;
    let opacity = (n > 3).then(|| means(clouds, rows, members, column));
    let element = column.values().element();
    let mut values = Buffer::with_capacity(element, samples.len() * n);
    for (i, sample) in samples.iter().enumerate() {
        for (channel, linear) in sample.albedo.into_iter().enumerate() {
            let value = match element {
                Element::U8 => f64::from(sample.code() >> (8 * channel) & 255),
                Element::U16 => {
                    (f64::from(linear_to_srgb(linear.clamp(0.0, 1.0))) * 65_535.0).round()
                }
                _ => f64::from(linear),
            };
            values.push(value);
        }
        if let Some(opacity) = &opacity {
            let value = opacity[n * i + 3];
            let is_whole = matches!(element, Element::U8 | Element::U16);
            values.push(if is_whole { value.round() } else { value });
        }
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(n: usize, origin: DVec3) -> Cloud {
        let at = |i: usize| [(i % n) as f32, (i / n) as f32, 0.0];
        let count = n * n;
        let columns = vec![
            Column::new(POSITION, 3, Buffer::F32((0..count).flat_map(at).collect())),
            Column::new(NORMAL, 3, Buffer::F32([0.0, 0.0, 1.0].repeat(count))),
            Column::new(RADIUS, 1, Buffer::F32(vec![1.0; count])),
            Column::new(COLOR, 3, Buffer::U8((0..count).flat_map(|_| [255, 0, 188]).collect())),
            Column::new(INTENSITY, 1, Buffer::U16((0..count).map(|i| i as u16 % 2).collect())),
            Column::new(
                "classification",
                1,
                Buffer::U8((0..count).map(|i| if i < 3 { 2 } else { 6 }).collect()),
            ),
        ];
        Cloud::new(origin, columns).unwrap()
    }

    #[test]
    fn merged_surfels_of_a_plane_cover_it_and_keep_its_columns() {
        let far = DVec3::new(1e6, -2e6, 30.0);
        let clouds = [plane(16, far), plane(16, far + DVec3::X * 16.0)];
        let found = merged(&clouds, &[0.0; 2], far + DVec3::X * 16.0).unwrap();
        assert_eq!(found.cloud.len(), 128);
        assert!(found.cloud.radii().iter().all(|&r| (1.5..2.0).contains(&r)));
        assert!(found.grain < 2.0 && (0.7..0.8).contains(&found.apart), "{}", found.apart);
        let area = |cloud: &Cloud| cloud.radii().iter().map(|r| r * r).sum::<f32>();
        let before: f32 = clouds.iter().map(area).sum();
        assert!(area(&found.cloud) > 0.7 * before);
        let mean: DVec3 =
            (0..128).filter_map(|i| found.cloud.world_position(i)).sum::<DVec3>() / 128.0;
        assert!((mean - far - DVec3::new(15.5, 7.5, 0.0)).length() < 1e-4, "{mean}");
        let column = |name: &str| found.cloud.column(name).unwrap().values().clone();
        assert_eq!(column(COLOR), Buffer::U8([255, 0, 188].repeat(128)));
        // Three of each cloud are of another class, and one merged surfel stands for two of them at least.
        let Buffer::U8(classes) = column("classification") else { panic!() };
        assert!((1..=4).contains(&classes.iter().filter(|&&class| class == 2).count()));
        assert!(classes.iter().all(|class| [2, 6].contains(class)));
        // The mean of 0 and 1, rounded away from 0.
        assert_eq!(column(INTENSITY), Buffer::U16(vec![1; 128]));
    }

    #[test]
    fn surfels_far_smaller_than_their_spacing_are_merged_all_the_same() {
        let n = 2 * NODE;
        let mut state = 5u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            100.0 * (state >> 8) as f32 / (1 << 24) as f32
        };
        let columns = vec![
            Column::new(POSITION, 3, Buffer::F32((0..3 * n).map(|_| random()).collect())),
            Column::new(NORMAL, 3, Buffer::F32([0.0, 0.0, 1.0].repeat(n))),
            Column::new(RADIUS, 1, Buffer::F32(vec![1e-4; n])),
        ];
        let cloud = Cloud::new(DVec3::ZERO, columns).unwrap();
        let found = merged(&[cloud], &[0.0], DVec3::ZERO).unwrap();
        assert!(found.cloud.len() <= NODE, "{}", found.cloud.len());
        assert!(found.grain > 0.5 && found.apart > 0.5, "it says how coarse it is");
    }

    #[test]
    fn what_does_not_look_like_discs_becomes_round_splats_once_it_is_too_many() {
        let n = 3 * NODE;
        let mut state = 7u32;
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        let places: Vec<f32> = (0..3 * n).map(|_| random()).collect();
        let normals = (0..n).flat_map(|i| match i % 3 {
            0 => [1.0, 0.0, 0.0],
            1 => [0.0, 1.0, 0.0],
            _ => [0.0, 0.0, 1.0],
        });
        let columns = vec![
            Column::new(POSITION, 3, Buffer::F32(places)),
            Column::new(NORMAL, 3, Buffer::F32(normals.collect())),
            Column::new(RADIUS, 1, Buffer::F32(vec![0.01; n])),
        ];
        let cloud = Cloud::new(DVec3::ZERO, columns).unwrap();
        let found = merged(&[cloud], &[0.0], DVec3::ZERO).unwrap();
        assert!(found.cloud.len() <= NODE, "{}", found.cloud.len());
        let planarity = found.cloud.floats(PLANARITY, 1);
        assert!(planarity.iter().filter(|&&planarity| planarity < PLANAR).count() > NODE / 8);
        assert!(found.apart < 0.1, "{}", found.apart);
    }
}
