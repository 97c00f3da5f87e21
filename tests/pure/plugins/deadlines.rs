//! Plugins that never answer: the host stops waiting, and nothing else happens.

use crate::plugins::fixture::{assert_makes_graph, assert_says, faulty_registry, load, request};
use std::time::{Duration, Instant};
use surfelshop_api::{HostInfo, UnitKind};
use surfelshop_runtime::boundary::Fault;
use surfelshop_runtime::plugins::{LoadError, Timeouts};

const SHORT: Duration = Duration::from_millis(300);
/// Far beyond any pause of a busy machine, far below for ever.
const LONG: Duration = Duration::from_secs(60);

/// Expects this to end, and hands its result on.
#[track_caller]
fn ends<T>(work: impl FnOnce() -> T) -> T {
    let started = Instant::now();
    let result = work();
    assert!(started.elapsed() < LONG, "it took {:?}", started.elapsed());
    result
}

#[test]
fn hang_in_describe() {
    let registry = faulty_registry();
    let unit = registry.find(UnitKind::Renderer, "hangs-in-describe").unwrap();
    let error = ends(|| unit.load(&Timeouts::of(SHORT)).unwrap_err());
    assert!(matches!(error, LoadError::Fault { fault: Fault::TimedOut(SHORT), .. }));
    let file = unit.path.display().to_string();
    assert_says(&error.to_string(), &["hangs-in-describe", &file, "did not answer within 0.3 s"]);
    assert_makes_graph(&load(UnitKind::Renderer, "fine"));
}

#[test]
fn hang_in_new() {
    let unit = load(UnitKind::Renderer, "hangs-in-new");
    let fault = ends(|| unit.start(&HostInfo::default(), &Timeouts::of(SHORT)).unwrap_err());
    assert_eq!(fault, Fault::TimedOut(SHORT));
    assert_makes_graph(&load(UnitKind::Renderer, "fine"));
}

#[test]
fn hang_in_frame_is_waited_for_once() {
    let unit = load(UnitKind::Renderer, "hangs-in-frame");
    let patience = Timeouts { frame: SHORT, ..Timeouts::default() };
    let mut hosted = unit.start(&HostInfo::default(), &patience).unwrap();
    assert_eq!(ends(|| hosted.frame(request())), Err(Fault::TimedOut(SHORT)));
    assert_eq!(hosted.given_up(), Some(&Fault::TimedOut(SHORT)));
    let started = Instant::now();
    for _ in 0..1000 {
        let line = hosted.frame(request()).unwrap_err().to_string();
        assert_says(&line, &["is not asked any more", "it did not answer within 0.3 s"]);
    }
    assert!(started.elapsed() < LONG, "a thousand deadlines are five minutes");
    ends(|| drop(hosted));
    assert_makes_graph(&load(UnitKind::Renderer, "fine"));
}

#[test]
fn hang_in_drop_is_not_waited_for() {
    let unit = load(UnitKind::Renderer, "hangs-in-drop");
    let mut hosted = unit.start(&HostInfo::default(), &Timeouts::default()).unwrap();
    assert!(hosted.frame(request()).is_ok());
    ends(|| drop(hosted));
    assert_makes_graph(&load(UnitKind::Renderer, "fine"));
}

#[test]
fn faults_reach_the_host_from_the_plugins_thread() {
    let host = HostInfo::default();
    let fault = load(UnitKind::Renderer, "panics-in-new").start(&host, &Timeouts::default());
    assert!(matches!(fault, Err(Fault::Panic(line)) if line.contains("new goes wrong")));
    let unit = load(UnitKind::Renderer, "panics-in-frame");
    let mut hosted = unit.start(&host, &Timeouts::default()).unwrap();
    for _ in 0..3 {
        let fault = hosted.frame(request());
        assert!(matches!(fault, Err(Fault::Panic(line)) if line.contains("frame goes wrong")));
    }
    assert_eq!(hosted.given_up(), None, "it answered");
}

#[test]
#[expect(clippy::print_stdout, reason = "times are shown, not judged")]
fn a_thread_of_its_own_changes_no_graph() {
    let unit = load(UnitKind::Renderer, "fine");
    let mut here = unit.create(&HostInfo::default()).unwrap();
    let mut there = unit.start(&HostInfo::default(), &Timeouts::default()).unwrap();
    assert_eq!(here.frame(&request()), there.frame(request()));

    let frames = 2000;
    let mean_us = |mut frame: Box<dyn FnMut() + '_>| {
        let started = Instant::now();
        (0..frames).for_each(|_| frame());
        started.elapsed().as_secs_f64() * 1e6 / f64::from(frames)
    };
    let direct = mean_us(Box::new(|| drop(here.frame(&request()))));
    let hosted = mean_us(Box::new(|| drop(there.frame(request()))));
    println!(
        "a graph takes {direct:.1} us, {hosted:.1} us from its own thread: {:.0} and {:.0} a second",
        1e6 / direct,
        1e6 / hosted
    );
}
