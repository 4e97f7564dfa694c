//! Simulated laps that are asked for again.

use sim::Setting;

use super::atlas::{Extent, Simulate};
use super::observed::ObservedRun;
use crate::remembered::Remembered;

/// Data sets that are kept: a search goes on from where it was a moment ago. Of 80 laps and 100 gates they take 64 MB.
const KEPT: usize = 256;

/// Effects, the number of a data set and its extent.
type Asked = (Vec<Setting>, u64, Extent);

/// A simulation that remembers its latest data sets.
pub(super) struct Memo<'a> {
    simulate: &'a Simulate<'a>,
    /// The laps of their runs; `None` where one crashes or stops.
    known: Remembered<Asked, Option<Vec<ObservedRun>>>,
}

impl<'a> Memo<'a> {
    pub(super) fn new(simulate: &'a Simulate<'a>) -> Self {
        Self {
            simulate,
            known: Remembered::new(KEPT),
        }
    }

    /// One data set; see [`Simulate`].
    pub(super) fn simulate(&self, effects: &[Setting], set: u64, extent: Extent) -> Option<Vec<ObservedRun>> {
        let is_it = |asked: &Asked| (asked.1, asked.2) == (set, extent) && asked.0 == effects;
        if let Some(runs) = self.known.find(is_it) {
            return runs;
        }
        let runs = (self.simulate)(effects, set, extent);
        self.known.keep((effects.to_vec(), set, extent), runs.clone());
        runs
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
