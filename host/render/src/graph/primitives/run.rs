//! Passes of graphs that sort and sum up, and the workgroups of those that count.

use crate::graph::RenderError;
use crate::graph::pipelines::Pipelines;
use crate::graph::primitives::{
    COUNTED, Numbers, Pairs, PassScratch, Step, Steps, Workgroups, masks_of,
};
use crate::graph::recorder::Recorder;
use crate::graph::resources::FrameResources;
use surfelshop_api::graph::{BufferId, Count, Pass, Scan, Sort, Work};

/// Runs a pass of a graph that sorts or sums up.
///
/// # Errors
/// Where a pipeline cannot be made.
pub(in crate::graph) fn run(
    pass: &Pass,
    resources: &FrameResources,
    recorder: &mut Recorder<'_>,
    pipelines: &mut Pipelines,
    scratch: &mut PassScratch,
) -> Result<(), RenderError> {
    let mut steps = Steps::new(recorder.gpu, pipelines, scratch);
    let prepared = match &pass.work {
        Work::Sort(sort) => prepare_sort(&mut steps, sort, resources),
        Work::Scan(scan) => prepare_scan(&mut steps, scan, resources),
        _ => Ok(()),
    };
    let Steps { steps, taken, .. } = steps;
    recorder.compute(&pass.name, |pass| steps.iter().for_each(|step| step.record(pass)));
    taken.into_iter().for_each(|buffer| scratch.give(buffer));
    prepared.map_err(|message| RenderError::pass(&pass.name, message))
}

fn prepare_sort(
    steps: &mut Steps<'_>,
    sort: &Sort,
    resources: &FrameResources,
) -> Result<(), String> {
    let (keys, values) = (buffer(resources, sort.keys)?, buffer(resources, sort.values)?);
    let no_more = wgpu::BufferUsages::empty();
    let n = sort.count.at_most();
    let mut room = |label: &str| steps.numbers(label, n, no_more);
    let pairs = Pairs {
        keys: [keys.clone(), room("keys between")],
        values: [values.clone(), room("values between")],
    };
    let numbers = numbers(resources, sort.count)?;
    // After an even number of rounds they are where they were.
    steps.sort(&pairs, numbers, &masks_of(sort.bits)).map(|_| ())
}

fn prepare_scan(
    steps: &mut Steps<'_>,
    scan: &Scan,
    resources: &FrameResources,
) -> Result<(), String> {
    let list = buffer(resources, scan.buffer)?;
    let numbers = numbers(resources, scan.count)?;
    let (blocks, amount) = steps.scan(list, numbers)?;
    let Some((into, offset)) = scan.total else { return Ok(()) };
    steps.total(&blocks, &amount, buffer(resources, into)?, word(offset)?)
}

/// The step that finds the workgroups of a pass of one invocation a thing, and the buffer that it writes them to.
///
/// # Errors
/// Where a pipeline cannot be made.
pub(in crate::graph) fn counted_groups(
    steps: &mut Steps<'_>,
    resources: &FrameResources,
    (id, offset): (BufferId, u64),
    [at_most, of_group]: [u32; 2],
) -> Result<(Step, wgpu::Buffer), String> {
    let groups = steps.numbers("workgroups", 4, wgpu::BufferUsages::INDIRECT);
    let bound = steps.uniform([word(offset)?, at_most, of_group.max(1), 0]);
    steps.step(
        COUNTED,
        "find_groups",
        Workgroups::Known([1, 1]),
        &[
            ("bound", bound.as_entire_binding()),
            ("numbers", buffer(resources, id)?.as_entire_binding()),
            ("groups", groups.as_entire_binding()),
        ],
    )?;
    let step = steps.steps.pop().ok_or("a step is missing")?;
    Ok((step, groups))
}

fn buffer(resources: &FrameResources, id: BufferId) -> Result<&wgpu::Buffer, String> {
    let made = resources.buffers.get(id.index()).and_then(Option::as_ref);
    made.ok_or_else(|| "one of its buffers was not made".to_owned())
}

fn numbers(resources: &FrameResources, count: Count) -> Result<Numbers<'_>, String> {
    Ok(match count {
        Count::Fixed(n) => Numbers::Known(n),
        Count::Read { buffer: id, offset, at_most } => {
            Numbers::Counted { buffer: buffer(resources, id)?, word: word(offset)?, at_most }
        }
    })
}

/// Words before a byte.
fn word(offset: u64) -> Result<u32, String> {
    let word = u32::try_from(offset / 4).ok();
    word.ok_or_else(|| format!("{offset} bytes lie beyond every buffer"))
}
