//! Around what origin positions are stored, so that 32-bit floats hold them.

use surfelshop_api::glam::DVec3;

/// How many times farther from zero than it is wide a cloud may lie: three bits of 24 are lost then.
const FAR: f64 = 8.0;

/// Whether 32-bit floats hold a position as it is.
fn is_exact(position: &DVec3) -> bool {
    position.as_vec3().as_dvec3() == *position
}

/// The origin for a cloud that begins with these positions and is said to have these bounds: zero where its
/// positions are exact, or so near to zero that an origin gains little. Its coordinates are whole multiples of a power
/// of two about as large as the cloud, so that subtracting it rounds nothing.
pub(super) fn origin(first: &[DVec3], bounds: Option<[DVec3; 2]>) -> DVec3 {
    if first.iter().all(is_exact) {
        return DVec3::ZERO;
    }
    let announced =
        bounds.filter(|[low, high]| low.is_finite() && high.is_finite() && low.cmple(*high).all());
    let [low, high] = announced.unwrap_or_else(|| {
        let finite = first.iter().filter(|position| position.is_finite());
        finite.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], position| {
            [low.min(*position), high.max(*position)]
        })
    });
    let distance = low.abs().max(high.abs()).max_element();
    let extent = (high - low).max_element();
    if !distance.is_finite() || distance <= FAR * extent {
        return DVec3::ZERO;
    }
    // A single point has no extent.
    let step = extent.max(distance * 2.0_f64.powi(-20)).log2().ceil().exp2();
    let origin = ((low + high) / 2.0 / step).round() * step;
    if origin.is_finite() { origin } else { DVec3::ZERO }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_positions_that_would_lose_bits_have_an_origin() {
        let near = [DVec3::new(0.1, 0.2, 0.3), DVec3::ONE];
        assert_eq!(origin(&near, None), DVec3::ZERO);
        let far_but_exact = [DVec3::splat(1_000_000.5), DVec3::splat(1_000_001.0)];
        assert_eq!(origin(&far_but_exact, None), DVec3::ZERO);
        let far = [DVec3::splat(1e6 + 0.1), DVec3::splat(1e6 + 3.0)];
        assert_eq!(origin(&far, None), DVec3::splat(1e6));
        let bounds = [DVec3::new(0.0, 0.0, 5e6), DVec3::new(100.0, 100.0, 5e6 + 1000.0)];
        assert_eq!(origin(&far, Some(bounds)), DVec3::new(0.0, 0.0, 5_000_192.0));
        let one = [DVec3::new(0.1, 0.0, 0.0)];
        assert!((origin(&one, None) - one[0]).length() < 1e-6);
        assert_eq!(origin(&[DVec3::NAN], None), DVec3::ZERO);
        assert_eq!(origin(&[DVec3::splat(f64::MAX)], None), DVec3::ZERO);
    }
}
