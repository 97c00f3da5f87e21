//! Columns on the device: uploaded when first drawn, shared by every view, dropped when unused.

use super::drawn::{ChunkBuffers, DrawnCloud};
use super::elements::{
    clip_drawn, clips_of, components_of, cuts, encode_color, field_drawn, fields_of, floats_of,
    is_color, part_of,
};
use super::host_columns::{ORDERED, OnHost, STOPPED, columns_drawn};
use super::order::{TIE_BREAKERS, drawing_order};
use super::radii::Radii;
use super::wanted::{Wanted, Wishes};
use crate::run::RenderError;
use std::cell::OnceCell;
use std::collections::HashMap;
use std::hash::{DefaultHasher, Hasher as _};
use std::sync::Arc;
use surfelshop_api::columns::{self, CloudView, ColumnView, Values};

/// Bytes of the widest element drawn from a storage buffer: three floats.
const WIDEST_STRIDE: u64 = 12;
/// The same of surfels that have fields or are cut: seven floats.
const WIDEST_OF_SPLATS: u64 = 28;

/// Chunks of clouds with merged surfels are made of whole groups.
const GROUP: u32 = surfelshop_raster::GROUP as u32;

/// Surfels put in order at a time on their way to the device.
const BATCH: usize = 4096;

/// Frames a column survives without being drawn.
pub(super) const KEPT_FRAMES: u64 = 64;

struct Uploaded {
    buffers: ChunkBuffers,
    n_surfels: usize,
    bytes: u64,
    /// The largest value, for radii.
    largest: f32,
    last_used: u64,
}

/// The order a cloud is drawn in. The indices themselves are made again when a column is uploaded:
/// they take as much memory as a column, and are rarely needed twice.
struct Order {
    /// Generations of the columns it follows from.
    of: Vec<u64>,
    /// Equal for equal orders.
    serial: u32,
    /// Surfels that are not cut, which come first.
    n_whole: u32,
    /// Hash of the indices, and of what divides them into chunks.
    hash: u64,
    last_used: u64,
}

/// A cloud on its way to the device.
struct Arriving<'a> {
    cloud: &'a CloudView<'a>,
    order_serial: u32,
    /// Indices of the surfels in drawing order, once a column needs them.
    order: OnceCell<Vec<u32>>,
    drawn: DrawnCloud,
}

/// All columns on the device, by their generation, the order they are drawn in and what they are
/// drawn as.
pub(crate) struct Columns {
    device: wgpu::Device,
    queue: wgpu::Queue,
    uploaded: HashMap<(u64, u32, &'static str), Uploaded>,
    pub(super) on_host: Vec<OnHost>,
    orders: Vec<Order>,
    pub(super) radii: Radii,
    wishes: Wishes,
    /// Clouds of so many surfels and more have all their columns.
    whole_from: usize,
    /// Serial numbers given away.
    pub(super) n_orders: u32,
    pub(super) chunk_len: u32,
    pub(super) frame: u64,
    /// Columns uploaded since the engine was made.
    pub(crate) uploads: u32,
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
            wishes: Wishes::default(),
            whole_from: usize::MAX,
            n_orders: 0,
            chunk_len: chunk_len.clamp(1, fits.max(1)),
            frame: 0,
            uploads: 0,
        }
    }

    /// Another, empty store for the same device, of which the same is wanted.
    pub(crate) fn another(&self) -> Self {
        let mut other = Self::new(self.device.clone(), self.queue.clone(), self.chunk_len);
        other.wishes = self.wishes.clone();
        other.frame = self.frame;
        other.whole_from = self.whole_from;
        other.radii.are_columns = self.radii.are_columns;
        other
    }

    /// The columns that something drawn of late reads, of those that can be done without.
    pub(crate) fn wanted(&self) -> Wanted {
        self.wishes.at(self.frame)
    }

    /// The columns that a cloud of so many surfels is drawn with, of those that can be done without.
    pub(crate) fn wanted_of(&self, n_surfels: usize) -> Wanted {
        if n_surfels >= self.whole_from { Wanted::ALL } else { self.wanted() }
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
        column.is_some_and(|column| self.radii.in_a_constant(column.generation))
    }

    /// Whether a cloud's surfels are in order with all that is drawn of them, in memory where the
    /// processor draws.
    pub(crate) fn holds(&self, cloud: &CloudView<'_>, on_host: bool) -> bool {
        // What cannot be drawn has nothing to be put in order.
        let Some(drawn) = columns_drawn(cloud, self.wanted_of(cloud.len)) else { return true };
        if on_host {
            return self.on_host.iter().any(|known| known.has(&drawn, cloud));
        }
        drawn.iter().all(|(name, drawn)| {
            let is_there = self.uploaded.keys().any(|(own, ..)| own == drawn);
            is_there || *name == columns::RADIUS && self.radii.in_a_constant(*drawn)
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
    }

    /// Bytes of columns on the device.
    pub(crate) fn bytes(&self) -> u64 {
        self.uploaded.values().map(|column| column.bytes).sum()
    }

    /// Bytes of columns in memory, as the processor draws them.
    pub(crate) fn host_bytes(&self) -> u64 {
        self.on_host.iter().map(|cloud| cloud.columns.bytes() as u64).sum()
    }

    /// Drops what has not been drawn or read for a while; called once a frame, with what that reads.
    pub(crate) fn next_frame(&mut self, wanted: Option<Wanted>) {
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

    /// The serial number of the order a cloud is drawn in, how many of its surfels are not cut, and the
    /// order itself where it had to be made to know.
    pub(super) fn order(&mut self, cloud: &CloudView<'_>) -> (u32, u32, OnceCell<Vec<u32>>) {
        let names = [columns::POSITION].into_iter().chain(TIE_BREAKERS);
        let of: Vec<u64> =
            names.filter_map(|name| cloud.column(name)).map(|column| column.generation).collect();
        let last_used = self.frame;
        if let Some(known) = self.orders.iter_mut().find(|order| order.of == of) {
            known.last_used = last_used;
            return (known.serial, known.n_whole, OnceCell::new());
        }
        let indices = drawing_order(cloud);
        let clips = clips_of(cloud);
        let is_whole = |&i: &u32| !clips.is_some_and(|clips| cuts(&clips[i as usize]));
        let n_whole = indices.partition_point(is_whole) as u32;
        let mut hasher = DefaultHasher::new();
        hasher.write(bytemuck::cast_slice(&indices));
        hasher.write_u32(n_whole);
        hasher.write_u64(widest_of(cloud));
        let hash = hasher.finish();
        // Other attributes rarely change the order; columns on the device then stay as they are.
        let equal = self.orders.iter().find(|order| order.hash == hash).map(|order| order.serial);
        let serial = equal.unwrap_or(self.n_orders + 1);
        self.n_orders = self.n_orders.max(serial);
        self.orders.push(Order { of, serial, n_whole, hash, last_used });
        (serial, n_whole, OnceCell::from(indices))
    }

    /// Brings the columns a cloud is drawn with onto the device, and behind them those of surfels that
    /// stand for several where it is to be drawn with `merged` ones.
    ///
    /// # Errors
    /// Where a column that drawing needs is missing or of another type.
    pub(crate) fn cloud(
        &mut self,
        cloud: &CloudView<'_>,
        merged: bool,
        tell: &(dyn Fn(f32) -> bool + Sync),
    ) -> Result<DrawnCloud, RenderError> {
        let n_surfels = counted(cloud)?;
        let mut drawn = DrawnCloud {
            origin: cloud.origin,
            n_surfels,
            n_places: n_surfels,
            n_whole: n_surfels,
            chunk_len: self.chunk_len_for(cloud),
            columns: Vec::new(),
            defines: Vec::new(),
            generations: Vec::new(),
            max_radius: 0.0,
            equal_radius: None,
            on_host: None,
            merged: None,
        };
        let wanted = self.wanted_of(cloud.len).for_merged(merged);
        let (order_serial, n_whole, order) = match merged {
            true => {
                let known = self.in_memory(cloud, true, tell)?;
                let n_places = known.columns.n_places();
                drawn.merged = Some(known.columns.clone());
                let (serial, n_whole) = (known.serial, known.n_whole);
                drawn.n_places = numbered(n_places)?;
                drawn.chunk_len = (drawn.chunk_len / GROUP).max(1) * GROUP;
                (serial, n_whole, OnceCell::new())
            }
            false => self.order(cloud),
        };
        // Behind the last of the surfels stand merged ones, which are not cut.
        drawn.n_whole = if n_whole < n_surfels { n_whole } else { drawn.n_places };
        let mut arriving = Arriving { cloud, order_serial, order, drawn };
        // Of all columns that there may be these are the largest.
        let told = |columns: f32| match tell(ORDERED + (1.0 - ORDERED) * columns) {
            true => Ok(()),
            false => Err(RenderError::Cloud(STOPPED.to_owned())),
        };
        told(0.0)?;
        self.floats(columns::POSITION, &mut arriving)?;
        told(0.3)?;
        self.floats(columns::NORMAL, &mut arriving)?;
        told(0.6)?;
        self.shape(merged, &mut arriving)?;
        if let Some(merged) = &arriving.drawn.merged {
            arriving.drawn.max_radius = arriving.drawn.max_radius.max(merged.max_reach());
        }
        self.splats(wanted, &mut arriving);
        if wanted.ao && cloud.floats(columns::AO, 1).is_some() {
            self.floats(columns::AO, &mut arriving)?;
            arriving.drawn.defines.push("AO");
        }
        if let Some(column) = cloud.column(columns::MATERIAL)
            && wanted.material
            && let (1, Values::U32(values)) = (column.components, column.values)
        {
            let encode = |i: usize, out: &mut Vec<u8>| out.extend(values[i].to_le_bytes());
            self.upload(column, columns::MATERIAL, &encode, 4, 0.0, &mut arriving);
            arriving.drawn.defines.push("MATERIAL");
        }
        if let Some(column) = cloud.column(columns::COLOR)
            && wanted.color
            && is_color(column)
        {
            let (layout, stride): (_, u64) = match column.values {
                Values::U8(_) => ("COLOR8", 4),
                _ => ("COLOR16", 8),
            };
            let encode = |i: usize, out: &mut Vec<u8>| encode_color(column, i, out);
            self.upload(column, columns::COLOR, &encode, stride, 0.0, &mut arriving);
            arriving.drawn.defines.push(layout);
        }
        told(1.0)?;
        Ok(arriving.drawn)
    }

    /// Brings along how large surfels are: half axes, radii, or one radius for all.
    fn shape(&mut self, merged: bool, arriving: &mut Arriving<'_>) -> Result<(), RenderError> {
        let cloud = arriving.cloud;
        let tangents = [columns::TANGENT_U, columns::TANGENT_V];
        if tangents.iter().all(|name| cloud.floats(name, 3).is_some()) {
            for name in tangents {
                let largest = self.floats(name, arriving)?;
                // The largest component bounds the length of a tangent within a factor of sqrt(3),
                // and two skewed ones that of the ellipse within sqrt(2) more.
                let bound = arriving.drawn.max_radius.max(largest * 2.45);
                arriving.drawn.max_radius = bound;
            }
            arriving.drawn.defines.push("TANGENTS");
        } else if !merged && let Some(radius) = self.radii.equal(cloud, self.frame) {
            arriving.drawn.max_radius = radius.abs();
            arriving.drawn.equal_radius = Some(radius);
            arriving.drawn.defines.push("EQUAL_RADII");
            let column = cloud.column(columns::RADIUS);
            arriving.drawn.generations.extend(column.map(|column| column.generation));
        } else {
            arriving.drawn.max_radius = self.floats(columns::RADIUS, arriving)?;
        }
        Ok(())
    }

    /// Brings along normal fields, and the lines that cut surfels.
    fn splats(&mut self, wanted: Wanted, arriving: &mut Arriving<'_>) {
        let cloud = arriving.cloud;
        if let (Some(fields), true) = (fields_of(cloud), wanted.fields)
            && let Some(column) = cloud.column(columns::NORMAL_FIELD)
        {
            let encode = |i: usize, out: &mut Vec<u8>| {
                out.extend_from_slice(bytemuck::cast_slice(&field_drawn(fields[i])));
            };
            self.upload(column, columns::NORMAL_FIELD, &encode, 16, 0.0, arriving);
        }
        if arriving.drawn.n_whole < arriving.drawn.n_places
            && let (Some(clips), Some(column)) = (clips_of(cloud), cloud.column(columns::CLIP))
        {
            let encode = |i: usize, out: &mut Vec<u8>| {
                out.extend_from_slice(bytemuck::cast_slice(&clip_drawn(clips[i])));
            };
            self.upload(column, columns::CLIP, &encode, WIDEST_OF_SPLATS, 0.0, arriving);
        }
    }

    /// Surfels in a chunk of a cloud at most.
    fn chunk_len_for(&self, cloud: &CloudView<'_>) -> u32 {
        // A number that fits 64 bits: both factors are below 2^32.
        let len = u64::from(self.chunk_len) * WIDEST_STRIDE / widest_of(cloud);
        u32::try_from(len).unwrap_or(u32::MAX).max(1)
    }

    /// Uploads a column of floats and returns its largest magnitude.
    fn floats(
        &mut self,
        name: &'static str,
        arriving: &mut Arriving<'_>,
    ) -> Result<f32, RenderError> {
        let cloud = arriving.cloud;
        let components = components_of(name);
        let values = floats_of(cloud, name)?;
        let Some(column) = cloud.column(name) else { return Ok(0.0) };
        let known =
            self.uploaded.get(&(column.generation, arriving.order_serial, name)).map(|c| c.largest);
        let largest =
            known.unwrap_or_else(|| values.iter().fold(0.0f32, |most, v| most.max(v.abs())));
        let n = components as usize;
        let encode = |i: usize, out: &mut Vec<u8>| {
            out.extend_from_slice(bytemuck::cast_slice(&values[n * i..n * (i + 1)]));
        };
        self.upload(column, name, &encode, 4 * u64::from(components), largest, arriving);
        Ok(largest)
    }

    /// Uploads a column in drawing order; `encode` appends the bytes of a surfel.
    fn upload(
        &mut self,
        column: &ColumnView<'_>,
        variable: &'static str,
        encode: &dyn Fn(usize, &mut Vec<u8>),
        stride: u64,
        largest: f32,
        arriving: &mut Arriving<'_>,
    ) {
        let frame = self.frame;
        let n_places = arriving.drawn.n_places as usize;
        // Whole surfels have no lines: theirs are never bound.
        let n_whole = if variable == columns::CLIP { arriving.drawn.n_whole } else { 0 };
        let chunks = arriving.drawn.chunks();
        let merged = arriving.drawn.merged.clone();
        let (device, queue, uploads) = (&self.device, &self.queue, &mut self.uploads);
        let key = (column.generation, arriving.order_serial, variable);
        let uploaded = self.uploaded.entry(key).or_insert_with(|| {
            *uploads += 1;
            let order = || arriving.order.get_or_init(|| drawing_order(arriving.cloud));
            let put: &dyn Fn(usize, &mut Vec<u8>) = match &merged {
                Some(merged) => {
                    let part = part_of(variable);
                    &move |place, out| merged.put(part, place, out)
                }
                None => {
                    let order = order();
                    &move |place, out| encode(order[place] as usize, out)
                }
            };
            let stride = usize::try_from(stride).unwrap_or(usize::MAX);
            let buffers = chunks
                .into_iter()
                .map(|(first, len)| {
                    let len = if first < n_whole { 1 } else { len as usize };
                    let first = first as usize;
                    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
                        label: Some(variable),
                        size: (len * stride) as u64,
                        usage: wgpu::BufferUsages::STORAGE,
                        mapped_at_creation: true,
                    });
                    // Written where the device reads it: no second copy of a chunk.
                    if let Ok(mut mapped) = buffer.get_mapped_range_mut(..) {
                        let mut ordered = Vec::with_capacity(BATCH * stride);
                        for batch in (0..len).step_by(BATCH) {
                            ordered.clear();
                            for place in batch..len.min(batch + BATCH) {
                                put(first + place, &mut ordered);
                            }
                            let start = batch * stride;
                            mapped.slice(start..start + ordered.len()).copy_from_slice(&ordered);
                        }
                    }
                    buffer.unmap();
                    // The memory written through is the driver's until a submission ends; ending
                    // one here keeps it to a chunk instead of a second copy of the cloud. A lost
                    // device is noticed when the frame is submitted.
                    queue.submit([]);
                    drop(device.poll(wgpu::PollType::wait_indefinitely()));
                    buffer
                })
                .collect();
            Uploaded {
                buffers: Arc::new(buffers),
                n_surfels: arriving.cloud.len,
                bytes: (n_places * stride) as u64,
                largest,
                last_used: frame,
            }
        });
        uploaded.last_used = frame;
        arriving.drawn.columns.push((variable, uploaded.buffers.clone()));
        arriving.drawn.generations.push(column.generation);
    }
}

/// Number of surfels, where all can be numbered.
pub(super) fn counted(cloud: &CloudView<'_>) -> Result<u32, RenderError> {
    numbered(cloud.len)
}

/// Bytes of the widest element that a cloud's surfels are drawn from.
fn widest_of(cloud: &CloudView<'_>) -> u64 {
    let are_splats = fields_of(cloud).is_some() || clips_of(cloud).is_some();
    if are_splats { WIDEST_OF_SPLATS } else { WIDEST_STRIDE }
}

fn numbered(n: usize) -> Result<u32, RenderError> {
    // The index texture keeps one bit for the side and one value for "none".
    u32::try_from(n)
        .ok()
        .filter(|n| *n < 1 << 31)
        .ok_or_else(|| RenderError::Cloud(format!("it has {n} surfels, fewer than 2^31 are drawn")))
}
