//! Simulated laps that are asked for again.

use std::collections::VecDeque;
use std::sync::Mutex;

use sim::Setting;

use super::atlas::{Extent, Simulate};
use super::observed::ObservedRun;

/// Data sets that are kept: a search goes on from where it was a moment ago. Of 80 laps and 100 gates they take 64 MB.
const KEPT: usize = 256;

/// Why the lock of a list is not poisoned.
pub(super) const NO_PANIC: &str = "no thread panics while it holds the list";

/// A simulated data set.
struct Known {
    effects: Vec<Setting>,
    set: u64,
    extent: Extent,
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
    pub(super) fn simulate(&self, effects: &[Setting], set: u64, extent: Extent) -> Option<Vec<ObservedRun>> {
        let is_it = |known: &&Known| (known.set, known.extent) == (set, extent) && known.effects == effects;
        if let Some(known) = self.known().iter().find(is_it) {
            return known.runs.clone();
        }
        let runs = (self.simulate)(effects, set, extent);
        let mut known = self.known();
        if known.len() == KEPT {
            known.pop_front();
        }
        known.push_back(Known {
            effects: effects.to_vec(),
            set,
            extent,
            runs: runs.clone(),
        });
        runs
    }

    fn known(&self) -> std::sync::MutexGuard<'_, VecDeque<Known>> {
        self.known.lock().expect(NO_PANIC)
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
        let simulate = |_: &[Setting], set: u64, _: Extent| {
            count.fetch_add(1, Ordering::Relaxed);
            (set != 3).then(Vec::new)
        };
        let memo = Memo::new(&simulate);
        let scale = |factor: f64| [Setting::constant(find("wheel-scale").unwrap(), [factor])];
        let whole = |effects: &[Setting], set: u64| memo.simulate(effects, set, Extent::Whole);
        for _ in 0..2 {
            assert!(whole(&scale(1.1), 1).is_some() && whole(&scale(1.1), 3).is_none());
            assert!(whole(&scale(1.2), 1).is_some() && whole(&[], 1).is_some());
            assert!(memo.simulate(&[], 1, Extent::FirstRuns).is_some());
        }
        assert_eq!(count.load(Ordering::Relaxed), 5);
        (10..10 + KEPT as u64).for_each(|set| drop(whole(&[], set)));
        whole(&scale(1.1), 1);
        assert_eq!(count.load(Ordering::Relaxed), 5 + KEPT as u64 + 1);
    }
}
