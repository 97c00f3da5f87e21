// What ambient accessibility leaves of the light on a surface.
#define_import_path surfelshop::occlusion

// Parts of that light, in the order in which `ao-affects` takes them in.
//
// From everywhere around, on a matte surface.
const AMBIENT = 0u;
// From lights, on a matte surface.
const DIFFUSE = 1u;
// Mirrored, from everywhere around.
const REFLECTIONS = 2u;
// Mirrored, from lights.
const HIGHLIGHTS = 3u;

// Whether there is accessibility, and it counts: a feature of the pass, see `Pass::occluded` of the
// plugin interface. Where it does not, nothing need look at `Surface::ao`, and its column is not drawn
// with.
override COUNTS: bool = true;

// The same, for other modules: they cannot import constants of this kind.
fn counts() -> bool {
    return COUNTS;
}

// The share of a part of the light that is left where `accessibility` of it would be if all of the
// occlusion counted; `strength` says how much of it does, and `affects` is the last part that it
// darkens.
//
// Twin: `AoAffects` of the plugin interface.
// Source: Liu 2006, section 1.5.2: the diffuse colour times 1 - S.
fn share(accessibility: f32, strength: f32, part: u32, affects: u32) -> f32 {
    return select(1.0, mix(1.0, accessibility, strength), part <= affects);
}
