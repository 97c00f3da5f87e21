//! Tests of how all work of this crate tells its progress and stops. They count questions and look
//! at fractions; how long anything takes decides nothing.

use super::*;
use crate::neighbours::Neighbours;
use crate::samples::{Random, grid, random_sphere, spiral_sphere};
use crate::{normals, radii, spread, thinning};
use glam::{DVec3, Vec3};
use std::cell::{Cell, RefCell};
use std::sync::Mutex;
use std::sync::mpsc::channel;

/// Work under test, on a cloud.
type Work = fn(&[Vec3], Progress<'_>) -> Result<(), Cancelled>;

/// All that tells its progress.
const ALL: [(&str, Work); 4] = [
    ("neighbours", |positions, progress| Neighbours::build(positions, progress).map(drop)),
    ("normals", |positions, progress| normals::estimate(positions, 16, progress).map(drop)),
    ("radii", |positions, progress| radii::estimate(positions, positions, progress).map(drop)),
    ("repair", repair),
];

/// What sorts and counts, so that a million points take a second or two.
const QUICK: [(&str, Work); 4] = [
    ("apart", |positions, progress| spread::apart(positions, 0.1, 1, progress).map(drop)),
    ("evenly", |positions, progress| {
        let count = positions.len() / 3;
        spread::evenly(positions, count, 12.0, 1, progress).map(drop)
    }),
    ("cubes", |positions, progress| {
        let edge = thinning::edge_for(positions, positions.len() / 5, progress)?;
        thinning::one_per_cube(positions, edge, &silent).map(drop)
    }),
    ("one per cube", |positions, progress| {
        thinning::one_per_cube(positions, 0.1, progress).map(drop)
    }),
];

/// Repairs normals that are zero in one half, and holds that they change only where that is done.
fn repair(positions: &[Vec3], progress: Progress<'_>) -> Result<(), Cancelled> {
    let neighbours = Neighbours::build(positions, &silent)?;
    let given: Vec<Vec3> =
        positions.iter().map(|&p| if p.x > 0.0 { p } else { Vec3::ZERO }).collect();
    let mut repaired = given.clone();
    let result = normals::repair(&neighbours, &mut repaired, 4, progress);
    assert_eq!(result.is_err(), repaired == given);
    result.map(drop)
}

/// The fractions that are reported.
fn reported(work: Work, positions: &[Vec3]) -> Vec<f64> {
    let reported = RefCell::new(Vec::new());
    let progress = |fraction: f64| {
        reported.borrow_mut().push(fraction);
        ControlFlow::Continue(())
    };
    work(positions, &progress).unwrap();
    reported.into_inner()
}

#[test]
fn work_stops_at_every_question_and_asks_no_other() {
    let positions = spiral_sphere(300, 0.2, 1);
    for (name, work) in ALL.into_iter().chain(QUICK) {
        let mut stop_at = 0;
        loop {
            stop_at += 1;
            let count = Cell::new(0);
            let progress = |_: f64| {
                count.set(count.get() + 1);
                if count.get() < stop_at {
                    ControlFlow::Continue(())
                } else {
                    ControlFlow::Break(())
                }
            };
            let result = work(&positions, &progress);
            // The number of questions is not always the same: see `aside`.
            if count.get() < stop_at {
                assert_eq!(result, Ok(()), "{name}");
                break;
            }
            assert_eq!((result, count.get()), (Err(Cancelled), stop_at), "{name}");
        }
        assert!(stop_at > 5, "{name} asked {stop_at} times");
    }
}

#[test]
fn fractions_rise_from_zero_to_one() {
    let far: Vec<Vec3> = spiral_sphere(50, 0.0, 2).iter().map(|&p| p + Vec3::X * 9.0).collect();
    let sphere = spiral_sphere(5000, 0.2, 3);
    let clouds = [
        vec![],
        vec![Vec3::ONE],
        vec![Vec3::NAN; 9],
        vec![Vec3::ONE; 9],
        grid(30, Vec3::X, Vec3::Y),
        [sphere, far].concat(),
    ];
    for (name, work) in ALL[..3].iter().chain(&QUICK) {
        for positions in &clouds {
            let reported = reported(*work, positions);
            assert!(reported.windows(2).all(|pair| pair[0] <= pair[1]), "{name}: {reported:?}");
            // Without points most steps are done when they begin.
            let (first, last) = (reported[0], reported[reported.len() - 1]);
            assert!((0.0..0.1).contains(&first), "{name}: {first}");
            // A sum of shares may miss one by rounding.
            assert!(last <= 1.0 && last > 1.0 - 1e-12, "{name}: {last}");
        }
    }
}

#[test]
fn no_stage_of_the_work_is_silent() {
    // One thread, for which blocks are smallest: their number is that of the points alone.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let positions = random_sphere(100_000, DVec3::ZERO, 1.0, 4);
    pool.install(|| {
        for (name, work) in ALL {
            let reported = reported(work, &positions);
            let widest = reported.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
            // So many points are sorted at once, which is a fifth of the search structure, and that is
            // a tenth of an estimate that builds its own. Repairing leaves out the rounds that it does not need.
            let most = match name {
                "neighbours" => 0.25,
                "repair" => 0.4,
                _ => 0.055,
            };
            assert!(widest < most, "{name}: {widest}");
        }
    });
}

#[test]
fn values_are_sorted_whatever_their_order_before() {
    let mut random = Random::new(5);
    let count = 3 * SORTED + 17;
    let of = |value: &mut dyn FnMut(usize) -> u32| -> Vec<(u32, u32)> {
        (0..count).map(|i| (value(i), i as u32)).collect()
    };
    let cases = [
        of(&mut |_| (random.unit() * 1e9) as u32),
        of(&mut |i| i as u32),
        of(&mut |i| (count - i) as u32),
        of(&mut |i| (i % 1024) as u32),
        of(&mut |_| 7),
        vec![],
        vec![(3, 0), (1, 1), (2, 2)],
    ];
    for values in cases {
        let mut expected = values.clone();
        expected.sort_unstable();
        assert!(sort(values, &silent).unwrap().concat() == expected);
    }
}

#[test]
fn work_done_aside_is_told_of_on_the_callers_thread() {
    let (end, ended) = channel();
    let ended = Mutex::new(ended);
    let reported = RefCell::new(Vec::new());
    let caller = thread::current().id();
    let progress = |fraction: f64| {
        assert_eq!(thread::current().id(), caller);
        reported.borrow_mut().push(fraction);
        if reported.borrow().len() == 5 {
            end.send(()).unwrap();
        }
        ControlFlow::Continue(())
    };
    let work = move || {
        ended.lock().unwrap().recv().unwrap();
        thread::current().id()
    };
    let worker = aside(&progress, Duration::from_millis(100), work).unwrap();
    assert_ne!(worker, caller);
    let reported = reported.into_inner();
    assert!(
        reported.len() >= 6 && reported.windows(2).all(|pair| pair[0] < pair[1]),
        "{reported:?}"
    );
    assert_eq!((reported[0], reported[reported.len() - 1]), (0.0, 1.0));
}

#[test]
fn work_done_aside_is_left_behind_on_a_wish_to_stop() {
    let (end, ended) = channel::<()>();
    let ended = Mutex::new(ended);
    let count = Cell::new(0);
    let progress = |_: f64| {
        count.set(count.get() + 1);
        if count.get() < 3 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    };
    // The work ends only after this function has let go of it.
    let work = move || ended.lock().unwrap().recv().is_ok();
    assert_eq!(aside(&progress, Duration::ZERO, work), Err(Cancelled));
    assert_eq!(count.get(), 3);
    drop(end);
}

#[test]
fn work_that_fails_aside_fails_here() {
    let caller = thread::current().id();
    let work = move || assert_eq!(thread::current().id(), caller, "the work needs this thread");
    assert_eq!(aside(&silent, Duration::ZERO, work), Ok(()));
}
