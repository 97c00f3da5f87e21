//! The boundary from C: the header says what the Rust structures are, and the first example is a renderer
//! like any other.

use crate::third_party::project::{build, folder, graph, project, renderer, root, surfelshop};
use std::mem::{offset_of, size_of};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::LazyLock;
use surfelshop_api::Tile;
use surfelshop_api::abi::format_table::{self, FormatTable, RawCloudSink, RawCloudSource, RawFile};
use surfelshop_api::abi::table::{
    Bytes, PluginTable, RawCloud, RawColumn, RawJob, Sink, channel, status,
};
use surfelshop_api::manifest::{ABI_MAJOR, ABI_MINOR};
use surfelshop_api::params::{Value, Values};

/// Calls the compiler that Rust links with, and takes no warning for an answer.
pub(crate) fn cc(source: &Path, target: &Path, options: &[&str]) {
    let mut command = Command::new("cc");
    command.args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-O2"]).args(options);
    command.arg("-I").arg(root().join("host/sdk/c")).arg("-o").arg(target).arg(source).arg("-lm");
    let compiled = command.output().unwrap_or_else(|error| panic!("cc: {error}"));
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
}

/// The example, compiled as its header says.
fn rim() -> PathBuf {
    // Once: a test must not load what another one is writing.
    static RIM: LazyLock<PathBuf> = LazyLock::new(|| {
        let library = folder("librim_c.so");
        cc(&root().join("host/sdk/c/rim.c"), &library, &["-shared", "-fPIC"]);
        library
    });
    RIM.clone()
}

#[test]
fn the_renderer_in_c_describes_the_very_graph_of_its_twin_in_rust() {
    let twin = build(&project("twin", "shading"), &["--release"], "release");
    let units = [rim(), twin.clone()].map(|library| renderer(&library));
    assert_eq!(units[0].description, units[1].description);
    let set = |sharpness: Value, rim: Value| {
        Values::from([("sharpness".to_owned(), sharpness), ("rim".to_owned(), rim)])
    };
    let text = || Value::Text("x".to_owned());
    for values in [
        Values::new(),
        set(Value::Float(1.0 / 3.0), Value::Color([0.1, 0.0, 1e30])),
        set(Value::Int(9), Value::Color([f32::NAN, 0.0, 0.0])),
        set(Value::Float(f64::NAN), text()),
        set(Value::Float(1e300), Value::Float(1.0)),
        set(Value::Float(-5.0), Value::Color([-0.0; 3])),
        set(text(), Value::Bool(true)),
    ] {
        let [c, rust] = units.each_ref().map(|unit| graph(unit, &values).unwrap());
        assert!(c.structure == rust.structure, "the structures differ");
        assert_eq!(c.data, rust.data, "{values:?}");
    }
    // And so the pictures are the same to the last bit.
    let sample = root().join("assets/sample.ply");
    let picture = |renderer: &str, library: &Path| {
        let png = folder(&format!("{renderer}.png"));
        let (sample, out) = (sample.to_str().unwrap(), png.to_str().unwrap());
        let line = ["render", sample, "-r", renderer, "-o", out, "--size", "96", "--trust"];
        let drawn = surfelshop(&[&line[..], &["--plugin", library.to_str().unwrap()]].concat());
        assert!(drawn.status.success(), "{}", String::from_utf8_lossy(&drawn.stderr));
        std::fs::read(png).unwrap()
    };
    assert!(picture("rim-c", &folder("librim_c.so")) == picture("twin", &twin));
}

#[test]
fn the_renderer_in_c_passes_every_case() {
    let library = rim();
    let checked = surfelshop(&["check", library.to_str().unwrap(), "--trust"]);
    let told = String::from_utf8_lossy(&checked.stdout);
    assert!(checked.status.success() && told.contains(", 0 failed, 0 limited"), "{told}");
}

/// The renderer of Gaussians, compiled as its header says.
fn gaussians() -> PathBuf {
    static GAUSSIANS: LazyLock<PathBuf> = LazyLock::new(|| {
        let library = folder("libgaussians_c.so");
        cc(&root().join("host/sdk/c/gaussians.c"), &library, &["-shared", "-fPIC"]);
        library
    });
    GAUSSIANS.clone()
}

#[test]
fn gaussians_in_c_look_as_those_of_the_built_in_renderer() {
    let (cloud, library) = (root().join("tests/stored/3.9/splats.ply"), gaussians());
    let (cloud, library) = (cloud.to_str().unwrap(), library.to_str().unwrap());
    let expected = folder("gaussians-built-in.exr");
    let expected = expected.to_str().unwrap();
    let line = ["render", cloud, "--size", "128", "-r", "gaussians", "--set", "order=0"];
    let drawn = surfelshop(&[&line[..], &["-o", expected]].concat());
    assert!(drawn.status.success(), "{}", String::from_utf8_lossy(&drawn.stderr));
    let line = ["check", library, "--trust", "--scene", cloud, "--expect", expected];
    let checked = surfelshop(&[&line[..], &["--psnr", "100"]].concat());
    let told = String::from_utf8_lossy(&checked.stdout);
    assert!(checked.status.success() && told.contains("1 passed, 0 failed"), "{told}");
    // What it needs is known before it is loaded, and a cloud without it is refused.
    let sample = root().join("assets/sample.ply");
    let png = folder("gaussians-c.png");
    let line =
        ["render", sample.to_str().unwrap(), "-r", "gaussians-c", "--trust", "--plugin", library];
    let refused = surfelshop(&[&line[..], &["-o", png.to_str().unwrap()]].concat());
    let told = String::from_utf8_lossy(&refused.stderr);
    assert!(!refused.status.success() && told.contains("splat_scale"), "{told}");
}

#[test]
fn gaussians_in_c_pass_every_case() {
    let library = gaussians();
    let checked = surfelshop(&["check", library.to_str().unwrap(), "--trust"]);
    let told = String::from_utf8_lossy(&checked.stdout);
    assert!(checked.status.success() && told.contains(", 0 failed, 0 limited"), "{told}");
}

/// Invariant: the C header declares what the Rust structures and their constants are
#[test]
fn the_header_declares_the_structures_of_the_boundary() {
    let mut expected = Vec::new();
    let mut fields = String::new();
    macro_rules! same {
        ($rust:ty, $c:literal: $($field:ident),*) => {
            fields += concat!("SIZE(", $c, ")\n");
            expected.push(size_of::<$rust>());
            $(
                fields += concat!("OFFSET(", $c, ", ", stringify!($field), ")\n");
                expected.push(offset_of!($rust, $field));
            )*
        };
    }
    same!(Bytes, "surfelshop_bytes": ptr, len);
    same!(Sink, "surfelshop_sink": context, write);
    same!(RawColumn, "surfelshop_column": name, element, components, generation, values, len);
    same!(
        RawCloud, "surfelshop_cloud":
        origin, len, columns, n_columns, faces, n_faces, object
    );
    same!(Tile, "surfelshop_tile": x, y, width, height, sample);
    same!(
        RawJob, "surfelshop_job":
        context, progress, cancelled, stage, parallel, compute
    );
    same!(
        PluginTable, "surfelshop_plugin_table":
        magic, size, abi_major, abi_minor, describe, create, destroy, frame, tile, run
    );
    same!(RawFile, "surfelshop_file": context, name, length, read_at, write_at);
    same!(RawCloudSink, "surfelshop_cloud_sink": context, begin, batch, faces, warn);
    same!(RawCloudSource, "surfelshop_cloud_source": context, next_cloud, next_batch);
    same!(
        FormatTable, "surfelshop_format_table":
        magic, size, abi_major, abi_minor, read, write
    );
    macro_rules! equal {
        ($($rust:expr, $c:literal;)*) => {
            $(
                fields += concat!("VALUE(", $c, ")\n");
                expected.push(usize::try_from($rust).unwrap());
            )*
        };
    }
    equal! {
        ABI_MAJOR, "SURFELSHOP_ABI_MAJOR";
        ABI_MINOR, "SURFELSHOP_ABI_MINOR";
        status::OK, "SURFELSHOP_OK";
        status::ERROR, "SURFELSHOP_ERROR";
        status::PANIC, "SURFELSHOP_PANIC";
        format_table::END, "SURFELSHOP_END";
        channel::ERROR, "SURFELSHOP_CHANNEL_ERROR";
        channel::DESCRIPTION, "SURFELSHOP_CHANNEL_DESCRIPTION";
        channel::STRUCTURE, "SURFELSHOP_CHANNEL_STRUCTURE";
        channel::DATA, "SURFELSHOP_CHANNEL_DATA";
        format_table::HEADER_CHANNEL, "SURFELSHOP_CHANNEL_HEADER";
        format_table::LINES_CHANNEL, "SURFELSHOP_CHANNEL_LINES";
        channel::BUFFERS, "SURFELSHOP_CHANNEL_BUFFERS";
    }
    let source = format!(
        "#include \"surfelshop.h\"\n#include <stdio.h>\n#include <stddef.h>\n\
         #define SIZE(type) printf(\"%zu\\n\", sizeof(type));\n\
         #define OFFSET(type, field) printf(\"%zu\\n\", offsetof(type, field));\n\
         #define VALUE(name) printf(\"%zu\\n\", (size_t)(name));\n\
         int main(void) {{\n{fields}return 0;\n}}\n"
    );
    let (file, program) = (folder("layout.c"), folder("layout"));
    std::fs::write(&file, source).unwrap();
    cc(&file, &program, &[]);
    let told = Command::new(program).output().unwrap().stdout;
    let told = String::from_utf8(told).unwrap();
    let told: Vec<usize> = told.lines().map(|line| line.parse().unwrap()).collect();
    let names: Vec<&str> = fields.lines().collect();
    for ((name, in_c), in_rust) in names.iter().zip(&told).zip(&expected) {
        assert_eq!(in_c, in_rust, "{name}");
    }
    assert_eq!(told.len(), expected.len());
}

#[test]
fn the_headers_are_cpp_too() {
    // Asked of the C compiler, since not every machine has one for C++.
    let (file, object) = (folder("both.c"), folder("both.o"));
    std::fs::write(&file, "#include \"surfelshop.h\"\n#include \"surfelshop_msgpack.h\"\n")
        .unwrap();
    cc(&file, &object, &["-Wc++-compat", "-c"]);
}
