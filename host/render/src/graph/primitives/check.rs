//! The rules that passes which sort, sum up or count must keep.

use crate::gpu::Gpu;
use crate::graph::pipelines::Pipelines;
use crate::graph::plan::{Node, Plan, Planned};
use crate::graph::primitives::{PREFIX_SUMS, RADIX_SORT, SCAN_ENTRY, SORT_ENTRY};
use surfelshop_api::graph::{BufferId, Count, Pass, Scan, Sort, Work};

/// Most workgroups of a pass that counts, as of one with a fixed number.
const MAX_ALL_GROUPS: u64 = 1 << 26;

impl Plan {
    /// Plans a pass that sorts or sums up.
    ///
    /// # Errors
    /// The first rule that it breaks.
    pub(in crate::graph) fn plan_primitive(
        &self,
        pass: &Pass,
        gpu: &Gpu,
        pipelines: &mut Pipelines,
    ) -> Result<Planned, String> {
        let (does, text, entry) = match &pass.work {
            Work::Sort(_) => ("sorts", RADIX_SORT, SORT_ENTRY),
            _ => ("sums up", PREFIX_SUMS, SCAN_ENTRY),
        };
        if gpu.computes_early() {
            return Err(format!(
                "it {does}, which OpenGL in software takes minutes to compile; use Vulkan, or a graphics card"
            ));
        }
        let named = [pass.wgsl.as_str(), pass.entry.as_str()];
        let given = named.iter().any(|text| !text.is_empty())
            || !(pass.bindings.is_empty() && pass.modules.is_empty())
            || !(pass.constants.is_empty() && pass.features.is_empty());
        if given {
            return Err(format!(
                "it {does} by a shader of the host: it takes no shader, binding, module, constant or feature"
            ));
        }
        if pass.camera.is_some() {
            return Err(format!("it {does} and looks from no camera"));
        }
        let shader = pipelines.shader(text, &[])?;
        let mut planned = Planned::new(pass, shader, entry.to_owned());
        planned.computes = true;
        match &pass.work {
            Work::Sort(sort) => self.check_sort(sort, gpu, &mut planned)?,
            Work::Scan(scan) => self.check_scan(scan, gpu, &mut planned)?,
            _ => {}
        }
        Ok(planned)
    }

    fn check_sort(&self, sort: &Sort, gpu: &Gpu, planned: &mut Planned) -> Result<(), String> {
        if sort.keys == sort.values {
            let label = self.label_of(sort.keys)?;
            return Err(format!("its keys and its values are one buffer, `{label}`; give two"));
        }
        if !(1..=u32::BITS).contains(&sort.bits) {
            return Err(format!("it sorts by {} bits; 1 to 32 are looked at", sort.bits));
        }
        let bytes = 4 * u64::from(sort.count.at_most());
        let keys = self.room(sort.keys, "keys", 0, bytes, true)?;
        let values = self.room(sort.values, "values", 0, bytes, true)?;
        planned.reads.extend([keys, values]);
        planned.writes.extend([keys, values]);
        self.check_count(sort.count, gpu, planned)
    }

    fn check_scan(&self, scan: &Scan, gpu: &Gpu, planned: &mut Planned) -> Result<(), String> {
        let bytes = 4 * u64::from(scan.count.at_most());
        let list = self.room(scan.buffer, "numbers", 0, bytes, true)?;
        planned.reads.push(list);
        planned.writes.push(list);
        if let Some((buffer, offset)) = scan.total {
            if buffer == scan.buffer && offset < bytes {
                let label = self.label_of(buffer)?;
                return Err(format!(
                    "its total at byte {offset} of buffer `{label}` lies among the {bytes} bytes of its numbers"
                ));
            }
            let total = self.room(buffer, "total", offset, 4, true)?;
            if total != list {
                // What lies beside it stays.
                planned.reads.push(total);
                planned.writes.push(total);
            }
        }
        self.check_count(scan.count, gpu, planned)
    }

    fn check_count(&self, count: Count, gpu: &Gpu, planned: &mut Planned) -> Result<(), String> {
        match count {
            Count::Fixed(_) => Ok(()),
            Count::Read { buffer, offset, .. } => self.check_read(buffer, offset, gpu, planned),
        }
    }

    /// # Errors
    /// Where the workgroups of a pass that counts are too many, or there is no such number.
    pub(in crate::graph) fn check_counted(
        &self,
        (buffer, offset): (BufferId, u64),
        at_most: u32,
        gpu: &Gpu,
        planned: &mut Planned,
    ) -> Result<(), String> {
        let of_group = planned.workgroup_size.iter().map(|n| u64::from(*n)).product::<u64>();
        let groups = u64::from(at_most).div_ceil(of_group.max(1));
        if at_most == 0 || groups > MAX_ALL_GROUPS {
            return Err(format!(
                "at most {at_most} invocations, {groups} workgroups; 1 to {MAX_ALL_GROUPS} workgroups run"
            ));
        }
        self.check_read(buffer, offset, gpu, planned)
    }

    /// Whether a number can be read from a buffer when the pass runs.
    fn check_read(
        &self,
        buffer: BufferId,
        offset: u64,
        gpu: &Gpu,
        planned: &mut Planned,
    ) -> Result<(), String> {
        if !gpu.dispatches_counted {
            return Err(
                "its count is read from a buffer, which this device cannot do; give a fixed number"
                    .to_owned(),
            );
        }
        let node = self.room(buffer, "count", offset, 4, false)?;
        planned.reads.push(node);
        Ok(())
    }

    fn label_of(&self, id: BufferId) -> Result<&str, String> {
        let buffer = self.structure.buffers.get(id.index());
        buffer.map(|buffer| buffer.label.as_str()).ok_or_else(|| unknown("a buffer"))
    }

    /// The node of a buffer that has so many bytes at an offset.
    fn room(
        &self,
        id: BufferId,
        what: &str,
        offset: u64,
        bytes: u64,
        written: bool,
    ) -> Result<Node, String> {
        let buffer = self.structure.buffers.get(id.index());
        let buffer = buffer.ok_or_else(|| unknown(&format!("a buffer for its {what} that")))?;
        let label = &buffer.label;
        if !offset.is_multiple_of(4) {
            return Err(format!(
                "byte {offset} of buffer `{label}` was given for its {what}; expected a multiple of 4"
            ));
        }
        let end = offset.saturating_add(bytes);
        if buffer.size < end {
            return Err(format!(
                "buffer `{label}` has {} bytes; {end} are needed for its {what}",
                buffer.size
            ));
        }
        if buffer.columns.is_some() || (written && buffer.surfels.is_some()) {
            return Err(format!(
                "buffer `{label}` was given for its {what}; the host fills it with surfels or columns"
            ));
        }
        if written && buffer.resident.is_some() {
            return Err(format!(
                "buffer `{label}` was given for its {what}; it is resident and only read"
            ));
        }
        Ok(Node::Buffer(id.index()))
    }
}

fn unknown(what: &str) -> String {
    format!("it names {what} the graph does not have")
}
