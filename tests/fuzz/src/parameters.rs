//! Descriptions of units, the values that belong to them, and what is typed for them.

use surfelshop_api::abi::plugin_side::Description;
use surfelshop_api::params::{Value, Values};
use surfelshop_runtime::plugins::keep_values;

/// Takes a description, values behind it, and the rest as what was typed for each parameter.
///
/// # Panics
/// Where it finds what must not be: that is a finding.
pub fn parameters(bytes: &[u8]) {
    let mut rest = bytes;
    let description = rmp_serde::from_read::<_, Description>(&mut rest).unwrap_or_default();
    if description.check().is_err() {
        return;
    }
    let values = rmp_serde::from_read::<_, Values>(&mut rest).unwrap_or_default();
    let typed = String::from_utf8_lossy(rest);
    for declared in &description.params {
        for given in values.values().chain([&declared.default]) {
            let value = declared.sanitise(Some(given));
            // What a unit is given is of the declared kind, or its own default.
            assert!(declared.fitted(&value).is_some() || same(&value, &declared.default));
        }
        match declared.parse(&typed) {
            Ok(value) => assert!(declared.fitted(&value).is_some(), "{declared:?} {value:?}"),
            Err(line) => assert!(!line.is_empty()),
        }
    }
    drop(keep_values(&values, &description.params));
}

/// Equality under which NaN is itself.
fn same(a: &Value, b: &Value) -> bool {
    format!("{a:?}") == format!("{b:?}")
}
