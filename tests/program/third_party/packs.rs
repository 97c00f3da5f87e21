//! Packed plugins, and formats that are read through modules.

use crate::third_party::project::{folder, root, surfelshop};
use glam::DVec3;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use surfelshop_tests::octree::write_octree;
use surfelshop_tests::stage::build_folder;

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[track_caller]
fn done(output: &Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// The line that a command fails with.
#[track_caller]
fn fails(output: &Output) -> String {
    let line = String::from_utf8_lossy(&output.stderr).trim_end().to_owned();
    assert!(!output.status.success() && line.lines().count() == 1, "{line}");
    line
}

/// An empty folder.
fn empty(name: &str) -> PathBuf {
    let folder = folder(name);
    drop(fs::remove_dir_all(&folder));
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Costs four starts of the program and two small pictures.
///
/// Invariant: what `plugins pack` writes is what `plugins add` takes, with its preview; a damaged pack is one line
#[test]
fn a_packed_plugin_is_added_listed_and_removed() {
    let (project, data) = (empty("packed-rim"), empty("packed-data"));
    let run = |line: &[&str]| {
        let program = build_folder().join(format!("surfelshop{}", std::env::consts::EXE_SUFFIX));
        let mut command = Command::new(program);
        command.args(line).env_remove("SURFELSHOP_PLUGINS").env("NODEVICE_SELECT", "1");
        command.env("XDG_DATA_HOME", &data).current_dir(root()).output().unwrap()
    };
    let pack = data.join("rim.surfelplug");
    let packing = ["plugins", "pack", text(&project), "-o", text(&pack)];
    assert!(fails(&run(&packing)).contains("expected a module there or in target/"));
    fs::copy(root().join("tests/stored/sandbox/rim.wasm"), project.join("rim.wasm")).unwrap();
    assert!(fails(&run(&packing)).contains("expected a README.md"));
    fs::write(project.join("README.md"), "# Rim\n").unwrap();
    fs::write(project.join("LICENSE"), "MIT\n").unwrap();
    assert!(done(&run(&packing)).contains("with a preview"));

    done(&run(&["plugins", "add", text(&pack)]));
    let listed = done(&run(&["plugins", "list"]));
    let preview = data.join("surfelshop/plugins/rim.pack/preview.png");
    assert!(listed.contains(text(&preview)), "{listed}");
    let image = surfelshop_image::png::read(&preview, 1 << 20).unwrap();
    assert_eq!([image.width, image.height], [256; 2]);
    assert!(image.data.iter().any(|v| *v > 0.0));
    let png = data.join("rim.png");
    done(&run(&["render", "assets/sample.ply", "-r", "rim-c", "--size", "64", "-o", text(&png)]));
    done(&run(&["plugins", "remove", "org.example.rim-c"]));
    assert!(!preview.exists() && !done(&run(&["plugins", "list"])).contains("rim.wasm"));

    let good = fs::read(&pack).unwrap();
    for (at, words) in [(700, "not what SHA256SUMS says"), (0, "pack holds")] {
        let mut bytes = good.clone();
        bytes[at] ^= 1;
        fs::write(&pack, bytes).unwrap();
        let line = fails(&run(&["plugins", "add", text(&pack)]));
        assert!(line.contains("rim.surfelplug: expected a packed plugin"), "{line}");
        assert!(line.contains(words) || line.contains("damaged archive"), "{line}");
    }
    fs::write(&pack, &good[..good.len() / 2]).unwrap();
    fails(&run(&["plugins", "add", text(&pack)]));
    assert!(!data.join("surfelshop/plugins/rim.wasm").exists());
}

/// The program beside modules of formats alone. Costs four starts of the program.
///
/// Invariant: `--sandbox-formats` reads and writes through the modules beside the program, and says where it finds none
#[test]
fn formats_are_modules_where_that_is_asked_for() {
    let place = build_folder().join("beside-modules");
    drop(fs::remove_dir_all(&place));
    fs::create_dir_all(&place).unwrap();
    let program = place.join("surfelshop");
    fs::hard_link(build_folder().join("surfelshop"), &program).unwrap();
    let out = place.join("sample.xyzb");
    let run = |more: &[&str]| {
        let mut command = Command::new(&program);
        command.args(["convert", text(&root().join("assets/sample.ply")), text(&out)]).args(more);
        command.env_remove("SURFELSHOP_PLUGINS").env("XDG_DATA_HOME", place.join("data"));
        command.output().unwrap()
    };
    // Without them no library reads instead.
    let output = run(&["--sandbox-formats"]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        !output.status.success() && said.contains("found none; `cargo sandbox-formats`"),
        "{said}"
    );
    let modules = place.join("sandbox-formats");
    fs::create_dir_all(&modules).unwrap();
    fs::copy(root().join("tests/stored/sandbox/xyzb.wasm"), modules.join("xyzb.wasm")).unwrap();
    fails(&run(&[]));
    done(&run(&["--sandbox-formats"]));
    assert!(fs::metadata(&out).unwrap().len() > 100_000);
    fs::remove_dir_all(&place).unwrap();
}

/// Every format of this project as a module writes what its library writes, and reads the same. With `SURFELSHOP_LONG`
/// the modules are built, which needs Rust's standard library for WebAssembly: a minute where it is there, and a
/// failure that says so where it is not.
#[test]
fn modules_of_formats_agree_with_libraries() {
    let manual = fs::read_to_string(root().join("host/manual/reference/sandbox.md")).unwrap();
    assert!(manual.contains("cargo sandbox-formats") && manual.contains("--sandbox-formats"));
    if !std::env::var("SURFELSHOP_LONG").is_ok_and(|value| value == "1") {
        return;
    }
    let built = Command::new(env!("CARGO")).arg("sandbox-formats").current_dir(root()).output();
    done(&built.unwrap());
    let sample = root().join("assets/sample.ply");
    let both = |from: &dyn Fn(&str, &[&str]) -> PathBuf, what: &str| {
        let read = |name: &str, more: &[&str]| {
            let back = folder(&format!("{name}-{what}.ply"));
            let file = from(name, more);
            done(&surfelshop(&[&["convert", text(&file), text(&back)], more].concat()));
            fs::read(back).unwrap()
        };
        let [native, module] = [read("by-library", &[]), read("by-module", &["--sandbox-formats"])];
        assert!(native == module, "what was read of .{what} differs");
    };
    for ending in ["las", "laz", "e57", "pcd", "xyz", "pts", "ptx", "sfl"] {
        let written = |name: &str, more: &[&str]| {
            let file = folder(&format!("{name}.{ending}"));
            done(&surfelshop(&[&["convert", text(&sample), text(&file)], more].concat()));
            file
        };
        both(&written, ending);
    }
    // These are read and not written.
    let stl = folder("one.stl");
    let facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
    fs::write(&stl, format!("solid one\n{facet}endsolid one\n")).unwrap();
    both(&|_, _| stl.clone(), "stl");
    let gltf = folder("one.gltf");
    let points = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAA";
    fs::write(
        &gltf,
        format!(
            r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
            "meshes":[{{"primitives":[{{"mode":0,"attributes":{{"POSITION":0}}}}]}}],
            "accessors":[{{"bufferView":0,"componentType":5126,"count":2,"type":"VEC3","min":[0,0,0],"max":[1,0,0]}}],
            "bufferViews":[{{"buffer":0,"byteLength":24}}],
            "buffers":[{{"byteLength":24,"uri":"data:application/octet-stream;base64,{points}"}}]}}"#
        ),
    )
    .unwrap();
    both(&|_, _| gltf.clone(), "gltf");
    // With files beside them.
    let scene = fs::read_to_string(&gltf).unwrap();
    let data = format!("data:application/octet-stream;base64,{points}");
    assert!(scene.contains(&data));
    fs::write(&gltf, scene.replace(&data, "one.bin")).unwrap();
    fs::write(folder("one.bin"), [[0; 12], [0, 0, 128, 63, 0, 0, 0, 0, 0, 0, 0, 0]].concat())
        .unwrap();
    both(&|_, _| gltf.clone(), "gltf");
    let octree = write_octree(&folder("town"), &[DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0)]);
    both(&|_, _| octree.clone(), "json");
}
