use super::*;
use crate::cloud::axis::Axis;
use crate::cloud::buffer::Buffer;
use crate::cloud::column::Column;
use glam::DVec3;
use surfelshop_api::columns::{COLOR, NORMAL, PLANARITY, POSITION, RADIUS, ROUND, ROUND_UNBOUNDED};

/// Surfels in a row along y, with a column `a`.
pub(super) fn column_of(values: Buffer) -> Cloud {
    let n = values.len();
    let positions = (0..n).flat_map(|i| [0.0, i as f32, 0.0]).collect();
    let normals = (0..n).flat_map(|_| [0.0, 1.0, 0.0]).collect();
    let columns = vec![
        Column::new(POSITION, 3, Buffer::F32(positions)),
        Column::new(NORMAL, 3, Buffer::F32(normals)),
        Column::new(RADIUS, 1, Buffer::F32(vec![0.5; n])),
        Column::new("a", 1, values),
    ];
    Cloud::new(DVec3::ZERO, columns).unwrap()
}

pub(super) fn floats(values: &[f64]) -> Cloud {
    column_of(Buffer::F64(values.to_vec()))
}

fn generations(cloud: &Cloud) -> Vec<u64> {
    cloud.columns().iter().map(Column::generation).collect()
}

fn by(attribute: Attribute) -> DisplaySettings {
    let color = ColorSource::new(ColorBy::Attribute(attribute));
    DisplaySettings { color, ..DisplaySettings::default() }
}

fn filters(all: &[(FilterAction, FilterTest)]) -> DisplaySettings {
    let filter = |(action, test): &(FilterAction, FilterTest)| Filter {
        attribute: Attribute::column("a"),
        action: *action,
        test: test.clone(),
    };
    DisplaySettings { filters: all.iter().map(filter).collect(), ..DisplaySettings::default() }
}

fn display(cloud: &Cloud, settings: &DisplaySettings) -> Displayed {
    Display::new(settings, &[cloud]).unwrap().of(cloud).unwrap()
}

fn colors(cloud: &Cloud) -> Vec<[u8; 3]> {
    let Some(Buffer::U8(values)) = cloud.column(COLOR).map(Column::values) else {
        panic!("no colours of 8 bits")
    };
    values.as_chunks().0.to_vec()
}

/// Invariant: what nothing colours or filters is displayed as it is, down to the generations of its columns
#[test]
fn what_is_plain_is_displayed_as_it_is() {
    let cloud = floats(&[1.0, 2.0]);
    let displayed = display(&cloud, &DisplaySettings::default());
    assert_eq!(generations(&displayed.cloud), generations(&cloud));
    assert!(displayed.kept.is_none() && displayed.cloud.column(COLOR).is_none());
    // Neither do filters that let everything through change anything.
    let all = filters(&[(FilterAction::Keep, FilterTest::Range([0.0, 9.0]))]);
    let displayed = display(&cloud, &all);
    assert_eq!(generations(&displayed.cloud), generations(&cloud));
    assert!(displayed.kept.is_none());
}

/// Invariant: equal columns and settings give columns of equal generations for as long as somebody displays
/// them
#[test]
fn what_is_displayed_is_found_again() {
    let cloud = floats(&[1.0, 2.0, 3.0, 4.0]);
    let mut settings = filters(&[(FilterAction::Hide, FilterTest::Values(vec![2]))]);
    settings.color = by(Attribute::column("a")).color;
    let first = display(&cloud, &settings);
    let again = display(&cloud.clone(), &settings);
    assert_eq!(generations(&first.cloud), generations(&again.cloud));
    assert_eq!(first.kept, again.kept);
    // Another map changes the colours, and nothing else of those that are shown.
    settings.color.map = MapChoice::Map(ColorMap::Turbo);
    let other = display(&cloud, &settings);
    for (one, another) in first.cloud.columns().iter().zip(other.cloud.columns()) {
        let is_same = one.generation() == another.generation();
        assert_eq!(is_same, one.name() != COLOR, "{}", one.name());
    }
    // The rest of the cloud is shared where nothing is filtered.
    settings.filters.clear();
    let whole = display(&cloud, &settings).cloud;
    assert_eq!(generations(&whole)[..4], generations(&cloud)[..]);
}

#[test]
fn filters_are_all_held() {
    let cloud = floats(&[0.0, 1.0, 2.0, 3.0, 4.0, f64::NAN]);
    let range = |low, high| FilterTest::Range([low, high]);
    let values = |values: &[i64]| FilterTest::Values(values.to_vec());
    for (tests, expected) in [
        (vec![(FilterAction::Keep, range(1.0, 3.0))], vec![1, 2, 3]),
        (vec![(FilterAction::Hide, range(1.0, 3.0))], vec![0, 4, 5]),
        (vec![(FilterAction::Keep, values(&[0, 4, 9]))], vec![0, 4]),
        (vec![(FilterAction::Hide, values(&[0, 4, 9]))], vec![1, 2, 3, 5]),
        (
            vec![
                (FilterAction::Keep, range(1.0, f64::INFINITY)),
                (FilterAction::Hide, values(&[3])),
            ],
            vec![1, 2, 4],
        ),
        (vec![(FilterAction::Keep, range(7.0, 8.0))], vec![]),
    ] {
        let shown = display(&cloud, &filters(&tests));
        assert_eq!(shown.kept.as_deref(), Some(&expected[..]), "{tests:?}");
        let places: Vec<f32> = shown.cloud.positions().iter().map(|p| p.y).collect();
        assert_eq!(places, expected.iter().map(|i| *i as f32).collect::<Vec<_>>());
        assert_eq!(shown.cloud.len(), expected.len());
        assert_eq!(shown.cloud.facts().n_surfels, expected.len() as u64);
        // Textures stay where they were fastened.
        assert_eq!(shown.cloud.object(), cloud.object());
        for (i, source) in expected.iter().enumerate() {
            assert_eq!(shown.source_index(i), *source as usize);
        }
    }
}

#[test]
fn triangles_stay_where_all_their_corners_do() {
    let cloud = floats(&[0.0, 1.0, 2.0, 3.0]).with_faces(vec![[0, 1, 2], [1, 2, 3]]).unwrap();
    let test = FilterTest::Range([1.0, 9.0]);
    let shown = display(&cloud, &filters(&[(FilterAction::Keep, test)]));
    assert_eq!(shown.cloud.faces(), [[0, 1, 2]]);
}

#[test]
fn numbers_have_the_colours_of_the_map() {
    let cloud = floats(&[0.0, 5.0, 10.0, -7.0, 99.0, f64::NAN, f64::INFINITY]);
    let mut settings = by(Attribute::column("a"));
    settings.color.range = [RangeEnd::Value(0.0), RangeEnd::Value(10.0)];
    let map = ColorMap::Viridis.colors();
    let expected = [map[0], map[128], map[255], map[0], map[255], [188; 3], map[255]];
    assert_eq!(colors(&display(&cloud, &settings).cloud), expected);
    settings.color.scale = Scale::Logarithmic;
    settings.color.range = [RangeEnd::Value(1.0), RangeEnd::Value(25.0)];
    let found = colors(&display(&cloud, &settings).cloud);
    assert_eq!((found[0], found[1], found[4]), (map[0], map[128], map[255]));
}

#[test]
fn the_range_is_of_all_clouds_together() {
    let (low, high) = (floats(&[0.0, 1.0]), floats(&[9.0, 10.0]));
    let mut settings = by(Attribute::column("a"));
    settings.color.range = [RangeEnd::Percent(0.0), RangeEnd::Percent(100.0)];
    let together = Display::new(&settings, &[&low, &high]).unwrap();
    let Colors::Ramp(ramp) = together.colors() else { panic!("no ramp") };
    assert_eq!((ramp.range, ramp.beyond), ([0.0, 10.0], [false, false]));
    settings.color.range = [RangeEnd::Value(0.0), RangeEnd::Value(9.5)];
    let narrower = Display::new(&settings, &[&low, &high]).unwrap();
    assert!(matches!(narrower.colors(), Colors::Ramp(ramp) if ramp.beyond == [false, true]));
    let map = ColorMap::Viridis.colors();
    assert_eq!(colors(&together.of(&high).unwrap().cloud)[1], map[255]);
    assert_eq!(colors(&together.of(&low).unwrap().cloud)[0], map[0]);
    // A cloud without the column is neutral, and is not filtered by it.
    let without = low.without_column("a");
    settings.filters = filters(&[(FilterAction::Keep, FilterTest::Values(vec![9]))]).filters;
    let display = Display::new(&settings, &[&without, &high]).unwrap();
    assert_eq!(colors(&display.of(&without).unwrap().cloud), [[188; 3]; 2]);
    assert_eq!(display.of(&high).unwrap().kept.as_deref(), Some(&[0][..]));
}

#[test]
fn heights_are_world_coordinates_along_the_upward_axis() {
    let cloud = floats(&[0.0; 3]);
    let columns = cloud.columns().to_vec();
    let moved = Cloud::new(DVec3::new(7.0, 4e6, -2.0), columns).unwrap();
    let test = FilterTest::Range([4e6 + 0.5, 4e6 + 1.5]);
    let filter = Filter { attribute: Attribute::Height, action: FilterAction::Keep, test };
    let mut settings = DisplaySettings { filters: vec![filter], ..by(Attribute::Height) };
    assert_eq!(display(&moved, &settings).kept.as_deref(), Some(&[1][..]));
    settings.up = Axis::PlusZ;
    settings.filters[0].test = FilterTest::Range([-2.0, -2.0]);
    let shown = display(&moved, &settings);
    assert!(shown.kept.is_none());
    // All are as high: the colour of the middle.
    assert_eq!(colors(&shown.cloud), [ColorMap::Viridis.colors()[128]; 3]);
}

#[test]
fn few_whole_numbers_are_categories_unless_something_else_is_said() {
    let labels = column_of(Buffer::U8(vec![2, 6, 2]));
    let mut settings = by(Attribute::column("a"));
    let palette = Palette::Numbers;
    let expected = [2, 6, 2].map(|value| palette.color(value));
    assert_eq!(colors(&display(&labels, &settings).cloud), expected);
    settings.color.map = MapChoice::Map(ColorMap::Grey);
    settings.color.range = [RangeEnd::Value(0.0), RangeEnd::Value(6.0)];
    assert_eq!(colors(&display(&labels, &settings).cloud)[1], [255; 3]);
    // Numbers with a point are none, but where their column says so.
    settings.color = by(Attribute::column("a")).color;
    let is_ramp = |cloud: &Cloud, name: &str| {
        let settings = by(Attribute::column(name));
        matches!(Display::new(&settings, &[cloud]).unwrap().colors(), Colors::Ramp(_))
    };
    let plain = floats(&[1.0, 2.0]);
    let named = Column::new("scalar_Classification", 1, Buffer::F32(vec![2.0, 6.0]));
    assert!(is_ramp(&plain, "a"));
    let classes = plain.with_columns(vec![named]).unwrap();
    assert!(!is_ramp(&classes, "scalar_Classification"));
    settings.color.by = ColorBy::Attribute(Attribute::column("scalar_Classification"));
    let legend = Display::new(&settings, &[&classes]).unwrap().legend().unwrap();
    let LegendBody::List(entries) = legend.body else { panic!("no list") };
    let labels: Vec<_> = entries.iter().map(|entry| (entry.label.as_str(), entry.n)).collect();
    assert_eq!(labels, [("2 ground", Some(1)), ("6 building", Some(1))]);
}

#[test]
fn hidden_categories_are_not_in_the_legend() {
    let labels = column_of(Buffer::U8(vec![2, 6, 7, 7]));
    let mut settings = filters(&[(FilterAction::Hide, FilterTest::Values(vec![7]))]);
    settings.color = by(Attribute::column("a")).color;
    let legend = Display::new(&settings, &[&labels]).unwrap().legend().unwrap();
    let LegendBody::List(entries) = legend.body else { panic!("no list") };
    assert_eq!(entries.len(), 2);
    assert_eq!((legend.title.as_str(), entries[1].label.as_str()), ("a", "6"));
}

#[test]
fn normals_are_told_apart_by_their_direction_whatever_their_length() {
    let all = colors::normal_color;
    let directions = [glam::Vec3::X, -glam::Vec3::X, glam::Vec3::Y, -glam::Vec3::Y, glam::Vec3::Z];
    for (i, a) in directions.iter().enumerate() {
        assert_eq!(all(*a, Axis::PlusY), all(*a * 0.01, Axis::PlusY));
        for b in &directions[..i] {
            assert_ne!(all(*a, Axis::PlusY), all(*b, Axis::PlusY));
        }
    }
    let light = |color: [u8; 3]| color.iter().map(|c| u32::from(*c)).sum::<u32>();
    assert!(light(all(glam::Vec3::Y, Axis::PlusY)) > light(all(-glam::Vec3::Y, Axis::PlusY)));
    // Up is up: turned with the axis, a direction keeps its colour.
    assert_eq!(all(glam::Vec3::Y, Axis::PlusY), all(glam::Vec3::Z, Axis::PlusZ));
    assert_eq!(all(-glam::Vec3::Z, Axis::PlusY), all(glam::Vec3::Y, Axis::PlusZ));
    assert_eq!(all(glam::Vec3::ZERO, Axis::PlusY), [188; 3]);
    let color = ColorSource::new(ColorBy::Normal);
    let settings = DisplaySettings { color, ..DisplaySettings::default() };
    let shown = display(&floats(&[1.0]), &settings).cloud;
    assert_eq!(colors(&shown), [all(glam::Vec3::Y, Axis::PlusY)]);
    assert!(Display::new(&settings, &[&shown]).unwrap().legend().is_some());
}

#[test]
fn one_colour_is_that_of_all_and_stands_in_the_facts() {
    let color = ColorSource::new(ColorBy::Uniform([255, 0, 128]));
    let settings = DisplaySettings { color, ..DisplaySettings::default() };
    let shown = display(&floats(&[1.0, 2.0]), &settings).cloud;
    assert_eq!(colors(&shown), [[255, 0, 128]; 2]);
    let facts = shown.facts();
    assert_eq!(facts.equal_color.map(|c| [c[0], c[1]]), Some([1.0, 0.0]));
    assert_eq!(facts.colored, [true]);
    assert!(facts.columns.is_sorted() && facts.columns.contains(&COLOR.to_owned()));
    let whole = Cloud::new(shown.origin(), shown.columns().to_vec()).unwrap();
    assert_eq!(whole.facts(), facts, "facts that were carried over are those that would be found");
}

#[test]
fn mistakes_are_one_line() {
    let cloud = floats(&[-1.0, 0.5]);
    let line = |settings: &DisplaySettings| {
        let error = Display::new(settings, &[&cloud]).unwrap_err().to_string();
        assert!(!error.contains('\n'), "{error}");
        error
    };
    let expected =
        "no cloud has a column `b`; there are `a`, `normal`, `position`, `radius`, and `height`";
    assert_eq!(line(&by(Attribute::column("b"))), expected);
    let mut filter = filters(&[(FilterAction::Keep, FilterTest::Values(vec![1]))]);
    filter.filters[0].attribute = Attribute::column("b");
    assert_eq!(line(&filter), expected);
    let component = by(Attribute::column("normal").with_component(3));
    assert_eq!(line(&component), "column `normal`: expected a component below 3, found 3");
    let mut categories = by(Attribute::column("a"));
    categories.color.map = MapChoice::Categories;
    assert!(line(&categories).starts_with("`a`: expected at most 1024 different whole numbers"));
    let mut log = by(Attribute::column("normal"));
    log.color.scale = Scale::Logarithmic;
    assert!(line(&log).starts_with("`normal`: expected numbers above 0 for a logarithmic scale"));
    // What is typed may lie below 0 all the same: the lower end is then the least number above it.
    let mut log = by(Attribute::column("a"));
    log.color.scale = Scale::Logarithmic;
    log.color.range = [RangeEnd::Value(-3.0), RangeEnd::Value(2.0)];
    let shown = Display::new(&log, &[&cloud]).unwrap();
    assert!(matches!(shown.colors(), Colors::Ramp(ramp) if ramp.range == [0.5, 2.0]));
}

#[test]
fn clouds_of_nothing_are_displayed() {
    let empty = floats(&[]);
    let color =
        |by: ColorBy| DisplaySettings { color: ColorSource::new(by), ..DisplaySettings::default() };
    for settings in [
        by(Attribute::Height),
        by(Attribute::column("a")),
        color(ColorBy::Normal),
        color(ColorBy::Uniform([1; 3])),
        filters(&[(FilterAction::Keep, FilterTest::Values(vec![1]))]),
    ] {
        assert_eq!(display(&empty, &settings).cloud.len(), 0);
        // Without a cloud there is nothing to be wrong.
        assert!(Display::new(&settings, &[]).is_ok());
    }
    let nothing = floats(&[f64::NAN, f64::NAN]);
    assert_eq!(colors(&display(&nothing, &by(Attribute::column("a"))).cloud), [[188; 3]; 2]);
}

/// Surfels whose surroundings are flat, half flat and not.
fn uneven() -> Cloud {
    let planarity = Column::new(PLANARITY, 1, Buffer::F32(vec![1.0, 0.45, 0.1]));
    floats(&[1.0, 2.0, 3.0]).with_columns(vec![planarity]).unwrap()
}

fn round(cloud: &Cloud) -> Option<&[u8]> {
    match cloud.column(ROUND).map(Column::values) {
        Some(Buffer::U8(round)) => Some(round),
        _ => None,
    }
}

fn splats(splats: SplatSettings) -> DisplaySettings {
    DisplaySettings { splats, ..DisplaySettings::default() }
}

/// Invariant: planarity of any type says the same
#[test]
fn planarity_may_have_any_type() {
    let types = [
        Buffer::F64(vec![1.0, 0.45, 0.1]),
        Buffer::U8(vec![255, 115, 25]),
        Buffer::U16(vec![65_535, 29_491, 6_553]),
        Buffer::U8(vec![1, 0, 0]),
    ];
    for planarity in types {
        let said = format!("{planarity:?}");
        let columns = vec![Column::new(PLANARITY, 1, planarity)];
        let cloud = floats(&[1.0, 2.0, 3.0]).with_columns(columns).unwrap();
        let displayed = display(&cloud, &splats(SplatSettings::default())).cloud;
        assert_eq!(round(&displayed), Some(&[0, 1, 1][..]), "{said}");
    }
}

/// Invariant: what is no surface is displayed as round splats, from the planarity on that the scene says
#[test]
fn what_is_no_surface_is_round() {
    let cloud = uneven();
    let usual = SplatSettings::default();
    let displayed = display(&cloud, &splats(usual)).cloud;
    assert_eq!(round(&displayed), Some(&[0, 1, 1][..]));
    assert_eq!(generations(&displayed)[..5], generations(&cloud)[..], "all else is shared");
    let again = display(&cloud, &splats(usual)).cloud;
    assert_eq!(generations(&displayed), generations(&again), "found again");
    let fewer = SplatSettings { round_below: 0.2, ..usual };
    assert_eq!(round(&display(&cloud, &splats(fewer)).cloud), Some(&[0, 0, 1][..]));
    let none = SplatSettings { round_below: 0.0, ..usual };
    assert_eq!(generations(&display(&cloud, &splats(none)).cloud), generations(&cloud));
    assert!(splats(none).is_plain(std::iter::once(&cloud)));
    assert!(!splats(usual).is_plain(std::iter::once(&cloud)));
    // Those that are shown keep theirs.
    let mut hidden = filters(&[(FilterAction::Hide, FilterTest::Values(vec![2]))]);
    hidden.splats = usual;
    assert_eq!(round(&display(&cloud, &hidden).cloud), Some(&[0, 1][..]));
}

#[test]
fn radii_have_a_limit_and_points_have_one() {
    let cloud = uneven();
    let limited = SplatSettings { largest_radius: Some(0.25), ..SplatSettings::default() };
    assert_eq!(display(&cloud, &splats(limited)).cloud.radii(), [0.25; 3]);
    let generous = SplatSettings { largest_radius: Some(0.75), ..SplatSettings::default() };
    let displayed = display(&cloud, &splats(generous)).cloud;
    assert_eq!(displayed.column(RADIUS).unwrap().generation(), cloud.columns()[2].generation());
    let points = |radius| SplatSettings { look: Look::Points { radius }, ..limited };
    let displayed = display(&cloud, &splats(points(0.1))).cloud;
    assert_eq!(
        (displayed.radii(), round(&displayed)),
        (&[0.1; 3][..], Some(&[ROUND_UNBOUNDED; 3][..]))
    );
    let tiny = display(&cloud, &splats(points(0.0))).cloud;
    assert!(tiny.radii().iter().all(|radius| *radius > 0.0 && *radius < 1e-6));
}

#[test]
fn points_are_no_ellipses() {
    let axis = |name| Column::new(name, 3, Buffer::F32(vec![0.5; 9]));
    let tangents = vec![axis("tangent_u"), axis("tangent_v")];
    let cloud = uneven().with_columns(tangents).unwrap();
    let points = SplatSettings { look: Look::Points { radius: 0.1 }, ..SplatSettings::default() };
    let displayed = display(&cloud, &splats(points)).cloud;
    assert!(displayed.column("tangent_u").is_none() && displayed.column("tangent_v").is_none());
}
