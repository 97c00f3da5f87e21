//! Changed files through the program itself, with a limit on memory, and kills at random moments; both by a
//! fixed seed. Costs 18 s; with `SURFELSHOP_LONG` four minutes, for thousands of runs and hundreds of kills.

#![cfg(unix)]

use crate::cli::program::{TestFolder, facing_front};
use std::fs;
use std::hash::{DefaultHasher, Hasher as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};
use surfelshop_fuzz::{Chance, mutated};

/// Far longer than anything here takes.
const LONG: Duration = Duration::from_secs(60);

/// Addresses that a run may take, kB: four times what drawing takes here.
const MOST_KB: u64 = 6_000_000;

fn is_long() -> bool {
    std::env::var_os("SURFELSHOP_LONG").is_some()
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Files of a folder of the checkout, as they are.
fn files_of(folder: &str, ending: &str) -> Vec<Vec<u8>> {
    let listing = root().join(folder).read_dir().unwrap();
    let mut paths: Vec<PathBuf> = listing.map(|found| found.unwrap().path()).collect();
    paths.retain(|path| path.is_file() && path.display().to_string().ends_with(ending));
    paths.sort();
    assert!(!paths.is_empty(), "{folder}");
    paths.iter().map(|path| fs::read(path).unwrap()).collect()
}

/// A report that is done already: what it kept is all that the next one reads.
const REPORT: &str = "report one.ply -r ewa-phong --knob shininess=2,8 --reference-set shininess=8 --size 16 \
                      --repeats 2 -o folder";
/// What a report keeps: whole, and what came since, a line each.
const KEPT: [&str; 2] = ["folder/cells.json", "folder/cells.log"];

/// Lines as a report that was killed leaves them behind its cells.
fn log_of(cells: &[u8]) -> Vec<u8> {
    let kept: serde_json::Value = serde_json::from_slice(cells).unwrap();
    let mut key = DefaultHasher::new();
    key.write(kept["key"].as_str().unwrap().as_bytes());
    let line = |cell| serde_json::json!({ "of": key.finish(), "what": { "cell": cell } });
    let lines = kept["cells"].as_array().unwrap().iter().map(line);
    lines.map(|line| format!("{line}\n")).collect::<String>().into_bytes()
}

/// A kind of input: what it is called, good ones, and commands that read it.
struct Kind {
    name: &'static str,
    seeds: Vec<Vec<u8>>,
    commands: &'static [&'static str],
}

fn kinds(desk: &TestFolder) -> Vec<Kind> {
    desk.run("render one.ply -r ewa-phong --size 8 -o y.png --save-graph good.graph").done();
    desk.run(REPORT).done();
    let cells = fs::read(desk.at(KEPT[0])).unwrap();
    let log = log_of(&cells);
    let scene = "format = 1\nexposure = 0.5\n[camera]\neye = [0, 0, 4]\ntarget = [0, 0, 0]\n[[lights]]\n\
                 towards = [0, 1, 1]\n[[clouds]]\npath = 'one.ply'\ntransform = { scale = 2.0 }\n[[views]]\n\
                 renderer = 'ewa-phong'\nvalues = { shininess = 8.0 }\n";
    let build = "0123456789abcdef".repeat(4);
    let trust = format!(
        "format = 1\n[[builds]]\nsha256 = \"{build}\"\npackage = \"a 1\"\nfile = \"/a.so\"\n[[places]]\n\
         file = \"/b.so\"\n"
    );
    let kind = |name, seeds, commands| Kind { name, seeds, commands };
    let format = |name: &'static str, commands| {
        let (_, ending) = name.split_once('.').unwrap();
        let folder = if ending == "glb" { "gltf" } else { ending };
        kind(name, files_of(&format!("tests/fuzz/corpus/{folder}/seeds"), ""), commands)
    };
    vec![
        format("x.las", &["info x.las", "convert x.las out.ply", "info x.las --full"]),
        format("x.e57", &["info x.e57", "convert x.e57 out.ply", "info x.e57 --full"]),
        format("x.pcd", &["info x.pcd", "convert x.pcd out.ply", "info x.pcd --full"]),
        format("x.xyz", &["info x.xyz", "convert x.xyz out.ply", "info x.xyz --full"]),
        format("x.sfl", &["info x.sfl", "convert x.sfl out.ply", "info x.sfl --full"]),
        format("x.stl", &["info x.stl", "convert x.stl out.ply", "render x.stl --size 8 -o y.png"]),
        format("x.glb", &["info x.glb", "convert x.glb out.ply", "render x.glb --size 8 -o y.png"]),
        kind(
            "x.ply",
            files_of("tests/fuzz/corpus/cloud/seeds", ""),
            &[
                "info x.ply",
                "convert x.ply out.ply",
                "bake x.ply -t radii -o out.ply",
                "render x.ply --size 8 -o y.png",
                "compare x.ply -r flat --size 8 --repeats 1 -o compared",
            ],
        ),
        kind(
            "x.hdr",
            files_of("tests/fuzz/corpus/probe/seeds", ""),
            &["info x.hdr", "render one.ply -r environment --env x.hdr --size 8 -o y.png"],
        ),
        kind(
            "x.scene.toml",
            vec![scene.into()],
            &["info x.scene.toml", "render x.scene.toml --size 8 -o y.png"],
        ),
        kind("trust.toml", vec![trust.into()], &["plugins --trust-file trust.toml"]),
        kind(
            "x.wgsl",
            files_of("plugins/procedural/src/patterns", ".wgsl"),
            &["render one.ply -r procedural --set file=x.wgsl --size 8 -o y.png"],
        ),
        kind(
            "x.graph",
            vec![fs::read(desk.at("good.graph")).unwrap()],
            &["render one.ply --graph x.graph --size 8 -o y.png"],
        ),
        kind(
            "x.so",
            files_of("tests/fuzz/corpus/manifest/seeds", ".so"),
            &["plugins --plugin x.so"],
        ),
        kind(KEPT[0], vec![cells], &[REPORT]),
        kind(KEPT[1], vec![log], &[REPORT]),
    ]
}

fn wait(child: &mut Child, what: &str) -> ExitStatus {
    let started = Instant::now();
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            return status;
        }
        assert!(started.elapsed() < LONG, "it hangs: {what}");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Success, or lines of this program's own on the standard error: at most one that is no warning.
fn judge(desk: &TestFolder, command: &str) -> Result<(), String> {
    let program = desk.command();
    let mut shell = Command::new("sh");
    shell.args(["-c", &format!("ulimit -v {MOST_KB}; exec \"$@\""), "sh"]);
    shell.arg(program.get_program()).args(command.split(' ')).current_dir(desk.at(""));
    shell.envs(program.get_envs().filter_map(|(name, value)| Some((name, value?))));
    let (out, err) = (desk.at("stdout"), desk.at("stderr"));
    shell.stdout(fs::File::create(&out).unwrap()).stderr(fs::File::create(&err).unwrap());
    let status = wait(&mut shell.stdin(Stdio::null()).spawn().unwrap(), command);
    let [out, err] = [out, err].map(|path| fs::read(path).unwrap());
    let [Ok(out), Ok(err)] = [out, err].map(String::from_utf8) else {
        return Err("what it says is no text".to_owned());
    };
    let said = format!("{status}: {} {}", out.escape_debug(), err.escape_debug());
    if format!("{out}{err}").contains(|c: char| c.is_control() && c != '\n') {
        return Err(format!("it steers the terminal: {said}"));
    }
    // Mesa says so of machines without a desktop.
    let lines = err.lines().filter(|line| !line.starts_with("error: XDG_RUNTIME_DIR"));
    let lines: Vec<&str> = lines.collect();
    let is_own = |line: &&str| line.starts_with("surfelshop: ");
    let is_note = |line: &&&str| line.contains(": warning: ") || line.contains("passed over: ");
    let n_failures = lines.len() - lines.iter().filter(is_note).count();
    match status.code() {
        Some(0) if lines.iter().all(is_own) => Ok(()),
        // What a mistyped command line gets has more lines.
        Some(1) if lines.iter().all(is_own) && n_failures == 1 => Ok(()),
        _ => Err(said),
    }
}

#[test]
fn changed_files_end_in_success_or_one_line() {
    let desk = TestFolder::new();
    desk.put_cloud("one.ply", &[facing_front(0.0, 0.0, 0.5)]);
    let kinds = kinds(&desk);
    let mut chance = Chance::new(2028);
    let n_runs = if is_long() { 4_500 } else { 176 };
    let mut n_good = 0;
    for number in 0..n_runs {
        let kind = &kinds[number % kinds.len()];
        let command = kind.commands[chance.below(kind.commands.len())];
        let bytes = mutated(&kind.seeds, &mut chance);
        for good in kinds.iter().filter(|kind| KEPT.contains(&kind.name)) {
            fs::write(desk.at(good.name), &good.seeds[0]).unwrap();
        }
        fs::write(desk.at(kind.name), &bytes).unwrap();
        drop(fs::remove_file(desk.at("out.ply")));
        let mut judged = judge(&desk, command);
        if judged.is_ok() && desk.at("out.ply").exists() {
            n_good += 1;
            let again = desk.run("info out.ply");
            if again.code != 0 {
                judged = Err(format!("what it wrote is not read: {}", again.stderr));
            }
        }
        if let Err(what) = judged {
            let path = std::env::temp_dir()
                .join(format!("surfelshop-{number}-{}", kind.name.replace('/', "-")));
            fs::write(&path, bytes).unwrap();
            panic!("{number}: {command}: {what}; the input is {}", path.display());
        }
    }
    assert!(n_good > 0, "no changed cloud was written again");
}

#[test]
fn kills_at_any_moment_leave_whole_files() {
    let desk = TestFolder::new();
    let surfels: Vec<_> = (0..20_000).map(|i| facing_front(i as f32, 0.0, 0.5)).collect();
    desk.put_cloud("in.ply", &surfels);
    let commands = [
        ("convert in.ply text.ply --ascii", "text.ply", 120),
        ("bake in.ply -t radii -o baked.ply", "baked.ply", 250),
        ("render in.ply --size 64 -o out.png", "out.png", 350),
        ("compare in.ply -r flat -r ewa-phong --size 32 -o folder", "folder/index.html", 600),
        (
            "report in.ply -r ewa-phong --knob shininess=2,4,8 --reference-set shininess=8 --size 32 \
             --repeats 3 -o folder",
            "folder/report.json",
            600,
        ),
    ];
    // Whole outputs, to know them by.
    for (command, output, _) in commands {
        desk.run(command).done();
        assert!(desk.at(output).is_file());
    }
    let mut chance = Chance::new(310);
    let (n_kills, signals) = (if is_long() { 310 } else { 25 }, ["-KILL", "-INT", "-TERM"]);
    let mut n_ended = 0;
    for number in 0..n_kills {
        let (command, output, longest_ms) = commands[number % commands.len()];
        let signal = signals[chance.below(signals.len())];
        let before = fs::read(desk.at(output)).unwrap();
        let mut run = desk.command_of_a_terminal();
        run.args(command.split_whitespace()).stdout(Stdio::null()).stderr(Stdio::null());
        let mut child = run.spawn().unwrap();
        std::thread::sleep(Duration::from_millis(chance.below(longest_ms) as u64));
        let sent = Command::new("kill").args([signal, &child.id().to_string()]).output().unwrap();
        let status = wait(&mut child, command);
        let what = format!("{number}: {signal} {command}, {status}");
        let after = fs::read(desk.at(output)).unwrap();
        match output.rsplit('.').next() {
            // Times in them differ from run to run; they end as whole ones do.
            Some("html") => assert!(after.trim_ascii_end().ends_with(b"</html>"), "{what}"),
            Some("json") => drop(serde_json::from_slice::<serde_json::Value>(&after).unwrap()),
            // Times of tools are in what they write.
            _ => {
                assert!(after == before || desk.run(&format!("info {output}")).code == 0, "{what}")
            }
        }
        n_ended += usize::from(sent.status.success() && !status.success());
        let parts = |desk: &TestFolder| {
            let folder = desk.at("folder").read_dir().unwrap();
            let inner = folder.map(|found| found.unwrap().file_name().display().to_string());
            let all = desk.files().into_iter().chain(inner);
            all.filter(|name| name.ends_with(".part")).collect::<Vec<_>>()
        };
        if signal == "-KILL" {
            // Whoever writes next into the folder removes what is left.
            desk.run("convert in.ply next.ply").done();
            fs::copy(desk.at("in.ply"), desk.at("folder/in.ply")).unwrap();
            desk.run("convert folder/in.ply folder/next.ply").done();
        }
        assert_eq!(parts(&desk), [] as [String; 0], "{what}");
    }
    assert!(n_ended > 0, "every command was done before it was ended");
}
