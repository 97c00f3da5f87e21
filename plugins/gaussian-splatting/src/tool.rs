//! # `gaussians`: surfels as Gaussian splats
//!
//! | parameter   | type  | default | meaning                                                              |
//! |-------------|-------|---------|----------------------------------------------------------------------|
//! | `size`      | float | 0.7     | standard deviation of a splat, in radii of its surfel                |
//! | `opacity`   | float | 0.99    | opacity at the centre                                                |
//! | `thickness` | float | 0       | standard deviation along the normal, in that across; 0 makes flat splats |
//!
//! Method. Each surfel becomes a Gaussian in its plane, or a thin one in space: its axes are those of the disc or the
//! ellipse, its colour that of the surfel, the same from all sides. The surfels stay what they were beside, so that both
//! are compared in one window; written as PLY or SPZ the cloud opens in viewers of Gaussians.
//!
//! Limits: nothing is fitted: the colours are those of the cloud, without light. The default size closes surfaces whose
//! radii do, and is softer than a disc: where a disc ends a splat still hides a third.
//!
//! Source: Huang et al. 2024, "2D Gaussian Splatting for Geometrically Accurate Radiance Fields", section 4.1: the splat.
//!
//! ```text
//! surfelshop bake model.ply -t gaussians -o splats.ply
//! ```

use glam::{Mat3, Quat, Vec3};
use surfelshop_api::columns::{
    NORMAL, OPACITY, RADIUS, SH, SPLAT_ROTATION, SPLAT_SCALE, TANGENT_U, TANGENT_V, Values,
};
use surfelshop_api::glam;
use surfelshop_api::params::linear_to_srgb;
use surfelshop_api::prelude::*;
use surfelshop_api::tool::NewColumn;

params! {
    /// Settings of the tool.
    pub struct Settings {
        /// Standard deviation of a splat, in radii of its surfel.
        size: f32 { default: 0.7, range: 0.05..=4.0, logarithmic: true },
        /// Opacity at the centre.
        opacity: f32 { default: 0.99, range: 0.01..=1.0 },
        /// Standard deviation along the normal, in the mean of those across; 0 makes flat splats.
        thickness: f32 { default: 0.0, range: 0.0..=1.0 },
    }
}

/// The constant function of spherical harmonics.
const SH_0: f32 = 0.282_094_8;

/// The tool.
pub(crate) struct ToGaussians;

impl Tool for ToGaussians {
    const INFO: UnitInfo =
        UnitInfo::new("gaussians", "Gaussians of surfels", "Makes each surfel a Gaussian splat.");
    type Params = Settings;
    const SCOPE: Scope = Scope::Surfel;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn run(&mut self, cloud: &CloudView<'_>, params: &Settings, job: &Job<'_>) -> Result<()> {
        job.progress(0.0, "making splats");
        let normals: Vec<Vec3> = cloud.vectors(NORMAL).collect();
        let radii = cloud.floats(RADIUS, 1).unwrap_or_default();
        let tangents = [TANGENT_U, TANGENT_V].map(|name| cloud.vectors(name).collect::<Vec<_>>());
        if normals.len() != cloud.len || radii.len() != cloud.len {
            return Err(Error::new("expected normals and radii; run the tools normals and radii"));
        }
        let albedos = cloud.albedos();
        let dimensions = if params.thickness > 0.0 { 3 } else { 2 };
        let splat = |i: usize| {
            let [u, v] = tangents.each_ref().map(|list| list.get(i).copied());
            let (axes, lengths) = axes(normals[i], radii[i], u.zip(v));
            let rotation = Quat::from_mat3(&axes).normalize().to_array();
            let across = lengths.map(|length| length * params.size);
            let along = 0.5 * (across[0] + across[1]) * params.thickness;
            let color = albedos[i].to_array().map(|c| (linear_to_srgb(c) - 0.5) / SH_0);
            (rotation, [across[0], across[1], along], color)
        };
        let splats = job.map(cloud.len, 0.0..0.9, splat)?;
        let rotations: Vec<f32> = splats.iter().flat_map(|(rotation, ..)| *rotation).collect();
        let scales = splats.iter().flat_map(|(_, scale, _)| &scale[..dimensions]);
        let scales: Vec<f32> = scales.copied().collect();
        let colors: Vec<f32> = splats.iter().flat_map(|(.., color)| *color).collect();
        let opacities = vec![params.opacity; cloud.len];
        let column = |name, components: usize, values| NewColumn {
            name,
            components: components as u32,
            values: Values::F32(values),
        };
        job.edit(&Edit::Columns(vec![
            column(OPACITY, 1, &opacities),
            column(SPLAT_SCALE, dimensions, &scales),
            column(SPLAT_ROTATION, 4, &rotations),
            column(SH[0], 3, &colors),
        ]))?;
        job.progress(1.0, &format!("{} splats", cloud.len));
        Ok(())
    }
}

/// Unit axes of a surfel, the third along its normal, and its half axes.
fn axes(normal: Vec3, radius: f32, tangents: Option<(Vec3, Vec3)>) -> (Mat3, [f32; 2]) {
    let round = || {
        let n = normal.try_normalize().unwrap_or(Vec3::Y);
        let (u, v) = n.any_orthonormal_pair();
        // Right-handed: the third is the product of the others.
        (Mat3::from_cols(u, v, u.cross(v)), [radius; 2])
    };
    let Some((u, v)) = tangents else { return round() };
    let lengths = [u.length(), v.length()];
    let Some(along) = u.try_normalize() else { return round() };
    match (v - along * along.dot(v)).try_normalize() {
        Some(across) => (Mat3::from_cols(along, across, along.cross(across)), lengths),
        None => round(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_those_of_discs_and_ellipses() {
        for normal in [Vec3::X, -Vec3::Z, Vec3::new(0.6, -0.64, -0.48), Vec3::ZERO] {
            let (axes, lengths) = axes(normal, 2.0, None);
            let expected = normal.try_normalize().unwrap_or(Vec3::Y);
            assert!((axes.z_axis - expected).length() < 1e-6, "{axes}");
            assert!((axes.determinant() - 1.0).abs() < 1e-6 && lengths == [2.0; 2]);
        }
        let (u, v) = (Vec3::new(0.0, 3.0, 0.0), Vec3::new(0.0, 0.0, 0.5));
        let (axes, lengths) = axes(Vec3::X, 1.0, Some((u, v)));
        assert_eq!((axes.x_axis, axes.y_axis, lengths), (Vec3::Y, Vec3::Z, [3.0, 0.5]));
        assert_eq!(axes.z_axis, Vec3::X);
    }
}
