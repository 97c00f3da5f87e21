use super::written;
use crate::cloud::selection::{Selection, SurfelRuns};
use crate::display::{
    Attribute, ColorBy, ColorSource, Filter, FilterAction, FilterTest, Look, MapChoice, RangeEnd,
    Scale, SplatSettings,
};
use crate::environment_map::Mapping;
use crate::scene::{
    Axis, Backdrop, CloudRenderer, EyeDomeLighting, EyeDomeUse, Keyed, Measure, MeasureKind,
    ProbeSource, SceneCloud, SceneEnvironment, SceneFile, SceneView, Table, ToneMap, read,
};
use crate::{Rotation, Transform};
use glam::{DQuat, DVec3, Vec3};
use proptest::collection::{btree_map, vec};
use proptest::option;
use proptest::prelude::*;
use surfelshop_api::graph::Output;
use surfelshop_api::params::{Value, Values};
use surfelshop_api::{Camera, Light, Projection, SurfaceSettings};

/// Values as third parties' programs write them, a few levels deep.
fn anything() -> impl Strategy<Value = toml::Value> {
    let leaf = prop_oneof![
        any::<bool>().prop_map(toml::Value::from),
        any::<i64>().prop_map(toml::Value::from),
        prop_oneof![any::<f64>(), Just(f64::INFINITY), Just(-0.0)]
            .prop_filter("NaN does not equal itself", |number| !number.is_nan())
            .prop_map(toml::Value::from),
        any::<String>().prop_map(toml::Value::from),
        Just(toml::Value::Datetime("1979-05-27T07:32:00.5-08:00".parse().unwrap())),
    ];
    leaf.prop_recursive(4, 24, 4, |inner| {
        prop_oneof![
            vec(inner.clone(), 0..4).prop_map(toml::Value::Array),
            btree_map(any::<String>(), inner, 0..4)
                .prop_map(|table| toml::Value::Table(table.into_iter().collect())),
        ]
    })
}

/// Keys that no version will know.
fn unknown() -> impl Strategy<Value = Table> {
    btree_map("x[a-z .\"é]{0,4}", anything(), 0..3).prop_map(|table| table.into_iter().collect())
}

fn keyed<T: std::fmt::Debug>(known: impl Strategy<Value = T>) -> impl Strategy<Value = Keyed<T>> {
    (known, unknown()).prop_map(|(known, unknown)| Keyed { known, unknown })
}

fn place() -> impl Strategy<Value = DVec3> {
    let number = prop_oneof![-10.0..10.0f64, -5e6..5e6, -1e37..1e37];
    vec(number, 3).prop_map(|numbers| DVec3::from_slice(&numbers))
}

fn direction() -> impl Strategy<Value = DVec3> {
    place().prop_filter("no direction", |vector| vector.try_normalize().is_some())
}

fn color(most: f32) -> impl Strategy<Value = [f32; 3]> {
    [0.0..=most, 0.0..=most, 0.0..=most]
}

fn camera() -> impl Strategy<Value = Camera> {
    let projection = prop_oneof![
        (0.02f64..178.0).prop_map(|angle| Projection::Perspective { fov_y: angle.to_radians() }),
        (1e-30..1e37).prop_map(|height| Projection::Orthographic { height }),
    ];
    (place(), place(), direction(), projection)
        .prop_filter("no axis", |(eye, target, ..)| (*target - *eye).try_normalize().is_some())
        .prop_map(|(eye, target, up, projection)| Camera { eye, target, up, projection })
}

fn transform() -> impl Strategy<Value = Transform> {
    let angle = || (-720.0..720.0f64).prop_map(f64::to_radians);
    let rotation = prop_oneof![
        [angle(), angle(), angle()].prop_map(|angles| Rotation::Euler(DVec3::from(angles))),
        [-1.0..1.0, -1.0..1.0, -1.0..1.0, 0.1..9.0]
            .prop_map(|numbers| Rotation::Quaternion(DQuat::from_array(numbers))),
    ];
    (place(), rotation, 1e-9..1e9).prop_map(|(translation, rotation, scale)| Transform {
        translation,
        rotation,
        scale,
    })
}

fn cloud() -> impl Strategy<Value = SceneCloud> {
    let name = option::of(any::<String>());
    let renderer = ("[a-z./-]{1,9}", values());
    let renderer = renderer.prop_map(|(name, values)| CloudRenderer { name, values });
    let bits = vec(any::<bool>(), 1..80).prop_map(|bits| {
        let hidden = Selection::of(bits.len(), |index| bits[index]).unwrap();
        SurfelRuns::of(&hidden)
    });
    let layer = option::of("[a-zé ./\"]{0,8}a").prop_map(|layer| layer.map(Into::into));
    let of_bits = (option::of(bits), layer);
    let places = (option::of(keyed(transform())), option::of(renderer), of_bits);
    ("[a-zé ./\"]{0,8}a", name, any::<bool>(), places).prop_map(
        |(path, name, visible, (transform, renderer, (hidden, layer)))| SceneCloud {
            hidden,
            layer,
            path: path.into(),
            name,
            visible,
            transform,
            renderer,
        },
    )
}

fn values() -> impl Strategy<Value = Values> {
    let value = prop_oneof![
        any::<bool>().prop_map(Value::Bool),
        any::<i64>().prop_map(Value::Int),
        proptest::num::f64::NORMAL.prop_map(Value::Float),
        any::<String>().prop_map(Value::Text),
        [proptest::num::f32::NORMAL; 3].prop_map(Value::Color),
    ];
    btree_map("[a-z-]{1,6}", value, 0..4)
}

fn view() -> impl Strategy<Value = SceneView> {
    let output = prop_oneof![
        Just(Output::Color),
        Just(Output::Depth),
        Just(Output::Ao),
        "[a-z ]{1,4}".prop_map(Output::Debug),
    ];
    ("[a-z./-]{1,9}", values(), option::of(keyed(camera())), output).prop_map(
        |(renderer, values, camera, output)| SceneView { renderer, values, camera, output },
    )
}

fn light() -> impl Strategy<Value = Light> {
    let directional = (direction(), color(1e30), any::<bool>());
    let directional = directional.prop_map(|(towards, radiance, follows_camera)| {
        Light::Directional { towards, radiance: Vec3::from(radiance), follows_camera }
    });
    let place = || prop::array::uniform3(-1e6..1e6f64).prop_map(DVec3::from);
    let point = (place(), color(1e30)).prop_map(|(position, intensity)| Light::Point {
        position,
        intensity: Vec3::from(intensity),
    });
    let spot = (place(), direction(), color(1e30), 0.0..=180f64, 0.0..=1f32).prop_map(
        |(position, direction, intensity, degrees, softness)| Light::Spot {
            position,
            target: position + direction,
            intensity: Vec3::from(intensity),
            angle: degrees.to_radians(),
            softness,
        },
    );
    prop_oneof![directional, point, spot]
}

fn surface() -> impl Strategy<Value = SurfaceSettings> {
    (0.0..=16f32, any::<bool>(), 0.01..1000f32, 0.0..=4f32).prop_map(
        |(depth_tolerance, two_sided, radius_scale, low_pass)| SurfaceSettings {
            depth_tolerance,
            two_sided,
            radius_scale,
            low_pass,
        },
    )
}

fn environment() -> impl Strategy<Value = SceneEnvironment> {
    let source = prop_oneof![
        Just(ProbeSource::Studio),
        Just(ProbeSource::Sky),
        "[a-zé ./\"]{0,8}a".prop_map(|path| ProbeSource::File(path.into())),
    ];
    let axes = prop_oneof![
        Just((Axis::MinusZ, Axis::PlusY)),
        Just((Axis::PlusY, Axis::PlusZ)),
        Just((Axis::MinusX, Axis::MinusY)),
    ];
    let mapping = option::of(proptest::sample::select(Mapping::ALL.to_vec()));
    (source, mapping, axes, -720.0..720.0f64, -60.0..=60f32).prop_map(
        |(source, mapping, (forward, up), degrees, stops)| SceneEnvironment {
            source,
            mapping,
            forward,
            up,
            rotation: degrees.to_radians(),
            stops,
        },
    )
}

fn attribute() -> impl Strategy<Value = Attribute> {
    let name = prop_oneof!["[a-zé .\"\\[]{0,8}a", Just("height".into()), Just("column:x".into())];
    let column = (name, 0..9u32)
        .prop_map(|(name, component)| Attribute::column(name).with_component(component));
    prop_oneof![Just(Attribute::Height), column]
}

fn color_source() -> impl Strategy<Value = ColorSource> {
    let by = prop_oneof![
        Just(ColorBy::File),
        Just(ColorBy::Normal),
        any::<[u8; 3]>().prop_map(ColorBy::Uniform),
        attribute().prop_map(ColorBy::Attribute),
    ];
    let map = proptest::sample::select([&[MapChoice::Automatic], &MapChoice::ALL[..]].concat());
    let scale = proptest::sample::select(Scale::ALL.to_vec());
    let end = prop_oneof![
        (0.0..=100f64).prop_map(RangeEnd::Percent),
        proptest::num::f64::NORMAL.prop_map(RangeEnd::Value),
    ];
    (by, map, scale, [end.clone(), end]).prop_map(|(by, map, scale, [a, b])| {
        let range = if a.is_below(b) { [a, b] } else { [b, a] };
        ColorSource { by, map, scale, range }
    })
}

fn filter() -> impl Strategy<Value = Filter> {
    let end =
        || prop_oneof![proptest::num::f64::NORMAL, Just(f64::INFINITY), Just(f64::NEG_INFINITY)];
    let test = prop_oneof![
        [end(), end()].prop_map(|[a, b]| FilterTest::Range([a.min(b), a.max(b)])),
        vec(any::<i64>(), 1..5).prop_map(FilterTest::Values),
    ];
    let action = prop_oneof![Just(FilterAction::Keep), Just(FilterAction::Hide)];
    (attribute(), action, test).prop_map(|(attribute, action, test)| Filter {
        attribute,
        action,
        test,
    })
}

fn splats() -> impl Strategy<Value = SplatSettings> {
    let look =
        prop_oneof![Just(Look::Surface), (0.0..1e6f32).prop_map(|radius| Look::Points { radius }),];
    let parts = (look, 0.0..=1f32, option::of(1e-6..1e6f32), any::<bool>());
    parts.prop_map(|(look, round_below, largest_radius, tint_backs)| SplatSettings {
        look,
        round_below,
        largest_radius,
        tint_backs,
    })
}

fn backdrop() -> impl Strategy<Value = Backdrop> {
    prop_oneof![
        Just(Backdrop::Transparent),
        color(1.0).prop_map(Backdrop::Color),
        [color(1.0), color(1.0)].prop_map(|[top, bottom]| Backdrop::Gradient { top, bottom }),
    ]
}

fn measure() -> impl Strategy<Value = Measure> {
    let text = || "[ -~é\n]{0,12}";
    let of = (0..MeasureKind::ALL.len(), vec(place(), 4), option::of(1e-9..1e30f64), any::<bool>());
    (of, text(), text()).prop_map(|((kind, mut places, thickness, hidden), name, text)| {
        let kind = MeasureKind::ALL[kind];
        let is = |of: MeasureKind| kind == of;
        places.truncate(*kind.n_places().end());
        let text = if is(MeasureKind::Note) { text } else { String::new() };
        let thickness = thickness.filter(|_| is(MeasureKind::Profile));
        Measure { kind, name, text, places, thickness, hidden }
    })
}

prop_compose! {
    fn display()(
        up in option::of(proptest::sample::select(Axis::ALL.to_vec())),
        color in keyed(color_source()),
        filters in vec(keyed(filter()), 0..3),
        splats in keyed(splats()),
    ) -> (Option<Axis>, Keyed<ColorSource>, Vec<Keyed<Filter>>, Keyed<SplatSettings>) {
        (up, color, filters, splats)
    }
}

prop_compose! {
    fn scene()(
        clouds in vec(keyed(cloud()), 0..3),
        camera in option::of(keyed(camera())),
        lights in vec(keyed(light()), 0..3),
        (exposure_stops, antialias) in (-60.0..=60f32, 1..=1024u32),
        (when, strength, radius) in (0..3usize, 0.0..=100f32, 0.01..=32f32),
        is_neutral in any::<bool>(),
        background in backdrop(),
        surface in keyed(surface()),
        environment in option::of(keyed(environment())),
        (up, color, filters, splats) in display(),
        (views, measures) in (vec(keyed(view()), 0..3), vec(keyed(measure()), 0..4)),
        layout in unknown(),
        unknown in unknown(),
    ) -> SceneFile {
        SceneFile {
            clouds,
            camera,
            lights,
            exposure_stops,
            antialias,
            eye_dome: EyeDomeLighting {
                when: [EyeDomeUse::Automatic, EyeDomeUse::Off, EyeDomeUse::On][when],
                strength,
                radius,
            },
            tone_map: if is_neutral { ToneMap::Neutral } else { ToneMap::Clamp },
            background,
            surface,
            environment,
            up,
            color,
            filters,
            splats,
            views,
            measures,
            layout,
            unknown,
            ..SceneFile::default()
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Invariant: a scene is read back as it was, and saved again byte by byte alike
    #[test]
    fn scenes_are_read_back_as_they_were_and_written_alike(mut scene in scene()) {
        let (_folder, path, text) = written(&scene);
        let opened = read(&path).unwrap();
        scene.folder = opened.scene.folder.clone();
        prop_assert_eq!(&opened.scene, &scene);
        opened.scene.write(&path).unwrap();
        prop_assert_eq!(std::fs::read_to_string(&path).unwrap(), text);
    }
}

#[test]
fn eight_bit_backgrounds_stay_hexadecimal() {
    for code in 0..=255u8 {
        let text = format!("format = 1\nbackground = \"#{code:02x}00ff\"\n");
        let (_folder, _, text) = written(&super::open(&text).scene);
        assert!(text.contains(&format!("background = \"#{code:02x}00ff\"")), "{text}");
    }
}
