//! Units that fail again and again are switched off, and come back when there is reason to.

use crate::plugins::fixture::{FAULTY, PluginFolder, assert_says, faulty_bytes, replaced, request};
use std::time::Duration;
use surfelshop_api::{HostInfo, UnitKind};
use surfelshop_runtime::boundary::Fault;
use surfelshop_runtime::plugins::{Contents, PluginHealth, STRIKES, Timeouts, UnitRef, UnitState};

/// A folder with the faulty plugin, and one of its renderers.
fn shelf_and_unit(id: &str) -> (PluginFolder, UnitRef) {
    let shelf = PluginFolder::new();
    shelf.put("subject", &faulty_bytes());
    let unit = shelf.scan().find(UnitKind::Renderer, &format!("{FAULTY}/{id}")).unwrap();
    (shelf, unit)
}

/// Has an instance describe a frame, and takes down how it went.
fn frame(conduct: &mut PluginHealth, unit: &UnitRef, limit: Duration) -> Result<(), Fault> {
    let loaded = unit.load(&Timeouts::default()).unwrap();
    let patience = Timeouts { frame: limit, ..Timeouts::default() };
    let result = loaded.start(&HostInfo::default(), &patience).unwrap().frame(request());
    match &result {
        Ok(_) => conduct.succeeded(unit, loaded.contents),
        Err(fault) => drop(conduct.failed(unit, loaded.contents, fault)),
    }
    result.map(drop)
}

const LONG: Duration = Duration::from_secs(5);
const SHORT: Duration = Duration::from_millis(200);

#[test]
fn three_panics_in_a_row_switch_a_unit_off() {
    let (_shelf, unit) = shelf_and_unit("panics-in-frame");
    let mut conduct = PluginHealth::default();
    for strike in 1..=STRIKES {
        assert_eq!(conduct.check(&unit), Ok(()));
        frame(&mut conduct, &unit, LONG).unwrap_err();
        let expected = if strike < STRIKES { UnitState::Failing(strike) } else { UnitState::Off };
        assert_eq!(conduct.record(&unit).unwrap().standing, expected);
    }
    let line = conduct.check(&unit).unwrap_err().to_string();
    assert_says(&line, &["faulty/panics-in-frame", "switched off", "frame goes wrong"]);
    assert_says(&conduct.records()[0].to_string(), &["switched off: panicked at"]);
    conduct.switch_on(&unit);
    assert_eq!(conduct.check(&unit), Ok(()));
    frame(&mut conduct, &unit, LONG).unwrap_err();
    assert_eq!(conduct.check(&unit), Ok(()), "it has three more");
}

#[test]
fn other_units_of_the_file_are_not_blamed() {
    let (_shelf, unit) = shelf_and_unit("hangs-in-frame");
    let mut fine = unit.clone();
    fine.id = "fine".to_owned();
    let mut conduct = PluginHealth::default();
    frame(&mut conduct, &unit, SHORT).unwrap_err();
    assert!(conduct.check(&unit).is_err());
    assert_eq!(conduct.check(&fine), Ok(()));
    frame(&mut conduct, &fine, LONG).unwrap();
    assert_eq!(conduct.records().len(), 1);
}

/// Invariant: a unit that hangs once or fails three times in a row is off until its file changes
#[test]
fn a_missed_deadline_switches_a_unit_off_until_its_file_changes() {
    let (shelf, unit) = shelf_and_unit("hangs-in-frame");
    let mut conduct = PluginHealth::default();
    assert_eq!(frame(&mut conduct, &unit, SHORT), Err(Fault::TimedOut(SHORT)));
    let line = conduct.check(&unit).unwrap_err().to_string();
    assert_says(&line, &["faulty/hangs-in-frame", "did not answer within 0.2 s"]);
    // A build that changes nothing but the time of the file is no reason to try again.
    shelf.put("subject", &faulty_bytes());
    assert!(conduct.check(&unit).is_err());
    shelf.put("subject", &replaced(faulty_bytes(), b"version\t0.", b"version\t8."));
    assert_eq!(conduct.check(&unit), Ok(()));
    frame(&mut conduct, &unit, SHORT).unwrap_err();
    assert!(conduct.check(&unit).is_err(), "the new file hangs as well");
}

#[test]
fn only_failures_in_a_row_count() {
    let (_shelf, unit) = shelf_and_unit("fine");
    let contents = Contents::of_file(&unit.path);
    let mut conduct = PluginHealth::default();
    let fault = Fault::Error("no".to_owned());
    for _ in 0..5 {
        conduct.failed(&unit, contents, &fault);
        assert_eq!(conduct.failed(&unit, contents, &fault), UnitState::Failing(2));
        frame(&mut conduct, &unit, LONG).unwrap();
        assert_eq!(conduct.record(&unit).unwrap().standing, UnitState::Good);
    }
    let not_asked = Fault::NotAsked("late".to_owned());
    assert_eq!(conduct.failed(&unit, contents, &not_asked), UnitState::Good);
}

#[test]
fn another_instance_does_not_redeem_a_unit_that_hangs() {
    let (_shelf, unit) = shelf_and_unit("fine");
    let contents = Contents::of_file(&unit.path);
    let mut conduct = PluginHealth::default();
    conduct.failed(&unit, contents, &Fault::TimedOut(LONG));
    frame(&mut conduct, &unit, LONG).unwrap();
    assert!(conduct.check(&unit).is_err());
}

#[test]
fn units_that_cannot_be_loaded_are_switched_off_too() {
    let (_shelf, unit) = shelf_and_unit("hangs-in-describe");
    let mut conduct = PluginHealth::default();
    let error = unit.load(&Timeouts::of(SHORT)).unwrap_err();
    let fault = error.fault().expect("its code did not answer");
    conduct.failed(&unit, Contents::of_file(&unit.path), fault);
    assert!(conduct.check(&unit).is_err());
}
