//! Sorting, prefix sums and counted workgroups, for passes of graphs and of splats: dispatches that are recorded one
//! after the other.

mod check;
mod run;
mod scratch;

use crate::gpu::Gpu;
use crate::graph::bind;
use crate::graph::pipeline_desc::{Pipeline, Stage};
use crate::graph::pipelines::Pipelines;
use crate::graph::variants::Settings;
pub(super) use run::{counted_groups, run};
pub(crate) use scratch::PassScratch;
use std::sync::Arc;

pub(super) const RADIX_SORT: &str = include_str!("radix_sort.wgsl");
pub(super) const PREFIX_SUMS: &str = include_str!("prefix_sums.wgsl");
const COUNTED: &str = include_str!("counted.wgsl");

/// An entry point of each of these, by which a pass of it is planned.
pub(super) const SORT_ENTRY: &str = "count_digits";
pub(super) const SCAN_ENTRY: &str = "within_blocks";

/// Numbers that a workgroup sorts or sums up, `BLOCK` of the shaders.
pub(super) const BLOCK: u32 = 1024;
/// Bits of a digit.
const DIGIT: u32 = 4;
/// Values of a digit.
const DIGITS: u32 = 1 << DIGIT;
/// Bytes of a part of amounts, `PART` of the shader: uniforms begin at multiples of it.
const PART_BYTES: u64 = 256;
/// Bytes of `Amount`, and where a part has its workgroups.
const AMOUNT_BYTES: u64 = 16;

/// Workgroups of so many, in rows that are not longer than a device allows.
pub(super) fn groups_of(n: u32, group: u32) -> [u32; 2] {
    let groups = n.div_ceil(group).max(1);
    let across = groups.min(1 << 15);
    [across, groups.div_ceil(across)]
}

/// How many workgroups run.
#[derive(Clone)]
enum Workgroups {
    Known([u32; 2]),
    /// Three words of a buffer, from this byte on.
    Counted(wgpu::Buffer, u64),
}

/// A dispatch.
pub(super) struct Step {
    /// The entry point.
    pub(super) name: &'static str,
    pipeline: Arc<Pipeline>,
    group: wgpu::BindGroup,
    workgroups: Workgroups,
}

impl Step {
    pub(super) fn record(&self, pass: &mut wgpu::ComputePass<'_>) {
        let Stage::Compute(stage) = &self.pipeline.stage else { return };
        pass.set_pipeline(stage);
        pass.set_bind_group(0, &self.group, &[]);
        match &self.workgroups {
            Workgroups::Known([across, down]) => pass.dispatch_workgroups(*across, *down, 1),
            Workgroups::Counted(buffer, at) => pass.dispatch_workgroups_indirect(buffer, *at),
        }
    }
}

/// Pairs to be sorted, with room for the result.
pub(super) struct Pairs {
    pub(super) keys: [wgpu::Buffer; 2],
    pub(super) values: [wgpu::Buffer; 2],
}

/// How many numbers a step works on.
#[derive(Clone, Copy)]
pub(super) enum Numbers<'b> {
    /// So many.
    Known(u32),
    /// As many as a word of a buffer says, and at most so many.
    Counted { buffer: &'b wgpu::Buffer, word: u32, at_most: u32 },
}

/// How many, as shaders read it.
pub(super) struct Amount {
    uniform: wgpu::Buffer,
    offset: u64,
    /// The number, where it is known.
    known: Option<u32>,
    at_most: u32,
}

impl Amount {
    fn binding(&self) -> wgpu::BindingResource<'_> {
        wgpu::BindingResource::Buffer(wgpu::BufferBinding {
            buffer: &self.uniform,
            offset: self.offset,
            size: std::num::NonZeroU64::new(AMOUNT_BYTES),
        })
    }

    /// Workgroups of a block each.
    fn workgroups(&self) -> Workgroups {
        match self.known {
            Some(n) => Workgroups::Known(groups_of(n.div_ceil(BLOCK), 1)),
            None => Workgroups::Counted(self.uniform.clone(), self.offset + AMOUNT_BYTES),
        }
    }
}

/// Dispatches under preparation, and the memory that they use.
pub(super) struct Steps<'a> {
    gpu: &'a Gpu,
    pipelines: &'a mut Pipelines,
    scratch: &'a mut PassScratch,
    pub(super) steps: Vec<Step>,
    /// To be given back once the steps are recorded.
    pub(super) taken: Vec<wgpu::Buffer>,
}

impl<'a> Steps<'a> {
    pub(super) fn new(
        gpu: &'a Gpu,
        pipelines: &'a mut Pipelines,
        scratch: &'a mut PassScratch,
    ) -> Self {
        Self { gpu, pipelines, scratch, steps: Vec::new(), taken: Vec::new() }
    }

    /// Room for so many numbers.
    fn numbers(&mut self, label: &str, n: u32, besides: wgpu::BufferUsages) -> wgpu::Buffer {
        let usage = wgpu::BufferUsages::STORAGE
            | wgpu::BufferUsages::COPY_SRC
            | wgpu::BufferUsages::COPY_DST
            | besides;
        let buffer = self.scratch.take(self.gpu, label, 4 * u64::from(n.max(1)), usage);
        self.taken.push(buffer.clone());
        buffer
    }

    fn uniform(&self, words: [u32; 4]) -> wgpu::Buffer {
        let bytes: Vec<u8> = words.into_iter().flat_map(u32::to_le_bytes).collect();
        self.gpu.filled_buffer("numbers of a step", &bytes, wgpu::BufferUsages::UNIFORM)
    }

    fn step(
        &mut self,
        text: &str,
        name: &'static str,
        workgroups: Workgroups,
        bound: &[(&str, wgpu::BindingResource<'_>)],
    ) -> Result<(), String> {
        let shader = self.pipelines.shader(text, &[])?;
        let pipeline = self.pipelines.compute(name, &shader, name, &Settings::default())?.pipeline;
        let group = bind(self.gpu, &pipeline, |variable| {
            let found = bound.iter().find(|(name, _)| *name == variable);
            found.map(|(_, resource)| resource.clone())
        })?;
        self.steps.push(Step { name, pipeline, group, workgroups });
        Ok(())
    }

    /// A number as shaders read it.
    fn known(&self, n: u32) -> Amount {
        let uniform = self.uniform([n, n.div_ceil(BLOCK), 0, 0]);
        Amount { uniform, offset: 0, known: Some(n), at_most: n }
    }

    /// How many numbers there are, and how many counts of digits of their blocks.
    ///
    /// # Errors
    /// Where a pipeline cannot be made.
    fn amounts(&mut self, numbers: Numbers<'_>) -> Result<[Amount; 2], String> {
        let of_counts = |n: u32| DIGITS * n.div_ceil(BLOCK);
        let (buffer, word, at_most) = match numbers {
            Numbers::Known(n) => return Ok([self.known(n), self.known(of_counts(n))]),
            Numbers::Counted { buffer, word, at_most } => (buffer, word, at_most),
        };
        let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::INDIRECT;
        let amounts = self.numbers("amounts", 2 * PART_BYTES as u32 / 4, usage);
        let bound = self.uniform([word, at_most, 0, 0]);
        self.step(
            COUNTED,
            "find_amounts",
            Workgroups::Known([1, 1]),
            &[
                ("bound", bound.as_entire_binding()),
                ("numbers", buffer.as_entire_binding()),
                ("amounts", amounts.as_entire_binding()),
            ],
        )?;
        let part = |i: u64, at_most: u32| Amount {
            uniform: amounts.clone(),
            offset: i * PART_BYTES,
            known: None,
            at_most,
        };
        Ok([part(0, at_most), part(1, of_counts(at_most))])
    }

    /// Sorts pairs by the lowest bits of their keys, in so many rounds of a digit; says which of the buffers hold them
    /// then: the first ones after an even number of rounds.
    ///
    /// # Errors
    /// Where a pipeline cannot be made.
    pub(super) fn sort(
        &mut self,
        pairs: &Pairs,
        numbers: Numbers<'_>,
        masks: &[u32],
    ) -> Result<usize, String> {
        if matches!(numbers, Numbers::Known(0 | 1)) {
            return Ok(0);
        }
        let [amount, of_counts] = self.amounts(numbers)?;
        let no_more = wgpu::BufferUsages::empty();
        let counts = self.numbers("counts of digits", of_counts.at_most, no_more);
        let mut from = 0;
        for (digit, mask) in (0..).zip(masks) {
            let digit = self.uniform([DIGIT * digit, *mask, 0, 0]);
            let (keys, values) = (&pairs.keys[from], &pairs.values[from]);
            let bound = [
                ("amount", amount.binding()),
                ("digit", digit.as_entire_binding()),
                ("keys", keys.as_entire_binding()),
                ("counts", counts.as_entire_binding()),
                ("values", values.as_entire_binding()),
                ("sorted_keys", pairs.keys[1 - from].as_entire_binding()),
                ("sorted_values", pairs.values[1 - from].as_entire_binding()),
            ];
            self.step(RADIX_SORT, SORT_ENTRY, amount.workgroups(), &bound[..4])?;
            self.sum_up(&counts, &of_counts)?;
            self.step(RADIX_SORT, "scatter", amount.workgroups(), &bound)?;
            from = 1 - from;
        }
        Ok(from)
    }

    /// Makes of each number the sum of those before it; the sum of all stands behind those of blocks.
    ///
    /// # Errors
    /// Where a pipeline cannot be made.
    pub(super) fn scan(
        &mut self,
        list: &wgpu::Buffer,
        numbers: Numbers<'_>,
    ) -> Result<(wgpu::Buffer, Amount), String> {
        let amount = match numbers {
            Numbers::Known(n) => self.known(n),
            Numbers::Counted { .. } => {
                let [amount, _] = self.amounts(numbers)?;
                amount
            }
        };
        let blocks = self.sum_up(list, &amount)?;
        Ok((blocks, amount))
    }

    fn sum_up(&mut self, list: &wgpu::Buffer, amount: &Amount) -> Result<wgpu::Buffer, String> {
        let n_blocks = amount.at_most.div_ceil(BLOCK);
        let no_more = wgpu::BufferUsages::empty();
        let blocks = self.numbers("sums of blocks", n_blocks + 1, no_more);
        let bound = [
            ("amount", amount.binding()),
            ("blocks", blocks.as_entire_binding()),
            ("list", list.as_entire_binding()),
        ];
        if amount.at_most > 0 {
            self.step(PREFIX_SUMS, SCAN_ENTRY, amount.workgroups(), &bound)?;
        }
        self.step(PREFIX_SUMS, "over_blocks", Workgroups::Known([1, 1]), &bound[..2])?;
        if amount.at_most > BLOCK {
            self.step(PREFIX_SUMS, "together", amount.workgroups(), &bound)?;
        }
        Ok(blocks)
    }

    /// Writes the sum of all into a word of a buffer.
    fn total(
        &mut self,
        blocks: &wgpu::Buffer,
        amount: &Amount,
        into: &wgpu::Buffer,
        word: u32,
    ) -> Result<(), String> {
        let place = self.uniform([word, 0, 0, 0]);
        self.step(
            PREFIX_SUMS,
            "write_total",
            Workgroups::Known([1, 1]),
            &[
                ("amount", amount.binding()),
                ("blocks", blocks.as_entire_binding()),
                ("place", place.as_entire_binding()),
                ("totals", into.as_entire_binding()),
            ],
        )
    }
}

/// Masks of the digits of so many bits, an even number of them: the last one sorts nothing where they are odd.
fn masks_of(bits: u32) -> Vec<u32> {
    let rounds = bits.div_ceil(2 * DIGIT) * 2;
    let mask = |round: u32| (1 << bits.saturating_sub(DIGIT * round).min(DIGIT)) - 1;
    (0..rounds).map(mask).collect()
}

/// Masks of the digits of so many bits, all of four.
pub(super) fn whole_masks_of(bits: u32) -> Vec<u32> {
    vec![DIGITS - 1; bits.div_ceil(DIGIT) as usize]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_step_compiles_for_any_device() {
        let gpu = Gpu::noop().unwrap();
        let mut pipelines = Pipelines::new(gpu.device.clone()).unwrap();
        let steps = [
            (RADIX_SORT, SORT_ENTRY),
            (RADIX_SORT, "scatter"),
            (PREFIX_SUMS, SCAN_ENTRY),
            (PREFIX_SUMS, "over_blocks"),
            (PREFIX_SUMS, "together"),
            (PREFIX_SUMS, "write_total"),
            (COUNTED, "find_amounts"),
            (COUNTED, "find_groups"),
        ];
        for (text, entry) in steps {
            let shader = pipelines.shader(text, &[]).unwrap_or_else(|e| panic!("{entry}: {e}"));
            let made = pipelines.compute(entry, &shader, entry, &Settings::default());
            made.map(|_| ()).unwrap_or_else(|e| panic!("{entry}: {e}"));
        }
    }

    #[test]
    fn digits_cover_the_bits_and_no_more_in_even_rounds() {
        assert_eq!(masks_of(32), [15; 8]);
        assert_eq!(masks_of(9), [15, 15, 1, 0]);
        assert_eq!(masks_of(1), [1, 0]);
        for bits in 1..=32 {
            let masks = masks_of(bits);
            let n: u32 = masks.iter().map(|mask| mask.count_ones()).sum();
            assert!(n == bits && masks.len().is_multiple_of(2), "{bits}: {masks:?}");
        }
        assert_eq!(whole_masks_of(9), [15, 15, 15]);
    }

    #[test]
    fn workgroups_cover_all_and_rows_are_short() {
        for n in [0, 1, 256, 257, 1 << 23, (1 << 24) + 1, u32::MAX] {
            let [across, down] = groups_of(n, 256);
            assert!(across <= 65_535 && down <= 65_535);
            assert!(u64::from(across) * u64::from(down) * 256 >= u64::from(n));
        }
    }
}
