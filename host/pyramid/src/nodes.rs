//! Nodes in memory: what was used last stays, within a budget.

use crate::error::PyramidError;
use crate::pyramid::Pyramid;
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use surfelshop_cloud::Cloud;

/// A node in memory.
struct Held {
    cloud: Arc<Cloud>,
    bytes: u64,
    last_used: u64,
}

#[derive(Default)]
struct State {
    held: HashMap<u32, Held>,
    bytes: u64,
    clock: u64,
    counts: NodesInMemory,
}

/// What is in memory, and what was read for it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct NodesInMemory {
    /// Nodes in memory.
    pub nodes: u64,
    /// Their bytes.
    pub bytes: u64,
    /// Nodes read since it was opened.
    pub nodes_read: u64,
    /// Bytes of the file that these took.
    pub bytes_read: u64,
}

/// Makes of a node what is shown of it: placed, coloured, filtered. A line where that cannot be.
pub type Prepare = Box<dyn Fn(Cloud) -> Result<Cloud, String> + Send + Sync>;

/// The nodes of a pyramid, of which those used last are kept in memory.
pub struct Nodes {
    pyramid: Arc<Pyramid>,
    budget: u64,
    prepare: Prepare,
    state: Mutex<State>,
}

impl Nodes {
    /// Keeps at most so many bytes of prepared nodes, beside those that are asked for together.
    #[must_use]
    pub fn new(pyramid: Arc<Pyramid>, budget: u64, prepare: Prepare) -> Self {
        Self { pyramid, budget, prepare, state: Mutex::default() }
    }

    fn read(&self, node: u32) -> Result<Cloud, PyramidError> {
        let cloud = self.pyramid.read(node)?;
        (self.prepare)(cloud).map_err(|line| PyramidError::file(self.pyramid.path(), line))
    }

    /// The pyramid.
    #[must_use]
    pub fn pyramid(&self) -> &Arc<Pyramid> {
        &self.pyramid
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // What is in there is only ever changed whole.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether a node is in memory.
    #[must_use]
    pub fn has(&self, node: u32) -> bool {
        self.state().held.contains_key(&node)
    }

    /// What is in memory.
    #[must_use]
    pub fn in_memory(&self) -> NodesInMemory {
        let state = self.state();
        NodesInMemory { nodes: state.held.len() as u64, bytes: state.bytes, ..state.counts }
    }

    /// These nodes, read where they are not in memory, on all threads. Others go where the budget is exceeded, those
    /// first that were used the longest time ago.
    ///
    /// # Errors
    /// That of the first node that could not be read.
    pub fn get(&self, nodes: &[u32]) -> Result<Vec<Arc<Cloud>>, PyramidError> {
        let mut found: Vec<Option<Arc<Cloud>>> = {
            let mut state = self.state();
            state.clock += 1;
            let clock = state.clock;
            nodes
                .iter()
                .map(|node| {
                    let held = state.held.get_mut(node)?;
                    held.last_used = clock;
                    Some(Arc::clone(&held.cloud))
                })
                .collect()
        };
        let missing: Vec<usize> = (0..nodes.len()).filter(|&i| found[i].is_none()).collect();
        let read: Vec<(usize, Result<Cloud, PyramidError>)> =
            missing.into_par_iter().map(|i| (i, self.read(nodes[i]))).collect();
        let mut state = self.state();
        let clock = state.clock;
        // Those above stay, too: what is drawn is chosen from them down.
        for above in nodes.iter().flat_map(|&node| self.pyramid.above(node)) {
            if let Some(held) = state.held.get_mut(&above) {
                held.last_used = clock;
            }
        }
        for (i, cloud) in read {
            let cloud = Arc::new(cloud?);
            let bytes = bytes_of(&cloud);
            let record = &self.pyramid.nodes()[nodes[i] as usize];
            state.counts.nodes_read += 1;
            state.counts.bytes_read += record.stored_bytes();
            let held = Held { cloud: Arc::clone(&cloud), bytes, last_used: clock };
            if let Some(old) = state.held.insert(nodes[i], held) {
                state.bytes -= old.bytes;
            }
            state.bytes += bytes;
            found[i] = Some(cloud);
        }
        let_go(&mut state, self.budget, clock);
        Ok(found.into_iter().flatten().collect())
    }
}

/// Lets go of what was used the longest time ago, until the rest fits; what is in use stays.
fn let_go(state: &mut State, budget: u64, clock: u64) {
    if state.bytes <= budget {
        return;
    }
    let mut by_age: Vec<(u64, u32)> =
        state.held.iter().map(|(node, held)| (held.last_used, *node)).collect();
    by_age.sort_unstable();
    for (last_used, node) in by_age {
        if state.bytes <= budget || last_used == clock {
            return;
        }
        if let Some(held) = state.held.remove(&node) {
            state.bytes -= held.bytes;
        }
    }
}

/// Bytes of a cloud's columns.
fn bytes_of(cloud: &Cloud) -> u64 {
    let bytes = |column: &surfelshop_cloud::Column| {
        (column.values().len() * column.values().element().size()) as u64
    };
    cloud.columns().iter().map(bytes).sum()
}
