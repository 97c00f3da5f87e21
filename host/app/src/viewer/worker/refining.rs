//! Pictures that get better from frame to frame. Each frame is drawn when nothing else is to be done, so
//! that a picture that is there keeps none waiting that is not, and several get better in turn.

use super::Worker;
use super::making::{Frames, shot};
use crate::viewer::darkroom::{News, Order, Place, Print, Shot};
use anyhow::anyhow;
use std::time::{Duration, Instant};

/// Time between two frames of a picture that are shown: showing one costs, too.
const BETWEEN_SHOWN: Duration = Duration::from_millis(50);

/// Frames of other pictures in between after which a picture begins anew: the engine drops what a
/// graph left on the device after 64.
const MOST_BETWEEN: u64 = 60;

/// Time after a picture of something in motion in which the device is kept free for the next one.
const MOTION: Duration = Duration::from_millis(150);

/// A picture that gets better.
pub(super) struct Refining {
    place: Place,
    /// Frames of it that are drawn: the index of the next one.
    n_frames: u32,
    /// When a frame of it was shown last.
    shown: Instant,
    /// [`Worker::n_drawn`] after its last frame.
    n_drawn: u64,
}

impl Worker {
    /// Has a picture that was just told refined, where that is wanted.
    pub(super) fn refine_on(&mut self, place: Place, order: &Order, shot: &Shot) {
        let now = Instant::now();
        if order.moves {
            self.moved = Some(now);
        } else if shot.refines {
            let (n_frames, n_drawn) = (shot.n_frames, self.n_drawn);
            self.refining.push_back(Refining { place, n_frames, shown: now, n_drawn });
        }
    }

    /// Does not refine the picture at a place any more.
    pub(super) fn leave_unrefined(&mut self, place: Place) {
        self.refining.retain(|refining| refining.place != place);
    }

    /// Has all pictures begin anew: what their frames left on the device is gone.
    pub(super) fn refine_anew(&mut self) {
        self.refining.iter_mut().for_each(|refining| refining.n_frames = 0);
    }

    /// From when on a picture may be refined, where there is one.
    pub(super) fn refines_from(&self) -> Option<Instant> {
        let now = Instant::now();
        (!self.refining.is_empty()).then(|| self.moved.map_or(now, |moved| moved + MOTION))
    }

    /// Draws the next frame of the picture that has waited for the longest time.
    pub(super) fn refine(&mut self) {
        let Some(mut refining) = self.refining.pop_front() else { return };
        let place = refining.place;
        let Some(in_use) = self.in_use.get(&place) else { return };
        let (serial, renderer) = (in_use.order.serial, in_use.name.clone());
        if self.n_drawn - refining.n_drawn > MOST_BETWEEN {
            refining.n_frames = 0;
        }
        let outcome = match self.next_frame(&refining) {
            Ok((n_frames, refines, shot)) => {
                if refines {
                    let shown = if shot.is_some() { Instant::now() } else { refining.shown };
                    let n_drawn = self.n_drawn;
                    self.refining.push_back(Refining { place, n_frames, shown, n_drawn });
                }
                let Some(shot) = shot else { return };
                Ok(shot)
            }
            Err(error) => Err(format!("{error:#}")),
        };
        self.teller.tell(News::Counters(self.studio.engine.counters()));
        self.teller.tell(News::Print(Box::new(Print { place, serial, renderer, outcome })));
    }

    /// Draws the next frame: how many there are, whether another one would change the picture, and the
    /// picture where it is the last one or none was shown for a while.
    fn next_frame(&mut self, refining: &Refining) -> anyhow::Result<(u32, bool, Option<Shot>)> {
        let started = Instant::now();
        let here = self.in_use.remove(&refining.place);
        let mut in_use = here.ok_or_else(|| anyhow!("nothing is drawn there any more"))?;
        if let Err(barred) = self.conduct.check(&in_use.reference) {
            self.in_use.insert(refining.place, in_use);
            return Err(barred.into());
        }
        let order = in_use.order.clone();
        let drawn = self.render(&mut in_use.view, &order, Frames::One(refining.n_frames));
        let result = match drawn {
            Ok((settled, explained)) => {
                let refines = settled.refines();
                // However many pictures there are, as many frames are shown in all.
                let others = u32::try_from(self.refining.len()).unwrap_or(u32::MAX);
                let between = BETWEEN_SHOWN.saturating_mul(others.saturating_add(1));
                let told = !refines || refining.shown.elapsed() >= between;
                let shot = told.then(|| shot(&settled, explained, &order, started)).transpose();
                shot.map(|shot| (settled.n_frames, refines, shot))
            }
            Err(error) => self.faulted(&in_use, error),
        };
        self.in_use.insert(refining.place, in_use);
        result
    }
}
