//! A link to a plugin that is turned while a command runs. Costs 2 s.

#![cfg(unix)]

use crate::cli::program::{TestFolder, facing_front};
use std::fs::{self, OpenOptions};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Compiles a plugin in C, which may include the example of the project.
pub(crate) fn cc(source: &Path, target: &Path) {
    let include = Path::new(env!("CARGO_MANIFEST_DIR")).join("../host/sdk/c");
    let mut command = Command::new("cc");
    command.args(["-shared", "-fPIC", "-O1", "-I"]).arg(include).arg("-o").args([target, source]);
    let compiled = command.output().unwrap_or_else(|error| panic!("cc: {error}"));
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
}

/// A description of a Vulkan driver of this machine.
fn driver() -> PathBuf {
    let folders = ["/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d"];
    let found = folders.iter().filter_map(|folder| fs::read_dir(folder).ok()).flatten().flatten();
    let mut found: Vec<PathBuf> = found.map(|file| file.path()).collect();
    found.sort_by_key(|path| !path.display().to_string().contains("lvp"));
    found.into_iter().next().expect("a Vulkan driver, which `cargo verify` installs")
}

/// Invariant: what is loaded is the file that was judged, wherever a link to it leads by then
#[test]
fn a_link_turned_between_judging_and_loading_runs_nothing_else() {
    let desk = TestFolder::new();
    desk.put_cloud("one.ply", &[facing_front(0.0, 0.0, 0.5)]);
    fs::create_dir(desk.at("trusted")).unwrap();
    desk.put("good.c", "#include \"rim.c\"\n");
    desk.put(
        "evil.c",
        "#include \"rim.c\"\n__attribute__((constructor)) static void run(void) {\n    FILE *f = \
         fopen(\"ran\", \"w\");\n    if (f) fclose(f);\n}\n",
    );
    cc(&desk.at("good.c"), &desk.at("trusted/good.so"));
    cc(&desk.at("evil.c"), &desk.at("evil.so"));
    desk.run("plugins trust --place trusted/good.so").done();
    symlink(desk.at("trusted/good.so"), desk.at("link.so")).unwrap();

    // Plugins are judged before the graphics device is opened and loaded after it. The loader of drivers waits
    // for somebody to write into this pipe.
    let pipe = desk.at("driver.json");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let mut command = desk.command();
    command.args("render one.ply -o one.png --size 16 -r rim-c --plugin link.so".split(' '));
    let drivers = format!("{}:{}", pipe.display(), driver().display());
    command.env("VK_DRIVER_FILES", &drivers).env("VK_ICD_FILENAMES", &drivers);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let child = command.spawn().unwrap();

    let (done, stopped) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(false)));
    let (link, evil) = (desk.at("link.so"), desk.at("evil.so"));
    let turner = std::thread::spawn({
        let (pipe, done, stopped) = (pipe.clone(), Arc::clone(&done), Arc::clone(&stopped));
        move || {
            while !done.load(Ordering::Relaxed) {
                // Opens when the loader does.
                let writer = OpenOptions::new().write(true).open(&pipe).unwrap();
                if !done.load(Ordering::Relaxed) && !stopped.swap(true, Ordering::Relaxed) {
                    symlink(&evil, link.with_extension("new")).unwrap();
                    fs::rename(link.with_extension("new"), &link).unwrap();
                }
                drop(writer);
            }
        }
    });
    let ended = child.wait_with_output().unwrap();
    done.store(true, Ordering::Relaxed);
    // Lets the other thread's last wait end.
    drop(OpenOptions::new().read(true).write(true).open(&pipe).unwrap());
    let reader = OpenOptions::new().read(true).write(true).open(&pipe).unwrap();
    turner.join().unwrap();
    drop(reader);

    let said = String::from_utf8_lossy(&ended.stderr).into_owned();
    assert!(stopped.load(Ordering::Relaxed), "the program opened no driver: {said}");
    assert!(!desk.at("ran").exists(), "code ran that nobody had said yes to: {said}");
    assert!(ended.status.success() && desk.at("one.png").exists(), "{said}");
    // Listed anew, the link leads to a third party.
    desk.run("render one.ply -o one.png --size 16 -r rim-c --plugin link.so")
        .failed(&["link.so", "new here"]);
    assert!(!desk.at("ran").exists());
}
