use crate::{Buffer, Cloud, CloudError, Column, NEUTRAL_ALBEDO};
use glam::{DVec3, Vec3};
use surfelshop_api::columns::Values;

fn floats(name: &str, components: u32, values: &[f32]) -> Column {
    Column::new(name, components, Buffer::F32(values.to_vec()))
}

/// Three surfels at x = 0, 1 and 2 around an origin far away.
fn three() -> Cloud {
    let position = floats("position", 3, &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0]);
    let radius = floats("radius", 1, &[0.5; 3]);
    let id = Column::new("id", 1, Buffer::U32(vec![7, 8, 9]));
    Cloud::new(DVec3::splat(1e6), vec![position, radius, id]).unwrap()
}

#[test]
fn empty_cloud_has_empty_bounds() {
    let facts = Cloud::default().facts().clone();
    assert_eq!(
        (facts.n_surfels, facts.bounds_min, facts.bounds_max),
        (0, DVec3::ZERO, DVec3::ZERO)
    );
    assert_eq!((facts.equal_radius, facts.equal_color), (None, None));
    assert!(Cloud::default().positions().is_empty() && Cloud::default().is_empty());
}

#[test]
fn facts_are_in_world_space() {
    let cloud = three();
    let facts = cloud.facts();
    assert_eq!(facts.bounds_min, DVec3::splat(1e6));
    assert_eq!(facts.bounds_max, DVec3::new(1e6 + 2.0, 1e6, 1e6));
    assert_eq!(facts.columns, ["id", "position", "radius"]);
    assert_eq!(facts.equal_radius, Some(0.5));
    assert_eq!(facts.equal_color, Some(NEUTRAL_ALBEDO));
}

#[test]
fn columns_that_do_not_fit_are_refused() {
    let position = || floats("position", 3, &[0.0; 6]);
    let new = |more: Vec<Column>| Cloud::new(DVec3::ZERO, [vec![position()], more].concat());
    let twice = new(vec![position()]);
    assert_eq!(twice.unwrap_err(), CloudError::Twice { column: "position".to_owned() });
    let short = new(vec![floats("normal", 3, &[0.0; 3])]).unwrap_err();
    assert_eq!(short.to_string(), "column `normal`: expected 6 values, found 3");
    let wrong = new(vec![Column::new("radius", 1, Buffer::F64(vec![1.0; 2]))]).unwrap_err();
    assert_eq!(wrong.to_string(), "column `radius`: expected 1 x f32, found 1 x f64");
    let color = new(vec![Column::new("color", 2, Buffer::U8(vec![1; 4]))]).unwrap_err();
    assert!(color.to_string().starts_with("column `color`: expected 3 x u8 or 4 x u8"));
    let nan = new(vec![floats("ao", 1, &[0.0, f32::NAN])]).unwrap_err();
    assert_eq!(nan, CloudError::NotFinite { column: "ao".to_owned(), surfel: 1 });
    assert!(matches!(new(vec![floats("", 1, &[0.0; 2])]), Err(CloudError::Shape { .. })));
    assert!(matches!(new(vec![floats("none", 0, &[])]), Err(CloudError::Shape { .. })));
    assert_eq!(Cloud::new(DVec3::ZERO, vec![]).unwrap_err(), CloudError::NoPosition);
    let far = Cloud::new(DVec3::NAN, vec![position()]);
    assert!(matches!(far, Err(CloudError::Origin { .. })));
    assert!(new(vec![floats("custom", 2, &[f32::NAN; 4])]).is_ok());
}

#[test]
fn edits_share_the_columns_they_leave_alone() {
    let cloud = three();
    let edited =
        cloud.with_columns(vec![floats("ao", 1, &[0.1; 3]), floats("radius", 1, &[1.0; 3])]);
    let edited = edited.unwrap();
    let generation = |cloud: &Cloud, name: &str| cloud.column(name).unwrap().generation();
    assert_eq!(generation(&cloud, "position"), generation(&edited, "position"));
    assert_eq!(cloud.positions().as_ptr(), edited.positions().as_ptr());
    assert_ne!(generation(&cloud, "radius"), generation(&edited, "radius"));
    assert_eq!((cloud.radii(), edited.radii()), (&[0.5; 3][..], &[1.0; 3][..]));
    assert_eq!(edited.facts().equal_radius, Some(1.0));
    assert!(cloud.with_columns(vec![floats("ao", 1, &[0.1; 2])]).is_err());
    assert!(edited.without_column("ao").column("ao").is_none());
    assert!(edited.without_column("position").column("position").is_some());
}

#[test]
fn the_view_borrows_and_tells_generations() {
    let cloud = three();
    let view = cloud.view();
    assert_eq!((view.len, view.origin), (3, DVec3::splat(1e6)));
    assert_eq!(view.floats("position", 3).unwrap().as_ptr(), cloud.positions().as_ptr().cast());
    assert_eq!(view.column("id").unwrap().values, Values::U32(&[7, 8, 9]));
    let generations: Vec<u64> = view.columns.iter().map(|column| column.generation).collect();
    assert!(generations[0] != generations[1] && generations[1] != generations[2]);
    assert_eq!(view.vectors("position").last(), Some(Vec3::X * 2.0));
}

#[test]
fn a_mask_keeps_rows_of_every_column() {
    let kept = three().keep(&[true, false, true]).unwrap();
    assert_eq!(kept.positions(), [Vec3::ZERO, Vec3::X * 2.0]);
    assert_eq!(kept.column("id").unwrap().values(), &Buffer::U32(vec![7, 9]));
    assert_eq!(kept.facts().n_surfels, 2);
    assert!(three().keep(&[true]).is_err());
    assert!(three().keep(&[false; 3]).unwrap().is_empty());
}

#[test]
fn eight_and_sixteen_bit_colours_are_srgb() {
    let color =
        |values: Buffer| three().with_columns(vec![Column::new("color", 3, values)]).unwrap();
    let eight = color(Buffer::U8(vec![0, 10, 55, 128, 188, 255, 1, 2, 3]));
    // Reference values of IEC 61966-2-1.
    let expected = [[0.0, 0.003_035_3, 0.038_204_4], [0.215_860_5, 0.502_886_5, 1.0]];
    let linear = eight.linear_colors().unwrap();
    for (found, expected) in linear.iter().zip(expected) {
        assert!((Vec3::from(*found) - Vec3::from(expected)).abs().max_element() < 1e-6);
    }
    assert_eq!(eight.color_linear(1), Some(linear[1]));
    assert_eq!(eight.color_linear(3), None);
    let sixteen =
        color(Buffer::U16(vec![0, 10 * 257, 55 * 257, 128 * 257, 188 * 257, 65535, 257, 514, 771]));
    assert_eq!(sixteen.linear_colors().unwrap(), linear);
    assert_eq!(sixteen.color_linear(0), Some(linear[0]));
    assert_eq!(eight.facts().equal_color, None);
    let same = color(Buffer::U8([188, 0, 255].repeat(3)));
    assert_eq!(same.facts().equal_color, same.color_linear(2));
    assert_eq!(three().linear_colors(), None);
}

#[test]
fn bytes_of_tools_become_values() {
    use surfelshop_api::columns::Element;
    let bytes: Vec<u8> = [1.5f32, -2.0].iter().flat_map(|value| value.to_le_bytes()).collect();
    assert_eq!(Buffer::from_little_endian(Element::F32, &bytes), Buffer::F32(vec![1.5, -2.0]));
    assert_eq!(Buffer::from_little_endian(Element::I16, &[1, 0, 255]), Buffer::I16(vec![1]));
}
