//! Modules that do as they should.

use super::{Noted, frame, instance};
use crate::{BatchTaker, Host, Instance, Lent, Limits, Module, Stop};
use surfelshop_api::columns::{Element, Values};
use surfelshop_api::format::{CloudHeader, FileColumn};
use surfelshop_api::{CloudView, ColumnView};

/// Writes the request back to channel 3 of the call's sink. Costs a millisecond.
const ECHO: &str = "(func $frame (param i32 i32 i32) (result i32)
    (i32.store (i32.const 2048) (local.get 0))
    (call_indirect (type $sink)
        (i32.load (local.get 2)) (i32.const 3) (local.get 1) (i32.load offset=4 (local.get 2)))
    i32.const 0)";

#[test]
fn a_request_goes_in_and_an_answer_comes_out() {
    let (status, noted) = frame(ECHO);
    assert_eq!(status, Ok(0));
    assert_eq!(noted.written, [(3, b"request".to_vec())]);
}

/// Room that one call is lent is the next one's: the memory does not grow. Costs some milliseconds.
#[test]
fn a_thousand_frames_take_no_more_memory_than_one() {
    let mut noted = Noted::default();
    let mut instance = instance(ECHO);
    assert_eq!(instance.create(0, b"", &mut noted), Ok((0, true)));
    let mut sizes = Vec::new();
    for _ in 0..1000 {
        instance.frame(&[7; 5000], &mut noted).unwrap();
        sizes.push(instance.memory_len());
    }
    assert_eq!(sizes[0], sizes[999]);
}

/// Invariant: functions are compiled whenever they are first called, also where a slice of steps is nearly used up
///
/// A megabyte of functions, each called once: a tenth of a second.
#[test]
fn compiling_functions_ends_no_call() {
    let functions: String =
        (0..50).map(|i| format!("(func $first{i} return {})", "nop ".repeat(20_000))).collect();
    let calls: String = (0..50).map(|i| format!("(call $first{i})")).collect();
    let (status, _) = frame(&format!(
        "{functions} (func $frame (param i32 i32 i32) (result i32) {calls} i32.const 7)"
    ));
    assert_eq!(status, Ok(7));
}

/// The C structures as `wasm32` lays them out: a tool reads number, origin and a column of a cloud, and writes them.
#[test]
fn a_tool_sees_a_cloud_as_c_lays_it_out() {
    let mut noted = Noted::default();
    let mut tool = instance(
        "(func $run (param $unit i32) (param $values i32) (param $cloud i32) (param $job i32) (param $sink i32) (result i32)
            (local $column i32)
            (local.set $column (i32.load offset=28 (local.get $cloud)))
            (i32.store (i32.const 2048) (i32.load offset=24 (local.get $cloud)))
            (f64.store (i32.const 2056) (f64.load offset=16 (local.get $cloud)))
            (f64.store (i32.const 2064) (f64.load offset=104 (local.get $cloud)))
            (f32.store (i32.const 2072) (f32.load offset=8 (i32.load offset=24 (local.get $column))))
            (i64.store (i32.const 2080) (i64.load offset=16 (local.get $column)))
            (i32.store (i32.const 2088) (i32.load offset=8 (i32.load offset=36 (local.get $cloud))))
            (i32.store (i32.const 3000) (i32.const 2048))
            (i32.store (i32.const 3004) (i32.const 44))
            (call_indirect (type $sink)
                (i32.const 0) (i32.const 9) (i32.const 3000) (i32.load offset=4 (local.get $sink)))
            i32.const 0)",
    );
    tool.create(0, b"", &mut noted).unwrap();
    let columns = vec![ColumnView {
        name: "height",
        components: 1,
        generation: 0x1234_5678_9abc,
        values: Values::F32(&[1.0, 2.0, 3.5]),
    }];
    let mut cloud = CloudView { len: 3, columns, faces: &[[0, 1, 2]], ..CloudView::default() };
    cloud.origin.z = -4.0;
    assert_eq!(tool.run(b"values", &cloud, &mut noted), Ok(0));
    let (channel, bytes) = &noted.written[0];
    let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    let double = |at: usize| f64::from_le_bytes(bytes[at..at + 8].try_into().unwrap());
    assert_eq!((*channel, number(0), double(8), double(16)), (9, 3, -4.0, 1.0));
    assert_eq!((f32::from_bits(number(24)), number(40)), (3.5, 2));
    assert_eq!(u64::from_le_bytes(bytes[32..40].try_into().unwrap()), 0x1234_5678_9abc);
}

/// A loop of 10,000 in ranges, progress with it, and an edit that is taken; one that is refused is told to the
/// module's own sink.
#[test]
fn a_tool_loops_and_stages() {
    let mut noted = Noted::default();
    let mut tool = instance(
        "(type $body (func (param i32 i32 i32)))
        (type $parallel (func (param i32 i32 f64 f64 i32 i32) (result i32)))
        (type $stage (func (param i32 i32 i32 i32 i32) (result i32)))
        (elem (i32.const 7) $body)
        (func $body (param $sum i32) (param $start i32) (param $end i32)
            (i32.store (local.get $sum) (i32.add (i32.load (local.get $sum))
                (i32.sub (local.get $end) (local.get $start)))))
        (func $mine (param i32 i32 i32)
            (i32.store (i32.const 2060) (i32.load offset=4 (local.get 2))))
        (elem (i32.const 0) $mine)
        (data (i32.const 3000) \"goodbad\")
        (data (i32.const 3016) \"\\b8\\0b\\00\\00\\04\\00\\00\\00\\bc\\0b\\00\\00\\03\\00\\00\\00\")
        (func $run (param $unit i32) (param $values i32) (param $cloud i32) (param $job i32) (param $sink i32) (result i32)
            (drop (call_indirect (type $parallel) (i32.const 0) (i32.const 10000) (f64.const 0) (f64.const 1)
                (i32.const 7) (i32.const 2048) (i32.load offset=16 (local.get $job))))
            (i32.store (i32.const 2052) (call_indirect (type $stage)
                (i32.const 0) (i32.const 3016) (i32.const 0) (i32.const 0) (local.get $sink)
                (i32.load offset=12 (local.get $job))))
            (i32.store (i32.const 2056) (call_indirect (type $stage)
                (i32.const 0) (i32.const 3024) (i32.const 0) (i32.const 0) (i32.const 3100)
                (i32.load offset=12 (local.get $job))))
            (i32.store (i32.const 3032) (i32.const 2048))
            (i32.store (i32.const 3036) (i32.const 16))
            (call_indirect (type $sink)
                (i32.const 0) (i32.const 9) (i32.const 3032) (i32.load offset=4 (local.get $sink)))
            i32.const 0)",
    );
    tool.create(0, b"", &mut noted).unwrap();
    assert_eq!(tool.run(b"", &CloudView::default(), &mut noted), Ok(0));
    let words: Vec<u32> =
        noted.written[0].1.chunks(4).map(|w| u32::from_le_bytes(w.try_into().unwrap())).collect();
    let said = "this edit is bad".len() as u32;
    assert_eq!(words, [10_000, 0, 1, said], "the sum, both statuses, and the length of the line");
    assert_eq!(noted.edits, [b"good".to_vec()]);
    assert_eq!((noted.progress.len(), noted.progress[2]), (3, 1.0));
}

/// A file in memory, a cloud that is written to it, and what is read back.
#[derive(Default)]
struct Files {
    file: Vec<u8>,
    said: Vec<u8>,
    clouds: usize,
    batches: usize,
    read: Vec<Vec<u8>>,
}

impl Host for Files {
    fn write(&mut self, channel: u32, bytes: &[u8]) {
        if channel == 1 {
            self.said = bytes.to_vec();
        }
    }

    fn length(&mut self) -> u64 {
        self.file.len() as u64
    }

    fn read_at(&mut self, offset: u64, buffer: &mut [u8]) -> Result<usize, String> {
        let there = self.file.get(offset as usize..).unwrap_or_default();
        let len = there.len().min(buffer.len());
        buffer[..len].copy_from_slice(&there[..len]);
        Ok(len)
    }

    fn write_at(&mut self, offset: u64, bytes: &[u8]) -> Result<(), String> {
        let end = offset as usize + bytes.len();
        self.file.resize(self.file.len().max(end), 0);
        self.file[offset as usize..end].copy_from_slice(bytes);
        Ok(())
    }

    fn next_cloud(&mut self) -> Result<Option<Vec<u8>>, String> {
        self.clouds += 1;
        let column = |name: &str, element| FileColumn::new(name, 3, element);
        let columns = vec![column("position", Element::F64), column("color", Element::U8)];
        let header = CloudHeader { rows: Some(4), columns, ..CloudHeader::default() };
        Ok((self.clouds == 1).then(|| rmp_serde::to_vec_named(&header).unwrap()))
    }

    fn next_batch(&mut self, take: &mut BatchTaker<'_>) -> Result<Result<bool, Stop>, String> {
        self.batches += 1;
        if self.batches > 2 {
            return Ok(Ok(false));
        }
        let columns = vec![
            ColumnView {
                name: "position",
                components: 3,
                generation: 0,
                values: Values::F64(&[1.0, 2.0, 3.0, -4.0, 5.0, 6.5]),
            },
            ColumnView {
                name: "color",
                components: 3,
                generation: 0,
                values: Values::U8(&[1, 2, 3, 4, 5, 6]),
            },
        ];
        Ok(take(&CloudView { len: 2, columns, ..CloudView::default() }).map(|()| true))
    }

    fn begin(&mut self, _header: &[u8]) -> Result<bool, String> {
        Ok(true)
    }

    fn batch(&mut self, columns: &[&[u8]]) -> Result<(), String> {
        self.read.extend(columns.iter().map(|column| column.to_vec()));
        Ok(())
    }
}

/// A format in C, whose allocator takes all memory that is there when it is first asked: what the host lends is no
/// part of it. Costs some milliseconds.
#[test]
fn a_format_in_c_writes_and_reads() {
    let bytes = include_bytes!("../../../../tests/stored/sandbox/xyzb.wasm");
    let mut format = Instance::new(&Module::new(bytes).unwrap(), Limits::default()).unwrap();
    let mut files = Files::default();
    let status = format.create(0, b"\x80", &mut files);
    assert_eq!(status, Ok((0, true)), "{}", String::from_utf8_lossy(&files.said));
    let status = format.file(b"\x80", Lent::Written("a.xyzb"), &mut files);
    assert_eq!(status, Ok(0), "{}", String::from_utf8_lossy(&files.said));
    assert!(files.file.starts_with(b"points xyzb 1\n"), "{:?}", files.file);
    let status = format.file(b"\x81\xa6values\x80", Lent::Read("a.xyzb"), &mut files);
    assert_eq!(status, Ok(0), "{}", String::from_utf8_lossy(&files.said));
    let twice = |values: &[u8]| [values, values].concat();
    let places = [1.0_f64, 2.0, 3.0, -4.0, 5.0, 6.5].map(f64::to_le_bytes).concat();
    assert_eq!(files.read, [twice(&places), twice(&[1, 2, 3, 4, 5, 6])]);
}
