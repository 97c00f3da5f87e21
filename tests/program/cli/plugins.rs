//! `surfelshop plugins trust`, `distrust`, `add`, `remove` and `new`, and what runs without a yes: nothing.

use crate::cli::program::{TestFolder, facing_front};
use std::path::PathBuf;
use surfelshop_tests::stage::build_folder;

const RIVAL: &str = "org.surfelshop.test.rival";

/// A good plugin in a place that is new to the program.
fn rival() -> PathBuf {
    let (prefix, suffix) = (std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    build_folder().join("examples").join(format!("{prefix}rival{suffix}"))
}

/// A desk with a cloud and a copy of that plugin, `mine.so`.
fn desk() -> TestFolder {
    let desk = TestFolder::new();
    desk.put_cloud("one.ply", &[facing_front(0.0, 0.0, 0.5)]);
    std::fs::write(desk.at("mine.so"), std::fs::read(rival()).unwrap()).unwrap();
    desk
}

const RENDER: &str = "render one.ply -o one.png --size 16 -r fine --plugin mine.so";

/// Invariant: no code of a plugin runs before somebody has said yes to it, and a yes to one
/// build is none to the next
#[test]
fn plugins_of_new_places_run_after_a_yes_and_their_next_build_after_another() {
    let desk = desk();
    let words =
        ["mine.so", "a place that is new here", "--trust", "surfelshop plugins trust mine.so"];
    desk.run(RENDER).failed(&words);
    desk.run(&format!("{RENDER} --trust")).done();
    // That was for once.
    desk.run(RENDER).failed(&words);

    let told = desk.run("plugins trust mine.so").done().stdout;
    assert!(told.contains(RIVAL) && told.contains("this build"), "{told}");
    desk.run(RENDER).done();
    // Wherever the same bytes lie.
    std::fs::copy(desk.at("mine.so"), desk.at("copy.so")).unwrap();
    desk.run(&RENDER.replace("mine.so", "copy.so")).done();

    let mut bytes = std::fs::read(rival()).unwrap();
    bytes.extend([0; 16]);
    std::fs::write(desk.at("mine.so"), &bytes).unwrap();
    desk.run(RENDER).failed(&["mine.so", "new here"]);
    desk.run("plugins trust --place mine.so").done();
    desk.run(RENDER).done();
    bytes.extend([0; 16]);
    std::fs::write(desk.at("mine.so"), &bytes).unwrap();
    desk.run(RENDER).done();

    // The build and the place.
    assert!(desk.run("plugins distrust mine.so").done().stdout.contains("2 removed"));
    desk.run(RENDER).failed(&["new here"]);
    desk.run("plugins distrust mine.so").failed(&["mine.so", "trusts no such file"]);
    // However it is named.
    std::fs::create_dir(desk.at("deep")).unwrap();
    desk.run("plugins trust --place deep/../mine.so").done();
    desk.run(RENDER).done();
    desk.run("plugins distrust ./mine.so").done();
    desk.run(RENDER).failed(&["new here"]);
}

#[test]
fn a_list_of_its_own_is_used_instead_of_the_users() {
    let desk = desk();
    desk.run("plugins trust mine.so --trust-file ci.toml").done();
    desk.run(RENDER).failed(&["new here"]);
    desk.run(&format!("{RENDER} --trust-file ci.toml")).done();
    desk.run(&format!("{RENDER} --trust-file none.toml")).failed(&["none.toml", "cannot be read"]);
    desk.put("ci.toml", "format = 1\n[[builds]]\nsha256 = \"12\"\n");
    desk.run(&format!("{RENDER} --trust-file ci.toml")).failed(&["ci.toml", "expected a SHA-256"]);
    // A failure leaves the list as it was.
    desk.run("plugins trust mine.so one.ply --trust-file new.toml").failed(&["one.ply", "is not"]);
    assert!(!desk.files().contains(&"new.toml".to_owned()));
}

#[test]
fn the_list_says_what_is_trusted_and_whose_it_is() {
    let desk = desk();
    let entry = |line: &str| {
        let list = desk.run(line).json();
        let plugins = list["plugins"].as_array().unwrap().clone();
        plugins.into_iter().find(|plugin| plugin["file"] == "mine.so").unwrap()
    };
    let new = entry("plugins --json --plugin mine.so");
    assert_eq!(new["trust"], "new");
    let sha256 = new["sha256"].as_str().unwrap().to_owned();
    assert_eq!(sha256.len(), 64);
    desk.run("plugins trust mine.so").done();
    assert_eq!(entry("plugins --json --plugin mine.so")["trust"], "build");
    let text = desk.run("plugins --plugin mine.so").done().stdout;
    let of_mine = text.split("mine.so").nth(1).unwrap();
    for words in
        [&*sha256, "yes, this build", "for hosts of ABI 3.", "by        ", "licence   MIT OR"]
    {
        assert!(of_mine.contains(words), "`{words}` is missing in: {text}");
    }
    // What came with the program is trusted with it, also by name.
    let ours = text.split("org.surfelshop.flat").nth(1).unwrap();
    assert!(ours.contains("yes, it came with the program"), "{text}");
    let short = &sha256[..8];
    desk.run(&format!("plugins distrust {short}")).done();
    assert_eq!(entry("plugins --json --plugin mine.so")["trust"], "new");
}

#[test]
fn added_plugins_are_found_and_trusted_and_removed_ones_are_gone() {
    let desk = desk();
    let render = "render one.ply -o one.png --size 16 -r fine";
    desk.run(render).failed(&["there is no renderer `fine`"]);
    let told = desk.run("plugins add mine.so").done().stdout;
    assert!(told.contains("renderer fine"), "{told}");
    desk.run(render).done();
    desk.run("plugins add one.ply").failed(&["one.ply", "is not a shared library"]);
    desk.run("plugins remove nobody").failed(&["nobody", "no such plugin"]);
    // Another package under that name, and names that no start would look for.
    let faulty = rival()
        .with_file_name(rival().file_name().unwrap().to_str().unwrap().replace("rival", "faulty"));
    std::fs::create_dir(desk.at("other")).unwrap();
    std::fs::copy(&faulty, desk.at("other/mine.so")).unwrap();
    desk.run("plugins add other/mine.so").failed(&["other/mine.so", RIVAL, "rename the file"]);
    std::fs::copy(rival(), desk.at("other/plain")).unwrap();
    desk.run("plugins add other/plain").failed(&["other/plain", "expected a name that ends in"]);
    desk.run("plugins add mine.so other/mine.so").failed(&["have one name"]);
    desk.run(render).done();
    desk.run(&format!("plugins remove {RIVAL}")).done();
    desk.run(render).failed(&["there is no renderer `fine`"]);
    // And nothing of it is trusted any more.
    desk.run(RENDER).failed(&["new here"]);
}

#[test]
fn a_project_is_whole_or_not_there() {
    let desk = TestFolder::new();
    let told = desk.run("plugins new rim-light --kind graph").done().stdout;
    assert!(told.contains("cargo build --release") && told.contains("--place"), "{told}");
    let files = ["Cargo.toml", "README.md", ".gitignore", "src/lib.rs", "src/ink.wgsl"];
    for file in files {
        assert!(desk.at("rim-light").join(file).is_file(), "{file}");
    }
    desk.run("plugins new rim-light").failed(&["rim-light", "is there already"]);
    for (name, words) in [
        ("Rim", "expected a name of a-z"),
        ("self", "is taken by Rust"),
        ("x --id a/b", "--id a/b"),
        ("x --api nowhere", "--api nowhere: expected a checkout"),
    ] {
        desk.run(&format!("plugins new {name}")).failed(&[words]);
    }
    desk.run("plugins new deep/er/tint --kind tool --api https://example.org/s.git").done();
    let manifest = std::fs::read_to_string(desk.at("deep/er/tint/Cargo.toml")).unwrap();
    let line = "surfelshop-api = { git = \"https://example.org/s.git\" }";
    assert!(manifest.contains(line), "{manifest}");
    // What builds elsewhere: a tag, or a path from the project.
    let tagged = "--api https://example.org/s.git --tag abi-3.10 --minor 9";
    desk.run(&format!("plugins new deep/tagged {tagged}")).done();
    let manifest = std::fs::read_to_string(desk.at("deep/tagged/Cargo.toml")).unwrap();
    let line = "surfelshop-api = { git = \"https://example.org/s.git\", tag = \"abi-3.10\" }";
    assert!(manifest.contains(line), "{manifest}");
    let code = std::fs::read_to_string(desk.at("deep/tagged/src/lib.rs")).unwrap();
    assert!(code.contains("id: \"org.example.tagged\", minor: 9, renderers:"), "{code}");
    let api = desk.at("checkout/host/sdk/api");
    std::fs::create_dir_all(&api).unwrap();
    std::fs::write(api.join("Cargo.toml"), "name = \"surfelshop-api\"\n").unwrap();
    desk.run("plugins new deep/near --api checkout").done();
    let manifest = std::fs::read_to_string(desk.at("deep/near/Cargo.toml")).unwrap();
    assert!(manifest.contains("path = \"../../checkout/host/sdk/api\""), "{manifest}");
    desk.run("plugins new deep/far --api checkout --tag v1").failed(&["--tag", "this is a folder"]);
    desk.run("plugins new deep/old --kind splat --minor 7").failed(&["--minor 7", "ABI 3.9"]);
    assert_eq!(desk.files(), ["checkout", "deep", "rim-light"]);
}

/// A project is the same on every machine but for one file, which says where this one has the crates. Costs a second.
///
/// Invariant: no file of a new plugin's project but one that its repository leaves out names a place on this machine
#[test]
fn a_project_goes_to_another_machine() {
    let desk = TestFolder::new();
    desk.run("plugins new rim --kind tracer").done();
    let read = |file: &str| std::fs::read_to_string(desk.at("rim").join(file)).unwrap();
    let config = ".cargo/config.toml";
    let sdk = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().join("host/sdk");
    let sdk = sdk.canonicalize().unwrap().to_str().unwrap().to_owned();
    for file in ["Cargo.toml", "README.md", ".gitignore", "src/lib.rs"] {
        assert!(!read(file).contains(&sdk), "{file}");
    }
    assert!(read("Cargo.toml").contains("surfelshop-geometry = \"0.1\""), "{}", read("Cargo.toml"));
    assert!(read(".gitignore").contains("/.cargo/config.toml"));
    assert!(read(config).contains(&format!("{sdk}/geometry")), "{}", read(config));
    // The other machine has them elsewhere.
    let checkout = desk.at("checkout/host/sdk/api");
    std::fs::create_dir_all(&checkout).unwrap();
    std::fs::write(checkout.join("Cargo.toml"), "name = \"surfelshop-api\"\n").unwrap();
    std::fs::remove_dir_all(desk.at("rim/.cargo")).unwrap();
    let told = desk.run("plugins sdk rim --api checkout").done().stdout;
    assert!(told.contains("surfelshop-api, surfelshop-geometry in "), "{told}");
    assert!(read(config).contains("checkout/host/sdk/geometry") && !read(config).contains(&sdk));
    // What the author wrote there stays, and nothing is there twice.
    let own = format!("[build]\njobs = 2\n{}", read(config));
    std::fs::write(desk.at("rim").join(config), own).unwrap();
    desk.run("plugins sdk rim").done();
    let now = read(config);
    assert!(now.starts_with("[build]\njobs = 2\n"), "{now}");
    assert!(now.matches("[patch.crates-io]").count() == 1 && now.contains(&sdk), "{now}");
    // A module's configuration is everybody's but for these lines.
    desk.run("plugins new boxed --sandbox").done();
    let boxed = std::fs::read_to_string(desk.at("boxed").join(config)).unwrap();
    assert!(
        boxed.contains("wasm32-unknown-unknown") && boxed.contains("[patch.crates-io]"),
        "{boxed}"
    );
    desk.run("plugins sdk nowhere")
        .failed(&["nowhere/Cargo.toml", "expected the Cargo.toml of a plugin"]);
    std::fs::write(desk.at("checkout/Cargo.toml"), "[dependencies]\n").unwrap();
    desk.run("plugins sdk checkout").failed(&["expected a dependency by version"]);
    std::fs::write(desk.at("rim").join(config), "[patch.crates-io]\nglam = { path = \"g\" }\n")
        .unwrap();
    desk.run("plugins sdk rim").failed(&["has a table [patch] of its own", "surfelshop-api = "]);
    assert!(read(config).starts_with("[patch.crates-io]\nglam"));
}
