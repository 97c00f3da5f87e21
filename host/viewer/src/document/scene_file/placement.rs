//! How a cloud was placed in the window, over how its scene places it.

use surfelshop_cloud::scene::Keyed;
use surfelshop_cloud::{Rotation, Transform};

/// Both as one, with the keys of the scene's; `None` where nothing moves.
pub(crate) fn over(scene: Option<Keyed<Transform>>, own: &Transform) -> Option<Keyed<Transform>> {
    if *own == Transform::default() {
        return scene;
    }
    let Keyed { known: first, unknown } = scene.unwrap_or_default();
    let (Some(turn), Some(before)) = (own.rotation.quaternion(), first.rotation.quaternion())
    else {
        return Some(Keyed { known: first, unknown });
    };
    let known = Transform {
        translation: turn * (first.translation * own.scale) + own.translation,
        rotation: Rotation::Quaternion((turn * before).normalize()),
        scale: own.scale * first.scale,
    };
    Some(Keyed { known, unknown })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn place(transform: &Transform, at: DVec3) -> DVec3 {
        let turn = transform.rotation.quaternion().unwrap();
        turn * (at * transform.scale) + transform.translation
    }

    #[test]
    fn one_placement_after_another_is_both() {
        let transform = |x: f64| Transform {
            translation: DVec3::new(x, -3.0, 2.0 * x),
            rotation: Rotation::Euler(DVec3::new(0.3 * x, 0.2, -0.7)),
            scale: 1.0 + 0.5 * x,
        };
        let (first, own) = (transform(1.0), transform(2.0));
        let both = over(Some(first.into()), &own).unwrap().known;
        for at in [DVec3::ZERO, DVec3::X, DVec3::new(4.0, -2.0, 7.0)] {
            assert!(place(&both, at).distance(place(&own, place(&first, at))) < 1e-9);
        }
        assert_eq!(over(None, &Transform::default()), None);
        assert_eq!(over(Some(first.into()), &Transform::default()).unwrap().known, first);
        let alone = over(None, &own).unwrap().known;
        assert!(place(&alone, DVec3::X).distance(place(&own, DVec3::X)) < 1e-9);
    }
}
