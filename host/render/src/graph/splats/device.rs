//! The device puts splats together: it sorts them from near to far, lists them by the tiles that they touch, sorts that by
//! tiles, and goes through each tile's list until nothing more is seen.

use crate::gpu::Gpu;
use crate::graph::bind;
use crate::graph::execute::Variables;
use crate::graph::pipeline_desc::{Pipeline, Stage};
use crate::graph::pipelines::Pipelines;
use crate::graph::primitives::{
    BLOCK, Numbers, Pairs, PassScratch, Step, Steps, groups_of, whole_masks_of,
};
use crate::graph::readback::map;
use crate::graph::recorder::Recorder;
use crate::graph::splats::Made;
use crate::graph::splats::parameters::Parameters;
use crate::graph::splats::source::{EXTENT, FOOTPRINT};
use crate::graph::variants::Settings;
use surfelshop_api::graph::{Composition, Splats};

const LIST_SPLATS: &str = include_str!("list_splats.wgsl");
const FILL_LISTS: &str = include_str!("fill_lists.wgsl");
/// The key of a splat that touches no pixel, `NOTHING` of the shader.
const NOTHING: u32 = u32::MAX;
/// Invocations of a workgroup that goes over splats or entries.
const GROUP: u32 = 256;

/// Splats of a tile's list, over all rounds, that software drivers go through: llvmpipe ends the loops of an invocation
/// without a word after 65,535 iterations of all of them together.
///
/// Source: Mesa, `LP_MAX_TGSI_LOOP_ITERATIONS` of `gallivm`.
const MOST_ITERATIONS: u64 = 65_000;

/// Puts splats together; `false` where there are more of them than the device binds at once, or goes through for a pixel.
///
/// # Errors
/// Where a pipeline cannot be made or the device fails.
pub(super) fn compose(
    splats: &Splats,
    variables: &Variables<'_>,
    made: &[Made],
    per_pixel: Option<&Pipeline>,
    recorder: &mut Recorder<'_>,
    pipelines: &mut Pipelines,
    scratch: &mut PassScratch,
) -> Result<bool, String> {
    let [made] = made else { return Ok(false) };
    let size = variables.plan.size_of(variables.pass);
    let mut device = Device::new(recorder, pipelines, scratch);
    device.per_pixel = per_pixel;
    let composed = device.compose(splats, variables, made, size);
    for buffer in device.taken {
        scratch.give(buffer);
    }
    composed
}

/// What the steps are recorded with, and the buffers that they use.
pub(super) struct Device<'a, 'g> {
    pub(super) recorder: &'a mut Recorder<'g>,
    pub(super) pipelines: &'a mut Pipelines,
    pub(super) scratch: &'a mut PassScratch,
    /// What puts splats together where the pass has a function of pixels.
    pub(super) per_pixel: Option<&'a Pipeline>,
    pub(super) taken: Vec<wgpu::Buffer>,
}

/// A variable of a shader, and what it is bound to.
type Bound<'b> = (&'b str, &'b wgpu::Buffer);

/// Splats in the order in which they are drawn.
pub(super) struct Order {
    /// How many; those that touch no pixel may be among them.
    pub(super) n: u32,
    pub(super) numbers: wgpu::Buffer,
    /// Tiles that each touches, by number.
    tiles: wgpu::Buffer,
}

impl<'a, 'g> Device<'a, 'g> {
    pub(super) fn new(
        recorder: &'a mut Recorder<'g>,
        pipelines: &'a mut Pipelines,
        scratch: &'a mut PassScratch,
    ) -> Self {
        Self { recorder, pipelines, scratch, per_pixel: None, taken: Vec::new() }
    }

    fn gpu(&self) -> &Gpu {
        self.recorder.gpu
    }

    /// Room for so many numbers.
    pub(super) fn numbers(&mut self, label: &str, n: u32) -> wgpu::Buffer {
        let usage = wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::COPY_SRC
            | wgpu::BufferUsages::COPY_DST;
        let bytes = 4 * u64::from(n.max(1));
        let buffer = self.scratch.take(self.recorder.gpu, label, bytes, usage);
        self.taken.push(buffer.clone());
        buffer
    }

    fn pairs(&mut self, label: &str, n: u32) -> Pairs {
        let mut two = || [self.numbers(label, n), self.numbers(label, n)];
        Pairs { keys: two(), values: two() }
    }

    /// A uniform of these numbers.
    pub(super) fn uniform(&self, words: &[u32]) -> wgpu::Buffer {
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        self.gpu().filled_buffer("splats", &bytes, wgpu::BufferUsages::UNIFORM)
    }

    /// Runs an entry point in so many workgroups.
    fn run(
        &mut self,
        text: &str,
        entry: &str,
        groups: [u32; 2],
        bound: &[Bound<'_>],
    ) -> Result<(), String> {
        self.run_with(text, &[], entry, groups, bound)
    }

    /// The same of a text for which these names are defined.
    pub(super) fn run_with(
        &mut self,
        text: &str,
        defines: &[&str],
        entry: &str,
        groups: [u32; 2],
        bound: &[Bound<'_>],
    ) -> Result<(), String> {
        let shader = self.pipelines.shader(text, defines)?;
        let name = name_of(entry);
        let found = self.pipelines.compute(&name, &shader, entry, &Settings::default())?;
        let pipeline = found.pipeline;
        let group = bind(self.recorder.gpu, &pipeline, |variable| {
            let found = bound.iter().find(|(name, _)| *name == variable);
            found.map(|(_, buffer)| buffer.as_entire_binding())
        })?;
        self.dispatch(&name, &pipeline, &group, groups);
        Ok(())
    }

    pub(super) fn dispatch(
        &mut self,
        name: &str,
        pipeline: &Pipeline,
        group: &wgpu::BindGroup,
        groups: [u32; 2],
    ) {
        self.recorder.compute(name, |pass| {
            if let Stage::Compute(stage) = &pipeline.stage {
                pass.set_pipeline(stage);
                pass.set_bind_group(0, group, &[]);
                pass.dispatch_workgroups(groups[0], groups[1], 1);
            }
        });
    }

    fn compose(
        &mut self,
        splats: &Splats,
        variables: &Variables<'_>,
        made: &Made,
        size: [u32; 2],
    ) -> Result<bool, String> {
        let view = Parameters::of(splats, variables, size)?;
        let Parameters { across, down, .. } = view;
        let ranges = self.numbers("ranges of tiles", 2 * across * down);
        self.recorder.encoder.clear_buffer(&ranges, 0, None);
        let entries = match self.lists(made, &view, &ranges, splats.composition)? {
            Some(entries) => entries,
            None => return Ok(false),
        };
        self.draw(splats, variables, made, &view, &entries, &ranges)?;
        Ok(true)
    }

    /// Splats from near to far where that is said, else by number.
    pub(super) fn in_order(
        &mut self,
        made: &Made,
        view: &Parameters,
        from_near: bool,
    ) -> Result<Order, String> {
        let n = made.n;
        let pairs = self.pairs("splats by distance", n);
        let tiles = self.numbers("tiles of splats", n.saturating_mul(2));
        let params = self.uniform(&view.words(n));
        if n > 0 {
            self.run(
                &list_splats(),
                "measure",
                groups_of(n, GROUP),
                &[
                    ("params", &params),
                    ("footprints", &made.footprints),
                    ("keys", &pairs.keys[0]),
                    ("numbers", &pairs.values[0]),
                    ("tiles", &tiles),
                ],
            )?;
        }
        if from_near && !self.gpu().sorts() {
            let (n, numbers) = self.sort_on_host(&pairs.keys[0], n)?;
            return Ok(Order { n, numbers, tiles });
        }
        let sorted = self.sort(&pairs, n, if from_near { u32::BITS } else { 0 })?;
        Ok(Order { n, numbers: pairs.values[sorted].clone(), tiles })
    }

    /// Sorts by keys where the device does not; those that touch no pixel are left out.
    fn sort_on_host(&mut self, keys: &wgpu::Buffer, n: u32) -> Result<(u32, wgpu::Buffer), String> {
        let keys = self.read(keys, 0, n)?;
        let mut pairs: Vec<(u32, u32)> =
            keys.into_iter().zip(0..).filter(|(key, _)| *key != NOTHING).collect();
        pairs.sort_unstable();
        let bytes: Vec<u8> = pairs.iter().flat_map(|(_, number)| number.to_le_bytes()).collect();
        let bytes = if bytes.is_empty() { &[0; 4] } else { bytes.as_slice() };
        let numbers =
            self.gpu().filled_buffer("splats by distance", bytes, wgpu::BufferUsages::STORAGE);
        Ok((pairs.len() as u32, numbers))
    }

    /// Lists splats by the tiles that they touch: numbers of splats, tile by tile; `None` where they are too many, in all
    /// or of a tile.
    fn lists(
        &mut self,
        made: &Made,
        view: &Parameters,
        ranges: &wgpu::Buffer,
        composition: Composition,
    ) -> Result<Option<wgpu::Buffer>, String> {
        let n = made.n;
        // Rounding of a mean depends on the order, which must not be that of the input.
        let in_order = matches!(composition, Composition::Over | Composition::Normalized { .. });
        let Order { numbers, tiles, .. } = self.in_order(made, view, in_order)?;
        let counts = self.numbers("tiles of splats, counted", n);
        let params = self.uniform(&view.words(n));
        if n > 0 {
            self.run(
                &list_splats(),
                "count",
                groups_of(n, GROUP),
                &[
                    ("params", &params),
                    ("numbers", &numbers),
                    ("tiles", &tiles),
                    ("counts", &counts),
                ],
            )?;
        }
        let total = self.sum_up(&counts, n)?;
        let total = self.read(&total, n.div_ceil(BLOCK), 1)?.first().copied().unwrap_or(0);
        let most = self.gpu().device.limits().max_storage_buffer_binding_size / 4;
        if u64::from(total) > most {
            return Ok(None);
        }
        let entries = self.pairs("entries of tiles", total);
        let fill_lists = format!("{FOOTPRINT}\n{FILL_LISTS}");
        if total > 0 {
            self.run(
                &fill_lists,
                "fill",
                groups_of(n, GROUP),
                &[
                    ("params", &params),
                    ("numbers", &numbers),
                    ("tiles", &tiles),
                    ("offsets", &counts),
                    ("entry_tiles", &entries.keys[0]),
                    ("entry_numbers", &entries.values[0]),
                ],
            )?;
        }
        let bits = u32::BITS - (view.across * view.down).leading_zeros();
        let sorted = self.sort(&entries, total, bits)?;
        if total > 0 {
            let params = self.uniform(&view.words(total));
            self.run(
                &fill_lists,
                "bound",
                groups_of(total, GROUP),
                &[("params", &params), ("entry_tiles", &entries.keys[sorted]), ("ranges", ranges)],
            )?;
        }
        if self.gpu().is_software() {
            let ranges = self.read(ranges, 0, 2 * view.across * view.down)?;
            let longest = ranges
                .as_chunks::<2>()
                .0
                .iter()
                .map(|[first, end]| end.saturating_sub(*first))
                .max();
            let rounds = match composition {
                Composition::Stochastic { samples } => samples,
                Composition::Normalized { .. } => 2,
                _ => 1,
            };
            if (u64::from(longest.unwrap_or(0)) + 1) * u64::from(rounds) > MOST_ITERATIONS {
                return Ok(None);
            }
        }
        Ok(Some(entries.values[sorted].clone()))
    }

    /// Sorts pairs by the lowest bits of their keys; says which of the buffers hold them then.
    fn sort(&mut self, pairs: &Pairs, n: u32, bits: u32) -> Result<usize, String> {
        let mut steps = Steps::new(self.recorder.gpu, self.pipelines, self.scratch);
        let from = steps.sort(pairs, Numbers::Known(n), &whole_masks_of(bits))?;
        let Steps { steps, taken, .. } = steps;
        self.record(steps, taken);
        Ok(from)
    }

    /// Makes of each number the sum of those before it; the sum of all stands behind those of blocks.
    fn sum_up(&mut self, list: &wgpu::Buffer, n: u32) -> Result<wgpu::Buffer, String> {
        let mut steps = Steps::new(self.recorder.gpu, self.pipelines, self.scratch);
        let (blocks, _) = steps.scan(list, Numbers::Known(n))?;
        let Steps { steps, taken, .. } = steps;
        self.record(steps, taken);
        Ok(blocks)
    }

    /// Records steps, a pass each.
    fn record(&mut self, steps: Vec<Step>, taken: Vec<wgpu::Buffer>) {
        for step in steps {
            let name = format!("host: splats, {}", step.name.replace('_', " "));
            self.recorder.compute(&name, |pass| step.record(pass));
        }
        self.taken.extend(taken);
    }

    /// So many numbers of a buffer, from one on, once all that was recorded is done.
    fn read(&mut self, buffer: &wgpu::Buffer, at: u32, n: u32) -> Result<Vec<u32>, String> {
        if n == 0 {
            return Ok(Vec::new());
        }
        let gpu = self.recorder.gpu;
        let usage = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ;
        let (at, bytes) = (4 * u64::from(at), 4 * u64::from(n));
        let read = self.scratch.take(gpu, "numbers read back", bytes, usage);
        self.recorder.encoder.copy_buffer_to_buffer(buffer, at, &read, 0, bytes);
        self.recorder.finish();
        let mapped = map(gpu, &read)?;
        self.scratch.give(read);
        let words = mapped.as_chunks::<4>().0.iter().take(n as usize);
        Ok(words.map(|word| u32::from_le_bytes(*word)).collect())
    }
}

/// The text that measures splats.
fn list_splats() -> String {
    [FOOTPRINT, EXTENT, LIST_SPLATS].join("\n")
}

/// What a step is called.
pub(super) fn name_of(entry: &str) -> String {
    format!("host: splats, {}", entry.replace('_', " "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_step_compiles_for_any_device() {
        let gpu = Gpu::noop().unwrap();
        let mut pipelines = Pipelines::new(gpu.device.clone()).unwrap();
        let lists = list_splats();
        let fills = format!("{FOOTPRINT}\n{FILL_LISTS}");
        let steps = [
            (lists.clone(), "measure"),
            (lists, "count"),
            (fills.clone(), "fill"),
            (fills, "bound"),
        ];
        for (text, entry) in steps {
            let shader = pipelines.shader(&text, &[]).unwrap_or_else(|e| panic!("{entry}: {e}"));
            let made = pipelines.compute(entry, &shader, entry, &Settings::default());
            made.map(|_| ()).unwrap_or_else(|e| panic!("{entry}: {e}"));
        }
    }
}
