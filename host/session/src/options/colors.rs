//! What colours surfels, which are shown and how they look, as it is typed.

use crate::options::values;
use anyhow::ensure;
use clap::Args;
use surfelshop_api::SurfaceSettings;
use surfelshop_cloud::display::{
    Attribute, ColorBy, ColorSource, DisplaySettings, Filter, FilterAction, FilterTest, Look,
    MapChoice, RangeEnd, Scale, SplatSettings,
};
use surfelshop_cloud::scene::MOST_FILTERS;

/// What colours surfels, which are shown, and how they look.
#[derive(Clone, Debug, Default, Args)]
pub struct ColorArguments {
    /// What colours surfels: file (their own colours), normal, height, the name of a column, or #rrggbb for
    /// all.
    ///
    /// `NAME[I]` is another component of a column than the first, and column:NAME a column that is called like
    /// one of the others. Columns of few whole numbers, such as classes, are categories.
    #[arg(long, value_name = "WHAT", value_parser = color_by)]
    pub color_by: Option<ColorBy>,
    /// The colours of numbers: viridis, turbo, grey, diverging, or categories with a colour for each whole
    /// number [default: categories or viridis].
    #[arg(long, value_name = "MAP", value_parser = color_map)]
    pub color_map: Option<MapChoice>,
    /// How numbers are spread over the map: linear or log.
    #[arg(long, value_name = "SCALE", value_parser = color_scale)]
    pub color_scale: Option<Scale>,
    /// The ends of the map, as numbers or as percentages of the surfels that lie below [default: 2%,98%].
    #[arg(long, value_name = "LOW,HIGH", value_parser = color_range, allow_hyphen_values = true)]
    pub color_range: Option<ColorRange>,
    /// Hide surfels by a column or the height: NAME=LOW..HIGH, where an end may be left out, or NAME=N,N,…
    /// with whole numbers; `none` shows what a scene hides. May be repeated.
    #[arg(long, value_name = "NAME=VALUES", value_parser = FilterSpec::parse)]
    pub hide: Vec<FilterSpec>,
    /// Show these surfels alone, said as for --hide; may be repeated, and all must be so.
    #[arg(long, value_name = "NAME=VALUES", value_parser = FilterSpec::parse)]
    pub only: Vec<FilterSpec>,
    /// Draw all surfels as points: round splats so many pixels wide, such as 3px (up to 8px), or of a radius in scene
    /// units, such as 0.02; `none` draws surfels where a scene has points. A width sets the low-pass.
    #[arg(long, value_name = "SIZE", value_parser = PointSpec::parse, allow_hyphen_values = true)]
    pub points: Option<PointSpec>,
    /// Draw surfels whose surroundings are less flat than this as round splats that face the eye, where clouds have a
    /// column `planarity`: from 0 (none) to 1 [default: 0.5]. Clouds get it where normals or radii are estimated and
    /// some of it is below 0.5, and by the tool `normals` with measures=true.
    #[arg(long, value_name = "PLANARITY", value_parser = values::planarity,
          allow_hyphen_values = true)]
    pub round_below: Option<f32>,
    /// Draw no disc with a larger radius than this, scene units; ellipses stay.
    #[arg(long, value_name = "RADIUS", value_parser = values::largest_radius,
          allow_hyphen_values = true)]
    pub largest_radius: Option<f32>,
    /// Draw surfels that are seen from behind in magenta, which shows where normals face; `--tint-backs=false` draws them
    /// as they are where a scene does not. Tracers, and what renderers draw themselves, have no backs.
    #[arg(long, value_name = "true|false", num_args = 0..=1, require_equals = true,
          default_missing_value = "true", hide_possible_values = true)]
    pub tint_backs: Option<bool>,
}

/// How large points are, as typed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PointSpec {
    /// Surfels are no points.
    None,
    /// Their width in pixels.
    Pixels(f32),
    /// Their radius in scene units.
    Radius(f32),
}

impl PointSpec {
    /// Reads `3px`, `0.02` or `none`.
    ///
    /// # Errors
    /// A line that says what was expected.
    pub fn parse(text: &str) -> Result<Self, String> {
        let expected =
            "expected a width such as 3px, from 0.5px to 8px, a radius such as 0.02, or none";
        let number = |text: &str| text.trim().parse().ok().filter(|n: &f32| n.is_finite());
        let found = match text.strip_suffix("px") {
            _ if text == "none" => Some(Self::None),
            Some(width) => number(width).filter(|n| (0.5..=8.0).contains(n)).map(Self::Pixels),
            None => number(text).filter(|n| *n > 0.0 && *n <= 1e37).map(Self::Radius),
        };
        found.ok_or_else(|| expected.to_owned())
    }
}

/// The ends of a map as typed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ColorRange(pub [RangeEnd; 2]);

/// A filter as typed; `None` for no filter at all.
#[derive(Clone, Debug, PartialEq)]
pub struct FilterSpec(pub Option<(Attribute, FilterTest)>);

impl ColorArguments {
    /// Whether nothing was typed.
    pub fn is_empty(&self) -> bool {
        let Self { color_by, color_map, color_scale, color_range, hide, only, .. } = self;
        let has_map = color_map.is_some() || color_scale.is_some() || color_range.is_some();
        let has_look = self.points.is_some()
            || self.round_below.is_some()
            || self.largest_radius.is_some()
            || self.tint_backs.is_some();
        color_by.is_none() && !has_map && hide.is_empty() && only.is_empty() && !has_look
    }

    /// The settings of the surface that draw points as wide as was typed.
    pub fn over_surface(&self, scene: &SplatSettings, surface: &mut SurfaceSettings) {
        match (self.points, scene.look) {
            (Some(PointSpec::Pixels(width)), _) => surface.low_pass = 0.5 * width,
            // As wide as they were is what points were, and no surface is.
            (Some(PointSpec::None), Look::Points { radius }) if radius <= 0.0 => {
                surface.low_pass = SurfaceSettings::default().low_pass;
            }
            _ => {}
        }
    }

    /// What was typed, over what a scene says. Another source than the scene's has the usual map, and filters
    /// that are typed take the place of the scene's.
    pub fn over(&self, scene: DisplaySettings) -> anyhow::Result<DisplaySettings> {
        let DisplaySettings { mut color, mut filters, mut splats, up } = scene;
        if let Some(by) = &self.color_by {
            color = ColorSource::new(by.clone());
        }
        let typed = [
            ("--color-map", self.color_map.is_some()),
            ("--color-scale", self.color_scale.is_some()),
            ("--color-range", self.color_range.is_some()),
        ];
        if let Some((option, _)) = typed.iter().find(|(_, is_typed)| *is_typed) {
            ensure!(
                matches!(color.by, ColorBy::Attribute(_)),
                "{option}: expected --color-by with `height` or the name of a column beside it"
            );
        }
        color.map = self.color_map.unwrap_or(color.map);
        color.scale = self.color_scale.unwrap_or(color.scale);
        color.range = self.color_range.map_or(color.range, |range| range.0);
        if !self.hide.is_empty() || !self.only.is_empty() {
            let typed = |all: &[FilterSpec], action: FilterAction| {
                let given = all.iter().filter_map(|spec| spec.0.clone());
                given.map(move |(attribute, test)| Filter { attribute, action, test }).collect()
            };
            let hide: Vec<Filter> = typed(&self.hide, FilterAction::Hide);
            let only: Vec<Filter> = typed(&self.only, FilterAction::Keep);
            filters = [hide, only].concat();
            let (n, most) = (filters.len(), MOST_FILTERS);
            ensure!(n <= most, "expected at most {most} --hide and --only, found {n}");
        }
        splats.look = match self.points {
            None => splats.look,
            Some(PointSpec::None) => Look::Surface,
            Some(PointSpec::Pixels(_)) => Look::Points { radius: 0.0 },
            Some(PointSpec::Radius(radius)) => Look::Points { radius },
        };
        splats.round_below = self.round_below.unwrap_or(splats.round_below);
        splats.largest_radius = self.largest_radius.or(splats.largest_radius);
        splats.tint_backs = self.tint_backs.unwrap_or(splats.tint_backs);
        Ok(DisplaySettings { color, filters, splats, up })
    }
}

/// Reads what colours surfels.
pub fn color_by(text: &str) -> Result<ColorBy, String> {
    let expected = "expected file, normal, height, the name of a column, or #rrggbb";
    match text.trim() {
        "" | "column:" | "uniform" => Err(expected.to_owned()),
        "file" => Ok(ColorBy::File),
        "normal" => Ok(ColorBy::Normal),
        color if color.starts_with('#') => {
            hexadecimal(color).map(ColorBy::Uniform).ok_or_else(|| expected.to_owned())
        }
        name => Ok(ColorBy::Attribute(attribute(name))),
    }
}

/// The channels of `#rrggbb`.
fn hexadecimal(text: &str) -> Option<[u8; 3]> {
    let digits = text.strip_prefix('#').filter(|digits| digits.len() == 6 && digits.is_ascii())?;
    let channel = |i: usize| u8::from_str_radix(digits.get(2 * i..2 * i + 2)?, 16).ok();
    Some([channel(0)?, channel(1)?, channel(2)?]).filter(|_| !digits.contains('+'))
}

/// The attribute of a name, with a component in brackets where it has one.
fn attribute(text: &str) -> Attribute {
    let component = text.strip_suffix(']').and_then(|text| text.rsplit_once('['));
    let component = component.and_then(|(name, digits)| Some((name, digits.parse().ok()?)));
    match component.filter(|(name, _)| !name.is_empty() && !text.starts_with("column:")) {
        // Behind brackets stands the name of a column, whatever it is.
        Some((name, component)) => Attribute::column(name).with_component(component),
        None => Attribute::from_name(text),
    }
}

/// Reads a map.
pub fn color_map(text: &str) -> Result<MapChoice, String> {
    let names = MapChoice::ALL.map(MapChoice::name).join(", ");
    let found = MapChoice::from_name(text).filter(|choice| *choice != MapChoice::Automatic);
    found.ok_or_else(|| format!("expected one of {names}"))
}

/// Reads a scale.
pub fn color_scale(text: &str) -> Result<Scale, String> {
    Scale::from_name(text).ok_or_else(|| "expected linear or log".to_owned())
}

/// Reads the ends of a map.
pub fn color_range(text: &str) -> Result<ColorRange, String> {
    let ends = text.split_once(',');
    let ends = ends.and_then(|(low, high)| Some([RangeEnd::parse(low)?, RangeEnd::parse(high)?]));
    match ends {
        Some([low, high]) if low.is_below(high) => Ok(ColorRange([low, high])),
        _ => Err("expected LOW,HIGH as numbers or percentages, the lower first, such as 5%,95%"
            .to_owned()),
    }
}

impl FilterSpec {
    /// Reads `NAME=LOW..HIGH`, `NAME=N,N` or `none`.
    ///
    /// # Errors
    /// A line that says what was expected.
    pub fn parse(text: &str) -> Result<Self, String> {
        let expected = "expected NAME=LOW..HIGH or NAME=N,N with whole numbers, such as height=0..12.5 or \
                        classification=7,18";
        if text == "none" {
            return Ok(Self(None));
        }
        let (name, values) = text.rsplit_once('=').ok_or(expected)?;
        if name.trim().is_empty() || name == "column:" {
            return Err(expected.to_owned());
        }
        let test = match values.split_once("..") {
            Some((low, high)) => {
                let end = |text: &str, open: f64| match text.trim() {
                    "" => Some(open),
                    text => text.parse().ok().filter(|number: &f64| !number.is_nan()),
                };
                let low = end(low, f64::NEG_INFINITY).ok_or(expected)?;
                let high = end(high, f64::INFINITY).ok_or(expected)?;
                if low > high {
                    return Err("expected the lower end of a range first".to_owned());
                }
                FilterTest::Range([low, high])
            }
            None => {
                let values = values.split(',').map(|value| value.trim().parse().ok());
                let values: Option<Vec<i64>> = values.collect();
                FilterTest::Values(values.ok_or(expected)?)
            }
        };
        Ok(Self(Some((attribute(name.trim()), test))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::explicit::parse;
    use surfelshop_cloud::scene::Axis;

    fn settings(options: &str, scene: DisplaySettings) -> anyhow::Result<DisplaySettings> {
        let line = format!("surfelshop render {options}");
        let line: Vec<&str> = line.split_whitespace().collect();
        parse::<ColorArguments>(&line)?.0.over(scene)
    }

    fn scene() -> DisplaySettings {
        let mut color = ColorSource::new(ColorBy::Attribute(Attribute::Height));
        color.map = MapChoice::Map(surfelshop_cloud::display::ColorMap::Turbo);
        color.scale = Scale::Logarithmic;
        let test = FilterTest::Values(vec![7]);
        let attribute = Attribute::column("classification");
        let filters = vec![Filter { attribute, action: FilterAction::Hide, test }];
        DisplaySettings { color, filters, up: Axis::PlusZ, ..DisplaySettings::default() }
    }

    #[test]
    fn what_is_typed_counts_instead_of_what_a_scene_says() {
        assert_eq!(settings("", scene()).unwrap(), scene());
        let typed = settings("--color-map grey", scene()).unwrap();
        assert_eq!((typed.color.scale, typed.color.by), (Scale::Logarithmic, scene().color.by));
        // Another source has the usual map.
        let typed = settings("--color-by intensity --color-range 5%,1e3", scene()).unwrap();
        let mut expected = ColorSource::new(ColorBy::Attribute(Attribute::column("intensity")));
        expected.range = [RangeEnd::Percent(5.0), RangeEnd::Value(1000.0)];
        assert_eq!((typed.color, typed.up), (expected, Axis::PlusZ));
        let shown: Vec<String> = settings("--only height=..3 --hide a=1 --hide b[2]=0..1", scene())
            .unwrap()
            .filters
            .iter()
            .map(ToString::to_string)
            .collect();
        assert_eq!(shown, ["hide a=1", "hide b[2]=0..1", "keep height=..3"]);
        assert!(settings("--hide none", scene()).unwrap().filters.is_empty());
        let tinted = settings("--tint-backs", scene()).unwrap();
        assert!(tinted.splats.tint_backs && !scene().splats.tint_backs);
        assert!(!settings("--tint-backs=false", tinted).unwrap().splats.tint_backs);
        assert_eq!(settings("--color-by file", scene()).unwrap().color.by, ColorBy::File);
    }

    #[test]
    fn a_map_needs_something_to_colour_by() {
        let line =
            |options: &str| settings(options, DisplaySettings::default()).unwrap_err().to_string();
        let expected = "expected --color-by with `height` or the name of a column beside it";
        assert_eq!(line("--color-map turbo"), format!("--color-map: {expected}"));
        assert_eq!(
            line("--color-by normal --color-scale log"),
            format!("--color-scale: {expected}")
        );
    }

    #[test]
    fn points_are_pixels_wide_or_have_a_radius() {
        let typed = settings("--points 3px --round-below 0.5 --largest-radius 2", scene()).unwrap();
        assert_eq!(typed.splats.look, Look::Points { radius: 0.0 });
        assert_eq!((typed.splats.round_below, typed.splats.largest_radius), (0.5, Some(2.0)));
        assert_eq!(PointSpec::parse("0.02"), Ok(PointSpec::Radius(0.02)));
        assert_eq!(settings("--points none", typed).unwrap().splats.look, Look::Surface);
        for wrong in ["", "px", "0px", "9px", "nanpx", "0", "-1", "inf", "3 cm"] {
            assert!(PointSpec::parse(wrong).unwrap_err().contains("such as 3px"), "{wrong}");
        }
    }

    #[test]
    fn sources_are_told_by_their_names() {
        let column = |name: &str| ColorBy::Attribute(Attribute::column(name));
        for (text, expected) in [
            ("file", ColorBy::File),
            ("normal", ColorBy::Normal),
            ("height", ColorBy::Attribute(Attribute::Height)),
            ("#ff8000", ColorBy::Uniform([255, 128, 0])),
            ("intensity", column("intensity")),
            ("column:height", column("height")),
            ("column:a[1]", column("a[1]")),
            ("normal[2]", ColorBy::Attribute(Attribute::column("normal").with_component(2))),
            ("a[x]", column("a[x]")),
        ] {
            assert_eq!(color_by(text), Ok(expected), "{text}");
        }
        for wrong in ["", "#12345", "#gg0000", "#+10203", "uniform", "column:"] {
            assert!(color_by(wrong).unwrap_err().starts_with("expected file, normal"), "{wrong}");
        }
    }

    #[test]
    fn filters_and_ranges_say_what_they_expect() {
        let parse = FilterSpec::parse;
        let range =
            |low, high| FilterSpec(Some((Attribute::Height, FilterTest::Range([low, high]))));
        assert_eq!(parse("height=-1.5..2"), Ok(range(-1.5, 2.0)));
        assert_eq!(parse("height=.."), Ok(range(f64::NEG_INFINITY, f64::INFINITY)));
        let values = FilterTest::Values(vec![7, -1]);
        assert_eq!(parse("a=b=7, -1"), Ok(FilterSpec(Some((Attribute::column("a=b"), values)))));
        for wrong in ["", "a", "=1", "a=", "a=x", "a=1.5", "a=1..b", "a=nan..", "a=1,,2"] {
            assert!(parse(wrong).unwrap_err().starts_with("expected NAME=LOW..HIGH"), "{wrong}");
        }
        assert_eq!(parse("a=2..1"), Err("expected the lower end of a range first".to_owned()));
        for wrong in ["5", "5%", "9,3", "50%,10%", "a,b", "1,2,3", "0,101%"] {
            assert!(color_range(wrong).unwrap_err().starts_with("expected LOW,HIGH"), "{wrong}");
        }
        assert!(color_map("automatic").is_err() && color_map("gray").is_ok());
        assert_eq!(color_scale("ln"), Err("expected linear or log".to_owned()));
    }
}
