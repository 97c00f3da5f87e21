//! Help, and the lines that say what went wrong.

use crate::cli::program::{TestFolder, facing_front};

fn desk() -> TestFolder {
    let desk = TestFolder::new();
    desk.put_cloud("one.ply", &[facing_front(0.0, 0.0, 1.0)]);
    desk
}

#[test]
fn help_names_every_command_and_ends_well() {
    let desk = TestFolder::new();
    let help = desk.run("--help").done().stdout;
    for command in ["render", "info", "plugins", "convert", "demo"] {
        assert!(help.contains(command), "`{command}` is missing in: {help}");
    }
    for command in ["render", "info", "plugins", "convert", "demo"] {
        let help = desk.run(&format!("{command} --help")).done().stdout;
        assert!(help.contains("Example"), "{help}");
    }
    assert!(desk.run("render --help").stdout.contains("runs its code"), "trust is mentioned");
    assert!(desk.run("--version").done().stdout.starts_with("surfelshop "));
}

#[test]
fn unknown_words_are_usage_errors() {
    let desk = desk();
    desk.run("paint").misused(&["`paint` is neither a command nor a file", "Usage: surfelshop"]);
    desk.run("plugins eat").misused(&["eat"]);
    desk.run("render").misused(&["--out", "<FILE>"]);
    desk.run("render one.ply").misused(&["--out"]);
    desk.run("render one.ply -o a.png --frobnicate").misused(&["--frobnicate"]);
}

#[test]
fn a_window_needs_a_file_that_exists_and_a_screen() {
    let desk = desk();
    desk.run("two.ply").failed(&["two.ply", "no such file"]);
    // The tests' programs see no screen.
    if cfg!(target_os = "linux") {
        desk.run("one.ply").failed(&["no window", "DISPLAY", "surfelshop render"]);
    }
}

#[test]
fn values_that_cannot_be_read_say_what_was_expected() {
    let desk = desk();
    for (option, words) in [
        ("-o a.jpg", &["a.jpg", ".png or .exr", "found .jpg"] as &[&str]),
        ("-o a", &[".png or .exr", "no ending"]),
        ("-o a.png --size 0x4", &["640x480"]),
        ("-o a.png --camera above", &["three-quarter", "px,py,pz"]),
        ("-o a.png --camera 1,2,3;1,2,3", &["found both equal"]),
        ("-o a.png --light up", &["x,y,z"]),
        ("-o a.png --light 0,0,0", &["found 0,0,0"]),
        ("-o a.png --background mauve", &["transparent", "#rrggbb"]),
        ("-o a.png --exposure bright", &["stops"]),
        ("-o a.png --fov 180", &["degrees"]),
        ("-o a.png --zoom 0", &["factor"]),
        ("-o a.png --radius-scale 0", &["factor"]),
        ("-o a.png --depth-tolerance 17", &["0 to 16"]),
        ("-o a.png --low-pass -1", &["0 to 4"]),
        ("-o a.png --patience 0", &["seconds"]),
        ("-o a.png --output heat", &["debug.NAME"]),
        ("-o a.png --bits 12", &["8", "16"]),
        ("-o a.png --tone-map film", &["clamp", "neutral"]),
        ("-o a.png --backend glide", &["vulkan", "gl"]),
        ("-o a.png --set gain", &["id=value"]),
    ] {
        desk.run(&format!("render one.ply {option}")).misused(words);
    }
    assert_eq!(desk.files(), ["one.ply"]);
}

#[test]
fn files_that_are_no_clouds_are_named() {
    let desk = desk();
    desk.put("garbage.ply", "\u{1}\u{2} nothing to see here");
    desk.put("cut.ply", "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n");
    desk.put("empty.ply", "");
    for command in ["render", "info", "convert"] {
        let tail = match command {
            "render" => "-o a.png",
            "info" => "",
            _ => "a.ply",
        };
        for (file, words) in [
            ("missing.ply", &["missing.ply", "cannot be read"] as &[&str]),
            ("garbage.ply", &["garbage.ply", "expected a PLY, OBJ, OFF, ", "nothing to see"]),
            ("cut.ply", &["cut.ply", "expected"]),
            ("empty.ply", &["empty.ply", "empty file"]),
            (".", &["a folder"]),
        ] {
            desk.run(&format!("{command} {file} {tail}")).failed(words);
        }
    }
    assert_eq!(desk.files(), ["cut.ply", "empty.ply", "garbage.ply", "one.ply"]);
}

#[test]
fn unknown_renderers_list_those_there_are() {
    let ended = desk().run("render one.ply -o a.png -r flot");
    ended.failed(&["`flot`", "did you mean `flat`", "ewa-phong, flat"]);
}

#[test]
fn parameters_are_checked_against_their_declaration() {
    let desk = desk();
    let set =
        |setting: &str| desk.run(&format!("render one.ply -o a.png --size 8 --set {setting}"));
    set("sparkle=1").failed(&["`ewa-phong` has no parameter `sparkle`", "shininess"]);
    set("shininess=dull").failed(&["`shininess` takes a number from 1 to 1024", "`dull`"]);
    set("shininess=5000").failed(&["from 1 to 1024", "`5000`"]);
    set("flat:shininess=5").failed(&["`flat`", "the renderer is `ewa-phong`"]);
    assert_eq!(desk.files(), ["one.ply"]);
    set("ewa-phong:shininess=5").done();
}

#[test]
fn outputs_a_renderer_does_not_offer_are_refused() {
    let ended = desk().run("render one.ply -o a.png --size 8 --output debug.heat");
    ended.failed(&["ewa-phong", "`debug.heat`", "color"]);
}

#[test]
fn pictures_beyond_the_device_are_refused() {
    let ended = desk().run("render one.ply -o a.png --size 1x4000000");
    ended.failed(&["1 x 4000000", "each side must be"]);
}

#[test]
fn missing_folders_are_named_before_any_work_and_nothing_is_left() {
    let desk = desk();
    let words = ["nowhere", "no such folder", "make it first"];
    desk.run("render one.ply -o nowhere/a.png").failed(&words);
    desk.run("convert one.ply nowhere/a.ply").failed(&words);
    assert_eq!(desk.files(), ["one.ply"]);
}

#[test]
fn unknown_endings_of_clouds_are_refused() {
    let desk = desk();
    for (output, ending) in [("one.obj", "`.obj`"), ("one.nonsense", "`.nonsense`")] {
        let words =
            [output, "expected a name that ends in .ply, ", ".las", &format!("found {ending}")];
        desk.run(&format!("convert one.ply {output}")).failed(&words);
        desk.run(&format!("convert one.ply {output} --estimate")).failed(&words);
    }
    desk.run("convert one.ply one").misused(&["ends in .ply", "no ending"]);
    assert_eq!(desk.files(), ["one.ply"]);
}

/// A tenth of a second.
#[test]
fn a_file_that_cannot_be_read_hides_no_other() {
    let desk = desk();
    desk.put("bad.ply", "no cloud");
    let ended = desk.run("info one.ply bad.ply one.ply");
    assert_eq!(ended.stdout.matches("one.ply\n").count(), 2, "{ended:?}");
    ended.failed(&["bad.ply", "expected"]);
    desk.run("info bad.ply").failed(&["bad.ply", "expected"]);
}

#[test]
fn closed_pipe_does_not_disturb() {
    let desk = desk();
    let mut child = desk
        .command()
        .args(["info", "one.ply", "--json"])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{output:?}");
    assert!(output.stderr.is_empty(), "{output:?}");
}
