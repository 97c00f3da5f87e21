//! What there is to say of light probes.

use serde_json::{Value, json};
use std::fmt::Write as _;
use surfelshop_cloud::environment_map::{Probe, Repairs};

/// Everything as one object.
pub fn object(probe: &Probe) -> Value {
    json!({
        "name": probe.name,
        "size": [probe.picture.width, probe.picture.height],
        "mapping": probe.mapping.name(),
        "mapping_was_detected": probe.mapping_was_detected,
        "texels_not_finite": probe.repairs.n_not_finite,
        "texels_negative": probe.repairs.n_negative,
        "mean_radiance": probe.facts.mean_radiance,
        "max_radiance": probe.facts.max_radiance,
        "sun": probe.facts.sun,
        "map_side": probe.facts.side,
    })
}

/// The same for people.
pub fn text(probe: &Probe) -> Result<String, std::fmt::Error> {
    let facts = &probe.facts;
    let mut text =
        format!("{}: light probe, {} x {}", probe.name, probe.picture.width, probe.picture.height);
    let how =
        if probe.mapping_was_detected { "detected; --env-mapping overrides" } else { "given" };
    write!(text, "\n  mapping        {} ({how})", probe.mapping.name())?;
    let [r, g, b] = facts.mean_radiance;
    write!(text, "\n  mean radiance  {r:.4} {g:.4} {b:.4}")?;
    write!(text, "\n  max radiance   {:.4}", facts.max_radiance)?;
    match &facts.sun {
        Some(sun) => {
            let [r, g, b] = sun.radiance;
            let radius = sun.angular_radius.to_degrees();
            let (x, y, z) = (sun.towards.x, sun.towards.y, sun.towards.z);
            write!(
                text,
                "\n  sun            towards {x:.3} {y:.3} {z:.3}, radius {radius:.2} deg"
            )?;
            write!(text, ", white surface {r:.3} {g:.3} {b:.3}")?;
        }
        None => text.push_str("\n  sun            none that dominates"),
    }
    if let Some(line) = repairs(probe) {
        write!(text, "\n  repaired       {line}")?;
    }
    Ok(text)
}

/// What was replaced in a probe, in a few words, if anything was.
pub fn repairs(probe: &Probe) -> Option<String> {
    let Repairs { n_not_finite, n_negative } = probe.repairs;
    (n_not_finite + n_negative > 0).then(|| {
        format!("replaced {n_not_finite} texels that are not finite and {n_negative} negative ones")
    })
}
