//! Undo and redo: earlier states of whatever is edited.

/// States before and after the current one.
#[derive(Clone, Debug)]
pub(crate) struct History<T> {
    past: Vec<T>,
    future: Vec<T>,
    settled: T,
}

/// Steps that can be undone.
const MOST_STEPS: usize = 200;

impl<T: Clone + PartialEq> History<T> {
    /// A history that begins here.
    pub(crate) fn new(now: T) -> Self {
        Self { past: Vec::new(), future: Vec::new(), settled: now }
    }

    /// Takes note of the current state. Called while nothing is being dragged, so that a drag of
    /// a slider is one step.
    pub(crate) fn note(&mut self, now: &T) {
        if *now == self.settled {
            return;
        }
        self.past.push(std::mem::replace(&mut self.settled, now.clone()));
        if self.past.len() > MOST_STEPS {
            self.past.remove(0);
        }
        self.future.clear();
    }

    /// Whether there is a state to go back to.
    pub(crate) fn can_undo(&self) -> bool {
        !self.past.is_empty()
    }

    /// Whether there is a state to go forward to.
    pub(crate) fn can_redo(&self) -> bool {
        !self.future.is_empty()
    }

    /// The state before; `None` where there is none.
    pub(crate) fn undo(&mut self) -> Option<T> {
        let before = self.past.pop()?;
        self.future.push(std::mem::replace(&mut self.settled, before));
        Some(self.settled.clone())
    }

    /// The state that was undone last; `None` where there is none.
    pub(crate) fn redo(&mut self) -> Option<T> {
        let after = self.future.pop()?;
        self.past.push(std::mem::replace(&mut self.settled, after));
        Some(self.settled.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_undone_and_redone_in_order() {
        let mut history = History::new(0);
        for state in [1, 1, 2, 3] {
            history.note(&state);
        }
        assert_eq!((history.undo(), history.undo()), (Some(2), Some(1)));
        assert_eq!(history.redo(), Some(2));
        history.note(&7);
        assert!(!history.can_redo());
        assert_eq!((history.undo(), history.undo(), history.undo()), (Some(2), Some(1), Some(0)));
        assert_eq!(history.undo(), None);
    }

    #[test]
    fn only_the_last_steps_are_kept() {
        let mut history = History::new(0);
        for state in 1..=1000 {
            history.note(&state);
        }
        let mut n_steps = 0;
        while history.undo().is_some() {
            n_steps += 1;
        }
        assert_eq!(n_steps, MOST_STEPS);
    }
}
