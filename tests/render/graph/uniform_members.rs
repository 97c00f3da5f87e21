//! Uniforms that are given by name: their order does not count, and what does not fit is refused by name.

use glam::{DVec3, Vec3};
use surfelshop_api::graph::Output;
use surfelshop_api::prelude::*;
use surfelshop_api::{Scene, static_plugin};
use surfelshop_render::RenderError;
use surfelshop_tests::{clouds, stage};

static_plugin! {
    id: "org.surfelshop.test.members",
    renderers: [InOrder, Exchanged, ByPosition, Missing, Extra, Mistyped, Shared, Declared, Forgotten],
}

params! {
    /// Parameters of the renderers here.
    pub struct Settings {
        /// Shininess, so to speak.
        shininess: f32 { default: 0.25 },
        /// Not the same number.
        specular: f32 { default: 0.75 },
        /// A colour.
        tint: [f32; 3] { default: [0.9, 0.5, 0.1] },
        /// A whole number.
        steps: i32 { default: -3, range: -5..=5 },
    }
}

const SHADE: &str = "
    var<uniform> settings: Settings;
    fn shade(s: Surface) -> vec4<f32> {
        let p = settings;
        return vec4(p.tint * p.specular + vec3(p.shininess, 0.0, f32(p.steps)), 1.0);
    }
";

/// A shader with these members; one that has no `shininess` of a float does without it.
fn shader(members: &str) -> String {
    let shade = match members.contains("shininess: f32") {
        true => SHADE.to_owned(),
        false => SHADE.replace("p.shininess", "0.0"),
    };
    format!("#import surfelshop::surface::Surface\nstruct Settings {{ {members} }}\n{shade}")
}

const IN_ORDER: &str = "shininess: f32, specular: f32, tint: vec3<f32>, steps: i32";

/// Renderers that differ in the members of their structure alone.
macro_rules! renderers {
    ($($name:ident $members:expr, $give:expr;)*) => {$(
        struct $name;

        impl Renderer for $name {
            const INFO: UnitInfo = UnitInfo::new("members", "Members", "Shows its parameters.");
            type Params = Settings;

            fn new(_host: &HostInfo) -> Result<Self> {
                Ok(Self)
            }

            fn frame(&mut self, frame: &Frame<Settings>, graph: &mut Graph) -> Result<()> {
                let give: fn(&Settings, &mut Graph) -> surfelshop_api::graph::UniformId = $give;
                let settings = give(&frame.params, graph);
                let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
                let pass = Pass::shading("shade", &shader($members), "shade");
                graph.pass(pass.bind("settings", settings).target(color));
                graph.output(Output::Color, color);
                Ok(())
            }
        }
    )*};
}

renderers! {
    InOrder IN_ORDER, |p, graph| graph.parameters(p);
    Exchanged "specular: f32, steps: i32, shininess: f32, tint: vec3<f32>", |p, graph| graph.parameters(p);
    ByPosition IN_ORDER, |p, graph| {
        let uniform = Uniform::new().f32(p.shininess).f32(p.specular);
        graph.uniform(uniform.vec3(Vec3::from(p.tint)).i32(p.steps))
    };
    Missing "shininess: f32, specular: f32, tint: vec3<f32>, steps: i32, gain: f32",
        |p, graph| graph.parameters(p);
    Extra "specular: f32, tint: vec3<f32>, steps: i32", |p, graph| graph.parameters(p);
    Mistyped "shininess: u32, specular: f32, tint: vec3<f32>, steps: i32", |p, graph| graph.parameters(p);
}

/// A uniform that two passes read by structures of different orders.
struct Shared;

impl Renderer for Shared {
    const INFO: UnitInfo = UnitInfo::new("shared", "Shared", "Reads one uniform twice.");
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn frame(&mut self, frame: &Frame<Settings>, graph: &mut Graph) -> Result<()> {
        let members = Members::of(&frame.params).without("tint").without("steps");
        let both = graph.members(members);
        let mut outputs = [Output::Color, Output::Debug("other".to_owned())].into_iter();
        for members in ["shininess: f32, specular: f32", "specular: f32, shininess: f32"] {
            let wgsl = format!(
                "#import surfelshop::surface::Surface
                 struct Settings {{ {members} }}
                 var<uniform> settings: Settings;
                 fn shade(s: Surface) -> vec4<f32> {{
                     return vec4(settings.shininess, settings.specular, 0.0, 1.0);
                 }}"
            );
            let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
            graph.pass(Pass::shading("shade", &wgsl, "shade").bind("settings", both).target(color));
            graph.output(outputs.next().expect("there are two"), color);
        }
        Ok(())
    }
}

/// Two passes and a module that read the same settings, whose structure no text of theirs has.
struct Declared;

impl Renderer for Declared {
    const INFO: UnitInfo = UnitInfo::new("declared", "Declared", "Imports its parameters.");
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn frame(&mut self, frame: &Frame<Settings>, graph: &mut Graph) -> Result<()> {
        let settings = graph.settings("params", Members::of(&frame.params));
        let other = graph.settings("other", Members::new().f32("gain", 1.0));
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        let shade = "
            #import surfelshop::surface::Surface
            #import params::settings
            #import other::settings as others
            #import tinted
            fn shade(s: Surface) -> vec4<f32> {
                let steps: i32 = settings.steps;
                let more = vec3(settings.shininess, 0.0, f32(steps));
                return vec4(others.gain * tinted::tinted() + more, 1.0);
            }";
        let tinted = "
            #define_import_path tinted
            #import params::settings
            fn tinted() -> vec3<f32> { return settings.tint * settings.specular; }";
        graph.pass(
            Pass::shading("shade", shade, "shade")
                .module("tinted", "tinted.wgsl", tinted)
                .settings(&settings)
                .settings(&other)
                .target(color),
        );
        graph.output(Output::Color, color);
        // Settings that a shader imports, of which nothing that runs is read.
        let unread = "
            #import surfelshop::surface::Surface
            #import params::settings
            fn other() -> f32 { return settings.shininess; }
            fn shade(s: Surface) -> vec4<f32> { return vec4(1.0); }";
        let one = graph.texture("one", Texture::view_sized(Format::Rgba32Float));
        graph.pass(Pass::shading("unread", unread, "shade").settings(&settings).target(one));
        graph.output(Output::Debug("one".to_owned()), one);
        Ok(())
    }
}

/// Settings that a pass imports and does not bring along.
struct Forgotten;

impl Renderer for Forgotten {
    const INFO: UnitInfo = UnitInfo::new("forgotten", "Forgotten", "Imports what is not there.");
    type Params = Settings;

    fn new(_host: &HostInfo) -> Result<Self> {
        Ok(Self)
    }

    fn frame(&mut self, _frame: &Frame<Settings>, graph: &mut Graph) -> Result<()> {
        let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
        let shade = "#import surfelshop::surface::Surface\n#import params::settings\n
            fn shade(s: Surface) -> vec4<f32> { return vec4(settings.specular); }";
        graph.pass(Pass::shading("shade", shade, "shade").target(color));
        graph.output(Output::Color, color);
        Ok(())
    }
}

/// The pictures of a renderer of this package.
fn pictures(unit: u32, outputs: &[Output]) -> Result<Vec<Vec<f32>>, RenderError> {
    let mut engine = stage::engine();
    let mut renderer = stage::static_renderer::<SurfelshopPackage>(&engine, unit);
    let cloud = clouds::sphere(500, 1.0).cloud();
    let view = stage::view(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, 32);
    let scene = Scene::default();
    let frame = stage::render(&mut engine, &mut renderer, &cloud, &scene, view, outputs)?;
    Ok(frame.images.into_iter().map(|(_, image)| image.data).collect())
}

fn refusal(unit: u32) -> String {
    pictures(unit, &[Output::Color]).unwrap_err().to_string()
}

#[test]
fn exchanged_members_draw_the_same_picture() {
    let color = [Output::Color];
    let expected = pictures(2, &color).unwrap();
    let is_red = |value: &f32| (value - 0.925).abs() < 1e-6;
    assert!(expected[0].iter().any(is_red), "the numbers are in the picture");
    assert_eq!(pictures(0, &color).unwrap(), expected);
    assert_eq!(pictures(1, &color).unwrap(), expected);
}

#[test]
fn settings_are_declared_by_the_graph_alone() {
    let expected = pictures(2, &[Output::Color]).unwrap();
    let outputs = [Output::Color, Output::Debug("one".to_owned())];
    assert_eq!(pictures(7, &outputs).unwrap()[0], expected[0]);
    let line = refusal(8);
    assert!(line.contains("line 2: there is no module `params::settings`"), "{line}");
}

#[test]
fn a_member_that_is_not_given_is_refused_by_name() {
    assert_eq!(refusal(3), "pass `shade`: `settings`: member `gain` (f32) is not given");
}

#[test]
fn a_value_without_a_member_is_refused_by_name() {
    let expected = "pass `shade`: `settings`: member `shininess` is given, which the structure lacks; it \
                    has: specular, tint, steps";
    assert_eq!(refusal(4), expected);
}

#[test]
fn a_member_of_another_type_is_refused_by_name() {
    let expected = "pass `shade`: `settings`: member `shininess` is u32 in the shader, f32 given";
    assert_eq!(refusal(5), expected);
}

#[test]
fn one_uniform_is_laid_out_for_each_structure_that_reads_it() {
    let images = pictures(6, &[Output::Color, Output::Debug("other".to_owned())]).unwrap();
    assert_eq!(images[0], images[1]);
    assert!(images[0].chunks_exact(4).any(|pixel| pixel == [0.25, 0.75, 0.0, 1.0]));
}
