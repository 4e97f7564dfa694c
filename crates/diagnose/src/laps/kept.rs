//! What settings do to the declared model that are asked for whatever the data are.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard};

use serde::{Deserialize, Serialize};
use sim::Setting;

use super::atlas::{Spent, White};
use super::simulated::Draws;
use super::trial::Trial;
use crate::remembered::NO_PANIC;

/// Actions that were simulated once and are kept with the atlas: every other data set asks for them again.
#[derive(Debug, Default)]
pub(super) struct Kept {
    known: Mutex<BTreeMap<String, Action>>,
    has_grown: AtomicBool,
}

/// What settings do, and what it took to find out.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Action {
    /// Laps simulated.
    laps: u64,
    /// A difference as in [`White`], to seven digits; `None` where the robot crashes.
    white: Option<Vec<f32>>,
}

impl Kept {
    pub(super) fn of(known: BTreeMap<String, Action>) -> Self {
        Self {
            known: Mutex::new(known),
            has_grown: AtomicBool::new(false),
        }
    }

    pub(super) fn to_map(&self) -> BTreeMap<String, Action> {
        self.known().clone()
    }

    /// Whether there are more than at first.
    pub(super) fn has_grown(&self) -> bool {
        self.has_grown.load(Ordering::Relaxed)
    }

    fn get(&self, key: &str) -> Option<Action> {
        self.known().get(key).cloned()
    }

    fn insert(&self, key: String, action: Action) {
        self.known().insert(key, action);
        self.has_grown.store(true, Ordering::Relaxed);
    }

    fn known(&self) -> MutexGuard<'_, BTreeMap<String, Action>> {
        self.known.lock().expect(NO_PANIC)
    }
}

impl Clone for Kept {
    fn clone(&self) -> Self {
        Self {
            known: Mutex::new(self.to_map()),
            has_grown: AtomicBool::new(self.has_grown()),
        }
    }
}

impl Trial<'_> {
    /// What settings do to a data set, by the same draws; `None` where the robot crashes.
    pub(super) fn kept_action(&self, settings: &[Setting], set: u64) -> Option<White> {
        let sets = set..set + 1;
        self.kept(format!("same draws {set}"), settings, |trial| {
            let found = trial.simulated_plainly(settings, sets.clone())?;
            Some(self.atlas.white(&found, &self.atlas.declared_mean(sets)))
        })
    }

    /// What settings do to the declared model's expectation, as these draws tell it.
    pub(super) fn kept_change(&self, settings: &[Setting], draws: &Draws) -> Option<White> {
        self.kept(format!("expectation {draws:?}"), settings, |trial| {
            let found = trial.simulated_by(settings, draws)?;
            Some(self.atlas.white(&found, &self.atlas.null))
        })
    }

    /// What is known, or else found and then known. It counts as spent each time: how often a model was traced changes no figure.
    fn kept(
        &self,
        mut key: String,
        settings: &[Setting],
        find: impl FnOnce(&Trial<'_>) -> Option<White>,
    ) -> Option<White> {
        for Setting { spec, pattern } in settings {
            key += &format!(" {} {pattern:?}", spec.name);
        }
        let action = self.atlas.kept.get(&key).unwrap_or_else(|| {
            let spent = Spent::default();
            let white = find(&Trial {
                spent: &spent,
                ..*self
            });
            let action = Action {
                laps: spent.count(),
                white: white.map(|white| white.iter().map(|&x| x as f32).collect()),
            };
            self.atlas.kept.insert(key, action.clone());
            action
        });
        self.spent.add(action.laps);
        let numbers = action.white?;
        Some(White::from_iterator(
            numbers.len(),
            numbers.into_iter().map(f64::from),
        ))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicU64;

    use sim::Vec2;

    use super::*;
    use crate::Beginning;
    use crate::laps::atlas::{Atlas, Extent, NULL_SETS, Simulate};
    use crate::laps::testing::simulated;

    /// The declared model itself on trial.
    fn trial<'a>(atlas: &'a Atlas, simulate: &'a Simulate<'a>) -> Trial<'a> {
        Trial::new(atlas, simulate, &atlas.null)
    }

    #[test]
    fn what_a_trace_asks_for_is_simulated_once_and_counts_each_time() {
        let simulations = AtomicU64::new(0);
        let counted = |effects: &[Setting], set: u64, extent: Extent| {
            simulations.fetch_add(1, Ordering::Relaxed);
            simulated(effects, set, extent)
        };
        let made = Atlas::without_effects(&counted, &[], true, &|| ()).unwrap();
        assert!(!made.has_grown());
        let aside = |mm: f64| [Setting::constant(sim::find("wheel-scale").unwrap(), [mm])];
        let asked = |atlas: &Atlas| {
            let before = simulations.load(Ordering::Relaxed);
            let trial = trial(atlas, &counted);
            let found = (
                trial.kept_action(&aside(2.0), 0),
                trial.kept_change(&aside(2.0), &Draws::Sets(0..3)),
            );
            let crashed = (
                trial.kept_action(&aside(1000.0), 0),
                trial.kept_change(&aside(1000.0), &Draws::Sets(0..3)),
            );
            assert_eq!(crashed, (None, None));
            (found, simulations.load(Ordering::Relaxed) - before)
        };
        let (first, simulated) = asked(&made);
        let (action, change) = (first.0.as_ref().unwrap(), first.1.as_ref().unwrap());
        assert!(made.has_grown() && simulated > 0);
        // By the same draws a shift is told as it is; by others within the error of 15 laps in 40 numbers.
        let shift = |white: &White| white.rows(0, made.layout.lap).norm();
        assert!((shift(change) / shift(action) - 1.0).abs() < 0.1);
        let read = Atlas::from_bytes(&made.to_bytes(), 0.004).unwrap();
        assert_eq!(asked(&read), (first, 0));
        assert!(!read.has_grown());
        assert_eq!(read.spent(), made.spent());
    }

    #[test]
    fn first_runs_stand_for_all_and_count_for_themselves() {
        let made = Atlas::without_effects(&simulated, &[], true, &|| ()).unwrap();
        let trial = trial(&made, &simulated);
        let aside = [Setting::constant(sim::find("wheel-scale").unwrap(), [2.0])];
        let before = made.spent();
        let found = trial.simulated_by(&aside, &Draws::FirstRuns(7)).unwrap();
        assert_eq!(made.spent() - before, 5);
        let whole = simulated(&aside, 7, Extent::Whole).unwrap();
        let first = made.observed(&whole).unwrap().0.remove(0).means.remove(0);
        assert_eq!(found.0[0].means.len(), 2);
        for mean in &found.0[0].means {
            assert!((mean - &first).amax() < 1e-9);
        }
    }

    #[test]
    fn first_runs_do_not_stand_for_others_whose_beginning_alone_is_known() {
        let second_begins = |effects: &[Setting], set: u64, extent: Extent| {
            let mut runs = simulated(effects, set, extent)?;
            let mut stream = sim::Streams { seed: set, run: 1 }.open("beginning");
            if let Some(second) = runs.get_mut(1) {
                let path: Vec<(f64, Vec2)> = (0..32)
                    .map(f64::from)
                    .map(|step| (0.064 * step, Vec2::X * (0.006 * step + 1e-3 * stream.normal())))
                    .collect();
                second.beginning = Beginning::of(&path);
            }
            Some(runs)
        };
        let made = Atlas::without_effects(&second_begins, &[], true, &|| ()).unwrap();
        let trial = trial(&made, &second_begins);
        let aside = [Setting::constant(sim::find("wheel-scale").unwrap(), [2.0])];
        let found = trial.simulated_by(&aside, &Draws::FirstRuns(7)).unwrap();
        assert_eq!(made.white(&found, &made.null).len(), made.layout.len());
    }

    #[test]
    fn as_few_data_sets_are_simulated_as_tell_enough() {
        let made = Atlas::without_effects(&simulated, &[], true, &|| ()).unwrap();
        assert_eq!(made.spent(), NULL_SETS * 10);
        let sets = |aside_mm: f64, error: f64| {
            let aside = [Setting::constant(sim::find("wheel-scale").unwrap(), [aside_mm])];
            let found = made.simulated_until(&simulated, &aside, 0..3, error, &made.spent);
            found.unwrap().summaries.len()
        };
        // Draws that do the same to the declared model tell all; others nothing, of which each of n data sets leaves 1 / n.
        assert_eq!((sets(2.0, 0.12), sets(200.0, 0.12)), (1, 3));
        assert_eq!((sets(200.0, 0.5), sets(200.0, 1.0)), (2, 1));
        assert_eq!(made.spent(), (NULL_SETS + 1 + 3 + 2 + 1) * 10);
    }
}
