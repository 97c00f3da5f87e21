//! Plugins as WebAssembly modules: the same source as a library's gives the same graphs, pictures and files, and
//! nobody is asked for trust.

use crate::third_party::c::cc;
use crate::third_party::project::{
    build, cargo, command, folder, graph, project, renderer, root, surfelshop, unit,
};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use surfelshop_api::UnitKind;
use surfelshop_api::params::{Value, Values};

/// What the C examples are compiled with, as their header says.
const CLANG: [&str; 10] = [
    "--target=wasm32-wasi",
    "-Oz",
    "-nostartfiles",
    "-Wl,--no-entry",
    "-Wl,--export-table",
    "-Wl,--growable-table",
    "-Wl,--export=SURFELSHOP_PLUGIN",
    "-Wl,--export-if-defined=SURFELSHOP_FORMATS",
    "-Wl,--strip-all",
    "-o",
];

/// A module that is built from C; its README says how.
fn stored(name: &str) -> PathBuf {
    root().join("tests/stored/sandbox").join(name)
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[track_caller]
fn done(output: &Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Parameters at their defaults, in the middle, and where they are none.
fn some_values() -> [Values; 3] {
    let set = |sharpness: Value, rim: Value| {
        Values::from([("sharpness".to_owned(), sharpness), ("rim".to_owned(), rim)])
    };
    [
        Values::new(),
        set(Value::Float(1.0 / 3.0), Value::Color([0.1, 0.0, 1e30])),
        set(Value::Float(f64::NAN), Value::Bool(true)),
    ]
}

/// Costs the compilation of a C file and two small pictures.
///
/// Invariant: a renderer draws the same picture, byte for byte, whether it is a library or a module
#[test]
fn a_renderer_draws_the_same_picture_as_module_and_as_library() {
    let library = folder("librim_beside_module.so");
    cc(&root().join("host/sdk/c/rim.c"), &library, &["-shared", "-fPIC"]);
    let units = [&library, &stored("rim.wasm")].map(|file| renderer(file));
    assert_eq!(units[0].description, units[1].description);
    for values in some_values() {
        let [native, sandboxed] = units.each_ref().map(|unit| graph(unit, &values).unwrap());
        assert!(native.structure == sandboxed.structure, "the structures differ");
        assert_eq!(native.data, sandboxed.data, "{values:?}");
    }
    let sample = root().join("assets/sample.ply");
    let picture = |file: &Path, trust: &[&str]| {
        let png = folder("rim-of-module.png");
        let line = ["render", text(&sample), "-r", "rim-c", "--size", "96", "-o", text(&png)];
        done(&surfelshop(&[&line[..], &["--plugin", text(file)], trust].concat()));
        std::fs::read(png).unwrap()
    };
    assert!(picture(&library, &["--trust"]) == picture(&stored("rim.wasm"), &[]));
}

/// Costs the compilation of a C file and four conversions of the sample.
///
/// Invariant: a format writes the same bytes and reads the same cloud, whether it is a library or a module
#[test]
fn a_format_writes_and_reads_the_same_as_module_and_as_library() {
    let library = folder("libxyzb_beside_module.so");
    cc(&root().join("host/sdk/c/xyzb.c"), &library, &["-shared", "-fPIC"]);
    let sample = root().join("assets/sample.ply");
    let files = |file: &Path, name: &str, trust: &[&str]| {
        let [written, back] = ["xyzb", "ply"].map(|e| folder(&format!("by-{name}.{e}")));
        for (from, to) in [(&sample, &written), (&written, &back)] {
            let line = ["convert", text(from), text(to), "--plugin", text(file)];
            let output = surfelshop(&[&line[..], trust].concat());
            done(&output);
        }
        [std::fs::read(written).unwrap(), std::fs::read(back).unwrap()]
    };
    let [native, sandboxed] =
        [files(&library, "library", &["--trust"]), files(&stored("xyzb.wasm"), "module", &[])];
    assert!(native[0].len() > 100_000 && native[0] == sandboxed[0], "the files differ");
    assert!(native[1] == sandboxed[1], "what was read differs");
}

/// Costs some starts of the program, small pictures and conversions of the sample.
///
/// Invariant: a command that uses no module compiles none and starts no engine, whatever modules are at hand; one that
/// uses one compiles that one
#[test]
fn only_modules_that_are_used_are_compiled() {
    let (sample, out) = (root().join("assets/sample.ply"), folder("uses-modules"));
    let [png, las, xyzb] = ["png", "las", "xyzb"].map(|ending| out.with_extension(ending));
    let [rim, format] = ["rim.wasm", "xyzb.wasm"].map(stored);
    let compiled = |words: &[&str]| {
        let modules = ["--plugin", text(&rim), "--plugin", text(&format)];
        let output = command(&[words, &modules].concat())
            .env("SURFELSHOP_LOG", "off,surfelshop_runtime::modules=info")
            .output()
            .unwrap();
        let told = done(&output);
        let said = String::from_utf8_lossy(&output.stderr).matches("a module was compiled").count();
        (said, told)
    };
    let picture =
        |renderer| ["render", text(&sample), "-r", renderer, "--size", "16", "-o", text(&png)];
    for (words, n) in [
        (&["plugins"][..], 0),
        (&picture("flat"), 0),
        (&["convert", text(&sample), text(&las)], 0),
        (&["bake", text(&sample), "-t", "thin", "-o", text(&out.with_extension("ply"))], 0),
        (&picture("rim-c"), 1),
        (&["convert", text(&sample), text(&xyzb)], 1),
    ] {
        assert_eq!(compiled(words).0, n, "{words:?}");
    }
    // And by the program's own count.
    for (file, n) in [(&sample, 0), (&las, 0), (&xyzb, 1)] {
        let (said, told) = compiled(&["info", text(file), "--json"]);
        let told: serde_json::Value = serde_json::from_str(&told).unwrap();
        assert_eq!((said, told["modules_compiled"].as_u64()), (n, Some(n as u64)), "{file:?}");
    }
}

/// The list names the sandbox, nothing asks for trust, and `add` and `remove` know modules. Costs some starts of the
/// program.
#[test]
fn modules_are_listed_added_and_removed_unasked() {
    let data = folder("module-data");
    drop(std::fs::remove_dir_all(&data));
    let run = |line: &[&str]| {
        let program = surfelshop_tests::stage::build_folder()
            .join(format!("surfelshop{}", std::env::consts::EXE_SUFFIX));
        Command::new(program)
            .args(line)
            .env_remove("SURFELSHOP_PLUGINS")
            .env("XDG_DATA_HOME", &data)
            .output()
            .unwrap()
    };
    let module = stored("rim.wasm");
    let listed = done(&run(&["plugins", "list", "--plugin", text(&module)]));
    assert!(listed.contains("not needed, it runs in a sandbox"), "{listed}");
    done(&run(&["plugins", "add", text(&module)]));
    let listed = done(&run(&["plugins", "list", "--json"]));
    assert!(listed.contains("\"sandboxed\"") && listed.contains("rim.wasm"), "{listed}");
    let trusted = std::fs::read_to_string(data.join("surfelshop/trust.toml")).unwrap_or_default();
    assert!(!trusted.contains("rim.wasm"), "nobody was asked: {trusted}");
    done(&run(&["plugins", "remove", "org.example.rim-c"]));
    assert!(!done(&run(&["plugins", "list"])).contains("rim.wasm"));
}

fn is_long() -> bool {
    std::env::var("SURFELSHOP_LONG").is_ok_and(|value| value == "1")
}

/// The stored modules are built by the command that their README and the C header say. With `SURFELSHOP_LONG` that is
/// run, which needs a C compiler for WebAssembly: a second where there is one, and a failure that says so where there
/// is none.
#[test]
fn stored_modules_are_built_from_the_examples() {
    for file in ["host/sdk/c/surfelshop.h", "tests/stored/sandbox/README.md"] {
        let said = std::fs::read_to_string(root().join(file)).unwrap();
        for word in CLANG.iter().filter(|word| **word != "-Oz") {
            assert!(said.contains(word), "{file} does not say {word}");
        }
    }
    if !is_long() {
        return;
    }
    for name in ["rim", "xyzb"] {
        let module = folder(&format!("{name}.wasm"));
        let source = root().join("host/sdk/c").join(format!("{name}.c"));
        let mut command = Command::new("clang");
        command.args(["-Wall", "-Wextra", "-Werror"]).args(CLANG).arg(&module).arg(source);
        let missing = "install the packages clang, lld, wasi-libc and libclang-rt-dev-wasm32";
        let built = command.output().unwrap_or_else(|error| panic!("clang: {error}; {missing}"));
        let told = String::from_utf8_lossy(&built.stderr);
        assert!(built.status.success(), "{missing}: {told}");
        let renderer = name == "rim";
        if renderer {
            let units = [&module, &stored("rim.wasm")].map(|file| self::renderer(file));
            for values in some_values() {
                let [new, old] = units.each_ref().map(|unit| graph(unit, &values).unwrap());
                assert!(new.structure == old.structure && new.data == old.data);
            }
        } else {
            let units = [&module, &stored("xyzb.wasm")].map(|file| unit(file, UnitKind::Format));
            assert_eq!(units[0].manifest, units[1].manifest);
        }
    }
}

/// A project of a kind that Cargo builds as a module.
fn boxed(kind: &str) -> PathBuf {
    let project = folder(&format!("boxed-{kind}"));
    drop(std::fs::remove_dir_all(&project));
    let said = done(&surfelshop(&["plugins", "new", text(&project), "--kind", kind, "--sandbox"]));
    let readme = std::fs::read_to_string(project.join("README.md")).unwrap();
    for said in [said, readme] {
        assert!(said.contains("rustup target add wasm32-unknown-unknown"), "{said}");
        assert!(said.contains(".wasm") && !said.contains("plugins trust"), "{said}");
    }
    project
}

/// A project of a kind, built.
fn module_of(kind: &str) -> PathBuf {
    let project = boxed(kind);
    std::fs::copy(root().join("Cargo.lock"), project.join("Cargo.lock")).unwrap();
    let built = cargo(&project, &["build", "--release"], &[]);
    let told = String::from_utf8_lossy(&built.stderr);
    let missing = "run `rustup target add wasm32-unknown-unknown`";
    assert!(built.status.success() && !told.contains("warning"), "{missing}: {told}");
    let name = format!("boxed_{kind}");
    folder("target/wasm32-unknown-unknown/release").join(format!("{name}.wasm"))
}

/// The same source gives the same graphs as module and as library, and passes every case of `check`. Projects are written here; with
/// `SURFELSHOP_LONG` they are built, too, which needs Rust's standard library for
/// WebAssembly: some minutes where it is there, and a failure that says so where it is not.
#[test]
fn projects_pass_every_case_as_modules() {
    for kind in ["shading", "graph", "splat", "tool", "tracer", "format"] {
        let written = boxed(kind);
        assert!(
            written.join(".cargo/config.toml").is_file() && written.join("src/lib.rs").is_file()
        );
        if !is_long() {
            continue;
        }
        let module = module_of(kind);
        let checked = surfelshop(&["check", text(&module)]);
        let told = String::from_utf8_lossy(&checked.stdout);
        let line = told.lines().last().unwrap_or_default();
        assert!(
            checked.status.success() && line.contains(", 0 failed, 0 limited, "),
            "{kind}: {told}"
        );
        if matches!(kind, "shading" | "graph") {
            let library =
                build(&project(&format!("boxed-{kind}"), kind), &["--release"], "release");
            let units = [&library, &module].map(|file| renderer(file));
            assert_eq!(units[0].description, units[1].description);
            for values in some_values() {
                let [native, sandboxed] =
                    units.each_ref().map(|unit| graph(unit, &values).unwrap());
                assert!(native.structure == sandboxed.structure, "the structures of {kind} differ");
                assert_eq!(native.data, sandboxed.data, "{kind} {values:?}");
            }
        }
        if kind == "tracer" {
            let library =
                build(&project(&format!("boxed-{kind}"), kind), &["--release"], "release");
            let [native, sandboxed] = [&library, &module].map(|file| {
                let (sample, png) = (root().join("assets/sample.ply"), folder("traced.png"));
                let line = ["render", text(&sample), "-r", "boxed-tracer", "--size", "48", "-o"];
                done(&surfelshop(
                    &[&line[..], &[text(&png), "--trust", "--plugin", text(file)]].concat(),
                ));
                std::fs::read(png).unwrap()
            });
            assert!(native == sandboxed, "the pictures of the tracer differ");
        }
    }
}
