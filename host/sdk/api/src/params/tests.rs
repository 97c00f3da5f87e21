use crate::params::*;
use crate::{choices, params};

choices! {
    /// A test choice.
    enum Mode { Fast = "fast", Exact = "exact" }
}
params! {
    /// Test parameters.
    struct Settings {
        /// A number
        /// over two lines.
        some_gain: f32 { default: 1.0, range: 0.0..=2.0, unit: "stops" },
        /// A choice.
        mode: Mode { default: Mode::Exact, id: "how" },
        /// A count.
        count: u32 { default: 4, range: 1..=8, quality: true },
        /// Text.
        path: String { default: "a".into() },
    }
}

#[test]
fn declarations_carry_everything() {
    let declared = Settings::declare();
    assert_eq!(declared[0].id, "some-gain");
    assert_eq!(declared[0].doc, "A number over two lines.");
    assert_eq!(declared[0].range, Some([0.0, 2.0]));
    assert_eq!(declared[0].unit, "stops");
    assert_eq!(declared[1].id, "how");
    assert_eq!(declared[1].default, Value::Text("exact".into()));
    assert!(declared[2].quality);
}

#[test]
fn received_values_are_brought_into_range() {
    let mut values = Values::new();
    values.insert("some-gain".into(), Value::Float(f64::NAN));
    values.insert("count".into(), Value::Int(-7));
    values.insert("how".into(), Value::Text("fast".into()));
    values.insert("path".into(), Value::Bool(true));
    let settings = Settings::from_values(&values);
    assert_eq!(settings.some_gain, 1.0);
    assert_eq!(settings.count, 1);
    assert_eq!(settings.mode, Mode::Fast);
    assert_eq!(settings.path, "a");
}

#[test]
fn typed_text_is_checked_against_the_declaration() {
    let declared = Settings::declare();
    assert_eq!(declared[0].parse("1.5"), Ok(Value::Float(1.5)));
    let refused = declared[0].parse("3").unwrap_err();
    assert_eq!(refused, "parameter `some-gain` takes a number from 0 to 2, found `3`");
    assert!(declared[1].parse("slow").unwrap_err().contains("one of fast, exact"));
    assert_eq!(parse_color("#ffffff"), Some([1.0; 3]));
    assert_eq!(parse_color("#fff"), None);
}

#[test]
fn srgb_round_trips() {
    for i in 0..=255u8 {
        let encoded = f32::from(i) / 255.0;
        // powf in f32 is good to a few units in the last place.
        assert!((linear_to_srgb(srgb_to_linear(encoded)) - encoded).abs() < 1e-6);
    }
}
