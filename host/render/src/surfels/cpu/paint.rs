//! Columns in memory that differ in albedos and accessibilities of some surfels from those that are there: these are
//! changed where they stand, and what they are merged to.

use crate::surfels::columns::Columns;
use crate::surfels::columns::changed::{few, places_of};
use crate::surfels::cpu::LINEAR_OF_SRGB;
use crate::surfels::cpu::columns::{Drawn, OnHost};
use std::sync::Arc;
use surfelshop_api::columns::{self, CloudView};
use surfelshop_cloud::changed_rows;
use surfelshop_raster::{Albedo, Paint};

impl OnHost {
    /// The surfels that differ in these columns; `None` where there are others, or more differs than is painted.
    fn rows_to_paint(&self, drawn: &[(&'static str, u64)]) -> Option<Vec<u32>> {
        if self.drawn.len() != drawn.len() || !self.columns.can_be_repainted() {
            return None;
        }
        let mut rows = Vec::new();
        for ((name, one), (own_name, other)) in self.drawn.iter().zip(drawn) {
            match one == other {
                _ if name != own_name => return None,
                true => {}
                false if [columns::COLOR, columns::AO].contains(name) => {
                    rows.extend(changed_rows(*one, *other)?);
                }
                false => return None,
            }
        }
        Some(rows)
    }
}

impl Columns {
    /// The columns in memory that those of a cloud differ least from, and in which surfels: those that were not drawn
    /// in this frame or later.
    pub(crate) fn paintable(
        &self,
        cloud: &CloudView<'_>,
        drawn: &[(&'static str, u64)],
        order_serial: u32,
        frame: u64,
    ) -> Option<(usize, Vec<u32>)> {
        let known = self
            .on_host
            .iter()
            .enumerate()
            .filter(|(_, known)| known.order_serial == order_serial && known.last_used < frame);
        let with_rows = known.filter_map(|(at, known)| Some((at, known.rows_to_paint(drawn)?)));
        with_rows.filter(|(_, rows)| few(rows.len(), cloud.len)).min_by_key(|(_, rows)| rows.len())
    }

    /// Makes a cloud's columns of others in memory, which are gone then. Returns where they are.
    pub(crate) fn painted(
        &mut self,
        cloud: &CloudView<'_>,
        drawn: &Drawn<'_>,
        order_serial: u32,
        merged: bool,
        order: Option<&Arc<Vec<u32>>>,
    ) -> Option<usize> {
        let (at, rows) = self.paintable(cloud, &drawn.columns, order_serial, self.frame)?;
        let (order, known) = (order?, &mut self.on_host[at]);
        if merged && !known.merged {
            return None;
        }
        // Whoever holds them still draws with them.
        let columns = Arc::get_mut(&mut known.columns)?;
        let places = places_of(&rows, order);
        let rows: Vec<u32> = places.iter().map(|place| order[*place as usize]).collect();
        let is_new = |name: &str| {
            let generation = |all: &[(&'static str, u64)]| {
                all.iter().find(|(own, _)| *own == name).map(|(_, generation)| *generation)
            };
            generation(&known.drawn) != generation(&drawn.columns)
        };
        let albedo = match is_new(columns::COLOR) {
            true => drawn.albedo(&rows),
            false => Albedo::Same(columns::NEUTRAL_ALBEDO),
        };
        let ao = drawn.sources.ao.filter(|_| is_new(columns::AO));
        let ao = ao.map(|ao| rows.iter().map(|row| ao[*row as usize]).collect());
        if !columns.repaint(&Paint { places, albedo, ao }, &drawn.sources.geometry, &LINEAR_OF_SRGB)
        {
            self.on_host.remove(at);
            return None;
        }
        known.drawn.clone_from(&drawn.columns);
        self.n_orders += 1;
        known.serial = self.n_orders;
        self.patches += 1;
        Some(at)
    }
}
