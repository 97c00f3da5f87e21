//! The environment map of a scene: which light probe, and its orientation.

use super::keyed::Keyed;
use super::parts::stops;
use super::source::{Entry, Fault, Section};
use crate::cloud::axis::Axis;
use crate::environment_map::Mapping;
use glam::{DMat3, DQuat, DVec3};
use std::path::PathBuf;

/// Where the light comes from.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum ProbeSource {
    /// A file, absolute or relative to the scene's folder.
    File(PathBuf),
    /// The built-in studio with soft boxes.
    Studio,
    /// The built-in clear sky with a sun.
    Sky,
}

/// The light around a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneEnvironment {
    /// Where it comes from.
    pub source: ProbeSource,
    /// How its picture shows directions; `None` where that is to be detected.
    pub mapping: Option<Mapping>,
    /// The world direction that the centre of the picture shows.
    pub forward: Axis,
    /// The world direction that is up in the picture; across `forward`.
    pub up: Axis,
    /// How far it is turned about `up`, counterclockwise seen from above, radians.
    pub rotation: f64,
    /// Factor on its light in stops, from -60 to 60.
    pub stops: f32,
}

impl SceneEnvironment {
    /// A probe as it was taken: it looks along -z, y is up.
    #[must_use]
    pub fn new(source: ProbeSource) -> Self {
        let (forward, up) = (Axis::MinusZ, Axis::PlusY);
        Self { source, mapping: None, forward, up, rotation: 0.0, stops: 0.0 }
    }

    /// Rotation from the world to the probe's own space, where -z is the centre of the picture and
    /// y is up. Where `forward` lies along `up`, another direction across `up` is taken.
    ///
    /// Source: erratum T14 of the thesis: the forward axis is no fact of a file.
    #[must_use]
    pub fn probe_from_world(&self) -> DMat3 {
        let up = self.up.direction();
        let mut forward = self.forward.direction();
        if !self.forward.is_across(self.up) {
            forward = if up.z.abs() > 0.5 { DVec3::Y } else { DVec3::NEG_Z };
        }
        let right = forward.cross(up);
        let turn = DMat3::from_quat(DQuat::from_axis_angle(up, -self.rotation));
        DMat3::from_cols(right, up, -forward).transpose() * turn
    }

    /// Factor on radiance.
    #[must_use]
    pub fn gain(&self) -> f64 {
        f64::from(self.stops).exp2()
    }
}

/// The section `environment`.
pub(super) fn read(mut section: Section<'_>) -> Result<Keyed<SceneEnvironment>, Fault> {
    let expected = "the path of a probe, \"studio\" or \"sky\"";
    let entry = section.need("probe", expected)?;
    let text = entry.text().filter(|text| !text.trim().is_empty() && !text.contains('\0'));
    let source = match text.ok_or_else(|| entry.wrong(expected))? {
        "studio" => ProbeSource::Studio,
        "sky" => ProbeSource::Sky,
        path => ProbeSource::File(path.into()),
    };
    let mut environment = SceneEnvironment::new(source);
    if let Some(entry) = section.find("mapping") {
        let mapping = entry.text().and_then(Mapping::from_name);
        let names = Mapping::ALL.map(Mapping::name).join(", ");
        environment.mapping = Some(mapping.ok_or_else(|| entry.wrong(format!("one of {names}")))?);
    }
    if let Some(entry) = section.find("forward") {
        environment.forward = axis(&entry)?;
    }
    if let Some(entry) = section.find("up") {
        environment.up = axis(&entry)?;
        if !environment.up.is_across(environment.forward) {
            return Err(entry.wrong("an axis across `forward`, which is -z where it is not given"));
        }
    }
    if let Some(entry) = section.find("rotation") {
        let expected = "an angle in degrees from -1e6 to 1e6";
        environment.rotation = entry.number(expected, |n| n.abs() <= 1e6)?.to_radians();
    }
    if let Some(entry) = section.find("exposure") {
        environment.stops = stops(&entry)?;
    }
    Ok(Keyed { known: environment, unknown: section.unknown()? })
}

fn axis(entry: &Entry<'_>) -> Result<Axis, Fault> {
    let axis = entry.text().and_then(Axis::from_name);
    axis.ok_or_else(|| entry.wrong("one of x, -x, y, -y, z, -z"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_probe_stands_as_it_is_told_to() {
        let mut environment = SceneEnvironment::new(ProbeSource::Studio);
        assert_eq!(environment.probe_from_world(), DMat3::IDENTITY);
        // Turned by a quarter, what was in front stands at the left.
        environment.rotation = std::f64::consts::FRAC_PI_2;
        let seen = environment.probe_from_world() * DVec3::NEG_X;
        assert!((seen - DVec3::NEG_Z).length() < 1e-12, "{seen}");
        for forward in Axis::ALL {
            for up in Axis::ALL {
                let environment =
                    SceneEnvironment { forward, up, rotation: 0.3, ..environment.clone() };
                let turn = environment.probe_from_world();
                assert!((turn.determinant() - 1.0).abs() < 1e-12);
                assert!((turn * up.direction() - DVec3::Y).length() < 1e-12);
            }
        }
        environment.rotation = 0.0;
        (environment.forward, environment.up) = (Axis::PlusX, Axis::PlusZ);
        let turn = environment.probe_from_world();
        assert_eq!(turn * DVec3::X, DVec3::NEG_Z);
        assert_eq!(turn * DVec3::NEG_Y, DVec3::X);
    }

    #[test]
    fn axes_have_names() {
        for axis in Axis::ALL {
            assert_eq!(Axis::from_name(axis.name()), Some(axis));
        }
        assert_eq!(Axis::from_name("+y"), Some(Axis::PlusY));
        assert_eq!(Axis::from_name("w"), None);
    }
}
