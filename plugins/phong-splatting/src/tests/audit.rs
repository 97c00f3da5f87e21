//! What the columns of a new cloud say, taken by themselves.

use super::{TestCloud, ToolOutput};
use surfelshop_api::columns::{CLIP, NORMAL, NORMAL_FIELD, POSITION, RADIUS, TANGENT_U, TANGENT_V};
use surfelshop_api::glam::{DVec2, DVec3};

/// A splat as a renderer reads it.
#[derive(Clone, Debug)]
pub(super) struct AuditedSplat {
    pub(super) at: DVec3,
    pub(super) normal: DVec3,
    pub(super) axes: [DVec3; 2],
    pub(super) half: DVec2,
    /// The unit normal of the plane, on the side of `normal`.
    pub(super) up: DVec3,
    field: [f64; 4],
    pub(super) clip: [f64; 7],
}

impl AuditedSplat {
    /// All splats of a run; that their columns are sound is checked on the way.
    pub(super) fn all(ran: &ToolOutput) -> Vec<Self> {
        let (positions, normals) = (ran.vectors(POSITION), ran.vectors(NORMAL));
        let (us, vs) = (ran.vectors(TANGENT_U), ran.vectors(TANGENT_V));
        let (radii, fields, clips) =
            (ran.floats(RADIUS), ran.floats(NORMAL_FIELD), ran.floats(CLIP));
        let all = [&flat(&positions), &flat(&normals), &flat(&us), &flat(&vs)];
        assert!(all.iter().all(|values| values.iter().all(|value| value.is_finite())));
        assert!(
            [&radii, &fields, &clips].iter().all(|values| values.iter().all(|v| v.is_finite()))
        );
        assert_eq!(fields.len(), positions.len() * 4);
        (0..positions.len())
            .map(|i| {
                let half = DVec2::new(us[i].length(), vs[i].length());
                let axes = [us[i] / half.x, vs[i] / half.y];
                assert!(half.min_element() > 0.0 && axes[0].dot(axes[1]).abs() < 1e-5, "{half}");
                assert!((f64::from(radii[i]) / half.max_element() - 1.0).abs() < 1e-5);
                assert!((normals[i].length() - 1.0).abs() < 1e-5);
                let up = axes[0].cross(axes[1]);
                let up = up * up.dot(normals[i]).signum();
                assert!(up.dot(normals[i]) > 0.2, "{}", up.dot(normals[i]));
                let field = std::array::from_fn(|k| f64::from(fields[i * 4 + k]));
                let clip =
                    std::array::from_fn(|k| clips.get(i * 7 + k).copied().map_or(0.0, f64::from));
                Self { at: positions[i], normal: normals[i], axes, half, up, field, clip }
            })
            .collect()
    }

    /// Coordinates in units of the half axes.
    pub(super) fn of(&self, point: DVec3) -> DVec2 {
        let d = point - self.at;
        DVec2::new(self.axes[0].dot(d), self.axes[1].dot(d)) / self.half
    }

    pub(super) fn height(&self, point: DVec3) -> f64 {
        self.up.dot(point - self.at)
    }

    /// The normal that is shaded with.
    pub(super) fn shaded(&self, at: DVec2) -> DVec3 {
        let [x, y, alpha, beta] = self.field;
        (self.up + self.axes[0] * (x + alpha * at.x) + self.axes[1] * (y + beta * at.y))
            .normalize_or_zero()
    }

    /// How far inside of what stays a place is, scene units; negative for what is cut off.
    pub(super) fn kept(&self, at: DVec2) -> f64 {
        let side = |line: &[f64]| {
            let gradient = (DVec2::new(line[0], line[1]) / self.half).length();
            (line[0] * at.x + line[1] * at.y + line[2]) / gradient.max(1e-30)
        };
        let [first, second] = [side(&self.clip[..3]), side(&self.clip[3..6])];
        match self.clip[6] as u32 {
            0 => f64::INFINITY,
            1 => first.min(second),
            _ => first.max(second),
        }
    }
}

fn flat(vectors: &[DVec3]) -> Vec<f32> {
    vectors.iter().flat_map(|vector| vector.as_vec3().to_array()).collect()
}

/// Angles between normals of samples and of splats, radians.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Errors {
    pub(super) field: f64,
    pub(super) constant: f64,
    pub(super) field_max: f64,
    pub(super) constant_max: f64,
}

/// Root mean squares and maxima over the samples of all splats; and the mean of splats over a sample.
pub(super) fn errors(given: &TestCloud, splats: &[AuditedSplat], tolerance: f64) -> (Errors, f64) {
    let (mut errors, mut count) = (Errors::default(), 0.0);
    let angle = |a: DVec3, b: DVec3| a.cross(b).length().atan2(a.dot(b));
    for splat in splats {
        for (point, normal) in given.positions.iter().zip(&given.normals) {
            let (point, normal) = (point.as_dvec3(), normal.as_dvec3());
            let is_high = splat.height(point).abs() > tolerance * (1.0 + 1e-4);
            let at = splat.of(point);
            if is_high || at.length_squared() > 1.0 || splat.up.dot(normal) < 0.25 {
                continue;
            }
            let (field, constant) = (angle(splat.shaded(at), normal), angle(splat.normal, normal));
            count += 1.0;
            errors.field += field * field;
            errors.constant += constant * constant;
            errors.field_max = errors.field_max.max(field);
            errors.constant_max = errors.constant_max.max(constant);
        }
    }
    errors.field = (errors.field / count).sqrt();
    errors.constant = (errors.constant / count).sqrt();
    (errors, count / given.positions.len() as f64)
}

/// Samples that no splat holds: within the tolerance of its plane, on its side, all of the disc in the
/// ellipse and the middle of it not cut off by more than `slack`.
pub(super) fn n_uncovered(
    given: &TestCloud,
    radii: &[f32],
    splats: &[AuditedSplat],
    tolerance: f64,
    slack: f64,
) -> usize {
    let holds = |splat: &AuditedSplat, point: DVec3, normal: DVec3, radius: f64| {
        splat.at.distance(point) <= 1.1 * splat.half.max_element()
            && splat.height(point).abs() <= tolerance * (1.0 + 1e-4)
            && splat.up.dot(normal) > 0.2
            && splat.kept(splat.of(point)) >= -slack
            && (0..24).all(|i| {
                let [sine, cosine] = {
                    let (sine, cosine) = (f64::from(i) * std::f64::consts::TAU / 24.0).sin_cos();
                    [sine, cosine]
                };
                let edge = point + (splat.axes[0] * cosine + splat.axes[1] * sine) * radius;
                splat.of(edge).length() <= 1.0 + 1e-6
            })
    };
    let samples = given.positions.iter().zip(&given.normals).enumerate();
    samples
        .filter(|(i, (point, normal))| {
            let radius = radii.get(*i).copied().map_or(0.0, f64::from);
            !splats.iter().any(|splat| holds(splat, point.as_dvec3(), normal.as_dvec3(), radius))
        })
        .count()
}
