//! What the shaders that put splats together are told.

use crate::graph::execute::Variables;
use crate::graph::splats::source::TILE;
use surfelshop_api::Projection;
use surfelshop_api::graph::{Composition, Footprint, Splats};

/// `Params` of the shaders, but for the number that differs from step to step.
#[derive(Clone, Copy)]
pub(super) struct Parameters {
    pub(super) across: u32,
    pub(super) down: u32,
    pub(super) planar: u32,
    pub(super) size: [u32; 2],
    /// Bits of a float.
    pub(super) near: u32,
    pub(super) orthographic: u32,
    pub(super) composition: u32,
    pub(super) samples: u32,
    pub(super) stride: u32,
    pub(super) depth_stride: u32,
    pub(super) tested: u32,
    /// Bits of a float.
    pub(super) unit: u32,
    /// Bits of a float.
    pub(super) tolerance: u32,
    /// What differs between steps of one kind.
    step: u32,
}

impl Parameters {
    /// Those of a pass and its view.
    ///
    /// # Errors
    /// Where there is no view.
    pub(super) fn of(
        splats: &Splats,
        variables: &Variables<'_>,
        size: [u32; 2],
    ) -> Result<Self, String> {
        let (seen, unit) = variables.view().ok_or("there is no view to draw splats in")?;
        let [across, down] = size.map(|side| side.div_ceil(TILE));
        let (composition, samples) = match splats.composition {
            Composition::Over => (0, 1),
            Composition::Additive => (1, 1),
            Composition::Nearest => (2, 1),
            Composition::Stochastic { samples } => (3, samples),
            Composition::Normalized { .. } => (4, 1),
        };
        let tolerance = match splats.composition {
            Composition::Normalized { tolerance } => tolerance,
            _ => 0.0,
        };
        Ok(Self {
            across,
            down,
            planar: u32::from(splats.footprint == Footprint::Planar),
            size,
            near: ((seen.near / unit) as f32).to_bits(),
            unit: (unit as f32).to_bits(),
            orthographic: u32::from(matches!(
                seen.camera.projection,
                Projection::Orthographic { .. }
            )),
            composition,
            samples,
            // Rows that are copied begin at multiples of 256 bytes.
            stride: size[0].next_multiple_of(16),
            depth_stride: size[0].next_multiple_of(64),
            tested: u32::from(splats.tested),
            tolerance: tolerance.to_bits(),
            step: 0,
        })
    }

    /// The same at a step of several.
    pub(super) fn at_step(&self, step: u32) -> Self {
        Self { step, ..*self }
    }

    pub(super) fn words(&self, n: u32) -> [u32; 16] {
        let Self { across, down, planar, size, near, orthographic, .. } = *self;
        let Self {
            composition, samples, stride, depth_stride, tested, unit, tolerance, step, ..
        } = *self;
        let [width, height] = size;
        [
            n,
            across,
            down,
            planar,
            width,
            height,
            near,
            orthographic,
            composition,
            samples,
            stride,
            depth_stride,
            tested,
            unit,
            tolerance,
            step,
        ]
    }
}
