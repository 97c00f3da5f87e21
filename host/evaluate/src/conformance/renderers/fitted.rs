//! Clouds with the columns that a renderer reads, made from what every cloud of a case has.

use crate::conformance::verdict::Failure;
use glam::{DMat3, DQuat, DVec3};
use std::cell::RefCell;
use std::rc::Rc;
use surfelshop_api::Need;
use surfelshop_api::columns::{
    AO, COLOR, MATERIAL, NEUTRAL_ALBEDO, Role, SH, SPLAT_ROTATION, SPLAT_SCALE, TANGENT_U,
    TANGENT_V,
};
use surfelshop_api::params::linear_to_srgb;
use surfelshop_cloud::{Buffer, Cloud, Column};

/// The constant of the spherical harmonics of order 0: 1 / (2 √π).
const ORDER_0: f32 = 0.282_094_8;

/// How thick splats are, in their smaller width.
const THICKNESS: f64 = 0.1;

/// Makes clouds fit, and remembers the last: frames of one shot have the same columns.
pub(super) struct Fitting {
    needs: Vec<Need>,
    last: RefCell<Option<(Vec<u64>, Rc<Cloud>)>>,
}

impl Fitting {
    /// For a renderer that reads these columns; nothing is done for one that requires none.
    pub(super) fn new(needs: &[Need]) -> Self {
        let is_needy = needs.iter().any(|need| need.required);
        let needs = if is_needy { needs.to_vec() } else { Vec::new() };
        Self { needs, last: RefCell::default() }
    }

    /// Whether splats are Gaussians, which fade out and have no edge.
    pub(super) fn has_gaussians(&self) -> bool {
        self.needs.iter().any(|need| need.column == SPLAT_SCALE)
    }

    /// What is read.
    pub(super) fn needs(&self) -> &[Need] {
        &self.needs
    }

    /// A cloud once for each column that is read beyond the usual ones, with numbers of every size in it.
    pub(super) fn damaged(&self, cloud: &Cloud) -> Result<Vec<(String, Cloud)>, Failure> {
        let odd = [0.0, -1.0, 1e-30, 1e30, f32::MAX];
        let fitted = self.fitted(cloud)?;
        let mut all = Vec::new();
        for column in fitted.columns() {
            let is_made = cloud.column(column.name()).is_none();
            let Buffer::F32(values) = column.values() else { continue };
            if is_made {
                let values = values.iter().enumerate();
                let values = values
                    .map(|(i, &value)| if i % 7 == 0 { odd[i / 7 % odd.len()] } else { value });
                let values = Buffer::F32(values.collect());
                let damaged = Column::new(column.name(), column.components(), values);
                let what = format!("column `{}` of every size", column.name());
                // What a renderer names may be a column that the host holds to a type.
                let refused = |error| Failure::fault(format!("{what}: {error}"));
                let damaged = fitted.with_columns(vec![damaged]).map_err(refused)?;
                all.push((what, damaged));
            }
        }
        Ok(all)
    }

    /// The cloud with the columns that it lacks.
    pub(super) fn fitted(&self, cloud: &Cloud) -> Result<Rc<Cloud>, Failure> {
        if self.needs.is_empty() {
            return Ok(Rc::new(cloud.clone()));
        }
        let origin = cloud.origin().to_array().map(f64::to_bits);
        let generations = cloud.columns().iter().map(Column::generation);
        let key: Vec<u64> = origin.into_iter().chain(generations).collect();
        if let Some((known, fitted)) = &*self.last.borrow()
            && *known == key
        {
            return Ok(Rc::clone(fitted));
        }
        let fitted = Rc::new(fitted(cloud, &self.needs)?);
        self.last.replace(Some((key, Rc::clone(&fitted))));
        Ok(fitted)
    }
}

/// A cloud with the columns that are read and that it lacks.
fn fitted(cloud: &Cloud, needs: &[Need]) -> Result<Cloud, Failure> {
    let lacks = |need: &&Need| {
        cloud.column(&need.column).is_none_or(|column| column.components() < need.components)
    };
    let made: Vec<Column> = needs.iter().filter(lacks).map(|need| made(cloud, need)).collect();
    let refused = |error| Failure::fault(format!("it reads a column that no cloud has: {error}"));
    cloud.with_columns(made).map_err(refused)
}

/// A column by its name, or else by what it is.
fn made(cloud: &Cloud, need: &Need) -> Column {
    let surfels = Surfels { cloud, radii: cloud.radii() };
    let components = match need.column.as_str() {
        SPLAT_SCALE => need.components.max(2),
        SPLAT_ROTATION => need.components.max(4),
        _ => need.components.max(1),
    };
    let each = |row: &dyn Fn(usize) -> Vec<f64>| -> Buffer {
        let rows = (0..cloud.len()).flat_map(|i| {
            let row = row(i);
            // Numbers that are too many or too few come from a need that no column has by its name.
            row.into_iter().cycle().take(components as usize).collect::<Vec<_>>()
        });
        Buffer::F32(rows.map(|value| value as f32).collect())
    };
    let linear = || {
        let colors = cloud.linear_colors();
        move |i: usize| {
            colors.as_ref().and_then(|all| all.get(i)).copied().unwrap_or(NEUTRAL_ALBEDO)
        }
    };
    let wide = |color: [f32; 3]| color.map(f64::from).to_vec();
    let values = match (need.column.as_str(), need.role) {
        (SPLAT_SCALE, _) => each(&|i| surfels.deviations(i).to_vec()),
        (name, _) if name == SH[0] => {
            let linear = linear();
            each(&|i| wide(linear(i).map(|channel| (linear_to_srgb(channel) - 0.5) / ORDER_0)))
        }
        (MATERIAL, _) => Buffer::U32(vec![0; cloud.len() * components as usize]),
        (AO, _) => each(&|_| vec![1.0]),
        (TANGENT_U, _) => each(&|i| surfels.axes(i)[0].to_array().to_vec()),
        (TANGENT_V, _) => each(&|i| surfels.axes(i)[1].to_array().to_vec()),
        (_, Role::Length) => each(&|i| vec![surfels.radius(i)]),
        (_, Role::LogLength) => {
            each(&|i| vec![surfels.radius(i).max(f64::from(f32::MIN_POSITIVE)).ln()])
        }
        (_, Role::Direction) => each(&|i| surfels.normal(i).to_array().to_vec()),
        (_, Role::Quaternion) => each(&|i| surfels.rotation(i).to_array().to_vec()),
        (_, Role::SphericalHarmonics(_)) => each(&|_| vec![0.0]),
        (COLOR, _) | (_, Role::Radiance) => {
            let linear = linear();
            each(&|i| wide(linear(i)))
        }
        (_, Role::Plain) => each(&|_| vec![1.0]),
    };
    Column::new(need.column.as_str(), components, values).with_role(need.role)
}

/// What cases know of their surfels.
struct Surfels<'a> {
    cloud: &'a Cloud,
    radii: &'a [f32],
}

impl Surfels<'_> {
    fn radius(&self, i: usize) -> f64 {
        self.radii.get(i).map_or(1.0, |&radius| f64::from(radius))
    }

    fn vector(&self, name: &str, i: usize) -> Option<DVec3> {
        self.cloud.vectors(name).get(i).map(|vector| vector.as_dvec3())
    }

    /// Of any length where cases have it so.
    fn normal(&self, i: usize) -> DVec3 {
        self.cloud.normals().get(i).map_or(DVec3::Z, |normal| normal.as_dvec3())
    }

    fn tangents(&self, i: usize) -> Option<[DVec3; 2]> {
        Some([self.vector(TANGENT_U, i)?, self.vector(TANGENT_V, i)?])
    }

    /// The half axes of the disc.
    fn axes(&self, i: usize) -> [DVec3; 2] {
        self.tangents(i).unwrap_or_else(|| {
            let rotation = self.rotation(i);
            [rotation * DVec3::X, rotation * DVec3::Y].map(|axis| axis * self.radius(i))
        })
    }

    /// Standard deviations: two of them end at the disc's edge.
    fn deviations(&self, i: usize) -> [f64; 3] {
        let [u, v] = match self.tangents(i) {
            Some(tangents) => tangents.map(|tangent| 0.5 * tangent.length()),
            None => [0.5 * self.radius(i); 2],
        };
        [u, v, THICKNESS * u.min(v)]
    }

    /// From axes whose third is the normal, and the first the first tangent where there is one.
    fn rotation(&self, i: usize) -> DQuat {
        let normal = self.normal(i).normalize_or(DVec3::Z);
        if let Some([u, v]) = self.tangents(i)
            && let (Some(x), Some(z)) = (u.try_normalize(), u.cross(v).try_normalize())
        {
            let z = if z.dot(normal) < 0.0 { -z } else { z };
            return DQuat::from_mat3(&DMat3::from_cols(x, z.cross(x), z));
        }
        DQuat::from_rotation_arc(DVec3::Z, normal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conformance::{clouds, hard};
    use glam::{Quat, Vec3};
    use surfelshop_api::NeedInfo;
    use surfelshop_api::columns::{NORMAL, OPACITY, RADIUS};

    fn needs(all: &[NeedInfo]) -> Vec<Need> {
        all.iter().map(Need::from).collect()
    }

    const SPLATS: [NeedInfo; 5] = [
        NeedInfo::column(SPLAT_SCALE, 2),
        NeedInfo::column(SPLAT_ROTATION, 4),
        NeedInfo::column(OPACITY, 1).optional(),
        NeedInfo::column(SH[0], 3).optional(),
        NeedInfo::column(SH[1], 9).optional(),
    ];

    fn quaternions(cloud: &Cloud) -> Vec<Quat> {
        let values = cloud.floats(SPLAT_ROTATION, 4);
        values.chunks_exact(4).map(Quat::from_slice).collect()
    }

    #[test]
    fn discs_become_gaussians_in_their_planes() {
        let cloud = clouds::sphere(200, 2.0).cloud();
        let made = fitted(&cloud, &needs(&SPLATS)).unwrap();
        let radius = cloud.radii()[0];
        assert_eq!(made.floats(SPLAT_SCALE, 2), vec![0.5 * radius; 400]);
        assert_eq!(made.floats(OPACITY, 1), vec![1.0; 200]);
        assert_eq!(made.floats(SH[1], 9), vec![0.0; 1800]);
        for (rotation, normal) in quaternions(&made).into_iter().zip(cloud.normals()) {
            assert!((rotation * Vec3::Z - *normal).length() < 1e-6);
            assert!((rotation.length() - 1.0).abs() < 1e-6);
        }
        let Some(Buffer::U8(colors)) = cloud.column(COLOR).map(Column::values) else { panic!() };
        for (harmonic, color) in made.floats(SH[0], 3).iter().zip(colors) {
            assert!((0.5 + ORDER_0 * harmonic - f32::from(*color) / 255.0).abs() < 1e-5);
        }
        let role = |name: &str| made.column(name).unwrap().role();
        assert_eq!([role(SPLAT_SCALE), role(SPLAT_ROTATION)], [Role::Length, Role::Quaternion]);
    }

    #[test]
    fn ellipses_keep_their_axes() {
        let surfels = clouds::sphere(100, 1.0).elliptical(0.4);
        let three = [NeedInfo::column(SPLAT_SCALE, 3), SPLATS[1]];
        let made = fitted(&surfels.cloud(), &needs(&three)).unwrap();
        let scales = made.floats(SPLAT_SCALE, 3).chunks_exact(3);
        for ((rotation, scale), [u, v]) in
            quaternions(&made).iter().zip(scales).zip(&surfels.tangents)
        {
            assert!((*rotation * Vec3::X).dot(u.normalize_or(Vec3::Z)) > 1.0 - 1e-5);
            assert!((scale[0] - 0.5 * u.length()).abs() < 1e-6 && scale[1] <= v.length());
            assert!(scale[2] > 0.0 && scale[2] < 0.11 * scale[0]);
        }
    }

    #[test]
    fn other_columns_are_made_by_what_they_are() {
        let cloud = clouds::sphere(10, 1.0).cloud();
        let all = [
            NeedInfo::column("reach", 1).role(Role::Length),
            NeedInfo::column("size", 1).role(Role::LogLength),
            NeedInfo::column("facing", 3).role(Role::Direction),
            NeedInfo::column("glow", 3).role(Role::Radiance),
            NeedInfo::column("weight", 2),
            NeedInfo::column(AO, 1),
            NeedInfo::column(MATERIAL, 1),
        ];
        let made = fitted(&cloud, &needs(&all)).unwrap();
        assert_eq!(made.floats("reach", 1), cloud.radii());
        assert_eq!(made.floats("size", 1)[0], cloud.radii()[0].ln());
        assert_eq!(made.floats("facing", 3), cloud.floats(NORMAL, 3));
        assert_eq!(made.floats("glow", 3)[..3], cloud.color_linear(0).unwrap());
        assert_eq!(made.floats("weight", 2), [1.0; 20]);
        assert_eq!(made.column("reach").unwrap().role(), Role::Length);
        // What no cloud can have is the renderer's fault.
        let failure = fitted(&cloud, &needs(&[NeedInfo::column(RADIUS, 5)])).unwrap_err();
        assert!(failure.is_fault && failure.line.contains("radius"), "{}", failure.line);
    }

    #[test]
    fn hard_surfels_give_numbers() {
        for (what, cloud) in hard::damaged() {
            let made = fitted(&cloud, &needs(&SPLATS)).unwrap();
            for (name, n) in [(SPLAT_SCALE, 2), (SPLAT_ROTATION, 4), (SH[0], 3)] {
                assert!(made.floats(name, n).iter().all(|v| v.is_finite()), "{what}, {name}");
            }
        }
    }

    #[test]
    fn what_is_not_required_changes_nothing_and_frames_share_columns() {
        let cloud = clouds::sphere(10, 1.0).cloud();
        let optional = needs(&SPLATS[2..]);
        let same = Fitting::new(&optional).fitted(&cloud).unwrap();
        assert_eq!(same.columns().len(), cloud.columns().len());
        let fitting = Fitting::new(&needs(&SPLATS));
        let generations = || -> Vec<u64> {
            let fitted = fitting.fitted(&cloud).unwrap();
            fitted.columns().iter().map(Column::generation).collect()
        };
        assert_eq!(generations(), generations());
        assert!(fitting.has_gaussians() && !Fitting::new(&optional).has_gaussians());
    }
}
