//! How many surfels of a pyramid are selected.

use crate::error::PyramidError;
use crate::pyramid::Pyramid;
use glam::DVec3;
use rayon::prelude::*;
use surfelshop_cloud::Progress;
use surfelshop_cloud::selection::{Ball, EditLayer, HiddenOnes, Reach, RegionSelection};

/// Leaves that are looked at together: between them it can be stopped.
const TOGETHER: usize = 64;

impl Pyramid {
    /// A ball around all surfels of a node, discs and all, in the coordinates of the file; `None` where there is no such
    /// node.
    #[must_use]
    pub fn ball(&self, node: u32) -> Option<Ball> {
        let record = self.nodes().get(node as usize)?;
        Some((record.middle, f64::from(record.spread) + f64::from(record.reach)))
    }

    /// Whether the file has a column.
    #[must_use]
    pub fn has_column(&self, name: &str) -> bool {
        self.directory().columns.iter().any(|column| column.name == name)
    }

    /// Leaves of which a selection may have something that edits leave, as far as that is told quickly, ascending; where
    /// there are more than `most` of them, one more.
    #[must_use]
    pub fn leaves_reached(
        &self,
        (layer, selection): (&EditLayer, &RegionSelection),
        most: usize,
    ) -> Vec<u32> {
        let (mut leaves, mut open) = (Vec::new(), vec![0u32]);
        while let (Some(node), true) = (open.pop(), leaves.len() <= most) {
            let (Some(ball), Some(record)) = (self.ball(node), self.nodes().get(node as usize))
            else {
                continue;
            };
            let reach = selection.reach(ball.0, ball.1);
            if reach == Reach::Nothing || layer.removes(ball, HiddenOnes::LeftOut) {
                continue;
            }
            if record.is_leaf() {
                leaves.push(node);
            }
            let [first, count] = record.children;
            open.extend((first..first + count).rev());
        }
        leaves
    }

    /// How many surfels of the leaves are selected, and how many there are, with these edits done. Leaves of which a
    /// selection has all or nothing are not read.
    ///
    /// # Errors
    /// As [`read`](Self::read), where a column is not there that selects, and where `progress` ends it.
    pub fn selected(
        &self,
        (layer, selection): (&EditLayer, &RegionSelection),
        progress: Progress<'_>,
    ) -> Result<[u64; 2], PyramidError> {
        let leaves = (0..).zip(self.nodes()).filter(|(_, record)| record.is_leaf());
        let leaves: Vec<(u32, u64)> =
            leaves.map(|(node, record)| (node, u64::from(record.n_surfels))).collect();
        let of_leaf = |&(node, n): &(u32, u64)| -> Result<[u64; 2], PyramidError> {
            let ball = self.ball(node);
            let around = ball.unwrap_or((DVec3::NAN, f64::NAN));
            if layer.removes(around, HiddenOnes::LeftOut) {
                return Ok([0, 0]);
            }
            if layer.version(around, |name| self.has_column(name)) == 0 {
                match selection.reach(around.0, around.1) {
                    Reach::Nothing => return Ok([0, n]),
                    Reach::All => return Ok([n, n]),
                    Reach::Some => {}
                }
            }
            let fault =
                |error: &dyn std::fmt::Display| PyramidError::file(self.path(), error.to_string());
            let leaf = layer
                .applied(self.read(node)?, ball, HiddenOnes::LeftOut)
                .map_err(|error| fault(&error))?;
            if leaf.is_empty() {
                return Ok([0, 0]);
            }
            let chosen = selection.select(&leaf).map_err(|error| fault(&error))?;
            Ok([chosen.count() as u64, leaf.len() as u64])
        };
        let mut sum = [0, 0];
        for (i, some) in leaves.chunks(TOGETHER).enumerate() {
            let done = (i * TOGETHER) as f64 / leaves.len() as f64;
            if progress(done).is_break() {
                return Err(PyramidError::Points("cancelled; nothing was written".to_owned()));
            }
            let counts = some.par_iter().map(of_leaf).collect::<Result<Vec<_>, _>>()?;
            for [selected, all] in counts {
                sum = [sum[0] + selected, sum[1] + all];
            }
        }
        Ok(sum)
    }
}
