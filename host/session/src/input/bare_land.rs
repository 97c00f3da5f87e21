//! Land without colours, which says little in one grey.

use super::clouds::Clouds;
use surfelshop_api::columns::COLOR;
use surfelshop_api::glam::DVec3;
use surfelshop_cloud::scene::Axis;

/// Height over the side of a square of the same area, below which clouds are land: rooms and statues are higher.
const FLAT: f64 = 0.25;
/// Fewer surfels are not taken for land.
const FEWEST: u64 = 1000;

/// Whether clouds are land without colours, by the axis that is up.
///
/// Land is wide for its height, and stands on z as maps do: what stands on y are models.
#[must_use]
pub fn is_bare_land(clouds: &Clouds, up: Axis) -> bool {
    let facts = &clouds.facts;
    let has_colors = clouds.loaded.iter().any(|one| one.cloud.column(COLOR).is_some());
    facts.n_surfels >= FEWEST && !has_colors && is_flat(facts.bounds_max - facts.bounds_min, up)
}

fn is_flat(extent: DVec3, up: Axis) -> bool {
    let side = (extent.x * extent.y).sqrt();
    up == Axis::PlusZ && extent.is_finite() && extent.z < FLAT * side
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn land_is_wide_and_stands_on_z() {
        let land = DVec3::new(1200.0, 560.0, 114.0);
        assert!(is_flat(land, Axis::PlusZ) && !is_flat(land, Axis::PlusY));
        assert!(!is_flat(DVec3::new(10.0, 8.0, 3.0), Axis::PlusZ), "a room");
        // A fence has no area.
        assert!(!is_flat(DVec3::new(100.0, 0.0, 1.0), Axis::PlusZ));
        assert!(!is_flat(DVec3::splat(f64::NAN), Axis::PlusZ));
        assert!(!is_flat(DVec3::new(f64::INFINITY, 1.0, 1.0), Axis::PlusZ));
    }
}
