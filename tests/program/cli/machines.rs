//! Machines without Vulkan, and without any graphics.

use crate::cli::program::{TestFolder, facing_front};

/// A machine without a Vulkan driver.
fn without_vulkan() -> TestFolder {
    let desk = TestFolder::new().with("VK_DRIVER_FILES", "/nonexistent");
    desk.put_cloud("one.ply", &[facing_front(0.0, 0.0, 1.0)]);
    desk
}

/// A machine without any graphics driver.
fn without_graphics() -> TestFolder {
    without_vulkan().with("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent")
}

/// Invariant: commands that draw nothing need no graphics driver
#[test]
fn commands_that_draw_nothing_need_no_adapter() {
    let desk = without_graphics();
    desk.run("--help").done();
    desk.run("plugins").done();
    desk.run("info one.ply").done();
    desk.run("convert one.ply two.ply").done();
    desk.put("a.scene.toml", "format = 1\n[[clouds]]\npath = 'one.ply'\n");
    desk.run("info a.scene.toml").done();
}

#[test]
fn tracers_draw_without_any_adapter() {
    let desk = without_graphics();
    let line = "render one.ply -r reference --set samples=4 --camera front --size 32 -o a.png";
    let told = desk.run(&format!("{line} --json")).json();
    assert_eq!((&told["frame"]["samples"], &told["pixels_not_finite"]), (&4.into(), &0.into()));
    let picture = crate::cli::program::read_png(&desk.at("a.png"));
    assert_eq!(picture.get_pixel(16, 16)[3], 255);
    assert_eq!(picture.get_pixel(0, 0)[3], 0);
    desk.run(&format!("{line} --output depth"))
        .failed(&["no output `depth`", "color, debug.variance"]);
}

#[cfg(target_os = "linux")]
#[test]
fn without_any_adapter_render_says_what_to_install() {
    let desk = without_graphics();
    let ended = desk.run("render one.ply -o a.png");
    let hint = "`-r reference` draws without one";
    ended.failed(&["no graphics adapter", "install", "mesa-vulkan-drivers", hint]);
    assert_eq!(desk.files(), ["one.ply"]);
}

#[cfg(target_os = "linux")]
#[test]
fn without_vulkan_render_uses_opengl() {
    let desk = without_vulkan();
    let report = desk.run("render one.ply -o a.png --size 32 --camera front --json").json();
    assert_eq!(report["adapter"]["backend"], "gl");
    assert!(report["adapter"]["description"].as_str().unwrap().contains("OpenGL"), "{report}");
    assert_eq!(report["pixels_not_finite"], 0);
    let picture = crate::cli::program::read_png(&desk.at("a.png"));
    assert_eq!(picture.get_pixel(16, 16)[3], 255);
    assert_eq!(picture.get_pixel(0, 0)[3], 0);
}

/// As on cards whose drivers offer OpenGL 3.3. Costs 0.3 s.
#[cfg(target_os = "linux")]
#[test]
fn an_opengl_that_is_too_old_is_refused_in_a_line() {
    let desk = without_vulkan()
        .with("MESA_GL_VERSION_OVERRIDE", "3.3")
        .with("MESA_GLSL_VERSION_OVERRIDE", "330");
    let ended = desk.run("render one.ply -o a.png --backend gl");
    ended.failed(&["lacks storage buffers", "driver offers 3.3", "--backend"]);
    assert_eq!(desk.files(), ["one.ply"]);
}

#[test]
fn adapters_that_do_not_exist_are_named_with_those_that_do() {
    let desk = TestFolder::new();
    desk.put_cloud("one.ply", &[facing_front(0.0, 0.0, 1.0)]);
    let ended = desk.run("render one.ply -o a.png --adapter imaginary");
    ended.failed(&["`imaginary`", "there are: "]);
}
