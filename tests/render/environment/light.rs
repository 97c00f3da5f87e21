//! What these tests share: parameters, and light that needs no file.

use glam::DVec3;
use surfelshop_api::params::{Value, Values};
use surfelshop_cloud::environment_map::Probe;
use surfelshop_tests::natural_light::lone_sun;

/// Where a [`Lab`](surfelshop_tests::natural_light::Lab) is looked at from.
pub(crate) const TO_EYE: DVec3 = DVec3::Z;

pub(crate) fn values(list: &[(&str, Value)]) -> Values {
    list.iter().map(|(id, value)| ((*id).to_owned(), value.clone())).collect()
}

pub(crate) fn text(value: &str) -> Value {
    Value::Text(value.to_owned())
}

/// Mirror-like reflection of everything, in full.
pub(crate) fn all_reflected(roughness: f64) -> Values {
    let number = Value::Float;
    values(&[
        ("kd", number(0.0)),
        ("metallic", number(1.0)),
        ("roughness", number(roughness)),
        // So few pixels show so large a sphere that each shows many normals.
        ("antialias", Value::Bool(false)),
    ])
}

pub(crate) fn matte() -> Values {
    values(&[("ks", Value::Float(0.0))])
}

pub(crate) fn sun() -> Probe {
    Probe::from_picture("lone sun", lone_sun(1e5), None).unwrap()
}

/// The four kinds of light that need no file.
pub(crate) fn probes() -> [Probe; 4] {
    [Probe::constant([1.0; 3]), Probe::studio(), Probe::sky(), sun()]
}
