//! Simulated laps that are asked for again.

use std::collections::VecDeque;
use std::sync::Mutex;

use sim::Setting;

use super::atlas::Simulate;
use super::observed::ObservedRun;

/// Data sets that are kept: a search goes on from where it was a moment ago. Of 80 laps and 100 gates they take 64 MB.
const KEPT: usize = 256;

/// A simulated data set.
struct Known {
    effects: Vec<Setting>,
    set: u64,
    /// The laps of its runs; `None` where one crashes or stops.
    runs: Option<Vec<ObservedRun>>,
}

/// A simulation that remembers its latest data sets.
pub(super) struct Memo<'a> {
    simulate: &'a Simulate<'a>,
    /// Oldest first.
    known: Mutex<VecDeque<Known>>,
}

impl<'a> Memo<'a> {
    pub(super) fn new(simulate: &'a Simulate<'a>) -> Self {
        Self {
            simulate,
            known: Mutex::default(),
        }
    }

    /// One data set; see [`Simulate`].
    pub(super) fn simulate(&self, effects: &[Setting], set: u64) -> Option<Vec<ObservedRun>> {
        let is_it = |known: &&Known| known.set == set && known.effects == effects;
        if let Some(known) = self.known().iter().find(is_it) {
            return known.runs.clone();
        }
        let runs = (self.simulate)(effects, set);
        let mut known = self.known();
        if known.len() == KEPT {
            known.pop_front();
        }
        known.push_back(Known {
            effects: effects.to_vec(),
            set,
            runs: runs.clone(),
        });
        runs
    }

    fn known(&self) -> std::sync::MutexGuard<'_, VecDeque<Known>> {
        self.known
            .lock()
            .expect("no thread panics while it holds the list")
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU64, Ordering};

    use sim::find;

    use super::*;

    #[test]
    fn the_latest_data_sets_are_simulated_once() {
        let count = AtomicU64::new(0);
        let simulate = |_: &[Setting], set: u64| {
            count.fetch_add(1, Ordering::Relaxed);
            (set != 3).then(Vec::new)
        };
        let memo = Memo::new(&simulate);
        let scale = |factor: f64| [Setting::constant(find("wheel-scale").unwrap(), [factor])];
        for _ in 0..2 {
            assert!(memo.simulate(&scale(1.1), 1).is_some() && memo.simulate(&scale(1.1), 3).is_none());
            assert!(memo.simulate(&scale(1.2), 1).is_some() && memo.simulate(&[], 1).is_some());
        }
        assert_eq!(count.load(Ordering::Relaxed), 4);
        (10..10 + KEPT as u64).for_each(|set| drop(memo.simulate(&[], set)));
        memo.simulate(&scale(1.1), 1);
        assert_eq!(count.load(Ordering::Relaxed), 4 + KEPT as u64 + 1);
    }
}
