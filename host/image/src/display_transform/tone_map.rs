//! Tone mapping: how radiance above what a screen can show is brought down.

use serde::{Deserialize, Serialize};

/// How radiance above what a screen can show is brought down.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ToneMap {
    /// Values above 1 are cut off.
    #[default]
    Clamp,
    /// Khronos PBR Neutral: colours below 0.8 stay, highlights are compressed and desaturated.
    Neutral,
}

/// Khronos PBR Neutral tone mapping of a linear colour.
///
/// Source: Khronos Group 2024, "Khronos PBR Neutral Tone Mapper", with F90 of 0.04, start of
/// compression 0.8 and desaturation 0.15.
pub(super) fn neutral(rgb: [f32; 3]) -> [f32; 3] {
    const START: f32 = 0.8 - 0.04;
    const DESATURATION: f32 = 0.15;
    let least = rgb[0].min(rgb[1]).min(rgb[2]);
    let offset = if least < 0.08 { least - 6.25 * least * least } else { 0.04 };
    let color = rgb.map(|value| value - offset);
    let peak = color[0].max(color[1]).max(color[2]);
    if peak < START {
        return color;
    }
    let d = 1.0 - START;
    let new_peak = 1.0 - d * d / (peak + d - START);
    let gray = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    color.map(|value| value * (new_peak / peak) * (1.0 - gray) + new_peak * gray)
}
