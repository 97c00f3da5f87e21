//! Which samples lie beside each other on the surface, and which face each other across a crease.

use super::samples::Samples;
use std::ops::Range;
use surfelshop_api::prelude::*;

/// Lists of samples, one for each sample, in one row.
#[derive(Default)]
pub(crate) struct Lists {
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl Lists {
    /// What a sample's list holds.
    pub(crate) fn of(&self, sample: u32) -> &[u32] {
        let sample = sample as usize;
        &self.items[self.starts[sample] as usize..self.starts[sample + 1] as usize]
    }

    /// For each of `n` items the rows that it is in.
    pub(crate) fn inverse(n: usize, rows: &[Vec<u32>]) -> Self {
        let mut starts = vec![0u32; n + 1];
        rows.iter().flatten().for_each(|&item| starts[item as usize + 1] += 1);
        for i in 0..n {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut items = vec![0; starts[n] as usize];
        for (number, row) in rows.iter().enumerate() {
            for &item in row {
                items[next[item as usize] as usize] = number as u32;
                next[item as usize] += 1;
            }
        }
        Self { starts, items }
    }

    /// Lists in which each pair is found from both ends.
    fn symmetric(n: usize, pairs: &[(u32, u32)]) -> Self {
        let mut starts = vec![0u32; n + 1];
        for &(a, b) in pairs {
            starts[a as usize + 1] += 1;
            starts[b as usize + 1] += 1;
        }
        for i in 0..n {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut items = vec![0; pairs.len() * 2];
        for &(a, b) in pairs {
            for (from, to) in [(a, b), (b, a)] {
                items[next[from as usize] as usize] = to;
                next[from as usize] += 1;
            }
        }
        for i in 0..n {
            items[starts[i] as usize..starts[i + 1] as usize].sort_unstable();
        }
        Self { starts, items }
    }
}

/// Samples beside each other.
pub(crate) struct Graph {
    /// Samples that are near and whose normals are alike.
    pub(crate) joined: Lists,
    /// Samples that are near, both among others of their like, and whose normals differ.
    pub(crate) across: Lists,
    /// Whether a sample, or one beside it, has others across a crease.
    pub(crate) by_edge: Vec<bool>,
}

/// How much farther than those nearest to either of them samples may lie apart to be beside each other,
/// where their discs do not touch: beyond are gaps.
const GAP: f64 = 3.0;

/// How many times as far as where their discs touch they may lie apart at most: the spacing of a sample
/// that is alone is its distance from all others.
const BEYOND: f64 = 2.0;

/// Samples whose mean distance is a sample's spacing.
const RING: usize = 4;

/// Cosine below which two normals are opposite: those are two sides of a sheet, not of a crease.
const OPPOSITE: f64 = -0.94;

/// Samples of its like that a sample needs around it to be a part of a face.
const FACE: usize = 3;

/// How much normals may bend around a sample of a face, as a share of the least bend of a crease: about
/// the square of the share of angles. Where all around bends as much there is no crease in it, but
/// detail that is sampled coarsely.
const FLAT: f64 = 0.1;

impl Graph {
    /// Links the samples. Normals are alike where the angle between them has a cosine of `alike` or more.
    pub(crate) fn of(
        samples: &Samples,
        alike: f64,
        share: Range<f64>,
        job: &Job<'_>,
    ) -> Result<Self> {
        let known = samples;
        let n = known.len();
        let spacings: Vec<f64> = (0..n).map(|i| spacing(known, i)).collect();
        let beside = |a: usize, b: usize| {
            let distance = known.points[a].distance(known.points[b]);
            let apart = known.discs[a] + known.discs[b];
            let spacing = spacings[a].min(spacings[b]);
            distance <= apart.max((GAP * spacing).min(BEYOND * apart))
        };
        let links = job.map(n, share, |i| {
            let mine = known.near[i].iter().map(|&other| other as usize);
            // Where both know each other, the lower one says so.
            let told = mine.filter(|&j| i < j || !known.near[j].contains(&(i as u32)));
            told.filter(|&j| beside(i, j)).map(|j| j as u32).collect::<Vec<u32>>()
        })?;
        let (mut alikes, mut differing) = (Vec::new(), Vec::new());
        for (i, links) in links.iter().enumerate() {
            for &j in links {
                let cosine = known.normals[i].dot(known.normals[j as usize]);
                if cosine >= alike {
                    alikes.push((i as u32, j));
                } else if cosine > OPPOSITE {
                    differing.push((i as u32, j));
                }
            }
        }
        job.check()?;
        let joined = Lists::symmetric(n, &alikes);
        let bend = FLAT * (1.0 - alike);
        let on_face: Vec<bool> = (0..n as u32)
            .map(|i| {
                let others = joined.of(i);
                let bends = others.iter().map(|&j| 1.0 - known.normal(j).dot(known.normal(i)));
                others.len() >= FACE && bends.sum::<f64>() <= bend * others.len() as f64
            })
            .collect();
        differing.retain(|&(a, b)| on_face[a as usize] && on_face[b as usize]);
        let across = Lists::symmetric(n, &differing);
        let ends = |i: u32| !across.of(i).is_empty();
        let by_edge =
            (0..n as u32).map(|i| ends(i) || joined.of(i).iter().any(|&j| ends(j))).collect();
        Ok(Self { joined, across, by_edge })
    }
}

/// Turns normals that nearly all samples in their plane say are the wrong way round, and returns how many.
pub(crate) fn turn(samples: &mut Samples, share: Range<f64>, job: &Job<'_>) -> Result<usize> {
    let wrong = job.map(samples.len(), share, |i| is_wrong(samples, i))?;
    for (normal, _) in samples.normals.iter_mut().zip(&wrong).filter(|(_, wrong)| **wrong) {
        *normal = -*normal;
    }
    Ok(wrong.iter().filter(|wrong| **wrong).count())
}

/// Mean distance of the nearest samples.
fn spacing(samples: &Samples, i: usize) -> f64 {
    let distances = samples.near[i].iter().map(|&j| samples.point(j).distance(samples.points[i]));
    let ring: Vec<f64> = distances.filter(|&distance| distance > 0.0).take(RING).collect();
    ring.iter().sum::<f64>() / ring.len().max(1) as f64
}

/// Whether nearly all samples in the plane of one have its normal the other way round.
fn is_wrong(samples: &Samples, i: usize) -> bool {
    let (point, normal) = (samples.points[i], samples.normals[i]);
    let (mut n_with, mut n_against) = (0usize, 0usize);
    for &j in &samples.near[i] {
        let offset = samples.point(j) - point;
        let cosine = normal.dot(samples.normal(j));
        let in_plane = normal.dot(offset).abs() <= 0.35 * offset.length();
        if in_plane && cosine.abs() > 0.7 {
            n_with += usize::from(cosine > 0.0);
            n_against += usize::from(cosine < 0.0);
        }
    }
    n_against >= 4 && n_against >= 5 * n_with
}
