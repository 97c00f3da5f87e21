//! Modules in text, as they are written by hand, and what becomes of them.

mod attacks;
mod reading;
mod whole;

use crate::{Host, Instance, Limits, Module, Stop};
use std::time::Duration;

/// What a call left behind.
#[derive(Default)]
struct Noted {
    written: Vec<(u32, Vec<u8>)>,
    asked_to_stop: bool,
    progress: Vec<f64>,
    edits: Vec<Vec<u8>>,
}

impl Host for Noted {
    fn write(&mut self, channel: u32, bytes: &[u8]) {
        self.written.push((channel, bytes.to_vec()));
    }

    fn cancelled(&mut self) -> bool {
        self.asked_to_stop
    }

    fn progress(&mut self, fraction: f64, _message: &[u8]) {
        self.progress.push(fraction);
    }

    fn stage(&mut self, header: &[u8], _values: &[&[u8]]) -> Result<(), String> {
        match header {
            b"bad" => Err("this edit is bad".to_owned()),
            _ => {
                self.edits.push(header.to_vec());
                Ok(())
            }
        }
    }
}

/// A manifest with one renderer.
fn manifest() -> Vec<u8> {
    let text = "id\torg.example.test\nversion\t1.0.0\nrenderer\ttest\tTest\tA test.\n";
    let mut bytes = b"SURFELSHOP-PLUG\n\x03\x00\x0b\x00".to_vec();
    bytes.extend((text.len() as u32).to_le_bytes());
    bytes.extend(text.as_bytes());
    bytes
}

/// Bytes as a string of the text format.
fn text(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("\\{byte:02x}")).collect()
}

/// A module whose functions `$describe`, `$create`, `$destroy`, `$frame`, `$tile` and `$run` are those of its table,
/// at 1 to 6. The table lies at 1024, and nothing else does below 2048 and from 4096 on. Functions that a test leaves out return 0, but
/// `$create`, which makes an instance.
fn module(functions: &str) -> Vec<u8> {
    let mut table = b"SURFELP\0\x28\0\0\0\x03\0\x0b\0".to_vec();
    table.extend((1_u32..=6).flat_map(u32::to_le_bytes));
    let mut source = format!(
        "(module
            (type $sink (func (param i32 i32 i32)))
            (memory (export \"memory\") 1)
            (table (export \"__indirect_function_table\") 8 funcref)
            (global (export \"SURFELSHOP_PLUGIN\") i32 (i32.const 1024))
            (data (i32.const 1024) \"{}\")
            (elem (i32.const 1) $describe $create $destroy $frame $tile $run)
            {functions}",
        text(&table)
    );
    let defaults = [
        ("describe", "(param i32 i32) (result i32)", "i32.const 0"),
        (
            "create",
            "(param i32 i32 i32 i32) (result i32)",
            "(i32.store (local.get 2) (i32.const 7)) i32.const 0",
        ),
        ("destroy", "(param i32 i32) (result i32)", "i32.const 0"),
        ("frame", "(param i32 i32 i32) (result i32)", "i32.const 0"),
        ("tile", "(param i32 i32 i32 i32 i32 i32 i32 i32 i32 i32 i32) (result i32)", "i32.const 0"),
        ("run", "(param i32 i32 i32 i32 i32) (result i32)", "i32.const 0"),
    ];
    for (name, ty, body) in defaults {
        if !functions.contains(&format!("(func ${name} ")) {
            source += &format!("\n(func ${name} {ty} {body})");
        }
    }
    source += &format!("\n(@custom \"surfelshop.manifest\" \"{}\"))", text(&manifest()));
    wat::parse_str(source).unwrap()
}

/// Less than the default, so that the tests are quick.
const LIMITS: Limits = Limits {
    memory: 16 << 20,
    steps: 20_000_000,
    time: Duration::from_secs(60),
    grace: Duration::from_millis(200),
};

fn instance(functions: &str) -> Instance {
    Instance::new(&Module::new(&module(functions)).unwrap(), LIMITS).unwrap()
}

/// How a frame of a module ends.
fn frame(functions: &str) -> (Result<i32, Stop>, Noted) {
    let mut noted = Noted::default();
    let mut instance = instance(functions);
    instance.create(0, b"info", &mut noted).unwrap();
    (instance.frame(b"request", &mut noted), noted)
}

/// The line that a frame of a module ends with.
fn stopped(functions: &str) -> String {
    frame(functions).0.unwrap_err().to_string()
}
