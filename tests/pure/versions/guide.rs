//! The guide for authors of plugins: its shaders compile, and its reference leaves nothing out. Its Rust
//! runs as documentation tests of the API crate.

use crate::versions::listing::listing;
use std::fs;
use std::path::{Path, PathBuf};
use surfelshop_api::abi::EncodedGraph;
use surfelshop_api::glam::{DVec3, Vec3};
use surfelshop_api::graph::{
    BufferColumn, Footprint, Format, Graph, Groups, Members, Output, Pass, Texture, TextureId,
};
use surfelshop_api::{CloudFacts, CloudInfo, Scene};
use surfelshop_render::{Engine, RendererView};
use surfelshop_runtime::plugins::Hosted;
use surfelshop_tests::clouds::sphere;
use surfelshop_tests::stage::{engine, render, view};

fn pages() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../host/manual/plugins");
    let mut pages: Vec<PathBuf> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    pages.sort();
    assert!(pages.len() >= 8, "{pages:?}");
    pages
}

#[test]
fn the_reference_lists_every_item_of_the_shader_modules() {
    let page = pages().into_iter().find(|page| page.ends_with("shaders.md")).unwrap();
    let page = fs::read_to_string(page).unwrap();
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let page = words(&page);
    let lines = listing();
    let items: Vec<&str> = lines.iter().filter_map(|line| line.strip_prefix("wgsl ")).collect();
    assert!(items.len() > 50, "{items:?}");
    for line in items {
        let (module, item) = line.split_once(' ').unwrap();
        assert!(page.contains(&words(item)), "{module} has `{item}`, which shaders.md lacks");
    }
}

/// The shaders of a page with the lines that they begin at.
fn shaders(page: &str) -> Vec<(usize, String)> {
    let mut found: Vec<(usize, String)> = Vec::new();
    let mut inside = false;
    for (i, line) in page.lines().enumerate() {
        match line.trim() {
            "```wgsl" => {
                inside = true;
                found.push((i + 2, String::new()));
            }
            "```" => inside = false,
            _ if inside => {
                if let Some((_, text)) = found.last_mut() {
                    text.push_str(line);
                    text.push('\n');
                }
            }
            _ => {}
        }
    }
    found
}

/// The name of the first function behind a text.
fn function_behind<'a>(wgsl: &'a str, text: &str) -> Option<&'a str> {
    let behind = wgsl.split_once(text)?.1.split_once("fn ")?.1;
    Some(behind.split_once('(')?.0)
}

/// The name of the function that makes splats.
fn splat_function(wgsl: &str) -> Option<&str> {
    let before = wgsl.split_once("-> splat::Splat")?.0;
    Some(before.rsplit_once("fn ")?.1.split_once('(')?.0)
}

/// The name of the function that tells pixels of splats, where there is one.
fn function_of_pixels(wgsl: &str) -> Option<&str> {
    let before = wgsl.split_once("-> splat::Fragment")?.0;
    Some(before.rsplit_once("fn ")?.1.split_once('(')?.0)
}

/// A pass of splats, with the columns that the pages read as the module `cloud`.
fn splats(graph: &mut Graph, wgsl: &str, function: &str, n: u64, color: TextureId) -> Pass {
    let clouds = vec![CloudInfo { n_surfels: n, ..CloudInfo::default() }];
    let facts = CloudFacts { clouds, ..CloudFacts::default() };
    let columns = [
        BufferColumn::new("position", 3),
        BufferColumn::new("normal", 3),
        BufferColumn::new("radius", 1),
        BufferColumn::new("color", 3),
        BufferColumn::new("opacity", 1),
        BufferColumn::new("splat_scale", 3),
        BufferColumn::new("splat_rotation", 4),
        BufferColumn::new("sh_0", 3),
        BufferColumn::new("sh_1", 9).f16(),
    ];
    let (n, cloud) = graph.columns("cloud", &facts, &[0], &columns);
    let is_planar = wgsl.contains("splat::planar(");
    let footprint = if is_planar { Footprint::Planar } else { Footprint::Conic };
    Pass::splats("splats", wgsl, function, footprint, n).reads(&cloud).target(color)
}

/// A pass with the settings that the pages have as the module `params`.
fn with_params(graph: &mut Graph, pass: Pass, wgsl: &str) -> Pass {
    if !wgsl.contains("#import params::settings") {
        return pass;
    }
    let members = Members::new().vec3("rim", Vec3::ONE).f32("sharpness", 1.0);
    let members = members.f32("opacity", 1.0).f32("ink", 1.0).u32("width", 1);
    pass.settings(&graph.settings("params", members))
}

/// Compiles a shader as the pass that it is of; what it wants bound is the affair of the pass.
fn compile(engine: &mut Engine, wgsl: &str) -> Result<(), String> {
    let cloud = sphere(10, 1.0).cloud();
    let mut graph = Graph::new();
    let color = graph.texture("color", Texture::view_sized(Format::Rgba32Float));
    if wgsl.contains("fn shade(") {
        let pass = Pass::shading("shade", wgsl, "shade").target(color);
        let pass = with_params(&mut graph, pass, wgsl);
        graph.pass(pass);
        graph.output(Output::Color, color);
    } else if let Some(function) = splat_function(wgsl) {
        let mut pass = splats(&mut graph, wgsl, function, cloud.len() as u64, color);
        if let Some(function) = function_of_pixels(wgsl) {
            pass = pass.per_pixel(function);
        }
        let pass = with_params(&mut graph, pass, wgsl);
        graph.pass(pass);
        graph.output(Output::Color, color);
    } else if let Some(entry) = function_behind(wgsl, "@fragment") {
        graph.pass(Pass::fullscreen("fullscreen", wgsl, entry).target(color));
        graph.output(Output::Color, color);
    } else {
        let entry = function_behind(wgsl, "@compute").ok_or("it has no entry point")?;
        let pass = Pass::compute("compute", wgsl, entry, Groups::Fixed([1; 3]));
        let pass = with_params(&mut graph, pass, wgsl);
        graph.pass(pass);
    }
    let structure = rmp_serde::to_vec_named(graph.structure()).unwrap();
    let graph = EncodedGraph { structure, data: graph.data().to_vec() };
    let mut renderer = RendererView::new(Hosted::replaying(graph).unwrap(), "guide");
    let view = view(DVec3::new(0.0, 1.0, 3.0), DVec3::ZERO, 8);
    let drawn = render(engine, &mut renderer, &cloud, &Scene::default(), view, &[Output::Color]);
    match drawn.map_err(|error| error.to_string()) {
        Ok(_) => Ok(()),
        // A compute pass makes no picture here.
        Err(line) if line.contains("is not bound") || line.contains("no output") => Ok(()),
        Err(line) => Err(line),
    }
}

#[test]
fn shaders_of_the_guide_compile() {
    let mut engine = engine();
    let mut n_shaders = 0;
    for page in pages() {
        for (line, wgsl) in shaders(&fs::read_to_string(&page).unwrap()) {
            let compiled = compile(&mut engine, &wgsl);
            assert_eq!(compiled, Ok(()), "{}:{line}", page.display());
            n_shaders += 1;
        }
    }
    assert!(n_shaders >= 6, "{n_shaders}");
    // And what is wrong would be found.
    let wrong = compile(&mut engine, "fn shade(s: Surface) -> vec4<f32> { return vec4(1.0); }");
    assert!(wrong.is_err(), "{wrong:?}");
    let wrong = "#import surfelshop::splat\n#import cloud\n\
                 fn a(i: u32) -> splat::Splat { return splat::planar(cloud::radius(i)); }";
    let wrong = compile(&mut engine, wrong);
    assert!(wrong.is_err(), "{wrong:?}");
}
