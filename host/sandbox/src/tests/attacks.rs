//! Modules that mean harm: each ends its own call with a line, and in time.

use super::{LIMITS, Noted, frame, instance, module, stopped};
use crate::{Instance, Limits, Module, Stop};
use std::time::{Duration, Instant};
use surfelshop_api::CloudView;

/// Steps of 20 M take about a tenth of a second.
#[test]
fn an_endless_loop_ends_after_its_steps() {
    let started = Instant::now();
    let line = stopped("(func $frame (param i32 i32 i32) (result i32) (loop (br 0)) i32.const 0)");
    assert_eq!(line, "it ran for more than 20000000 steps, and was stopped");
    assert!(started.elapsed() < Duration::from_secs(5), "{:?}", started.elapsed());
}

/// Costs the fifth of a second that a job may go on after it was asked to stop.
#[test]
fn a_job_that_does_not_stop_is_stopped() {
    let started = Instant::now();
    let mut noted = Noted { asked_to_stop: true, ..Noted::default() };
    let mut tool =
        instance("(func $run (param i32 i32 i32 i32 i32) (result i32) (loop (br 0)) i32.const 0)");
    tool.create(0, b"", &mut noted).unwrap();
    assert_eq!(tool.run(b"", &CloudView::default(), &mut noted), Err(Stop::Cancelled));
    assert!(started.elapsed() < Duration::from_secs(5), "{:?}", started.elapsed());
}

#[test]
fn a_recursion_without_end_takes_no_stack_of_the_hosts() {
    let line = stopped(
        "(func $frame (param i32 i32 i32) (result i32) (call $frame (local.get 0) (local.get 1) (local.get 2)))",
    );
    assert!(line.contains("went too deep"), "{line}");
    // With many values on each level, and through the function table.
    let locals = "i64 ".repeat(1000);
    let line = stopped(&format!(
        "(type $f (func (param i32 i32 i32) (result i32)))
        (func $frame (param i32 i32 i32) (result i32) (local {locals})
            (call_indirect (type $f) (local.get 0) (local.get 1) (local.get 2) (i32.const 4)))"
    ));
    assert!(line.contains("went too deep"), "{line}");
}

/// Memory grows to the cap and not beyond; the module is told.
#[test]
fn memory_ends_at_its_cap() {
    let (status, _) = frame(
        "(func $frame (param i32 i32 i32) (result i32)
            (loop $more
                (br_if $more (i32.ne (memory.grow (i32.const 16)) (i32.const -1))))
            (i32.store (i32.sub (i32.mul (memory.size) (i32.const 65536)) (i32.const 4)) (i32.const 1))
            (memory.size))",
    );
    let pages = status.unwrap();
    assert!(
        (LIMITS.memory as i32 / 65536 - 16..=LIMITS.memory as i32 / 65536).contains(&pages),
        "{pages}"
    );
    // Whatever a module has at once, or says that it needs to begin with.
    for memory in ["(memory (export \"memory\") 65536)", "(memory (export \"memory\") 300)"] {
        let text = format!("(module {memory})");
        let large = Module::new(&wat::parse_str(text).unwrap()).unwrap();
        assert!(Instance::new(&large, LIMITS).is_err(), "{memory}");
    }
    let table = "(module (table 100000000 funcref))";
    assert!(Instance::new(&Module::new(&wat::parse_str(table).unwrap()).unwrap(), LIMITS).is_err());
}

#[test]
fn a_trap_is_a_line() {
    for (code, expected) in [
        ("unreachable", "it gave up"),
        ("(i32.load (i32.const -4))", "outside its memory"),
        ("(i32.div_u (i32.const 1) (i32.const 0))", "divided a whole number by zero"),
        ("(i32.trunc_f32_s (f32.const 1e20))", "too large"),
        (
            "(call_indirect (type $f) (local.get 0) (local.get 1) (local.get 2) (i32.const 99))",
            "that is none",
        ),
        (
            "(call_indirect (type $f) (local.get 0) (local.get 1) (local.get 2) (i32.const 1))",
            "that is none",
        ),
        (
            "(memory.fill (i32.const 0) (i32.const 1) (i32.const -1)) (i32.const 0)",
            "outside its memory",
        ),
    ] {
        let line = stopped(&format!(
            "(type $f (func (param i32 i32 i32) (result i32)))
            (func $frame (param i32 i32 i32) (result i32) {code})"
        ));
        assert!(line.contains(expected), "{code}: {line}");
    }
    // What a module starts with may go wrong, too.
    let start = module("(func $first unreachable) (start $first)");
    let line = Instance::new(&Module::new(&start).unwrap(), LIMITS).unwrap_err().to_string();
    assert!(line.contains("it gave up"), "{line}");
}

/// A message of this address and length, written to the call's sink.
fn writing(at: i32, len: i32) -> String {
    format!(
        "(func $frame (param i32 i32 i32) (result i32)
            (i32.store (i32.const 2048) (i32.const {at}))
            (i32.store (i32.const 2052) (i32.const {len}))
            (call_indirect (type $sink)
                (i32.const 0) (i32.const 3) (i32.const 2048) (i32.load offset=4 (local.get 2)))
            i32.const 0)"
    )
}

#[test]
fn lies_about_addresses_and_lengths_are_found() {
    for (at, len) in [(0, -1), (-1, 1), (-16, 32), (65536 * 2, 1), (i32::MAX, i32::MAX), (4, -4)] {
        let line = stopped(&writing(at, len));
        assert!(line.contains("outside its memory"), "{at}, {len}: {line}");
    }
    // Nothing is read where there is nothing to read.
    assert_eq!(frame(&writing(-1, 0)).0, Ok(0));
    // The structure itself lies outside, or wraps around.
    let line = stopped(
        "(func $frame (param i32 i32 i32) (result i32)
            (call_indirect (type $sink)
                (i32.const 0) (i32.const 3) (i32.const -4) (i32.load offset=4 (local.get 2)))
            i32.const 0)",
    );
    assert!(line.contains("outside its memory"), "{line}");
    // A table of functions outside its memory, and one whose entries are none.
    let lied = |from: &str, to: &str| {
        let text = "(module
            (memory (export \"memory\") 1) (table (export \"__indirect_function_table\") 1 funcref)
            (global (export \"SURFELSHOP_PLUGIN\") i32 (i32.const 1024))
            (data (i32.const 1024) \"SURFELP\\00\\28\\00\\00\\00\\03\\00\\0b\\00\"))"
            .replace(from, to);
        let module = Module::new(&wat::parse_str(text).unwrap()).unwrap();
        Instance::new(&module, LIMITS).map(|_| ()).unwrap_err().to_string()
    };
    assert!(lied("(i32.const 1024))\n", "(i32.const -8))\n").contains("outside its memory"));
    assert!(lied("SURFELP", "SURFELX").contains("magic bytes"));
    assert!(lied("\\03\\00", "\\04\\00").contains("speaks ABI 4.11, this host 3."));
    assert!(lied("\\0b\\00\"", "\\ff\\00\"").contains("speaks ABI 3.255"));
    assert!(lied("\\28", "\\20").contains("has 32 bytes, expected 40"));
    assert!(lied("1 funcref", "1 1 funcref").contains("--growable-table"));
    assert!(lied("1 funcref", "1 externref").contains("cannot grow"));
}

/// Functions that have other arguments than the interface says, or that are the host's own.
#[test]
fn wrong_functions_are_told_apart() {
    let line = stopped("(func $frame (param i32 i32 i32 i32) (result i32) i32.const 0)");
    assert!(line.contains("other arguments than the interface says"), "{line}");
    // A loop body that is the host's.
    let mut noted = Noted::default();
    let mut tool = instance(
        "(type $parallel (func (param i32 i32 f64 f64 i32 i32) (result i32)))
        (func $run (param i32 i32 i32) (param $job i32) (param $sink i32) (result i32)
            (call_indirect (type $parallel) (i32.const 0) (i32.const 9) (f64.const 0) (f64.const 1)
                (i32.load offset=4 (local.get $sink)) (i32.const 0) (i32.load offset=16 (local.get $job))))",
    );
    tool.create(0, b"", &mut noted).unwrap();
    let line = tool.run(b"", &CloudView::default(), &mut noted).unwrap_err().to_string();
    assert!(line.contains("passed on a function of the host"), "{line}");
    // A sink whose function is none.
    let stage = |write: &str| {
        format!(
            "(type $stage (func (param i32 i32 i32 i32 i32) (result i32)))
            (data (i32.const 3000) \"bad\")
            (func $run (param i32 i32 i32) (param $job i32) (param $sink i32) (result i32)
                (i32.store (i32.const 2048) (i32.const 3000))
                (i32.store (i32.const 2052) (i32.const 3))
                (i32.store (i32.const 2060) {write})
                (call_indirect (type $stage) (i32.const 0) (i32.const 2048) (i32.const 0) (i32.const 0)
                    (i32.const 2056) (i32.load offset=12 (local.get $job))))"
        )
    };
    let run = |write: &str| {
        let mut noted = Noted::default();
        let mut tool = instance(&stage(write));
        tool.create(0, b"", &mut noted).unwrap();
        tool.run(b"", &CloudView::default(), &mut noted).unwrap_err().to_string()
    };
    assert!(run("(i32.const 12345)").contains("has none there"));
    assert!(run("(i32.const 0)").contains("has none there"));
}

/// A sink that calls the host, which calls the sink, and so on.
#[test]
fn calls_within_calls_end() {
    let mut noted = Noted::default();
    let mut tool = instance(
        "(type $stage (func (param i32 i32 i32 i32 i32) (result i32)))
        (data (i32.const 3000) \"bad\")
        (elem (i32.const 7) $again)
        (func $again (param i32 i32 i32) (drop (call $more)))
        (func $more (result i32)
            (call_indirect (type $stage) (i32.const 0) (i32.const 2048) (i32.const 0) (i32.const 0)
                (i32.const 2056) (i32.load (i32.const 2064))))
        (func $run (param i32 i32 i32) (param $job i32) (param $sink i32) (result i32)
            (i32.store (i32.const 2048) (i32.const 3000))
            (i32.store (i32.const 2052) (i32.const 3))
            (i32.store (i32.const 2060) (i32.const 7))
            (i32.store (i32.const 2064) (i32.load offset=12 (local.get $job)))
            (call $more))",
    );
    tool.create(0, b"", &mut noted).unwrap();
    let line = tool.run(b"", &CloudView::default(), &mut noted).unwrap_err().to_string();
    assert!(line.contains("within calls within calls"), "{line}");
}

/// Requests cost steps, so that a loop of them ends as any other does; so do bytes that are named again and again.
#[test]
fn a_loop_of_requests_ends() {
    let started = Instant::now();
    for len in [0, 60_000] {
        let line = stopped(&format!(
            "(func $frame (param i32 i32 i32) (result i32)
                (i32.store (i32.const 2052) (i32.const {len}))
                (loop
                    (call_indirect (type $sink)
                        (i32.const 0) (i32.const 3) (i32.const 2048) (i32.load offset=4 (local.get 2)))
                    (br 0))
                i32.const 0)"
        ));
        assert!(line.contains("more than 20000000 steps"), "{line}");
    }
    assert!(started.elapsed() < Duration::from_secs(10), "{:?}", started.elapsed());
}

/// Steps that take long, 1 MB filled by each: the time ends the call. Costs a fifth of a second.
#[test]
fn long_steps_end_after_their_time() {
    let limits = Limits { steps: u64::MAX, time: Duration::from_millis(200), ..LIMITS };
    let filling = module(
        "(func $frame (param i32 i32 i32) (result i32)
            (drop (memory.grow (i32.const 32)))
            (loop (memory.fill (i32.const 65536) (i32.const 1) (i32.const 1000000)) (br 0))
            i32.const 0)",
    );
    let mut instance = Instance::new(&Module::new(&filling).unwrap(), limits).unwrap();
    let started = Instant::now();
    instance.create(0, b"", &mut Noted::default()).unwrap();
    let line = instance.frame(b"", &mut Noted::default()).unwrap_err().to_string();
    assert_eq!(line, "it ran for more than 0.2 s, and was stopped");
    assert!(started.elapsed() < Duration::from_secs(5), "{:?}", started.elapsed());
}

/// A loop that the host runs costs steps, however little the module does in it. Costs a tenth of a second.
#[test]
fn a_loop_of_the_hosts_ends() {
    // A frame is lent no loops, but can find them beside the function that its sink names.
    let line = stopped(
        "(type $parallel (func (param i32 i32 f64 f64 i32 i32) (result i32)))
        (elem (i32.const 7) $body)
        (func $body (param i32 i32 i32))
        (func $frame (param i32 i32 i32) (result i32)
            (call_indirect (type $parallel) (i32.const 0) (i32.const -1) (f64.const 0) (f64.const 1)
                (i32.const 7) (i32.const 0) (i32.add (i32.load offset=4 (local.get 2)) (i32.const 4))))",
    );
    assert_eq!(line, "it ran for more than 20000000 steps, and was stopped");
}

/// A call clears all variables of its function, for the steps of a short one.
#[test]
fn functions_of_very_many_variables_are_refused() {
    let with = |n: usize| module(&format!("(func $many (local {}))", "i64 ".repeat(n)));
    assert!(Module::new(&with(2000)).is_ok());
    let line = Module::new(&with(2001)).unwrap_err();
    assert!(line.contains("a function has 2001 variables, at most 2000 are taken"), "{line}");
}

/// What a module starts with has fewer steps than a call, since nobody can end it before.
#[test]
fn starting_is_short() {
    let start = module("(func $first (loop (br 0))) (start $first)");
    let limits = Limits { steps: u64::MAX, ..LIMITS };
    let started = Instant::now();
    let line = Instance::new(&Module::new(&start).unwrap(), limits).unwrap_err().to_string();
    assert_eq!(line, "it ran for more than 20000000 steps before anything was called");
    assert!(started.elapsed() < Duration::from_secs(5), "{:?}", started.elapsed());
}

/// What one module does is nothing to the next one, nor to another instance of the same.
#[test]
fn another_instance_goes_on() {
    let source = module(
        "(func $frame (param i32 i32 i32) (result i32)
            (if (i32.load8_u (i32.load (local.get 1))) (then unreachable))
            i32.const 0)",
    );
    let module = Module::new(&source).unwrap();
    let make = || {
        let mut instance = Instance::new(&module, Limits::default()).unwrap();
        instance.create(0, b"", &mut Noted::default()).unwrap();
        instance
    };
    let (mut bad, mut good) = (make(), make());
    assert!(bad.frame(&[1], &mut Noted::default()).is_err());
    assert_eq!(good.frame(&[0], &mut Noted::default()), Ok(0));
}
