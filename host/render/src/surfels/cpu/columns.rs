//! Columns in memory, where the CPU draws: put in order when first drawn, shared by every view,
//! dropped when unused.

use crate::graph::RenderError;
use crate::surfels::columns::Columns;
use crate::surfels::columns::arranging::{ORDERED, STOPPED, counted};
use crate::surfels::columns::demand::ColumnDemand;
use crate::surfels::columns::elements::{
    clip_drawn, clips_of, drawn_generation, encode_color, field_drawn, fields_of, geometry_of,
    is_color, round_reach,
};
use crate::surfels::columns::order::drawing_order;
use crate::surfels::cpu::columns as columns_of;
use crate::surfels::render_cloud::DrawnCloud;
use rayon::prelude::*;
use std::sync::Arc;
use surfelshop_api::columns::{self, CloudView, ColumnView, Values};
use surfelshop_raster::{Albedo, Merging, Sources, Splats};

/// A cloud in memory.
pub(crate) struct OnHost {
    /// Names and generations of its columns.
    pub(crate) drawn: Vec<(&'static str, u64)>,
    pub(crate) order_serial: u32,
    /// Equal for equal columns.
    pub(crate) serial: u32,
    /// Surfels that are not cut, which come first.
    pub(crate) n_whole: u32,
    pub(crate) columns: Arc<surfelshop_raster::Columns>,
    pub(crate) max_radius: f32,
    /// Whether there are surfels that stand for several.
    pub(crate) merged: bool,
    pub(crate) last_used: u64,
}

impl OnHost {
    /// Whether all of these columns of a cloud are there, and others only where the cloud has them, too.
    pub(crate) fn has(&self, drawn: &[(&'static str, u64)], cloud: &CloudView<'_>) -> bool {
        let is_of_cloud = |(name, generation): &(&'static str, u64)| {
            cloud.column(name).is_some_and(|column| drawn_generation(cloud, column) == *generation)
        };
        drawn.iter().all(|column| self.drawn.contains(column)) && self.drawn.iter().all(is_of_cloud)
    }

    /// Lets go of columns that nothing reads any more.
    pub(crate) fn keep(&mut self, wanted: ColumnDemand) {
        let wanted = wanted.for_merged(self.merged);
        if self.drawn.iter().all(|(name, _)| wanted.reads(name)) {
            return;
        }
        // Whoever holds them still draws with them.
        let Some(columns) = Arc::get_mut(&mut self.columns) else { return };
        if !wanted.color {
            columns.forget_albedo(columns::NEUTRAL_ALBEDO);
        }
        if !wanted.ao {
            columns.forget_ao();
        }
        if !wanted.material {
            columns.forget_material();
        }
        if !wanted.fields {
            columns.forget_fields();
        }
        self.drawn.retain(|(name, _)| wanted.reads(name));
    }
}

/// What a cloud is drawn with.
pub(crate) struct Drawn<'a> {
    pub(crate) sources: Sources<'a>,
    fields: Option<&'a [[f32; 4]]>,
    clips: Option<&'a [[f32; 7]]>,
    color: Option<&'a ColumnView<'a>>,
    /// Names and generations of the columns.
    pub(crate) columns: Vec<(&'static str, u64)>,
}

/// Names and generations of the columns a cloud is drawn with; `None` where it cannot be drawn.
pub(crate) fn columns_drawn(
    cloud: &CloudView<'_>,
    wanted: ColumnDemand,
) -> Option<Vec<(&'static str, u64)>> {
    Drawn::of(cloud, wanted).ok().map(|drawn| drawn.columns)
}

impl<'a> Drawn<'a> {
    fn of(cloud: &'a CloudView<'a>, wanted: ColumnDemand) -> Result<Self, RenderError> {
        let geometry = geometry_of(cloud)?;
        let tangents = geometry.tangents;
        let material = cloud.column(columns::MATERIAL).filter(|_| wanted.material);
        let materials = material.and_then(|column| match column.values {
            Values::U32(values) if column.components == 1 => Some(values),
            _ => None,
        });
        let ao = cloud.floats(columns::AO, 1).filter(|_| wanted.ao);
        let sources = Sources { geometry, ao, materials, all_read: false };
        let color = cloud.column(columns::COLOR);
        let color = color.filter(|column| wanted.color && is_color(column));
        let fields = fields_of(cloud).filter(|_| wanted.fields);
        let clips = clips_of(cloud);
        let used = [
            fields.map(|_| columns::NORMAL_FIELD),
            clips.map(|_| columns::CLIP),
            Some(columns::POSITION),
            Some(columns::NORMAL),
            tangents.is_none().then_some(columns::RADIUS),
            tangents.is_some().then_some(columns::TANGENT_U),
            tangents.is_some().then_some(columns::TANGENT_V),
            sources.ao.map(|_| columns::AO),
            materials.map(|_| columns::MATERIAL),
            color.map(|_| columns::COLOR),
        ];
        let used = used.into_iter().flatten();
        let named = |name| cloud.column(name).map(|column| (name, drawn_generation(cloud, column)));
        let columns = used.filter_map(named).collect();
        Ok(Self { sources, fields, clips, color, columns })
    }

    /// Normal fields and the lines that cut surfels, in this order.
    fn splats(&self, order: &[u32], n_whole: u32) -> Splats {
        let all = order.iter().map(|&i| i as usize);
        let cut = order.iter().skip(n_whole as usize).map(|&i| i as usize);
        Splats {
            fields: self.fields.map(|fields| all.map(|i| field_drawn(fields[i])).collect()),
            n_whole: n_whole as usize,
            clips: match self.clips {
                Some(clips) => cut.map(|i| clip_drawn(clips[i])).collect(),
                None => Vec::new(),
            },
        }
    }

    /// At least the longest half axis.
    fn max_radius(&self) -> f32 {
        let largest = |values: &[f32]| values.iter().fold(0.0f32, |most, v| most.max(v.abs()));
        match self.sources.geometry.tangents {
            // As for columns on the device.
            Some([u, v]) => 2.45 * largest(u).max(largest(v)),
            None => largest(self.sources.geometry.radii),
        }
    }

    /// Albedos in this order, as they are stored on the device.
    pub(crate) fn albedo(&self, order: &[u32]) -> Albedo {
        let Some(column) = self.color else { return Albedo::Same(columns::NEUTRAL_ALBEDO) };
        let encoded = |bytes: &mut Vec<u8>, i: &u32| {
            bytes.clear();
            encode_color(column, *i as usize, bytes);
        };
        let all = order.par_iter();
        match column.values {
            Values::U8(_) => Albedo::Codes(
                all.map_init(Vec::new, |bytes, i| {
                    encoded(bytes, i);
                    bytemuck::pod_read_unaligned(bytes)
                })
                .collect(),
            ),
            _ => Albedo::Halves(
                all.map_init(Vec::new, |bytes, i| {
                    encoded(bytes, i);
                    bytemuck::pod_read_unaligned(bytes)
                })
                .collect(),
            ),
        }
    }
}

impl Columns {
    /// Brings the columns a cloud is drawn with into drawing order in memory, and surfels that stand
    /// for several where it is to be drawn with `merged` ones: the cloud as the CPU draws it.
    ///
    /// # Errors
    /// Where a column that drawing needs is missing or of another type.
    pub(crate) fn on_host(
        &mut self,
        cloud: &CloudView<'_>,
        merged: bool,
        tell: &(dyn Fn(f32) -> bool + Sync),
    ) -> Result<DrawnCloud<'static>, RenderError> {
        let n_surfels = counted(cloud)?;
        let chunk_len = self.chunk_len;
        let known = self.in_memory(cloud, (merged, false), tell)?;
        Ok(DrawnCloud {
            origin: cloud.origin,
            object: 0,
            n_surfels,
            n_places: n_surfels,
            n_whole: known.n_whole,
            chunk_len,
            columns: Vec::new(),
            defines: Vec::new(),
            generations: known.drawn.iter().map(|(_, generation)| *generation).collect(),
            max_radius: known.max_radius,
            equal_radius: None,
            round_reach: round_reach(cloud),
            on_host: Some(known.columns.clone()),
            geometry: None,
            merged: None,
        })
    }

    /// A cloud's columns in memory: with merged surfels, and for whoever reads all of them.
    ///
    /// # Errors
    /// Where a column that drawing needs is missing or of another type.
    pub(crate) fn in_memory(
        &mut self,
        cloud: &CloudView<'_>,
        (merged, all_read): (bool, bool),
        tell: &(dyn Fn(f32) -> bool + Sync),
    ) -> Result<&OnHost, RenderError> {
        let mut drawn = Drawn::of(cloud, self.wanted_of(cloud.len).for_merged(merged))?;
        drawn.sources.all_read = all_read;
        let (order_serial, n_whole, order) = self.order(cloud);
        let is_it = |known: &OnHost| {
            known.has(&drawn.columns, cloud)
                && known.order_serial == order_serial
                && (known.merged || !merged)
        };
        let at = match self.on_host.iter().position(is_it) {
            Some(at) => Some(at),
            None => self.painted(cloud, &drawn, order_serial, merged, order.get()),
        };
        let at = match at {
            Some(at) => at,
            None => {
                self.uploads += 1;
                self.let_go_of_older(order_serial, &drawn.columns);
                let order = order.into_inner().unwrap_or_else(|| Arc::new(drawing_order(cloud)));
                if !tell(ORDERED) {
                    return Err(RenderError::Cloud(STOPPED.to_owned()));
                }
                let albedo = drawn.albedo(&order);
                let told = |fraction| {
                    tell(ORDERED + (1.0 - ORDERED) * fraction);
                };
                let splats = drawn.splats(&order, n_whole);
                let merging = match (merged, self.expects_edits) {
                    (false, _) => Merging::No,
                    (true, false) => Merging::Once,
                    (true, true) => Merging::Repaintable,
                };
                let columns = columns_of(&drawn.sources, order, albedo, splats, merging, &told);
                self.n_orders += 1;
                self.on_host.push(OnHost {
                    drawn: drawn.columns.clone(),
                    order_serial,
                    serial: self.n_orders,
                    n_whole,
                    columns: Arc::new(columns),
                    max_radius: drawn.max_radius(),
                    merged,
                    last_used: 0,
                });
                self.on_host.len() - 1
            }
        };
        let frame = self.frame;
        let known = &mut self.on_host[at];
        known.last_used = frame;
        Ok(known)
    }

    /// Drops copies of a cloud as it was: all but the last one, which another view may still show. One
    /// without merged surfels goes, too, where one with them follows.
    fn let_go_of_older(&mut self, order_serial: u32, columns: &[(&'static str, u64)]) {
        let of_it = self.on_host.iter().filter(|known| known.order_serial == order_serial);
        let latest = of_it.map(|known| known.last_used).max();
        self.on_host.retain(|known| {
            let is_there = known.drawn.iter().all(|column| columns.contains(column));
            let stays = Some(known.last_used) == latest && !is_there;
            known.order_serial != order_serial || stays
        });
    }
}
