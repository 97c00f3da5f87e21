//! How runs end: the cloud is as it was unless the tool did its work.

use crate::tools::fixture::{CANCEL, cloud, end, generations, options, start, tool, values};
use std::time::{Duration, Instant};
use surfelshop_api::params::{Value, Values};
use surfelshop_runtime::boundary::Fault;
use surfelshop_runtime::plugins::{PluginHealth, UnitState};
use surfelshop_runtime::tools::{Ended, Running};

/// Waits until a tool has done this share of its work.
#[track_caller]
fn wait_for(running: &mut Running, share: f64) {
    let started = Instant::now();
    while running.progress().fraction < share {
        assert!(started.elapsed() < Duration::from_secs(60), "{:?}", running.progress());
        let ended = running.wait(Duration::from_millis(5));
        assert!(ended.is_none(), "{ended:?}");
    }
}

/// Runs a tool that fails, and returns how.
#[track_caller]
fn fault(id: &str) -> Fault {
    let cloud = cloud(100);
    let before = generations(&cloud);
    let ended = end(start(id, &Values::new(), &cloud, &options()));
    assert_eq!(generations(&cloud), before);
    match ended {
        Ended::Failed(fault) => fault,
        other => panic!("{other:?}"),
    }
}

#[test]
fn cancelled_in_the_middle_nothing_is_changed() {
    let cloud = cloud(100);
    let before = generations(&cloud);
    // Ten seconds of work on each of two threads, in ranges of a sixth of a second.
    let pace = values([("items", Value::Int(8000)), ("milliseconds", Value::Int(3))]);
    let mut running = start(
        "works-slowly",
        &pace,
        &cloud,
        &surfelshop_runtime::tools::ToolOptions { threads: 2, ..options() },
    );
    wait_for(&mut running, 0.1);
    let progress = running.progress();
    assert_eq!(progress.message, "sleeping");
    assert!(progress.left.is_some() || progress.elapsed < Duration::from_secs(2), "{progress:?}");
    running.cancel();
    // It stops well within its patience, or it would have been left behind.
    assert!(matches!(end(running), Ended::Cancelled));
    assert_eq!(generations(&cloud), before);
}

#[test]
fn a_tool_that_does_not_stop_is_left_behind_and_switched_off() {
    for id in ["ignores-cancel", "hangs-in-loop"] {
        let cloud = cloud(1000);
        let before = generations(&cloud);
        let mut running = start(id, &Values::new(), &cloud, &options());
        // No deadline while nobody asks it to stop.
        assert!(running.wait(Duration::from_millis(200)).is_none());
        running.cancel();
        let ended = end(running);
        assert!(matches!(ended, Ended::LeftBehind(CANCEL)), "{ended:?}");
        assert_eq!(generations(&cloud), before);
        let (reference, unit) = tool(id);
        let mut conduct = PluginHealth::default();
        let standing = conduct.failed(&reference, unit.contents, &ended.fault().unwrap());
        assert_eq!(standing, UnitState::Off);
        assert!(conduct.check(&reference).is_err());
        // Everything else goes on.
        let fine = end(start("stages-ao", &Values::new(), &cloud, &options()));
        assert!(matches!(fine, Ended::Done(_)), "{fine:?}");
    }
}

#[test]
fn errors_and_panics_after_an_edit_drop_it() {
    assert_eq!(fault("stages-and-fails"), Fault::Error("the tide is out".to_owned()));
    let Fault::Panic(line) = fault("panics-in-run") else { panic!("not a panic") };
    assert!(line.contains("run goes wrong"), "{line}");
}

#[test]
fn an_edit_that_does_not_fit_is_refused_with_the_reason() {
    let expected = "column `ao`: expected 100 values, found 101";
    assert_eq!(fault("wrong-length-edit"), Fault::Error(expected.to_owned()));
}
