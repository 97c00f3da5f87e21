//! What loading did to the points of a file, counted.

use crate::cloud::Cloud;
use crate::cloud::splats::SplatKind;
use serde::Serialize;
use std::fmt;

/// A cloud and how it came to be.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The cloud: at least `position`, `normal` and `radius`.
    pub cloud: Cloud,
    /// What was dropped, repaired and estimated.
    pub summary: Summary,
}

/// Where the normals of a loaded cloud come from; each surfel counts once, except in `degenerate`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct NormalCounts {
    /// Unit vectors of the file, kept as they are.
    pub given: u64,
    /// Vectors of the file that were made unit length.
    pub normalised: u64,
    /// Absent in the file; means of the triangles around, weighted by their areas.
    pub from_triangles: u64,
    /// Zero or not finite in the file; replaced from valid ones nearby or estimated.
    pub repaired: u64,
    /// Absent in the file; estimated from positions or, in a mesh, from normals nearby.
    pub estimated: u64,
    /// Axes of Gaussian splats.
    pub of_splats: u64,
    /// Estimated ones whose surroundings do not span a plane.
    pub degenerate: u64,
    /// Estimated ones of points whose surroundings are no surface.
    pub scattered: u64,
    /// Estimated ones that face the device that took the scan.
    pub towards_scanner: u64,
    /// Estimated ones that face the side from where they can be seen.
    pub towards_free_space: u64,
    /// Estimated ones for whose side there is little evidence, or none.
    pub of_unsure_side: u64,
    /// Of all these, normals that were flipped for it.
    pub turned: u64,
}

/// The path of a moving scanner, as the pulses tell that came back several times.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Trajectory {
    /// Pulses that it was found from.
    pub n_pulses: u64,
    /// Straight pieces that it is made of.
    pub n_pieces: u64,
    /// Median distance from the points, in units of the file.
    pub distance: f64,
    /// The largest of the pieces' median distances that rays pass it at, as a share of the distance.
    pub miss: f64,
}

impl fmt::Display for Trajectory {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let pulses = in_groups(self.n_pulses);
        // Three digits, as many as are sure.
        let digits = (2.0 - self.distance.log10().floor()).clamp(0.0, 20.0) as usize;
        let (distance, miss) = (self.distance, 100.0 * self.miss);
        write!(
            out,
            "from {pulses} pulses with several returns, in {} pieces: {distance:.digits$} units of the file from the \
             points, missed by at most {miss:.2} % of that",
            self.n_pieces
        )
    }
}

/// Where the radii of a loaded cloud come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct RadiusCounts {
    /// Radii of the file, kept as they are.
    pub given: u64,
    /// Extents of Gaussian splats.
    pub of_splats: u64,
    /// Absent in the file; they cover the triangles around.
    pub from_triangles: u64,
    /// Absent, zero, negative or not finite in the file; estimated from neighbours.
    pub estimated: u64,
    /// Larger than the cloud in the file; made the diagonal of its bounds.
    pub clamped: u64,
}

/// Where the colours of a loaded cloud come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ColorCounts {
    /// Colours of the file, kept as they are.
    pub given: u64,
    /// What Gaussian splats look like from all around.
    pub of_splats: u64,
    /// Absent in the file; drawn in the neutral albedo.
    pub neutral: u64,
    /// Negative or not finite in the file; replaced by the neutral albedo.
    pub replaced: u64,
}

/// What a load did: everything that was dropped, repaired or estimated is counted.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Summary {
    /// The file.
    pub file: String,
    /// Format and encoding, such as `PLY, binary little endian`.
    pub format: String,
    /// Points the file announces.
    pub n_in_file: u64,
    /// Surfels of the cloud.
    pub n_surfels: u64,
    /// Points left out because a coordinate is not finite, or too large.
    pub n_dropped: u64,
    /// Of these, points whose coordinates are finite and too large for single precision: beyond a quarter of
    /// its range, 8.5e37, so that differences and diagonals have numbers.
    pub n_too_large: u64,
    /// What Gaussian splats the surfels are, where they are such.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub splats: Option<SplatKind>,
    /// Triangles between the surfels.
    pub n_triangles: u64,
    /// World position that the positions are relative to.
    pub origin: [f64; 3],
    /// Normals.
    pub normals: NormalCounts,
    /// The median of the angles by which estimated normals may be off by the scatter of their neighbours, degrees;
    /// `None` where none is estimated.
    pub normal_error_deg: Option<f32>,
    /// The path of the scanner, where normals were turned towards it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trajectory: Option<Trajectory>,
    /// Radii.
    pub radii: RadiusCounts,
    /// Colours.
    pub colors: ColorCounts,
    /// Names of the cloud's columns.
    pub columns: Vec<String>,
    /// Comments of the file.
    pub comments: Vec<String>,
    /// What the user should know, one sentence each.
    pub warnings: Vec<String>,
    /// Time the load took, estimation included, seconds.
    pub seconds: f64,
}

/// Joins the counts that are not zero.
fn counts(parts: &[(u64, &str)]) -> String {
    let shown: Vec<String> = parts
        .iter()
        .filter(|(count, _)| *count > 0)
        .map(|(count, what)| format!("{count} {what}"))
        .collect();
    if shown.is_empty() { "none".to_owned() } else { shown.join(", ") }
}

/// A number with a comma between thousands.
#[must_use]
pub fn in_groups(number: u64) -> String {
    let digits = number.to_string();
    let mut grouped = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    grouped
}

impl Summary {
    /// Why points were left out, as it reads behind their number.
    #[must_use]
    pub fn why_dropped(&self) -> String {
        let too_large = "their coordinates exceed 8.5e37; scale the file";
        match (self.n_dropped - self.n_too_large, self.n_too_large) {
            (_, 0) => "their coordinates are not finite".to_owned(),
            (0, _) => too_large.to_owned(),
            (n, _) => format!("the coordinates of {n} are not finite; of the others {too_large}"),
        }
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { file, format, n_surfels, n_in_file, n_dropped, .. } = self;
        write!(out, "{file}: {n_surfels} surfels ({format}, {:.2} s)", self.seconds)?;
        if *n_dropped > 0 {
            write!(out, "\n  dropped {n_dropped} of {n_in_file} points, {}", self.why_dropped())?;
        }
        if let Some(kind) = self.splats {
            write!(out, "\n  {} {kind}", in_groups(*n_surfels))?;
        }
        if self.n_triangles > 0 {
            write!(out, "\n  {} triangles", self.n_triangles)?;
        }
        let n = &self.normals;
        let normals = counts(&[
            (n.given, "given"),
            (n.normalised, "made unit length"),
            (n.from_triangles, "from triangles"),
            (n.repaired, "repaired"),
            (n.of_splats, "of splats"),
            (n.estimated, "estimated"),
            (n.degenerate, "without a plane"),
            (n.scattered, "of no surface"),
            (n.towards_scanner, "towards the scanner"),
            (n.towards_free_space, "towards free space"),
            (n.of_unsure_side, "of uncertain side"),
        ]);
        let r = &self.radii;
        let radii = counts(&[
            (r.given, "given"),
            (r.from_triangles, "from triangles"),
            (r.of_splats, "of splats"),
            (r.estimated, "estimated"),
            (r.clamped, "clamped"),
        ]);
        let c = &self.colors;
        let colors = counts(&[
            (c.given, "given"),
            (c.of_splats, "of splats"),
            (c.neutral, "neutral"),
            (c.replaced, "replaced"),
        ]);
        write!(out, "\n  normals {normals}; radii {radii}; colours {colors}")?;
        if let Some(path) = self.trajectory {
            write!(out, "\n  scanner's path {path}")?;
        }
        write!(out, "\n  columns {}", self.columns.join(", "))?;
        if self.origin != [0.0; 3] {
            let [x, y, z] = self.origin;
            write!(out, "\n  origin {x} {y} {z}")?;
        }
        for warning in &self.warnings {
            write!(out, "\n  warning: {warning}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thousands_are_told_apart() {
        assert_eq!(
            [0, 999, 1000, 438_101, 12_345_678].map(in_groups),
            ["0", "999", "1,000", "438,101", "12,345,678"]
        );
    }
}
