//! Modules that do as they should.

use super::{Noted, frame, instance};
use surfelshop_api::columns::Values;
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
