//! WebAssembly modules: read, compiled and run, as far as they go.

use crate::assert_one_line;
use std::time::Duration;
use surfelshop_api::CloudView;
use surfelshop_sandbox::{Host, Instance, Lent, Limits, Module, read};

/// So that an input takes little time and memory, whatever it does.
const LIMITS: Limits = Limits {
    memory: 16 << 20,
    steps: 1_000_000,
    time: Duration::from_secs(1),
    grace: Duration::ZERO,
};

/// A host that takes everything and is asked to stop at once.
struct Silent;

impl Host for Silent {
    fn write(&mut self, _channel: u32, _bytes: &[u8]) {}

    fn cancelled(&mut self) -> bool {
        true
    }

    fn begin(&mut self, _header: &[u8]) -> Result<bool, String> {
        Ok(true)
    }

    fn read_at(&mut self, offset: u64, buffer: &mut [u8]) -> Result<usize, String> {
        buffer.fill(offset as u8);
        Ok(buffer.len() / 2)
    }
}

/// Takes the bytes as a module, and makes every kind of call on it.
///
/// # Panics
/// Where it finds what must not be: that is a finding.
pub fn module(bytes: &[u8]) {
    if let Err(unfit) = read(bytes, |_manifest| true) {
        assert_one_line(&unfit.to_string());
    }
    let module = match Module::new(bytes) {
        Ok(module) => module,
        Err(line) => return assert_one_line(&line),
    };
    let mut instance = match Instance::new(&module, LIMITS) {
        Ok(instance) => instance,
        Err(stop) => return assert_one_line(&stop.to_string()),
    };
    let calls = [
        instance.describe(0, &mut Silent),
        instance.create(0, b"\x80", &mut Silent).map(|(status, _)| status),
        instance.frame(b"\x80", &mut Silent),
        instance.run(b"\x80", &CloudView::default(), &mut Silent),
        instance.file(b"\x80", Lent::Read("a"), &mut Silent),
        instance.file(b"\x80", Lent::Written("a"), &mut Silent),
    ];
    for stop in calls.into_iter().filter_map(Result::err) {
        assert_one_line(&stop.to_string());
    }
}
