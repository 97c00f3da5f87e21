use super::*;
use crate::assemble;
use crate::formats::batches::CloudBatches;
use crate::formats::table_sink::TableSink;
use crate::{Buffer, Column, ReadOptions, Rotation, StagedEdits, ToolRun, Transform};
use surfelshop_api::columns::{Element, POSITION, Role};
use surfelshop_api::format::{CloudHeader, CloudSinkHost as _, CloudSourceHost as _, Pose};
use surfelshop_api::params::Values;
use surfelshop_api::tool::{ColumnHeader, EditHeader};

fn turn() -> DQuat {
    DQuat::from_xyzw(0.3, -0.5, 1.1, 0.7).normalize()
}

/// Invariant: splats look alike after they are turned, from where they are seen then
#[test]
fn turned_splats_look_alike_from_turned_directions() {
    let rotation = Rotation::Quaternion(turn());
    for n_scales in [2, 3] {
        let cloud = Trained::new(40, n_scales, 3).ply("ascii", "float").load().cloud;
        let transform = Transform { translation: DVec3::new(1.0, 2.0, -3.0), rotation, scale: 2.5 };
        let moved = cloud.transformed(&transform).unwrap();
        let matrix = DMat3::from_quat(turn());
        for i in 0..40 {
            for d in directions() {
                let error = color(&moved, i, turn() * d) - color(&cloud, i, d);
                assert!(error.length() < 1e-6, "{error}");
            }
            let expected = matrix * covariance(&cloud, i) * matrix.transpose() * 6.25;
            let error = (covariance(&moved, i) - expected).to_cols_array();
            let size = expected.to_cols_array().iter().fold(0.0, |most: f64, c| most.max(c.abs()));
            assert!(error.iter().all(|e| e.abs() < 1e-6 * size), "{error:?}");
        }
        assert_eq!(moved.floats(OPACITY, 1), cloud.floats(OPACITY, 1));
        let generation = |cloud: &Cloud, name| cloud.column(name).unwrap().generation();
        for name in [OPACITY, SH[0], "color"] {
            assert_eq!(generation(&moved, name), generation(&cloud, name), "{name}");
        }
    }
}

/// Clouds of a file are turned by their poses, and back where each is written in its own axes.
#[test]
fn poses_of_files_turn_splats() {
    let cloud = Trained::new(25, 3, 3).ply("ascii", "float").load().cloud;
    let speed = Column::new("speed", 3, Buffer::F32(vec![0.5; 75])).with_role(Role::Direction);
    let cloud = cloud.with_columns(vec![speed]).unwrap();
    let handed = reading::handed_over(&cloud, &["normal", "radius", "tangent_u", "tangent_v"]);
    let poses = [
        Pose { rotation: turn(), translation: DVec3::new(1.0, 0.0, 2.0) },
        Pose { rotation: DQuat::from_rotation_x(1.0), translation: DVec3::ZERO },
    ];
    let mut sink = TableSink::default();
    for pose in poses {
        let columns = handed.iter().map(|(column, _)| column.clone()).collect();
        sink.begin(&CloudHeader { columns, pose, ..CloudHeader::default() }).unwrap();
        let values: Vec<_> = handed.iter().map(|(_, values)| values.as_values()).collect();
        sink.batch(&values).unwrap();
    }
    let (table, source) = sink.finish().unwrap();
    let both = assemble::cloud(table, source, &ReadOptions::default()).unwrap().cloud;
    let near = |found: &[f32], expected: &[f32], what: &str| {
        let is_near = |(a, b): (&f32, &f32)| (a - b).abs() < 2e-6;
        assert!(found.iter().zip(expected).all(is_near), "{what}");
    };
    let mut batches = CloudBatches::new(&both, true);
    for (i, Pose { rotation, translation }) in poses.into_iter().enumerate() {
        let rotation = Rotation::Quaternion(rotation);
        let transform = Transform { translation, rotation, scale: 1.0 };
        let moved = cloud.transformed(&transform).unwrap();
        batches.next_cloud().unwrap().unwrap();
        let view = batches.next_batch().unwrap().unwrap();
        let names = [(SH[1], 9), (SH[2], 15), (SH[3], 21), (SPLAT_ROTATION, 4), ("speed", 3)];
        for (name, n) in names.into_iter().chain([(SPLAT_SCALE, 3)]) {
            let of = i * 25 * n as usize..(i + 1) * 25 * n as usize;
            near(&both.floats(name, n)[of], moved.floats(name, n), name);
            near(view.floats(name, n).unwrap(), cloud.floats(name, n), name);
        }
    }
}

#[test]
fn what_does_not_change_is_shared() {
    let cloud = Trained::new(10, 3, 3).ply("ascii", "float").load().cloud;
    let shared = |transform: Transform| -> Vec<String> {
        let moved = cloud.transformed(&transform).unwrap();
        let both = cloud.columns().iter().zip(moved.columns());
        let same = both.filter(|(a, b)| a.generation() == b.generation());
        same.map(|(a, _)| a.name().to_owned()).collect()
    };
    let all: Vec<&str> = cloud.columns().iter().map(Column::name).collect();
    assert_eq!(shared(Transform { translation: DVec3::X, ..Transform::default() }), all);
    let scaled = shared(Transform { scale: 2.0, ..Transform::default() });
    assert_eq!(scaled, ["color", OPACITY, SPLAT_ROTATION, SH[0], SH[1], SH[2], SH[3]]);
    let rotation = Rotation::Quaternion(turn());
    let turned = shared(Transform { rotation, ..Transform::default() });
    assert_eq!(turned, ["color", OPACITY, SPLAT_SCALE, SH[0]]);
}

/// A cloud of two surfels with a column in some role.
fn with_role(components: u32, values: Buffer, role: Role) -> Cloud {
    let position = Column::new(POSITION, 3, Buffer::F32(vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0]));
    let column = Column::new("own", components, values).with_role(role);
    Cloud::new(DVec3::ZERO, vec![position, column]).unwrap()
}

#[test]
fn columns_of_any_name_follow_their_roles() {
    let rotation = Rotation::Euler(DVec3::new(0.0, 0.0, std::f64::consts::FRAC_PI_2));
    let transform = Transform { rotation, scale: 3.0, ..Transform::default() };
    let moved = |components: u32, values: &[f64], role: Role| -> Vec<f64> {
        let wide = with_role(components, Buffer::F64(values.to_vec()), role);
        let narrow = values.iter().map(|&value| value as f32).collect();
        let narrow = with_role(components, Buffer::F32(narrow), role);
        let [wide, narrow] = [wide, narrow].map(|cloud| {
            let moved = cloud.transformed(&transform).unwrap();
            let column = moved.column("own").unwrap();
            assert_eq!(column.role(), role);
            column.values().iter_f64().collect::<Vec<_>>()
        });
        assert!(wide.iter().zip(&narrow).all(|(a, b)| (a - b).abs() < 1e-6 || a.is_nan()));
        wide
    };
    let near = |found: Vec<f64>, expected: &[f64]| {
        let is_near = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-12;
        assert!(found.iter().zip(expected).all(is_near), "{found:?} for {expected:?}");
    };
    near(moved(1, &[2.0, -1.0], Role::Length), &[6.0, -3.0]);
    near(moved(1, &[2.0, -1.0], Role::LogLength), &[2.0 + 3f64.ln(), 3f64.ln() - 1.0]);
    let direction = [1.0, 0.0, 5.0, 0.0, 2.0, 0.0];
    near(moved(3, &direction, Role::Direction), &[0.0, 1.0, 5.0, -2.0, 0.0, 0.0]);
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let quaternion = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 2.0];
    let expected = [0.0, 0.0, half, half, 0.0, 0.0, 2.0 * half, 2.0 * half];
    near(moved(4, &quaternion, Role::Quaternion), &expected);
    // Of one channel, y, z and x.
    let order_one = [1.0, 2.0, 3.0, 0.0, 0.0, 1.0];
    let expected = [3.0, 2.0, -1.0, 1.0, 0.0, 0.0];
    near(moved(3, &order_one, Role::SphericalHarmonics(1)), &expected);
    for role in [Role::Plain, Role::Radiance, Role::SphericalHarmonics(0)] {
        near(moved(3, &direction, role), &direction);
    }
    assert!(moved(1, &[f64::NAN, 1.0], Role::Length)[0].is_nan());
}

#[test]
fn roles_of_other_types_are_refused_by_name() {
    let rotation = Rotation::Quaternion(turn());
    let transform = Transform { rotation, scale: 3.0, ..Transform::default() };
    for (components, role) in [
        (1, Role::Length),
        (3, Role::Direction),
        (4, Role::Quaternion),
        (9, Role::SphericalHarmonics(1)),
    ] {
        let cloud = with_role(components, Buffer::I16(vec![1; 2 * components as usize]), role);
        let error = cloud.transformed(&transform).unwrap_err().to_string();
        assert!(error.contains("column `own` of") && error.contains("i16"), "{error}");
        // What stays as it is may have any type.
        let moved = Transform { translation: DVec3::X, ..Transform::default() };
        assert!(cloud.transformed(&moved).is_ok());
    }
    let floats = |n: usize| Buffer::F32(vec![1.0; 2 * n]);
    assert!(with_role(3, floats(3), Role::Quaternion).transformed(&transform).is_err());
    let sixth = with_role(13, floats(13), Role::SphericalHarmonics(6));
    assert!(sixth.transformed(&transform).is_err());
    let huge = with_role(1, Buffer::F32(vec![1.0, 3e38]), Role::Length);
    let error = huge.transformed(&transform).unwrap_err().to_string();
    assert!(error.contains("`own` cannot hold"), "{error}");
}

#[test]
fn a_role_stays_with_its_column() {
    let cloud = with_role(3, Buffer::F32(vec![1.0; 6]), Role::Direction);
    let role = |cloud: &Cloud| cloud.column("own").unwrap().role();
    assert_eq!(role(&cloud.keep(&[true, false]).unwrap()), Role::Direction);
    let kept = cloud.column("own").unwrap().gather(&[1, 0]).unwrap();
    assert_eq!(kept.role(), Role::Direction);
    let header = |components, element| ColumnHeader { name: "own".to_owned(), components, element };
    for (components, element, expected) in [
        (3, Element::F32, Role::Direction),
        (3, Element::F64, Role::Direction),
        (6, Element::F32, Role::Plain),
        (3, Element::U8, Role::Plain),
    ] {
        let mut staged = StagedEdits::new(cloud.clone());
        let bytes = vec![0; 2 * components as usize * element.size()];
        let edit = EditHeader::Columns(vec![header(components, element)]);
        staged.stage(&edit, &[&bytes]).unwrap();
        let time = std::time::UNIX_EPOCH;
        let made = ToolRun::new("a/b".to_owned(), "1.0.0".to_owned(), &Values::default(), time);
        assert_eq!(role(&staged.commit(made).unwrap().cloud), expected);
    }
}
