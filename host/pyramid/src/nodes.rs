//! Nodes in memory: what was used last stays, within a budget.

use crate::error::PyramidError;
use crate::pyramid::Pyramid;
use rayon::prelude::*;
use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Duration;
use surfelshop_cloud::Cloud;

/// A node in memory.
struct Held {
    cloud: Arc<Cloud>,
    bytes: u64,
    last_used: u64,
    /// What of the look it was made with concerns it.
    version: u64,
}

#[derive(Default)]
struct State {
    held: HashMap<u32, Held>,
    bytes: u64,
    clock: u64,
    counts: NodesInMemory,
    /// Nodes that are to be read, the first first.
    wishes: Vec<u32>,
    /// What these are to look like.
    look: Arc<NodeLook>,
    /// Nodes that are being read.
    n_loading: usize,
    /// Nodes that were read since somebody waited for them.
    n_arrived: usize,
    fault: Option<PyramidError>,
    /// Nodes of a version that could not be read, and why not.
    bad: HashMap<(u32, u64), String>,
    has_ended: bool,
}

impl State {
    /// A node in memory that looks like this.
    fn held(&self, node: u32, look: &NodeLook) -> Option<Arc<Cloud>> {
        let held = self.held.get(&node).filter(|held| held.version == (look.version)(node));
        held.map(|held| Arc::clone(&held.cloud))
    }

    /// Whether nothing is left to be read.
    fn is_done(&self) -> bool {
        self.wishes.is_empty() && self.n_loading == 0
    }
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

/// What is shown of nodes.
pub struct NodeLook {
    /// Makes of a node, by its number, what is shown of it: edited, placed, coloured, filtered. A line where that cannot be.
    pub prepare: Box<dyn Fn(u32, Cloud) -> Result<Cloud, String> + Send + Sync>,
    /// Tells apart what becomes of a node: looks with the same number make the same of it.
    pub version: Box<dyn Fn(u32) -> u64 + Send + Sync>,
}

impl Default for NodeLook {
    /// As the file has them.
    fn default() -> Self {
        Self { prepare: Box::new(|_, cloud| Ok(cloud)), version: Box::new(|_| 0) }
    }
}

/// The nodes of a pyramid, of which those used last are kept in memory. Those that are wanted are read by a thread of
/// their own, which sleeps where there are none.
pub struct Nodes {
    store: Arc<NodeStore>,
    /// Whether the thread runs: it begins with the first wish.
    has_loader: OnceLock<bool>,
}

/// What the nodes and the thread that reads them share.
struct NodeStore {
    pyramid: Arc<Pyramid>,
    budget: u64,
    state: Mutex<State>,
    /// Told when there are wishes, or the nodes are no longer needed.
    wished: Condvar,
    /// Told when nodes have been read.
    arrived: Condvar,
}

impl Drop for Nodes {
    fn drop(&mut self) {
        let mut state = self.store.state();
        state.has_ended = true;
        state.wishes.clear();
        // The thread may be at work for a moment, and keeps the rest.
        state.held.clear();
        self.store.wished.notify_all();
    }
}

impl NodeStore {
    fn read(&self, node: u32, look: &NodeLook) -> Result<Cloud, PyramidError> {
        let cloud = self.pyramid.read(node)?;
        (look.prepare)(node, cloud).map_err(|line| PyramidError::file(self.pyramid.path(), line))
    }

    fn state(&self) -> MutexGuard<'_, State> {
        // What is in there is only ever changed whole.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Notes that nodes are in use, and those above them: what is drawn is chosen from them down.
    fn touch(&self, state: &mut State, nodes: &[u32]) {
        let clock = state.clock;
        for node in nodes.iter().flat_map(|&node| self.pyramid.above(node).chain([node])) {
            if let Some(held) = state.held.get_mut(&node) {
                held.last_used = clock;
            }
        }
    }

    /// Takes a node that was read.
    fn put(&self, state: &mut State, node: u32, look: &NodeLook, cloud: Cloud) -> Arc<Cloud> {
        let (cloud, version) = (Arc::new(cloud), (look.version)(node));
        let bytes = bytes_of(&cloud);
        state.counts.nodes_read += 1;
        state.counts.bytes_read += self.pyramid.nodes()[node as usize].stored_bytes();
        let held = Held { cloud: Arc::clone(&cloud), bytes, last_used: state.clock, version };
        if let Some(old) = state.held.insert(node, held) {
            state.bytes -= old.bytes;
        }
        state.bytes += bytes;
        cloud
    }

    /// Reads what is wished for, the first wishes first, until the nodes are no longer needed.
    fn load(&self) {
        loop {
            let (next, look): (Vec<u32>, _) = {
                let mut state = self.state();
                while state.wishes.is_empty() && !state.has_ended {
                    state = self.wished.wait(state).unwrap_or_else(PoisonError::into_inner);
                }
                if state.has_ended {
                    return;
                }
                let mut wishes = std::mem::take(&mut state.wishes);
                let look = Arc::clone(&state.look);
                wishes.retain(|node| state.held(*node, &look).is_none());
                let n = wishes.len().min(rayon::current_num_threads());
                state.wishes = wishes.split_off(n);
                state.n_loading = n;
                (wishes, look)
            };
            let read = |node: u32| {
                if self.state().has_ended {
                    return None;
                }
                // What goes wrong in here is one node's fault, and must not keep others waiting.
                let read = catch_unwind(AssertUnwindSafe(|| self.read(node, &look)));
                let line = format!(
                    "node {node} cannot be made ready; `surfelshop index` makes another pyramid"
                );
                let read = read
                    .unwrap_or_else(|_panic| Err(PyramidError::file(self.pyramid.path(), line)));
                Some((node, read))
            };
            let read: Vec<_> = next.into_par_iter().filter_map(read).collect();
            let mut state = self.state();
            if state.has_ended {
                return;
            }
            for (node, cloud) in read {
                match cloud {
                    Ok(cloud) => {
                        self.put(&mut state, node, &look, cloud);
                        state.n_arrived += 1;
                    }
                    Err(error) => {
                        // One that fails would fail again.
                        state.wishes.clear();
                        state.bad.insert((node, (look.version)(node)), error.to_string());
                        state.fault.get_or_insert(error);
                    }
                }
            }
            state.n_loading = 0;
            let clock = state.clock;
            let_go(&mut state, self.budget, clock);
            self.arrived.notify_all();
        }
    }
}

impl Nodes {
    /// Keeps at most so many bytes of prepared nodes, beside those that are asked for together.
    #[must_use]
    pub fn new(pyramid: Arc<Pyramid>, budget: u64) -> Self {
        let (state, wished, arrived) = Default::default();
        let store = Arc::new(NodeStore { pyramid, budget, state, wished, arrived });
        Self { store, has_loader: OnceLock::new() }
    }

    /// The pyramid.
    #[must_use]
    pub fn pyramid(&self) -> &Arc<Pyramid> {
        &self.store.pyramid
    }

    /// Whether a node is in memory, of whatever look.
    #[must_use]
    pub fn has(&self, node: u32) -> bool {
        self.store.state().held.contains_key(&node)
    }

    /// What is in memory.
    #[must_use]
    pub fn in_memory(&self) -> NodesInMemory {
        let state = self.store.state();
        NodesInMemory { nodes: state.held.len() as u64, bytes: state.bytes, ..state.counts }
    }

    /// Wishes for nodes, the first of them first, in the place of all earlier wishes; those that are in use stay
    /// meanwhile. Returns at once.
    pub fn wish(&self, in_use: &[u32], wishes: Vec<u32>, look: &Arc<NodeLook>) {
        let has_loader = *self.has_loader.get_or_init(|| {
            let store = Arc::clone(&self.store);
            let thread = std::thread::Builder::new().name("pyramid nodes".to_owned());
            thread.spawn(move || store.load()).is_ok()
        });
        {
            let mut state = self.store.state();
            state.clock += 1;
            self.store.touch(&mut state, in_use);
            if let Some(line) =
                wishes.iter().find_map(|&node| state.bad.get(&(node, (look.version)(node))))
            {
                let fault = PyramidError::Points(line.clone());
                state.fault.get_or_insert(fault);
                return;
            }
            if has_loader {
                (state.wishes, state.look) = (wishes, Arc::clone(look));
                self.store.wished.notify_all();
                return;
            }
        }
        // Where the system has no thread to give, this one reads.
        if let Err(error) = self.get(&wishes, look) {
            self.store.state().fault.get_or_insert(error);
        }
        self.store.state().n_arrived += 1;
    }

    /// Whether nodes that were wished for are still to come.
    #[must_use]
    pub fn is_loading(&self) -> bool {
        !self.store.state().is_done()
    }

    /// Waits until nodes have arrived since this was asked last, there are no wishes left, or so much time has passed;
    /// whether some have arrived.
    ///
    /// # Errors
    /// That of a node that could not be read.
    pub fn wait(&self, longest: Duration) -> Result<bool, PyramidError> {
        let state = self.store.state();
        let is_idle =
            |state: &mut State| state.n_arrived == 0 && !state.is_done() && state.fault.is_none();
        let waited = self.store.arrived.wait_timeout_while(state, longest, is_idle);
        let (mut state, _) = waited.unwrap_or_else(PoisonError::into_inner);
        match state.fault.take() {
            Some(fault) => Err(fault),
            None => Ok(std::mem::take(&mut state.n_arrived) > 0),
        }
    }

    /// These nodes, read where they are not in memory with this look, on all threads. Others go where the budget is exceeded, those
    /// first that were used the longest time ago.
    ///
    /// # Errors
    /// That of the first node that could not be read.
    pub fn get(&self, nodes: &[u32], look: &NodeLook) -> Result<Vec<Arc<Cloud>>, PyramidError> {
        let store = &*self.store;
        let mut found: Vec<Option<Arc<Cloud>>> = {
            let mut state = store.state();
            state.clock += 1;
            store.touch(&mut state, nodes);
            let held = |node: &u32| state.held(*node, look);
            nodes.iter().map(held).collect()
        };
        let missing: Vec<usize> = (0..nodes.len()).filter(|&i| found[i].is_none()).collect();
        let read: Vec<(usize, Result<Cloud, PyramidError>)> =
            missing.into_par_iter().map(|i| (i, store.read(nodes[i], look))).collect();
        let mut state = store.state();
        let mut fault = None;
        for (i, cloud) in read {
            match cloud {
                Ok(cloud) => found[i] = Some(store.put(&mut state, nodes[i], look, cloud)),
                Err(error) => fault = fault.or(Some(error)),
            }
        }
        // What was read meanwhile by others is as new.
        store.touch(&mut state, nodes);
        let clock = state.clock;
        let_go(&mut state, store.budget, clock);
        match fault {
            Some(fault) => Err(fault),
            None => Ok(found.into_iter().flatten().collect()),
        }
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
