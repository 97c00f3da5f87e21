//! Light views: the scene's lights as cameras, whose depths are shadow maps.

mod passes;

use std::f64::consts::{FRAC_PI_2, PI};
use surfelshop_api::glam::{DVec3, Vec3};
use surfelshop_api::graph::CameraId;
use surfelshop_api::prelude::*;
use surfelshop_api::{CloudFacts, Lamp, View};

/// Faces of all light views: six of each of a scene's lights.
const MOST_FACES: usize = 48;

/// Most texels of all faces: what they see is drawn in every frame.
const MOST_TEXELS: u64 = 1 << 22;

/// Most texels on a side of a face of the light surface buffer: one of each block of its picture, another
/// one in the next frame. Measured, pictures whose lights were placed by all texels were no nearer to the
/// reference.
const MOST_LIT: u32 = 256;

/// Cells on a side of a face's importance, as in `light_views.wgsl`.
pub(crate) const CELLS: u32 = 64;

/// Spots with a wider angle than this between axis and edge are looked from as point lights are: one
/// picture would have most of its texels in its corners.
const WIDEST_SPOT: f64 = 70.0 * PI / 180.0;

/// Share of its largest extent that is visible around the scene: surfels reach beyond their centres.
const AROUND: f64 = 1.05;

/// At most so many times fewer texels has a light's view while something moves: of 512 on a side half are
/// enough for the shadows of the Cornell box, a quarter loses parts of its ring's, and an eighth nearly all.
const FEWEST_TEXELS: u32 = 4;

/// Texels on a side of a light's view that has `side` at rest, where one surfel of `stride` is drawn.
pub(crate) fn side_in_motion(side: u32, stride: u32) -> u32 {
    side >> (stride.clamp(1, FEWEST_TEXELS).ilog2() / 2)
}

/// One face of a light view.
pub(crate) struct Face {
    /// Which of the scene's lights it belongs to.
    light_index: u32,
    view: View,
    /// A tangent, or scene units where its rays are parallel.
    half_extent: f64,
    /// Share of the picture's half width that belongs to it alone.
    own: f64,
}

/// The light views of a frame.
pub(crate) struct LightViews {
    pub(crate) faces: Vec<Face>,
    /// Texels on a side of each face.
    pub(crate) side: u32,
    /// Frames of this view since something changed.
    frame_index: u32,
}

/// The scene's size, to which lengths are related: a power of two, so that it loses nothing.
pub(crate) fn extent_of(facts: &CloudFacts) -> f64 {
    let boxes = facts.objects.iter().map(|object| object.size);
    let extent = (facts.bounds_max - facts.bounds_min).max_element().max(boxes.fold(0.0, f64::max));
    // Beyond these the squares of f32 end, which nobody's scene needs.
    let exponent = extent.log2().round();
    if exponent.is_finite() { exponent.clamp(-120.0, 120.0).exp2() } else { 1.0 }
}

impl LightViews {
    /// What the lights of a frame see, each picture with `side` texels, fewer where there are many.
    pub(crate) fn new<P>(frame: &Frame<P>, side: u32) -> Self {
        let mut faces = Vec::new();
        for (i, light) in
            frame.scene.lights.iter().take(surfelshop_api::Scene::MAX_LIGHTS).enumerate()
        {
            let source = Lamp::new(light, &frame.view, &frame.cloud);
            if source.intensity.max_element() > 0.0 {
                faces.extend(faces_of(i as u32, light, &source, &frame.cloud));
            }
        }
        faces.truncate(MOST_FACES);
        let mut side = side.next_power_of_two().clamp(CELLS, 4096);
        while u64::from(side) * u64::from(side) * faces.len() as u64 > MOST_TEXELS && side > CELLS {
            side /= 2;
        }
        for face in &mut faces {
            face.view.size_px = [side; 2];
            if face.own < 1.0 {
                // A point light's face has a cell more on each side, so that filters find neighbours
                // there; whole cells are its own, so that none is lit in part.
                let own = f64::from(CELLS - 2) / f64::from(CELLS);
                (face.own, face.half_extent) = (own, 1.0 / own);
                let fov_y = 2.0 * face.half_extent.atan();
                face.view.camera.projection = Projection::Perspective { fov_y };
            }
        }
        Self { faces, side, frame_index: frame.frame_index }
    }

    /// Texels on a side of each face of the light surface buffer.
    pub(crate) fn lit_side(&self) -> u32 {
        self.side.min(MOST_LIT)
    }

    /// Declares the cameras.
    pub(crate) fn cameras(&self, graph: &mut Graph) -> Vec<CameraId> {
        let camera = |(i, face): (usize, &Face)| {
            let before = self.faces[..i]
                .iter()
                .filter(|other| other.light_index == face.light_index)
                .count();
            let label = match self
                .faces
                .iter()
                .filter(|other| other.light_index == face.light_index)
                .count()
            {
                1 => format!("light {}", face.light_index + 1),
                _ => format!("light {}, side {}", face.light_index + 1, before + 1),
            };
            graph.camera(&label, &face.view)
        };
        self.faces.iter().enumerate().map(camera).collect()
    }

    /// The bytes of `Faces` of `light_views.wgsl`.
    pub(crate) fn uniform(&self, eye: DVec3, extent: f64) -> Uniform {
        let mut uniform = Uniform::new();
        for face in &self.faces {
            let view_from_world = face.view.camera.view_from_world();
            let row = |i: usize| view_from_world.row(i).as_vec3();
            let is_parallel =
                matches!(face.view.camera.projection, Projection::Orthographic { .. });
            let unit = if is_parallel { extent } else { 1.0 };
            uniform = uniform
                .vec3(row(0))
                .u32(face.light_index)
                .vec3(row(1))
                .f32((face.half_extent / unit) as f32)
                .vec3(row(2))
                .u32(u32::from(is_parallel))
                .vec3(((face.view.camera.eye - eye) / extent).as_vec3())
                .f32(face.own as f32);
        }
        for _ in self.faces.len()..MOST_FACES {
            for _ in 0..4 {
                uniform = uniform.vec3(Vec3::ZERO).u32(0);
            }
        }
        let block = self.side / self.lit_side();
        let [x, y] = chosen_of(block, self.frame_index);
        let uniform = uniform.u32(self.faces.len() as u32).u32(self.side);
        uniform.f32((1.0 / extent) as f32).u32(self.lit_side()).u32(x).u32(y).u32(block)
    }
}

/// The texel that is taken of blocks of so many on a side, a power of two: each once in as many frames, from
/// the middle on.
fn chosen_of(block: u32, frame_index: u32) -> [u32; 2] {
    let n = block * block;
    let middle = n / 2 + block / 2;
    let i = frame_index.wrapping_mul(n / 2 + 1).wrapping_add(middle) % n;
    [i % block, i / block]
}

/// The faces of a light.
fn faces_of(number: u32, light: &Light, source: &Lamp, facts: &CloudFacts) -> Vec<Face> {
    let Some(position) = source.position else {
        return vec![parallel(number, source.towards, facts)];
    };
    let face = |target: DVec3, up: DVec3, fov_y: f64, own: f64| {
        let projection = Projection::Perspective { fov_y };
        let camera = Camera { eye: position, target: position + target, up, projection };
        let near = source.nearest;
        let half_extent = (0.5 * fov_y).tan();
        let view = View { camera, size_px: [1; 2], near, far: 2.0 * near };
        Face { light_index: number, view, half_extent, own }
    };
    if let Light::Spot { angle, .. } = light
        && *angle <= WIDEST_SPOT
    {
        // A spot of no angle has no light, and a camera some.
        let fov_y = 2.0 * (angle.max(1e-3) * 1.02).min(WIDEST_SPOT);
        let up = source.towards.any_orthonormal_vector();
        return vec![face(-source.towards, up, fov_y, 1.0)];
    }
    let sides = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
    let six = sides.map(|side| {
        let up = if side.y == 0.0 { DVec3::Y } else { DVec3::X };
        face(side, up, FRAC_PI_2, 0.9)
    });
    six.into()
}

/// What a directional light sees: all of the scene.
fn parallel(number: u32, towards: DVec3, facts: &CloudFacts) -> Face {
    let center = 0.5 * facts.bounds_min + 0.5 * facts.bounds_max;
    let boxes = facts.objects.iter().map(|object| object.size).fold(0.0, f64::max);
    let radius = (0.5 * (facts.bounds_max - facts.bounds_min).length()).max(0.5 * boxes) * AROUND;
    let radius = if radius > 0.0 && radius.is_finite() { radius } else { 1.0 };
    let camera = Camera {
        eye: center + towards * (2.0 * radius),
        target: center,
        up: towards.any_orthonormal_vector(),
        projection: Projection::Orthographic { height: 2.0 * radius },
    };
    let view = View { camera, size_px: [1; 2], near: 0.5 * radius, far: 3.5 * radius };
    Face { light_index: number, view, half_extent: radius, own: 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use surfelshop_api::Scene;

    fn frame(lights: Vec<Light>) -> Frame<()> {
        let camera = Camera {
            eye: DVec3::new(0.0, 0.0, 4.0),
            target: DVec3::ZERO,
            up: DVec3::Y,
            projection: Projection::Perspective { fov_y: 0.7 },
        };
        let view = View { camera, size_px: [64; 2], near: 0.01, far: 9.0 };
        let cloud = CloudFacts {
            n_surfels: 9,
            bounds_min: DVec3::splat(-1.0),
            bounds_max: DVec3::ONE,
            ..CloudFacts::default()
        };
        let scene = Scene { lights, ..Scene::default() };
        Frame { view, scene, cloud, frame_index: 0, params: (), environment: None }
    }

    fn spot(angle: f64) -> Light {
        let (position, target) = (DVec3::Y, DVec3::ZERO);
        Light::Spot { position, target, intensity: Vec3::ONE, angle, softness: 0.2 }
    }

    #[test]
    fn each_kind_of_light_has_its_pictures() {
        let position = DVec3::ZERO;
        let n = |light: Light| LightViews::new(&frame(vec![light]), 512).faces.len();
        assert_eq!(n(spot(0.5)), 1);
        assert_eq!(n(spot(2.0)), 6);
        assert_eq!(n(Light::Point { position, intensity: Vec3::ONE }), 6);
        assert_eq!(n(Light::Point { position, intensity: Vec3::ZERO }), 0);
        assert_eq!(n(Light::Point { position: DVec3::NAN, intensity: Vec3::ONE }), 0);
        assert_eq!(LightViews::new(&frame(Vec::new()), 512).faces.len(), 0);
        assert_eq!(LightViews::new(&frame(Scene::default().lights), 512).faces.len(), 1);
        let many = vec![Light::Point { position, intensity: Vec3::ONE }; 9];
        let many = LightViews::new(&frame(many), 1024);
        assert_eq!(many.faces.len(), MOST_FACES);
        assert!(u64::from(many.side).pow(2) * 48 <= MOST_TEXELS);
    }

    #[test]
    fn lights_see_half_as_finely_in_motion_and_no_less() {
        let sides = [0, 1, 2, 3, 4, 64, u32::MAX].map(|stride| side_in_motion(512, stride));
        assert_eq!(sides, [512, 512, 512, 512, 256, 256, 256]);
    }

    #[test]
    fn every_texel_of_a_block_has_its_frame() {
        for block in [1, 2, 4, 8] {
            let n = block * block;
            let chosen: BTreeSet<[u32; 2]> = (0..n).map(|frame| chosen_of(block, frame)).collect();
            assert_eq!(chosen.len(), n as usize, "{block}");
            assert!(chosen.iter().flatten().all(|&at| at < block), "{block}");
            assert_eq!(chosen_of(block, 0), [block / 2; 2]);
        }
    }

    #[test]
    fn the_faces_of_a_point_light_have_every_direction_once() {
        let light = Light::Point { position: DVec3::ZERO, intensity: Vec3::ONE };
        let views = LightViews::new(&frame(vec![light]), 256);
        for i in 0..500u32 {
            let turn = f64::from(i) * 2.4;
            let y = 1.0 - 2.0 * (f64::from(i) + 0.5) / 500.0;
            let r = (1.0 - y * y).sqrt();
            let direction = DVec3::new(r * turn.cos(), y, r * turn.sin());
            let own = |face: &&Face| {
                let seen = face.view.camera.view_from_world() * direction;
                let across = seen.truncate().abs().max_element() / -seen.z / face.half_extent;
                seen.z < 0.0 && across <= face.own
            };
            assert_eq!(views.faces.iter().filter(own).count(), 1, "{direction}");
        }
    }
}
