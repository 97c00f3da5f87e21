//! WebAssembly modules as plugins: found, judged and used like libraries, but nobody is asked.

use crate::plugins::fixture::{FAULTY, PluginFolder, faulty_bytes, formats, request, rival};
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};
use surfelshop_api::abi::EncodedGraph;
use surfelshop_api::{HostInfo, UnitKind};
use surfelshop_cloud::Formats as _;
use surfelshop_runtime::boundary::Fault;
use surfelshop_runtime::formats::PluginFormats;
use surfelshop_runtime::plugins::{
    LoadError, LoadedUnit, Origin, Place, Registry, SearchPath, State, Timeouts, Trust, TrustState,
};

/// A module that is built from C; its README says how.
fn stored(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("stored/sandbox").join(name)
}

fn manifest(text: &str, abi: [u8; 4]) -> Vec<u8> {
    let mut bytes = b"SURFELSHOP-PLUG\n".to_vec();
    bytes.extend(abi);
    bytes.extend((text.len() as u32).to_le_bytes());
    bytes.extend(text.as_bytes());
    bytes
}

fn one_renderer(id: &str) -> String {
    format!("id\torg.example.{id}\nversion\t1.0.0\nrenderer\t{id}\tTitle\tSummary.\n")
}

/// A module with this manifest and this code for a frame, which has the parameters 0 (the instance), 1 (the request)
/// and 2 (the sink).
fn module(manifest: &[u8], frame: &str) -> Vec<u8> {
    let text = |bytes: &[u8]| bytes.iter().map(|b| format!("\\{b:02x}")).collect::<String>();
    let mut table = b"SURFELP\0\x28\0\0\0\x03\0\x0b\0".to_vec();
    table.extend((1_u32..=6).flat_map(u32::to_le_bytes));
    let described = b"\x82\xa6params\x90\xa6limits\x90";
    let source = format!(
        "(module
            (type $write (func (param i32 i32 i32)))
            (memory (export \"memory\") 1)
            (table (export \"__indirect_function_table\") 7 funcref)
            (global (export \"SURFELSHOP_PLUGIN\") i32 (i32.const 1024))
            (data (i32.const 1024) \"{}\")
            (data (i32.const 2048) \"{}\")
            (data (i32.const 2080) \"\\00\\08\\00\\00\\{:02x}\\00\\00\\00\")
            (elem (i32.const 1) $describe $create $destroy $frame $none $none)
            (func $describe (param i32 i32) (result i32)
                (call_indirect (type $write) (i32.load (local.get 1)) (i32.const 2) (i32.const 2080)
                    (i32.load offset=4 (local.get 1)))
                i32.const 0)
            (func $create (param i32 i32 i32 i32) (result i32)
                (i32.store (local.get 2) (i32.const 1)) i32.const 0)
            (func $destroy (param i32 i32) (result i32) i32.const 0)
            (func $frame (param i32 i32 i32) (result i32) {frame})
            (func $none)
            (@custom \"surfelshop.manifest\" \"{}\"))",
        text(&table),
        text(described),
        described.len(),
        text(manifest)
    );
    wat::parse_str(source).unwrap()
}

/// A stored module without its own manifest, whose section is the last, and with this one instead.
fn forged(module: &[u8], text: &str) -> Vec<u8> {
    let section = [&b"\x13surfelshop.manifest"[..], &manifest(text, [3, 0, 11, 0])].concat();
    let at = module.windows(20).position(|bytes| bytes == b"\x13surfelshop.manifest").unwrap();
    let head = [0, section.len() as u8 | 128, (section.len() >> 7) as u8];
    [&module[..at - 3], &head, &section].concat()
}

/// A frame of a new instance.
fn frame(unit: &LoadedUnit) -> Result<EncodedGraph, Fault> {
    unit.create(&HostInfo::default())?.frame(&request())
}

/// What is found in a folder, without anybody's trust.
fn scanned(folder: &PluginFolder) -> Registry {
    let folders = vec![Place::new(folder.path(), Origin::UserFolder)];
    Registry::scan(&SearchPath { folders, ..SearchPath::default() })
}

fn put(folder: &PluginFolder, name: &str, bytes: &[u8]) {
    fs::write(folder.path().join(name), bytes).unwrap();
}

/// The reason why a file of these bytes is refused.
fn refused(bytes: &[u8]) -> String {
    let folder = PluginFolder::new();
    put(&folder, "a.wasm", bytes);
    match &scanned(&folder).entries()[0].state {
        State::Refused(reason) => reason.clone(),
        other => panic!("it is {other:?}"),
    }
}

/// Invariant: nobody is asked for trust in a module, and its units are used like any other's
#[test]
fn a_module_is_listed_loaded_and_drawn_with_unasked() {
    let folder = PluginFolder::new();
    put(&folder, "rim.wasm", &fs::read(stored("rim.wasm")).unwrap());
    let registry = scanned(&folder);
    let entry = &registry.entries()[0];
    assert_eq!((entry.trust, entry.asks_for_trust()), (TrustState::Sandboxed, false));
    let unit = registry.find(UnitKind::Renderer, "rim-c").unwrap();
    let loaded = registry.load(&unit).unwrap();
    assert_eq!(loaded.description.params.len(), 2);
    let graph = frame(&loaded).unwrap();
    assert!(graph.structure.len() > 1000 && graph.data.len() == 16, "{}", graph.data.len());
    // A library under the name of a module is a library, and asked about.
    put(&folder, "library.wasm", &fs::read(rival()).unwrap());
    let registry = scanned(&folder);
    assert_eq!(registry.entries()[0].trust, TrustState::New);
    // And what was a module when it was listed, and is a library when it is loaded, is asked about then.
    put(&folder, "rim.wasm", &fs::read(rival()).unwrap());
    assert!(matches!(registry.load(&unit), Err(LoadError::Untrusted { .. })));
}

/// Invariant: a module that lies in a folder takes the place of no plugin that somebody said yes to
#[test]
fn a_module_takes_nobodys_place_unasked() {
    let folder = PluginFolder::new();
    let rival_id =
        "id\torg.surfelshop.test.rival\nversion\t9.0.0\nrenderer\tfine\tForged\tA forgery.\n";
    put(&folder, "z.wasm", &module(&manifest(rival_id, [3, 0, 11, 0]), "i32.const 0"));
    folder.put("a", &fs::read(rival()).unwrap());
    let folders = vec![Place::new(folder.path(), Origin::UserFolder)];
    let trust = Trust::everything();
    let registry = Registry::scan(&SearchPath { folders, trust, ..SearchPath::default() });
    let forged = registry.entries().iter().find(|entry| entry.path.ends_with("z.wasm")).unwrap();
    assert!(matches!(forged.state, State::Shadowed { .. }), "{:?}", forged.state);
    assert!(!registry.find(UnitKind::Renderer, "fine").unwrap().path.ends_with("z.wasm"));
}

/// Invariant: where the name of a unit or a type of files is another plugin's, a module that only lies in a folder stands
/// back; one that is named on the command line does not
#[test]
fn a_module_takes_no_name_and_no_type_of_files_unasked() {
    let folder = PluginFolder::new();
    folder.put("a", &faulty_bytes());
    folder.put("b", &fs::read(formats()).unwrap());
    let fine = "id\torg.example.z\nversion\t1.0.0\nrenderer\tfine\tFine\tAnother.\n";
    put(&folder, "z.wasm", &module(&manifest(fine, [3, 0, 11, 0]), "i32.const 0"));
    let takes =
        "id\torg.example.y\nversion\t1.0.0\nformat\ty\tY\tTakes.\nending\ttriplets\nending\tmine\n";
    let stored = fs::read(stored("xyzb.wasm")).unwrap();
    put(&folder, "y.wasm", &forged(&stored, takes));
    let registry = |named: &[&str]| {
        let folders = vec![Place::new(folder.path(), Origin::UserFolder)];
        let files = named.iter().map(|name| folder.path().join(name));
        let files = files.map(|file| Place::new(&file, Origin::CommandLine)).collect();
        Registry::scan(&SearchPath { folders, files, trust: Trust::everything() })
    };
    let unasked = registry(&[]);
    let package = |registry: &Registry| {
        registry.find(UnitKind::Renderer, "fine").ok().map(|unit| unit.package)
    };
    assert_eq!(package(&unasked).as_deref(), Some(FAULTY));
    let names = unasked.names(UnitKind::Renderer);
    for name in ["fine", "org.example.z/fine"] {
        assert!(names.iter().any(|known| known == name), "{names:?}");
    }
    assert_eq!(unasked.find(UnitKind::Renderer, "org.example.z/fine").unwrap().id, "fine");
    assert_eq!(package(&registry(&["z.wasm"])).as_deref(), Some("org.example.z"), "it was named");
    let by_name = |registry: Registry, name: &str| {
        PluginFormats::new(Arc::new(registry), Timeouts::default()).by_name(name, false)
    };
    let own = "org.surfelshop.test.formats/triplets".to_owned();
    assert_eq!(by_name(registry(&[]), "a.triplets"), Some(own));
    let its = Some("org.example.y/y".to_owned());
    assert_eq!(by_name(registry(&[]), "a.mine"), its, "nobody else's");
    assert_eq!(by_name(registry(&["y.wasm"]), "a.triplets"), its);
}

/// An endless loop of a frame ends after its steps, a few seconds at most, and nothing is left at work; the next
/// frame of another plugin, and of the same one, is answered. Costs those seconds.
#[test]
fn an_endless_frame_ends_and_the_next_of_another_is_good() {
    let folder = PluginFolder::new();
    let bytes = manifest(&one_renderer("endless"), [3, 0, 11, 0]);
    put(&folder, "endless.wasm", &module(&bytes, "(loop (br 0)) i32.const 0"));
    put(&folder, "rim.wasm", &fs::read(stored("rim.wasm")).unwrap());
    let registry = scanned(&folder);
    let load = |id: &str| registry.load(&registry.find(UnitKind::Renderer, id).unwrap()).unwrap();
    let (endless, rim) = (load("endless"), load("rim-c"));
    let started = Instant::now();
    let fault = frame(&endless).unwrap_err();
    let Fault::Panic(line) = &fault else { panic!("{fault}") };
    // A slow machine is at the time before it is at the steps.
    assert!(
        ["1000000000 steps", "4 s"]
            .map(|limit| format!("it ran for more than {limit}, and was stopped"))
            .contains(line),
        "{line}"
    );
    assert!(started.elapsed() < Duration::from_secs(60), "{:?}", started.elapsed());
    let other = Instant::now();
    frame(&rim).unwrap();
    assert!(other.elapsed() < Duration::from_secs(5), "{:?}", other.elapsed());
}

/// What a frame that goes wrong says, and that the instance is made anew for the next one: each says the same.
#[test]
fn frames_that_go_wrong_are_lines() {
    let text = |frame: &str| {
        let folder = PluginFolder::new();
        put(&folder, "bad.wasm", &module(&manifest(&one_renderer("bad"), [3, 0, 11, 0]), frame));
        let registry = scanned(&folder);
        let unit = registry.find(UnitKind::Renderer, "bad").unwrap();
        let loaded = registry.load(&unit).unwrap();
        let mut hosted = loaded.start(&HostInfo::default(), &Timeouts::default()).unwrap();
        let [first, second] = [0, 1].map(|_| hosted.frame(request()).unwrap_err().to_string());
        assert_eq!(first, second);
        first
    };
    assert!(text("unreachable").contains("`unreachable`"));
    assert!(text("(i32.load (i32.const -1))").contains("outside its memory"));
    assert!(text("(call $frame (local.get 0) (local.get 1) (local.get 2))").contains("too deep"));
    let line = text(
        "(call_indirect (type $write) (i32.const 0) (i32.const 3) (i32.const -9) (i32.load offset=4 (local.get 2))) i32.const 0",
    );
    assert!(line.starts_with("broke the plugin interface: it named"), "{line}");
    // Bytes that are no graph are found where any plugin's are: when they are decoded.
    let line = text("i32.const 7");
    assert_eq!(line, "broke the plugin interface: it returned the unknown status 7");
}

#[test]
fn forged_cut_and_foreign_modules_are_refused_unrun() {
    let good = one_renderer("good");
    // What would trap at once if it ran.
    let made = |text: &str, abi| module(&manifest(text, abi), "unreachable");
    assert!(refused(&made(&good, [4, 0, 0, 0])).contains("the plugin speaks ABI 4.0"));
    assert!(refused(&made(&good, [3, 0, 200, 0])).contains("speaks ABI 3.200"));
    let format = "id\torg.example.x\nversion\t1\nformat\tx\tX\tX.\nending\tx\n";
    assert!(refused(&made(format, [3, 0, 11, 0])).contains("`SURFELSHOP_FORMATS`"));
    let hidden = good.replace("Title", "Ti\u{202e}tle");
    assert!(refused(&made(&hidden, [3, 0, 11, 0])).contains("do not show"));
    let whole = made(&good, [3, 0, 11, 0]);
    let cut = refused(&whole[..whole.len() / 2]);
    assert!(cut.contains("is damaged or cut off"), "{cut}");
    let line = refused(&module(b"SURFELSHOP-PLUG\n\x03\x00\x0b\x00\xff\xff\xff\xff", ""));
    assert!(line.starts_with("is refused: "), "{line}");
    // A section that names a unit which its code does not have.
    let folder = PluginFolder::new();
    let two = format!("{good}renderer\tother\tTitle\tSummary.\n");
    let rim = fs::read(stored("rim.wasm")).unwrap();
    put(&folder, "forged.wasm", &forged(&rim, &two));
    let registry = scanned(&folder);
    let unit = registry.find(UnitKind::Renderer, "other").unwrap();
    let line = registry.load(&unit).unwrap_err().to_string();
    assert!(line.contains("unit 1 was asked for, the plugin has 1"), "{line}");
}

/// A file of 2 GB is refused by its length; nothing of it is read. Costs no disk: the file has no contents.
#[test]
fn a_huge_module_is_refused_unread() {
    let folder = PluginFolder::new();
    let file = File::create(folder.path().join("huge.wasm")).unwrap();
    file.set_len(2 << 30).unwrap();
    let started = Instant::now();
    let registry = scanned(&folder);
    assert!(started.elapsed() < Duration::from_secs(2), "{:?}", started.elapsed());
    let State::Refused(reason) = &registry.entries()[0].state else { panic!() };
    assert!(reason.contains("2147483648 bytes, at most 33554432"), "{reason}");
}
