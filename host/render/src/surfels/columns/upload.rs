//! Columns on their way to the device, when a cloud is first drawn.

use crate::graph::RenderError;
use crate::surfels::columns::arranging::{ORDERED, STOPPED, counted, numbered};
use crate::surfels::columns::demand::ColumnDemand;
use crate::surfels::columns::elements::{
    clip_drawn, clips_of, components_of, drawn_generation, encode_color, field_drawn, fields_of,
    floats_of, geometry_of, is_color, part_of, round_of, round_reach,
};
use crate::surfels::columns::order::drawing_order;
use crate::surfels::columns::patch::PatchSource;
use crate::surfels::columns::{Columns, Uploaded, WIDEST_OF_SPLATS, WIDEST_STRIDE, widest_of};
use crate::surfels::render_cloud::DrawnCloud;
use std::cell::OnceCell;
use std::sync::Arc;
use surfelshop_api::columns::{self, CloudView, ColumnView, Values};
use surfelshop_raster::radius_drawn;

/// Chunks of clouds with merged surfels are made of whole groups.
const GROUP: u32 = surfelshop_raster::GROUP as u32;

/// Surfels put in order at a time on their way to the device.
const BATCH: usize = 4096;

/// A cloud on its way to the device.
struct Arriving<'a> {
    cloud: &'a CloudView<'a>,
    order_serial: u32,
    /// Indices of the surfels in drawing order, once a column needs them.
    order: OnceCell<Arc<Vec<u32>>>,
    drawn: DrawnCloud<'static>,
}

impl Columns {
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
    ) -> Result<DrawnCloud<'static>, RenderError> {
        let n_surfels = counted(cloud)?;
        let mut drawn = DrawnCloud {
            origin: cloud.origin,
            object: 0,
            n_surfels,
            n_places: n_surfels,
            n_whole: n_surfels,
            chunk_len: self.chunk_len_for(cloud),
            columns: Vec::new(),
            defines: Vec::new(),
            generations: Vec::new(),
            max_radius: 0.0,
            equal_radius: None,
            round_reach: round_reach(cloud),
            on_host: None,
            geometry: None,
            merged: None,
        };
        let wanted = self.wanted_of(cloud.len).for_merged(merged);
        let (order_serial, n_whole, order) = match merged {
            true => {
                let known = self.in_memory(cloud, (true, true), tell)?;
                known.columns.make_all_parts(&geometry_of(cloud)?);
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
            let drawn = column.map(|column| drawn_generation(cloud, column));
            arriving.drawn.generations.extend(drawn);
        } else {
            arriving.drawn.max_radius = self.radii(arriving)?;
        }
        Ok(())
    }

    /// Uploads radii, negative where surfels are round splats, and returns the largest.
    fn radii(&mut self, arriving: &mut Arriving<'_>) -> Result<f32, RenderError> {
        let cloud = arriving.cloud;
        let values = floats_of(cloud, columns::RADIUS)?;
        let Some(column) = cloud.column(columns::RADIUS) else { return Ok(0.0) };
        let generation = drawn_generation(cloud, column);
        let known = self.uploaded.get(&(generation, arriving.order_serial, columns::RADIUS));
        let largest =
            known.map_or_else(|| values.iter().fold(0.0f32, |most, &v| most.max(v)), |c| c.largest);
        let round = round_of(cloud);
        let encode = |i: usize, out: &mut Vec<u8>| {
            let is_round = round.is_some_and(|round| round[i] != 0);
            out.extend_from_slice(&radius_drawn(values[i], is_round).to_ne_bytes());
        };
        self.upload(column, columns::RADIUS, &encode, 4, largest, arriving);
        Ok(largest)
    }

    /// Brings along normal fields, and the lines that cut surfels.
    fn splats(&mut self, wanted: ColumnDemand, arriving: &mut Arriving<'_>) {
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
        let generation = drawn_generation(arriving.cloud, column);
        let key = (generation, arriving.order_serial, variable);
        // Merged surfels follow from many, and those that are cut lie in other chunks.
        if merged.is_none()
            && variable != columns::CLIP
            && let Some(known) = self.predecessor(key, arriving.cloud.len, frame)
        {
            let order = arriving.order.get_or_init(|| Arc::new(drawing_order(arriving.cloud)));
            let stride = usize::try_from(stride).unwrap_or(usize::MAX);
            let source = PatchSource { order, encode, stride, chunks: &chunks, largest };
            self.patch(known, key, &source);
        }
        let (device, queue, uploads) = (&self.device, &self.queue, &mut self.uploads);
        let sent_bytes = &mut self.sent_bytes;
        let uploaded = self.uploaded.entry(key).or_insert_with(|| {
            *uploads += 1;
            *sent_bytes += n_places as u64 * stride;
            let order = || arriving.order.get_or_init(|| Arc::new(drawing_order(arriving.cloud)));
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
                        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
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
        arriving.drawn.generations.push(generation);
    }
}
