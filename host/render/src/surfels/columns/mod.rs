//! Columns on the device: shared by every view, dropped when unused.

pub(crate) mod arranging;
pub(crate) mod changed;
pub(crate) mod demand;
pub(crate) mod elements;
pub(crate) mod order;
pub(crate) mod orders;
pub(crate) mod patch;
pub(crate) mod radii;
pub(crate) mod upload;
pub(crate) mod usage;

use crate::surfels::columns::demand::{ColumnDemand, DemandHistory, KEPT_FRAMES};
use crate::surfels::columns::elements::{clips_of, cuts, drawn_generation, fields_of};
use crate::surfels::columns::order::drawing_order;
use crate::surfels::columns::orders::{Order, order_as_before, ordered_by};
use crate::surfels::columns::radii::Radii;
use crate::surfels::cpu::columns::{OnHost, columns_drawn};
use crate::surfels::render_cloud::ChunkBuffers;
use std::cell::OnceCell;
use std::collections::HashMap;
use std::hash::{DefaultHasher, Hasher as _};
use std::sync::Arc;
use surfelshop_api::columns::{self, CloudView};

/// Bytes of the widest element drawn from a storage buffer: three floats.
pub(crate) const WIDEST_STRIDE: u64 = 12;
/// The same of surfels that have fields or are cut: seven floats.
pub(crate) const WIDEST_OF_SPLATS: u64 = 28;

/// A column on the device, in the order its cloud is drawn in.
pub(crate) struct Uploaded {
    pub(crate) buffers: ChunkBuffers,
    pub(crate) n_surfels: usize,
    pub(crate) bytes: u64,
    /// The largest value, for radii.
    pub(crate) largest: f32,
    pub(crate) last_used: u64,
}

/// All columns on the device, by their generation, the order they are drawn in and what they are
/// drawn as.
pub(crate) struct Columns {
    pub(crate) device: wgpu::Device,
    pub(crate) queue: wgpu::Queue,
    pub(crate) uploaded: HashMap<(u64, u32, &'static str), Uploaded>,
    pub(crate) on_host: Vec<OnHost>,
    orders: Vec<Order>,
    pub(crate) radii: Radii,
    wishes: DemandHistory,
    /// Clouds of so many surfels and more have all their columns.
    whole_from: usize,
    /// Whether what changed columns are made of is kept.
    pub(crate) expects_edits: bool,
    /// Serial numbers given away.
    pub(crate) n_orders: u32,
    pub(crate) chunk_len: u32,
    pub(crate) frame: u64,
    /// Columns uploaded since the engine was made.
    pub(crate) uploads: u32,
    /// Columns that were made of others on the device.
    pub(crate) patches: u32,
    /// Bytes of columns sent to the device.
    pub(crate) sent_bytes: u64,
}

impl Columns {
    /// A store whose chunks have at most `chunk_len` surfels, fewer where the device's bindings
    /// are smaller.
    pub(crate) fn new(device: wgpu::Device, queue: wgpu::Queue, chunk_len: u32) -> Self {
        let limits = device.limits();
        let bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let fits = u32::try_from(bytes / WIDEST_STRIDE).unwrap_or(u32::MAX);
        Self {
            device,
            queue,
            uploaded: HashMap::new(),
            on_host: Vec::new(),
            orders: Vec::new(),
            radii: Radii::default(),
            wishes: DemandHistory::default(),
            whole_from: usize::MAX,
            expects_edits: false,
            n_orders: 0,
            chunk_len: chunk_len.clamp(1, fits.max(1)),
            frame: 0,
            uploads: 0,
            patches: 0,
            sent_bytes: 0,
        }
    }

    /// Another, empty store for the same device, of which the same is wanted.
    pub(crate) fn another(&self) -> Self {
        let mut other = Self::new(self.device.clone(), self.queue.clone(), self.chunk_len);
        other.wishes = self.wishes.clone();
        other.frame = self.frame;
        other.whole_from = self.whole_from;
        other.expects_edits = self.expects_edits;
        other.radii.are_columns = self.radii.are_columns;
        other
    }

    /// The columns that something drawn of late reads, of those that can be done without.
    pub(crate) fn wanted(&self) -> ColumnDemand {
        self.wishes.at(self.frame)
    }

    /// The columns that a cloud of so many surfels is drawn with, of those that can be done without.
    pub(crate) fn wanted_of(&self, n_surfels: usize) -> ColumnDemand {
        if n_surfels >= self.whole_from { ColumnDemand::ALL } else { self.wanted() }
    }

    /// Has clouds of so many surfels and more drawn with all columns that they have.
    pub(crate) fn keep_whole_from(&mut self, n_surfels: usize) {
        self.whole_from = n_surfels;
    }

    /// Has equal radii uploaded as columns, or put into a constant.
    pub(crate) fn keep_radii(&mut self, keeps: bool) {
        self.radii.are_columns = keeps;
    }

    /// Whether a cloud's radii are one, in a constant.
    pub(crate) fn has_equal_radii(&self, cloud: &CloudView<'_>) -> bool {
        let column = cloud.column(columns::RADIUS);
        column.is_some_and(|column| self.radii.in_a_constant(drawn_generation(cloud, column)))
    }

    /// Whether a cloud's surfels are in order with all that is drawn of them, in memory where the
    /// processor draws; or are as soon as what changed is put to what is there.
    pub(crate) fn holds(&mut self, cloud: &CloudView<'_>, on_host: bool) -> bool {
        // What cannot be drawn has nothing to be put in order.
        let Some(drawn) = columns_drawn(cloud, self.wanted_of(cloud.len)) else { return true };
        if on_host && self.on_host.iter().any(|known| known.has(&drawn, cloud)) {
            return true;
        }
        let known = self.known_order(cloud).map(|order| order.serial);
        let next = self.frame + 1;
        if on_host {
            return known.is_some_and(|order| self.paintable(cloud, &drawn, order, next).is_some());
        }
        drawn.iter().all(|(name, generation)| {
            let is_there = self.uploaded.keys().any(|(own, ..)| own == generation);
            let patched = |order| self.predecessor((*generation, order, *name), cloud.len, next);
            is_there
                || *name == columns::RADIUS && self.radii.in_a_constant(*generation)
                || known.is_some_and(|order| patched(order).is_some())
        })
    }

    /// Takes what another store has for the same device.
    pub(crate) fn absorb(&mut self, other: Self) {
        let last_used = self.frame;
        let mut serials = HashMap::new();
        for order in other.orders {
            let known = self.orders.iter().find(|own| own.hash == order.hash);
            let serial = known.map(|own| own.serial).unwrap_or_else(|| {
                self.n_orders += 1;
                self.n_orders
            });
            serials.insert(order.serial, serial);
            self.orders.retain(|own| own.of != order.of);
            self.orders.push(Order { serial, last_used, ..order });
        }
        let uploaded = other.uploaded.into_iter().filter_map(|(key, column)| {
            let (generation, serial, variable) = key;
            let serial = *serials.get(&serial)?;
            Some(((generation, serial, variable), Uploaded { last_used, ..column }))
        });
        self.uploaded.extend(uploaded);
        for known in other.on_host {
            let Some(&order_serial) = serials.get(&known.order_serial) else { continue };
            // What was made of it meanwhile gives way, unless it has merged ones besides.
            let is_same =
                |own: &OnHost| own.drawn == known.drawn && own.order_serial == order_serial;
            if self.on_host.iter().any(|own| is_same(own) && (own.merged || !known.merged)) {
                continue;
            }
            self.on_host.retain(|own| !is_same(own));
            self.n_orders += 1;
            let serial = self.n_orders;
            self.on_host.push(OnHost { order_serial, serial, last_used, ..known });
        }
        self.radii.absorb(other.radii, last_used);
        self.uploads += other.uploads;
        self.patches += other.patches;
        self.sent_bytes += other.sent_bytes;
    }

    /// Bytes of columns on the device.
    pub(crate) fn bytes(&self) -> u64 {
        self.uploaded.values().map(|column| column.bytes).sum()
    }

    /// Bytes of columns in memory, as the CPU draws them.
    pub(crate) fn host_bytes(&self) -> u64 {
        // Orders of clouds that differ in attributes are one.
        let mut orders: Vec<&Arc<Vec<u32>>> =
            self.orders.iter().filter_map(|order| order.indices.as_ref()).collect();
        orders.extend(self.on_host.iter().filter_map(|cloud| cloud.columns.order()));
        orders.sort_by_key(|order| Arc::as_ptr(order));
        orders.dedup_by(|a, b| Arc::ptr_eq(a, b));
        let kept: usize = orders.iter().map(|order| size_of_val(order.as_slice())).sum();
        self.on_host.iter().map(|cloud| cloud.columns.bytes() as u64).sum::<u64>() + kept as u64
    }

    /// Drops what has not been drawn or read for a while; called once a frame, with what that reads.
    pub(crate) fn next_frame(&mut self, wanted: Option<ColumnDemand>) {
        self.frame += 1;
        match wanted {
            Some(wanted) => self.wishes.hear(wanted, self.frame),
            None => self.wishes.wait(),
        }
        let wanted = self.wanted();
        let oldest = self.frame.saturating_sub(KEPT_FRAMES);
        self.uploaded.retain(|(_, _, variable), column| {
            // Merged surfels are told apart by their materials.
            let is_read = column.n_surfels >= self.whole_from
                || wanted.reads(variable)
                || *variable == columns::MATERIAL;
            column.last_used >= oldest && is_read
        });
        self.on_host.retain(|cloud| cloud.last_used >= oldest);
        let whole_from = self.whole_from;
        for cloud in self.on_host.iter_mut().filter(|cloud| cloud.columns.len() < whole_from) {
            cloud.keep(wanted);
        }
        self.radii.forget(oldest);
        self.orders.retain(|order| order.last_used >= oldest);
    }

    /// The order of a cloud, where it is known or follows from a known one.
    fn known_order(&mut self, cloud: &CloudView<'_>) -> Option<&Order> {
        let of = ordered_by(cloud);
        let at = match self.orders.iter().position(|order| order.of == of) {
            Some(at) => at,
            None => {
                let order = order_as_before(&self.orders, cloud, &of)?;
                self.orders.push(order);
                self.orders.len() - 1
            }
        };
        let known = &mut self.orders[at];
        known.last_used = self.frame;
        Some(known)
    }

    /// The serial number of the order a cloud is drawn in, how many of its surfels are not cut, and the
    /// order itself where it had to be made to know.
    pub(crate) fn order(&mut self, cloud: &CloudView<'_>) -> (u32, u32, OnceCell<Arc<Vec<u32>>>) {
        if let Some(known) = self.known_order(cloud) {
            let indices = known.indices.clone().map(OnceCell::from).unwrap_or_default();
            return (known.serial, known.n_whole, indices);
        }
        let (of, last_used) = (ordered_by(cloud), self.frame);
        let indices = Arc::new(drawing_order(cloud));
        let clips = clips_of(cloud);
        let is_whole = |&i: &u32| !clips.is_some_and(|clips| cuts(&clips[i as usize]));
        let n_whole = indices.partition_point(is_whole) as u32;
        let mut hasher = DefaultHasher::new();
        hasher.write(bytemuck::cast_slice(&indices[..]));
        hasher.write_u32(n_whole);
        hasher.write_u64(widest_of(cloud));
        let hash = hasher.finish();
        // Other attributes rarely change the order; columns on the device then stay as they are.
        let equal = self.orders.iter().find(|order| order.hash == hash).map(|order| order.serial);
        let serial = equal.unwrap_or(self.n_orders + 1);
        self.n_orders = self.n_orders.max(serial);
        let kept = self.expects_edits.then(|| Arc::clone(&indices));
        self.orders.push(Order { of, serial, n_whole, hash, indices: kept, last_used });
        (serial, n_whole, OnceCell::from(indices))
    }
}

/// Bytes of the widest element that a cloud's surfels are drawn from.
pub(crate) fn widest_of(cloud: &CloudView<'_>) -> u64 {
    let are_splats = fields_of(cloud).is_some() || clips_of(cloud).is_some();
    if are_splats { WIDEST_OF_SPLATS } else { WIDEST_STRIDE }
}
